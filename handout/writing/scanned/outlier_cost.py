"""The cost of glyphs that are not like others of their letter: with a neighbour's stroke, or without one of their own.

Where a line of writing is cut wrongly the reading may still be sure of itself; what gives it away is the size, and
that a glyph looks more like other letters than like its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.hand.letter_classes import ASCENDING, DESCENDING, DOTTED
from handout.hand.scanned import ScannedHand
from handout.values import Array, Indices


@dataclass(frozen=True)
class OutlierSettings:
    """When a glyph is unlike its kind, and what that costs; all weights and bounds are set by eye."""

    most: float = 6.0  # cost: more than any other glyph of the letter costs
    # size
    few: int = 4  # glyphs of a letter, fewer than which have no usual size
    floor: float = 0.15  # x-heights: spread that any letter may have
    usual: float = 2.0  # spreads from the median that are still usual
    rise: float = 1.2  # cost for each spread more
    # likeness
    kin: int = 6  # glyphs of a letter, fewer than which need not be alike
    nearest: int = 2  # glyphs that one is compared with, of its letter and of others
    strange: float = 0.35  # log of how much nearer others may be than its own kind
    steep: float = 6.0  # cost for each unit more
    share: float = 0.35  # of a letter's glyphs that one should be like: several cut in one wrong way are alike too
    alien: float = 0.2  # log of how much further from those it may be than is usual
    steeper: float = 9.0  # cost for each unit more
    # stems
    apart: float = 0.12  # x-heights between a stem and its dot
    long: float = 80.0  # per cent: this much of a letter's stems are no longer than its usual one
    cut: float = 0.65  # share of that length below which a stem is cut
    short: float = 20.0  # cost for each unit less


SETTINGS = OutlierSettings()
_BLUR = 0.2  # x-heights, of what a glyph looks like from afar
_ACROSS, _UP = np.arange(-1.6, 1.61, _BLUR), np.arange(-1.2, 2.41, _BLUR)  # where a glyph is looked at, x-heights

Looks = NDArray[np.float32]  # half the room and half the time, of what takes most of both


def outlier_cost(hand: ScannedHand, bodies: Sequence[Indices]) -> Array:
    """(n,) float ≥ 0: cost of glyphs with the given bodies for not being like others of their letters."""
    letters = np.array([glyph.letter for glyph in hand.glyphs])
    x, y, each, first = _lines(hand, bodies)
    sizes, looks = _sizes(x, y, each, first), _blurred_lines(x, y, each, first)
    length = np.einsum("ij,ij->i", looks, looks)
    cost = np.zeros(len(bodies))
    for letter in set(letters.tolist()) - {""}:
        same_letter = letters == letter
        own_y = [y[first[number] : first[number + 1]] for number in np.flatnonzero(same_letter)]
        stems = np.array([_stem_top(line) for line in own_y]) if letter in DOTTED else np.zeros(0)
        lost = _lost_stem_cost(letter, sizes[same_letter], stems)
        odd = np.stack([_size_cost(sizes[same_letter]), _likeness_cost(looks, length, same_letter), lost])
        cost[same_letter] = np.clip(odd.max(axis=0), 0.0, SETTINGS.most)
    return cost


def _lost_stem_cost(letter: str, sizes: Array, stems: Array) -> Array:
    """(k,): cost of the sizes (k, 4) of glyphs of one letter for a stem that others have and they have not.

    stems : (k,) the tops of the stems of a letter with a dot.
    """
    if letter not in ASCENDING | DESCENDING | DOTTED:
        return np.zeros(len(sizes))
    reach = stems if letter in DOTTED else sizes[:, 1] if letter in ASCENDING else -sizes[:, 2]
    usual = float(np.percentile(reach, SETTINGS.long))
    return np.asarray(SETTINGS.short * (SETTINGS.cut - reach / usual)) if usual > 0 else np.zeros(len(sizes))


def _stem_top(y: Array) -> float:
    """The top of what a line has under its dot."""
    rising = np.sort(y)
    gaps = np.flatnonzero(np.diff(rising) > SETTINGS.apart)
    return float(rising[gaps[0]] if len(gaps) else rising[-1])


def _size_cost(sizes: Array) -> Array:
    """(k,): cost of the sizes (k, 4) of glyphs of one letter."""
    if len(sizes) < SETTINGS.few:
        return np.zeros(len(sizes))
    away = np.abs(sizes - np.median(sizes, axis=0))
    spread = 1.48 * np.median(away, axis=0) + SETTINGS.floor
    return np.asarray(SETTINGS.rise * ((away / spread).max(axis=1) - SETTINGS.usual))


def _likeness_cost(looks: Looks, length: Looks, same_letter: NDArray[np.bool_]) -> Array:
    """(k,): cost of the `own` glyphs, which are of one letter, for being nearer to those of others.

    length : (n,): squares of the lengths of looks (n, points).
    """
    if same_letter.sum() < SETTINGS.kin or (~same_letter).sum() < SETTINGS.nearest:
        return np.zeros(int(same_letter.sum()))
    others = -2 * looks[same_letter] @ looks.T
    others += length[same_letter][:, None]
    others += length
    np.maximum(others, 0.0, out=others)
    kin = others[:, same_letter]
    np.fill_diagonal(kin, np.inf)
    others[:, same_letter] = np.inf
    near, far = (_nearest(part, SETTINGS.nearest).mean(axis=1) + 1e-9 for part in (kin, others))
    like = max(SETTINGS.nearest, round(SETTINGS.share * len(kin)))
    most = _nearest(kin, like).max(axis=1) + 1e-9
    alien = SETTINGS.steeper * (np.log(most / np.median(most)) - SETTINGS.alien)
    return np.asarray(np.maximum(SETTINGS.steep * (np.log(near / far) - SETTINGS.strange), alien))


def _nearest(square: Looks, count: int) -> Looks:
    """(k, count): the least of the distances whose squares are given, in any order."""
    return np.sqrt(np.partition(square, count - 1, axis=1)[:, :count])


def _lines(hand: ScannedHand, bodies: Sequence[Indices]) -> tuple[Array, Array, Array, Indices]:
    """x and y of all bodies' vertices, x-heights, one body behind the other; how much of the line a vertex of each
    stands for; and where each body begins, and the last one ends."""
    first = np.cumsum([0, *map(len, bodies)])
    count = np.diff(first)
    pages = [hand.pages[glyph.page] for glyph in hand.glyphs]
    unit, each = np.array([(page.pitch / page.x_height, page.pixel / page.x_height) for page in pages]).reshape(-1, 2).T
    places = hand.placed(
        np.repeat(np.arange(len(bodies)), count), np.concatenate([np.zeros(0, dtype=np.intp), *bodies])
    )
    x, y = places.T * np.repeat(unit, count)
    return x - np.repeat(np.add.reduceat(x, first[:-1]) / count, count), y, each, first


def _sizes(x: Array, y: Array, each: Array, first: Indices) -> Array:
    """(n, 4): width, top, bottom and half the length of every line."""
    begin = first[:-1]
    wide = np.maximum.reduceat(x, begin) - np.minimum.reduceat(x, begin)
    return np.column_stack(
        [wide, np.maximum.reduceat(y, begin), np.minimum.reduceat(y, begin), np.diff(first) * each / 2]
    )


def _blurred_lines(x: Array, y: Array, each: Array, first: Indices) -> Looks:
    """(n, points): what lines look like from afar: square roots of their length around the points of a grid."""
    across, up = (
        np.exp(np.square(((at[:, None] - grid) / _BLUR).astype(np.float32)) / -2)
        for at, grid in ((x, _ACROSS), (y, _UP))
    )
    looks = np.array([up[a:b].T @ across[a:b] for a, b in pairwise(first.tolist())])
    return np.asarray(np.sqrt(looks.reshape(len(each), -1) * each[:, None].astype(np.float32)))
