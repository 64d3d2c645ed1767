"""Where the address stands on an envelope that is addressed by hand, or in its window, and where its sender."""

from __future__ import annotations

from dataclasses import dataclass

from handout.values import Page
from handout.writing.layout import ASCENT, DESCENT, Layout

# what the post keeps for itself, mm: stamps and postmark above, the sorter's bar code below
_STAMPS, _BAR_CODE = 40.0, 15.0
_SIDE = 10.0
# of the sheet: the block's left edge, how far it may move left for a long line, and the block's centre
_LEFT, _LEFT_LEAST, _CENTRE = 0.52, 0.3, 0.55
# x-heights: a line of n characters is about n + 2.5 long; at a pitch of 3.3 capitals touch what stands above, 3 of 100
_MORE, _PITCH = 2.5, 3.6
_CARE = 0.6  # of a person's variation, by eye: an address has to be read, and its lines are not to touch
_X_HEIGHT, _X_HEIGHT_LEAST = 3.2, 1.8
_LEAST = 5.0  # mm, the room that a layout needs
# the sender: size of its letters and distance from the edges, mm, on the usual envelopes; its share of the width
_SENDER, _SENDER_EDGE, _SENDER_WIDE = 1.9, 8.0, 0.42
# of the back: mm from the upper edge, where the flap is; share of the width left free
_BACK_EDGE, _BACK_LEFT = 9.0, 0.25
_CLEAR = 1.5  # mm between the sender, or a number, and what cannot be printed on: hands wander; set by eye
_TICK, _TICK_EDGE = 1.5, 6.0  # mm, size of a row's number and its distance from the lower left corner; set by eye


@dataclass(frozen=True)
class EnvelopeWindow:
    """The window of an envelope, on the letter that lies in it.

    page : the letter's; box : (x, y, width, height), mm, of what is seen of it however it has slipped; below : mm
    from the top, where the letter itself may begin.
    """

    page: str
    box: tuple[float, float, float, float]
    below: float


# Sources: "Windows of envelopes" in docs/bibliography.md.
# DL and C5: the zone of the address in the field of DIN 5008:2020, form B (85 x 45 mm at 20 mm, 45 mm; its upper
# 17.7 mm are for remarks), which windows of DIN 680 show of a letter that is folded at its marks, 105 mm.
# #10: the usual window is 4 1/2 x 1 1/8 in, 7/8 in from the left and 1/2 in from the lower edge of 9 1/2 x 4 1/8 in; a
# letter folded in three stands on the lower edge and slips 1 in sideways, and the USPS wants 1/8 in clear all around.
# CH: the field of SN 010130 on the right, 90 x 45 mm at 112 mm, 45 mm, or on the left, 100 x 45 mm at 20 mm, 35.5 mm,
# less 10 mm above, where the sender may stand, and 5 mm at the other sides, by which a letter may slip (set by eye).
# FR: where the frame that a French bureau of mail asks for (85 x 33 mm at 110 mm, 55 mm) and the field of KOMA-Script's
# NF (90 x 45 mm at 110 mm, 35 mm) overlap.
WINDOWS = {
    "DL": EnvelopeWindow("A4", (25.0, 62.7, 78.0, 27.3), 98.5),
    "C5": EnvelopeWindow("A4", (25.0, 62.7, 78.0, 27.3), 98.5),
    "#10": EnvelopeWindow("letter", (25.4, 55.0, 82.5, 22.2), 95.0),
    "CH": EnvelopeWindow("A4", (117.0, 55.0, 80.0, 30.0), 98.5),
    "CH-LEFT": EnvelopeWindow("A4", (25.0, 45.5, 90.0, 30.0), 89.0),
    "FR": EnvelopeWindow("A4", (110.0, 55.0, 85.0, 25.0), 99.0),
}


