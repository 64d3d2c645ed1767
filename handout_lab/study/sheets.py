"""Where everything is on the sheets of a study, their codes, and the sheets as a PDF.

A sheet has the marks of prompt sheets at its corners and two equal QR codes at its foot, which say of which study and
person it is and which rows it has; from that alone follows where its boxes are, so that a scan can be read without
anything else.  Snippets stand in frames of one size, ink on the white of the sheet, their baselines at one height.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

import handout
from handout.errors import InputError
from handout.prompting import sheet_codes, sheet_pdf
from handout.prompting.sheet_layout import MARK_FOOT, MARK_QUIET, MARK_SIDE, MARK_SIZE
from handout.values import Array, Page, readonly
from handout_lab.study import design
from handout_lab.study.design import ENVELOPES, PAIRS, SINGLES, Person
from handout_lab.study.snippets import Picture

COVER = "P"
KINDS = (COVER, SINGLES, PAIRS, ENVELOPES)
FRAME = (80.0, 16.0)  # mm of a snippet, with the white around it
ABOVE = 10.3  # mm of a frame above the baseline
BOX = 5.0  # mm, side of a box to tick
EDGE = 0.35  # mm of its line
CODE, CODE_VERSION = 12.0, 2  # mm a side; QR codes of version 2 have 25 modules
_RECORD = struct.Struct(">2sB6sHBBBBBB")
_MAGIC, _VERSION = b"hS", 1  # of the codes; a reader refuses any other
_TOP, _ABOVE_FOOT = 33.0, 4.0  # mm from the upper edge where rows begin; of white above the codes
_LEFT, _IN = 20.0, 8.0  # mm from the left edge to numbers, and from there to single snippets
# mm: height of a row by kind of page; of a pair its reference, the two, their boxes
_ROW = {SINGLES: 21.5, PAIRS: 44.6, ENVELOPES: 12.0, COVER: 13.0}
_COVER_TOP = 120.0  # mm: rows of the cover begin under its text
_REFERENCE = FRAME[1] + 1.5  # mm from the top of a pair to its two
_BETWEEN = 6.0  # mm between its two
_OPTIONS = {SINGLES: (100.0, 30.0), ENVELOPES: (50.0, 30.0)}  # mm from numbers to the first box, and from box to box
ANSWERS = {SINGLES: (design.REAL, design.MADE), PAIRS: (design.LEFT, design.RIGHT)}
ANSWERS[ENVELOPES] = ANSWERS[SINGLES]
WORD = {design.REAL: "real", design.MADE: "fake"}  # as in seed 000: "computer generated" would say what to look for
# the rows of the cover: what they are called, what they say, their boxes
ABOUT = (
    ("consent", "I agree", ("yes",)),
    ("age", "My age", ("under 20", "20 to 39", "40 to 59", "60 or more")),
    ("writes", "I write by hand", ("daily", "weekly", "seldom")),
    ("hand", "I write with", ("the left hand", "the right hand")),
)
CONSENT = "I take part of my own free will. My answers may be used and published without my name."
_WELCOME = (
    "You will see short pieces of handwriting. Some were written by a person with a pen,",
    "the others are fakes. Please tell which are which: go by your first impression, leave",
    "no row out, guess where you do not know, and do not turn back. It takes five minutes.",
    "",
    "Cross one box of each row:",
    "If you change your mind, fill one in:",
)
_HEADS = {
    SINGLES: ("Questionnaire A", "Was this written by a person, or is it a fake? Cross one box in each row."),
    PAIRS: (
        "Questionnaire B",
        "Of the two below each line of real writing, one is by that person. Cross the fake.",
    ),
    ENVELOPES: ("Envelopes", "Written by a person with a pen, or a fake? You see each envelope for five seconds."),
}
_Colour = tuple[float, float, float]
_BLACK, _GREY = (0.0, 0.0, 0.0), (0.45, 0.45, 0.45)  # device RGB
_POINTS = 72 / 25.4  # a mm
_SMALL, _TEXT, _HEAD = 7.5, 10.0, 14.0  # points
_SPARED = 5  # per cent of the pictures that may be too large for their frame, and are left out
_SMALLEST = 0.4  # of its size, at which writing is shown at least; set by eye


@dataclass(frozen=True)
class SheetRecord:
    """What the code of a sheet says.

    study : its name, hexadecimal; person, page : from 1; kind : one of `KINDS`; first, count : of its rows.
    """

    study: str
    person: int
    page: int
    pages: int
    kind: str
    first: int
    count: int

    def packed(self) -> bytes:
        """In few bytes, with a check."""
        kind = KINDS.index(self.kind)
        fields = (self.person, self.page, self.pages, kind, self.first, self.count, 0)
        data = _RECORD.pack(_MAGIC, _VERSION, bytes.fromhex(self.study), *fields)
        return data + struct.pack(">I", zlib.crc32(data))


def unpacked(data: bytes) -> SheetRecord | None:
    """What a code says; None if it is none of a study's, or damaged."""
    if len(data) != _RECORD.size + 4 or struct.unpack(">I", data[-4:])[0] != zlib.crc32(data[:-4]):
        return None
    magic, version, study, person, page, pages, kind, first, count, _ = _RECORD.unpack(data[:-4])
    if (magic, version) != (_MAGIC, _VERSION) or kind >= len(KINDS):
        return None
    return SheetRecord(study.hex(), person, page, pages, KINDS[kind], first, count)


