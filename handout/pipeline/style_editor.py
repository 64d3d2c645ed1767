"""A handstyle on the desk, as the studio's page Style shows it: its numbers by plain names, and what they make.

A style is a flat table here: "movement.smooth" → 0.3, angles in degrees and times in ms, as its sliders have them.
What moves is a plan of targets in the JSON of `sources.plans`, so that `handout strokes draw` makes the same of
what is saved; a word in a drawn hand shows what only letters show.
"""

from __future__ import annotations

import math
import tomllib
import typing
from collections.abc import Sequence
from dataclasses import replace
from functools import cache, lru_cache
from pathlib import Path

import numpy as np
from msgspec.structs import replace as replaced

from handout import atomic, shipped
from handout.errors import InputError, reported
from handout.motion.learned.model import LearnedMovement
from handout.motion.optimal_control import targets_through
from handout.motion.styles import restyling, style_file, target_plans, targets
from handout.motion.styles.style import BOUNDS, Style, check_style, names, of_table, read_style
from handout.motion.styles.style import path as path_of
from handout.pipeline import writing
from handout.pipeline.options import PictureOptions, SheetOptions, StyleDraft, StyleValue, WritingOptions
from handout.pipeline.results import Facts
from handout.sinks import check_outputs, write_drawings
from handout.sources import plans as target_files
from handout.tables import Angle, Time
from handout.values import Array, Drawing, Stroke

_PLAIN = Style(title="")
_ROUND_TURN = 180.0  # degrees: angles without bounds of their own go as far to either side
_LOOSE = 0.12  # heights: how large the ellipses of a style are shown where it rounds as usual; set by eye
_SHOWN = (0.03, 0.45)  # heights: the least and the greatest size at which they are shown; set by eye
_MOST_SAMPLES = 12
_FINE = 4  # digits after the point, of mm
_WORD_SHEET = SheetOptions("160x36mm", "6mm", 1)

_SAID = {
    2: "acceleration", 3: "jerk", 4: "snap", 5: "crackle", "rest": "it rests", "free": "it flies off", "none": "goes "
    "freely", "along": "is led along", "avoid": "is kept from", "round": "an even line", "speed": "wider where slower",
    "nib": "a flat nib", "pointed": "swells downwards", "": "the first example",
}  # fmt: skip


def style_of(draft: StyleDraft) -> Style:
    """A draft as a style. Raises InputError: a value that none can have; the message names its key."""
    place = Path(f"{draft.name}.style" if draft.base else f"{draft.name}.toml")
    made, model = of_table(_tables(draft), place), None
    if draft.base:
        base = path_of(draft.base)
        with reported(f"read {base}"):
            model = _model(base, base.stat().st_mtime_ns)
    try:
        return check_style(replaced(made, model=model))
    except ValueError as error:
        raise InputError(f"{place}: {error}") from error


def _tables(draft: StyleDraft) -> dict[str, typing.Any]:
    """As a file has them: nested, with units, and without what is usual anyway."""
    nested: dict[str, typing.Any] = {"title": draft.name}
    usual = plain_values(_PLAIN)
    for key, value in draft.values.items():
        table, dot, field = key.partition(".")
        if dot and value != usual.get(key):
            nested.setdefault(table, {})[field] = _with_unit(key, value)
        elif not dot and value:
            nested[key] = value
    return nested


@cache
def _groups() -> list[dict[str, typing.Any]]:
    """The groups of style_knobs.toml."""
    text = Path(__file__).with_name("style_knobs.toml").read_text(encoding="utf-8")
    return typing.cast(list[dict[str, typing.Any]], tomllib.loads(text)["groups"])


@cache
def _kind(key: str) -> typing.Any:
    """The type of a key's value; None of one that there is not."""
    table, _, field = key.partition(".")
    holder = getattr(_PLAIN, table, None)
    return typing.get_type_hints(type(holder)).get(field) if field else None


def _with_unit(key: str, value: StyleValue) -> typing.Any:
    kind = _kind(key)
    inner = typing.get_args(kind)[0] if typing.get_origin(kind) is tuple else kind
    if isinstance(value, str):
        return value
    if typing.get_origin(kind) is typing.Literal:
        return int(value) if isinstance(value, float | int) else value
    each = value if isinstance(value, Sequence) else [value]
    unit = {Angle: "deg", Time: "ms"}.get(inner)
    made = [part if unit is None else f"{part:.10g}{unit}" for part in each]
    return made if typing.get_origin(kind) is tuple else made[0]


def plain_values(style: Style) -> dict[str, StyleValue]:
    """Every key of a style and its value: numbers, degrees, ms, words, lists of numbers."""
    values: dict[str, StyleValue] = {"title": style.title, "notes": style.notes}
    for key in (knob["key"] for group in _groups() for knob in group["knobs"]):
        table, _, field = key.partition(".")
        values[key] = _plain(getattr(getattr(style, table), field))
    return values


