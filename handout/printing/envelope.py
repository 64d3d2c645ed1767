"""Where the address stands on an envelope that is addressed by hand."""

from __future__ import annotations

from handout.printing.rows import Row
from handout.values import Page
from handout.writing.layout import ASCENT, DESCENT, Layout

# what the post keeps for itself, mm: stamps and postmark above, the sorter's bar code below
_STAMPS, _BAR_CODE = 40.0, 15.0
_SIDE = 10.0
# of the sheet: the block's left edge, how far it may move left for a long line, and the block's centre
_LEFT, _LEFT_LEAST, _CENTRE = 0.52, 0.3, 0.55
# x-heights: a line of n characters is about n + 2.5 long, and the lines of an address stand closer than a letter's
_MORE, _PITCH = 2.5, 3.3
_X_HEIGHT, _X_HEIGHT_LEAST = 3.2, 1.8
_LEAST = 5.0  # mm, the room that a layout needs


def address_text(row: Row) -> str:
    """What is written on the envelope of a row."""
    return "\n".join(row.lines)


def address_layout(page: Page, lines: int, longest: int = 20, x_height: float | None = None) -> Layout:
    """The layout of an address of so many lines on an envelope.

    The block begins a little right of the middle of the envelope and lies about its centre a little below the
    middle, clear of stamps and bar code.  A long line first moves it to the left and then makes the writing
    smaller; what is still too long is shrunk by composition (`Layout.fit`).

    Parameters
    ----------
    page : Page
        The envelope as it is read, mm.
    lines : int
        How many lines the address has.
    longest : int
        Characters in the longest of them.
    x_height : float, optional
        mm; otherwise 3.2 mm on the usual envelopes, less on small ones, for long lines and for many lines.

    Raises
    ------
    InputError
        A page too small to be written on.
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
    return Layout(page, (top, side, bottom, left), x_height, _PITCH * x_height, fit=True)
