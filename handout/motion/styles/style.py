"""Handstyles as files: `styles/*.toml` read into frozen, validated structs, and `.style` archives of what was learned.

The fields are documented for people who do not program in `docs/styles.md`.  Lengths are shares of the height of a
letter, so that a style looks the same at every size; angles are as seen, anticlockwise from the line of writing.
"""

from __future__ import annotations

import difflib
import math
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import msgspec

from handout import shipped, tables
from handout.errors import InputError
from handout.motion.learned.model import LearnedMovement
from handout.motion.learned.sequences import MovementSequence
from handout.motion.styles import style_file
from handout.tables import Angle, Table, Time


class FormStyle(Table, frozen=True):
    """What is done to the letter before it is moved through.

    shear: of the upright; stretch: widths times this; overshoot: how far targets lie beyond the curve's own, 1 for a
    movement through its extremes, 0 for one that cuts them, more for one that swings past them.
    """

    shear: Angle = Angle(0.0)
    stretch: float = 1.0
    overshoot: float = 1.0


class MovementStyle(Table, frozen=True):
    """How the pen moves.

    smooth: smoothing time over the interval; drawn_at: the smoothing at which targets are sought that lead through
    the wanted points; order: the derivative that is the effort; interval: from one target to the next; end: the pen
    comes to "rest" or flies off ("free").
    """

    smooth: float = 0.3
    drawn_at: float = 0.3
    order: Literal[2, 3, 4, 5] = 4
    interval: Time = Time(0.09)
    end: Literal["rest", "free"] = "rest"


class Covariance(Table, frozen=True):
    """The shape that all targets share: an oblique pair of axes, and how sizes differ.

    axes: lengths of the two axes, relative to each other; angles: their directions; spread: standard deviation of
    the logarithm of the targets' sizes; corners: size at a corner of the letter, against 1 elsewhere.
    """

    axes: tuple[float, float] = (1.0, 1.0)
    angles: tuple[Angle, Angle] = (Angle(0.0), Angle(math.pi / 2))
    spread: float = 0.0
    corners: float = 1.0


class Guides(Table, frozen=True):
    """What the velocity is led along, or avoids: see `handout.motion.tracker`."""

    mode: Literal["none", "along", "avoid"] = "none"
    direction: Angle = Angle(0.0)
    strength: float = 0.0


class Breaking(Table, frozen=True):
    """Curves broken into straight strokes.

    directions: those that strokes may have, none for curves as they are; least: length of the shortest stroke; foot:
    length of the slanting step that begins and ends an upright; step: its direction.
    """

    directions: tuple[Angle, ...] = ()
    least: float = 0.1
    foot: float = 0.0
    step: Angle = Angle(-0.7)


class Flick(Table, frozen=True):
    """How far beyond its ends a stroke reaches, along its direction there: entry and exit."""

    entry: float = 0.0
    exit: float = 0.0


class LigatureStyle(Table, frozen=True):
    """Strokes that are joined.

    reach: greatest distance from the end of one to the start of the next that is joined, 0 for none; turn: a target
    near the join is left out where the angle that it forms with its neighbours is larger than this.
    """

    reach: float = 0.0
    turn: Angle = Angle(math.radians(100))


class BrushStyle(Table, frozen=True):
    """The pen's mark.

    kind: "round", an even line; "speed", wider where it is slower; "nib", the edge of a flat nib at `angle`;
    "pointed", which swells in strokes downwards; width: of the widest mark; thin: share of it of the thinnest, for
    "speed" and "pointed"; pace: for "speed", how gently it follows, in usual speeds of a stroke: 0.3 a lot, 3 hardly;
    taper: length over which the ends thin out.
    """

    kind: Literal["round", "speed", "nib", "pointed"] = "round"
    width: float = 0.08
    thin: float = 0.25
    angle: Angle = Angle(0.7)
    pace: float = 4.0
    taper: float = 0.0


class Jitter(Table, frozen=True):
    """Motor noise: its standard deviation at the targets, in heights of a letter."""

    size: float = 0.0


class LearnedStyle(Table, frozen=True):
    """How a learned manner is moved in; for `.style` archives.

    temperature: chance in it, 1 as in the examples; hold: how far the path is led through the places that a drawing
    passes, 0 not, 1 as far as its movement lets it; keep: share of a drawing's own bends and overlaps that stays;
    duration: of a stroke; primer: the example that primes it, "" the first.
    """

    temperature: float = 0.5
    hold: float = 1.0
    keep: float = 0.75
    duration: Time = Time(0.3)
    primer: str = ""


class Style(Table, frozen=True):
    """A handstyle; `name` is that of its file, without its suffix; `model` is what a ``.style`` has learned."""

    title: str
    form: FormStyle = FormStyle()
    movement: MovementStyle = MovementStyle()
    covariance: Covariance = Covariance()
    guide: Guides = Guides()
    breaking: Breaking = Breaking()
    flick: Flick = Flick()
    ligature: LigatureStyle = LigatureStyle()
    brush: BrushStyle = BrushStyle()
    jitter: Jitter = Jitter()
    learned: LearnedStyle = LearnedStyle()
    notes: str = ""
    name: str = ""
    model: LearnedMovement | None = None

    @property
    def primer(self) -> MovementSequence | None:
        """The example that primes a learned style, if it has any."""
        primers = {} if self.model is None else self.model.primers
        return primers.get(self.learned.primer) or next(iter(primers.values()), None)


