"""Turns the rows of an address table into pages: composes, checks and prepares each, then sends or writes them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self

from handout import atomic
from handout.errors import InputError
from handout.inking.device_pixels import Calibrate, DevicePixels, device_pixels
from handout.printing import media
from handout.printing.documents import WRITERS
from handout.printing.envelope import address_layout, address_text
from handout.printing.journal import Journal
from handout.printing.media import Feeding
from handout.printing.printers import open_queue, ticket
from handout.printing.queue import Queue, Say, SimulatedQueue
from handout.printing.rows import Row, select
from handout.printing.sending import SILENT, Checked, Failed, Job, Listener, Remaining, Report, remaining, send
from handout.profiles import Printer
from handout.sinks import picture_pdf
from handout.values import Drawing, Page, Raster
from handout.writing.layout import Layout

_MOST_COPIES = 100  # of a row; set by eye, against a slip of the keyboard

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

    def pixels(self, drawing: Drawing, dpi: int) -> DevicePixels:
        """The page as the pixels that are printed."""
        return device_pixels(self.ink(drawing, dpi), self.calibrate)


@dataclass(frozen=True)
class BatchOptions:
    """Which rows are printed, and where.

    rows : by their numbers in the file, ``"3-7,9"``, ``"7-"``; all for "".
    copies : envelopes for each row, 1 to 100, all alike.
    again : rows to print again when a run is gone on with, whatever became of them.
    out : .pdf (all pages in one), .png or .svg (a file a row), written instead of printing; for a simulated printer
        the folder of its jobs, unless it has one of these endings.
    """

    rows: str = ""
    copies: int = 1
    again: str = ""
    out: Path | None = None


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
    chosen, again = _chosen_rows(rows, options, journal.resumed)
    # what is wrong with the page or the size is wrong for every row: said once, now
    address_layout(page, 1, 1, maker.x_height)
    with _destination(maker, profile, options, queue, journal.resumed, listener.say) as destination:
        todo = Remaining()
        if isinstance(destination, Spool):
            destination.queue.check(ticket(profile, page, "handout"))
            numbers = [row.number for row in chosen if not row.problem]
            todo = remaining(journal, destination.queue, numbers, options.copies, again)
            chosen = [row for row in chosen if row.problem or row.number in {number for number, _ in todo.send}]
        checked = Checked()
        for n, row in enumerate(chosen):
            listener.progress(n, len(chosen), "check")
            _check(row, maker, profile, page, destination, checked)
        listener.progress(len(chosen), len(chosen), "check")
        jobs: tuple[Job, ...] = ()
        if isinstance(destination, Spool):
            table = [row.number for row in rows if not row.problem]
            jobs = send(destination, checked, todo, options.copies, table, journal, listener)
        files = destination.files()
    done = sorted({*checked.done, *(row for row, _ in todo.wait)})
    return Report(
        tuple(done), tuple(checked.failed), files, jobs, tuple(checked.warnings), tuple(todo.done), tuple(todo.unknown)
    )


def _chosen_rows(rows: Sequence[Row], options: BatchOptions, resumed: bool) -> tuple[list[Row], set[int]]:
    """The rows that are asked for, and the numbers of those that are to be printed whatever became of them."""
    if not 1 <= options.copies <= _MOST_COPIES:
        raise InputError(f"copies: {options.copies} is outside 1 to {_MOST_COPIES}.")
    chosen = select(rows, options.rows)
    again = {row.number for row in select(chosen, options.again)} if options.again else set()
    if again and not resumed:
        raise InputError("--again prints rows of a batch again that is gone on with: give --resume too.")
    return chosen, again


def _check(
    row: Row, maker: PageMaker, profile: Printer, page: Page, destination: Destination, checked: Checked
) -> None:
    """Compose a row and make it ready, or note why it cannot be."""
    checked.warnings += [f"row {row.number}: {warning}" for warning in row.warnings]
    if row.problem:
        checked.failed.append(Failed(row.number, row.problem))
        return
    try:
        layout = address_layout(page, len(row.lines), max(map(len, row.lines)), maker.x_height)
        drawing = maker.write(address_text(row), layout, row.number)
    except InputError as error:
        checked.failed.append(Failed(row.number, str(error)))
        return
    warning = _margin_warning(drawing, profile)
    if warning:
        checked.warnings.append(f"row {row.number}: {warning}")
    destination.take(row.number, drawing)
    checked.done.append(row.number)


def _margin_warning(drawing: Drawing, profile: Printer) -> str | None:
    """Whether the strokes, with their width, keep to what the printer can reach."""
    if drawing.bounds is None:
        return "nothing is written on it"
    pen = max((float(s.width.max()) for s in drawing.strokes if s.width is not None), default=0.0) / 2
    x0, y0, x1, y1 = drawing.bounds
    feeding = Feeding.of(drawing.page, profile)
    bounds = feeding.bounds((x0 - pen, y0 - pen, x1 + pen, y1 + pen))
    return media.margin_warning(bounds, feeding.sheet, profile.margins, profile.title)


class Destination(Protocol):
    """Takes the drawings of the checked rows; a context manager, so that no half-done file stays."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def take(self, number: int, drawing: Drawing) -> None:
        """Make ready what row `number` needs."""
        ...

    def files(self) -> tuple[Path, ...]:
        """What has been written for the user."""
        ...


