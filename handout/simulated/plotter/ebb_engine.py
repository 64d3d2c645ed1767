"""The simulated EBB below its parser: a command under way, a short queue, the motors' accumulators, the pen's servo.

A command becomes the steps of both motors at each of its ticks (25 000 a second, a step when 2³¹ overflows), worked out
for all ticks at once in whole numbers.

Source: Schmalz, EiBotBoard command set: the accumulator, and its behaviour by version: up to 2.6 LM changes
its rate after adding it and between two commands a tick passes; from 2.7 half the acceleration is taken off first; from
3.0 rates have a sign.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from handout.profiles import Plotter
from handout.simulated.plotter.paper import DrawnPaper

TICK = 4e-5  # s
FULL = 2**31
_CHUNK = 4096  # ticks worked out at once
_LONGEST = 25_000 * 120  # ticks after which a move that never ends is ended, so that a simulation does

Counts = NDArray[np.int64]


@dataclass
class Accumulators:
    """What is left of a step in each motor's accumulator."""

    left: list[int] = field(default_factory=lambda: [0, 0])

    def clear(self, which: int, falling: tuple[bool, bool] = (False, False)) -> None:
        """Clear accumulators (bit 0: motor 1, bit 1: motor 2); fill that of a motor that will count down instead."""
        for motor in (0, 1):
            if which >> motor & 1:
                self.left[motor] = FULL - 1 if falling[motor] else 0


@dataclass(frozen=True, eq=False)
class Move:
    """Steps of both motors since its beginning, at the end of each of its ticks: (ticks, 2); accumulators after it."""

    steps: Counts
    after: tuple[int, int]

    @property
    def ticks(self) -> int:
        return len(self.steps)


