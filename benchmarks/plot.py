"""Plotting: how much of the hand's motion a machine keeps, what was announced against executed, cost of planning."""

from __future__ import annotations

import dataclasses
import itertools
import math
import resource
import subprocess
import sys
import time

import msgspec
import numpy as np

import handout
from handout import profiles
from handout.plotting import Plan, observation, plan, run
from handout.plotting.dialects import MoveBlock, dialect
from handout.plotting.driver import PlotReport
from handout.plotting.overlap import OVERLAP
from handout.plotting.planning import lookahead
from handout.plotting.planning.plan import Order
from handout.plotting.planning.toolpath import DRAW, machine_of, start_times
from handout.profiles import Acceleration, Length, Plotter, Speed
from handout.simulated.plotter.options import SimulatorOptions
from handout.values import Drawing, Page, Stroke
from handout_lab.simulated import FaultyPlotter

TEXT = (
    "The handwriting on the wall may be a forgery, and nobody reads it twice. Every morning she wrote a page before "
    "breakfast, quickly and without lifting her eyes, and every evening she burned it."
)
HANDS = ("house-joined", "house-print", "house-quick")
MACHINES = ((1.0, 1000, 0.01), (1.0, 2000, 0.01), (1.0, 2000, 0.05), (1.0, 5000, 0.01), (1.5, 2000, 0.01))
LATENCIES = (0.001, 0.004, 0.008, 0.016)
MANY = 100


def main() -> None:
    """Print all comparisons."""
    fidelity_of_hands()
    straight_line()
    latencies()
    long_page()
    many_pages()


def plotter(acceleration: float, deviation: float = 0.01) -> Plotter:
    """The simulated plotter with another acceleration, mm/s², and junction deviation, mm."""
    profile = profiles.find("simulated", "plotter")
    assert isinstance(profile, Plotter)
    limits = msgspec.structs.replace(
        profile.limits, acceleration=Acceleration(acceleration), junction_deviation=Length(deviation)
    )
    return msgspec.structs.replace(profile, limits=limits)


def written(hand: str, text: str, x_height: float = 3.0, pace: float = 1.0, seed: int = 1) -> Drawing:
    """A page in a built-in hand, `pace` times as fast as it writes by itself."""
    rng = np.random.default_rng(seed)
    loaded = handout.load(hand)
    layout = handout.Layout(handout.page("A5"), margin=(15, 12, 15, 12), x_height=x_height)
    drawing: Drawing = handout.trace(handout.compose(text, loaded, layout, rng)[0], loaded, rng)
    strokes = tuple(Stroke(s.t / pace, s.xy, word=s.word) for s in drawing.strokes)
    return dataclasses.replace(drawing, strokes=strokes)


def with_mean_feeds(made: Plan) -> Plan:
    """The same plan with the obvious feeds: of every segment, its mean speed."""
    way = made.toolpath
    length = np.linalg.norm(np.diff(way.points, axis=0), axis=1)
    rows = np.flatnonzero((way.kind == DRAW) & (way.requested_time > 0))
    mean = dict(zip(rows.tolist(), (60 * length[rows] / way.requested_time[rows]).tolist(), strict=True))
    blocks = tuple(
        MoveBlock(block.x, block.y, max(round(mean.get(row, block.feed)), 1)) if isinstance(block, MoveBlock) else block
        for block, (_, row) in zip(made.blocks, way.instructions, strict=True)
    )
    feed = np.zeros(len(way.kind))
    for block, (_, row) in zip(blocks, way.instructions, strict=True):
        if isinstance(block, MoveBlock):
            feed[row] = block.feed / 60
    lines = lookahead.blocks(way.points, way.stands, machine_of(made.profile))
    motion = lookahead.run_planner(lines, feed, made.profile.port.queue)
    return dataclasses.replace(made, blocks=blocks, motion=motion, starts=start_times(way, motion, made.profile))


def execute(made: Plan, latency: float = 0.001, overlap: float = OVERLAP) -> tuple[observation.Fidelity, PlotReport]:
    """What the simulated plotter makes of a plan."""
    port = FaultyPlotter(made.profile, SimulatorOptions(latency=latency))
    report = run(made, port, made.profile, overlap=overlap)
    return observation.compare_strokes(made.intended_drawing(), port.executed_drawing()), report


