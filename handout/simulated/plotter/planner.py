"""A simulated controller's queue of moves, its speeds between them, and its steps; and what Marlin does otherwise.

Entry speeds come from junction deviation, looking back and ahead; moves are made in slices of ten milliseconds, some of
them prepared ahead.

Source: Marlin's planner, read for facts: acceleration of travel moves along the path, junction deviation with a limit
for the curves that short segments make, or classic jerk; a block under way is not planned anew.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

Steps = tuple[int, int, int]
Vector = tuple[float, float, float]

_STRAIGHT = 0.999999  # cosine of a junction that counts as straight, as in GRBL 1.1's planner


@dataclass
class Axes:
    """Settings of the three axes: steps/mm, greatest speed mm/s, acceleration mm/s²; and the junction deviation, mm."""

    steps: list[float]
    speed: list[float]
    acceleration: list[float]
    deviation: float

    def limit_along(self, unit: Vector, limits: list[float]) -> float:
        """The greatest value in a direction that keeps every axis within its limit."""
        return min(limit / abs(part) for limit, part in zip(limits, unit, strict=True) if part != 0.0)


@dataclass(slots=True)
class StepLine:
    """One move: whole steps from `start`, `count` of them on the longest axis, `mm` long (what is left of it)."""

    start: Steps
    delta: Steps
    count: int
    mm: float
    whole: float
    unit: Vector
    acceleration: float
    nominal: float
    most: float  # square of the greatest entry speed
    entry: float = 0.0  # square of the planned entry speed


class MoveQueue:
    """Moves that have been read and not yet handed to the steppers."""

    least = 1  # steps of a move that is queued

    def __init__(self, axes: Axes, size: int) -> None:
        self.axes, self.size = axes, size
        self.lines: deque[StepLine] = deque()
        self.position: Steps = (0, 0, 0)
        self._unit: Vector = (0.0, 0.0, 0.0)
        self._nominal = 0.0

    @property
    def full(self) -> bool:
        """Whether no further move can be taken."""
        return len(self.lines) >= self.size

    def add(self, target: Vector, feed: float) -> bool:
        """Queue a move to the target, mm, at a feed in mm/s (or as fast as the axes can: infinite).

        Returns whether there was anything to move; less than a step is not.
        """
        steps = self.axes.steps
        there = [math.floor(x * s + 0.5) for x, s in zip(target, steps, strict=True)]
        dx, dy, dz = (a - b for a, b in zip(there, self.position, strict=True))
        count = max(abs(dx), abs(dy), abs(dz))
        if count < self.least:
            return False
        way = (dx / steps[0], dy / steps[1], dz / steps[2])
        mm = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
        unit = (way[0] / mm, way[1] / mm, way[2] / mm)
        line = StepLine(self.position, (dx, dy, dz), count, mm, mm, unit, 0.0, 0.0, 0.0)
        self.limit(line, feed)
        self.lines.append(line)
        self._unit, self._nominal = unit, line.nominal
        self.position = (there[0], there[1], there[2])
        self.plan()
        return True

    def limit(self, line: StepLine, feed: float) -> None:
        """Set how fast a new line may be run at a feed, how fast begun, and its acceleration."""
        axes = self.axes
        line.nominal = max(min(feed, axes.limit_along(line.unit, axes.speed)), 1 / 60)
        line.most = min(self._corner(line.unit), line.nominal * line.nominal, self._nominal**2) if self.lines else 0.0
        line.acceleration = axes.limit_along(line.unit, axes.acceleration)

    def _corner(self, unit: Vector) -> float:
        """Square of the speed at which the corner between the last move and a new direction may be taken."""
        last = self._unit
        cosine = -(last[0] * unit[0] + last[1] * unit[1] + last[2] * unit[2])
        if cosine > _STRAIGHT:
            return 0.0
        if cosine < -_STRAIGHT:
            return math.inf
        x, y, z = unit[0] - last[0], unit[1] - last[1], unit[2] - last[2]
        norm = math.sqrt(x * x + y * y + z * z)
        acceleration = self.axes.limit_along((x / norm, y / norm, z / norm), self.axes.acceleration)
        half = math.sqrt(0.5 * (1.0 - cosine))
        return acceleration * self.axes.deviation * half / (1.0 - half)

    def plan(self, settled: int = 1) -> None:
        """Set the entry speeds: back from a stop at the end, then forward from the last line that is settled.

        The first line's own is left alone: what comes before it has been handed over and cannot be changed any more.
        """
        lines = self.lines
        after = 0.0
        for index in range(len(lines) - 1, settled - 1, -1):
            line = lines[index]
            after = min(line.most, after + 2.0 * line.acceleration * line.mm)
            line.entry = after
        for index in range(settled - 1, len(lines) - 1):
            line, following = lines[index], lines[index + 1]
            reached = line.entry + 2.0 * line.acceleration * line.mm
            if reached < following.entry:
                following.entry = reached

    @property
    def leave(self) -> float:
        """Square of the speed at which the first line ends."""
        return self.lines[1].entry if len(self.lines) > 1 else 0.0

    def clear(self, position: Steps) -> None:
        """Forget all moves; the machine stands at `position`."""
        self.lines.clear()
        self.position, self._nominal = position, 0.0


_SLICE = 0.010  # s of a step segment, ACCELERATION_TICKS_PER_SECOND of GRBL 1.1
_AHEAD = 6  # step segments prepared, SEGMENT_BUFFER_SIZE of GRBL 1.1


class Planned(Protocol):
    """Where the stepper takes its lines from; see `queue.Queue`."""

    lines: deque[StepLine]
    position: Steps

    @property
    def leave(self) -> float: ...

    def plan(self) -> None: ...


@dataclass(slots=True)
class _Ramp:
    """Speed over the rest of a line: up with `a` from u to top, level, down to v; all in mm and s."""

    u: float
    top: float
    v: float
    a: float
    up: float
    level: float
    down: float
    mm: float

    @property
    def time(self) -> float:
        return self.up + self.level + self.down

    def state_at(self, t: float) -> tuple[float, float]:
        """Distance covered and speed, t seconds after the beginning."""
        if t <= self.up:
            return self.u * t + 0.5 * self.a * t * t, self.u + self.a * t
        if t <= self.up + self.level:
            return self.up * 0.5 * (self.u + self.top) + self.top * (t - self.up), self.top
        left = max(self.time - t, 0.0)
        return self.mm - self.v * left - 0.5 * self.a * left * left, self.v + self.a * left


def _ramp(mm: float, u: float, v: float, nominal: float, a: float) -> _Ramp:
    if u * u - v * v >= 2.0 * a * mm:  # braking all the way
        v = math.sqrt(max(u * u - 2.0 * a * mm, 0.0))
        return _Ramp(u, u, v, a, 0.0, 0.0, (u - v) / a, mm)
    top = min(math.sqrt(a * mm + 0.5 * (u * u + v * v)), max(nominal, u))
    v = min(v, top)
    up, down = (top - u) / a, (top - v) / a
    level = max(mm - 0.5 * up * (u + top) - 0.5 * down * (v + top), 0.0) / top
    return _Ramp(u, top, v, a, up, level, down, mm)


class Stepper:
    """Takes lines from the queue and turns them into steps; `moved` is told where it is when."""

    def __init__(self, queue: Planned, moved: Callable[[float, Steps], None], ahead: int = _AHEAD) -> None:
        self.queue, self.moved, self.ahead = queue, moved, ahead
        self.position: Steps = queue.position
        self.moving = False
        self.holding = False
        self.next_end = math.inf  # time at which the slice under way ends
        self._slices: deque[tuple[float, Steps]] = deque()
        self._ramp: _Ramp | None = None
        self._speed = 0.0
        self._done = 0.0  # s of the ramp that are prepared
        self._base = 0.0  # mm of the line that were left when the ramp was made
        self._steps_left = 0
        self._spare = 0.0  # time of the part of a step that the last slice did not make

    def start(self, now: float) -> None:
        """Begin to move if there is anything to do."""
        if self.moving or not self.queue.lines:
            return
        self.moving, self._speed = True, 0.0
        self.moved(now, self.position)
        self._next_slice(now)

    @property
    def ending(self) -> bool:
        """Whether the end of a line is under way that the queue has let go."""
        return self.moving and self._ramp is None and bool(self._slices)

    def replan(self) -> None:
        """The queue has changed: plan the rest of the line under way anew."""
        if self._ramp is not None and not self.holding:
            self._make_ramp(self.queue.lines[0])

    def hold(self) -> None:
        """Brake at once."""
        if self.moving and not self.holding:
            self.holding = True
            if self._ramp is not None:
                self._make_ramp(self.queue.lines[0])

    def resume(self, now: float) -> None:
        """Go on after a hold that came to rest."""
        self.holding = False
        if self._ramp is not None:
            self.queue.lines[0].entry = 0.0
            self.queue.plan()
            self._make_ramp(self.queue.lines[0])
        self.start(now)

    def stop(self) -> None:
        """Stop dead, forget what was prepared."""
        self._slices.clear()
        self._ramp, self.moving, self.holding, self.next_end = None, False, False, math.inf
        self._speed = self._spare = 0.0

    def finish_slice(self) -> None:
        """The slice under way ends now."""
        now, (_, self.position) = self.next_end, self._slices.popleft()
        self.moved(now, self.position)
        self._next_slice(now)

    def _next_slice(self, now: float) -> None:
        self.prepare()
        if self._slices:
            self.next_end = now + self._slices[0][0]
        else:
            self.moving, self.next_end, self._speed = False, math.inf, 0.0

    def prepare(self) -> None:
        """Prepare slices as long as there is room and something to do."""
        while self.moving and len(self._slices) < self.ahead:
            if self._ramp is None:
                if not self.queue.lines or (self.holding and self._speed <= 0.0):
                    return
                line = self.queue.lines[0]
                self._steps_left, self._spare = line.count, 0.0
                if not self.holding:
                    self._speed = math.sqrt(line.entry)
                self._make_ramp(line)
            self._slice()
            if self.holding and self._speed <= 0.0:
                return

    def _make_ramp(self, line: StepLine) -> None:
        """From the present speed over what is left of the line; to a stop on the way if the machine is to hold."""
        stop = self._speed**2 / (2.0 * line.acceleration)
        if self.holding:
            self._ramp = _ramp(min(stop, line.mm), self._speed, 0.0, line.nominal, line.acceleration)
        else:
            self._ramp = _ramp(line.mm, self._speed, math.sqrt(self.queue.leave), line.nominal, line.acceleration)
        self._done, self._base = 0.0, line.mm

    def _slice(self) -> None:
        """Prepare one slice: at least one step, at most to the end of the line."""
        ramp, line = self._ramp, self.queue.lines[0]
        assert ramp is not None
        since, end = self._done, self._done
        left, exact = self._steps_left, float(self._steps_left)
        per_mm = line.count / line.whole
        while left == self._steps_left and end < ramp.time:
            end = end + _SLICE if end + _SLICE < ramp.time else ramp.time
            gone, speed = ramp.state_at(end)
            exact = (self._base - gone) * per_mm
            if exact < 1.25 and end < ramp.time and not self.holding:
                end, (gone, speed) = ramp.time, ramp.state_at(ramp.time)
            finished = end >= ramp.time and ramp.mm >= self._base
            exact = 0.0 if finished else (self._base - gone) * per_mm
            left = math.ceil(exact - 1e-9)
            self._speed, line.entry = speed, speed * speed
            line.mm = max(self._base - gone, 0.0)
        time = end - since + self._spare
        self._done = end
        if self._steps_left > exact:
            each = time / (self._steps_left - exact)
            self._spare = (left - exact) * each
            self._emit(line, left, time - self._spare)
        if left == 0:
            if len(self.queue.lines) == 1:
                self._speed = 0.0
            self.queue.lines.popleft()
            self._ramp = None
        elif end >= ramp.time:  # held on the way
            self._speed = 0.0

    def _emit(self, line: StepLine, left: int, time: float) -> None:
        if left < self._steps_left:
            done = line.count - left
            there = tuple(
                start + math.floor(delta * done / line.count + 0.5)
                for start, delta in zip(line.start, line.delta, strict=True)
            )
            self._slices.append((time, (there[0], there[1], there[2])))
        self._steps_left = left


_OCTAGON = -math.sqrt(0.5)  # cosine of the junction from which on short segments are taken for a curve
_SHORT = 1.0  # mm


@dataclass
class MarlinAxes(Axes):
    """Settings besides: acceleration along the path, mm/s²; jerk, mm/s (0: junction deviation); least time, s."""

    travel: float
    jerk: float
    least_time: float = 0.02


class MarlinQueue(MoveQueue):
    """Blocks that have been read and not yet been run; a move of a few steps waits for the next one."""

    least = 6

    def __init__(self, axes: MarlinAxes, size: int) -> None:
        super().__init__(axes, size)
        self.settings = axes
        self._running: StepLine | None = None

    @property
    def waiting(self) -> int:
        """Blocks that are not under way."""
        return len(self.lines) - bool(self.lines and self.lines[0] is self._running)

    def limit(self, line: StepLine, feed: float) -> None:
        """Longer if few blocks are left in the queue; no slower at its beginning than half its first step allows."""
        axes, mm, time = self.settings, line.mm, line.mm / max(feed, 0.01)
        missing = axes.least_time - time
        if missing > 0 and 2 <= self.waiting <= (self.size + 1) // 2 - 1:
            time += 2.0 * missing / self.waiting
        line.nominal = min(mm / time, axes.limit_along(line.unit, axes.speed))
        line.acceleration = min(axes.travel, axes.limit_along(line.unit, axes.acceleration))
        line.entry = min(0.5 * line.acceleration * mm / line.count, line.nominal * line.nominal)
        line.most = max(min(self._begin(line), line.nominal * line.nominal), line.entry)

    def _begin(self, line: StepLine) -> float:
        """Square of the greatest speed at the beginning of a block."""
        alone, unit, nominal = not self.waiting, line.unit, line.nominal
        if self.settings.jerk:
            before = (0.0, 0.0, 0.0) if alone else self._unit
            change = max(abs(a - b) for a, b in zip(unit, before, strict=True))
            slower = nominal if alone else min(nominal, self._nominal)
            return min(slower, self.settings.jerk / change if change else math.inf) ** 2
        if alone:
            return 0.0
        last = self._unit
        cosine = -(last[0] * unit[0] + last[1] * unit[1] + last[2] * unit[2])
        if cosine > _STRAIGHT:
            return 0.0
        return min(self._round(cosine, last, unit, line.mm, line.acceleration), self._nominal**2)

    def _round(self, cosine: float, last: Vector, unit: Vector, mm: float, acceleration: float) -> float:
        """Junction deviation; and for short segments the speed of the curve of which they are chords."""
        x, y, z = unit[0] - last[0], unit[1] - last[1], unit[2] - last[2]
        norm = math.sqrt(x * x + y * y + z * z)
        if norm == 0.0:
            return math.inf
        across = min(acceleration, self.axes.limit_along((x / norm, y / norm, z / norm), self.axes.acceleration))
        half = math.sqrt(0.5 * (1.0 - max(cosine, -_STRAIGHT)))
        speed2 = across * self.axes.deviation * half / (1.0 - half)
        if mm < _SHORT and cosine < _OCTAGON:
            turn = max(math.acos(min(-cosine, 1.0)), 0.033)  # where Marlin's own arc cosine ends
            speed2 = min(speed2, mm * across / turn)
        return speed2

    def plan(self, settled: int = 1) -> None:
        """Set the speeds between blocks that are not settled."""
        super().plan(2 if self.lines and self.lines[0] is self._running else settled)

    @property
    def leave(self) -> float:
        """Square of the speed at which the first block ends; settled once the stepper has asked, as it begins it."""
        self._running = self.lines[0]
        return super().leave

    def clear(self, position: Steps) -> None:
        """Forget all blocks; the machine stands at `position`."""
        super().clear(position)
        self._running = None
