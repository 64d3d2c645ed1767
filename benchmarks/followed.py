"""How much of what a pen did is in the paths that were recovered from its ink: strokes, directions, order.

A true stroke counts as far as the line graph has it: ink that failed, or that the mask lost, nobody can follow.  It is
*found* where at least 90 % of that lies within `NEAR` of one recovered path, in the order of either, and *right* where
the two run the same way.  A recovered path may make detours of one x-height on the way: a retraced stem a little too
long is no other stroke.  Dots, shorter than half a millimetre, are found where a path is, and have no direction.  A
word is *in order* where all its strokes are found and the recovered paths, and places on one path, come in the order
of writing; *all right* where all directions are right, too; its *bodies* are in order where it is without dots,
bars and accents.

Detours over what is not there are not seen by that: so much of the length that is drawn lies off the ink, farther than
`NEAR` from the line graph.  A lift, between two strokes of a word, is *kept* unless one recovered path has half of both
of them, or is joined with others that have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.spatial import cKDTree

from handout.values import Array

NEAR = 0.25  # mm, a tenth of an x-height
FOUND = 0.9
_DETOUR = 2.5  # mm
_DOT, _MET = 0.5, 0.3  # mm; share of a dot that a path meets
_MARK = 1.0  # mm, no longer is a mark …
_LEVEL = 1.5  # … unless it is so much wider than tall
_STEP = 0.1  # mm
_BACK = 0.02  # of a path: places so near one another are one
_PASSED = 0.5  # of a stroke that a path has
_CHANGE = 10.0  # places on no stroke at all that a path may pass rather than change over to another stroke


@dataclass
class Tally:
    """Counts over some writing; `+=` adds other writing's."""

    strokes: int = 0
    found: int = 0
    right: int = 0
    words: int = 0
    ordered: int = 0
    good: int = 0
    bodies: int = 0
    drawn: float = 0.0
    off: float = 0.0
    lifts: int = 0
    kept: int = 0
    wrong: list[int] = field(default_factory=list)

    def __iadd__(self, other: Tally) -> Tally:
        for name in (
            "strokes",
            "found",
            "right",
            "words",
            "ordered",
            "good",
            "bodies",
            "drawn",
            "off",
            "lifts",
            "kept",
        ):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.wrong += other.wrong
        return self

    def shares(self) -> tuple[float, float, float, float]:
        """Strokes found; of these in the right direction; words in order; words all right."""
        strokes, found, words = max(self.strokes, 1), max(self.found, 1), max(self.words, 1)
        return self.found / strokes, self.right / found, self.ordered / words, self.good / words

    def drawing(self) -> tuple[float, float]:
        """Of the length that is drawn, how much lies off the ink; lifts kept."""
        return self.off / max(self.drawn, 1e-9), self.kept / max(self.lifts, 1)


def tally(true: Sequence[Array], words: Sequence[int], recovered: Sequence[Array], seen: Array) -> Tally:
    """Judge some writing.

    Parameters
    ----------
    true : (n, 2) float, mm, strokes in the order of writing; words : the word of each.
    recovered : (n, 2) float, mm, paths in order.
    seen : (n, 2) float, mm, vertices of the line graph.
    """
    paths = [evenly(xy) for xy in recovered]
    tree = cKDTree(seen)
    found: dict[int, list[tuple[bool, bool, float]]] = {}
    followed: dict[int, list[Array]] = {}
    for stroke, word in zip(true, words, strict=True):
        places = evenly(stroke)
        places = places[tree.query(places)[0] <= NEAR]
        if len(places):
            dot = float(np.ptp(stroke, axis=0).max()) < _DOT
            found.setdefault(word, []).append(_judged(places, paths, dot))
            followed.setdefault(word, []).append(places)
    result = Tally()
    for path in paths:
        result.drawn += _STEP * (len(path) - 1)
        result.off += _STEP * float((tree.query(path)[0] > NEAR).sum())
    for own in followed.values():
        result.lifts += len(own) - 1
        result.kept += _parts(own, paths) - 1
    for word, strokes in found.items():
        waits = marks(followed[word])
        bodies = [one for one, mark in zip(strokes, waits, strict=True) if not mark]
        result.bodies += all(ok for ok, _, _ in bodies) and not (np.diff([at for _, _, at in bodies]) < -_BACK).any()
        places_ = [place for _, _, place in strokes]
        ordered = all(ok for ok, _, _ in strokes) and bool((np.diff(places_) >= -_BACK).all())
        good = ordered and all(right for _, right, _ in strokes)
        result.strokes += len(strokes)
        result.found += sum(ok for ok, _, _ in strokes)
        result.right += sum(right for _, right, _ in strokes)
        result.words += 1
        result.ordered += ordered
        result.good += good
        if not good:
            result.wrong.append(word)
    return result


