"""Damage campaign: bytes that come over wrong, either way, on plotters of all dialects; what is noticed, and mended.

And journals of plots and of batches that are damaged on the disk: what is gone on with (`tell_journals`).
4000 of each: none says more than is drawn, none loses or repeats a row unsaid.

Every run damages one random byte of a plot, of all that is written or of all that is answered, handshake included: it
is lost, doubled, has a bit turned over or is any other byte.  Whoever is told of it goes on with ``--resume``.

630 runs (seeds 1000 to 1005): none unnoticed, none endless, no ink missing; wrong ink besides, noticed, in 51 (EBB 17,
GRBL 12, HP-GL 22).
"""

from __future__ import annotations

import itertools
import os
import tempfile
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from multiprocessing.pool import Pool
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks import faults
from benchmarks.faults import MACHINES, Desk, Endless, Extent, Machine, Run, profile_of
from handout.errors import HandoutError, InputError, PrinterError
from handout.journal_lines import seal
from handout.plotting.driver import connect
from handout.plotting.jobs.journal import PlotJournal as PlotJournal
from handout.plotting.jobs.journal import read_progress
from handout.plotting.jobs.places import START, DrawnPlace
from handout.printing import journal
from handout.printing.batch import BatchOptions, PrinterWay, PrintSpool, make_rows
from handout.printing.journal import ENVELOPE, Piece
from handout.printing.prepared import PreparedPage, PreparedRow
from handout.printing.queue import Outcome, OutcomeUnknown, Queue, Ticket
from handout.printing.rows import TableRow
from handout.printing.sending import PrintingStopped, Report
from handout.printing.several import Several
from handout.profiles import Printer
from handout.simulated.plotter.options import SimulatorOptions as Simulated
from handout.values import Drawing, Page
from handout_lab.ink_comparison import SLACK

KINDS = (
    "lost-byte", "flipped-byte", "doubled-byte", "changed-byte", "lost-answer", "flipped-answer", "changed-answer",
)  # fmt: skip
SEEDS = range(1000, 1006)  # none of them was looked at while the program was made
JOURNALS = range(60_000, 64_000)
HELD = 300.0  # s that a handshake may take
LOST = (("lost-answer", 0), ("changed-answer", ord("?")))
OUTCOMES = ("right", "noticed, right", "noticed, wrong ink", "noticed, ink missing", "not noticed, wrong ink",
            "not noticed, ink missing", "not finished", "endless")  # fmt: skip

ON_DISK = ("flipped", "changed", "lost", "doubled", "zeroed", "torn")
_SECTOR = 512
_NAMES = ("one", "two")  # of printers


def on_disk(data: bytes, rng: np.random.Generator) -> tuple[str, bytes]:
    """What becomes of a journal: how it is damaged, and its bytes then."""
    kind, at = ON_DISK[rng.integers(len(ON_DISK))], int(rng.integers(len(data)))
    if rng.random() < 0.4:  # the end is where damage tells most
        at = len(data) - 1 - int(rng.integers(min(len(data), 200)))
    if kind == "zeroed":
        start = at // _SECTOR * _SECTOR
        stop = min(start + _SECTOR, len(data))
        return kind, data[:start] + bytes(stop - start) + data[stop:]
    if kind == "torn":  # of a line that nobody relies on yet
        return kind, data + seal('{"row": 3, "copy": 1, "state": "sending"}')[: int(rng.integers(1, 50))]
    value = data[at] ^ (1 << int(rng.integers(8))) if kind == "flipped" else int(rng.integers(256))
    new = {"lost": b"", "doubled": data[at : at + 1] * 2}.get(kind, bytes([value]))
    return kind, data[:at] + new + data[at + 1 :]


