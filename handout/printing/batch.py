"""A table of addresses through the printer: every row checked first, one job an envelope, nothing lost in a jam."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from handout.errors import InputError, PrinterError
from handout.printing import media, selection
from handout.printing.address import Row
from handout.printing.destination import Destination, Ink, Sink, Spool, Target, preview
from handout.printing.envelope import address_layout, address_text
from handout.printing.submit import Queue, SimulatedQueue, open_queue
from handout.profiles import Printer
from handout.values import Drawing, Page, Raster
from handout.writing.layout import Layout

# what the command says once before it prints on a printer that no chart has been measured on
UNCALIBRATED = (
    "The colours are not calibrated for this printer and paper: the ink will look as the printer makes it, "
    "which may be lighter, darker or of another hue than the hand's own."
)
_MOST_COPIES = 100

# text, layout, number of the row → the page as it is written; the row's own random stream is the caller's matter
Write = Callable[[str, Layout, int], Drawing]
# done, all, what is being done ("check" or "send")
Progress = Callable[[int, int, str], object]


@dataclass(frozen=True)
class Failed:
    """A row that could not be done, and why."""

    row: int
    reason: str


@dataclass(frozen=True)
class Job:
    """A row that went to the queue, and the name of its job there."""

    row: int
    name: str


@dataclass(frozen=True)
class Report:
    """What became of a batch.

    rows : numbers of the rows that are done; failed : the others, with reasons; files : what was written;
    jobs : what was sent; warnings : sentences that name their row.
    """

    rows: tuple[int, ...] = ()
    failed: tuple[Failed, ...] = ()
    files: tuple[Path, ...] = ()
    jobs: tuple[Job, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def exit_code(self) -> int:
        """0 all done, 4 some rows failed and the others were done, 2 none could be done."""
        if not self.failed:
            return 0
        return 4 if self.rows else 2


class PrintingStopped(PrinterError):
    """The queue failed in the middle of a batch; `report` holds what was sent, `resume` the rows to ask for again."""

    def __init__(self, message: str, report: Report, resume: str) -> None:
        super().__init__(message)
        self.report = report
        self.resume = resume


@dataclass
class _Checked:
    """The outcome of the checks so far."""

    done: list[int] = field(default_factory=list)
    failed: list[Failed] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def print_rows(
    rows: Sequence[Row],
    write: Write,
    profile: Printer,
    page: Page,
    *,
    out: Path | None = None,
    queue: Queue | None = None,
    select: str = "",
    copies: int = 1,
    x_height: float | None = None,
    ink: Ink | None = None,
    sink: Sink | None = None,
    about: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> Report:
    """Address an envelope for every row and print it, or write it to `out`.

    Every row is composed, inked and checked before the first is sent; rows that fail are reported together and the
    others are done.  Each envelope is a job of its own, so that a jam costs one envelope.

    Parameters
    ----------
    rows : sequence of Row
        The whole table.
    write : callable
        (text, layout, row number) → Drawing.
    profile : Printer
        The machine; one that is a file (`profile.file`) needs `out`.
    page : Page
        The envelope as it is read.
    out : Path, optional
        .pdf (all pages in one), .png or .svg (a file a row): written instead of printing.  For a simulated printer
        it is the folder of its jobs, unless it has one of these endings.
    queue : Queue, optional
        Otherwise the profile's own, checked to exist before any work is done.
    select : str
        Rows by their numbers in the file: ``"3-7,9"``, ``"7-"``; all for "".
    copies : int
        Envelopes for each row, 1 to 100, all alike.
    x_height : float, optional
        mm; otherwise chosen for each address.
    ink, sink : callable, optional
        (drawing, dpi) → Raster and (drawing, path) → file; otherwise handout's own.
    about : mapping, optional
        Seed, hand and options, stored in every PDF.
    progress : callable, optional
        Called as (done, all, "check" or "send").

    Raises
    ------
    InputError
        Rows that do not exist, copies out of bounds, a file that cannot be written.
    PrinterError
        No queue.
    PrintingStopped
        The queue refused a page after others had been sent.
    """
    if not 1 <= copies <= _MOST_COPIES:
        raise InputError(f"copies: {copies} is outside 1 to {_MOST_COPIES}.")
    # what is wrong with the page or the size is wrong for every row: said once, now
    address_layout(page, 1, 1, x_height)
    chosen = selection.select(rows, select)
    target = Target(profile, ink or _plain_ink, about or {})
    tell = progress or (lambda done, total, stage: None)
    with _destination(target, out, queue, sink or _write_drawing, copies) as destination:
        checked = _Checked()
        for n, row in enumerate(chosen):
            tell(n, len(chosen), "check")
            _check(row, write, profile, page, x_height, destination, checked)
        tell(len(chosen), len(chosen), "check")
        jobs: tuple[Job, ...] = ()
        if isinstance(destination, Spool):
            table = [row.number for row in rows if not row.problem]
            jobs = _send(destination, checked, copies, table, tell)
        files = destination.files()
    return Report(tuple(checked.done), tuple(checked.failed), files, jobs, tuple(checked.warnings))


def _destination(target: Target, out: Path | None, queue: Queue | None, sink: Sink, copies: int) -> Destination:
    profile = target.profile
    if queue is None and profile.simulated and (out is None or out.suffix == ""):
        queue = SimulatedQueue(out or Path("printed"))
        return Spool(queue, target)
    if out is not None:
        return preview(out, target, sink, copies)
    if queue is None and profile.file:
        raise InputError(f"{profile.title} writes a file: give it a name, such as --dry-run out.pdf.")
    return Spool(queue or open_queue(profile), target)


def _check(
    row: Row,
    write: Write,
    profile: Printer,
    page: Page,
    x_height: float | None,
    destination: Destination,
    checked: _Checked,
) -> None:
    """Compose a row and make it ready, or note why it cannot be."""
    checked.warnings += [f"row {row.number}: {warning}" for warning in row.warnings]
    if row.problem:
        checked.failed.append(Failed(row.number, row.problem))
        return
    try:
        layout = address_layout(page, len(row.lines), max(map(len, row.lines)), x_height)
        drawing = write(address_text(row), layout, row.number)
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
    turn = media.turn_for(drawing.page, profile)
    bounds = media.turned_bounds((x0 - pen, y0 - pen, x1 + pen, y1 + pen), drawing.page, turn)
    return media.margin_warning(bounds, media.turned_page(drawing.page, turn), profile.margins, profile.title)


def _send(
    spool: Spool, checked: _Checked, copies: int, table: Sequence[int], tell: Callable[[int, int, str], object]
) -> tuple[Job, ...]:
    """Send what passed; a failure on the way says what went and how to go on."""
    jobs: list[Job] = []
    whole = [n for n in table if n not in {failed.row for failed in checked.failed}]
    for n, number in enumerate(checked.done):
        tell(n, len(checked.done), "send")
        with _resumable(number, copies, checked, jobs, whole):
            for _ in range(copies):
                name = spool.send(number)
                jobs.append(Job(number, name))
    tell(len(checked.done), len(checked.done), "send")
    return tuple(jobs)


@contextmanager
def _resumable(number: int, copies: int, checked: _Checked, jobs: list[Job], whole: Sequence[int]) -> Iterator[None]:
    """Turns a queue's failure, and adds to an interruption, the rows that went and those that did not."""
    try:
        yield
    except (PrinterError, KeyboardInterrupt) as error:
        sent = tuple(n for n in checked.done if n < number)
        left = [n for n in checked.done if n >= number]
        resume = selection.ranges(left, whole)
        went = f"Rows {selection.ranges(sent, whole)} were sent" if sent else "Nothing was sent"
        begun = sum(job.row == number for job in jobs)
        part = f" and {begun} of {copies} copies of row {number}" if begun else ""
        told = f"{went}{part}; go on with --rows {resume}."
        if isinstance(error, KeyboardInterrupt):
            error.add_note(f"Stopped at row {number}. {told}")
            raise
        rest = tuple(Failed(n, "not sent") for n in left)
        report = Report(sent, (*checked.failed, *rest), (), tuple(jobs), tuple(checked.warnings))
        raise PrintingStopped(f"Row {number}: {error} {told}", report, resume) from error


def _plain_ink(drawing: Drawing, dpi: int) -> Raster:
    from handout.inking.plain import ink

    return ink(drawing, dpi)


def _write_drawing(drawing: Drawing, path: Path) -> object:
    from handout.sinks import write_drawing

    return write_drawing(drawing, path)
