"""The prompt sheets as a PDF: pages to write on, with fiducials and codes, and pages to lay beside and under them.

What is printed where the author writes is of one pale orange whose red is that of white paper: the red channel of
a scan does not show it, under blue, black and green ink alike.  The typeface is the PDF library's, with accents set
over the letters that it lacks; a line with letters that it has no base for is written, in strokes.
"""

from __future__ import annotations

import io
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import handout
from handout import units
from handout.errors import InputError
from handout.hand.diacritics import BELOW, OGONEK
from handout.hand.letter_classes import ASCENDING
from handout.prompting import sheet_codes
from handout.prompting.prompt_pages import Prompt
from handout.prompting.sheet_codes import PageRecord
from handout.prompting.sheet_layout import MARK_SIZE, SheetLayout, mark_cells, mark_corners, mark_number
from handout.values import Array, Page

# a line of text → its strokes (n, 2), y up from the baseline, for type of size 1
Write = Callable[[str], Sequence[Array]]
REGULAR, BOLD = "Vera", "VeraBd"
# combining mark → the mark that stands for itself, and whether it hangs below
_ACCENTS = {
    "\u0300": "`", "\u0301": "´", "\u0302": "ˆ", "\u0303": "˜", "\u0304": "¯", "\u0306": "˘", "\u0307": "˙",
    "\u0308": "¨", "\u030a": "˚", "\u030b": "˝", "\u030c": "ˇ", "\u0326": "¸", "\u0327": "¸", "\u0328": "˛",
}  # fmt: skip
_RAISED = 0.17  # of the size, for marks on capitals and tall letters
# device RGB; both with a red of 1
RULE = (1.0, 0.80, 0.62)
WORDS = (1.0, 0.60, 0.36)
_BLACK = (0.0, 0.0, 0.0)
_UNDER = (0.25, 0.25, 0.25)  # lines that have to be seen through a sheet
_MM = 72 / 25.4
_RULE_WIDTH, _UNDER_WIDTH = 0.25, 0.6  # mm
_STROKE = 0.06  # width of written lines, for type of size 1
_SIZE = 0.24  # of printed words, a pitch
_LABEL_SIZE = 7.0  # points


@cache
def register_faces() -> None:
    """Make the faces known to the library."""
    from reportlab.pdfbase import pdfmetrics
    from reportlab.pdfbase.ttfonts import TTFont

    for name in (REGULAR, BOLD):
        pdfmetrics.registerFont(TTFont(name, f"{name}.ttf"))


@cache
def _known_characters() -> frozenset[int]:
    from reportlab.pdfbase import pdfmetrics

    register_faces()
    return frozenset(pdfmetrics.getFont(REGULAR).face.charToGlyph)


def refuse_unprintable(texts: Iterable[str]) -> None:
    """Raise InputError unless every character can be printed."""
    every = {char for text in texts for char in text if not char.isspace()}
    lacking = sorted(char for char in every if _parts(char) is None)
    if lacking:
        shown = " ".join(lacking[:20]) + (" …" if len(lacking) > 20 else "")
        raise InputError(f"The sheets can be printed in Latin letters only, not with {shown}: leave these out.")


@cache
def _parts(char: str) -> tuple[str, str] | None:
    """The character and "", or its base letter and its mark; None if it cannot be printed."""
    if ord(char) in _known_characters():
        return char, ""
    decomposed = unicodedata.normalize("NFD", char)
    fine = len(decomposed) == 2 and ord(decomposed[0]) in _known_characters() and decomposed[1] in _ACCENTS
    return (decomposed[0], decomposed[1]) if fine else None


def draw_text(canvas: Any, x: float, y: float, text: str, font: str, size: float) -> None:
    """Print a line of text from (x, y) in points; `refuse_unprintable` has been asked."""
    run = ""
    for char in text:
        base, mark = _parts(char) or ("?", "")
        if mark:
            x = _draw_run(canvas, x, y, run, font, size)
            run = ""
            sign = _ACCENTS[mark]
            middle = (canvas.stringWidth(base, font, size) - canvas.stringWidth(sign, font, size)) / 2
            tall = mark not in BELOW | {OGONEK} and (base.isupper() or base in ASCENDING)
            canvas.setFont(font, size)
            canvas.drawString(x + middle, y + (_RAISED * size if tall else 0.0), sign)
        run += base
    _draw_run(canvas, x, y, run, font, size)


