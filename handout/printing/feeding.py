"""How a page lies as the printer is fed: turned for the edge that goes in first, and moved by what it is out by."""

from __future__ import annotations

from dataclasses import dataclass

from handout.errors import InputError
from handout.printing import media
from handout.printing.media import Bounds, Turn
from handout.profiles import Printer
from handout.values import Page, Raster

# quarter turns by where they bring the upper edge of the page
_TURNS: dict[str, tuple[Turn, ...]] = {
    "leading": (),
    "left": ("left",),
    "right": ("right",),
    "trailing": ("left", "left"),
}


@dataclass(frozen=True)
class Feeding:
    """The way from a page as it is read to the sheet as it is fed.

    page : as it is read; turns : quarter turns, one after the other; nudge : mm to the right and down, before them.
    """

    page: Page
    turns: tuple[Turn, ...]
    nudge: tuple[float, float]

    @classmethod
    def of(cls, page: Page, profile: Printer) -> Feeding:
        """How this printer is fed with such a page.

        Raises
        ------
        InputError
            The flap cannot be where the profile says, the way the sheet is fed.
        """
        turn = media.turn_for(page, profile)
        flap = profile.flap or {"": "leading"}.get(turn, turn)
        able = ("left", "right") if turn else ("leading", "trailing")
        if flap not in able:
            other = "long" if profile.feed == "short" else "short"
            raise InputError(
                f"flap: {page.name or 'the page'}, fed with its {profile.feed} edge first, has its upper edge "
                f"{' or '.join(able)}, not {flap}; choose one of these, or --feed {other}."
            )
        return cls(page, _TURNS[flap], (profile.nudge.x, profile.nudge.y))

    @property
    def sheet(self) -> Page:
        """The sheet as it is fed."""
        page = self.page
        for turn in self.turns:
            page = media.turned_page(page, turn)
        return page

    def bounds(self, bounds: Bounds) -> Bounds:
        """Where (x least, y least, x greatest, y greatest), mm, of the page lies on the sheet."""
        (x, y), page = self.nudge, self.page
        found = (bounds[0] + x, bounds[1] + y, bounds[2] + x, bounds[3] + y)
        for turn in self.turns:
            found, page = media.turned_bounds(found, page, turn), media.turned_page(page, turn)
        return found

    def raster(self, raster: Raster) -> Raster:
        """The same pixels on the sheet; nothing is resampled."""
        (x, y), page = self.nudge, self.page
        moved = Raster(raster.rgba, raster.dpi, (raster.origin[0] + x, raster.origin[1] + y))
        for turn in self.turns:
            moved, page = media.turned_raster(moved, page, turn), media.turned_page(page, turn)
        return moved
