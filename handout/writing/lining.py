"""How a writer's lines lie on a page: their left edge, slopes, bends and distances."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from handout.writing.variation import EDGE_MEMORY, USUAL, Drift


@dataclass(frozen=True)
class Lining:
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


HOUSE = Lining()
_MOST_DRIFT = 2.0  # x-heights that the left edge moves over a page


@dataclass(frozen=True)
class Lie:
    """How one line lies: x-heights above its even place, from the left margin, and its slope (tangent) and sag."""

    above: float
    edge: float
    slope: float
    sag: float


def lies(lining: Lining, count: int, jitter: float, reach: float, rng: np.random.Generator) -> list[Lie]:
    """How the lines of a page lie, from its first to its last.

    Parameters
    ----------
    jitter : scale of all variation.
    reach : half the width between the margins, x-heights.
    """
    page = rng.normal(0.0, lining.page_tilt * jitter)
    edges = Drift(jitter * lining.edge, lining.edge_memory, rng)
    least, most = -lining.most_rise / reach, lining.most_rise / reach  # a long line drifts no further than a short one
    bent = min(1.0, reach / lining.reach) if lining.reach else 1.0
    habit, begun = min(jitter, 1.0), count - 1 if lining.edge_drift < 0 else 0
    found: list[Lie] = []
    tilt = 0.0
    for number in range(count):
        above = rng.normal(0.0, jitter * lining.pitch)
        drift = min(lining.edge_drift * (number - begun), _MOST_DRIFT)
        edge = edges.next() + habit * drift
        fresh = rng.normal(0.0, jitter * lining.tilt)
        tilt = lining.tilt_memory * tilt + math.sqrt(1 - lining.tilt_memory**2) * fresh if number else fresh
        sag = habit * lining.bend_mean + rng.normal(0.0, jitter * lining.bend)
        found.append(Lie(-above, edge, max(least, min(most, page + tilt)), bent * sag))
    return found