def _draw_run(canvas: Any, x: float, y: float, run: str, font: str, size: float) -> float:
    canvas.setFont(font, size)
    canvas.drawString(x, y, run)
    return x + float(canvas.stringWidth(run, font, size))


def text_width(text: str, font: str, size: float) -> float:
    """Width of a line of text, points."""
    from reportlab.pdfbase import pdfmetrics

    register_faces()
    shown = "".join((_parts(char) or ("?", ""))[0] for char in text)
    return float(pdfmetrics.stringWidth(shown, font, size))


def _is_typed(text: str) -> bool:
    """Whether the typeface has every letter of a text."""
    return all(char.isspace() or _parts(char) is not None for char in text)


def _draw_line(canvas: Any, x: float, y: float, line: str, font: str, size: float, write: Write | None) -> None:
    """A line of words in the colour that is set, typed or written."""
    if write is None or _is_typed(line):
        draw_text(canvas, x, y, line, font, size)
        return
    canvas.saveState()
    canvas.translate(x, y)
    canvas.scale(size, size)
    canvas.setStrokeColor(canvas._fillColorObj)
    canvas.setLineWidth(_STROKE)
    canvas.setLineCap(1)
    path = canvas.beginPath()
    for stroke in write(line):
        path.moveTo(*stroke[0].tolist())
        for point in stroke[1:].tolist():
            path.lineTo(*point)
    canvas.drawPath(path)
    canvas.restoreState()


def _fit_size(lines: Sequence[str], font: str, size: float, room: float, write: Write | None) -> float:
    """The size, or less, at which all lines are as wide as there is room, points."""
    typed = [text_width(line, font, size) for line in lines if write is None or _is_typed(line)]
    written = [] if write is None else [write(line) for line in lines if not _is_typed(line)]
    widest = max([*typed, *(size * float(np.vstack(strokes)[:, 0].max()) for strokes in written)], default=0.0)
    return size * min(1.0, room / widest) if widest else size


def to_pdf(prompt: Prompt, layout: SheetLayout, write: Write | None = None) -> bytes:
    """The sheets of a prompt; the same prompt gives the same bytes.

    write : writes the lines whose letters the typeface lacks; None: these are refused.

    With printed words there is a page to write on for each page of the prompt. Without, each is followed by a page
    with its words, to lie beside it, and the last page is ruled, to lie under all of them.

    Raises InputError: a character that cannot be printed. DoesNotFit: more text on a page than its codes hold.
    """
    from reportlab.pdfgen.canvas import Canvas

    register_faces()
    if write is None:
        refuse_unprintable(line for page in prompt.pages for line in page)
    records = page_records(prompt, layout)
    stream = io.BytesIO()
    # invariant: no dates and no random names in the file
    canvas = Canvas(
        stream, pagesize=(layout.page.width * _MM, layout.page.height * _MM), invariant=1, pageCompression=1
    )
    canvas.setTitle("Sheets to write on")
    canvas.setSubject(f"Prompt {records[0].key}, {units.count(len(records), 'page')}")
    canvas.setCreator(f"handout {handout.__version__}")
    canvas.setViewerPreference("PrintScaling", "None")
    for record in records:
        _page_to_write_on(canvas, layout, record, write)
        canvas.showPage()
        if not layout.printed:
            _page_of_words(canvas, layout, record, write)
            canvas.showPage()
    if not layout.printed:
        # dark lines show through the sheet above; frames show where its marks go
        _label(canvas, layout, "Lay this under the sheet you write on, the frames under its four marks", _BLACK)
        _rules(canvas, layout, _UNDER, _UNDER_WIDTH)
        canvas.setLineWidth(_UNDER_WIDTH * _MM)
        for square in mark_corners(layout.page):
            x, y = square[0] * _MM
            canvas.rect(x, layout.page.height * _MM - y - MARK_SIZE * _MM, MARK_SIZE * _MM, MARK_SIZE * _MM)
        canvas.showPage()
    canvas.save()
    return stream.getvalue()


