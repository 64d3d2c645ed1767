"""Plots on the real clock: does the pen rest on the paper while the disk is slow or the processor busy?

The first sentence of `plot`'s text, at the pace of the hand, as a job that is kept; the simulated machine goes on by
the computer's clock.  Told of each run: rests of more than 20 ms within strokes, as they were executed; the greatest;
correlation of the speeds with the hand's, at the same times and at the same places; ink that was not safe on the disk,
at most; and how many rests the program itself has noticed.  The first row of a machine, on the virtual clock, is what
can be had at best.

Thirty runs with raised priority (GRBL, EBB 2.8.1 and 3.0.2; disk slower by 0, 0.3 and 1 s, with and without a program
that spins): no rest in any; r .9984 to .9992, as on the virtual clock (.9988, .9992); up to 68 mm not secured with a
disk that takes 1 s.  Where the disk is waited for within strokes, as with `OverlapGuard` without a clock: 69 rests,
7.5 s, r .36 (GRBL, 0.3 s), 50 rests, 10.7 s, r .29 (EBB 2.8.1, 0.3 s) and 50, 45.9 s, r .29 (1 s).
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from benchmarks import ebb, plot
from handout.errors import DeviceError
from handout.motion import timing
from handout.plotting import observation
from handout.plotting.driver import PlotReport
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.store import JobOptions as JobOptions
from handout.plotting.ports import Port
from handout.profiles import Plotter
from handout.simulated.plotter.options import SimulatorOptions
from handout.values import Drawing
from handout_lab.simulated import FaultyPlotter
from handout_lab.simulated.faults import busy_processor, slow_disk

REST = 0.02  # s
SENTENCE = plot.TEXT.partition(". ")[0] + "."
CASES = ((0.0, 0), (0.3, 0), (1.0, 0), (0.0, 1), (1.0, 1))  # s by which the disk is slow, programs beside
MACHINES: tuple[tuple[str, Plotter, str], ...] = (
    ("GRBL", plot.plotter(2000), ""),
    ("EBB 2.8.1", ebb.machine(2000, 100.0), "2.8.1"),
    ("EBB 3.0.2", ebb.machine(2000, 100.0), "3.0.2"),
)
_STEP = 0.0125  # mm
_TIMES = 2
_PRIORITY = 10  # of real-time programs: what others do on a shared machine is not to be measured


@dataclass(frozen=True)
class Live:
    """One run: what was executed, and what the program says of it."""

    executed: Drawing
    report: PlotReport
    said: tuple[str, ...]


class _Nobody:
    """Puts in the sheet, and does not try again."""

    def do(self, request: str) -> None:
        return

    def try_again(self, error: DeviceError) -> bool:
        return False

    def paused(self, pressed: Callable[[], bool]) -> None:
        return


def main() -> None:
    """Print a table for every machine."""
    print(f"priority: {'raised' if raise_priority() else 'usual'}")
    print("rests > 20 ms, in all, longest | as the program told them | r, rms of peak | mm not secured | moves in hand")
    for machine in MACHINES:
        table(*machine)


def table(title: str, profile: Plotter, firmware: str) -> None:
    """Print all cases of a machine."""
    drawing, options = plot.written("house-joined", SENTENCE), SimulatorOptions(firmware=firmware)
    print(f"{title:<9} virtual clock          {told(live(drawing, profile, options))}")
    for disk, busy in CASES:
        for _ in range(_TIMES):
            with slow_disk(disk), busy_processor(busy):
                run = live(drawing, profile, msgspec.structs.replace(options, realtime=True))
            print(f"{title:<9} disk +{disk:3.1f} s, {busy} beside  {told(run)}", flush=True)


def raise_priority() -> bool:
    """Go before all other programs, those excepted that are started from here; whether that is allowed."""
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
    except (AttributeError, OSError):
        return False
    return True


def live(drawing: Drawing, profile: Plotter, options: SimulatorOptions) -> Live:
    """Plot a drawing as a job."""
    port, said, reports = FaultyPlotter(profile, options), list[str](), list[PlotReport]()

    def plotted(report: PlotReport, port: Port) -> None:
        reports.append(report)

    with tempfile.TemporaryDirectory() as folder:
        job = store.create([drawing], profile, JobOptions(), place=Path(folder))
        runner.run_job(job, lambda: port, _Nobody(), plotted=plotted, log=said.append)
    return Live(port.executed_drawing(), reports[0], tuple(said))


def told(run: Live) -> str:
    """One line of the table."""
    assert run.report.plan is not None
    meant, report = run.report.plan.intended_drawing(), run.report
    rms, correlation = ebb.in_time(meant, run.executed)
    paused = [rest for _, _, rest in rests(meant, run.executed)]
    true = f"{len(paused):>3} {sum(paused):6.2f} s {max(paused, default=0.0):.3f} s"
    noticed = f"{len(report.observation.rests):>3} {report.observation.rested_s:6.2f} s"
    return f"{true} | {noticed} | {correlation:.4f} {rms:6.2%} | {report.unsecured:5.1f} | {report.min_queue}"


def rests(meant: Drawing, executed: Drawing) -> list[tuple[int, float, float]]:
    """Where the pen stood still within strokes: the stroke, s since its beginning, and for how many s.

    A rest is time in which no step was made, less what the hand takes for the same two steps.
    """
    found = []
    for number, (a, b) in enumerate(zip(meant.strokes, executed.strokes, strict=True)):
        if not observation.goes_somewhere(a, b):
            continue
        moved = np.append(True, np.any(np.diff(b.xy, axis=0) != 0.0, axis=1))
        clock, way = b.t[moved], timing.arc_length(b.xy[moved])
        whole = timing.arc_length(a.xy)
        there = np.interp(np.stack([way[:-1] - _STEP, way[1:] + _STEP]) * whole[-1] / way[-1], whole, a.t)
        still = np.diff(clock) - (there[1] - there[0])
        found += [(number, float(clock[at] - clock[0]), float(still[at])) for at in np.flatnonzero(still > REST)]
    return found
