"""Sheets as printers know them: standard media names, and the direction in which a page is fed."""

from __future__ import annotations

from typing import Literal

import msgspec
import numpy as np

from handout.profiles import Margins, Printer
from handout.values import Page, Raster

Bounds = tuple[float, float, float, float]
Turn = Literal["", "left", "right"]

# names of PWG 5101.1 with their sizes in mm, the shorter side first
_SHEETS: dict[tuple[float, float], str] = {
    (74, 105): "iso_a7_74x105mm", (105, 148): "iso_a6_105x148mm", (148, 210): "iso_a5_148x210mm",
    (210, 297): "iso_a4_210x297mm", (297, 420): "iso_a3_297x420mm",
    (128, 182): "jis_b6_128x182mm", (182, 257): "jis_b5_182x257mm", (257, 364): "jis_b4_257x364mm",
    (215.9, 279.4): "na_letter_8.5x11in", (215.9, 355.6): "na_legal_8.5x14in", (279.4, 431.8): "na_ledger_11x17in",
    (139.7, 215.9): "na_invoice_5.5x8.5in", (184.15, 266.7): "na_executive_7.25x10.5in",
    (203.2, 254): "na_govt-letter_8x10in", (215.9, 330.2): "na_foolscap_8.5x13in",
    (76.2, 127): "na_index-3x5_3x5in", (101.6, 152.4): "na_index-4x6_4x6in", (127, 203.2): "na_index-5x8_5x8in",
    (127, 177.8): "na_5x7_5x7in", (88.9, 127): "oe_photo-l_3.5x5in", (100, 150): "om_small-photo_100x150mm",
    (100, 148): "jpn_hagaki_100x148mm", (148, 200): "jpn_oufuku_148x200mm",
}  # fmt: skip
_ENVELOPES: dict[tuple[float, float], str] = {
    (110, 220): "iso_dl_110x220mm", (81, 114): "iso_c7_81x114mm", (81, 162): "iso_c7c6_81x162mm",
    (114, 162): "iso_c6_114x162mm", (114, 229): "iso_c6c5_114x229mm", (162, 229): "iso_c5_162x229mm",
    (229, 324): "iso_c4_229x324mm", (125, 176): "iso_b6_125x176mm", (176, 250): "iso_b5_176x250mm",
    (125, 324): "iso_b6c4_125x324mm", (110, 230): "om_italian_110x230mm", (220, 220): "om_invite_220x220mm",
    (98.425, 225.425): "na_number-9_3.875x8.875in", (104.775, 241.3): "na_number-10_4.125x9.5in",
    (114.3, 263.525): "na_number-11_4.5x10.375in", (120.65, 279.4): "na_number-12_4.75x11in",
    (127, 292.1): "na_number-14_5x11.5in", (98.425, 190.5): "na_monarch_3.875x7.5in",
    (92.075, 165.1): "na_personal_3.625x6.5in", (111.125, 146.05): "na_a2_4.375x5.75in",
    (152.4, 228.6): "na_6x9_6x9in", (177.8, 228.6): "na_7x9_7x9in", (165.1, 241.3): "na_c5_6.5x9.5in",
    (120, 235): "jpn_chou3_120x235mm", (90, 205): "jpn_chou4_90x205mm", (105, 235): "jpn_you4_105x235mm",
}  # fmt: skip
_NAMES = _SHEETS | _ENVELOPES
# sizes nearer than this are the same sheet: CUPS itself allows about as much
_SAME = 0.2


def name(sheet: Page) -> str:
    """The name of a sheet as it is fed, for ``lp -o media=``.

    A sheet that lies with its shorter side across the feed has its name from PWG 5101.1; any other, or one fed with
    its longer side first, is a custom size, of which the first number is always the side across the feed.
    """
    for (width, height), standard in _NAMES.items():
        if abs(sheet.width - width) <= _SAME and abs(sheet.height - height) <= _SAME:
            return standard
    return f"Custom.{sheet.width:g}x{sheet.height:g}mm"


def is_envelope(page: Page) -> bool:
    """Whether the page, either way up, has the size of an envelope of PWG 5101.1."""
    across, along = sorted((page.width, page.height))
    return any(abs(across - width) <= _SAME and abs(along - height) <= _SAME for width, height in _ENVELOPES)


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


def turned_raster(raster: Raster, page: Page, turn: Turn) -> Raster:
    """The same pixels on the turned sheet; nothing is resampled."""
    if not turn:
        return raster
    height, width = raster.rgba.shape[:2]
    pixel = 25.4 / raster.dpi
    x, y = raster.origin
    bounds = turned_bounds((x, y, x + width * pixel, y + height * pixel), page, turn)
    return Raster(np.rot90(raster.rgba, 1 if turn == "left" else -1), raster.dpi, bounds[:2])


def margin_warning(bounds: Bounds, sheet: Page, margins: Margins, title: str) -> str | None:
    """What of the ink at `bounds`, mm, on the sheet as fed cannot be printed; None if all can."""
    x0, y0, x1, y1 = bounds
    room = {"leading": y0, "trailing": sheet.height - y1, "left": x0, "right": sheet.width - x1}
    need = {"leading": margins.top, "trailing": margins.bottom, "left": margins.left, "right": margins.right}
    short = {edge: have for edge, have in room.items() if have < need[edge] - 1e-6}
    if not short:
        return None
    edge, have = min(short.items(), key=lambda item: item[1] - need[item[0]])
    if have < 0:
        return f"ink reaches {-have:.1f} mm beyond the {edge} edge of the sheet and will be cut off"
    return (
        f"ink comes within {have:.1f} mm of the {edge} edge of the sheet as it is fed, and {title} cannot print "
        f"nearer than {need[edge]:g} mm: it may be cut off there"
    )
