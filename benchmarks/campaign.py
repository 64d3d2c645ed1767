"""Kill campaign: batches of letters and envelopes on simulated plotters and printers, killed at random: once each.

Every row has a letter of its own, four to a bed on plotters, and an envelope.  A program is killed at a random line of
the batch's journal (before or after it is written), at a random byte to or from the plotter, or within a printer's
taking of a page, and begun again with --resume until nothing is left; a plot's journal keeps then what was on the disk.
Five batches, on a GRBL, a Marlin, an EBB and two printers: 500 rows, 1000 pages, 200 kills; every page is made once.
What many rows cost, and workers that are killed: `benchmarks.scale`, which follows.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import scale
from benchmarks.faults import MACHINES as EVERY
from benchmarks.faults import OVERLAP, Crash, Desk, Somebody, journals, profile_of
from handout.merging.sheets import Grid
from handout.pipeline.plot_request import AttendanceOptions
from handout.pipeline.plot_rows import PlotSpool, PlotterQueue
from handout.pipeline.plotting import ReportFile, Unattended
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.job import Options
from handout.printing import journal
from handout.printing.batch import BatchOptions, PrintSpool, Way, make_rows
from handout.printing.journal import ENVELOPE, Journal, Piece
from handout.printing.prepared import BatchPage, RowMaker
from handout.printing.queue import Outcome, SimulatedQueue, Ticket
from handout.printing.rows import Row
from handout.profiles import Printer
from handout.simulated.plotter.ink_comparison import SLACK, compare
from handout.simulated.plotter.options import Options as Simulated
from handout.values import Drawing, Page, Raster, Stroke

MACHINES = (EVERY[0], EVERY[5], EVERY[8])  # a GRBL, a Marlin and an EBB
PRINTERS = 2
ROWS, KILLS = 100, 40  # of each of the five
_CARD, _ENVELOPE = Page(60.0, 40.0), Page(80.0, 50.0)
_STEPS = 0.2  # mm by which a place may be known too early, as in `faults`
_ENDLESS = 1800.0  # s of a sheet: whatever takes longer would never end
_MOST_RUNS = 400  # of a batch; one that needs more would never end


@dataclass
class Tally:
    """What became of a batch: pieces by how often they were made, what was wrong on sheets, kills and runs."""

    made: Counter[Piece] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    kills: int = 0
    runs: int = 0

    def verdict(self, rows: Sequence[Row]) -> str:
        """ "right", or what is wrong."""
        wanted = {Piece(row.number, 1, part) for row in rows for part in ("letter 1", ENVELOPE)}
        if missing := wanted - self.made.keys():
            return f"{len(missing)} missing"
        if twice := [piece for piece, count in self.made.items() if count > 1]:
            return f"{len(twice)} made twice, such as {twice[0]}"
        return self.wrong[0] if self.wrong else "right"


def rows(count: int) -> list[Row]:
    """Rows of a table, numbered from 2."""
    return [Row(number, (f"Name {number}", "Street", "Town")) for number in range(2, count + 2)]


def write(row: Row) -> list[BatchPage]:
    """The letter and the envelope of a row: each a line that no other page has."""
    drawings = (_line(row.number, _CARD), _line(row.number + 0.5, _ENVELOPE))
    parts = ("letter 1", ENVELOPE)
    return [BatchPage(part, drawing, _blank) for part, drawing in zip(parts, drawings, strict=True)]


def _blank(dpi: int) -> Raster:
    return Raster(np.zeros((2, 2, 4), dtype=np.float32), dpi)


def _line(number: float, page: Page) -> Drawing:
    """A bent line of a length and at a height that no other of a hundred rows has."""
    x = np.linspace(8.0, 18.0 + 0.3 * number, 12)
    y = 8.0 + number * 1.7 % (page.height - 16.0) + np.sin(x)
    return Drawing((Stroke(np.linspace(0.0, 1.5, 12), np.column_stack([x, y]), word=0),), page, {"words": ["row"]})


@dataclass
class Fate:
    """When the program is killed next: after so many lines of the journal, if it has not been by then."""

    rng: np.random.Generator
    lines: int = -1
    written: bool = False

    @contextlib.contextmanager
    def over(self, kept: Journal) -> Iterator[None]:
        """A run of which the journal counts towards the end."""
        real = kept._write

        def counted(entry: Any) -> None:
            if self.lines == 0 and not self.written:
                raise Crash
            real(entry)
            if self.lines == 0:
                raise Crash
            self.lines -= 1

        kept._write = counted  # type: ignore[method-assign]
        yield


class CountingDesk(Desk):
    """A desk that keeps what was drawn on every sheet."""

    def __init__(self, profile: Any, options: Simulated) -> None:
        self.sheets: list[Drawing] = []
        super().__init__(profile, options)

    def lay(self, page: Page, placement: Any) -> None:
        """A fresh sheet; the last is put away."""
        self.sheets.append(self.executed())
        super().lay(page, placement)


class DeskQueue(PlotterQueue):
    """A plotter on a desk."""

    desk: CountingDesk

    def follow(self, job: str) -> Outcome:
        """Draw it, with somebody there who does what is asked."""
        kept = store.find(job)
        if not kept.standing().finished:
            self.desk.replug(1.0)  # the connection for the sheet before is closed
            self.desk.until = self.desk.now + _ENDLESS
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
        if self.kill_at == 0 and not self.fate.written:
            raise Crash
        job = super().send(pdf, ticket)
        if self.kill_at == 0:
            raise Crash
        return job


def plotted(machine: int, count: int, kills: int, seed: int, folder: Path) -> tuple[Tally, list[Row]]:
    """A batch on a plotter, killed so many times."""
    rng, table, tally = np.random.default_rng([seed, machine]), rows(count), Tally()
    profile = profile_of(MACHINES[machine])
    desk = CountingDesk(profile, Simulated(**dict(MACHINES[machine].options)))
    jobs: dict[str, tuple[Drawing, tuple[Piece, ...]]] = {}
    options = Options(overlap=OVERLAP)
    with journals(desk) as safe:
        for _ in range(_MOST_RUNS):
            fate = Fate(rng)
            if tally.kills < kills:
                if rng.random() < 0.5:
                    fate.lines, fate.written = int(rng.integers(1, 8 * count // kills + 2)), bool(rng.integers(2))
                else:
                    desk.crash = desk.calls + int(rng.integers(1, 120 * count // kills))
            queue = DeskQueue(profile, "sim:", options, Unattended("sim:"), AttendanceOptions(), ReportFile(None))
            queue.desk = desk
            place = DeskSpool(queue, jobs)
            if _ran(lambda kept, place=place: _made(table, place, kept), folder, fate, tally):
                break
            desk.crash, desk.crashed = -1, False
            for job in store.every():
                path = job.folder / "journal"
                if not job.standing().finished and path.stat().st_ino in safe:
                    os.truncate(path, safe[path.stat().st_ino])
            desk.replug(60.0)
    _judge(desk, jobs, tally)
    return tally, table


def _made(table: Sequence[Row], place: Any, kept: Journal) -> None:
    with place:
        make_rows(table, RowMaker(write, place.prepare).each, place, BatchOptions(), kept)


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
            assert kept._stream is not None
            kept._stream.close()
            return False
    return True


def _judge(desk: CountingDesk, jobs: dict[str, tuple[Drawing, tuple[Piece, ...]]], tally: Tally) -> None:
    """Find every job on one sheet, and look whether all of its ink is there, and once."""
    sheets = [sheet for sheet in (*desk.sheets, desk.executed()) if sheet.strokes]
    used = set[int]()
    for whole, pieces in jobs.values():
        found = []
        for number, sheet in enumerate(sheets):
            if not np.allclose(sheet.bounds or np.inf, whole.bounds or 0.0, atol=1.0):
                continue
            ink = compare(whole, sheet.strokes)
            if not (ink.missing or ink.gap > SLACK or ink.dots or ink.stray or ink.deviation > SLACK):
                found.append(number)
                if ink.doubled > (OVERLAP + _STEPS) * (1 + tally.kills):
                    tally.wrong.append(f"{ink.doubled:.1f} mm drawn twice")
        used |= set(found)
        tally.made.update(piece for piece in pieces for _ in found)
    tally.wrong += [f"sheet {number} has other ink" for number in range(len(sheets)) if number not in used]


def printed(number: int, count: int, kills: int, seed: int, folder: Path) -> tuple[Tally, list[Row]]:
    """A batch on a printer, killed so many times."""
    rng, table, tally = np.random.default_rng([seed, 100 + number]), rows(count), Tally()
    profile = Printer(kind="printer", title="Simulated", dpi=36, simulated=True)
    for _ in range(_MOST_RUNS):
        fate = Fate(rng, written=bool(rng.integers(2)))
        queue = FallibleQueue(folder / "printed", go_on=True)
        queue.fate = fate
        if tally.kills < kills:
            if rng.random() < 0.5:
                fate.lines = int(rng.integers(1, 8 * count // kills + 2))
            else:
                queue.kill_at = int(rng.integers(1, 2 * count // kills + 2))
        place = PrintSpool(queue, Way(profile, lambda page: profile, {}, queue))
        if _ran(lambda kept, place=place: _made(table, place, kept), folder, fate, tally):
            break
    for entry in queue._log:
        words = entry.split('"title": "')[1].split('"')[0].split()
        tally.made[Piece(int(words[3]), 1, " ".join(words[4:]))] += 1
    return tally, table


def campaign(count: int, kills: int, seed: int, only: Sequence[int] = range(len(MACHINES) + PRINTERS)) -> list[Tally]:
    """Batches on every machine; raises AssertionError where a row was not made exactly once."""
    tallies = []
    for number in only:
        with tempfile.TemporaryDirectory() as name, _state(Path(name)):
            if number < len(MACHINES):
                tally, table = plotted(number, count, kills, seed, Path(name))
            else:
                tally, table = printed(number - len(MACHINES), count, kills, seed, Path(name))
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
    """Print what became of five batches."""
    import time

    begun = time.process_time()
    kills = runs = made = 0
    for number in range(len(MACHINES) + PRINTERS):
        (tally,) = campaign(ROWS, KILLS, 1, [number])
        name = MACHINES[number].title if number < len(MACHINES) else f"printer {number - len(MACHINES) + 1}"
        print(f"{name:24} {ROWS} rows, {sum(tally.made.values())} pages, {tally.kills} kills, {tally.runs} runs: right")
        kills, runs, made = kills + tally.kills, runs + tally.runs, made + sum(tally.made.values())
    print(f"{ROWS * 5} rows, {made} pages, {kills} kills, {runs} runs, {time.process_time() - begun:.0f} s of CPU")
    scale.main()
