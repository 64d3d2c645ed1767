"""A simulated controller's step generator: moves in slices of ten milliseconds, some of them prepared ahead."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from handout.simulated.plotter.queue import StepLine, Steps

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
