"""A table and a plotter: the letters and envelopes of its rows, sheet after sheet, several cards on one bed.

The batch is that of printers: its rows, its journal, how it is gone on with.  A sheet is a job of `plotting.jobs`,
which goes on within a stroke where it broke off; the plotter says by these jobs what became of a page.
"""

from __future__ import annotations

import contextlib
import gzip
import itertools
import threading
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from handout.errors import DoesNotFit, InputError
from handout.merging.sheets import Grid, grid
from handout.pipeline import merging
from handout.pipeline.options import MergeOptions, TableOptions
from handout.pipeline.plot_request import AttendanceOptions, PartOptions, PlotOptions, PlotRequest
from handout.pipeline.plotting import (
    AtPlotter,
    AttendedPlotter,
    Drawn,
    ReportFile,
    asked_machine,
    is_simulated,
    job_options,
    shown_pages,
)
from handout.pipeline.results import SILENT, Attendant
from handout.pipeline.row_work import BatchDelivery, make_all
from handout.pipeline.texts import STROKES
from handout.plotting import bed
from handout.plotting.dialects import dialect
from handout.plotting.driver import connect
from handout.plotting.jobs import store
from handout.plotting.jobs.store import JobOptions
from handout.plotting.planning.plan import Plan
from handout.printing.journal import BACK, ENVELOPE, Piece
from handout.printing.prepared import NOTHING, BatchPage, Destination, PreparedPage
from handout.printing.queue import Outcome
from handout.printing.rows import name_rows
from handout.printing.sending import Spool
from handout.printing.several import Several
from handout.profiles import Plotter
from handout.sinks import Look, check_outputs, write_drawings
from handout.sinks.drawing_json import to_json
from handout.sources.drawing_json import from_json
from handout.values import Drawing, Page

_PENS = "--columns pen=…: a plotter draws with the pen that is in it; the column shows in pictures alone."


@dataclass(frozen=True, kw_only=True)
class PlottedRows(BatchDelivery, Drawn):
    """What became of a table that was plotted, or would be."""


def plot_rows(
    table: str | Path,
    request: PlotRequest,
    port: str | Sequence[str] | None,
    batch: tuple[TableOptions, MergeOptions] = (TableOptions(), MergeOptions()),
    attendance: AttendanceOptions = AttendanceOptions(),
    *,
    outputs: Sequence[str | Path] = (),
    attendant: Attendant = SILENT,
) -> PlottedRows:
    """Plot a letter, an envelope or both for every row of a table; with `outputs`, write what would be plotted.

    request : how it is written and plotted; its source is not looked at.
    port : see `plotting.open_port`; of several plotters each makes the next row that no other has.
    batch : the options of the table, and those of its letters.

    Raises TableError, InputError: the table or the letter cannot be read, or an option is wrong.
    Raises RowsRefused: there are letters, and some rows cannot be made: nothing was plotted.
    Raises DeviceError, PrintingStopped: the plotter cannot be reached, or failed; the message says how to go on.
    """
    (rows, merge), plotting, paths = batch, request.plotting, [Path(name) for name in outputs]
    account = ReportFile(attendance.report)
    check_outputs(paths)
    ports = [port] if isinstance(port, str) else list(port or ())
    profile = asked_machine(plotting, ports[0] if ports else None)
    how = request.writing, request.sheet, request.picture
    pages = merging.open_rows(table, rows, merge, how, attendant, STROKES)
    task, sheet, shared = pages.look(), request.sheet, grid(plotting.grid, plotting.gap)
    _check_grid(shared, task.layout.page, profile)
    ways = {name: getattr(plotting, name) for name in ("order", "layers", "grid", "pen_up", "pen_down")}
    more = {**ways, "gap": str(plotting.gap), "margin": sheet.margin, "pages": sheet.pages, "device": profile.name}
    rows = replace(rows, copies=plotting.copies)
    options, record = merging.begin_batch(pages, rows, more, envelopes_to=plotting.envelopes_to, dry_run=bool(paths))
    place: PlotFiles | PlotSpool | Several
    queues = list[PlotterQueue]()
    job = job_options(replace(plotting, copies=1), profile, task.fast)
    if paths:
        place = PlotFiles(shared, profile, paths, task.look, job)
    else:
        queue = partial(PlotterQueue, profile, options=job, attendance=attendance, account=account)
        place, queues = _plotters(shared, ports, plotting, queue, attendant)
    several = attendant.plotting() if isinstance(place, Several) else contextlib.nullcontext()
    notes = [*task.given_notes, *([_PENS] if pages.merge.fields.says("pen") else [])]
    with record, place, several:
        made = make_all(pages, place, options, (rows, record), drawn=True, notes=notes, listener=attendant)
    reports = tuple(part for plotter in queues for part in plotter.reports)
    times = Drawn(reports=reports).executed_facts()
    if isinstance(place, PlotFiles):
        account.write_plans(place.plans)
        times = {"planned_s": round(sum(planned.duration for planned in place.plans), 2)}
    own = {"told": {**made.told, **times}, "destination": ", ".join([*ports, *plotting.envelopes_to])}
    return PlottedRows(**{**vars(made), **own}, reports=reports)