@dataclass(frozen=True, eq=False)
class Row:
    """A row with boxes.

    number : as printed, from 1; answers : what each box means; boxes : (k, 4) left, top, right, bottom, mm.
    """

    questionnaire: str
    number: int
    answers: tuple[str, ...]
    boxes: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "boxes", readonly(self.boxes, len(self.answers), 4))


def codes(page: Page) -> Array:
    """(2, 4) mm: where the codes of a sheet stand."""
    inside = MARK_SIDE + MARK_SIZE + 2 * MARK_QUIET
    foot = page.height - MARK_FOOT
    left = (inside, page.width - inside - CODE)
    return np.array([(x, foot - CODE, x + CODE, foot) for x in left])


def rows(page: Page, record: SheetRecord) -> list[Row]:
    """The rows of a sheet, with the places of their boxes."""
    return [_row(record, k) for k in range(record.count)]


def _row(record: SheetRecord, k: int) -> Row:
    number, top = record.first + k, _top(record.kind, k)
    if record.kind == COVER:
        name, _, answers = ABOUT[k]
        middle = [(_LEFT + 40 + 33 * n, top + BOX / 2) for n in range(len(answers))]
        return Row(name, 1, answers, _boxes(middle))
    if record.kind == PAIRS:
        y = top + _REFERENCE + FRAME[1] + 1.5 + BOX / 2
        middle = [(_LEFT + n * (FRAME[0] + _BETWEEN) + FRAME[0] / 2, y) for n in (0, 1)]
    else:
        first, step = _OPTIONS[record.kind]
        y = top + (FRAME[1] / 2 if record.kind == SINGLES else BOX / 2)
        middle = [(_LEFT + first + n * step, y) for n in (0, 1)]
    return Row(record.kind, number, ANSWERS[record.kind], _boxes(middle))


def above(row: Row) -> float:
    """mm from the boxes of a row up to what they are about."""
    return {PAIRS: _REFERENCE + FRAME[1], SINGLES: (FRAME[1] - BOX) / 2}.get(row.questionnaire, 0.0)


def _boxes(middles: Sequence[tuple[float, float]]) -> Array:
    half = BOX / 2 * np.array([-1, -1, 1, 1])
    return np.array([(x, y, x, y) for x, y in middles]) + half


def _top(kind: str, k: int) -> float:
    """mm from the upper edge of the sheet to a row."""
    return (_COVER_TOP if kind == COVER else _TOP) + k * _ROW[kind]


