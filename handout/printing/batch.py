"""Turns the rows of a table into pages: writes, checks and prepares each, then sends them or writes files."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self, runtime_checkable

from handout import atomic, units
from handout.errors import InputError
from handout.inking.device_pixels import Calibrate, DevicePixels, device_pixels
from handout.printing import media
from handout.printing.documents import WRITERS
from handout.printing.envelope import address_layout, address_text
from handout.printing.journal import ENVELOPE, Journal, Piece
from handout.printing.media import Feeding
from handout.printing.printers import open_queue, ticket
from handout.printing.queue import Queue, Say, SimulatedQueue
from handout.printing.rows import Row, select
from handout.printing.sending import (
    SILENT,
    Checked,
    Failed,
    Job,
    Listener,
    Pages,
    Remaining,
    Report,
    pieces,
    remaining,
    send,
)
from handout.profiles import Printer
from handout.sinks import picture_pdf
from handout.values import Drawing, Page, Raster
from handout.writing.layout import Layout

MOST_COPIES = 100  # of a row; set by eye, against a slip of the keyboard
BACK = "back"  # the part of a row that is the back of its envelope

# text, layout, number of the row → the page as it is written; the row's own random stream is the caller's matter
Write = Callable[[str, Layout, int], Drawing]
Ink = Callable[[Drawing, int], Raster]
Sink = Callable[[Drawing, Path], object]


def _plain_ink(drawing: Drawing, dpi: int) -> Raster:
    from handout.inking.plain import ink

    return ink(drawing, dpi)


def _write_drawing(drawing: Drawing, path: Path) -> object:
    from handout.sinks import write_drawing

    return write_drawing(drawing, path)


@dataclass(frozen=True)
class BatchPage:
    """A page of a row: which part of the row it is, its drawing, and how that becomes pixels or a picture.

    part : `ENVELOPE`, or in words, such as ``"letter 2"``.
    ink : dpi → the ink as it is; calibrate : the calibration of printer and paper, if there is one.
    save : writes the page to a .png or .svg file.
    """

    part: str
    drawing: Drawing
    ink: Callable[[int], Raster]
    calibrate: Calibrate | None = None
    save: Callable[[Path], object] = lambda path: None

    def pixels(self, dpi: int) -> DevicePixels:
        """The page as the pixels that are printed."""
        return device_pixels(self.ink(dpi), self.calibrate)


WriteRow = Callable[[Row], Sequence[BatchPage]]  # InputError where the row cannot be made


@dataclass(frozen=True)
class PageMaker:
    """How an address becomes a page, and the page pixels or a picture.

    write : (text, layout, row number) → Drawing.
    ink : (drawing, dpi) → Raster, the ink as it is.
    calibrate : the calibration of printer and paper, if there is one.
    sink : (drawing, path) → file, for pages as .png and .svg.
    x_height : mm; None: chosen for each address.
    about : seed, hand and options, stored in every PDF.
    """

    write: Write
    ink: Ink = _plain_ink
    calibrate: Calibrate | None = None
    sink: Sink = _write_drawing
    x_height: float | None = None
    about: Mapping[str, object] = field(default_factory=dict)

    def envelope(self, row: Row, page: Page) -> BatchPage:
        """The envelope of a row."""
        layout = address_layout(page, len(row.lines), max(map(len, row.lines)), self.x_height)
        drawing = self.write(address_text(row), layout, row.number)
        ink, save = partial(self.ink, drawing), partial(self.sink, drawing)
        return BatchPage(ENVELOPE, drawing, ink, self.calibrate, save)


@dataclass(frozen=True)
class BatchOptions:
    """Which rows are made, and where.

    rows : by their numbers in the file, ``"3-7,9"``, ``"7-"``; all for "".
    copies : of each row, 1 to 100, all alike; a row may have a number of its own besides.
    again : rows to make again when a run is gone on with, whatever became of them.
    out : .pdf (all pages in one), .png or .svg (a file a page), written instead of printing; for a simulated printer
        the folder of its jobs, unless it has one of these endings.
    all_or_none : whether a row that cannot be made keeps all of them from being made.
    """

    rows: str = ""
    copies: int = 1
    again: str = ""
    out: Path | None = None
    all_or_none: bool = False


def print_rows(
    rows: Sequence[Row],
    maker: PageMaker,
    profile: Printer,
    page: Page,
    options: BatchOptions = BatchOptions(),
    *,
    queue: Queue | None = None,
    journal: Journal | None = None,
    listener: Listener = SILENT,
) -> Report:
    """Address an envelope for every row and print it, or write it to a file.

    Every row is composed, inked and checked before the first is sent; rows that fail are reported together and the
    others are done.  Each envelope is a job of its own, so that a jam costs one envelope.

    Parameters
    ----------
    rows : sequence of Row
        The whole table.
    profile : Printer
        The machine; one that is a file (`profile.file`) needs `options.out`.
    page : Page
        The envelope as it is read.
    queue : Queue, optional
        Otherwise the profile's own, checked to exist before any work is done.
    journal : Journal, optional
        Keeps what became of every envelope; one that goes on with an earlier run says what is left.

    Raises
    ------
    InputError
        Rows that do not exist, copies out of bounds, a file that cannot be written.
    PrinterError
        No queue.
    PrintingStopped
        The queue refused a page after others had been sent.
    """
    journal = journal or Journal()
    chosen_rows(rows, options, journal.resumed)
    # what is wrong with the page or the size is wrong for every row: said once, now
    address_layout(page, 1, 1, maker.x_height)
    way = Way(profile, lambda page: profile, maker.about, queue=queue, resumed=journal.resumed, say=listener.say)
    with destination(way, options, [page]) as place:
        return make_rows(rows, lambda row: [maker.envelope(row, page)], place, options, journal, listener)


def make_rows(
    rows: Sequence[Row],
    write: WriteRow,
    place: Destination,
    options: BatchOptions,
    journal: Journal,
    listener: Listener = SILENT,
) -> Report:
    """Make the pages of every row that is asked for, check them all, then hand each to its device exactly once.

    Raises
    ------
    InputError
        Rows that do not exist, or copies out of bounds.
    PrintingStopped
        The device refused a page after others had been sent.
    """
    chosen, again = chosen_rows(rows, options, journal.resumed)
    copies = {row.number: options.copies * row.copies for row in chosen}
    todo = Remaining([row.number for row in chosen if not row.problem])
    if isinstance(place, Spool):
        todo = remaining(journal, place.queue, todo.fresh, copies, again)
        chosen = [row for row in chosen if row.problem or row.number in todo.rows]
    checked, parts = _checked(chosen, write, place, copies, listener)
    if checked.failed and options.all_or_none:
        raise RowsRefused(Report((), tuple(checked.failed), warnings=tuple(checked.warnings)))
    jobs: tuple[Job, ...] = ()
    if isinstance(place, Spool):
        made = {row: pieces(row, copies[row], parts[row]) for row in checked.done}
        jobs = send(place, checked, todo, made, _makeable(rows), journal, listener)
    place.finish()
    done = tuple(sorted({*checked.done, *(piece.row for piece in todo.wait)}))
    before, unknown = tuple(todo.done), tuple(todo.unknown)
    return Report(done, tuple(checked.failed), place.files(), jobs, tuple(checked.warnings), before, unknown)


def _makeable(rows: Sequence[Row]) -> list[int]:
    return [row.number for row in rows if not row.problem]


def _checked(
    rows: Sequence[Row], write: WriteRow, place: Destination, copies: Mapping[int, int], listener: Listener
) -> tuple[Checked, dict[int, list[str]]]:
    """Every row written and made ready, and the parts that each has."""
    checked, parts = Checked(), dict[int, list[str]]()
    for n, row in enumerate(rows):
        listener.progress(n, len(rows), "check")
        parts[row.number] = _check(row, write, place, copies[row.number], checked)
    listener.progress(len(rows), len(rows), "check")
    return checked, parts


class RowsRefused(InputError):
    """Some rows cannot be made, so that none is; `report` says which and why."""

    def __init__(self, report: Report) -> None:
        first = report.failed[0]
        more = f", nor can {units.count(len(report.failed) - 1, 'other')}" if len(report.failed) > 1 else ""
        super().__init__(
            f"Row {first.row} cannot be made{more}: {first.reason.rstrip('.')}. Nothing was made: mend the table or "
            "the letter, or make the other rows with --skip-bad."
        )
        self.report = report


def chosen_rows(rows: Sequence[Row], options: BatchOptions, resumed: bool) -> tuple[list[Row], set[int]]:
    """The rows that are asked for, and the numbers of those that are to be made whatever became of them."""
    if not 1 <= options.copies <= MOST_COPIES:
        raise InputError(f"copies: {options.copies} is outside 1 to {MOST_COPIES}.")
    chosen = select(rows, options.rows)
    again = {row.number for row in select(chosen, options.again)} if options.again else set()
    if again and not resumed:
        raise InputError("--again prints rows of a batch again that is gone on with: give --resume too.")
    return chosen, again


def _check(row: Row, write: WriteRow, place: Destination, copies: int, checked: Checked) -> list[str]:
    """Write a row and make it ready, or note why it cannot be; the parts that it has."""
    checked.warnings += [f"row {row.number}: {warning}" for warning in row.warnings]
    if row.problem:
        checked.failed.append(Failed(row.number, row.problem))
        return []
    try:
        pages = write(row)
        warnings = [warning for page in pages if (warning := place.warning(page))]
        place.take(row.number, pages, copies)
    except InputError as error:
        checked.failed.append(Failed(row.number, str(error)))
        return []
    checked.warnings += [f"row {row.number}: {warning}" for warning in dict.fromkeys(warnings)]
    checked.done.append(row.number)
    return [page.part for page in pages]


def margin_warning(drawing: Drawing, profile: Printer) -> str | None:
    """Whether the strokes, with their width, keep to what the printer can reach."""
    if drawing.bounds is None:
        return "nothing is written on it"
    pen = max((float(s.width.max()) for s in drawing.strokes if s.width is not None), default=0.0) / 2
    x0, y0, x1, y1 = drawing.bounds
    feeding = Feeding.of(drawing.page, profile)
    bounds = feeding.bounds((x0 - pen, y0 - pen, x1 + pen, y1 + pen))
    return media.margin_warning(bounds, feeding.sheet, profile.margins, profile.title)


@dataclass(frozen=True)
class Way:
    """The way to a printer, or to the file that stands for one.

    fed : page → the printer as it is fed with that.
    about : stored in every PDF.
    queue : that pages go to, if it is not the profile's own; resumed : whether a batch is gone on with.
    change : asks somebody to put in other paper, in words.
    """

    profile: Printer
    fed: Callable[[Page], Printer]
    about: Mapping[str, object]
    queue: Queue | None = None
    resumed: bool = False
    say: Say = lambda sentence: None
    change: Callable[[str], object] = lambda request: None


class Destination(Protocol):
    """Takes the pages of the checked rows; a context manager, so that no half-done file stays."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def warning(self, page: BatchPage) -> str | None:
        """What has to be said of a page before it goes there."""
        ...

    def take(self, number: int, pages: Sequence[BatchPage], copies: int) -> None:
        """Make ready what row `number` needs."""
        ...

    def finish(self) -> None:
        """All rows are taken, and what had to be sent is sent."""
        ...

    def files(self) -> tuple[Path, ...]:
        """What has been written for the user."""
        ...