def _plotters(
    shared: Grid, ports: Sequence[str], plotting: PlotOptions, queue: Callable[..., PlotterQueue], attendant: Attendant
) -> tuple[PlotSpool | Several, list[PlotterQueue]]:
    """Open the plotters at these ports; of several, each is spoken of by its name, and only one asks at a time."""
    addresses = [*ports, *plotting.envelopes_to]
    if len(addresses) == 1:
        only = queue(person=AtPlotter(attendant, ports[0]))
        return PlotSpool(shared, only.profile, only.open()), [only]
    names = list[str]()
    for address in addresses:
        if address in addresses[: len(names)] and not is_simulated(address):
            raise InputError(f"{address} is named twice: each plotter makes its own pages.")
        names.append(f"{address}{len(names) + 1}" if addresses.count(address) > 1 else address)
    spools, queues, asking = list[PlotSpool](), list[PlotterQueue](), threading.Lock()
    try:
        for name, address in zip(names, addresses, strict=True):
            queues.append(queue(person=AtPlotter(attendant, address, name, asking)).open())
            spools.append(PlotSpool(shared, queues[-1].profile, queues[-1]))
    except BaseException:
        for each in queues:
            each.close()
        raise
    return Several(spools[: len(ports)], spools[len(ports) :]), queues


def _check_grid(shared: Grid, card: Page, profile: Plotter) -> None:
    """Refuse a grid that is larger than the bed, before anything is written."""
    sheet, reach = shared.sheet(card), profile.bed
    upright = sheet.width <= reach.width and sheet.height <= reach.height
    turned = sheet.width <= reach.height and sheet.height <= reach.width
    if shared.cards > 1 and not (upright or turned):
        raise DoesNotFit(
            f"grid: {shared.across} x {shared.down} cards of {card.width:g} x {card.height:g} mm take "
            f"{sheet.width:g} x {sheet.height:g} mm, and the bed of {profile.name or profile.title} has "
            f"{reach.width:g} x {reach.height:g} mm: use fewer cards, a smaller --gap or a smaller --page."
        )


@dataclass(frozen=True)
class _OnSheet:
    """Prepares a page, and checks that the machine reaches it wherever it lies on its sheet."""

    shared: Grid
    profile: Plotter

    def __call__(self, number: int, page: BatchPage) -> PreparedPage:
        drawing, grid = page.drawing, _grid(page.part, self.shared)
        placed = bed.place(grid.sheet(drawing.page), self.profile)
        corner = np.array(grid.corner(grid.cards - 1, drawing.page))
        for stroke in drawing.strokes:
            bed.check(placed.to_machine(np.concatenate([stroke.xy, stroke.xy + corner])), self.profile)
        warning = bed.beyond_paper(drawing) if drawing.strokes else NOTHING
        data = gzip.compress(to_json(replace(drawing, ink=None, inked=None)), 1, mtime=0)
        return PreparedPage(page.part, drawing.page, data, warning or "")


def _grid(part: str, shared: Grid) -> Grid:
    """Envelopes lie on the bed alone."""
    return Grid() if part in (ENVELOPE, BACK) else shared


class _Sheets(Destination):
    """Pages on their way to a plotter: kept on the disk, and laid on sheets together."""

    def __init__(self, shared: Grid, profile: Plotter) -> None:
        super().__init__()
        self.shared, self.profile = shared, profile
        self.prepare = _OnSheet(shared, profile)
        self._pages: dict[tuple[int, str], tuple[Path, Page]] = {}
        self._copies: dict[int, int] = {}

    def take(self, number: int, pages: Sequence[PreparedPage], copies: int) -> None:
        """Keep the row's pages."""
        for page in pages:
            path = self.keep(f"{number}-{page.part or 'envelope'}.json.gz", page.data)
            self._pages[number, page.part] = path, page.page
        self._copies[number] = copies

    def sheets(self, pieces: Iterable[Piece]) -> Iterator[Sequence[Piece]]:
        """Letters first, as many on a sheet as there is room for; then envelopes, then their backs."""
        envelopes, backs = list[Piece](), list[Piece]()
        yield from self._group_alike(_letters(pieces, envelopes, backs), self.shared.cards)
        for kind in (envelopes, backs):
            yield from self._group_alike(kind, 1)

    def _group_alike(self, pieces: Iterable[Piece], many: int) -> Iterator[Sequence[Piece]]:
        """Neighbours of one size, as many on a sheet as there is room for."""
        for _, alike in itertools.groupby(pieces, lambda piece: self._pages[piece.row, piece.part][1]):
            while sheet := list(itertools.islice(alike, many)):
                yield sheet

    def drawing(self, sheet: Sequence[Piece]) -> Drawing:
        """A sheet with all that lies on it."""
        cards = [from_json(gzip.decompress(self._pages[piece.row, piece.part][0].read_bytes())) for piece in sheet]
        return _grid(sheet[0].part, self.shared).lay_cards(cards)