def _room(page: Page, kind: str) -> int:
    """How many rows a sheet has room for."""
    foot = page.height - MARK_FOOT - CODE - _ABOVE_FOOT
    return int((foot - _TOP) // _ROW[kind])


def records(page: Page, study: str, number: int, person: Person, about: bool) -> list[SheetRecord]:
    """The sheets of a person, with their rows spread evenly over as few as hold them."""
    parts = [(COVER, 1, len(ABOUT) if about else 1)]
    for kind in (SINGLES, PAIRS, ENVELOPES):
        count = len(person.items(kind))
        sheets = -(-count // _room(page, kind))
        edges = [count * k // sheets for k in range(sheets + 1)] if sheets else [0]
        parts += [(kind, a + 1, b - a) for a, b in pairwise(edges)]
    return [
        SheetRecord(study, number, k, len(parts), kind, first, count) for k, (kind, first, count) in enumerate(parts, 1)
    ]


@dataclass(frozen=True, eq=False)
class Show:
    """What sheets show.

    pictures : (number of a snippet, real or made or control) → its picture, and how much smaller it is shown.
    references : number of a reference → the same; title : of the study.
    """

    pictures: Mapping[tuple[int, str], tuple[Picture, float]]
    references: Mapping[int, tuple[Picture, float]]
    title: str


def to_pdf(page: Page, sheets: Sequence[tuple[SheetRecord, Person]], show: Show) -> bytes:
    """The sheets of people, one after the other; the same sheets give the same bytes."""
    from reportlab.pdfgen.canvas import Canvas

    sheet_pdf.register_faces()
    sheet_pdf.refuse_unprintable([show.title])
    stream = io.BytesIO()
    size = (page.width * _POINTS, page.height * _POINTS)
    canvas = Canvas(stream, pagesize=size, invariant=1, pageCompression=1)
    canvas.setTitle(show.title)
    canvas.setCreator(f"handout {handout.__version__}")
    canvas.setViewerPreference("PrintScaling", "None")
    drawing = _Drawing(canvas, page, show)
    for record, person in sheets:
        drawing.sheet(record, person)
        canvas.showPage()
    canvas.save()
    return stream.getvalue()


class _Drawing:
    """Draws sheets on a canvas; lengths are mm from the upper left corner of the page."""

    def __init__(self, canvas: Any, page: Page, show: Show) -> None:
        self.canvas, self.page, self.show = canvas, page, show
        self._readers: dict[int, Any] = {}

    def sheet(self, record: SheetRecord, person: Person) -> None:
        """One sheet."""
        sheet_pdf.draw_marks(self.canvas, self.page)
        symbol = sheet_codes.symbol(record.packed(), CODE_VERSION)
        places = codes(self.page)
        for left, top, _, _ in places.tolist():
            sheet_pdf.draw_cells(self.canvas, self.page, symbol, left, top, CODE)
        said = f"study {record.study}, person {record.person}, page {record.page} of {record.pages}"
        self._text(places[0, 2] + 4, places[0, 3] - 1, said, _SMALL, _GREY)
        if record.kind == COVER:
            self._cover(record)
        else:
            head, told = _HEADS[record.kind]
            self._text(_LEFT + 3, 16.5, head, _HEAD, _BLACK, bold=True)
            self._text(_LEFT + 3, 23.5, told, _TEXT)
            again = "Changed your mind? Fill the wrong box in completely, and cross the other one."
            self._text(places[0, 2] + 4, places[0, 1] + 4, again, _SMALL)
        draw = {COVER: self._about, SINGLES: self._single, PAIRS: self._pair, ENVELOPES: self._envelope}[record.kind]
        for k, row in enumerate(rows(self.page, record)):
            for box in row.boxes.tolist():
                self._box(box)
            draw(row, _top(record.kind, k), person)

    def _cover(self, record: SheetRecord) -> None:
        self._text(_LEFT + 3, 40, self.show.title, 18, _BLACK, bold=True)
        for k, line in enumerate(_WELCOME):
            self._text(_LEFT + 3, 54 + 6.5 * k, line, _TEXT + 1)
        self._example(98.0, 80.0, filled=False)
        self._example(98.0, 86.5, filled=True)
        self._text(_LEFT + 3, 108, CONSENT, _TEXT)

    def _example(self, x: float, y: float, *, filled: bool) -> None:
        """A row of boxes as it is to be marked: small, away from where any is read."""
        side = 3.6
        boxes = [(x + 7 * k, y - side + 0.8, x + 7 * k + side, y + 0.8) for k in (0, 1)]
        for box in boxes:
            self._box(box)
        if filled:
            left, top, right, bottom = boxes[0]
            self.canvas.rect(left * _POINTS, self._y(bottom), side * _POINTS, (bottom - top) * _POINTS, fill=1)
        left, top, right, bottom = boxes[1]
        self.canvas.setLineWidth(1.1)
        self.canvas.line(left * _POINTS, self._y(top), right * _POINTS, self._y(bottom))
        self.canvas.line(left * _POINTS, self._y(bottom), right * _POINTS, self._y(top))

    def _about(self, row: Row, top: float, person: Person) -> None:
        said = next(said for name, said, _ in ABOUT if name == row.questionnaire)
        self._text(_LEFT + 3, top + BOX / 2 + 1.2, said, _TEXT)
        for box, answer in zip(row.boxes.tolist(), row.answers, strict=True):
            self._text(box[2] + 1.5, top + BOX / 2 + 1.2, answer, _TEXT - 1)

    def _single(self, row: Row, top: float, person: Person) -> None:
        item = person.singles[row.number - 1]
        self._number(row, top)
        kind = design.REAL if item.truth == design.REAL else item.condition
        self._snippet(self.show.pictures[item.snippet, kind], _LEFT + _IN, top)
        self._answers(row)

    def _answers(self, row: Row) -> None:
        for box, answer in zip(row.boxes.tolist(), row.answers, strict=True):
            self._text(box[2] + 2, box[3] - 1.2, WORD[answer], _TEXT)

    def _pair(self, row: Row, top: float, person: Person) -> None:
        item = person.pairs[row.number - 1]
        self._number(row, top)
        self._snippet(self.show.references[item.reference], _LEFT + _IN, top)
        kinds = (item.condition, design.REAL) if item.truth == design.LEFT else (design.REAL, item.condition)
        for k, kind in enumerate(kinds):
            self._snippet(self.show.pictures[item.snippet, kind], _LEFT + k * (FRAME[0] + _BETWEEN), top + _REFERENCE)
        self._line(_LEFT, top + _ROW[PAIRS] - 2.4, self.page.width - _LEFT)

    def _envelope(self, row: Row, top: float, person: Person) -> None:
        item = person.envelopes[row.number - 1]
        self._text(_LEFT, top + BOX / 2 + 1.2, f"{row.number}.   Envelope {item.snippet + 1}", _TEXT)
        self._answers(row)

    def _number(self, row: Row, top: float) -> None:
        self._text(_LEFT - 5, top + FRAME[1] / 2 + 1.2, f"{row.number}.", _TEXT)

    def _snippet(self, shown: tuple[Picture, float], left: float, top: float) -> None:
        """A picture in its frame: begins at its left, its baseline at the height of all."""
        from PIL import Image
        from reportlab.lib.utils import ImageReader

        picture, scale = shown
        if id(picture) not in self._readers:
            self._readers[id(picture)] = ImageReader(Image.fromarray(picture.rgb))
        pixel = 25.4 / picture.dpi * scale
        height, width = (side * pixel for side in picture.rgb.shape[:2])
        y = top + ABOVE - picture.base * pixel
        self.canvas.drawImage(
            self._readers[id(picture)], left * _POINTS, self._y(y + height), width * _POINTS, height * _POINTS
        )

    def _box(self, box: Sequence[float]) -> None:
        left, top, right, bottom = box
        self.canvas.setStrokeColorRGB(*_BLACK)
        self.canvas.setFillColorRGB(*_BLACK)
        self.canvas.setLineWidth(EDGE * _POINTS)
        self.canvas.rect(left * _POINTS, self._y(bottom), (right - left) * _POINTS, (bottom - top) * _POINTS)

    def _line(self, left: float, y: float, right: float) -> None:
        self.canvas.setStrokeColorRGB(*_GREY)
        self.canvas.setLineWidth(0.3)
        self.canvas.line(left * _POINTS, self._y(y), right * _POINTS, self._y(y))

    def _text(
        self, x: float, y: float, text: str, size: float, colour: _Colour = _BLACK, *, bold: bool = False
    ) -> None:
        self.canvas.setFillColorRGB(*colour)
        face = sheet_pdf.BOLD if bold else sheet_pdf.REGULAR
        sheet_pdf.draw_text(self.canvas, x * _POINTS, self._y(y), text, face, size)

    def _y(self, y: float) -> float:
        return (self.page.height - y) * _POINTS


def scale_of(pictures: Sequence[Picture]) -> float:
    """How much smaller snippets of a hand have to be shown so that nearly all fit into their frames; at most 1.

    Raises
    ------
    InputError
        They are too large.
    """
    scale = min(1.0, float(np.percentile([largest(picture) for picture in pictures], _SPARED)))
    if scale < _SMALLEST:
        raise InputError(
            f"The writing is so large that it would have to be shown at {scale:.0%} of its size, which nobody sees "
            f"it in (at least {_SMALLEST:.0%}): take other pages."
        )
    return scale


def largest(picture: Picture) -> float:
    """The scale at which a picture just stays in its frame."""
    pixel = 25.4 / picture.dpi
    above, below = picture.base * pixel, (picture.rgb.shape[0] - picture.base) * pixel
    return float(min(FRAME[0] / picture.width, ABOVE / max(above, 1e-3), (FRAME[1] - ABOVE) / max(below, 1e-3)))


def fits(picture: Picture, scale: float) -> bool:
    """Whether a picture shown at that scale stays in its frame."""
    return largest(picture) >= scale - 1e-6