def marks(strokes: Sequence[Array]) -> list[bool]:
    """Which strokes of a word look like dots, bars and accents: small or level, over or under a larger one."""
    size = [float(np.ptp(xy, axis=0).max()) for xy in strokes]
    bounds = [(float(xy[:, 0].min()), float(xy[:, 0].max())) for xy in strokes]
    found = []
    for own, xy, (left, right) in zip(size, strokes, bounds, strict=True):
        beside = any(
            other > own and left - NEAR <= high and right + NEAR >= low
            for other, (low, high) in zip(size, bounds, strict=True)
        )
        wide, tall = np.ptp(xy, axis=0)
        found.append(bool(beside and (own < _MARK or wide > _LEVEL * tall)))
    return found


def evenly(xy: Array) -> Array:
    """(k, 2): places along a path, `_STEP` apart."""
    if len(xy) < 2:
        return xy
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    at = np.linspace(0.0, run[-1], max(1, int(np.ceil(run[-1] / _STEP))) + 1)
    return np.column_stack([np.interp(at, run, xy[:, k]) for k in (0, 1)])


def _judged(places: Array, paths: Sequence[Array], dot: bool) -> tuple[bool, bool, float]:
    """Whether a stroke is found, whether its direction is right, and where: number of the path, and how far along."""
    forward, backward = (0.0, -1.0), (0.0, -1.0)
    low, high = places.min(axis=0) - NEAR, places.max(axis=0) + NEAR
    for number, path in enumerate(paths):
        if (path.min(axis=0) > high).any() or (path.max(axis=0) < low).any():
            continue
        near = np.hypot(*(places[:, None] - path[None]).transpose(2, 0, 1)) <= NEAR
        share, end = _along(near)
        forward = max(forward, (share, number + 0.999 * end), key=lambda one: one[0])
        share, end = _along(near[:, ::-1])
        backward = max(backward, (share, number + 0.999 * (1 - end)), key=lambda one: one[0])
    share = max(forward[0], backward[0])
    ok = share >= FOUND or (dot and share >= _MET)
    same = forward[0] >= backward[0]
    return ok, ok and (dot or same), (forward if same else backward)[1]


def _parts(strokes: Sequence[Array], paths: Sequence[Array]) -> int:
    """How many of a word's strokes, given by their places, no recovered path joins to others of them."""
    part = list(range(len(strokes)))
    low, high = (pick([pick(xy, axis=0) for xy in strokes], axis=0) for pick in (np.min, np.max))
    for path in paths:
        if len(strokes) > 1 and not ((path.min(axis=0) > high).any() or (path.max(axis=0) < low).any()):
            passed = _passed(strokes, path)
            part = [min(part[k] for k in passed) if one in {part[k] for k in passed} else one for one in part]
    return len(set(part))


def _passed(strokes: Sequence[Array], path: Array) -> list[int]:
    """The strokes of which a path has half, each of its places being on one stroke only."""
    away = np.column_stack([cKDTree(xy).query(path, distance_upper_bound=2 * NEAR)[0] for xy in strokes])
    price = np.minimum(away / (2 * NEAR), 1.0) ** 2
    total, back = price[0], np.zeros(price.shape, dtype=np.intp)
    for step in range(1, len(path)):
        least = int(total.argmin())
        change = total[least] + _CHANGE < total
        back[step] = np.where(change, least, np.arange(len(strokes)))
        total = np.where(change, total[least] + _CHANGE, total) + price[step]
    on = np.zeros(len(path), dtype=np.intp)
    on[-1] = total.argmin()
    for step in range(len(path) - 1, 0, -1):
        on[step - 1] = back[step, on[step]]
    found = []
    for k, xy in enumerate(strokes):
        own = path[on == k]
        if len(own) and (cKDTree(own).query(xy)[0] <= NEAR).mean() >= _PASSED:
            found.append(k)
    return found


def _along(near: NDArray[np.bool_]) -> tuple[float, float]:
    """Greatest share of a stroke's places met in order along a path, and where on the path the last of them is.

    near : (places of the stroke, places of the path) bool.
    """
    count, length = near.shape
    if count < 2:
        return float(near.any()), float(near[0].argmax() / length)
    detour = round(_DETOUR / _STEP)
    best = np.zeros(length + detour)
    for row in near:
        if not row.any():
            best[detour:] = np.maximum.accumulate(best[detour:])
            continue
        before = maximum_filter1d(best, detour + 1, mode="constant", origin=detour // 2)[detour:]
        best[detour:] = np.where(row, before + 1, best[detour:])
    return float(best.max() / count), float(best[detour:].argmax() / length)
