"""Where writing goes on a sheet: margins, letter size, line distance, and how lines lie there.

`BaselineModel` says how a writer's lines lie: their left edge, slopes, bends and distances, on blank paper and on
rules; `author_baselines` learns it from the pages of a scanned hand.  A page may lie crooked in its scan: its middle
slope is taken out first, and is not told from a habit of the author's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from handout.errors import InputError
from handout.values import Array, Page
from handout.writing.variation import EDGE_MEMORY, PITCH_MEMORY, USUAL, Drift

if TYPE_CHECKING:
    from handout.hand.scanned import ScannedHand, ScannedPage


@dataclass(frozen=True)
class BaselineModel:
    """Standard deviations in x-heights unless said otherwise; those of `variation.Variation` where nothing is known.

    edge, edge_memory : of the left edge about its course, and correlation with the line before.
    edge_drift : by how much each line begins further right than the one before.
    page_tilt : tangent, slope of all lines of a page together.
    tilt, tilt_memory : tangent, slope of a line about its page's; correlation with the line before.
    most_rise : how far the ends of a line leave its middle, at most.
    bend, bend_mean : sag of a line from its ends to its middle.
    reach : half the length of the writer's own lines; shorter ones bend less; 0: all lines bend alike.
    pitch, pitch_memory : of a line's height about even distances; correlation with the line before: who follows rules
        or a sheet below has none, on blank paper each line is laid by the one above.
    closer : than usual two lines come at most; people look where the line above is.
    line_rise : of a drawn hand's letters over their line, as they wander along it; see `variation.Variation`.
    """

    edge: float = USUAL.edge
    edge_memory: float = EDGE_MEMORY
    edge_drift: float = 0.0
    page_tilt: float = 0.5 * USUAL.tilt
    tilt: float = USUAL.tilt
    tilt_memory: float = 0.0
    most_rise: float = 0.35
    bend: float = USUAL.bend
    bend_mean: float = 0.0
    reach: float = 0.0
    pitch: float = USUAL.pitch
    pitch_memory: float = PITCH_MEMORY
    closer: float = math.inf
    line_rise: float = USUAL.line_rise


USUAL_BASELINES = BaselineModel()
_MOST_DRIFT = 2.0  # x-heights that the left edge moves over a page


@dataclass(frozen=True)
class LineGeometry:
    """How one line lies: x-heights above its even place, from the left margin, and its slope (tangent) and sag."""

    above: float
    edge: float
    slope: float
    sag: float


def line_geometries(
    model: BaselineModel, count: int, jitter: float, reach: float, rng: np.random.Generator
) -> list[LineGeometry]:
    """How the lines of a page lie, from its first to its last.

    jitter : scale of all variation.
    reach : half the width between the margins, x-heights.
    """
    page = rng.normal(0.0, model.page_tilt * jitter)
    edges = Drift(jitter * model.edge, model.edge_memory, rng)
    heights = Drift(jitter * model.pitch, model.pitch_memory, rng)
    least, most = -model.most_rise / reach, model.most_rise / reach  # a long line drifts no further than a short one
    bent = min(1.0, reach / model.reach) if model.reach else 1.0
    habit, begun = min(jitter, 1.0), count - 1 if model.edge_drift < 0 else 0
    geometries: list[LineGeometry] = []
    tilt, below = 0.0, -math.inf
    for number in range(count):
        below = max(heights.draw_next(rng), below - model.closer)
        drift = min(model.edge_drift * (number - begun), _MOST_DRIFT)
        edge = edges.draw_next(rng) + habit * drift
        fresh = rng.normal(0.0, jitter * model.tilt)
        tilt = model.tilt_memory * tilt + math.sqrt(1 - model.tilt_memory**2) * fresh if number else fresh
        sag = habit * model.bend_mean + rng.normal(0.0, jitter * model.bend)
        geometries.append(LineGeometry(-below, edge, max(least, min(most, page + tilt)), bent * sag))
    return geometries


# Measured on three pages of one writer on squared paper (Peraire, CC BY 4.0): lines stand .13–.17 mm about the rules
# that they follow, turned by .003–.005 against them and bent by .1 mm; small letters of 2.65 to 2.9 mm.
# The feet of letters lie across the rule there, half of the pen's line under it; other writers keep clear of it.
# Along a line letters wander no more about it: the mean of seven feet .24 mm (deviation), of 63 people's pages .20 to
# .35, half of them under .25 (Copiste d'un jour); with the .16 x-heights of `variation.USUAL` it is .37.
FOOT_ABOVE_RULE = 0.15  # mm from the middle of a letter's foot down to its rule
_WANDERS, _TILT, _BEND = 0.15, 0.004, 0.1  # mm, tangent, mm
_MEASURED_X_HEIGHT = 2.8  # mm: small letters that those lengths are of


@dataclass(frozen=True)
class Ruling:
    """Lines to write on, from the upper one down.

    rules : (height, slope) of each: mm from the top of the page where it crosses the page's middle, and its tangent,
        down the page where it is positive.
    """

    rules: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if not self.rules or (np.diff([height for height, _ in self.rules]) <= 0).any():
            raise ValueError("a ruling has rules, each below the one before")

    @property
    def pitch(self) -> float:
        """The usual distance of two rules, mm; 1000 if there is only one."""
        heights = [height for height, _ in self.rules]
        return float(np.median(np.diff(heights))) if len(heights) > 1 else 1000.0

    def rules_within(self, top: float, bottom: float, reach: float) -> tuple[tuple[float, float], ...]:
        """The rules that lie between two heights, mm, up to `reach` mm left and right of the page's middle."""
        return tuple(
            (height, slope)
            for height, slope in self.rules
            if height - abs(slope) * reach >= top - 1e-9 and height + abs(slope) * reach <= bottom + 1e-9
        )