def _plain(value: typing.Any) -> StyleValue:
    if isinstance(value, tuple):
        return [typing.cast(float, _plain(part)) for part in value]
    if isinstance(value, Angle):
        return round(math.degrees(value), 6)
    if isinstance(value, Time):
        return round(1e3 * value, 6)
    return typing.cast(StyleValue, value)


@lru_cache(maxsize=4)
def _model(place: Path, changed: int) -> LearnedMovement | None:
    return read_style(place).model


def open_style(name: str) -> Facts:
    """A style, by its name or file, with its knobs; a TOML file that is not there yet is a plain style.

    Raises InputError: there is no such style, or it is not valid.
    """
    place = path_of(name)
    begun = place.suffix == ".toml" and name.endswith(".toml") and not place.exists()
    style = Style(title=place.stem, name=place.stem) if begun else read_style(place)
    learned = style.model is not None
    shown = [group for group in _groups() if group.get("of") != ("rules" if learned else "learned")]
    return {
        "name": style.name,
        "title": style.title,
        "learned": learned,
        "values": typing.cast(Facts, plain_values(style)),
        "groups": [
            {
                "name": group["name"],
                "seen_in": group["seen_in"],
                "knobs": [_knob(style, **one) for one in group["knobs"]],
            }
            for group in shown
        ],
    }


def _knob(style: Style, key: str, label: str, ends: Sequence[float] = ()) -> Facts:
    kind, usual = _kind(key), plain_values(_PLAIN)[key]
    facts: Facts = {"key": key, "label": label, "usual": typing.cast(Facts, usual)}
    if key == "learned.primer":
        primers = [] if style.model is None else list(style.model.primers)
        return {**facts, "options": [["", _SAID[""]], *([one, one] for one in primers)]}
    if typing.get_origin(kind) is typing.Literal:
        return {**facts, "options": [[one, _SAID[one]] for one in typing.get_args(kind)]}
    angle = Angle in (kind, *typing.get_args(kind))
    factor = 180 / math.pi if angle else 1e3 if kind is Time else 1.0
    least, most = (factor * end for end in BOUNDS.get(key, (-math.pi, math.pi) if angle else (0.01, 100.0)))
    low, high = ends or (least, most)
    unit = "°" if angle else "ms" if kind is Time else ""
    bounds = {"least": round(least, 3), "most": round(most, 3), "low": round(low, 3), "high": round(high, 3)}
    count = len(typing.get_args(kind)) if typing.get_origin(kind) is tuple else 1
    return {**facts, **bounds, "unit": unit, "count": 0 if Ellipsis in typing.get_args(kind) else count}


def move_targets(plan: bytes, draft: StyleDraft, seed: int, samples: int = 0) -> Facts:
    """A plan of targets moved through in a style: strokes with their speeds, ellipses, and more by other chances.

    Raises InputError: not a plan, or not a style.
    """
    thrown, style = target_files.read_targets(plan), style_of(draft)
    drawing, followed = target_plans.draw_with_ellipses(thrown, style, np.random.default_rng(seed))
    if len(followed) and not thrown.has_ellipses:
        followed = followed * _shown_size(style, thrown) ** 2
    chances = [np.random.default_rng((seed, 1 + copy)) for copy in range(min(samples, _MOST_SAMPLES))]
    others = [target_plans.draw_plan(thrown, style, rng) for rng in chances]
    spreads = [[round(float(x), _FINE) for x in (one[0, 0], one[0, 1], one[1, 1])] for one in followed]
    return {
        "strokes": [_stroke_facts(stroke) for stroke in drawing.strokes],
        "samples": [[_line(stroke) for stroke in other.strokes] for other in others],
        "ellipses": spreads,
        "duration_s": round(drawing.duration, 3),
        "length_mm": round(drawing.pen_down, 1),
    }


def _shown_size(style: Style, plan: target_plans.TargetPlan) -> float:
    """mm over the unit of a style's covariances: looser targets make a rounder movement, as σ ~ smooth^order says.

    Source: seed 003, §3 (eq. 9) and §4.1 (fig. 8: the magnitude of the ellipses is how smooth the path is).
    """
    parts = [xy for xy, _ in plan.parts()]
    height = targets.letter_height(Drawing(tuple(Stroke(np.arange(float(len(xy))), xy) for xy in parts), plan.page))
    size = _LOOSE * (style.movement.smooth / _PLAIN.movement.smooth) ** style.movement.order
    unit = math.sqrt(math.prod(style.covariance.axes) * abs(math.sin(float(np.subtract(*style.covariance.angles)))))
    return height * float(np.clip(size, *_SHOWN)) / unit


def _line(stroke: Stroke) -> Facts:
    xy = stroke.xy.round(_FINE - 2)
    return {"x": xy[:, 0].tolist(), "y": xy[:, 1].tolist()}