_PLAIN = Style(title="")
_STEEPEST = math.radians(75)  # of shear
_APART = math.radians(4.5)  # between directions that are not the same
# key path → (least, greatest)
BOUNDS: dict[str, tuple[float, float]] = {
    "form.shear": (-_STEEPEST, _STEEPEST), "form.stretch": (0.2, 5), "form.overshoot": (-1, 3),
    "movement.smooth": (0.05, 1), "movement.drawn_at": (0.05, 0.5), "movement.interval": (0.005, 2),
    "covariance.spread": (0, 2), "covariance.corners": (0.05, 5), "guide.strength": (0, 10),
    "breaking.least": (0.02, 1), "breaking.foot": (0, 1), "flick.entry": (0, 3), "flick.exit": (0, 3),
    "ligature.reach": (0, 5), "ligature.turn": (0, 3.15), "brush.width": (0.002, 1), "brush.thin": (0.02, 1),
    "brush.pace": (0.01, 100), "brush.taper": (0, 3), "jitter.size": (0, 1), "learned.temperature": (0.01, 5),
    "learned.hold": (0, 1), "learned.keep": (0, 1), "learned.duration": (0.02, 5),
}  # fmt: skip


# tables by which rules move; a learned manner has no use for them
_RULES = ("movement", "covariance", "guide", "breaking", "flick", "ligature", "jitter")


def read_style(path: Path) -> Style:
    """Read and check a style's TOML file, or a ``.style`` archive.

    Raises InputError: not TOML, an unknown key, a missing unit, a value out of bounds (the message names file and key);
    or an archive that is damaged or holds no style.
    """
    if path.suffix == ".style":
        values, model = style_file.load(path)
        return _check_file(msgspec.structs.replace(of_table(values, path), model=model), path)
    style = of_table(tables.load_table(path, "a style"), path)
    if style.learned != LearnedStyle():
        raise InputError(f"{path}: [learned] is for .style archives, which handout style learn makes.")
    return style


def of_table(values: dict[str, Any], path: Path) -> Style:
    """The style of the tables of a file. Raises InputError: as `read_style`."""
    for name in ("name", "model"):
        if name in values:
            raise InputError(f"{path}: {name} cannot be set; a style is called as its file is.")
    try:
        style = tables.convert_table(values, Style)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error
    return _check_file(msgspec.structs.replace(style, name=path.stem), path)


def _check_file(style: Style, path: Path) -> Style:
    try:
        return check_style(style)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error


def check_style(style: Style) -> Style:
    """The style, if all its numbers are within their bounds. Raises ValueError: one is not."""
    tables.check_bounds(style, BOUNDS)
    if style.model is not None:
        rules = [name for name in _RULES if getattr(style, name) != getattr(_PLAIN, name)]
        if rules:
            raise ValueError(f"{rules[0]} is a rule: a learned style has its movement from its examples.")
        if style.learned.primer not in ("", *style.model.primers):
            known = ", ".join(style.model.primers)
            raise ValueError(f"learned.primer = {style.learned.primer!r} is none of its examples: {known}.")
    first, second = style.covariance.axes
    if not (min(first, second) > 0 and max(first, second) <= 100 * min(first, second)):
        raise ValueError(f"covariance.axes = {[first, second]} must be above 0, and within a hundredfold.")
    a, b = style.covariance.angles
    if abs((b - a + math.pi / 2) % math.pi - math.pi / 2) < _APART:
        raise ValueError("covariance.angles are nearly the same: two axes need different directions.")
    lines = sorted(angle % math.pi for angle in style.breaking.directions)
    if lines and (len(lines) == 1 or min(b - a for a, b in pairwise([*lines, lines[0] + math.pi])) < _APART):
        raise ValueError("breaking.directions needs two directions or more that differ, or none.")
    return style


def names() -> list[str]:
    """Names of all known styles, the user's own included."""
    return sorted(_files())


def _files() -> dict[str, Path]:
    """Name → file of all known styles; of a user's two of one name the archive."""
    return shipped.files("styles", "*.toml") | shipped.files("styles", "*.style")


def find(name: str) -> Style:
    """The style of that name, or of that TOML file or ``.style`` archive.

    Raises InputError: unknown (the message lists the nearest), or not valid.
    """
    return read_style(path(name))


def path(name: str) -> Path:
    """The file of a style that `find` finds. Raises InputError: unknown; the message lists the nearest."""
    if name.endswith((".toml", ".style")):
        return Path(name)
    styles = _files()
    if name in styles:
        return styles[name]
    near = difflib.get_close_matches(name, styles, 3, 0.5) or sorted(styles)
    raise InputError(f"style: {name!r} is neither a style nor a .toml or .style file; the nearest: {', '.join(near)}.")
