"""The typeface of the printed words: that of the PDF library, with marks set over letters that it lacks."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from functools import cache
from typing import Any

from handout.errors import InputError
from handout.hand.letter_classes import ASCENDING

REGULAR, BOLD = "Vera", "VeraBd"
# combining mark → the mark that stands for itself, and whether it hangs below
_MARKS = {
    "\u0300": "`", "\u0301": "´", "\u0302": "ˆ", "\u0303": "˜", "\u0304": "¯", "\u0306": "˘", "\u0307": "˙",
    "\u0308": "¨", "\u030a": "˚", "\u030b": "˝", "\u030c": "ˇ", "\u0326": "¸", "\u0327": "¸", "\u0328": "˛",
}  # fmt: skip
_BELOW = {"\u0326", "\u0327", "\u0328"}
_RAISED = 0.17  # of the size, for marks on capitals and tall letters


@cache
def register() -> None:
    """Make the faces known to the library."""
    from reportlab.pdfbase import pdfmetrics
    from reportlab.pdfbase.ttfonts import TTFont

    for name in (REGULAR, BOLD):
        pdfmetrics.registerFont(TTFont(name, f"{name}.ttf"))


@cache
def _known() -> frozenset[int]:
    from reportlab.pdfbase import pdfmetrics

    register()
    return frozenset(pdfmetrics.getFont(REGULAR).face.charToGlyph)


def check(texts: Iterable[str]) -> None:
    """Raise InputError unless every character can be printed."""
    every = {char for text in texts for char in text if not char.isspace()}
    lacking = sorted(char for char in every if _parts(char) is None)
    if lacking:
        shown = " ".join(lacking[:20]) + (" …" if len(lacking) > 20 else "")
        raise InputError(f"The sheets can be printed in Latin letters only, not with {shown}: leave these out.")


@cache
def _parts(char: str) -> tuple[str, str] | None:
    """The character and "", or its base letter and its mark; None if it cannot be printed."""
    if ord(char) in _known():
        return char, ""
    decomposed = unicodedata.normalize("NFD", char)
    fine = len(decomposed) == 2 and ord(decomposed[0]) in _known() and decomposed[1] in _MARKS
    return (decomposed[0], decomposed[1]) if fine else None


def draw(canvas: Any, x: float, y: float, text: str, font: str, size: float) -> None:
    """Print a line of text from (x, y) in points; `check` has been asked."""
    run = ""
    for char in text:
        base, mark = _parts(char) or ("?", "")
        if mark:
            x = _run(canvas, x, y, run, font, size)
            run = ""
            _mark(canvas, x, y, base, mark, font, size)
        run += base
    _run(canvas, x, y, run, font, size)


def _run(canvas: Any, x: float, y: float, run: str, font: str, size: float) -> float:
    canvas.setFont(font, size)
    canvas.drawString(x, y, run)
    return x + float(canvas.stringWidth(run, font, size))


def _mark(canvas: Any, x: float, y: float, base: str, mark: str, font: str, size: float) -> None:
    sign = _MARKS[mark]
    middle = (canvas.stringWidth(base, font, size) - canvas.stringWidth(sign, font, size)) / 2
    tall = mark not in _BELOW and (base.isupper() or base in ASCENDING)
    canvas.setFont(font, size)
    canvas.drawString(x + middle, y + (_RAISED * size if tall else 0.0), sign)


def width(text: str, font: str, size: float) -> float:
    """Width of a line of text, points."""
    from reportlab.pdfbase import pdfmetrics

    register()
    shown = "".join((_parts(char) or ("?", ""))[0] for char in text)
    return float(pdfmetrics.stringWidth(shown, font, size))