@runtime_checkable
class Spool(Destination, Pages, Protocol):
    """A destination whose pages are sent to a device."""


class _Printed:
    """What pages on the way to a printer, or to a file that stands for one, have in common."""

    _way: Way

    def warning(self, page: BatchPage) -> str | None:
        """Ink that the printer does not reach."""
        return margin_warning(page.drawing, self._way.fed(page.drawing.page))

    def finish(self) -> None:
        """Nothing: pages are written as they are taken."""


class PdfFile(_Printed):
    """All pages in one PDF, each as it is read; the file appears when the batch is done."""

    def __init__(self, path: Path, way: Way) -> None:
        """Check now that `path` can be written."""
        atomic.check_writable(path)
        self._path, self._way = path, way
        self._stack = ExitStack()
        self._writer: picture_pdf.PdfWriter | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.__exit__(kind, error, trace)

    def take(self, number: int, pages: Sequence[BatchPage], copies: int) -> None:
        """Add the row's pages, once for each copy."""
        if self._writer is None:
            # only now, so that a batch without a single good row leaves no empty file
            self._writer = self._stack.enter_context(picture_pdf.document(self._path, self._way.about))
        inked = [(page.drawing.page, page.pixels(self._way.profile.dpi)) for page in pages]
        for _ in range(copies):
            for sheet, pixels in inked:
                self._writer.add(sheet, pixels)

    def files(self) -> tuple[Path, ...]:
        """The PDF, if it has a page."""
        return (self._path,) if self._writer is not None else ()


