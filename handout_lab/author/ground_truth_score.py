"""Scores what a reader found on a simulated scan against the truth: mask, path, letters, splits, matte.

The reader's results are plain arrays in pixels of the scan, so that any reader can be scored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, Indices
from handout_lab.author.ink_ownership import evenly
from handout_lab.author.truth import Truth

NOBODY = -1  # the letter of ink that is no letter's
NEAR = 0.06  # mm between a true and a found path that count as one
_STEP = 0.5  # pixels between the places at which paths are compared
_LOST = 0.25  # rule heights beyond which a split is another one
_AT = 0.15  # rule heights between a true and a found split that count as one place
_OTHER_PAPERS = ((0.05, 0.25, 0.1), (0.95, 0.85, 0.2))  # dark green, yellow
_LIGHTER, _DARKER = 0.02, 0.15  # what counts as lightening it, and how much darker the usual ink has to be


@dataclass(frozen=True)
class PathScore:
    """How well the pen's way was found, as far as it left visible ink.

    A stretch is *clear* where no other part of the way is nearer than the width of a line, and the line turns no
    tighter than about its own edge: elsewhere lines have run into one, whose middle is neither's.

    recall : share of the clear true way that has a found path within `NEAR`; recall_all : the same of all of it.
    precision : share of the found way, near clear stretches, that has the true one within `NEAR`; precision_all : the
        same of all of it.
    clear : share of the true way that is clear.
    error : rms distance, mm, of the clear true way from the found one where it was met.
    """

    recall: float
    recall_all: float
    precision: float
    precision_all: float
    clear: float
    error: float


@dataclass(frozen=True)
class SplitScore:
    """How well the places between joined letters were found; distances in rule heights.

    recall : share of the true splits that have one within a quarter of a rule height; placed : within .15 of it.
    precision : share of the found splits that are near a true one.
    median, worst : distance of the found ones, the middle and the 95th percentile; NaN without any.
    """

    recall: float
    placed: float
    precision: float
    median: float
    worst: float


@dataclass(frozen=True)
class MatteScore:
    """How well ink and paper were told apart.

    recomposed : greatest difference, of 1, between the scan and the ink put back on the found paper.
    alpha : mean absolute error of alpha where either has ink.
    paper : mean absolute error of the paper under the ink, of 1.
    halo : share of inked pixels that, put on dark green or on yellow paper, lighten it in a channel in which the
        page's usual ink darkens it; the worse of the two.
    """

    recomposed: float
    alpha: float
    paper: float
    halo: float


def overlap(mask: NDArray[np.bool_], true: NDArray[np.bool_]) -> float:
    """Intersection over union of two masks (h, w); 1 where both are empty."""
    either = np.count_nonzero(mask | true)
    return np.count_nonzero(mask & true) / either if either else 1.0


def path(truth: Truth, places: Array, edges: Indices, near: float = NEAR) -> PathScore:
    """Compare a found line with the pen's way.

    Parameters
    ----------
    places : (n, 2) float, pixels, vertices of the found line; edges : (m, 2) int, pairs of them.
    near : mm.
    """
    ours, clear = _way(truth)
    theirs = _drawn(np.asarray(places, dtype=np.float64), np.asarray(edges, dtype=np.intp))
    if not len(ours) or not len(theirs):
        both = float(len(ours) == len(theirs))
        return PathScore(both, both, both, both, float(clear.mean()) if len(clear) else 1.0, 0.0)
    away = _distance(ours, theirs)[0] * truth.pixel
    back, nearest = _distance(theirs, ours)
    judged = clear[nearest] & (back < truth.line)
    met = away <= near
    good = away[met & clear]
    return PathScore(
        recall=float(met[clear].mean()) if clear.any() else 1.0,
        recall_all=float(met.mean()),
        precision=float((back[judged] * truth.pixel <= near).mean()) if judged.any() else 1.0,
        precision_all=float((back * truth.pixel <= near).mean()),
        clear=float(clear.mean()),
        error=float(np.sqrt(np.mean(good**2))) if len(good) else 0.0,
    )


def missed(truth: Truth, places: Array, edges: Indices, near: float = NEAR) -> Array:
    """(k, 2) pixels, to be shown: where the pen's clear way has no found line within `near` mm."""
    ours, clear = _way(truth)
    theirs = _drawn(places, edges)
    return ours[clear & (_distance(ours, theirs)[0] * truth.pixel > near)] if len(theirs) else ours[clear]


