"""Where writing goes on a sheet: margins, letter size, line distance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from handout.errors import InputError
from handout.values import Page
from handout.writing.baseline_model import FOOT_ABOVE_RULE, Ruling

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
    jitter : scale of all variation: 1 as people vary, 0 the ideal form.
    ruling : the rules of a lined sheet that lines are written on; `line_spacing` says nothing then.

    Raises
    ------
    InputError
        Margins that leave no room, or an x-height or line distance outside its bounds.
    """

    page: Page
    margin: tuple[float, float, float, float] = (20.0, 20.0, 20.0, 20.0)
    x_height: float = 2.5
    line_spacing: float | None = None
    align: Align = "ragged"
    fit: bool = False
    jitter: float = 1.0
    ruling: Ruling | None = None

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
        """The rules of a page on which there is room for a line between the margins; none where it is blank."""
        if self.ruling is None:
            return ()
        top, right, bottom, left = self.margin
        upper, lower = top + ASCENT * self.x_height, self.page.height - bottom - DESCENT * self.x_height
        middle = self.page.width / 2
        reach = max(middle - left, middle - right, 0.0)
        return self.ruling.within(upper + FOOT_ABOVE_RULE, lower + FOOT_ABOVE_RULE, reach)