def fidelity_of_hands() -> None:
    """Speeds kept by fitted feeds, and by mean speeds, at the hand's pace on several machines, and faster on one."""
    print("speeds against the hand's: correlation and rms of the peak, at the same times / at the same places;")
    print("strokes' time over the hand's; greatest deviation of the path, mm; executed over announced duration")
    for pace, acceleration, deviation in MACHINES:
        print(f"pace {pace:g}, {acceleration} mm/s², junction deviation {deviation:g} mm")
        for hand in HANDS:
            made = plan(written(hand, TEXT, pace=pace), plotter(acceleration, deviation))
            mean = with_mean_feeds(made)
            ours, report = execute(made)
            naive, _ = execute(mean)
            predicted = [
                observation.compare_strokes(made.intended_drawing(), one.predicted_drawing()) for one in (made, mean)
            ]
            print(f"  {hand:<13} fitted, predicted   {_figures(predicted[0])}")
            print(f"  {'':<13} fitted, simulated   {_figures(ours)}  {report.executed_s / made.duration:.4f}")
            print(f"  {'':<13} mean F, predicted   {_figures(predicted[1])}")
            print(
                f"  {'':<13} mean F, simulated   {_figures(naive)}  rms in time {naive.timed_rms / ours.timed_rms:.1f} "
                f"times ours, 1 − r {(1 - naive.timed) / (1 - ours.timed):.1f} times"
            )


def _figures(found: observation.Fidelity) -> str:
    return (
        f"{found.timed:.4f} {found.timed_rms:6.2%} / {found.correlation:.4f} {found.rms:6.2%}  "
        f"{found.stretched:.4f}  {found.deviation:.3f}"
    )


def straight_line() -> None:
    """A single fast stroke: 40 mm in half a second, with a lognormal speed."""
    t = np.linspace(0.0, 0.5, 101)
    share = np.array([0.5 + 0.5 * math.erf(math.log(max(time, 1e-6) / 0.21) / (0.35 * 2**0.5)) for time in t.tolist()])
    x = 40 * (share - share[0]) / (share[-1] - share[0])
    stroke = Stroke(t, np.column_stack([20 + x, np.full_like(t, 30.0)]))
    profile = plotter(2000)
    limits = msgspec.structs.replace(profile.limits, draw_speed=Speed(300.0), travel_speed=Speed(300.0))
    profile = msgspec.structs.replace(profile, limits=limits)
    made = plan(Drawing((stroke,), Page(148, 210)), profile)
    print(f"straight 40 mm in 0.5 s, peak {stroke.speed.max():.0f} mm/s, 2000 mm/s², by the ink that may be under way")
    for overlap in (OVERLAP, 30.0):
        fitted, mean = (execute(one, overlap=overlap)[0] for one in (made, with_mean_feeds(made)))
        print(f"  {overlap:.0f} mm: fitted {_figures(fitted)}")
        print(f"         mean F {_figures(mean)}")


def latencies() -> None:
    """The stream over slow connections: announced against executed, how far the queue empties."""
    print(
        "latency, each way: executed/announced; segments a second of pen time; fewest moves in hand; 1 − r, rms in time"
    )
    made = plan(written("house-joined", TEXT), plotter(2000))
    for latency in LATENCIES:
        found, report = execute(made, latency)
        rate = report.segments / float(made.motion.duration[made.toolpath.draws].sum())
        print(
            f"  {1000 * latency:3.0f} ms: {report.executed_s / report.announced_s:.4f}  {rate:.0f}/s  "
            f"{report.min_queue}  {1 - found.timed:.4f}  {found.timed_rms:.2%}"
        )


def long_page() -> None:
    """Planning a page of a thousand characters, against plotting it; when its first byte could leave."""
    drawing = written("house-joined", (TEXT + " ") * 5, x_height=2.0)
    characters = len(TEXT) * 5
    profile = plotter(2000)
    orders: tuple[Order, ...] = ("writing", "travel")
    for order in orders:
        begin = time.process_time()
        made = plan(drawing, profile, order=order)
        took = time.process_time() - begin
        next(iter(dialect(profile.dialect).program(made.blocks, profile)))
        first = time.process_time() - begin
        print(
            f"{characters} characters, order {order}: {len(made.blocks)} blocks planned in {took:.2f} s of CPU, "
            f"first command after {first:.2f} s, {made.duration / took:.0f} times as fast as plotted; "
            f"pen up {made.pen_up:.0f} mm"
        )
    begin = time.process_time()
    _, report = execute(made)
    print(f"simulated: {report.executed_s / (time.process_time() - begin):.0f} times as fast as the real thing")


def many_pages() -> None:
    """Peak memory of planning one page, and of planning many one after the other, each in a process of its own."""
    code = "from benchmarks import plot; plot.pages({})"
    peaks = [
        int(subprocess.run([sys.executable, "-c", code.format(n)], capture_output=True, check=True, text=True).stdout)
        for n in (1, MANY)
    ]
    print(f"peak memory: {peaks[0] / 1024:.0f} MB for one page, {peaks[1] / 1024:.0f} MB for {MANY}")


def pages(number: int) -> None:
    """Plan and encode pages one after the other; prints the greatest memory ever held, KB."""
    profile = plotter(2000)
    drawing = written("house-joined", (TEXT + " ") * 5, x_height=2.0)
    sent = 0
    for _ in itertools.repeat(None, number):
        made = plan(drawing, profile)
        sent += sum(len(command.data) for command in dialect(profile.dialect).program(made.blocks, profile))
    assert sent > 0
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