def on_rules(model: BaselineModel) -> BaselineModel:
    """How lines lie where there are rules to follow: hardly further off them than people's do."""
    return replace(
        model,
        pitch=min(model.pitch, _WANDERS / _MEASURED_X_HEIGHT),
        tilt=min(model.tilt, _TILT),
        pitch_memory=0.0,
        tilt_memory=0.0,
        page_tilt=0.0,
        most_rise=min(model.most_rise, 2 * _WANDERS / _MEASURED_X_HEIGHT),
        bend=min(model.bend, _BEND / _MEASURED_X_HEIGHT),
        bend_mean=0.0,
        line_rise=min(model.line_rise, _WANDERS / _MEASURED_X_HEIGHT),
    )


ASCENT, DESCENT = 2.15, 1.15  # x-heights above the first baseline and below the last
Align = Literal["left", "right", "centre", "ragged"]


@dataclass(frozen=True)
class Layout:
    """How a text is set on a page.

    page : the sheet.
    margin : (top, right, bottom, left), mm.
    x_height : height of a small letter without ascender, mm.
    line_spacing : distance of baselines, mm; None: the hand's own.
    align : "ragged" is a left edge that wanders as people's does; "left" is a straighter one.
    fit : shrink what does not fit (size first, then spacing) instead of refusing it.
    unbroken : shrink lines that are too long rather than break them, while they stay legible.
    jitter : scale of all variation: 1 as people vary, 0 the ideal form.
    ruling : the rules of a lined sheet that lines are written on; `line_spacing` says nothing then.
    rewritten : words that are written again while all others stay as they are: where each begins in the text, and how
        many times.
    at : a place in the text, graphemes from 0: only the page that holds it is placed; past the end the last one.
    shrunk : its size as a share of that which was asked for.

    Raises InputError: margins that leave no room, or an x-height or line distance outside its bounds.
    """

    page: Page
    margin: tuple[float, float, float, float] = (20.0, 20.0, 20.0, 20.0)
    x_height: float = 2.5
    line_spacing: float | None = None
    align: Align = "ragged"
    fit: bool = False
    unbroken: bool = False
    jitter: float = 1.0
    ruling: Ruling | None = None
    rewritten: tuple[tuple[int, int], ...] = ()
    at: int | None = None
    shrunk: float = 1.0

    def __post_init__(self) -> None:
        top, right, bottom, left = self.margin
        if min(self.margin) < 0:
            raise InputError(f"margin: {min(self.margin):g} mm is negative; margins are 0 mm or more.")
        if self.width < 5 or self.height < 5:
            raise InputError(
                f"The margins ({top:g}, {right:g}, {bottom:g}, {left:g} mm) leave {max(self.width, 0):g} x "
                f"{max(self.height, 0):g} mm of the {self.page.width:g} x {self.page.height:g} mm page; "
                "at least 5 x 5 mm are needed: use smaller margins or a larger page."
            )
        if not 0.3 <= self.x_height <= 100:
            raise InputError(f"x-height: {self.x_height:g} mm is outside 0.3 to 100 mm.")
        if self.line_spacing is not None and not self.x_height <= self.line_spacing <= 1000:
            raise InputError(
                f"line spacing: {self.line_spacing:g} mm is outside {self.x_height:g} mm (the x-height) to 1000 mm."
            )
        if not 0 <= self.jitter <= 5:
            raise InputError(f"variation: {self.jitter:g} is outside 0 to 5 (1 is as people vary).")

    @property
    def told(self) -> dict[str, list[float]]:
        """What a page tells of its size: nothing where it is that which was asked for."""
        return {"shrunk": [round(self.shrunk, 2)]} if self.shrunk < 1 else {}

    @property
    def width(self) -> float:
        """Room between the left and right margin, mm."""
        return self.page.width - self.margin[1] - self.margin[3]

    @property
    def height(self) -> float:
        """Room between the top and bottom margin, mm."""
        return self.page.height - self.margin[0] - self.margin[2]

    @property
    def room(self) -> float:
        """Room between the left and right margin, x-heights."""
        return self.width / self.x_height

    def baseline_distance(self, pitch: float) -> float:
        """Distance of baselines, mm; `pitch` is the usual one of the hand, x-heights."""
        if self.ruling is not None:
            return self.ruling.pitch
        return self.line_spacing if self.line_spacing is not None else pitch * self.x_height

    def lines_a_page(self, pitch: float) -> int:
        """How many lines one page holds."""
        if self.ruling is not None:
            return len(self.rules)
        height = self.height - (ASCENT + DESCENT) * self.x_height
        return 1 + math.floor(height / self.baseline_distance(pitch) + 1e-9) if height >= 0 else 0

    @property
    def rules(self) -> tuple[tuple[float, float], ...]:
        """The rules of a page that have room for a line between the margins; none on a blank page."""
        if self.ruling is None:
            return ()
        top, right, bottom, left = self.margin
        upper, lower = top + ASCENT * self.x_height, self.page.height - bottom - DESCENT * self.x_height
        middle = self.page.width / 2
        reach = max(middle - left, middle - right, 0.0)
        return self.ruling.rules_within(upper + FOOT_ABOVE_RULE, lower + FOOT_ABOVE_RULE, reach)


