"""Forms of letters: how letters are usually written, as paths in the order of writing.

Order and direction of a letter's strokes (its ductus) are much the same in all Western hands; their shapes are not, so
a form is laid over a letter's line with the place, size, breadth and slant of that before the two are compared.  Forms
come from the built-in hands, each of which is one writer's, and from `ductus.toml`, which lists on a coarse grid what
other writers do.  `turning_points` tells where strokes may begin, cease or turn back in the middle of a branch.

Source of `ductus.toml`: general knowledge of how handwriting is taught and done in the West.
"""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise, zip_longest
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.hand.drawn import Hand
from handout.hand.library import load
from handout.motion.recovery.network import BranchNetwork
from handout.tables import load_table
from handout.values import Array, Glyph, Indices

HANDS = ("house-joined", "house-quick", "house-print")
SAMPLES = 24  # of a path
_FORMS = 8  # of each hand
_STEP = 4  # places of a curve on either side that tell whether it turns back
_FINE = 8  # places between two points of `ductus.toml`
_LOOKED = 3  # forms that say where strokes may begin and turn
_CLEAR = 7.0  # half widths, at least, from a node to a further node on a branch
_CUTS = 2  # turning points of a letter at most
# Of a letter's size: line so near where a form turns is cut.  Set on recorded letters and words; at .3 the round
# shoulder of half the r of two writers was too far from the form's corner, and they began at the tip of the arm.
_REACH = 0.45


@dataclass(frozen=True)
class FormWeights:
    """Costs of comparing traversals of a letter with its forms, in the unit of `network.CostWeights`.

    Those of matching were found by random search (`benchmarks.order_search`) on fewer pages and letters than it has
    now, those of rare forms by a search over traversals that were computed before, those of guides and loops by hand.
    """

    # matching (`form_matching`)
    unlike: float = 10.0  # for 1 of distance from the nearest form
    near: float = 0.82  # of a letter's size: places so far apart are unlike
    farthest: float = 3.6  # what a place costs at most
    aimed: float = 0.59  # of a right angle between directions
    open: float = 0.4  # of every place on the way from another letter that is skipped
    lifted: float = 0.04  # of every lift that only one of traversal and form has
    spared: float = 2.4  # of a lift that a form has, too
    # rare forms
    one_hand: float = 1.2  # of a form that one writer is known to have
    other: float = 1.3  # of a ductus that fewer people have
    rare: float = 1.6  # of one that few have
    # guides (`traversal.form_guides`)
    passed: float = 10.0  # of passing a whole letter, for 1 of distance
    left_out: float = 15.0  # of leaving out a whole form, or going back over it
    most_left_out: float = 0.3  # of a form
    guided_lift: float = 2.0  # spared where the form is lifted for, too; cost of going on there
    led: float = 4.0  # of coming back to where a letter is led in from the line (`letter_line.find_lead_in`)
    # loops (`letter_line.loop_direction_errors`)
    loop: float = 4.0  # of a loop that is the wrong way round
    loop_above: float = 0.95  # x-heights over the baseline: where loops of stems are
    loop_high: float = 0.6  # of the height of a letter whose baseline is not known, above which they are


WEIGHTS = FormWeights()


@dataclass(frozen=True, eq=False)
class LetterForms:
    """Some forms of one letter.

    xy : (f, s, 2) float, evenly along each form, mean 0, both deviations 1, x and y uncorrelated.
    stroke_of : (f, s) int: the stroke that each place is on.
    delayed : (f, s) bool: whether that is written after the word.
    strokes : (f,) int: how many each has.
    ends : for each form (k, 2) float: where its strokes begin and end and where they turn back.
    cost : (f,) float: of a form that few people write.
    drawn : (f,) bool: whether it is a built-in hand's, which tells what is delayed, or an entry of `ductus.toml`.
    """

    xy: Array
    stroke_of: NDArray[np.intp]
    delayed: NDArray[np.bool_]
    strokes: NDArray[np.intp]
    ends: tuple[Array, ...]
    cost: Array
    drawn: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.xy)

    def take(self, rows: NDArray[np.intp]) -> LetterForms:
        """Some of the forms."""
        ends = tuple(self.ends[i] for i in rows)
        xy, stroke_of, delayed, strokes = self.xy[rows], self.stroke_of[rows], self.delayed[rows], self.strokes[rows]
        return LetterForms(xy, stroke_of, delayed, strokes, ends, self.cost[rows], self.drawn[rows])


def forms_of(letter: str, entered: bool, left: bool, hands: tuple[str, ...] = HANDS) -> LetterForms | None:
    """Forms of a letter; None if no hand has any.

    entered, left : whether the pen comes from another letter, and goes to one, without a lift.
    """
    for name in (letter, unicodedata.normalize("NFD", letter)[:1]):
        forms = _forms(name, entered, left, hands)
        if forms is not None:
            return forms
    return None


