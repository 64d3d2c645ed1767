"""Glyphs that are not like the others of their letter: a stroke of the neighbour's in them, or one of their own lost.

Where a line of writing is cut wrongly the reading may still be sure of itself; what gives it away is the size, and
that a glyph looks more like other letters than like its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import ScannedHand
from handout.values import Array, Indices

_FEW = 4  # glyphs of a letter, fewer than which have no usual size
_FLOOR = 0.15  # x-heights: spread that any letter may have
_USUAL = 2.0  # spreads from the median that are still usual
_RISE, _MOST = 1.2, 6.0  # cost for each spread more, and the most of it: more than any other glyph of the letter costs
_KIN = 6  # glyphs of a letter, fewer than which need not be alike
_NEAREST = 2  # glyphs that one is compared with, of its letter and of others
_STRANGE, _STEEP = 0.35, 6.0  # log of how much nearer others may be than its own kind; cost for each unit more
_SHARE = 0.35  # of a letter's glyphs that one should be like: several that are cut in one wrong way are alike too
_ALIEN, _STEEPER = 0.2, 9.0  # log of how much further from those it may be than is usual; cost for each unit more
_TALL, _DEEP, _DOTTED = frozenset("bdfhklt"), frozenset("gpqy"), frozenset("ij")
_APART = 0.12  # x-heights between a stem and its dot
_LONG, _CUT = 80, 0.65  # per cent; share of that length below which a stem is cut
_SHORT = 20.0  # cost for each unit less
_BLUR = 0.2  # x-heights
_ACROSS, _UP = np.arange(-1.6, 1.61, _BLUR), np.arange(-1.2, 2.41, _BLUR)  # where a glyph is looked at, x-heights


def oddity(hand: ScannedHand, bodies: Sequence[Indices]) -> Array:
    """(n,) float ≥ 0: cost of glyphs with the given bodies for not being like others of their letters."""
    letters = np.array([glyph.letter for glyph in hand.glyphs])
    lines = [_line(hand, number, body) for number, body in enumerate(bodies)]
    sizes = np.array([_size(*line) for line in lines]).reshape(-1, 4)
    looks = np.array([_look(*line) for line in lines]).reshape(len(lines), -1)
    cost = np.zeros(len(bodies))
    for letter in set(letters.tolist()) - {""}:
        own = letters == letter
        stems = np.array([_stem(lines[number][1]) for number in np.flatnonzero(own)])
        odd = np.stack([_unusual(sizes[own]), _strange(looks, own), _short(letter, sizes[own], stems)])
        cost[own] = np.clip(odd.max(axis=0), 0.0, _MOST)
    return cost


def _short(letter: str, sizes: Array, stems: Array) -> Array:
    """(k,): cost of the sizes (k, 4) of glyphs of one letter for a stem (k,) that others have and they have not."""
    if letter not in _TALL | _DEEP | _DOTTED:
        return np.zeros(len(sizes))
    reach = stems if letter in _DOTTED else sizes[:, 1] if letter in _TALL else -sizes[:, 2]
    usual = float(np.percentile(reach, _LONG))
    return np.asarray(_SHORT * (_CUT - reach / usual)) if usual > 0 else np.zeros(len(sizes))


def _stem(y: Array) -> float:
    """The top of what a line has under its dot."""
    rising = np.sort(y)
    gaps = np.flatnonzero(np.diff(rising) > _APART)
    return float(rising[gaps[0]] if len(gaps) else rising[-1])


def _unusual(sizes: Array) -> Array:
    """(k,): cost of the sizes (k, 4) of glyphs of one letter."""
    if len(sizes) < _FEW:
        return np.zeros(len(sizes))
    away = np.abs(sizes - np.median(sizes, axis=0))
    spread = 1.48 * np.median(away, axis=0) + _FLOOR
    return np.asarray(_RISE * ((away / spread).max(axis=1) - _USUAL))


def _strange(looks: Array, own: NDArray[np.bool_]) -> Array:
    """(k,): cost of the `own` glyphs, which are of one letter, for being nearer to those of others."""
    if own.sum() < _KIN or (~own).sum() < _NEAREST:
        return np.zeros(int(own.sum()))
    mine = looks[own]
    square = (mine**2).sum(axis=1)[:, None] + (looks**2).sum(axis=1) - 2 * mine @ looks.T
    away = np.sqrt(np.maximum(square, 0.0))
    kin, others = away[:, own], away[:, ~own]
    np.fill_diagonal(kin, np.inf)
    near, far = (np.sort(part, axis=1)[:, :_NEAREST].mean(axis=1) + 1e-9 for part in (kin, others))
    most = np.sort(kin, axis=1)[:, : max(_NEAREST, round(_SHARE * len(kin)))].max(axis=1) + 1e-9
    alien = _STEEPER * (np.log(most / np.median(most)) - _ALIEN)
    return np.asarray(np.maximum(_STEEP * (np.log(near / far) - _STRANGE), alien))


def _line(hand: ScannedHand, number: int, body: Indices) -> tuple[Array, Array, float]:
    """x and y of a body's vertices, and how much of the line each stands for; x-heights."""
    glyph = hand.glyphs[number]
    page = hand.pages[glyph.page]
    x, y = page.to_line(glyph.line, page.graph.uv[body]).T * (page.pitch / page.x_height)
    return x - x.mean(), y, page.pixel / page.x_height


def _size(x: Array, y: Array, each: float) -> tuple[float, float, float, float]:
    """Width, top, bottom and half the length of a line."""
    return float(np.ptp(x)), float(y.max()), float(y.min()), len(x) * each / 2


def _look(x: Array, y: Array, each: float) -> Array:
    """What a line looks like from afar: square roots of its length around the points of a grid."""
    across, up = (np.exp(-(((at[:, None] - grid) / _BLUR) ** 2) / 2) for at, grid in ((x, _ACROSS), (y, _UP)))
    return np.asarray(np.sqrt(up.T @ across * each).ravel())