def by_time(ticks: int, rates: tuple[int, int], gains: tuple[int, int], left: list[int], signed: bool) -> Move:
    """LT: so many ticks, however many steps that makes."""
    tracks, after = [], []
    for rate, gain, begin in zip(rates, gains, left, strict=True):
        way = 1 if rate >= 0 else -1
        grown = begin + np.cumsum(_rates(rate if signed else abs(rate), gain, 0, ticks, signed))
        tracks.append(grown // FULL * (1 if signed else way))
        after.append(int(grown[-1]) % FULL if ticks else begin)
    return Move(np.stack(tracks, axis=1), (after[0], after[1]))


def by_steps(
    steps: tuple[int, int], rates: tuple[int, int], gains: tuple[int, int], left: list[int], half: bool
) -> Move:
    """SM and LM: each motor goes on until it has made its steps; the move ends with the slower of them.

    half : whether the rate is changed before it is added, beginning half a change lower.
    """
    tracks, after = [], []
    for count, rate, gain, begin in zip(steps, rates, gains, left, strict=True):
        track, end = _step_until(abs(count), rate, gain, begin, half)
        tracks.append(track if count >= 0 else -track)
        after.append(end)
    longest = max(len(track) for track in tracks)
    rests = (np.full(longest - len(track), track[-1] if len(track) else 0, dtype=np.int64) for track in tracks)
    held = [np.concatenate([track, rest]) for track, rest in zip(tracks, rests, strict=True)]
    return Move(np.stack(held, axis=1), (after[0], after[1]))


def constant_rate(steps: int, ms: int, exact: bool) -> int:
    """The rate of SM; short moves of boards before 3.0 are worked out to 16 bits only."""
    ticks = 25 * ms
    if exact:
        return min(steps * FULL // ticks, FULL - 1)
    coarse, rest = divmod(steps << 15, ticks)
    return min((coarse << 16) + ((rest << 16) // ticks if ms > 30 else 0), FULL - 1)


def _rates(rate: int, gain: int, first: int, ticks: int, signed: bool, half: bool = True) -> Counts:
    """What is added at each of the ticks from number `first`."""
    count = np.arange(first, first + ticks, dtype=np.int64)
    base = rate - int(gain / 2) + gain if half else rate
    rates = base + gain * count
    return rates if signed else rates % FULL  # below zero it rolls over


def _step_until(count: int, rate: int, gain: int, begin: int, half: bool) -> tuple[Counts, int]:
    """Steps at each tick until there are `count`, and what the accumulator keeps."""
    parts: list[Counts] = []
    steps, first = 0, 0
    left = begin
    while steps < count and first < _LONGEST:
        grown = left + np.cumsum(_rates(rate, gain, first, _CHUNK, False, half))
        total = steps + grown // FULL
        done = int(np.searchsorted(total, count))
        parts.append(total[: done + 1])
        if done < _CHUNK:
            return np.concatenate(parts), int(grown[done]) % FULL
        steps, left, first = int(total[-1]), int(grown[-1]) % FULL, first + _CHUNK
    return (np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)), left


_CHANNEL = 0.003  # s of a channel; as many as are on lie between two pulses to the servo
_SHOWN = 25  # ticks between two places that the paper is told

_SLIP = 40  # steps lost in a dead stop; set by eye, half a millimetre at 80 steps/mm

Make = Callable[[Accumulators], Move]


@dataclass(frozen=True)
class QueuedCommand:
    """A command of the queue.

    motion : works out what it moves from the accumulators as they are when it begins; None: it does not move.
    ticks : how long it lasts if it does not move.
    servo : place and rate of change, if it moves the pen's servo; lifts : whether it was told to go up.
    enable : motors on or off, if it switches them.
    """

    motion: Make | None = None
    ticks: int = 0
    servo: tuple[int, int] | None = None
    lifts: bool = True
    enable: tuple[int, int] | None = None


class Engine:
    """Executes jobs one after the other.

    depth : commands the queue holds besides the one under way.
    pause : ticks that pass between two commands.
    powered : whether the motors have power; without, steps are counted and nothing moves.
    """

    def __init__(self, profile: Plotter, paper: DrawnPaper, depth: int, pause: int, powered: bool) -> None:
        self.profile, self.paper, self.depth, self.pause, self.powered = profile, paper, depth, pause, powered
        self.mixed = profile.bed.gantry == "corexy"
        self.accumulators = Accumulators()
        self.queue: deque[QueuedCommand] = deque()
        self.job: QueuedCommand | None = None
        self.ends = math.inf
        self.finished = 0  # jobs, ever
        self.steps = [0, 0]  # since the counters were cleared
        self.enabled = [False, False]
        self.servo, self.channels = 0, 8  # where it was told to go; how many servos share its time
        self.pen_up = self.told_up = True
        self._move: Move | None = None
        self._began = 0.0
        self._from = (0, 0)  # motors, when the move began, in the paper's count
        self._motors = (0, 0)

    @property
    def room(self) -> bool:
        return len(self.queue) < self.depth

    @property
    def busy(self) -> bool:
        return self.job is not None

    def begin(self, now: float) -> None:
        """Power comes on: the carriage stands at what it takes for zero."""
        self.queue.clear()
        self.job, self._move, self.ends = None, None, math.inf
        self.accumulators, self.steps, self.enabled = Accumulators(), [0, 0], [False, False]
        self._motors = (0, 0)
        self.paper.believe((0, 0, self.paper.place[2]))

    def add(self, job: QueuedCommand, now: float) -> None:
        """Queue a job; it begins at once if nothing is under way."""
        self.queue.append(job)
        if self.job is None:
            self._begin_next_job(now)

    def finish(self) -> None:
        """The job under way ends, the next begins."""
        end = self.ends
        self._keep(end)
        self.finished += 1
        self.job, self.ends = None, math.inf
        if self.queue:
            self._begin_next_job(end + self.pause * TICK)

    def stop(self, now: float, everything: bool) -> bool:
        """Drop what is under way and what waits (only motion, unless everything); whether any of it moves."""
        moved = self._move is not None
        interrupted = moved or any(job.motion is not None for job in self.queue)
        self.queue = deque(job for job in self.queue if not everything and job.motion is None)
        if self.job is not None and (everything or moved):
            self._keep(now)
            self.job, self.ends = None, math.inf
            if self.queue:
                self._begin_next_job(now)
        return interrupted

    def slip(self) -> None:
        """Let the motors slip: they were stopped dead, so some steps were counted and not made."""
        self.steps = [steps + _SLIP for steps in self.steps]
        self._motors = (self._motors[0] + _SLIP, self._motors[1] + _SLIP)
        self.paper.believe((*self._halves(*self._motors), self.paper.place[2]))

    def count_steps(self, now: float) -> tuple[int, int]:
        """Count the steps of both motors so far."""
        first, second = self._so_far(now)
        return self.steps[0] + first, self.steps[1] + second

    def moving(self, now: float) -> tuple[bool, bool]:
        """Whether each motor moves."""
        if self._move is None:
            return False, False
        last, so_far = self._move.steps[-1], self._so_far(now)
        return bool(last[0] != so_far[0]), bool(last[1] != so_far[1])

    def clear(self) -> None:
        """Set the counters to zero."""
        self.steps = [0, 0]

    def switch(self, motors: tuple[int, int]) -> None:
        """Switch the motors on or off."""
        self.enabled = [motor > 0 for motor in motors]

    def _begin_next_job(self, now: float) -> None:
        job = self.job = self.queue.popleft()
        self._began = now
        if job.enable is not None:
            self.switch(job.enable)
        if job.servo is not None:
            self.told_up = job.lifts
            # its servo goes to a place, by so much with every pulse; it arrives later than the profile allows it
            (place, rate), pen = job.servo, self.profile.pen
            sweep = abs(place - self.servo) / rate * _CHANNEL * self.channels if rate else 0.0
            self.servo = place
            self.pen_up = abs(place - pen.up) < abs(place - pen.down)
            allowed = pen.up_time if self.pen_up else pen.down_time
            self.paper.pen(now + max(sweep - allowed, 0.0), float(place))
        ticks = job.ticks
        if job.motion is not None:
            self.enabled = [True, True]
            self._move, self._from = job.motion(self.accumulators), self._motors
            ticks = self._move.ticks
        self.ends = now + ticks * TICK

    def _so_far(self, now: float) -> tuple[int, int]:
        """Steps of the move under way."""
        ticks = self._ticks(now)
        if self._move is None or ticks == 0:
            return 0, 0
        first, second = self._move.steps[ticks - 1].tolist()
        return first, second

    def _ticks(self, now: float) -> int:
        """Of the move under way, how many have passed."""
        whole = self._move.ticks if self._move is not None else 0
        return min(max(math.floor((now - self._began) / TICK + 1e-6), 0), whole)

    def _keep(self, now: float) -> None:
        """Show the paper what the move under way has done until now, and forget it."""
        move, ticks = self._move, self._ticks(now)
        self._move = None
        if move is None:
            return
        for tick in [*range(_SHOWN - 1, ticks - 1, _SHOWN), ticks - 1] if ticks else []:
            first, second = move.steps[tick].tolist()
            if self.powered:
                x, y = self._halves(self._from[0] + first, self._from[1] + second)
                self.paper.move_to(self._began + (tick + 1) * TICK, (x, y, self.paper.place[2]))
        if ticks:
            steps = move.steps[ticks - 1].tolist()
            self.steps = [self.steps[0] + steps[0], self.steps[1] + steps[1]]
            self._motors = (self._from[0] + steps[0], self._from[1] + steps[1])
        self.accumulators.left = list(move.after)

    def _halves(self, first: int, second: int) -> tuple[int, int]:
        """Half steps of x and y from the steps of the motors."""
        return (first + second, first - second) if self.mixed else (2 * first, 2 * second)
