"""The sizes of sheets and envelopes: their names, their sides in mm, and what printers call them.

A new size is one line in `_SIZES`: `--page`, its help texts and what printers are told of a sheet follow from it.

Source: PWG 5101.1 (media names and their sizes); ISO 216 and ISO 269 for those of A and C sizes.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from handout import units
from handout.errors import InputError

if TYPE_CHECKING:  # --help names the pages, and `values` needs numpy
    from handout.values import Page


class PageSize(NamedTuple):
    """A size of paper: its name in PWG 5101.1, its sides in mm, whether it is an envelope, its name in `--page`."""

    media: str
    short: float
    long: float
    envelope: bool = False
    name: str = ""


_SIZES = (
    PageSize("iso_a3_297x420mm", 297, 420, name="A3"),
    PageSize("iso_a4_210x297mm", 210, 297, name="A4"),
    PageSize("iso_a5_148x210mm", 148, 210, name="A5"),
    PageSize("iso_a6_105x148mm", 105, 148, name="A6"),
    PageSize("iso_a7_74x105mm", 74, 105),
    PageSize("na_letter_8.5x11in", 215.9, 279.4, name="letter"),
    PageSize("na_legal_8.5x14in", 215.9, 355.6),
    PageSize("na_ledger_11x17in", 279.4, 431.8),
    PageSize("na_invoice_5.5x8.5in", 139.7, 215.9),
    PageSize("na_executive_7.25x10.5in", 184.15, 266.7),
    PageSize("na_govt-letter_8x10in", 203.2, 254),
    PageSize("na_foolscap_8.5x13in", 215.9, 330.2),
    PageSize("na_index-3x5_3x5in", 76.2, 127),
    PageSize("na_index-4x6_4x6in", 101.6, 152.4),
    PageSize("na_index-5x8_5x8in", 127, 203.2),
    PageSize("na_5x7_5x7in", 127, 177.8),
    PageSize("jis_b6_128x182mm", 128, 182),
    PageSize("jis_b5_182x257mm", 182, 257),
    PageSize("jis_b4_257x364mm", 257, 364),
    PageSize("oe_photo-l_3.5x5in", 88.9, 127),
    PageSize("om_small-photo_100x150mm", 100, 150),
    PageSize("jpn_hagaki_100x148mm", 100, 148),
    PageSize("jpn_oufuku_148x200mm", 148, 200),
    PageSize("iso_dl_110x220mm", 110, 220, True, "DL"),
    PageSize("iso_c6_114x162mm", 114, 162, True, "C6"),
    PageSize("iso_c5_162x229mm", 162, 229, True, "C5"),
    PageSize("na_number-10_4.125x9.5in", 104.775, 241.3, True, "number-10"),
    PageSize("iso_c7_81x114mm", 81, 114, True),
    PageSize("iso_c7c6_81x162mm", 81, 162, True),
    PageSize("iso_c6c5_114x229mm", 114, 229, True),
    PageSize("iso_c4_229x324mm", 229, 324, True),
    PageSize("iso_b6_125x176mm", 125, 176, True),
    PageSize("iso_b5_176x250mm", 176, 250, True),
    PageSize("iso_b6c4_125x324mm", 125, 324, True),
    PageSize("om_italian_110x230mm", 110, 230, True),
    PageSize("om_invite_220x220mm", 220, 220, True),
    PageSize("na_number-9_3.875x8.875in", 98.425, 225.425, True),
    PageSize("na_number-11_4.5x10.375in", 114.3, 263.525, True),
    PageSize("na_number-12_4.75x11in", 120.65, 279.4, True),
    PageSize("na_number-14_5x11.5in", 127, 292.1, True),
    PageSize("na_monarch_3.875x7.5in", 98.425, 190.5, True),
    PageSize("na_personal_3.625x6.5in", 92.075, 165.1, True),
    PageSize("na_a2_4.375x5.75in", 111.125, 146.05, True),
    PageSize("na_6x9_6x9in", 152.4, 228.6, True),
    PageSize("na_7x9_7x9in", 177.8, 228.6, True),
    PageSize("na_c5_6.5x9.5in", 165.1, 241.3, True),
    PageSize("jpn_chou3_120x235mm", 120, 235, True),
    PageSize("jpn_chou4_90x205mm", 90, 205, True),
    PageSize("jpn_you4_105x235mm", 105, 235, True),
)
_NAMED = {size.name.lower(): size for size in _SIZES if size.name}
NAMES = tuple(size.name for size in _NAMED.values())
HELP = f"{' '.join(NAMES)} or WxHmm."  # for the help of `--page`
_CUSTOM = re.compile(r"(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)(mm|cm|in)\Z")
_LEAST, _MOST = 20, 5000  # mm, a side of a custom page; set by eye
_SAME = 0.2  # mm: sizes nearer than this are the same sheet; CUPS itself allows about as much


def page(name: str) -> Page:
    """The page of that name, or of the size ``"WxHmm"``; envelopes lie with their long side across, as they are read.

    Raises InputError: unknown name, or a side outside 20–5000 mm.
    """
    from handout.values import Page

    size = _NAMED.get(name.lower())
    if size is not None:
        return Page(*((size.long, size.short) if size.envelope else (size.short, size.long)), size.name)
    match = _CUSTOM.match(name)
    if match is None:
        known = ", ".join(NAMES)
        raise InputError(f"No page size is called {name!r}: use one of {known}, or WxHmm such as 150x100mm.")
    width, height = (units.length(match.group(i) + match.group(3)) for i in (1, 2))
    if not (_LEAST <= width <= _MOST and _LEAST <= height <= _MOST):
        raise InputError(f"A page of {width:g} x {height:g} mm is outside {_LEAST} to {_MOST} mm a side.")
    return Page(width, height, name)


def margins(text: str | None, page: Page) -> tuple[float, float, float, float]:
    """(top, right, bottom, left) in mm from one, two or four lengths; default: a tenth of the short side."""
    if text is None:
        margin = min(20.0, 0.1 * min(page.width, page.height))
        return (margin,) * 4
    parts = [units.length(part, "margin") for part in text.split(",")]
    if len(parts) not in (1, 2, 4):
        raise InputError(f"margin: {text!r} holds {len(parts)} lengths; give one, two or four.")
    top, right, bottom, left = (parts * 4)[:4]
    return (top, right, bottom, left)


def size_of(page: Page) -> PageSize | None:
    """The standard size of a page, either way up; None for another."""
    short, long = sorted((page.width, page.height))
    return next((size for size in _SIZES if is_near(short, size.short) and is_near(long, size.long)), None)


def is_near(side: float, standard: float) -> bool:
    """Whether a side has a standard length, as nearly as sheets are told apart."""
    return abs(side - standard) <= _SAME