def _way(truth: Truth) -> tuple[Array, NDArray[np.bool_]]:
    """(n, 2) pixels, evenly along all true paths, as far as they lie under visible ink, and (n,) where it is clear."""
    ways = [_along(p.xy) for p in truth.paths]
    if not ways:
        return np.zeros((0, 2)), np.zeros(0, dtype=bool)
    places = np.concatenate(ways)
    visible = _within(places, truth.mask)
    return places[visible], _clear(ways, truth.line)[visible]


def _along(xy: Array) -> Array:
    at = evenly(xy, _STEP)
    return np.column_stack([np.interp(at, np.arange(len(xy)), xy[:, k]) for k in (0, 1)])


def _clear(ways: Sequence[Array], line: float) -> NDArray[np.bool_]:
    """(n,) for the places of all ways: whether the line, `line` pixels wide, runs alone there."""
    return np.concatenate([~_tight(way, line) for way in ways]) & ~_doubled(ways, line)


def _tight(way: Array, line: float) -> NDArray[np.bool_]:
    """(n,) whether the way turns within its own line: the ends of an arc π / 2 · `line` long are nearer than `line`."""
    half = max(1, round(np.pi / 4 * line / _STEP))
    tight = np.zeros(len(way), dtype=bool)
    if len(way) > 2 * half:
        tight[half:-half] = np.linalg.norm(way[2 * half :] - way[: -2 * half], axis=1) < line
        # what lies within the turn, too
        tight = np.convolve(tight, np.ones(2 * half + 1), mode="same") > 0
    return tight


def _doubled(ways: Sequence[Array], line: float) -> NDArray[np.bool_]:
    """(n,) whether another stroke, or this one 1.5 `line` or more further along, passes within `line` pixels."""
    from scipy.spatial import cKDTree

    places = np.concatenate(ways)
    reach = 1.5 * line
    number = np.repeat(np.arange(len(ways)), [len(way) for way in ways])
    far = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))]) + number * 4 * reach
    some = np.arange(0, len(places), max(1, round(line / 4 / _STEP)))
    tree = cKDTree(places[some])
    doubled = np.empty(len(places), dtype=bool)
    for start in range(0, len(places), 1 << 16):
        part = slice(start, start + (1 << 16))
        # of the nearest a dozen may be neighbours along the way, but not two dozen
        away, index = tree.query(places[part], k=min(24, len(some)), distance_upper_bound=line)
        away, index = away.reshape(len(away), -1), index.reshape(len(index), -1)
        between = np.abs(np.r_[far[some], np.nan][index] - far[part, None])
        doubled[part] = ((between > reach) & np.isfinite(away)).any(axis=1)
    return doubled