def page_records(prompt: Prompt, layout: SheetLayout) -> list[PageRecord]:
    """What the codes of each page say."""
    named, count = sheet_codes.key(prompt.pages), len(prompt.pages)
    return [
        PageRecord(named, number, count, layout.pitch, layout.printed, lines)
        for number, lines in enumerate(prompt.pages, 1)
    ]


def _page_to_write_on(canvas: Any, layout: SheetLayout, record: PageRecord, write: Write | None) -> None:
    draw_marks(canvas, layout.page)
    for box, symbol in zip(layout.codes, sheet_codes.symbols(record), strict=True):
        draw_cells(canvas, layout.page, symbol, box[0], box[1], box[2] - box[0])
    instruction = (
        "Write under the printed words, in your usual hand" if layout.printed else "Write here, in your usual hand"
    )
    _label(
        canvas, layout, f"Page {record.number} of {record.pages}. {instruction}. Scan the whole sheet in colour.", WORDS
    )
    if layout.printed:
        _rules(canvas, layout, RULE, _RULE_WIDTH)
        # the words of each line stay inside its band and are never wider than the line
        room = (layout.right - layout.left) * _MM
        size = _fit_size(record.lines, BOLD, _SIZE * layout.pitch * _MM, room, write)
        canvas.setFillColorRGB(*WORDS)
        for line, band in zip(record.lines, layout.bands, strict=False):
            # the descenders of the words stay inside the band too
            height = (layout.page.height - band[3]) * _MM + 0.22 * size
            _draw_line(canvas, layout.left * _MM, height, line, BOLD, size, write)


def draw_marks(canvas: Any, page: Page) -> None:
    """The marks at the corners of a sheet."""
    for corner, square in enumerate(mark_corners(page)):
        cells = mark_cells(mark_number(page, corner))
        draw_cells(canvas, page, cells, square[0, 0], square[0, 1], MARK_SIZE)


def draw_cells(canvas: Any, page: Page, cells: NDArray[np.bool_], left: float, top: float, side: float) -> None:
    """Black cells of a square, as one path, so that no seams show between them."""
    cell = side / len(cells) * _MM
    canvas.saveState()
    canvas.transform(cell, 0, 0, -cell, left * _MM, (page.height - top) * _MM)  # in cells, y down
    path = canvas.beginPath()
    for row, line in enumerate(cells):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], line.astype(np.int8), [0]])))
        for begin, end in edges.reshape(-1, 2).tolist():
            path.rect(begin, row, end - begin, 1)
    canvas.setFillColorRGB(*_BLACK)
    canvas.drawPath(path, stroke=0, fill=1)
    canvas.restoreState()


def _label(canvas: Any, layout: SheetLayout, text: str, colour: tuple[float, float, float]) -> None:
    box = layout.label
    canvas.setFillColorRGB(*colour)
    draw_text(canvas, box[0] * _MM, (layout.page.height - box[3] + 1.2) * _MM, text, BOLD, _LABEL_SIZE)


def _rules(canvas: Any, layout: SheetLayout, colour: tuple[float, float, float], width: float) -> None:
    canvas.setStrokeColorRGB(*colour)
    canvas.setLineWidth(width * _MM)
    for y in layout.baselines:
        height = (layout.page.height - y) * _MM
        canvas.line(layout.left * _MM, height, layout.right * _MM, height)


def _page_of_words(canvas: Any, layout: SheetLayout, record: PageRecord, write: Write | None) -> None:
    """The lines of a page, numbered, at the height where they are to be written."""
    canvas.setFillColorRGB(*_BLACK)
    _label(canvas, layout, f"Words of page {record.number} of {record.pages}, line by line", _BLACK)
    room = (layout.right - layout.left) * _MM
    size = _fit_size(record.lines, REGULAR, min(11.0, 0.5 * layout.pitch * _MM), room, write)
    for number, (line, y) in enumerate(zip(record.lines, layout.baselines, strict=False), 1):
        height = (layout.page.height - y) * _MM
        count = str(number)
        draw_text(canvas, (layout.left - 3) * _MM - text_width(count, REGULAR, 7), height, count, REGULAR, 7)
        _draw_line(canvas, layout.left * _MM, height, line, REGULAR, size, write)