def plot_journal(seed: int) -> str:
    """What becomes of the damaged journal of a plot: "right", "right, told", or what is wrong."""
    rng = np.random.default_rng([seed, 21])
    with tempfile.TemporaryDirectory() as name, patch.object(os, "fsync", lambda handle: None):
        path = Path(name) / "journal"
        part, right = _plotted(path, rng)
        whole = read_progress(path)
        kind, data = on_disk(path.read_bytes(), rng)
        path.write_bytes(data)
        standing = read_progress(path)
        with PlotJournal(path) as kept:
            taken_up = kept.standing
    if (standing.part, standing.place) != (taken_up.part, taken_up.place):
        return f"{kind}: read and taken up differ"
    if standing.finished > whole.finished or standing.part > part or (standing.part == part and standing.place > right):
        return f"{kind}: more is said to be drawn than is"
    known = standing.part == whole.part and standing.begun == whole.begun and standing.finished == whole.finished
    if not known and not standing.uncertain and not standing.finished and standing.part < part:
        return f"{kind}: another sheet, and nobody is asked"
    return "right, told" if standing.damaged else "right" if standing == whole else f"{kind}: less, and nobody is told"


def _plotted(path: Path, rng: np.random.Generator) -> tuple[int, DrawnPlace]:
    """A journal of a plot with breaks and doubts; the part that it ends in, and up to where that is drawn right."""
    part, right = 0, START
    for _ in range(int(rng.integers(1, 5))):
        with PlotJournal(path) as kept:
            right = kept.standing.place if kept.standing.begun else START
            for _ in range(int(rng.integers(1, 30))):
                chance = rng.random()
                if not kept.standing.begun:
                    kept.begin(part)
                    right = START
                elif chance < 0.7:
                    before, right = (
                        right,
                        DrawnPlace(right.stroke + int(rng.integers(0, 3)), float(right.stroke + rng.random())),
                    )
                    right = max(before, right)
                    kept.note_drawn(right, proven=bool(rng.random() < 0.6))
                elif chance < 0.78:
                    kept.note_opened()
                elif chance < 0.86:
                    kept.complete()
                    part, right = part + 1, START
                elif chance < 0.9:  # what is behind the last proven place is wrong, and the job ends
                    kept.doubt()
                    right = kept.standing.place
                    break
                kept.sync()
            if rng.random() < 0.2:
                raise_ = Interrupt()
                kept.__exit__(Interrupt, raise_, None)
    return part, right


class Interrupt(Exception):
    """Why a plot ended."""


class _Printer(Queue):
    """A printer that remembers what came out, by title; at one page it fails in a way of its own.

    refuses : it takes nothing; dies : the program is killed before it has the page, or after.
    """

    def __init__(self, name: str, rng: np.random.Generator, knows: bool) -> None:
        self.name, self.knows, self.made = name, knows, list[str]()
        self.fails, self.how = int(rng.integers(1, 16)), ("refuses", "lost", "dies", "dead")[rng.integers(4)]

    def send(self, page: Path, ticket: Ticket) -> str:
        self.fails -= 1
        if self.fails == 0 and self.how == "refuses":
            raise PrinterError("out of paper.")
        if self.fails == 0 and self.how == "dies":
            raise faults.Crash
        self.made.append(ticket.title)
        if self.fails == 0:
            raise faults.Crash if self.how == "dead" else OutcomeUnknown("the cable was pulled.")
        return f"{len(self.made)}@9"

    def outcome(self, job: str, title: str, earlier: Collection[str] = ()) -> Outcome:
        if not self.knows:
            return Outcome("unknown", "the printer does not know the job (any longer)")
        return Outcome("completed" if title in self.made else "failed")


