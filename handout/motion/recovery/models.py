"""How letters are usually written: the forms of the built-in hands, as paths in the order of writing.

The order in which a letter's strokes are written, and their directions, are much the same in all Western hands; their
shapes are not, so that a form is laid over a letter's line with its own place, size, breadth and slant before the two
are compared.
"""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from handout.hand.library import load
from handout.motion.recovery import ductus
from handout.motion.recovery.ductus import Way, curve
from handout.values import Array, Glyph, Hand

HANDS = ("house-joined", "house-quick", "house-print")
SAMPLES = 24  # of a path
_FORMS = 8  # of each hand
_ONE_HAND = 1.2  # cost of a form that one writer is known to have
_STEP = 4  # places of a curve on either side that tell whether it turns back


@dataclass(frozen=True, eq=False)
class Models:
    """Some forms of one letter.

    xy : (f, s, 2) float, evenly along each form, mean 0, both deviations 1, x and y uncorrelated.
    of : (f, s) int: the stroke that each place is on.
    late : (f, s) bool: written after the word.
    strokes : (f,) int: how many each has.
    ends : for each form (k, 2) float: where its strokes begin and end and where they turn back.
    cost : (f,) float: of a form that few people write.
    drawn : (f,) bool: whether it is a built-in hand's, which tells what is written late, or an entry in `ductus`.
    """

    xy: Array
    of: NDArray[np.intp]
    late: NDArray[np.bool_]
    strokes: NDArray[np.intp]
    ends: tuple[Array, ...]
    cost: Array
    drawn: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.xy)

    def take(self, forms: NDArray[np.intp]) -> Models:
        """Some of the forms."""
        ends = tuple(self.ends[i] for i in forms)
        xy, of, late, strokes = self.xy[forms], self.of[forms], self.late[forms], self.strokes[forms]
        return Models(xy, of, late, strokes, ends, self.cost[forms], self.drawn[forms])


def models(letter: str, entered: bool, left: bool, hands: tuple[str, ...] = HANDS) -> Models | None:
    """Forms of a letter; None if no hand has any.

    Parameters
    ----------
    entered, left : whether the pen comes from another letter, and goes to one, without a lift.
    """
    for name in (letter, unicodedata.normalize("NFD", letter)[:1]):
        found = _models(name, entered, left, hands)
        if found is not None:
            return found
    return None


@lru_cache(maxsize=512)
def _models(letter: str, entered: bool, left: bool, hands: tuple[str, ...]) -> Models | None:
    each = [_chosen(hand.glyphs.get(letter, ()), entered, left) for hand in _loaded(hands)]
    glyphs = [glyph for some in zip_longest(*each) for glyph in some if glyph is not None]
    # letters that are joined to others have the manners of joined hands
    taught = ductus.ways(letter) if hands and not entered and not left else ()
    found = [made for one in (*glyphs, *taught) if (made := _model(one)) is not None]
    if not found:
        return None
    xy, of, late, ends, cost, drawn = zip(*found, strict=True)
    strokes = np.array([int(which[-1]) + 1 for which in of], dtype=np.intp)
    return Models(
        np.array(xy), np.array(of), np.array(late), strokes, ends, np.array(cost) - min(cost), np.array(drawn)
    )


@lru_cache(maxsize=4)
def _loaded(hands: tuple[str, ...]) -> tuple[Hand, ...]:
    return tuple(load(hand) for hand in hands)


def _chosen(glyphs: Sequence[Glyph], entered: bool, left: bool) -> list[Glyph]:
    """Forms that fit, each drawn one once before any is there in another variant."""
    fitting = [g for g in glyphs if (g.entry != "lifted") == entered and (g.exit != "lifted") == left]
    ranked: dict[int, list[Glyph]] = {}
    for glyph in fitting or glyphs:
        ranked.setdefault(glyph.form, []).append(glyph)
    # variants of one drawing differ in how they are entered: another one of them for each drawing
    turned = [own[i % len(own) :] + own[: i % len(own)] for i, own in enumerate(ranked.values())]
    return [g for some in zip_longest(*turned) for g in some if g is not None][:_FORMS]


@lru_cache(maxsize=4096)
def _model(one: Glyph | Way) -> tuple[Array, NDArray[np.intp], NDArray[np.bool_], Array, float, bool] | None:
    drawn = isinstance(one, Glyph)
    curves = [curve(stroke) for stroke in one.strokes] if isinstance(one, Glyph) else list(one.strokes)
    xy, which = along(curves, SAMPLES)
    if max(map(_deviation, xy.T)) < 1e-6:
        return None
    late = np.array(one.late if isinstance(one, Glyph) else (False,) * len(curves), dtype=bool)[which]
    marks = np.concatenate([[curve[0], curve[-1], *_turns(curve)] for curve in curves])
    low = xy.mean(axis=0)
    matrix = np.linalg.inv(frame(xy - low)).T
    cost = _ONE_HAND if isinstance(one, Glyph) else one.cost
    return (xy - low) @ matrix, which, late, (marks - low) @ matrix, cost, drawn


def frame(xy: Array) -> Array:
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


def along(curves: Sequence[Array], count: int) -> tuple[Array, NDArray[np.intp]]:
    """Places (count, 2) at even distances along some ways, one after the other, and (count,) on which way each is."""
    runs = [np.hypot(*np.diff(curve, axis=0).T) for curve in curves]
    steps = np.concatenate([np.concatenate([[0.0], run]) for run in runs])  # nothing is written between two ways
    first = np.cumsum([0, *(len(curve) for curve in curves)])
    # a way of no length, a dot, takes its place, too
    run = np.cumsum(steps) + 1e-9 * np.arange(len(steps))
    xy = np.concatenate(curves)
    at = np.linspace(0.0, run[-1], count)
    near = np.minimum(np.searchsorted(run, at), len(run) - 1)
    which = np.searchsorted(first, near, side="right") - 1
    before = np.maximum(near - 1, first[which])
    gap = run[near] - run[before]
    share = np.where(gap > 0, (at - run[before]) / np.maximum(gap, 1e-12), 0.0)[:, None]
    return xy[before] + np.clip(share, 0, 1) * (xy[near] - xy[before]), which