def _stroke_facts(stroke: Stroke) -> Facts:
    """A stroke as the page draws it: mm, s, mm/s."""
    speed = np.zeros(len(stroke.t))
    if len(stroke.t) > 1:
        speed = np.linalg.norm(np.gradient(stroke.xy, stroke.t, axis=0), axis=1)
    facts = {**_line(stroke), "t": stroke.t.round(_FINE).tolist(), "speed": speed.round(1).tolist()}
    if stroke.width is not None:
        facts["width"] = stroke.width.round(3).tolist()
    if stroke.nib > 0 and stroke.rotation is not None:
        facts |= {"nib": round(stroke.nib, 3), "turn": round(float(stroke.rotation[0]), 4)}
    return facts


def word(text: str, hand: str, draft: StyleDraft, seed: int) -> Facts:
    """A word in a drawn hand and a style.

    Raises InputError: no such hand, a text that it cannot write, or not a style.
    """
    style, drawing = style_of(draft), _write_word(text, hand)
    styled = restyling.restyle(drawing, style, np.random.default_rng(seed))
    strokes: list[Facts] = [_stroke_facts(stroke) for stroke in styled.strokes]
    notes = restyling.losses(drawing, styled, style)
    return {"strokes": strokes, "width": drawing.page.width, "height": drawing.page.height, "notes": notes}


@lru_cache(maxsize=16)
def _write_word(text: str, hand: str) -> Drawing:
    drawing = writing.drawings(text, WritingOptions(hand, seed=1, fit=True, fallback=True), _WORD_SHEET)[0]
    if not drawing.strokes:
        raise InputError("Give a word to be written.")
    return drawing


def targets_of_word(text: str, hand: str, draft: StyleDraft) -> Facts:
    """A plan whose targets lead a style's movement through the letters of a word: something to begin with.

    Raises InputError: as `word`.
    """
    drawing, order = _write_word(text, hand), style_of(draft).movement.order
    height, parts = targets.letter_height(drawing), list[Array]()
    for stroke in drawing.strokes:
        motif = targets.find(stroke.xy, height)
        points = np.concatenate([motif.points, motif.points[:1]]) if motif.ring else motif.points
        parts.append(targets_through(points, smooth=_PLAIN.movement.drawn_at, order=order))
    low = np.concatenate(parts).min(axis=0)
    span = np.concatenate(parts).max(axis=0) - low
    page = np.array([148.0, 105.0])  # A6 across
    scale = float((0.8 * page / np.maximum(span, 1e-6)).min())
    placed = [(part - low) * scale + (page - scale * span) / 2 for part in parts]
    ends = np.cumsum([len(part) for part in placed]) - 1
    return {
        "targets": np.concatenate(placed).round(2).tolist(),
        "pen_up": ends[:-1].tolist(),
        "page": {"width": float(page[0]), "height": float(page[1])},
    }


def keep_movement(plan: bytes, draft: StyleDraft, seed: int, output: Path) -> Facts:
    """Write what is on the desk: a drawing, as `handout strokes draw` writes it, or the style (.toml or .style).

    Raises InputError: not a plan, not a style, or a file that cannot be written.
    """
    style = style_of(draft)
    if output.suffix in (".toml", ".style"):
        atomic.write(output, _style_bytes(draft))
    else:
        check_outputs([output])
        drawing = target_plans.draw_plan(target_files.read_targets(plan), style, np.random.default_rng(seed))
        drawing = replace(drawing, about={**drawing.about, "seed": seed})
        write_drawings([drawing], [output], PictureOptions().look(styled=True))
    return {"files": [str(output)]}


def _style_bytes(draft: StyleDraft) -> bytes:
    model, text = style_of(draft).model, style_file.to_toml(_tables(draft))
    return text.encode() if model is None else style_file.to_bytes(text, model)


def save_style(draft: StyleDraft, place: str | None = None, *, replace_: bool = False) -> Facts:
    """Keep a style, by its name among the user's own, or in the file that was opened.

    Raises InputError: not a style; one of that name is there, and is not to be replaced; or it cannot be written.
    """
    data = _style_bytes(draft)
    if place is None:
        home = shipped.user_folder("styles")
        kinds = (".style", ".toml") if draft.base else (".toml", ".style")
        path, other = (home / f"{draft.name}{kind}" for kind in kinds)
        if other.exists():  # of two of one name one would never be found again
            raise InputError(f"{draft.name} is the name of a style of another kind: give another.")
        if draft.name in names() and not path.exists():
            raise InputError(f"{draft.name} is the name of a style that comes with the program: give another.")
        if path.exists() and not replace_:
            raise InputError(f"There is a style {draft.name} already.")
        home.mkdir(parents=True, exist_ok=True)
    else:
        path = Path(place)
        if (path.suffix == ".style") != bool(draft.base):
            raise InputError(f"{path.name} is of another kind than this style: save it by another name.")
    atomic.write(path, data)
    return {"name": path.stem, "file": str(path)}