class PictureFiles(_Printed):
    """A file a page: ``cards.png`` becomes ``cards-002.png``, ``cards-003.png`` …, numbered as the table's rows.

    Of a row with several pages they are ``cards-002-letter-1.png``, ``cards-002-letter-2.png``, ``cards-002.png``.
    """

    def __init__(self, path: Path, way: Way) -> None:
        """Check now that `path` can be written."""
        atomic.check_writable(path)
        self._path, self._way = path, way
        self._pages: dict[Path, BatchPage] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        return None

    def take(self, number: int, pages: Sequence[BatchPage], copies: int) -> None:
        """Name the row's pictures."""
        for page in pages:
            part = f"-{page.part.replace(' ', '-')}" if page.part and len(pages) > 1 else ""
            self._pages[self._path.with_name(f"{self._path.stem}-{number:03d}{part}{self._path.suffix}")] = page

    def finish(self) -> None:
        """Write the pictures."""
        for path, page in self._pages.items():
            page.save(path)

    def files(self) -> tuple[Path, ...]:
        """The pictures."""
        return tuple(self._pages)


class PrintSpool(_Printed):
    """Pages prepared for a printer's queue, each a document in the direction of feed, in a temporary folder.

    Where envelopes are fed from a tray of their own, the pages of a row come out one after the other; else all
    letters come first, and somebody is asked once for the envelopes, and once for their backs.
    """

    def __init__(self, queue: Queue, way: Way) -> None:
        """Nothing is sent before `send` is called."""
        self.queue, self._way = queue, way
        self._stack = ExitStack()
        self._pages: dict[tuple[int, str], tuple[Path, Page]] = {}
        self._last: tuple[int, Page] | None = None

    def __enter__(self) -> Self:
        self._folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="handout-")))
        return self

    def __exit__(self, *exc: object) -> None:
        self._stack.close()

    def take(self, number: int, pages: Sequence[BatchPage], copies: int) -> None:
        """Make the row's pages ready."""
        format = self.queue.format
        for page in pages:
            profile, sheet = self._way.fed(page.drawing.page), page.drawing.page
            feeding = Feeding.of(sheet, profile)
            pixels = feeding.pixels(page.pixels(self.queue.resolution(profile.dpi)))
            path = self._folder / f"{_file_name(Piece(number, 1, page.part))}.{format}"
            path.write_bytes(WRITERS[format](feeding.sheet, pixels, {**self._way.about, "row": number}))
            self._pages[number, page.part] = path, sheet

    def sheets(self, pieces: Sequence[Piece]) -> Iterable[Sequence[Piece]]:
        """Every page is a job; in passes, where the paper has to be changed."""
        return ((piece,) for piece in sorted(pieces, key=self._pass))

    def _pass(self, piece: Piece) -> int:
        """In which pass a page is printed."""
        if piece.part == BACK:
            return 2
        sources = {self._way.fed(sheet).source for _, sheet in self._pages.values()}
        sizes = {sheet for _, sheet in self._pages.values()}
        return int(piece.part == ENVELOPE and len(sources) < len(sizes))

    def ready(self, sheet: Sequence[Piece]) -> None:
        """Ask for other paper where a new pass begins."""
        (piece,) = sheet
        now = self._pass(piece), self._pages[piece.row, piece.part][1]
        if self._last is not None and now[0] != self._last[0]:
            name = now[1].name or f"{now[1].width:g} x {now[1].height:g} mm"
            back = " again, with their backs to the print side and in the same order" if piece.part == BACK else ""
            self._way.change(f"Put in the envelopes ({name}){back}")
        self._last = now

    def send(self, sheet: Sequence[Piece], title: str) -> str:
        """Hand a page to the queue as a job of that title; the job's name there."""
        (piece,) = sheet
        path, page = self._pages[piece.row, piece.part]
        return self.queue.send(path, ticket(self._way.fed(page), page, title, _file_name(piece)))

    def files(self) -> tuple[Path, ...]:
        """Nothing for the user: it went to the queue."""
        return ()


