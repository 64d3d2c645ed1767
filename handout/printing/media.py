"""A page as the printer is fed with it: what the sheet is called, which edge goes in first, what can be printed on.

Sizes and their names are in `handout.page_sizes`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import msgspec
import numpy as np

from handout import page_sizes
from handout.errors import InputError
from handout.inking.device_pixels import DevicePixels
from handout.profiles import Margins, Nudge, Printer
from handout.values import Page

Bounds = tuple[float, float, float, float]
Turn = Literal["", "left", "right"]

# quarter turns by where they bring the upper edge of the page
_TURNS: dict[str, tuple[Turn, ...]] = {
    "leading": (),
    "left": ("left",),
    "right": ("right",),
    "trailing": ("left", "left"),
}
_ROUNDING = 1e-6  # mm: nearer to a margin than this is on it


def name(sheet: Page) -> str:
    """The name of a sheet as it is fed, for ``lp -o media=``.

    A sheet that lies with its shorter side across the feed has its name from PWG 5101.1; any other, or one fed with
    its longer side first, is a custom size, of which the first number is always the side across the feed.
    """
    size = page_sizes.size_of(sheet)
    if size is not None and page_sizes.is_near(sheet.width, size.short):
        return size.media
    return f"Custom.{sheet.width:g}x{sheet.height:g}mm"


def is_envelope(page: Page) -> bool:
    """Whether the page, either way up, has the size of an envelope of PWG 5101.1."""
    size = page_sizes.size_of(page)
    return size is not None and size.envelope


def printer_for(page: Page, profile: Printer) -> Printer:
    """The printer as it is when fed with this page: with the tray and the margins of its envelopes, if it is one."""
    special = profile.envelope
    if not is_envelope(page):
        return profile
    return msgspec.structs.replace(
        profile, source=special.source or profile.source, margins=special.margins or profile.margins
    )


def turn_for(page: Page, profile: Printer) -> Turn:
    """How a page has to be turned to lie as this printer is fed; "" where it already does."""
    wide = page.width > page.height
    turned = page.width < page.height if profile.feed == "long" else wide
    return profile.turn if turned else ""


def turned_page(page: Page, turn: Turn) -> Page:
    """The sheet after a quarter turn (or none)."""
    return Page(page.height, page.width, page.name) if turn else page


def turned_bounds(bounds: Bounds, page: Page, turn: Turn) -> Bounds:
    """Where (x least, y least, x greatest, y greatest), mm, of `page` lies on the turned sheet."""
    x0, y0, x1, y1 = bounds
    if turn == "left":
        return y0, page.width - x1, y1, page.width - x0
    if turn == "right":
        return page.height - y1, x0, page.height - y0, x1
    return bounds


def turned_pixels(pixels: DevicePixels, page: Page, turn: Turn) -> DevicePixels:
    """The same pixels on the turned sheet; nothing is resampled."""
    if not turn:
        return pixels
    height, width = pixels.rgb.shape[:2]
    pitch = 25.4 / pixels.dpi
    x, y = pixels.origin
    bounds = turned_bounds((x, y, x + width * pitch, y + height * pitch), page, turn)
    rgb = np.ascontiguousarray(np.rot90(pixels.rgb, 1 if turn == "left" else -1))
    return DevicePixels(rgb, pixels.dpi, bounds[:2])


@dataclass(frozen=True)
class Feeding:
    """The way from a page as it is read to the sheet as it is fed.

    page : as it is read; turns : quarter turns, one after the other; nudge : mm to the right and down, before them.
    """

    page: Page
    turns: tuple[Turn, ...]
    nudge: tuple[float, float]

    @classmethod
    def for_page(cls, page: Page, profile: Printer) -> Feeding:
        """How this printer is fed with such a page.

        Raises InputError: the flap cannot be where the profile says, the way the sheet is fed.
        """
        turn = turn_for(page, profile)
        flap = profile.flap or {"": "leading"}.get(turn, turn)
        possible = ("left", "right") if turn else ("leading", "trailing")
        if flap not in possible:
            other = "long" if profile.feed == "short" else "short"
            raise InputError(
                f"flap: {page.name or 'the page'}, fed with its {profile.feed} edge first, has its upper edge "
                f"{' or '.join(possible)}, not {flap}; choose one of these, or --feed {other}."
            )
        return cls(page, _TURNS[flap], (profile.nudge.x, profile.nudge.y))

    @property
    def sheet(self) -> Page:
        """The sheet as it is fed."""
        page = self.page
        for turn in self.turns:
            page = turned_page(page, turn)
        return page

    def bounds(self, bounds: Bounds) -> Bounds:
        """Where (x least, y least, x greatest, y greatest), mm, of the page lies on the sheet."""
        (x, y), page = self.nudge, self.page
        fed = (bounds[0] + x, bounds[1] + y, bounds[2] + x, bounds[3] + y)
        for turn in self.turns:
            fed, page = turned_bounds(fed, page, turn), turned_page(page, turn)
        return fed

    def pixels(self, pixels: DevicePixels) -> DevicePixels:
        """The same pixels on the sheet, without white around them; nothing is resampled."""
        (x, y), page = self.nudge, self.page
        pixels = pixels.trim_white()  # before they are turned: going through turned ones takes a hundred times as long
        fed = DevicePixels(pixels.rgb, pixels.dpi, (pixels.origin[0] + x, pixels.origin[1] + y))
        for turn in self.turns:
            fed, page = turned_pixels(fed, page, turn), turned_page(page, turn)
        return fed


def page_margins(page: Page, profile: Printer) -> tuple[float, float, float, float]:
    """What of a page, as it is read, this printer cannot print on: (top, right, bottom, left), mm."""
    feeding = Feeding.for_page(page, msgspec.structs.replace(profile, nudge=Nudge()))
    kept, sheet = profile.margins, feeding.sheet
    w, h = page.width, page.height
    found = []
    for side in ((0.0, 0.0, w, 0.0), (w, 0.0, w, h), (0.0, h, w, h), (0.0, 0.0, 0.0, h)):
        x0, y0, x1, y1 = feeding.bounds(side)
        lies = (kept.left if x0 < sheet.width / 2 else kept.right, kept.top if y0 < sheet.height / 2 else kept.bottom)
        found.append(float(lies[0] if abs(x1 - x0) < abs(y1 - y0) else lies[1]))
    top, right, bottom, left = found
    return top, right, bottom, left


def margin_warning(bounds: Bounds, sheet: Page, margins: Margins, title: str) -> str | None:
    """What of the ink at `bounds`, mm, on the sheet as fed cannot be printed; None if all can."""
    x0, y0, x1, y1 = bounds
    room = {"leading": y0, "trailing": sheet.height - y1, "left": x0, "right": sheet.width - x1}
    need = {"leading": margins.top, "trailing": margins.bottom, "left": margins.left, "right": margins.right}
    short = {edge: have for edge, have in room.items() if have < need[edge] - _ROUNDING}
    if not short:
        return None
    edge, have = min(short.items(), key=lambda item: item[1] - need[item[0]])
    if have < 0:
        return f"ink reaches {-have:.1f} mm beyond the {edge} edge of the sheet and will be cut off"
    return (
        f"ink comes within {have:.1f} mm of the {edge} edge of the sheet as it is fed, and {title} cannot print "
        f"nearer than {need[edge]:g} mm: it may be cut off there, so keep it clear by a larger --margin, or by another "
        f"--feed or --tray"
    )