@dataclass(frozen=True)
class LayoutHabitSettings:
    """What is taken for a habit of an author's lines; bounds, set by eye, beyond which lines run into each other or the
    page looks like an accident."""

    least: int = 5  # lines of a page that tell something
    prior: float = 3.0  # lines that what is usual among people counts for
    long: float = 0.6  # of the median length: shorter lines tell nothing of slope and bend
    indented: float = 1.5  # x-heights from the edge: the first line of a paragraph, not its writer's edge
    of_pitch: float = 0.35  # between lines: further the ends of one are never from its middle
    edge: tuple[float, float] = (0.03, 0.8)
    drift: float = 0.15
    tilt: tuple[float, float] = (0.001, 0.025)
    bend: tuple[float, float] = (0.05, 0.6)
    distance: tuple[float, float] = (0.03, 0.42)  # of lines
    pitch: float = 0.6
    bend_mean: float = 0.6
    rise: tuple[float, float] = (0.35, 1.3)


HABITS = LayoutHabitSettings()


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
def author_baselines(hand: ScannedHand) -> BaselineModel:
    """How the lines of a hand's pages lie; what pages of fewer than five lines cannot tell is taken to be usual."""
    pages = [_lines(hand, number, page) for number, page in enumerate(hand.pages) if page.transcript]
    pages = [page for page in pages if len(np.unique(page.number)) >= HABITS.least]
    if not pages:
        return USUAL_BASELINES
    edges = [_edge(page) for page in pages]
    long = [page.reach >= HABITS.long * np.median(page.reach) for page in pages]
    tilts = [(page.slope - np.median(page.slope[lines]))[lines] for page, lines in zip(pages, long, strict=True)]
    sags = np.concatenate([page.sag[lines] for page, lines in zip(pages, long, strict=True)])
    share = len(sags) / (len(sags) + HABITS.prior)
    mean = float(np.median(sags))
    pitch, memory, closer = _heights(pages)
    return BaselineModel(
        edge=_deviation([rest for rest, _ in edges], USUAL_BASELINES.edge, HABITS.edge, 2),
        edge_memory=_memory([rest for rest, _ in edges], USUAL_BASELINES.edge_memory, 2),
        edge_drift=share * float(np.clip(np.mean([drift for _, drift in edges]), -HABITS.drift, HABITS.drift)),
        tilt=_deviation(tilts, USUAL_BASELINES.tilt, HABITS.tilt),
        tilt_memory=_memory(tilts, USUAL_BASELINES.tilt_memory, 1),
        most_rise=float(np.clip(HABITS.of_pitch * hand.pitch, *HABITS.rise)),
        bend=_deviation([sags - mean], USUAL_BASELINES.bend, HABITS.bend),
        bend_mean=share * float(np.clip(mean, -HABITS.bend_mean, HABITS.bend_mean)),
        reach=float(np.median(np.concatenate([page.reach for page in pages]))),
        pitch=pitch,
        pitch_memory=memory,
        closer=closer,
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
    at_margin = np.abs(page.left - np.median(page.left)) < 2 * HABITS.indented
    if at_margin.sum() < HABITS.least:
        return np.zeros(0), 0.0
    drift, start = _course(page.number[at_margin], page.left[at_margin])
    rest = page.left - (start + drift * page.number)
    return rest[np.abs(rest) < HABITS.indented], drift


def _course(x: Array, y: Array) -> tuple[float, float]:
    """Slope and start of the straight line through the middle of all pairs of points.

    Source: Sen 1968, Estimates of the regression coefficient based on Kendall's tau.
    """
    on, up = (np.subtract.outer(of, of) for of in (x, y))
    slope = float(np.median(up[on > 0] / on[on > 0]))
    return slope, float(np.median(y) - slope * np.median(x))


def _heights(pages: Sequence[_PageLines]) -> tuple[float, float, float]:
    """`BaselineModel.pitch`, `pitch_memory` and `closer`; the first told by distances, which no slow course makes
    smaller."""
    uneven = [page.height - np.polyval(np.polyfit(page.number, page.height, 1), page.number) for page in pages]
    memory = _memory(uneven, USUAL_BASELINES.pitch_memory, 2)
    apart = [own for page in pages if len(own := np.diff(page.height)[np.diff(page.number) == 1])]
    ratio = math.sqrt(2 * (1 - memory))  # of the spread of distances to that of heights
    spread = _deviation([own - own.mean() for own in apart], USUAL_BASELINES.pitch * ratio, HABITS.distance)
    closer = max((float(np.median(own) - own.min()) for own in apart), default=math.inf)
    return min(spread / ratio, HABITS.pitch), memory, closer


def _deviation(rests: Sequence[Array], usual: float, bounds: tuple[float, float], parameters: int = 1) -> float:
    """Standard deviation of what is left on each page when its `parameters` are taken out, with some lines as is usual
    beside them."""
    squares = np.concatenate([np.zeros(0), *(np.square(rest) for rest in rests)])
    if not len(squares):
        return usual
    # one line that went astray is no habit
    squares = np.minimum(squares, (3 * 1.4826) ** 2 * np.median(squares))
    free = max(len(squares) - parameters * len(rests), 1)
    return float(np.clip(np.sqrt((squares.sum() + HABITS.prior * usual**2) / (free + HABITS.prior)), *bounds))


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
    lines = max(sum(map(len, rests)) / len(rests), HABITS.least)
    correlation = float(np.clip((raw + parameters / lines) / (1 - (parameters + 2) / lines), -1.0, 1.0))
    return float(np.clip((count * correlation + HABITS.prior * usual) / (count + HABITS.prior), 0.0, 0.95))
