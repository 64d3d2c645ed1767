"""How an author's own lines lie on the pages that were scanned.

A page may lie crooked in its scan: its middle slope is taken out first, and is not told from a habit of the author's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from handout.hand.scanned import ScannedHand, ScannedPage
from handout.values import Array
from handout.writing.baseline_model import USUAL_BASELINES, BaselineModel

LEAST = 5  # lines of a page that tell something
_PRIOR = 3.0  # lines that what is usual among people counts for
_LONG = 0.6  # of the median length: shorter lines tell nothing of slope and bend
_INDENTED = 1.5  # x-heights from the edge: the first line of a paragraph, not its writer's edge
_OF_PITCH = 0.35  # between lines: further the ends of one are never from its middle
# what is taken for a habit at most: beyond, lines run into each other or the page looks like an accident
_EDGE, _DRIFT, _TILT, _BEND, _PITCH = (0.03, 0.8), 0.15, (0.001, 0.025), (0.05, 0.6), (0.02, 0.3)
_BEND_MEAN, _RISE = 0.6, (0.35, 1.3)


@dataclass(frozen=True, eq=False)
class _PageLines:
    """Lines of one page, x-heights, with the page's slope taken out; y down.

    number : (n,): which line of an evenly ruled sheet each is.
    left, height : (n,): where the ink begins, and the baseline at the line's middle.
    slope, sag, reach : (n,): tangent (upwards), ends over the middle, half the length of each.
    """

    number: Array
    left: Array
    height: Array
    slope: Array
    sag: Array
    reach: Array


@lru_cache(maxsize=4)
def baseline_model(hand: ScannedHand) -> BaselineModel:
    """How the lines of a hand's pages lie; what pages of fewer than five lines cannot tell is taken to be usual."""
    pages = [_lines(hand, number, page) for number, page in enumerate(hand.pages) if page.transcript]
    pages = [page for page in pages if len(np.unique(page.number)) >= LEAST]
    if not pages:
        return USUAL_BASELINES
    edges = [_edge(page) for page in pages]
    long = [page.reach >= _LONG * np.median(page.reach) for page in pages]
    tilts = [(page.slope - np.median(page.slope[lines]))[lines] for page, lines in zip(pages, long, strict=True)]
    sags = np.concatenate([page.sag[lines] for page, lines in zip(pages, long, strict=True)])
    share = len(sags) / (len(sags) + _PRIOR)
    mean = float(np.median(sags))
    return BaselineModel(
        edge=_deviation([rest for rest, _ in edges], USUAL_BASELINES.edge, _EDGE),
        edge_memory=_memory([rest for rest, _ in edges], USUAL_BASELINES.edge_memory, 2),
        edge_drift=share * float(np.clip(np.mean([drift for _, drift in edges]), -_DRIFT, _DRIFT)),
        tilt=_deviation(tilts, USUAL_BASELINES.tilt, _TILT),
        tilt_memory=_memory(tilts, USUAL_BASELINES.tilt_memory, 1),
        most_rise=float(np.clip(_OF_PITCH * hand.pitch, *_RISE)),
        bend=_deviation([sags - mean], USUAL_BASELINES.bend, _BEND),
        bend_mean=share * float(np.clip(mean, -_BEND_MEAN, _BEND_MEAN)),
        reach=float(np.median(np.concatenate([page.reach for page in pages]))),
        pitch=_deviation([_uneven(page) for page in pages], USUAL_BASELINES.pitch, _PITCH),
    )


def _lines(hand: ScannedHand, number: int, page: ScannedPage) -> _PageLines:
    """What is known of the lines of a page that have letters."""
    size = page.x_height / page.pixel  # pixels an x-height
    begins: dict[int, float] = {}
    for glyph in hand.glyphs:
        if glyph.page == number and glyph.letter:
            x = float(page.graph.uv[glyph.vertices, 0].min())
            begins[glyph.line] = min(begins.get(glyph.line, x), x)
    lines = np.array(sorted(begins), dtype=np.intp)
    if not len(lines):
        return _PageLines(*[np.zeros(0)] * 6)
    _, slope, curve, middle, reach = page.baselines[lines].T
    skew = float(np.median(slope))
    height = page.base(lines, middle)
    # the page is turned so that its lines are level
    left = np.array([begins[int(line)] for line in lines]) + skew * height
    level = height - skew * (middle - middle.mean())
    place = np.rint((level - level.min()) / page.unit)
    return _PageLines(place, left / size, level / size, skew - slope, -curve * reach**2 / size, reach / size)


def _edge(page: _PageLines) -> tuple[Array, float]:
    """Where lines begin about the course of the left edge, and how far right that goes from line to line."""
    at_margin = np.abs(page.left - np.median(page.left)) < 2 * _INDENTED
    if at_margin.sum() < LEAST:
        return np.zeros(0), 0.0
    drift, start = _course(page.number[at_margin], page.left[at_margin])
    rest = page.left - (start + drift * page.number)
    return rest[np.abs(rest) < _INDENTED], drift


def _course(x: Array, y: Array) -> tuple[float, float]:
    """Slope and start of the straight line through the middle of all pairs of points.

    Source: Sen 1968, Estimates of the regression coefficient based on Kendall's tau.
    """
    on, up = (np.subtract.outer(of, of) for of in (x, y))
    slope = float(np.median(up[on > 0] / on[on > 0]))
    return slope, float(np.median(y) - slope * np.median(x))


def _uneven(page: _PageLines) -> Array:
    """How far lines stand from even distances."""
    return page.height - np.polyval(np.polyfit(page.number, page.height, 1), page.number)


def _deviation(rests: Sequence[Array], usual: float, bounds: tuple[float, float]) -> float:
    """Standard deviation of what is left on each page, with some lines as is usual beside them."""
    squares = np.concatenate([np.square(rest) for rest in rests])
    if not len(squares):
        return usual
    # one line that went astray is no habit
    squares = np.minimum(squares, (3 * 1.4826) ** 2 * np.median(squares))
    free = max(len(squares) - len(rests), 1)
    return float(np.clip(np.sqrt((squares.sum() + _PRIOR * usual**2) / (free + _PRIOR)), *bounds))


def _memory(rests: Sequence[Array], usual: float, parameters: int) -> float:
    """Correlation of each line with the one before, when a page's middle (1) or its course (2 parameters) is taken out.

    Source: for how much that lowers it on a page of n lines, Kendall 1954, Note on bias in the estimation of
    autocorrelation: (1 + 3ρ)/n, and (2 + 4ρ)/n.
    """
    count = sum(max(len(rest) - 1, 0) for rest in rests)
    alone = sum(float(np.square(rest).sum()) * (len(rest) - 1) / len(rest) for rest in rests if len(rest))
    if alone <= 0:
        return usual
    raw = sum(float(rest[1:] @ rest[:-1]) for rest in rests) / alone
    lines = max(sum(map(len, rests)) / len(rests), LEAST)
    correlation = float(np.clip((raw + parameters / lines) / (1 - (parameters + 2) / lines), -1.0, 1.0))
    return float(np.clip((count * correlation + _PRIOR * usual) / (count + _PRIOR), 0.0, 0.95))