def address_layout(page: Page, lines: int, longest: int = 20, x_height: float | None = None) -> Layout:
    """The layout of an address of so many lines on an envelope.

    The block begins a little right of the middle of the envelope and lies about its centre a little below the
    middle, clear of stamps and bar code.  A long line first moves it to the left and then makes the writing
    smaller; what is still too long is shrunk by composition (`Layout.fit`).

    page : the envelope as it is read, mm.
    lines : how many lines the address has.
    longest : characters in the longest of them.
    x_height : mm; otherwise 3.2 mm on the usual envelopes, less on small ones, for long lines and for many lines.

    Raises InputError: a page too small to be written on.
    """
    scale = min(1.0, page.height / 104, page.width / 150)
    stamps, bar_code, side = _STAMPS * scale, _BAR_CODE * scale, _SIDE * scale
    # of the block, x-heights: `deep` holds just so many lines, so that one too long is shrunk rather than broken
    wide, deep = max(longest, 1) + _MORE, ASCENT + DESCENT + _PITCH * (max(lines, 1) - 0.9)
    if x_height is None:
        fits = min((page.width * (1 - _LEFT_LEAST) - side) / wide, (page.height - stamps - bar_code) / deep)
        x_height = max(min(_X_HEIGHT * scale, fits), min(_X_HEIGHT_LEAST, _X_HEIGHT * scale))
    left = min(_LEFT * page.width, max(page.width - side - wide * x_height, _LEFT_LEAST * page.width))
    height = max(deep * x_height, _LEAST)
    lowest = page.height - bar_code - height
    top = max(min(max(_CENTRE * page.height - height / 2, stamps), lowest), side)
    bottom = max(page.height - top - height, side)
    return Layout(page, (top, side, bottom, left), x_height, _PITCH * x_height, jitter=_CARE, fit=True, unbroken=True)


def sender_layout(
    page: Page, lines: int, longest: int, back: bool = False, clear: tuple[float, float, float, float] = (0, 0, 0, 0)
) -> Layout:
    """The layout of the sender's address: small, in the upper left corner of an envelope, or on its flap.

    clear : (top, right, bottom, left), mm, that cannot be written on.
    """
    scale = min(1.0, page.height / 104, page.width / 150)
    x_height, edge = _SENDER * scale, _SENDER_EDGE * scale
    left, top = (_BACK_LEFT * page.width, _BACK_EDGE * scale) if back else (edge, edge)
    left, top = max(left, clear[3] + _CLEAR), max(top, clear[0] + _CLEAR)
    wide = page.width * (1 - 2 * _BACK_LEFT if back else _SENDER_WIDE)
    return box_layout(page, (left, top, wide, page.height / 2 - top), lines, longest, x_height)


def tick_layout(page: Page, longest: int, clear: tuple[float, float, float, float] = (0, 0, 0, 0)) -> Layout:
    """The layout of a row's number, by which a letter and its envelope are put together; `clear` as above."""
    high = _TICK * (ASCENT + DESCENT) + _LEAST / 2
    left, below = max(_TICK_EDGE, clear[3] + _CLEAR), max(_TICK_EDGE, clear[2] + _CLEAR)
    box = (left, page.height - below - high, _TICK * (longest + 2 * _MORE), high)
    return box_layout(page, box, 1, longest, _TICK)


def box_layout(
    page: Page, box: tuple[float, float, float, float], lines: int, longest: int, x_height: float = _X_HEIGHT
) -> Layout:
    """The layout of so many lines in a box, (x, y, width, height) in mm, no larger than `x_height`."""
    x, y, width, height = box
    wide, deep = max(longest, 1) + _MORE, ASCENT + DESCENT + _PITCH * (max(lines, 1) - 0.9)
    size = max(min(x_height, width / wide, height / deep), _X_HEIGHT_LEAST / 2)
    right = max(page.width - x - max(width, _LEAST), 0.0)
    bottom = max(page.height - y - max(deep * size, _LEAST), 0.0)
    return Layout(page, (y, right, bottom, x), size, _PITCH * size, jitter=_CARE, fit=True, unbroken=True)
