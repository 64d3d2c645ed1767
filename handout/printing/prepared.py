"""Pages of a row as their destination takes them: prepared by any process, taken by one, in the order of the rows.

What a destination needs of a page (a document for a printer, pixels for a PDF, a picture's file, a drawing for a
plotter) depends on the row and the destination's settings alone; it is made by a `Prepare`, which can be pickled.
"""

from __future__ import annotations

import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Self

from handout.errors import InputError, reported
from handout.inking.device_pixels import Calibrate, DevicePixels, device_pixels
from handout.printing import media
from handout.printing.documents import WRITERS
from handout.printing.media import Feeding
from handout.printing.rows import TableRow
from handout.profiles import Printer
from handout.sinks import picture_pdf
from handout.values import Drawing, Page, Raster

NOTHING = "nothing is written on it"


@dataclass(frozen=True)
class BatchPage:
    """A page of a row: which part of the row it is, its drawing, and how that becomes pixels or a picture.

    part : `journal.ENVELOPE`, or in words, such as ``"letter 2"``.
    ink : dpi → the ink as it is; calibrate : the calibration of printer and paper, if there is one.
    file : name of a .png or .svg file → what it holds.
    """

    part: str
    drawing: Drawing
    ink: Callable[[int], Raster]
    calibrate: Calibrate | None = None
    file: Callable[[Path], bytes] = lambda path: b""

    def pixels(self, dpi: int) -> DevicePixels:
        """The page as the pixels that are printed."""
        return device_pixels(self.ink(dpi), self.calibrate)


@dataclass(frozen=True)
class PreparedPage:
    """A page as its destination takes it.

    part : as of the `BatchPage`; page : as it is read; data : what the destination asked for.
    warning : what has to be said of it.
    """

    part: str
    page: Page
    data: bytes
    warning: str = ""


@dataclass(frozen=True)
class PreparedRow:
    """The pages of a row, or why it has none.

    number : of the row; warnings : phrases to stand after "row 5:".
    """

    number: int
    pages: tuple[PreparedPage, ...] = ()
    warnings: tuple[str, ...] = ()
    problem: str = ""


class Destination(ABC):
    """Takes the prepared pages of rows, in their order; a context manager, so that no half-done file stays.

    prepare : makes what it takes; any process may call it.
    """

    prepare: Prepare

    def __init__(self) -> None:
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.__exit__(kind, error, trace)

    @cached_property
    def _folder(self) -> Path:
        """A temporary one, for pages that wait."""
        return Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="handout-")))

    def keep(self, name: str, data: bytes) -> Path:
        """Keep a page under a name; where."""
        path = self._folder / name
        with reported(f"keep a page in {self._folder}"):
            path.write_bytes(data)
        return path

    @abstractmethod
    def take(self, number: int, pages: Sequence[PreparedPage], copies: int) -> None:
        """Take what `prepare` made of row `number`."""

    def finish(self) -> None:  # noqa: B027 - nothing is left to do by itself
        """All rows are taken, and what had to be sent is sent."""

    def files(self) -> tuple[Path, ...]:
        """What has been written for the user."""
        return ()


# makes of a page of a row, by its number, what a destination takes; picklable, and the same from every process.  It
# raises InputError where the page cannot go there
Prepare = Callable[[int, BatchPage], PreparedPage]
WriteRow = Callable[[TableRow], Sequence[BatchPage]]  # InputError where the row cannot be made
MakeRows = Callable[[Iterable[TableRow]], Iterable[PreparedRow]]  # one for each row, in their order


def prepare_row(write: WriteRow, prepare: Prepare, row: TableRow) -> PreparedRow:
    """The pages of a row, written and prepared, or why it cannot be made."""
    if row.problem:
        return PreparedRow(row.number, warnings=row.warnings, problem=row.problem)
    try:
        pages = tuple(prepare(row.number, page) for page in write(row))
    except InputError as error:
        return PreparedRow(row.number, warnings=row.warnings, problem=str(error))
    told = dict.fromkeys(
        f"{page.part or 'envelope'}: {page.warning}" if len(pages) > 1 else page.warning
        for page in pages
        if page.warning
    )
    return PreparedRow(row.number, pages, (*row.warnings, *told))


def margin_warning(drawing: Drawing, profile: Printer) -> str | None:
    """Whether the strokes, with their width, keep to what the printer can reach."""
    if drawing.bounds is None:
        return NOTHING
    pen = max((float(s.width.max()) for s in drawing.strokes if s.width is not None), default=0.0) / 2
    x0, y0, x1, y1 = drawing.bounds
    feeding = Feeding.for_page(drawing.page, profile)
    bounds = feeding.bounds((x0 - pen, y0 - pen, x1 + pen, y1 + pen))
    return media.margin_warning(bounds, feeding.sheet, profile.margins, profile.title)


@dataclass(frozen=True)
class _ForPrinter:
    """What pages on the way to a printer, or to a file that stands for one, have in common.

    fed : page → the printer as it is fed with that.
    """

    fed: Callable[[Page], Printer]

    def _finish_page(self, page: BatchPage, data: bytes) -> PreparedPage:
        sheet = page.drawing.page
        return PreparedPage(page.part, sheet, data, margin_warning(page.drawing, self.fed(sheet)) or "")


@dataclass(frozen=True)
class PrinterPage(_ForPrinter):
    """Pages as documents in the direction of feed, of a format of `documents.WRITERS`.

    about : stored in every PDF; calibrated : whether the calibration of pages is this printer's.
    """

    format: str
    dpi: int
    about: Mapping[str, object]
    calibrated: bool = True

    def __call__(self, number: int, page: BatchPage) -> PreparedPage:
        feeding = Feeding.for_page(page.drawing.page, self.fed(page.drawing.page))
        page = page if self.calibrated else replace(page, calibrate=None)
        pixels = feeding.pixels(page.pixels(self.dpi))
        return self._finish_page(page, WRITERS[self.format](feeding.sheet, pixels, {**self.about, "row": number}))


@dataclass(frozen=True)
class PdfPage(_ForPrinter):
    """Pages as they are read, as they stand in a PDF of all."""

    dpi: int

    def __call__(self, number: int, page: BatchPage) -> PreparedPage:
        return self._finish_page(page, picture_pdf.page_picture(page.drawing.page, page.pixels(self.dpi)).pack())


@dataclass(frozen=True)
class PicturePage(_ForPrinter):
    """Pages as the files of pictures; path : of all of them, without a row's number."""

    path: Path

    def __call__(self, number: int, page: BatchPage) -> PreparedPage:
        return self._finish_page(page, page.file(self.path))