class PdfFile:
    """All pages in one PDF, each as it is read; the file appears when the batch is done."""

    def __init__(self, path: Path, maker: PageMaker, dpi: int, copies: int = 1) -> None:
        """Check now that `path` can be written."""
        atomic.check_writable(path)
        self._path, self._maker, self._dpi, self._copies = path, maker, dpi, copies
        self._stack = ExitStack()
        self._writer: picture_pdf.PdfWriter | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.__exit__(kind, error, trace)

    def take(self, number: int, drawing: Drawing) -> None:
        """Add the row's page, once for each copy."""
        if self._writer is None:
            # only now, so that a batch without a single good row leaves no empty file
            self._writer = self._stack.enter_context(picture_pdf.document(self._path, self._maker.about))
        pixels = self._maker.pixels(drawing, self._dpi)
        for _ in range(self._copies):
            self._writer.add(drawing.page, pixels)

    def files(self) -> tuple[Path, ...]:
        """The PDF, if it has a page."""
        return (self._path,) if self._writer is not None else ()


class PictureFiles:
    """A file a row: ``cards.png`` becomes ``cards-002.png``, ``cards-003.png`` …, numbered as the table's rows."""

    def __init__(self, path: Path, sink: Sink) -> None:
        """`sink` writes one drawing to one path, its format told by the suffix."""
        atomic.check_writable(path)
        self._path, self._sink = path, sink
        self._written: list[Path] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        return None

    def take(self, number: int, drawing: Drawing) -> None:
        """Write the row's picture."""
        path = self._path.with_name(f"{self._path.stem}-{number:03d}{self._path.suffix}")
        self._sink(drawing, path)
        self._written.append(path)

    def files(self) -> tuple[Path, ...]:
        """The pictures."""
        return tuple(self._written)


class Spool:
    """Pages prepared for a queue, each a document in the direction of feed, in a temporary folder."""

    def __init__(self, queue: Queue, maker: PageMaker, profile: Printer) -> None:
        """Nothing is sent before `send` is called."""
        self.queue, self._maker, self._profile = queue, maker, profile
        self._stack = ExitStack()
        self._pages: dict[int, tuple[Path, Page]] = {}

    def __enter__(self) -> Self:
        self._folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="handout-")))
        return self

    def __exit__(self, *exc: object) -> None:
        self._stack.close()

    def take(self, number: int, drawing: Drawing) -> None:
        """Make the row's page ready."""
        feeding, format = Feeding.of(drawing.page, self._profile), self.queue.format
        pixels = feeding.pixels(self._maker.pixels(drawing, self.queue.resolution(self._profile.dpi)))
        path = self._folder / f"row-{number:03d}.{format}"
        path.write_bytes(WRITERS[format](feeding.sheet, pixels, {**self._maker.about, "row": number}))
        self._pages[number] = path, drawing.page

    def send(self, number: int, title: str, name: str) -> str:
        """Hand the row's page to the queue as a job of that title; the job's name there."""
        path, page = self._pages[number]
        return self.queue.send(path, ticket(self._profile, page, title, name))

    def files(self) -> tuple[Path, ...]:
        """Nothing for the user: it went to the queue."""
        return ()


def _destination(
    maker: PageMaker, profile: Printer, options: BatchOptions, queue: Queue | None, resumed: bool, say: Say
) -> Destination:
    """Where the pages go: a queue, a simulated one, or the files that a name asks for."""
    out = options.out
    if queue is None and profile.simulated and (out is None or out.suffix == ""):
        return Spool(SimulatedQueue(out or Path("printed"), go_on=resumed), maker, profile)
    if out is None:
        if queue is None and profile.file:
            raise InputError(f"{profile.title} writes a file: give it a name, such as --dry-run out.pdf.")
        return Spool(queue or open_queue(profile, say), maker, profile)
    suffix = out.suffix.lower()
    if suffix == ".pdf":
        return PdfFile(out, maker, profile.dpi, options.copies)
    if suffix in (".png", ".svg"):
        return PictureFiles(out, maker.sink)
    raise InputError(f"{out}: pages are written as .pdf, .png or .svg; give the file one of these endings.")
