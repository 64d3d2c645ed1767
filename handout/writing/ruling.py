"""The rules of a lined sheet that a text is written on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handout.writing.lining import Lining

# Measured on three pages of one writer on squared paper (Peraire, CC BY 4.0): lines stand .13–.17 mm about the rules
# that they follow, turned by .003–.005 against them and bent by .1 mm; small letters of 2.65 to 2.9 mm.
# The feet of letters lie across the rule there, half of the pen's line under it; other writers keep clear of it.
ABOVE = 0.15  # mm from the middle of a letter's foot down to its rule
_WANDERS, _TILT, _BEND = 0.15, 0.004, 0.1  # mm, tangent, mm
_SMALL = 2.8  # mm: small letters that those lengths are of


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


def on_rules(lining: Lining) -> Lining:
    """How lines lie where there are rules to follow: hardly further off them than people's do."""
    return replace(
        lining,
        pitch=min(lining.pitch, _WANDERS / _SMALL),
        tilt=min(lining.tilt, _TILT),
        tilt_memory=0.0,
        page_tilt=0.0,
        most_rise=min(lining.most_rise, 2 * _WANDERS / _SMALL),
        bend=min(lining.bend, _BEND / _SMALL),
        bend_mean=0.0,
    )
