"""Many rows: rows a CPU second, what several processes cost, memory at 100,000 rows, workers killed at random.

CPU seconds are those of all processes, the one that takes the rows included; one process and two make the same rows in
turns, so that whatever else the machine does falls on both.  Memory is that of a process of its own for each size of
table: its rows are real and their pages are not, but bytes of a page's size, so that the table, the journal and what is
known of the rows are measured, and not the ink.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from handout.pipeline import merging
from handout.pipeline.merging import RowPages
from handout.pipeline.options import MergeOptions, PictureOptions, SheetOptions, TableOptions, WritingOptions
from handout.pipeline.results import SILENT
from handout.pipeline.row_work import MadeRow, ProcessWorkers, Remote, RowWork, open_workers, row_work
from handout.printing.batch import BatchOptions, PrinterWay, PrintSpool, make_rows
from handout.printing.journal import ENVELOPE, Journal
from handout.printing.prepared import PreparedPage, PreparedRow, PrinterPage
from handout.printing.queue import Outcome, Queue, Ticket
from handout.printing.rows import TableRow
from handout.profiles import Printer, find
from handout.values import Page

_EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
_PRINTER = find("simulated", "printer")
ROWS = 16  # of each kind
_PAGE = 60_000  # bytes of a page, of those that stand for one
SIZES = (1_000, 10_000, 100_000)  # rows of tables
_KILLED = 24  # rows of the batches whose workers are killed


def _fed(page: Page) -> Printer:
    assert isinstance(_PRINTER, Printer)
    return _PRINTER


@dataclass(frozen=True)
class TimedWork(RowWork):
    """Says of each row how long it took, s of CPU, as a warning."""

    def make(self, row: TableRow) -> MadeRow:
        """As always."""
        begun = time.process_time()
        made = super().make(row)
        return replace(made, row=replace(made.row, warnings=(str(time.process_time() - begun),)))


def work(hand: str, letter: str | None = None, *, dpi: int = 600, envelopes: bool = False, pen: str = "") -> TimedWork:
    """The rows of the example's table in a hand."""
    options = MergeOptions(letter and str(_EXAMPLES / letter), with_envelopes=envelopes)
    merged = merging.read_merge(_EXAMPLES / "people.csv", TableOptions(), options, SILENT)
    sheet = SheetOptions(usual_page="A4" if letter else "DL")
    pages = RowPages(merged, WritingOptions(hand), sheet, PictureOptions(pen=pen or None), seed=1)
    made = row_work(pages, PrinterPage(_fed, "pdf", dpi, {}))
    return TimedWork(made.pages, made.prepare, hands=made.hands)


def _rows(count: int, of: RowWork) -> list[TableRow]:
    """So many, the example's over and over."""
    table = of.pages.merge.table.rows
    return [replace(table[n % len(table)], number=n + 2) for n in range(count)]


def speed(title: str, of: TimedWork, count: int = ROWS) -> None:
    """Print what a row costs."""
    rows = _rows(count + 2, of)
    with open_workers(of, 1, "", print) as here:
        made = [each.row for each in here.make_each(rows)]
    costs = [float(row.warnings[0]) for row in made if not row.problem]  # that hands lack letters for cost nothing
    first, kept = costs[0], sorted(costs[2:])
    print(
        f"{title:34} {sum(kept) / len(kept):6.2f} s a row (least {kept[0]:.2f}, the first {first:.2f}): "
        f"{len(kept) / sum(kept):.2f} rows a CPU second"
    )


def _timed(workers: RowWork | Remote, rows: list[TableRow]) -> tuple[float, float]:
    """CPU seconds of all processes, and seconds, for these rows."""
    own, begun = time.process_time(), time.perf_counter()
    made = sum(float(each.row.warnings[0]) for each in workers.make_each(rows))
    here = time.process_time() - own
    return (here if isinstance(workers, ProcessWorkers) else 0.0) + made, time.perf_counter() - begun


def efficiency(of: TimedWork, turns: int = 4, count: int = 8) -> None:
    """Print what two processes make of two processors."""
    rows, cpu, clock = _rows(count, of), [0.0, 0.0], [0.0, 0.0]
    with open_workers(of, 1, "", print) as here, open_workers(of, 2, "", print) as two:
        for workers in (here, two):
            list(workers.make_each(rows[:4]))  # hands are loaded, processes begun
        for _ in range(turns):
            for number, workers in enumerate((here, two)):
                spent, lasted = _timed(workers, rows)
                cpu[number] += spent
                clock[number] += lasted
    load = os.getloadavg()[0]
    print(
        f"two processes: {cpu[0] / cpu[1]:.2f} of the rows a CPU second that one makes; "
        f"{clock[0] / clock[1] / 2:.2f} of linear by the clock (load of the machine {load:.1f})"
    )