def _file_name(piece: Piece) -> str:
    words = [f"row-{piece.row:03d}", *filter(None, [piece.part.replace(" ", "-")])]
    return "-".join([*words, *([str(piece.copy)] * (piece.copy > 1))])


def destination(way: Way, options: BatchOptions, sheets: Iterable[Page]) -> Destination:
    """Where the pages go: a queue, a simulated one, or the files that a name asks for.

    sheets : of which the printer is asked, before any work, whether it takes them.
    """
    out, profile, queue = options.out, way.profile, way.queue
    if queue is None and profile.simulated and (out is None or out.suffix == ""):
        queue = SimulatedQueue(out or Path("printed"), go_on=way.resumed)
    elif out is None:
        if queue is None and profile.file:
            raise InputError(f"{profile.title} writes a file: give it a name, such as --dry-run out.pdf.")
        queue = queue or open_queue(profile, way.say)
    else:
        suffix = out.suffix.lower()
        if suffix == ".pdf":
            return PdfFile(out, way)
        if suffix in (".png", ".svg"):
            return PictureFiles(out, way)
        raise InputError(f"{out}: pages are written as .pdf, .png or .svg; give the file one of these endings.")
    for page in sheets:
        queue.check(ticket(way.fed(page), page, "handout"))
    return PrintSpool(queue, way)
