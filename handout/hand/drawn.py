"""Drawn hands: a TOML file of points on the curve, read into a `Hand`; and such a hand written in haste or with care.

The file holds every form once.  What follows from a form by rule is derived here: the ways into a joined letter
(from the baseline, from a high exit, or with the pen lifted), and how its last stroke ends at the end of a word.
The format is described for people who draw in `docs/drawing-a-hand.md`.

Haste makes a hand quicker, larger in breadth and smaller in height, more slanted and more joined; it rounds what it
passes, its words flatten towards their ends, and their last strokes trail off.  Care does the opposite.  The
directions are those of writing speeded up on request; the amounts are this project's, set by looking.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import ClassVar, Literal

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from handout.errors import InputError
from handout.hand.diacritics import DOTLESS, NAMES
from handout.hand.protocol import Repertoire
from handout.summary import as_svg, one_line
from handout.tables import load_table
from handout.values import Array, Glyph, readonly

_HOUSE = Path(__file__).resolve().parent / "house"
_PLACES = frozenset({"start", "middle", "end", "alone"})
_LAST_PLACES = frozenset({"end", "alone"})
_HIGH_EXIT_KEPT = 0.72  # share of a high exit stroke that is written at the end of a word
# key → (least, greatest)
_BOUNDS = {
    "slant": (-2, 2),
    "smooth": (0.05, 1),
    "drawn_at": (0.05, 1),
    "interval": (0.005, 2),
    "word_space": (0.1, 5),
    "pitch": (1, 20),
    "variation": (0, 3),
    "breadth": (0.3, 3),
}
FURTHEST = 100  # x-heights from a letter's origin to anything of it, and its greatest width; set by eye
_FAVOUR = 1.0  # of a form drawn for its place in the word over one for any place
_NEVER = 6.0  # reluctance of a lift that the hand does not make


class DerivedForms(Mapping[str, tuple[Glyph, ...]]):
    """The glyphs of some letters, derived when a letter is first asked for: a text has few of a hand's."""

    def __init__(self, letters: Iterable[str], derive: Callable[[str], tuple[Glyph, ...]]) -> None:
        self._derive = derive
        self._glyphs: dict[str, tuple[Glyph, ...] | None] = dict.fromkeys(letters)

    def __getitem__(self, letter: str) -> tuple[Glyph, ...]:
        glyphs = self._glyphs[letter]
        if glyphs is None:
            glyphs = self._glyphs[letter] = self._derive(letter)
        return glyphs

    def __contains__(self, letter: object) -> bool:
        return letter in self._glyphs

    def __iter__(self) -> Iterator[str]:
        return iter(self._glyphs)

    def __len__(self) -> int:
        return len(self._glyphs)