def _within(places: Array, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) whether the pixel at each place is in the mask."""
    column, row = np.rint(places).astype(np.intp).T
    inside = (row >= 0) & (column >= 0) & (row < mask.shape[0]) & (column < mask.shape[1])
    inside[inside] = mask[row[inside], column[inside]]
    return np.asarray(inside)


def _drawn(places: Array, edges: Indices) -> Array:
    """(k, 2): vertices, and places along the edges no further apart than `_STEP`."""
    if not len(edges):
        return places
    a, b = places[edges[:, 0]], places[edges[:, 1]]
    parts = int(np.ceil(np.linalg.norm(b - a, axis=1).max() / _STEP))
    share = (np.arange(1, parts) / max(parts, 1))[:, None, None]
    return np.concatenate([places, (a + share * (b - a)).reshape(-1, 2)])


def _distance(of: Array, to: Array) -> tuple[Array, Indices]:
    """Distance of each place to the nearest other, and its index."""
    from scipy.spatial import cKDTree

    away, index = cKDTree(to).query(of)
    return np.asarray(away), np.asarray(index, dtype=np.intp)


def owners(truth: Truth, places: Array) -> Indices:
    """(n,) int: index in the text of the letter whose ink lies at each place (n, 2) pixels; −1 where there is none."""
    column, row = np.rint(np.asarray(places)).astype(np.intp).T
    height, width = truth.labels.shape
    inside = (row >= 0) & (column >= 0) & (row < height) & (column < width)
    letters = np.full(len(row), NOBODY, dtype=np.intp)
    letters[inside] = truth.labels[row[inside], column[inside]] - 1
    return letters


def letters_right(truth: Truth, places: Array, readings: Sequence[str]) -> float:
    """Share of the page's letters that were read right.

    Parameters
    ----------
    places : (n, 2) float, pixels, vertices of the found line.
    readings : (n,) grapheme that each vertex is taken for, "" for none.  A letter is right where most of its vertices
        that are taken for any letter are taken for it.
    """
    names = np.asarray(readings, dtype=object)
    most = _most(truth, np.where(names == "", NOBODY, owners(truth, places)), names.astype(str))
    return float(np.mean([text == letter.text for letter, text in zip(truth.letters, most, strict=True)]))


def letters_identified(truth: Truth, places: Array, assignment: Indices) -> float:
    """Share of the page's letters that most of their own ink was assigned to; an equal letter beside it does not count.

    Parameters
    ----------
    places : (n, 2) float, pixels, vertices of the found line.
    assignment : (n,) int, index in the text of the letter that each vertex is given to, −1 for none.
    """
    most = _most(truth, np.where(np.asarray(assignment) < 0, NOBODY, owners(truth, places)), np.asarray(assignment))
    return float(np.mean([at == letter.at for letter, at in zip(truth.letters, most, strict=True)]))


def _most(truth: Truth, owner: Indices, readings: NDArray[Any]) -> list[Any]:
    """The reading that most places of each letter have; None for a letter without places."""
    order = np.argsort(owner, kind="stable")
    bounds = np.searchsorted(owner[order], [[letter.at, letter.at + 1] for letter in truth.letters])
    answers: list[Any] = []
    for first, last in bounds.tolist():
        values, counts = np.unique(readings[order[first:last]], return_counts=True)
        answers.append(values[counts.argmax()] if len(values) else None)
    return answers


def splits(truth: Truth, places: Array) -> SplitScore:
    """Pair found splits (k, 2), pixels, with the true ones, one to one and as near as can be, and score the pairs."""
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    true = np.array([split.xy for split in truth.splits]).reshape(-1, 2)
    places = np.asarray(places, dtype=np.float64).reshape(-1, 2)
    if not len(true) or not len(places):
        none = float(not len(true))
        return SplitScore(none, none, float(not len(places)), np.nan, np.nan)
    away = cdist(true, places) / truth.rule
    # one beyond reach costs more than any pair within it
    pairs = linear_sum_assignment(np.where(away <= _LOST, away, 1e3))
    off = away[pairs][away[pairs] <= _LOST]
    middle, worst = np.percentile(off, [50, 95]) if len(off) else (np.nan, np.nan)
    placed = int(np.count_nonzero(off <= _AT)) / len(true)
    return SplitScore(len(off) / len(true), placed, len(off) / len(places), float(middle), float(worst))


def matte(image: NDArray[Any], truth: Truth, ink: NDArray[Any], alpha: NDArray[Any], paper: NDArray[Any]) -> MatteScore:
    """Judge a matte of `image` (h, w, 3) uint8.

    Parameters
    ----------
    ink : (h, w, 3), 0–1, the ink's own colour; alpha : (h, w), 0–1; paper : (h, w, 3), 0–1, the paper below.
    """
    shown = np.flatnonzero((alpha > 0) | truth.mask)
    if not len(shown):
        return MatteScore(0.0, 0.0, 0.0, 0.0)
    take = [np.asarray(part, dtype=np.float32).reshape(-1, 3)[shown] for part in (image, ink, paper, truth.paper)]
    scan, colour, below, clean = take[0] / 255, take[1], take[2], take[3] / np.iinfo(truth.paper.dtype).max
    cover = np.asarray(alpha, dtype=np.float32).reshape(-1)[shown, None]
    again = cover * colour + (1 - cover) * below
    off = np.abs(cover[:, 0] - truth.alpha.reshape(-1)[shown])
    return MatteScore(
        float(np.abs(again - scan).max()),
        float(off.mean()),
        float(np.abs(below - clean).mean()),
        max(_halo(colour, cover, np.asarray(other, dtype=np.float32)) for other in _OTHER_PAPERS),
    )


def _halo(colour: NDArray[np.float32], cover: NDArray[np.float32], paper: NDArray[np.float32]) -> float:
    """Share of pixels (n, 3) that lighten the paper (3,) in a channel in which the page's usual ink darkens it."""
    sure = cover[:, 0] >= np.median(cover)
    darkens = np.median(colour[sure], axis=0) < paper - _DARKER
    lighter = cover * colour + (1 - cover) * paper > paper + _LIGHTER
    return float((lighter & darkens).any(axis=1).mean())
