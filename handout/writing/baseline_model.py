"""How a writer's lines lie on a page: their left edge, slopes, bends and distances, on blank paper and on rules."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from handout.writing.variation import EDGE_MEMORY, USUAL, Drift


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
    pitch : of a line's height about even distances.
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

    Parameters
    ----------
    jitter : scale of all variation.
    reach : half the width between the margins, x-heights.
    """
    page = rng.normal(0.0, model.page_tilt * jitter)
    edges = Drift(jitter * model.edge, model.edge_memory, rng)
    least, most = -model.most_rise / reach, model.most_rise / reach  # a long line drifts no further than a short one
    bent = min(1.0, reach / model.reach) if model.reach else 1.0
    habit, begun = min(jitter, 1.0), count - 1 if model.edge_drift < 0 else 0
    geometries: list[LineGeometry] = []
    tilt = 0.0
    for number in range(count):
        above = rng.normal(0.0, jitter * model.pitch)
        drift = min(model.edge_drift * (number - begun), _MOST_DRIFT)
        edge = edges.next() + habit * drift
        fresh = rng.normal(0.0, jitter * model.tilt)
        tilt = model.tilt_memory * tilt + math.sqrt(1 - model.tilt_memory**2) * fresh if number else fresh
        sag = habit * model.bend_mean + rng.normal(0.0, jitter * model.bend)
        geometries.append(LineGeometry(-above, edge, max(least, min(most, page + tilt)), bent * sag))
    return geometries


# Measured on three pages of one writer on squared paper (Peraire, CC BY 4.0): lines stand .13–.17 mm about the rules
# that they follow, turned by .003–.005 against them and bent by .1 mm; small letters of 2.65 to 2.9 mm.
# The feet of letters lie across the rule there, half of the pen's line under it; other writers keep clear of it.
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
        """The usual distance of two rules, mm; of a single one the height of a sheet that has no other."""
        heights = [height for height, _ in self.rules]
        return float(np.median(np.diff(heights))) if len(heights) > 1 else 1000.0

    def within(self, top: float, bottom: float, reach: float) -> tuple[tuple[float, float], ...]:
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
        tilt_memory=0.0,
        page_tilt=0.0,
        most_rise=min(model.most_rise, 2 * _WANDERS / _MEASURED_X_HEIGHT),
        bend=min(model.bend, _BEND / _MEASURED_X_HEIGHT),
        bend_mean=0.0,
    )