@dataclass(frozen=True, eq=False)
class Hand:
    """How one person writes; read-only.

    glyphs : the forms of every character that has forms of its own.
    marks : accents by combining character: glyphs relative to the centre of an x-height letter.
    slant : tangent of the slant.
    smooth : see ActionPlan.
    drawn_at : the smoothing at which the points of the glyphs lie on the curve.
    delayed_after : dots, bars and accents are written after the "word" or after their "letter".
    interval : s of motor time a point at the hand's own pace.
    word_space : gap between words, x-heights.
    pitch : distance of lines, x-heights.
    x_height : usual height of a small letter, mm.
    variation : how much the letters of this hand vary, 1 is usual.
    fading : share of their height that letters lose towards the end of a word, as a hurried hand's do.
    languages : code of a language → its own forms of some letters.
    """

    name: str
    title: str
    glyphs: Mapping[str, tuple[Glyph, ...]]
    marks: Mapping[str, tuple[Glyph, ...]]
    slant: float
    smooth: float
    drawn_at: float
    delayed_after: str
    interval: float
    word_space: float
    pitch: float
    x_height: float = 2.5
    variation: float = 1.0
    fading: float = 0.0
    languages: Mapping[str, Mapping[str, tuple[Glyph, ...]]] = field(default_factory=dict)

    pages: ClassVar[None] = None

    __repr__, _repr_svg_ = one_line, as_svg

    @cached_property
    def letters(self) -> Mapping[str, int]:
        """How many glyphs there are of each character."""
        return {letter: len(glyphs) for letter, glyphs in self.glyphs.items()}

    @cached_property
    def repertoire(self) -> Repertoire:
        """What it can write."""
        return Repertoire(self.name, frozenset(self.glyphs), frozenset(self.marks) | {DOTLESS})

    def x_height_on(self, spacing: float, usual: float) -> float:
        return usual * spacing

    def with_language(self, code: str) -> Hand:
        own = self.languages.get(code.replace("_", "-").partition("-")[0].lower(), {})
        local = DerivedForms([*self.glyphs, *own], lambda letter: own[letter] if letter in own else self.glyphs[letter])
        return replace(self, glyphs=local) if own else self

    def with_haste(self, haste: float) -> Hand:
        if not -1 <= haste <= 1:
            raise InputError(f"haste: {haste:g} is outside -1 (careful) to 1 (hurried).")
        if haste == 0:
            return self
        shape = np.diag(np.exp([_BREADTH * haste, _HEIGHT * haste]))
        return replace(
            self,
            glyphs=DerivedForms(self.glyphs, partial(_hastened_letter, self.glyphs, shape, haste)),
            marks={mark: tuple(_hasten_glyph(g, shape, 0.0) for g in glyphs) for mark, glyphs in self.marks.items()},
            smooth=self.smooth + (_SMOOTH if haste > 0 else _SMOOTH_CARE) * haste,
            interval=self.interval * float(np.exp(-_PACE * haste)),
            slant=self.slant + _SLANT * haste,
            word_space=self.word_space * float(np.exp(_BREADTH * haste)),
            variation=self.variation * float(np.exp(_VARIATION * haste)),
            fading=max(0.0, self.fading + _FADING * haste),
        )


class _Form(msgspec.Struct, forbid_unknown_fields=True):
    width: float
    pen: str
    late: str = ""
    in_: str = msgspec.field(default="lifted", name="in")
    out: Literal["low", "high", "lifted"] = "lifted"
    at: str = ""
    after: str = ""
    before: str = ""
    end: str = ""
    cut: int = 0
    weight: float = 1.0


class _Entry(msgspec.Struct, forbid_unknown_fields=True):
    low: list[str] = []
    high: list[str] = []
    lifted: list[str] = []
    lift: float = 0.0


_LettersOfFile = dict[str, list[_Form] | str]


class _LettersFile(msgspec.Struct, forbid_unknown_fields=True):
    letters: _LettersOfFile
    languages: dict[str, _LettersOfFile] = {}