class _Taken(Queue):
    """A printer that takes everything."""

    name = "nowhere"

    def send(self, page: Path, ticket: Ticket) -> str:
        return ticket.name

    def outcome(self, job: str, title: str, earlier: Collection[str] = ()) -> Outcome:
        return Outcome("completed")


def _cheap(rows: Iterable[TableRow]) -> Iterator[PreparedRow]:
    sheet = Page(210.0, 297.0, "A4")
    for row in rows:
        pages = (PreparedPage(part, sheet, os.urandom(16) * (_PAGE // 16)) for part in ("letter 1", ENVELOPE))
        yield PreparedRow(row.number, tuple(pages))


def keep(count: int) -> None:
    """Print the memory that a batch of so many rows takes, in MB: with the table, and at the end."""
    with tempfile.TemporaryDirectory() as name:
        path, lines = Path(name) / "table.csv", (_EXAMPLES / "people.csv").read_text(encoding="utf-8").splitlines()
        body = (lines[1 + n % (len(lines) - 1)] for n in range(count))
        path.write_text("\n".join([lines[0], *body]), encoding="utf-8")
        before = _most()
        options = MergeOptions(str(_EXAMPLES / "thanks.md"), with_envelopes=True)
        merged = merging.read_merge(path, TableOptions(), options, SILENT)
        table, begun = _most(), time.process_time()
        place = PrintSpool(_Taken(), PrinterWay(_fed(Page(1, 1)), _fed, {}), [Page(210.0, 297.0, "A4")])
        with place:
            make_rows(merged.table, _cheap, place, BatchOptions(), Journal())
            left = sum(1 for _ in place._folder.iterdir())
        spent = (time.process_time() - begun) / count
        assert not left, "pages that were sent are kept"
    print(f"{count:7} rows: {before:4.0f} MB before, {table:4.0f} with the table, {_most():4.0f} at the end; ", end="")
    print(f"{1000 * spent:.2f} ms of CPU a row for taking, keeping and journalling it", flush=True)


def _most() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _killed(workers: RowWork | Remote, rows: list[TableRow], pids: Callable[[], list[int]]) -> tuple[list[Any], int]:
    """The pages of rows of which one in four is followed by the end of one of some processes, and how many ended."""
    rng, made, kills = random.Random(1), [], 0
    for each in workers.make_each(rows):
        made.append(each.row.pages)
        if rng.random() < 0.25 and (alive := pids()):
            with contextlib.suppress(ProcessLookupError):
                os.kill(rng.choice(sorted(alive)), signal.SIGKILL)
                kills += 1
    return made, kills


def _children(before: set[Any]) -> list[int]:
    return [one.pid for one in set(multiprocessing.active_children()) - before if one.pid is not None]


def survived() -> None:
    """Print how many kills of processes and of a cluster's workers batches survive, each page as it should be."""
    of = work("house-print", "thanks.md", dpi=72, envelopes=True, pen="plain")
    rows = _rows(_KILLED, of)
    with open_workers(of, 1, "", print) as here:
        wanted = [made.row.pages for made in here.make_each(rows)]
    before = set(multiprocessing.active_children())
    with open_workers(of, 2, "", print) as two:
        made, kills = _killed(two, rows, lambda: _children(before))
    assert made == wanted
    print(f"two processes, {kills} killed at random: {len(rows)} rows, the same bytes, in their order")
    distributed: Any = __import__("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": 50}
    with (
        distributed.LocalCluster(**options) as cluster,
        open_workers(of, 1, cluster.scheduler_address, print) as workers,
    ):
        made, kills = _killed(workers, rows, lambda: [one.pid for one in cluster.workers.values() if one.pid])
    assert made == wanted
    print(f"a Dask cluster, {kills} workers killed at random: {len(rows)} rows, the same bytes, in their order")


def main() -> None:
    """Print all of it."""
    speed("envelope, drawn hand, 600 dpi", work("house-joined"))
    speed("envelope, scanned hand, 600 dpi", work("house-joined-ballpoint"), ROWS // 2)
    speed("letter of a page, drawn, 600 dpi", work("house-joined", "thanks.md"))
    speed("letter of three pages, drawn", work("house-joined", "letter.md"), 4)
    efficiency(work("house-joined"))
    for count in SIZES:
        subprocess.run([sys.executable, "-m", "benchmarks.scale", str(count)], check=True)
    survived()


if __name__ == "__main__":
    keep(int(sys.argv[1])) if len(sys.argv) > 1 else main()