@lru_cache(maxsize=512)
def _forms(letter: str, entered: bool, left: bool, hands: tuple[str, ...]) -> LetterForms | None:
    of_hands = [_fitting(hand.glyphs.get(letter, ()), entered, left) for hand in _load_hands(hands)]
    glyphs = [glyph for row in zip_longest(*of_hands) for glyph in row if glyph is not None]
    # letters that are joined to others are written as joined hands write them
    taught = ductus(letter) if hands and not entered and not left else ()
    forms = [form for source in (*glyphs, *taught) if (form := _form(source)) is not None]
    if not forms:
        return None
    xy, stroke_of, delayed, ends, cost, drawn = zip(*forms, strict=True)
    strokes = np.array([int(which[-1]) + 1 for which in stroke_of], dtype=np.intp)
    cheapest = np.array(cost) - min(cost)
    return LetterForms(np.array(xy), np.array(stroke_of), np.array(delayed), strokes, ends, cheapest, np.array(drawn))


@lru_cache(maxsize=4)
def _load_hands(hands: tuple[str, ...]) -> tuple[Hand, ...]:
    return tuple(load(hand) for hand in hands)


def _fitting(glyphs: Sequence[Glyph], entered: bool, left: bool) -> list[Glyph]:
    """The glyphs that are joined in this way: one variant of each drawn form first, then the other variants."""
    fitting = [g for g in glyphs if (g.entry != "lifted") == entered and (g.exit != "lifted") == left]
    ranked: dict[int, list[Glyph]] = {}
    for glyph in fitting or glyphs:
        ranked.setdefault(glyph.form, []).append(glyph)
    # variants of one drawing differ in how they are entered: another one of them for each drawing
    turned = [
        variants[i % len(variants) :] + variants[: i % len(variants)] for i, variants in enumerate(ranked.values())
    ]
    return [g for row in zip_longest(*turned) for g in row if g is not None][:_FORMS]


@lru_cache(maxsize=4096)
def _form(source: Glyph | Ductus) -> tuple[Array, NDArray[np.intp], NDArray[np.bool_], Array, float, bool] | None:
    """The fields of `LetterForms` for one form; None for one of no extent."""
    drawn = isinstance(source, Glyph)
    curves = [_curve(stroke) for stroke in source.strokes] if isinstance(source, Glyph) else list(source.strokes)
    xy, which = resample_strokes(curves, SAMPLES)
    if max(map(_deviation, xy.T)) < 1e-6:
        return None
    delayed = np.array(source.delayed if isinstance(source, Glyph) else (False,) * len(curves), dtype=bool)[which]
    ends = np.concatenate([[curve[0], curve[-1], *_turns(curve)] for curve in curves])
    low = xy.mean(axis=0)
    matrix = np.linalg.inv(frame_of(xy - low)).T
    cost = WEIGHTS.one_hand if isinstance(source, Glyph) else source.cost
    return (xy - low) @ matrix, which, delayed, (ends - low) @ matrix, cost, drawn


def frame_of(xy: Array) -> Array:
    """(2, 2) upper triangular: takes what has deviations 1 and no slant to the size and slant of places (n, 2)."""
    right, up = xy.T
    size = max(_deviation(xy), 1e-9)
    y = max(_deviation(up), 0.05 * size)
    slant = float((right * up).sum()) / len(xy) / y**2 if y > 0.3 * size else 0.0
    x = max(_deviation(right - slant * up), 0.05 * size)
    return np.array([[x, slant * y], [0.0, y]])


def _deviation(values: Array) -> float:
    """As `values.std()`, which takes several times as long for so few."""
    off = values - values.sum() / values.size
    return math.sqrt(float((off * off).sum()) / values.size)


def _turns(curve: Array) -> Iterator[Array]:
    """Places where a curve turns back on itself."""
    step = _STEP
    if len(curve) <= 2 * step:
        return
    chord = curve[step:] - curve[:-step]
    size = np.hypot(*chord.T)
    cosine = (chord[:-step] * chord[step:]).sum(axis=1) / np.maximum(size[:-step] * size[step:], 1e-12)
    inner = np.flatnonzero((cosine[1:-1] < -0.2) & (cosine[1:-1] <= cosine[:-2]) & (cosine[1:-1] < cosine[2:])) + 1
    yield from curve[step + inner]


def resample_strokes(curves: Sequence[Array], count: int) -> tuple[Array, NDArray[np.intp]]:
    """Places (count, 2) at even distances along some strokes in turn, and (count,) on which stroke each is."""
    runs = [np.hypot(*np.diff(curve, axis=0).T) for curve in curves]
    steps = np.concatenate([np.concatenate([[0.0], run]) for run in runs])  # nothing is written between two strokes
    first = np.cumsum([0, *(len(curve) for curve in curves)])
    # a stroke of no length, a dot, takes its place, too
    run = np.cumsum(steps) + 1e-9 * np.arange(len(steps))
    xy = np.concatenate(curves)
    at = np.linspace(0.0, run[-1], count)
    near = np.minimum(np.searchsorted(run, at), len(run) - 1)
    which = np.searchsorted(first, near, side="right") - 1
    before = np.maximum(near - 1, first[which])
    gap = run[near] - run[before]
    share = np.where(gap > 0, (at - run[before]) / np.maximum(gap, 1e-12), 0.0)[:, None]
    return xy[before] + np.clip(share, 0, 1) * (xy[near] - xy[before]), which


