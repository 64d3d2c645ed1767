"""Plotting: how much of the hand's speed a machine keeps, what was announced against executed, time of planning."""

from __future__ import annotations

import dataclasses
import math
import time

import msgspec
import numpy as np

import handout
from handout import profiles
from handout.plotting import Plan, fidelity, open_port, plan, run
from handout.plotting.blocks import Move
from handout.plotting.course import DRAW
from handout.plotting.planned import Order
from handout.plotting.simulated import SimulatedPlotter
from handout.profiles import Acceleration, Plotter, Speed
from handout.values import Drawing, Page, Stroke

TEXT = (
    "The handwriting on the wall may be a forgery, and nobody reads it twice. Every morning she wrote a page before "
    "breakfast, quickly and without lifting her eyes, and every evening she burned it."
)
HANDS = ("house-joined", "house-print", "house-quick")
ACCELERATIONS = (1000, 2000, 5000)


def main() -> None:
    """Print all comparisons."""
    fidelity_of_hands()
    straight_line()
    long_page()


def machine(acceleration: float) -> Plotter:
    """The simulated plotter with another acceleration, mm/s²."""
    profile = profiles.find("simulated", "plotter")
    assert isinstance(profile, Plotter)
    limits = msgspec.structs.replace(profile.limits, acceleration=Acceleration(acceleration))
    return msgspec.structs.replace(profile, limits=limits)


def written(hand: str, text: str, x_height: float = 3.0, pace: float = 1.0) -> Drawing:
    """A page in a built-in hand, `pace` times as fast as it writes by itself."""
    rng = np.random.default_rng(1)
    loaded = handout.load(hand)
    layout = handout.Layout(handout.page("A5"), margin=(15, 12, 15, 12), x_height=x_height)
    drawing: Drawing = handout.trace(handout.compose(text, loaded, layout, rng)[0], loaded, rng)
    strokes = tuple(Stroke(s.t / pace, s.xy, word=s.word) for s in drawing.strokes)
    return dataclasses.replace(drawing, strokes=strokes)


def with_mean_feeds(made: Plan) -> Plan:
    """The same plan with the obvious feeds: of every segment, its mean speed."""
    way = made.course
    length = np.linalg.norm(np.diff(way.points, axis=0), axis=1)
    rows = np.flatnonzero((way.kind == DRAW) & (way.intended > 0))
    feeds = dict(zip(rows.tolist(), (60 * length[rows] / way.intended[rows]).tolist(), strict=True))
    blocks = tuple(
        Move(block.x, block.y, max(round(feeds.get(row, block.feed)), 1)) if isinstance(block, Move) else block
        for block, (_, row) in zip(made.blocks, way.told, strict=True)
    )
    return dataclasses.replace(made, blocks=blocks)


def execute(made: Plan, profile: Plotter) -> tuple[fidelity.Fidelity, float]:
    """What the simulated plotter makes of a plan, and how long it took it, s."""
    port = open_port("sim:", profile)
    assert isinstance(port, SimulatedPlotter)
    report = run(made, port, profile)
    return fidelity.compare(made.drawing, port.executed()), report.executed_s


def fidelity_of_hands() -> None:
    """Speeds kept by fitted feeds, and by mean speeds, at the hand's pace on three machines, and faster on one."""
    print("speeds against the hand's, along the path / at the same time; rms of peak; stretch; deviation, mm")
    for pace, acceleration in (*((1.0, a) for a in ACCELERATIONS), (1.5, 2000)):
        profile = machine(acceleration)
        for hand in HANDS:
            made = plan(written(hand, TEXT, pace=pace), profile)
            ours, took = execute(made, profile)
            mean, _ = execute(with_mean_feeds(made), profile)
            error = (1 - mean.timed) / max(1 - ours.timed, 1e-9)
            print(
                f"  {hand:<13} pace {pace:g}, {acceleration:>4} mm/s²: fitted {_figures(ours)} | mean speeds "
                f"{_figures(mean)} | ratio of 1 − r in time {error:.1f}; executed/announced {took / made.duration:.4f}"
            )


def _figures(found: fidelity.Fidelity) -> str:
    return f"{found.correlation:.4f}/{found.timed:.4f} {found.rms:6.2%} {found.stretched:.3f} {found.deviation:.3f}"


def straight_line() -> None:
    """A single fast stroke: 40 mm in half a second, with a lognormal speed."""
    t = np.linspace(0.0, 0.5, 101)
    share = np.array([0.5 + 0.5 * math.erf(math.log(max(time, 1e-6) / 0.21) / (0.35 * 2**0.5)) for time in t.tolist()])
    x = 40 * (share - share[0]) / (share[-1] - share[0])
    stroke = Stroke(t, np.column_stack([20 + x, np.full_like(t, 30.0)]))
    drawing = Drawing((stroke,), Page(148, 210))
    profile = machine(2000)
    limits = msgspec.structs.replace(profile.limits, draw_speed=Speed(300.0), travel_speed=Speed(300.0))
    profile = msgspec.structs.replace(profile, limits=limits)
    found, _ = execute(plan(drawing, profile), profile)
    print(f"straight 40 mm in 0.5 s, peak {stroke.speed.max():.0f} mm/s: {_figures(found)}")


def long_page() -> None:
    """Planning a page of a thousand characters, against plotting it."""
    drawing = written("house-joined", (TEXT + " ") * 5, x_height=2.0)
    characters = len(TEXT) * 5
    profile = machine(2000)
    orders: tuple[Order, ...] = ("writing", "travel")
    for order in orders:
        begin = time.perf_counter()
        made = plan(drawing, profile, order=order)
        took = time.perf_counter() - begin
        print(
            f"{characters} characters, order {order}: {len(made.blocks)} blocks planned in {took:.2f} s, "
            f"{made.duration / took:.0f} times as fast as plotted; pen up {made.pen_up:.0f} mm"
        )
    begin = time.perf_counter()
    _, executed = execute(made, profile)
    print(f"simulated: {executed / (time.perf_counter() - begin):.0f} times as fast as the real thing")
