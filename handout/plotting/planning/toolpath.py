"""The whole way of the pen over a page, as rows of arrays: travels, liftings, drawn segments, and pauses in between."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handout.hooks import Go, Lower, Send, Steps, Wait, goes
from handout.plotting import pen_lift
from handout.plotting.dialects import Block, Pause, PenBlock, UserLines, dialect
from handout.plotting.planning.hooking import NONE, Hooking
from handout.plotting.planning.lookahead import Flags, Machine, Motion, to_steps
from handout.plotting.planning.segments import Trajectory
from handout.profiles import Plotter
from handout.summary import one_line
from handout.values import Array, readonly

TRAVEL, LIFT, LOWER, DRAW, WIPE = range(5)
FREE = (TRAVEL, WIPE)  # moves over the bed that no time is asked for
Instruction = tuple[PenBlock | Pause | UserLines | None, int]


class HookSpan(NamedTuple):
    """Instructions with a hook among them, and the ways to and from it: from `first` to before `stop`.

    name : "before_page", "after_page", "dip", or "stroke": between two strokes without a dip.
    """

    name: str
    first: int
    stop: int


@dataclass(frozen=True, eq=False)
class Toolpath:
    """Moves in order; the pen starts and ends at the machine's zero, lifted.

    points : (n + 1, 3) float, mm, machine coordinates; move i leads from point i to point i + 1.
    kind : (n,) TRAVEL, LIFT, LOWER (of a pen on the Z axis), DRAW or WIPE (of a hook, with the pen down); stroke : (n,)
        index of the stroke, −1 for none.
    requested_time : (n,) float, s, what a drawn segment is to take; 0 for all else.
    stands : (n,) bool: the machine comes to rest before the move and the controller's queue runs empty.
    pause : (n + 1,) float, s, rest before each move, and after the last.
    first : (strokes,) the move before which the pen is down.
    instructions : what the machine is told, in order: a pen command, a pause or lines and the row of the move they come
        before, or None and the row of a move.
    hooks : where hooks are among them, in order.
    """

    points: Array
    kind: NDArray[np.int8]
    stroke: NDArray[np.intp]
    requested_time: Array
    stands: Flags
    pause: Array
    first: NDArray[np.intp]
    instructions: tuple[Instruction, ...]
    hooks: tuple[HookSpan, ...] = ()

    __repr__ = one_line

    @property
    def follows_pressure(self) -> bool:
        """Whether the pen changes its height while it draws."""
        heights = self.points[1:, 2][self.draws]
        return bool(heights.size) and bool((heights != heights[0]).any())

    @property
    def draws(self) -> Flags:
        """(n,) bool: moves with the pen on the paper."""
        return np.asarray(self.kind == DRAW)

    def drawn_times(self, cuts: Trajectory, clock: Array) -> Array:
        """(n,) s that drawn moves take by a clock, (cuts,) s; 0 for all else."""
        times = np.zeros(len(self.kind))
        times[self.draws] = np.diff(clock)[cuts.stroke[1:] == cuts.stroke[:-1]]
        return times

    def blocks(self, move: Callable[[int], Block]) -> tuple[Block, ...]:
        """What the machine is told; `move` makes the block of a row."""
        return tuple(move(row) if block is None else block for block, row in self.instructions)

    def block_starts(self, starts: Array, motion: Motion) -> Array:
        """(blocks,) s when the machine begins each; pens and pauses begin when the move before them has ended."""
        rests = np.append(0.0, starts[:-1] + motion.duration)
        rows = np.array([row for _, row in self.instructions])
        moves = np.array([block is None for block, _ in self.instructions])
        return np.asarray(np.where(moves, starts[rows], rests[rows]))


def machine_of(profile: Plotter) -> Machine:
    """The limits of the machine, axis by axis."""
    limits, pen = profile.limits, profile.pen
    fastest = max(limits.draw_speed, limits.travel_speed)
    return Machine(
        acceleration=np.array([limits.acceleration, limits.acceleration, pen.z_acceleration], dtype=float),
        rate=np.array([fastest, fastest, pen.z_speed], dtype=float),
        steps=np.array([limits.steps_per_mm, limits.steps_per_mm, Z_STEPS], dtype=float),
        deviation=float(limits.junction_deviation),
        queue=profile.port.queue,
        path=float(limits.acceleration) if dialect(profile.dialect).curves else np.inf,
        curves=dialect(profile.dialect).curves,
        jerk=float(limits.jerk),
    )


Z_STEPS = 1000.0  # heights are not rounded: no profile says how fine the Z axis is, and nothing depends on it


class _Builder:
    """Collects moves; `rest` is the time the machine has to stand before the next one."""

    def __init__(self, profile: Plotter) -> None:
        self.profile, self.pen = profile, profile.pen
        self.on_z = profile.pen.lift == "z"
        self.at = np.array([0.0, 0.0, self.pen.up if self.on_z else 0.0])
        self.points: list[Array] = [self.at[None]]
        self.kinds: list[tuple[int, int, int]] = []  # kind, stroke, how many
        self.requested_time: list[Array] = []
        self.stands: list[int] = [0]
        self.pauses: list[tuple[int, float]] = []
        self.instructions: list[Instruction] = []
        self.hooks: list[HookSpan] = []
        self.count = 0

    def rest(self, seconds: float) -> None:
        """Stand still before the next move."""
        self.stands.append(self.count)
        self.pauses.append((self.count, seconds))

    def go(self, kind: int, points: Array, stroke: int = -1, requested_time: Array | None = None) -> None:
        """Append moves to the points, (m, 3) mm."""
        self.points.append(points)
        self.kinds.append((kind, stroke, len(points)))
        self.requested_time.append(np.zeros(len(points)) if requested_time is None else requested_time)
        self.at = points[-1]
        if kind in (DRAW, *FREE):  # a pen on the Z axis is told to move as any other pen
            self.instructions.extend((None, self.count + i) for i in range(len(points)))
        self.count += len(points)

    def travel(self, x: float, y: float, kind: int = TRAVEL) -> None:
        """Go there, unless the pen already is, to within less than a step."""
        there = np.array([[x, y, self.at[2]]])
        steps = np.array([self.profile.limits.steps_per_mm] * 2 + [Z_STEPS])
        if (to_steps(there[0], steps) != to_steps(self.at, steps)).any():
            self.go(kind, there)

    def move_pen(self, down: bool, value: float | None = None, inks: bool = True) -> None:
        """Lift or lower the pen and wait for it; see `PenBlock`."""
        pen = pen_lift.lower_to(self.pen, value)
        wait = pen_lift.wait(pen, down, float(self.profile.port.line_time))
        if down:
            wait += dialect(self.profile.dialect).lowering_bytes * 10.0 / self.profile.port.baud
        self.instructions.append((PenBlock(down, value, inks), self.count))
        if self.on_z:
            height = pen.down if down else pen.up
            self.go(LOWER if down else LIFT, np.array([[self.at[0], self.at[1], height]]))
        if wait > 0:
            self.rest(wait)

    def hook(self, steps: Steps) -> None:
        """Do the steps of a hook; the pen is lifted when they end."""
        down = False
        for step in steps:
            if isinstance(step, Go):
                self.travel(step.x, step.y, WIPE if down else TRAVEL)
            elif isinstance(step, Wait):
                self.instructions.append((Pause(step.seconds), self.count))
                self.rest(step.seconds)
            elif isinstance(step, Send):
                self.instructions.append((UserLines(step.lines), self.count))
                self.rest(len(step.lines) * float(self.profile.port.line_time))
            elif isinstance(step, Lower) or down:
                down = isinstance(step, Lower)
                self.move_pen(down, step.value if isinstance(step, Lower) else None, inks=False)
        if down:
            self.move_pen(False, inks=False)

    def at_zero(self, name: str, steps: Steps) -> None:
        """A hook of the page: from zero, and back to it."""
        first = len(self.instructions)
        self.hook(steps)
        self.travel(0.0, 0.0)
        self.span(name, first)

    def to_stroke(self, stroke: int, there: Array, hooked: Hooking) -> None:
        """From the end of a stroke to the beginning of the next, (2,) mm, with what is done in between."""
        first = len(self.instructions)
        if stroke > 0:
            self.hook(hooked.after_stroke)
        if stroke in hooked.dips:
            self.hook(hooked.dip)
        if not goes(hooked.before_stroke):
            self.travel(*there)
        self.hook(hooked.before_stroke)
        self.travel(*there)
        dips, idle = stroke in hooked.dips, not (hooked.before_stroke or (hooked.after_stroke and stroke > 0))
        if dips or not idle:
            self.span("dip" if dips else "stroke", first)

    def span(self, name: str, first: int) -> None:
        """Instructions from `first` on are a hook; one without any, such as to go where the pen is, is none."""
        if len(self.instructions) > first:
            self.hooks.append(HookSpan(name, first, len(self.instructions)))


def lay_out(
    cuts: Trajectory, dots: Array, profile: Plotter, hooked: Hooking = NONE, heights: Array | None = None
) -> Toolpath:
    """The toolpath that draws the strokes one after the other.

    cuts : in machine coordinates.
    dots : (strokes,) float, s: how long the pen rests on the paper in a stroke that goes nowhere.
    heights : (n,) float, mm: of the pen at the cuts, where it follows the pressure.
    """
    build = _Builder(profile)
    build.instructions.append((PenBlock(down=False), 0))
    build.rest((0.0 if build.on_z else profile.pen.up_time) + profile.port.line_time)
    starts = np.append(np.flatnonzero(np.diff(cuts.stroke, prepend=-1)), len(cuts.t))
    if hooked.before_page:
        build.at_zero("before_page", hooked.before_page)
    first = []
    for stroke, (a, b) in enumerate(itertools.pairwise(starts)):
        build.to_stroke(stroke, cuts.xy[a], hooked)
        build.move_pen(down=True)
        first.append(build.count)
        if b - a > 1:
            z = np.full(b - a - 1, build.at[2]) if heights is None else heights[a + 1 : b]
            points = np.column_stack([cuts.xy[a + 1 : b], z])
            build.go(DRAW, points, stroke, np.diff(cuts.t[a:b]))
        elif dots[stroke] > 0:
            build.instructions.append((Pause(float(dots[stroke])), build.count))
            build.rest(float(dots[stroke]))
        build.move_pen(down=False)
    build.to_stroke(len(first), np.zeros(2), Hooking(after_stroke=hooked.after_stroke))
    if hooked.after_page:
        build.at_zero("after_page", hooked.after_page)
    pause = np.zeros(build.count + 1)
    for row, seconds in build.pauses:
        pause[row] += seconds
    stands = np.zeros(build.count + 1, dtype=bool)
    stands[build.stands] = True
    kind, strokes, many = np.array(build.kinds, dtype=np.intp).reshape(-1, 3).T
    return Toolpath(
        points=readonly(np.concatenate(build.points), None, 3),
        kind=np.repeat(kind, many).astype(np.int8),
        stroke=np.repeat(strokes, many),
        requested_time=np.concatenate([*build.requested_time, np.zeros(0)]),
        stands=stands[:-1],
        pause=pause,
        first=np.array(first, dtype=np.intp),
        instructions=tuple(build.instructions),
        hooks=tuple(build.hooks),
    )


def pen_up_speeds(toolpath: Toolpath, profile: Plotter) -> Array:
    """(n,) float, mm/s, for the moves that do not draw; without meaning for the others."""
    pen = profile.pen
    speeds = {TRAVEL: float(profile.limits.travel_speed), LIFT: float(pen.z_speed), DRAW: float(pen.z_speed)}
    speeds |= {LOWER: pen_lift.lowering_speed(pen), WIPE: float(profile.limits.draw_speed)}
    return np.array([speeds[kind] for kind in range(5)])[toolpath.kind]


def start_times(toolpath: Toolpath, motion: Motion, profile: Plotter) -> Array:
    """(n + 1,) float, s: when each move begins, and when all is done."""
    wait = toolpath.pause.copy()
    wait[:-1][toolpath.stands] += queue_filling_times(toolpath, profile)
    done = np.concatenate([[0.0], np.cumsum(motion.duration + wait[:-1])])
    return np.append(done[:-1] + wait[:-1], done[-1] + wait[-1])


def queue_filling_times(toolpath: Toolpath, profile: Plotter) -> Array:
    """(rests,) float, s: how long the machine stands after each rest until its queue is full and it begins to move.

    It first reads as many lines as the queue holds, or as come before the next rest.
    """
    stand = np.flatnonzero(toolpath.stands)
    lines = np.minimum(np.diff(np.append(stand, len(toolpath.kind))), profile.port.queue) + 1
    return np.asarray(lines * profile.port.line_time)
