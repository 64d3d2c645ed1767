"""Kill campaign: batches of letters and envelopes on simulated plotters and printers, killed at random: once each.

Every row has a letter of its own, four to a bed on plotters, and an envelope.  A program is killed at a random line of
the batch's journal (before or after it is written), at a random byte to or from the plotter, or within a printer's
taking of a page, and begun again with --resume until nothing is left; a plot's journal keeps then what was on the disk.
Ten batches: a GRBL, a Marlin, an EBB, two printers; the three plotters at once, the two printers at once; then
three Klippers at once, on four GRBLs over real sockets, on the four newest profiles.  Every page is made once, and the
letter and the envelope of a row by one machine.
What many rows cost, and workers that are killed: `benchmarks.scale`, which follows.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NoReturn
from unittest.mock import patch

import numpy as np

from benchmarks import scale
from benchmarks.faults import KLIPPER, NETWORK, NEWEST, OVERLAP, Crash, Desk, Machine, Somebody, journals, profile_of
from benchmarks.faults import MACHINES as EVERY
from handout.merging.sheets import Grid
from handout.pipeline.plot_rows import PlotSpool, PlotterQueue
from handout.pipeline.plotting import AtPlotter
from handout.pipeline.results import Attendant
from handout.plotting import bed
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.store import JobOptions
from handout.printing import journal
from handout.printing.batch import BatchOptions, PrinterWay, PrintSpool, make_rows
from handout.printing.journal import ENVELOPE, Journal, Piece
from handout.printing.prepared import BatchPage, prepare_row
from handout.printing.queue import Outcome, SimulatedQueue, Ticket
from handout.printing.rows import TableRow
from handout.printing.several import Several
from handout.profiles import Printer
from handout.simulated.plotter.options import SimulatorOptions as Simulated
from handout.values import Drawing, Page, Raster, Stroke
from handout_lab.ink_comparison import SLACK, compare
from handout_lab.simulated import NetworkedPlotter

MACHINES = (EVERY[0], EVERY[5], EVERY[8], *KLIPPER[:3], *NETWORK, *NEWEST)  # first a GRBL, a Marlin and an EBB
PRINTERS = 2
ROWS, KILLS = 100, 40  # of each batch
_CARD, _ENVELOPE = Page(60.0, 40.0), Page(80.0, 50.0)
_STEPS = 0.2  # mm by which a place may be known too early, as in `faults`
_ENDLESS = 1800.0  # s of a sheet: whatever takes longer would never end
_MOST_RUNS = 400  # of a batch; one that needs more would never end


@dataclass
class Tally:
    """What became of a batch: pieces by how often they were made, what was wrong on sheets, kills and runs."""

    made: Counter[Piece] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    machines: set[tuple[int, int]] = field(default_factory=set)  # row, machine that made something of it
    kills: int = 0
    runs: int = 0

    def verdict(self, rows: Sequence[TableRow]) -> str:
        """ "right", or what is wrong."""
        wanted = {Piece(row.number, 1, part) for row in rows for part in ("letter 1", ENVELOPE)}
        if missing := wanted - self.made.keys():
            return f"{len(missing)} missing"
        if twice := [piece for piece, count in self.made.items() if count > 1]:
            return f"{len(twice)} made twice, such as {twice[0]}"
        if len(self.machines) != len(rows):
            return f"{len(self.machines) - len(rows)} rows whose letter and envelope are parted"
        return self.wrong[0] if self.wrong else "right"


Batch = tuple[Tally, list[TableRow]]


def rows(count: int) -> list[TableRow]:
    """Rows of a table, numbered from 2."""
    return [TableRow(number, (f"Name {number}", "Street", "Town")) for number in range(2, count + 2)]


def write(row: TableRow) -> list[BatchPage]:
    """The letter and the envelope of a row: each a line that no other page has."""
    drawings = (_line(row.number, _CARD), _line(row.number + 0.5, _ENVELOPE))
    parts = ("letter 1", ENVELOPE)
    return [BatchPage(part, drawing, _blank) for part, drawing in zip(parts, drawings, strict=True)]


def _blank(dpi: int) -> Raster:
    return Raster(np.zeros((2, 2, 4), dtype=np.uint8), dpi)


def _line(number: float, page: Page) -> Drawing:
    """A bent line of a length and at a height that no other of five hundred rows has."""
    x = np.linspace(8.0, 18.0 + 0.3 * (number % 100), 12)
    y = 8.0 + (number * 1.7 + 3.0 * (number // 100)) % (page.height - 16.0) + np.sin(x)
    return Drawing((Stroke(np.linspace(0.0, 1.5, 12), np.column_stack([x, y]), word=0),), page, {"words": ["row"]})


@dataclass
class Fate:
    """When the program is killed next: after so many lines of the journal, if it has not been by then."""

    rng: np.random.Generator
    lines: int = -1
    written: bool = False
    dead: bool = False  # the program is: no thread of it does anything more

    @contextlib.contextmanager
    def over(self, kept: Journal) -> Iterator[None]:
        """A run of which the journal counts towards the end."""
        real = kept._write

        def counted(entry: Any) -> None:
            if self.dead or (self.lines == 0 and not self.written):
                self.die()
            real(entry)
            if self.lines == 0:
                self.die()
            self.lines -= 1

        with patch.object(kept, "_write", counted):
            yield

    def die(self) -> NoReturn:
        """The program is killed, with all of its threads."""
        self.dead = True
        raise Crash


class CountingDesk(Desk):
    """A desk that keeps what was drawn on every sheet.

    job : that is drawn; laid : jobs whose sheet was put in.
    """

    fate: Fate | None = None
    job = ""

    def _count(self) -> None:
        dead = self.fate is not None and self.fate.dead
        try:
            if dead:
                raise Crash
            super()._count()
        except Crash:
            self.crashed = True
            if self.fate is not None:
                self.fate.dead = True
            raise

    def __init__(self, profile: Any, options: Simulated) -> None:
        self.sheets: list[Drawing] = []
        self.laid: set[str] = set()
        super().__init__(profile, options)

    def lay(self, page: Page, placement: Any) -> None:
        """A fresh sheet; the last is put away."""
        self.sheets.append(self.executed_drawing())
        self.laid.add(self.job)
        super().lay(page, placement)


class NetworkedCountingDesk(CountingDesk, NetworkedPlotter):
    """The same with a plotter on a network."""


def _desk(machine: Machine) -> CountingDesk:
    options = Simulated(**dict(machine.options))
    return (NetworkedCountingDesk if options.network else CountingDesk)(profile_of(machine), options)


class DeskQueue(PlotterQueue):
    """A plotter on a desk."""

    desk: CountingDesk

    def follow(self, job: str, title: str) -> Outcome:
        """Draw it, with somebody there who does what is asked."""
        kept = store.find(job)
        if not kept.standing().finished:
            self.desk.replug(1.0)  # the connection for the sheet before is closed
            self.desk.until = self.desk.now + _ENDLESS
            self.desk.job = job
            if (
                kept.standing().begun and job not in self.desk.laid
            ):  # killed between a sheet's being put in and its line
                page = kept.drawing(kept.standing().part).page
                self.desk.lay(page, bed.place(page, kept.profile))
            runner.run_job(kept, lambda: self.desk, Somebody(self.desk), runner.RunOptions(patience=60.0))
        return Outcome("completed")


class DeskSpool(PlotSpool):
    """Notes which pieces lie on which job's sheet, for the judge."""

    def __init__(self, queue: DeskQueue, jobs: dict[str, tuple[Drawing, tuple[Piece, ...]]]) -> None:
        super().__init__(Grid(2, 2, 3.0), queue.profile, queue)
        self._jobs = jobs

    def send(self, sheet: Sequence[Piece], title: str) -> str:
        """As always."""
        whole = self.drawing(sheet)
        name = super().send(sheet, title)
        self._jobs[name] = whole, tuple(sheet)
        return name