@dataclass(frozen=True, eq=False)
class Ductus:
    """One way of writing a letter, as `ductus.toml` has it.

    strokes : (n, 2) float, y up, each letter in a unit of its own: the pen's path, for each stroke.
    cost : more for a rare one.
    """

    strokes: tuple[Array, ...]
    cost: float


@lru_cache(maxsize=512)
def ductus(letter: str) -> tuple[Ductus, ...]:
    """The ways of writing a letter, the usual ones first; none where it is not known."""
    parts = (("usual", 0.0), ("other", WEIGHTS.other), ("rare", WEIGHTS.rare))
    table = _ductus_table()
    return tuple(Ductus(_read_ductus(text), cost) for part, cost in parts for text in table[part].get(letter, ()))


@lru_cache(maxsize=1)
def _ductus_table() -> dict[str, dict[str, list[str]]]:
    return load_table(Path(__file__).with_name("ductus.toml"), "ways of writing letters")


def _read_ductus(text: str) -> tuple[Array, ...]:
    """The strokes of an entry of `ductus.toml`."""
    strokes = []
    for stroke in text.split("|"):
        points = stroke.split()
        xy = np.array([[float(point[0]), float(point[1])] for point in points])
        corners = [i for i, point in enumerate(points) if point.endswith("'")]
        parts = [_curve(xy[a : b + 1]) for a, b in pairwise([0, *corners, len(points) - 1])]
        strokes.append(np.concatenate([parts[0], *(part[1:] for part in parts[1:])]))
    return tuple(strokes)


def _curve(points: Array) -> Array:
    """The spline of Catmull and Rom through some points."""
    if len(points) < 2:
        return points
    padded = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    a, b, c, d = (padded[i : len(padded) - 3 + i, None] for i in range(4))
    t = (np.arange(_FINE) / _FINE)[:, None]
    way = 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
    return np.concatenate([way.reshape(-1, 2), points[-1:]])


def turning_points(
    net: BranchNetwork, body: Sequence[int], vertices: Indices, laid: Array, forms: LetterForms
) -> list[int]:
    """Vertices in the middle of branches where the nearest forms of the letter begin, cease or turn back.

    body : branches of the letter; own : (n,) int, vertices of these.
    laid : (f, s, 2) float: the forms, laid over the letter.
    """
    xy = net.xy[vertices]
    middle = xy.mean(axis=0)
    size = float(np.sqrt((xy.std(axis=0) ** 2).sum()))
    marks = np.concatenate(forms.ends[:_LOOKED]) @ frame_of(xy - middle).T + middle
    gap = np.hypot(xy[:, 0] - marks[:, :1], xy[:, 1] - marks[:, 1:])
    near = gap.argmin(axis=1)
    near = near[gap[np.arange(len(near)), near] <= _REACH * size]
    place = {v: (b, i) for b in body for i, v in enumerate(net.branches[b].tolist())}
    runs: dict[int, Array] = {}
    points: list[int] = []
    # many marks of different forms are at one vertex
    for mark in dict.fromkeys(vertices[near].tolist()):
        vertex = _sharpest_near(net, mark, place, runs)
        if vertex is not None and vertex not in points and _is_clear(net, vertex, points, place):
            points.append(vertex)
            if len(points) == _CUTS:
                break
    return points


def _sharpest_near(
    net: BranchNetwork, vertex: int, place: dict[int, tuple[int, int]], runs: dict[int, Array]
) -> int | None:
    """The sharpest bend near a vertex of a branch, if that is far enough from both its nodes.

    runs : for branches how far along them their vertices are, half widths; more are added.
    """
    b, i = place[vertex]
    path = net.branches[b]
    if path[0] == path[-1]:
        return vertex if len(path) > 8 else None
    if b not in runs:
        step = net.xy[path[1:]] - net.xy[path[:-1]]
        runs[b] = np.concatenate([[0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]))]) / net.half_width
    run = runs[b]
    near = np.flatnonzero((np.abs(run - run[i]) < _CLEAR) & (run > _CLEAR) & (run < run[-1] - _CLEAR))
    if not len(near):
        return None
    reach = max(2, round(2 * (len(path) - 1) / max(float(run[-1]), 1e-9)))
    before, after = np.maximum(near - reach, 0), np.minimum(near + reach, len(path) - 1)
    a, c = net.xy[path[near]] - net.xy[path[before]], net.xy[path[after]] - net.xy[path[near]]
    bend = (a * c).sum(axis=1) / np.maximum(np.hypot(*a.T) * np.hypot(*c.T), 1e-12) + 0.02 * np.abs(run[near] - run[i])
    return int(path[near[int(bend.argmin())]])


def _is_clear(net: BranchNetwork, vertex: int, points: Sequence[int], place: dict[int, tuple[int, int]]) -> bool:
    """Whether no other turning point is near on the same branch."""
    b, _ = place[vertex]
    same = [v for v in points if place[v][0] == b]
    return all(float(np.hypot(*(net.xy[v] - net.xy[vertex]))) > 1.5 * _CLEAR * net.half_width for v in same)