def batch_journal(seed: int) -> str:
    """What becomes of the damaged journal of a batch: "right", "named", "refused", or what is wrong."""
    rng = np.random.default_rng([seed, 22])
    printers = [_Printer(name, rng, rng.random() < 0.7) for name in _NAMES[: 1 + (rng.random() < 0.2)]]
    parts = (ENVELOPE,) if rng.random() < 0.5 else ("letter 1", ENVELOPE)
    bad = set(rng.integers(2, 12, 2).tolist()) if rng.random() < 0.3 else set()
    table = [
        TableRow(number, ("A",), copies=1 + int(rng.random() < 0.1)) for number in range(2, 2 + int(rng.integers(3, 9)))
    ]
    what = journal.Batch(Path("table.csv"), {"a": 1})

    def made(rows: Iterable[TableRow]) -> Iterator[PreparedRow]:
        for row in rows:
            pages = tuple(PreparedPage(part, Page(9, 9), b"") for part in parts)
            yield PreparedRow(row.number, problem="no") if row.number in bad else PreparedRow(row.number, pages)

    def run(begin: Callable[..., journal.Journal], *more: int, again: str = "") -> Report | None:
        profile = Printer(kind="printer", title="Any", dpi=36)
        spools = [PrintSpool(each, PrinterWay(profile, lambda page: profile, {}, each)) for each in printers]
        place = Several(spools) if len(spools) > 1 else spools[0]
        kept = begin(what, *more, folder)
        try:
            with place:
                report = make_rows(table, made, place, BatchOptions(again=again), kept)
        except faults.Crash:
            assert kept._file is not None
            kept._file.close()
            return None
        except PrintingStopped as stopped:
            kept.__exit__(PrintingStopped, stopped, None)
            return stopped.report
        kept.__exit__(None, None, None)
        return report

    with tempfile.TemporaryDirectory() as name, patch.object(os, "fsync", lambda handle: None):
        folder = Path(name)
        for turn in range(1 + int(rng.random() < 0.5)):
            there = next(folder.iterdir(), None)
            run(
                journal.resume if turn and there and there.stat().st_size else journal.begin,
                *([] if turn and there and there.stat().st_size else [7]),
            )
            for printer in printers:
                printer.fails = int(rng.integers(1, 16))
        path = next(folder.iterdir())
        if not path.stat().st_size:
            return "right"
        kind, data = on_disk(path.read_bytes(), rng)
        path.write_bytes(data)
        wanted = {Piece(row.number, copy, part) for row in table for copy in range(1, row.copies + 1) for part in parts}
        wanted = {piece for piece in wanted if piece.row not in bad}
        asked = set[int]()
        for turn in range(8):
            before = _made(printers)
            for printer in printers:
                printer.fails = int(rng.integers(1, 16)) if turn < 3 else 0
            missing = {piece.row for piece in wanted - before.keys()}
            try:
                again = sorted(asked & missing) if turn else []
                report = run(journal.resume, again=",".join(map(str, again)))
            except InputError as error:
                return "refused" if str(error).endswith(".") and _made(printers) == before else f"{kind}: {error}"
            except Exception as error:
                return f"{kind}: {type(error).__name__}: {error}"
            after = _made(printers)
            if twice := [piece for piece, count in after.items() if count > 1 and piece.row not in asked]:
                return f"{kind}: {twice[0]} twice"
            asked |= {failed.row for failed in report.unknown} if report else set()
            if (
                report is not None
                and not report.failed
                and (silent := {piece.row for piece in wanted - after.keys()} - asked)
            ):
                return f"{kind}: rows {silent} silently lost"
            if not wanted - after.keys():
                return "named" if asked else "right"
    return f"{kind}: never done, {sorted(wanted - after.keys())}"


def _made(printers: Sequence[_Printer]) -> Counter[Piece]:
    """How often each piece came out."""
    found = Counter[Piece]()
    for title in itertools.chain.from_iterable(printer.made for printer in printers):
        words = title.split()
        copied = words[4:5] == ["copy"]
        found[Piece(int(words[3]), int(words[5]) if copied else 1, " ".join(words[6 if copied else 4 :]))] += 1
    return found


def damaged(machine: Machine, kind: str, seed: int, whole: Drawing, extent: Extent) -> Run:
    """Plot with one byte damaged."""
    rng = np.random.default_rng([seed, 11, MACHINES.index(machine), KINDS.index(kind)])
    at = int(rng.integers(0, extent.said if kind.endswith("answer") else extent.bytes))
    bit, value = int(rng.integers(0, 8)), int(rng.integers(0, 256))
    run = Run(machine, kind, seed, where=f"byte {at}, bit {bit}, value {value}")
    options = Simulated(**dict(machine.options), fault=kind, at=at, bit=bit, value=value)
    faults.perform(run, Desk(profile_of(machine), options), whole)
    return run