class FallibleQueue(SimulatedQueue):
    """A printer that may be taking a page when the program is killed: before or after it has it."""

    fate: Fate
    kill_at = -1

    def send(self, pdf: Path, ticket: Ticket) -> str:
        """Take a page."""
        self.kill_at -= 1
        if self.fate.dead or (self.kill_at == 0 and not self.fate.written):
            self.fate.die()
        job = super().send(pdf, ticket)
        if self.kill_at == 0:
            self.fate.die()
        return job


def plotted(machines: Sequence[int], count: int, kills: int, seed: int) -> Batch:
    """A batch on plotters, killed so many times."""
    rng, table, tally = np.random.default_rng([seed, *machines]), rows(count), Tally()
    desks = [_desk(MACHINES[n]) for n in machines]
    jobs: dict[str, tuple[Drawing, tuple[Piece, ...]]] = {}
    folder = store.folder().parent
    with journals(desks) as safe:
        for _ in range(_MOST_RUNS):
            fate = Fate(rng)
            for desk in desks:
                desk.fate, desk.crash, desk.crashed = fate, -1, False
            if tally.kills < kills:
                if rng.random() < 0.5:
                    fate.lines, fate.written = int(rng.integers(1, 8 * count // kills + 2)), bool(rng.integers(2))
                else:
                    desk = desks[rng.integers(len(desks))]
                    desk.crash = desk.calls + int(rng.integers(1, 120 * count // kills // len(desks) + 2))
            spools = [DeskSpool(_queue(desk, n), jobs) for n, desk in enumerate(desks)]
            if _ran(_work(table, spools), folder, fate, tally):
                break
            for job in store.list_kept_jobs():
                path = (job.folder / "journal").resolve()
                if not job.standing().finished and path in safe:
                    os.truncate(path, safe[path])
            for desk in desks:
                desk.replug(60.0)
    for number, desk in enumerate(desks):
        desk.fate = None
        _judge(desk, jobs, tally, number)
    return tally, table


def _queue(desk: CountingDesk, number: int) -> DeskQueue:
    person = AtPlotter(Attendant(), "sim:", f"desk {number}")
    queue = DeskQueue(desk.profile, person, options=JobOptions(overlap=OVERLAP))
    queue.desk = desk
    return queue


def _work(table: Sequence[TableRow], spools: Sequence[Any]) -> Callable[[Journal], None]:
    place = Several(spools) if len(spools) > 1 else spools[0]
    return lambda kept: _made(table, place, kept)


def _made(table: Sequence[TableRow], place: Any, kept: Journal) -> None:
    with place:
        made = partial(prepare_row, write, place.prepare)
        make_rows(table, partial(map, made), place, BatchOptions(), kept)


def _ran(work: Any, folder: Path, fate: Fate, tally: Tally) -> bool:
    """One run of a program; whether it came to its end."""
    tally.runs += 1
    what = journal.Batch(Path("table.csv"), {"a": 1})
    try:
        kept = journal.begin(what, 1, folder) if tally.runs == 1 else journal.resume(what, folder)
    except Exception as error:
        if "nothing to resume" not in str(error):
            raise
        kept = journal.begin(what, 1, folder)
    with fate.over(kept):
        try:
            work(kept)
            fate.lines = -1
            kept.__exit__(None, None, None)
        except Crash:
            tally.kills += 1
            assert kept._file is not None
            kept._file.close()
            return False
    return True


def _judge(
    desk: CountingDesk, jobs: dict[str, tuple[Drawing, tuple[Piece, ...]]], tally: Tally, number: int = 0
) -> None:
    """Find on which sheets of a desk jobs lie, and look whether all of their ink is there, and once."""
    sheets = [sheet for sheet in (*desk.sheets, desk.executed_drawing()) if sheet.strokes]
    used = set[int]()
    for whole, pieces in jobs.values():
        found = []
        for at, sheet in enumerate(sheets):
            if not np.allclose(sheet.bounds or np.inf, whole.bounds or 0.0, atol=1.0):
                continue
            ink = compare(whole, sheet.strokes)
            if not (ink.missing or ink.gap > SLACK or ink.dots or ink.stray or ink.deviation > SLACK):
                found.append(at)
                if ink.doubled > (OVERLAP + _STEPS) * (1 + tally.kills):
                    tally.wrong.append(f"{ink.doubled:.1f} mm drawn twice")
        used |= set(found)
        tally.made.update(piece for piece in pieces for _ in found)
        tally.machines.update({(piece.row, number) for piece in pieces if found})
    tally.wrong += [f"sheet {number} has other ink" for number in range(len(sheets)) if number not in used]


def printed(printers: Sequence[int], count: int, kills: int, seed: int) -> Batch:
    """A batch on printers, killed so many times."""
    rng, table, tally = np.random.default_rng([seed, 100, *printers]), rows(count), Tally()
    profile = Printer(kind="printer", title="Simulated", dpi=36, simulated=True)
    folder = store.folder().parent
    for _ in range(_MOST_RUNS):
        fate = Fate(rng, written=bool(rng.integers(2)))
        queues = [FallibleQueue(folder / f"printed-{n}", go_on=True) for n in printers]
        for queue in queues:
            queue.fate = fate
        if tally.kills < kills:
            if rng.random() < 0.5:
                fate.lines = int(rng.integers(1, 8 * count // kills + 2))
            else:
                queues[rng.integers(len(queues))].kill_at = int(rng.integers(1, 2 * count // kills // len(queues) + 2))
        spools = [PrintSpool(queue, PrinterWay(profile, lambda page: profile, {}, queue)) for queue in queues]
        if _ran(_work(table, spools), folder, fate, tally):
            break
    for number, queue in enumerate(queues):
        for entry in queue._log:
            words = entry.split('"title": "')[1].split('"')[0].split()
            tally.made[Piece(int(words[3]), 1, " ".join(words[4:]))] += 1
            tally.machines.add((int(words[3]), number))
    return tally, table


# number of a batch → what makes it, and on which of the machines
BATCHES: Sequence[tuple[Callable[..., Batch], Sequence[int]]] = (
    *((plotted, [n]) for n in range(3)),
    *((printed, [n]) for n in range(PRINTERS)),
    (plotted, range(3)),
    (printed, range(PRINTERS)),
    *((plotted, group) for group in (range(3, 6), range(6, 10), range(10, 14))),
)


def campaign(count: int, kills: int, seed: int, only: Sequence[int]) -> list[Tally]:
    """Batches by their numbers in `BATCHES`; AssertionError where a page was not made once, or a row's were parted."""
    tallies = []
    for number in only:
        make, machines = BATCHES[number]
        with tempfile.TemporaryDirectory() as name, _state(Path(name)):
            tally, table = make(machines, count, kills, seed)
            tallies.append(tally)
            assert tally.verdict(table) == "right", tally.verdict(table)
    return tallies


@contextlib.contextmanager
def _state(folder: Path) -> Iterator[None]:
    """Jobs are kept in this folder."""
    real = store.folder, store.prune
    store.folder = lambda: folder / "plots"
    store.prune = lambda place=None, keep=0: None  # the judge wants all of them
    try:
        yield
    finally:
        store.folder, store.prune = real


def main() -> None:
    """Print what became of every batch."""
    import time

    begun = time.process_time()
    kills = runs = made = 0
    for number, (make, machines) in enumerate(BATCHES):
        (tally,) = campaign(ROWS, KILLS, 1, [number])
        kind = "plotter" if make is plotted else "printer"
        name, pages = f"{kind} {', '.join(str(n + 1) for n in machines)}", sum(tally.made.values())
        print(f"{name:16} {ROWS} rows, {pages} pages, {tally.kills} kills, {tally.runs} runs: right", flush=True)
        kills, runs, made = kills + tally.kills, runs + tally.runs, made + pages
    print(f"{made} pages, {kills} kills, {runs} runs, {time.process_time() - begun:.0f} s of CPU")
    scale.main()