class _DrawnFile(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    title: str
    slant: float
    smooth: float
    interval: float
    word_space: float
    pitch: float
    letters: _LettersOfFile
    marks: dict[str, list[_Form]]
    drawn_at: float | None = None
    breadth: float = 1.0
    variation: float = 1.0
    late: Literal["word", "letter"] = "word"
    endings: list[tuple[float, float]] = []
    entries: dict[str, _Entry] = {}
    also: list[str] = []
    languages: dict[str, _LettersOfFile] = {}


def read_drawn_hand(path: Path) -> Hand:
    """Read a drawn hand.

    Raises InputError: not TOML, an unknown key, an entry that is not defined, or points that are not numbers.
    """
    try:
        file = msgspec.convert(load_table(path, "a drawn hand"), _DrawnFile)
    except msgspec.ValidationError as error:
        raise InputError(f"{path}: cannot be read as a drawn hand: {error}.") from error
    _add_scripts(path, file)
    for key, (least, greatest) in _BOUNDS.items():
        value = getattr(file, key)
        if value is not None and not least <= value <= greatest:
            raise InputError(f"{path}: {key} = {value:g} is outside {least:g} to {greatest:g}.")
    try:
        glyphs = DerivedForms(file.letters, partial(_letter, file))
        if path.resolve().parent != _HOUSE:  # which is known to be right; what is wrong in others is said now
            dict(glyphs)
        marks = {
            NAMES[name]: tuple(_glyph(name, n, form, _points(form.pen, 1.0), 1.0) for n, form in enumerate(forms))
            for name, forms in file.marks.items()
        }
    except (KeyError, ValueError) as error:
        raise InputError(f"{path}: {error}.") from error
    local = {
        code: DerivedForms(forms, partial(_letter, msgspec.structs.replace(file, letters=file.letters | forms)))
        for code, forms in file.languages.items()
    }
    return Hand(
        name=file.name,
        title=file.title,
        glyphs=glyphs,
        marks=marks,
        slant=file.slant,
        smooth=file.smooth,
        drawn_at=file.drawn_at or file.smooth,
        delayed_after=file.late,
        interval=file.interval,
        word_space=file.word_space,
        pitch=file.pitch,
        variation=file.variation,
        languages=local,
    )


def _add_scripts(path: Path, file: _DrawnFile) -> None:
    """Add the letters that come with the program and a hand's file asks for, as far as it has those they are like."""
    scripts = {each.stem: each for each in sorted(_HOUSE.glob("scripts/*.toml"))}
    for name in file.also:
        if name not in scripts:
            raise InputError(f"{path}: also = {name!r} is none of {', '.join(scripts)}.")
        more = msgspec.convert(load_table(scripts[name], "letters of drawn hands"), _LettersFile)
        known = more.letters | file.letters
        drawn = {
            letter: forms for letter, forms in more.letters.items() if not isinstance(forms, str) or forms in known
        }
        file.letters, file.languages = drawn | file.letters, more.languages | file.languages


def _points(text: str, breadth: float) -> list[Array]:
    """``"x,y x,y | x,y"`` → one (n, 2) array a stroke, x times `breadth`."""
    if not text:
        return []
    try:
        return [
            _near_origin([[float(v) for v in point.split(",")] for point in stroke.split()]) * (breadth, 1.0)
            for stroke in text.split("|")
        ]
    except ValueError as error:
        raise ValueError(f"points {text!r}: expected 'x,y x,y | x,y' ({error})") from error


def _near_origin(values: ArrayLike) -> Array:
    """Points (n, 2), if all are as near to a letter's origin as a letter's can be."""
    points = readonly(values, None, 2)
    if points.size and np.abs(points).max() > FURTHEST:
        raise ValueError(f"{np.abs(points).max():.4g} is beyond {FURTHEST} x-heights")
    return points


def _glyph(letter: str, number: int, form: _Form, strokes: list[Array], breadth: float) -> Glyph:
    delayed = _points(form.late, breadth)
    if not abs(form.width) <= FURTHEST:
        raise ValueError(f"letter {letter!r}, form {number + 1}: width = {form.width:g} is beyond {FURTHEST} x-heights")
    if not form.weight > 0:
        raise ValueError(f"letter {letter!r}, form {number + 1}: weight = {form.weight:g} is not above 0")
    return Glyph(
        letter=letter,
        strokes=(*strokes, *delayed),
        delayed=(False,) * len(strokes) + (True,) * len(delayed),
        width=form.width * breadth,
        places=frozenset(form.at.split()) or _PLACES,
        after=form.after,
        before=form.before,
        rank=bool(form.after) + bool(form.before),
        favour=math.log(form.weight) + (_FAVOUR if form.at and frozenset(form.at.split()) != _PLACES else 0.0),
        form=number,
    )


def _letter(file: _DrawnFile, letter: str) -> tuple[Glyph, ...]:
    forms = file.letters[letter]
    if isinstance(forms, str) and isinstance(forms := file.letters.get(same := forms, ""), str):
        raise ValueError(f"letter {letter!r}: no forms are drawn of {same!r}")
    return tuple(glyph for number, form in enumerate(forms) for glyph in _derive(letter, number, form, file))


def _derive(letter: str, number: int, form: _Form, file: _DrawnFile) -> Iterator[Glyph]:
    """Every glyph that follows from one drawn form."""
    pen = _points(form.pen, file.breadth)
    if not pen:
        raise ValueError(f"letter {letter!r}, form {number + 1}: no points")
    for kind, prefix, reluctance, inside in _ways_in(letter, form, file):
        first = np.vstack([prefix, pen[0]]) if len(prefix) else pen[0]
        glyph = replace(
            _glyph(letter, number, form, [first, *pen[1:]], file.breadth), entry=kind, reluctance=reluctance
        )
        if inside:
            glyph = replace(glyph, places=glyph.places - {"start", "alone"})
        if form.out == "lifted":
            yield glyph
            continue
        if glyph.places - _LAST_PLACES:
            yield replace(glyph, exit=form.out, places=glyph.places - _LAST_PLACES)
        if glyph.places & _LAST_PLACES:
            yield from _end_forms(replace(glyph, places=glyph.places & _LAST_PLACES), form, file)


def _ways_in(letter: str, form: _Form, file: _DrawnFile) -> Iterator[tuple[str, Array, float, bool]]:
    """(kind of entry, points before the form's own, reluctance to lift, only inside a word)."""
    if form.in_ in ("low", "high", "lifted", "free"):
        yield form.in_, np.empty((0, 2)), 0.0, False
        return
    if form.in_ not in file.entries:
        raise ValueError(f"letter {letter!r}: no entry is called {form.in_!r}")
    entry = file.entries[form.in_]
    reluctance = math.log((1 - entry.lift) / entry.lift) if 0 < entry.lift < 1 else _NEVER
    for kind in ("low", "high", "lifted"):
        for text in getattr(entry, kind):
            points = _points(text, file.breadth)
            cost = reluctance if kind == "lifted" else 0.0
            yield kind, points[0] if points else np.empty((0, 2)), cost, kind != "lifted"


def _end_forms(glyph: Glyph, form: _Form, file: _DrawnFile) -> Iterator[Glyph]:
    """The forms of a joining letter at the end of a word: its exit is shortened, or as `end`, `cut` say."""
    last = glyph.last_main
    body, tip = glyph.strokes[last], glyph.strokes[last][-1]
    if form.cut:
        if not 0 < form.cut < len(body):
            raise ValueError(f"letter {glyph.letter!r}: cut = {form.cut} is outside 1 to {len(body) - 1}, its points")
        variants = [(body[: -form.cut], 0.0)]
    else:
        tails = _tails(body, form, file)
        variants = [(np.vstack([body[:-1], tail]), max(0.0, 0.6 * float(tail[0] - tip[0]))) for tail in tails]
    for points, wider in variants:
        strokes = (*glyph.strokes[:last], points, *glyph.strokes[last + 1 :])
        yield replace(glyph, strokes=strokes, width=glyph.width + wider)


def _tails(body: Array, form: _Form, file: _DrawnFile) -> list[Array]:
    """Where the last stroke of a word may end: points that replace its last one."""
    tip = body[-1]
    if form.end:
        return [points[0] for points in _points(form.end.replace(" ", "|"), file.breadth)]
    if form.out == "high":
        return [body[-2] + _HIGH_EXIT_KEPT * (tip - body[-2])]
    return [np.array([tip[0] + dx, y]) for dx, y in (_near_origin(file.endings).tolist() if file.endings else ())] or [
        tip
    ]


# at haste 1; care (haste −1) goes as far the other way, except where it says
_SMOOTH, _SMOOTH_CARE = 0.05, 0.03
_PACE = 0.3  # of the logarithm of the interval
_SLANT = 0.06  # tangent
_BREADTH, _HEIGHT = 0.07, -0.06  # of the logarithm
_VARIATION = 0.35  # of the logarithm
_FADING = 0.16
_TRAIL = 0.22  # x-heights that the last stroke of a word reaches further
_JOINING = 2.0  # added to the reluctance to lift


def _hastened_letter(
    glyphs: Mapping[str, tuple[Glyph, ...]], shape: Array, haste: float, letter: str
) -> tuple[Glyph, ...]:
    return tuple(_hasten_glyph(glyph, shape, haste) for glyph in glyphs[letter])


def _hasten_glyph(glyph: Glyph, shape: Array, haste: float) -> Glyph:
    strokes = [stroke @ shape for stroke in glyph.strokes]
    width = glyph.width * float(shape[0, 0])
    if haste > 0 and glyph.exit == "lifted" and glyph.places <= _LAST_PLACES and glyph.letter.islower():
        stroke = strokes[glyph.last_main]
        tip, before = stroke[-1], stroke[-2] if len(stroke) > 1 else stroke[-1]
        if tip[0] > before[0] and -0.1 < tip[1] < 0.6:  # leaves to the right near the line: is drawn out along it
            moved = np.array([tip[0] + _TRAIL * haste, tip[1] * (1 - 0.5 * haste)])
            width += max(0.0, float(moved[0] - tip[0]))
            strokes[glyph.last_main] = np.vstack([stroke[:-1], moved])
    joining = glyph.reluctance + _JOINING * haste if glyph.reluctance else 0.0
    return replace(glyph, strokes=tuple(strokes), width=width, reluctance=joining)