def outcome(run: Run) -> str:
    """What became of a plot, one of `OUTCOMES`."""
    ink = run.inked
    if run.endless:
        return "endless"
    if not run.finished or ink is None:
        return "not finished"
    noticed = bool(run.stops) or any("counted other steps" in said for said in run.said)
    told = "noticed, " if noticed else "not noticed, "
    if ink.missing or ink.gap > SLACK or ink.dots:
        return told + "ink missing"
    if ink.deviation > SLACK or ink.stray:
        return told + "wrong ink"
    return "noticed, right" if noticed else "right"


def cases(seeds: Iterable[int]) -> list[tuple[Machine, str, int]]:
    """Every kind of damage with every machine, for every seed."""
    return [(machine, kind, seed) for seed in seeds for machine in MACHINES for kind in KINDS]


def one(machine: Machine, kind: str, seed: int) -> Run:
    """One run of the campaign."""
    whole = faults.drawing()
    return damaged(machine, kind, seed, whole, faults.extent_of(machine, whole))


def answers(machine: Machine) -> int:
    """Bytes that a machine says while it is met."""
    desk = Desk(profile_of(machine), Simulated(**dict(machine.options)))
    connect(desk, desk.profile, lambda _: None)
    return desk.faults.said


def met(machine: Machine, kind: str, at: int, value: int) -> str:
    """Meet a machine of whose answers one byte is damaged: "connected", what was said, or "endless"."""
    options = Simulated(**dict(machine.options), fault=kind, at=at, value=value)
    desk = Desk(profile_of(machine), options)
    desk.until = HELD
    try:
        connect(desk, desk.profile, lambda _: None)
    except HandoutError as error:  # settings that came over wrong can be such that no page fits
        return str(error)
    except Endless:
        return "endless"
    return "connected"


def tell(pool: Pool) -> None:
    """Print the tables of damage, and of handshakes in which one byte of the answers is lost or another."""
    told(pool.starmap(one, cases(SEEDS), chunksize=4))
    for machine in MACHINES:
        ways = [(machine, kind, at, value) for at in range(answers(machine)) for kind, value in LOST]
        found = Counter(
            said if said in ("connected", "endless") else "one sentence" for said in pool.starmap(met, ways)
        )
        print(f"answers of the handshake: {machine.title:<38} " + _counted(found))


def tell_journals(pool: Pool, seeds: Iterable[int] = JOURNALS) -> None:
    """Print what became of damaged journals."""
    for title, of in (("plots", plot_journal), ("batches", batch_journal)):
        found = Counter(pool.map(of, seeds, chunksize=50))
        print(f"damaged journals of {title}: {found.total()}: {_counted(found)}", flush=True)


def told(runs: Sequence[Run]) -> None:
    """A line for every dialect and way; the worst ink of those that were noticed, and of the others."""

    def group(run: Run) -> tuple[str, bool]:
        return profile_of(run.machine).dialect, run.fault.endswith("answer")

    for (dialect, answered), some in itertools.groupby(sorted(runs, key=group), group):
        of = list(some)
        worst = [run.inked for run in of if run.inked is not None]
        missing, doubled, stray = (max(getattr(ink, name) for ink in worst) for name in ("missing", "doubled", "stray"))
        print(
            f"{dialect:<6} {'answers' if answered else 'commands':<8} {len(of):>4} runs: "
            + _counted(Counter(map(outcome, of)))
            + f"; missing at most {missing:.1f} mm, twice {doubled:.1f} mm, astray {stray:.1f} mm"
        )


def _counted(found: Counter[str]) -> str:
    return ", ".join(f"{count} {what}" for what, count in found.most_common())