class PlotFiles(_Sheets):
    """Sheets as they would be plotted, written to files."""

    def __init__(self, shared: Grid, profile: Plotter, paths: Sequence[Path], look: Look, options: JobOptions) -> None:
        super().__init__(shared, profile)
        self._paths, self._look, self._options = paths, look, options
        self._written: tuple[Path, ...] = ()
        self.plans: list[Plan] = []

    def finish(self) -> None:
        """Write all sheets."""
        pieces = [Piece(row, copy, part) for row, part in self._pages for copy in range(1, self._copies[row] + 1)]
        if not pieces:
            return
        pieces.sort(key=lambda piece: (piece.row, piece.copy))
        sheets = [self.drawing(sheet) for sheet in self.sheets(pieces)]
        shown, self.plans = shown_pages(sheets, PartOptions(), self.profile, self._options, SILENT)
        self._written = tuple(write_drawings(shown, self._paths, self._look))

    def files(self) -> tuple[Path, ...]:
        """The previews."""
        return self._written


class PlotSpool(_Sheets, Spool):
    """Sheets for a plotter."""

    queue: PlotterQueue

    def __init__(self, shared: Grid, profile: Plotter, queue: PlotterQueue) -> None:
        super().__init__(shared, profile)
        self.queue = queue

    def ready(self, sheet: Sequence[Piece]) -> None:
        """Have the sheet put in."""
        rows, part = name_rows(sorted({piece.row for piece in sheet})), sheet[0].part
        wanted = f"the envelope of {rows}" if part in (ENVELOPE, BACK) else f"a sheet for {rows}"
        self.queue.feed(f"{wanted}, its back up" if part == BACK else wanted)

    def send(self, sheet: Sequence[Piece], title: str) -> str:
        """Keep a sheet as a job of that title; its name."""
        job = self.queue.begin(self.drawing(sheet), title)
        for piece in sheet:
            if piece.copy == self._copies[piece.row]:
                self._pages[piece.row, piece.part][0].unlink(missing_ok=True)
        return job


def _letters(pieces: Iterable[Piece], envelopes: list[Piece], backs: list[Piece]) -> Iterator[Piece]:
    """Yield the pieces of letters; put those of envelopes and backs aside."""
    for piece in pieces:
        if piece.part in (ENVELOPE, BACK):
            (envelopes if piece.part == ENVELOPE else backs).append(piece)
        else:
            yield piece


@dataclass(kw_only=True)
class PlotterQueue(AttendedPlotter):
    """A plotter as a device of a batch: a sheet is a job that is kept until it is drawn."""

    options: JobOptions
    keeps: bool = False
    _sheets: int = 0

    @property
    def name(self) -> str:
        """What to call it: by its address, if it is the only one there."""
        return self.person.name or self.person.address

    def feed(self, sheet: str) -> None:
        """Put a sheet in, by the machine's feeder or by asking for it; the first lies there already."""
        self._sheets += 1
        if self._sheets == 1:
            return
        if not self.profile.feeder.command:
            self.person.do(f"Put in {sheet}")
            return
        with contextlib.closing(self if self.port else self.open()):
            assert self.port is not None
            controller = connect(self.port, self.profile, lambda sentence: None)
            for line in self.profile.feeder.command:
                controller.send(f"{line}{dialect(self.profile.dialect).line_end}".encode())
            controller.finish()

    def begin(self, drawing: Drawing, title: str) -> str:
        """A job of one sheet, on the disk when this returns; its name."""
        return store.create([drawing], self.profile, self.options, title=title, port=self.person.address).name

    def follow(self, job: str, title: str) -> Outcome:
        """Draw a job, or what is left of it."""
        kept, self._sheets = store.find(job), max(self._sheets, 1)
        if not kept.standing().finished:
            self.draw(kept)
            self.attendance = replace(self.attendance, at_zero=False)
        return Outcome("completed")

    def outcome(self, job: str, title: str, earlier: Collection[str] = ()) -> Outcome:
        """What became of a job whose name or title is known."""
        # of that name if it is known, which may have been given again to another
        kept = next((plot for plot in store.list_kept_jobs() if plot.title == title and job in ("", plot.name)), None)
        if kept is None:
            if job:
                return Outcome("unknown", "that plot is not kept any more")
            return Outcome("failed", "no such plot was begun")
        return Outcome("completed" if kept.standing().finished else "waiting", job="" if job else kept.name)

    def cancel(self, job: str, title: str) -> Outcome:
        """Nothing to cancel: what has been begun is kept."""
        return self.outcome(job, title)
