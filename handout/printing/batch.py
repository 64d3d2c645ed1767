"""A table of addresses through the printer: every row checked first, one job an envelope, nothing lost in a jam."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from handout.errors import InputError
from handout.printing import media
from handout.printing.destination import Destination, Ink, Sink, Spool, Target, preview
from handout.printing.envelope import address_layout, address_text
from handout.printing.journal import Journal
from handout.printing.media import Feeding
from handout.printing.printers import open_queue, ticket
from handout.printing.queue import Queue, Say, SimulatedQueue
from handout.printing.report import Failed, Job, PrintingStopped, Report
from handout.printing.rows import Row
from handout.printing.rows import select as select_rows
from handout.printing.sending import Checked, Left, left, send
from handout.profiles import Printer
from handout.values import Drawing, Page, Raster
from handout.writing.layout import Layout

# what the command says once before it prints on a printer that no chart has been measured on
UNCALIBRATED = (
    "The colours are not calibrated for this printer and paper: the ink will look as the printer makes it, "
    "which may be lighter, darker or of another hue than the hand's own; handout calibrate wizard makes it match."
)
__all__ = ["UNCALIBRATED", "Failed", "Job", "PrintingStopped", "Report", "print_rows"]
_MOST_COPIES = 100

# text, layout, number of the row → the page as it is written; the row's own random stream is the caller's matter
Write = Callable[[str, Layout, int], Drawing]
# done, all, what is being done ("check" or "send")
Progress = Callable[[int, int, str], object]


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
    journal: Journal | None = None,
    again: str = "",
    say: Say = lambda message: None,
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
    journal : Journal, optional
        Keeps what became of every envelope; one that goes on with an earlier run says what is left.
    again : str
        Rows to print again when a run is gone on with, whatever became of them.
    say : callable, optional
        Told what the printer has to be waited for.

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
    chosen = select_rows(rows, select)
    journal = journal or Journal()
    anew = {row.number for row in select_rows(chosen, again)} if again else set()
    if anew and not journal.resumed:
        raise InputError("--again prints rows of a batch again that is gone on with: give --resume too.")
    target = Target(profile, lambda drawing, dpi: _page_raster(drawing, dpi, ink or _plain_ink), about or {})
    tell = progress or (lambda done, total, stage: None)
    with _destination(target, out, queue, sink or _write_drawing, copies, journal.resumed, say) as destination:
        todo = Left()
        if isinstance(destination, Spool):
            destination.queue.check(ticket(profile, page, "handout"))
            todo = left(journal, destination.queue, [r.number for r in chosen if not r.problem], copies, anew)
            sent = {row for row, _ in todo.send}
            chosen = [row for row in chosen if row.problem or row.number in sent]
        checked = Checked()
        for n, row in enumerate(chosen):
            tell(n, len(chosen), "check")
            _check(row, write, profile, page, x_height, destination, checked)
        tell(len(chosen), len(chosen), "check")
        jobs: tuple[Job, ...] = ()
        if isinstance(destination, Spool):
            table = [row.number for row in rows if not row.problem]
            jobs = send(destination, checked, todo, copies, table, journal, tell)
        files = destination.files()
    done = sorted({*checked.done, *(row for row, _ in todo.wait)})
    return Report(
        tuple(done), tuple(checked.failed), files, jobs, tuple(checked.warnings), tuple(todo.done), tuple(todo.unknown)
    )


def _page_raster(drawing: Drawing, dpi: int, ink: Ink) -> Raster:
    """A page as pixels for the printer: the one place through which the colours of every page go."""
    return ink(drawing, dpi)


def _destination(
    target: Target, out: Path | None, queue: Queue | None, sink: Sink, copies: int, go_on: bool, say: Say
) -> Destination:
    profile = target.profile
    if queue is None and profile.simulated and (out is None or out.suffix == ""):
        queue = SimulatedQueue(out or Path("printed"), go_on=go_on)
        return Spool(queue, target)
    if out is not None:
        return preview(out, target, sink, copies)
    if queue is None and profile.file:
        raise InputError(f"{profile.title} writes a file: give it a name, such as --dry-run out.pdf.")
    return Spool(queue or open_queue(profile, say), target)


def _check(
    row: Row,
    write: Write,
    profile: Printer,
    page: Page,
    x_height: float | None,
    destination: Destination,
    checked: Checked,
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
    feeding = Feeding.of(drawing.page, profile)
    bounds = feeding.bounds((x0 - pen, y0 - pen, x1 + pen, y1 + pen))
    return media.margin_warning(bounds, feeding.sheet, profile.margins, profile.title)


def _plain_ink(drawing: Drawing, dpi: int) -> Raster:
    from handout.inking.plain import ink

    return ink(drawing, dpi)


def _write_drawing(drawing: Drawing, path: Path) -> object:
    from handout.sinks import write_drawing

    return write_drawing(drawing, path)
