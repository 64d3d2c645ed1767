"""The simulated Klipper's toolhead: moves wait until their speeds are settled, and are carried out by print time.

Source: Klipper's documentation (Kinematics, Code overview) and its host program, read for facts: junctions by square
corner velocity and by the curve that short moves make; moves are settled a quarter of a second at a time; with less
than a second of settled motion in hand all that waits is settled, to a stop; after a stop it waits for two seconds of
motion, or until none has come for a tenth of a second, and begins a quarter of a second later.  Its minimum cruise
ratio is taken to be 0.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from handout.simulated.plotter.planner import Steps, Vector

_SETTLES = 0.25  # s of motion, at its own speed, after which it looks what is settled (LOOKAHEAD_FLUSH_TIME)
LOW, HIGH = 1.0, 2.0  # s of settled motion below which it plans to stop, above which it takes no more (BUFFER_TIME_…)
_BEGINS = 0.25  # s before it begins after a stop (BUFFER_TIME_START)
_PATIENT = 0.1  # s without a move after which it begins with what it has
_SAMPLE = 0.005  # s between two places that are told to the paper; our choice
_STRAIGHT = 0.999999
_INSTANT = 1e-9  # s
Event = Callable[[float], None]


@dataclass
class ToolheadLimits:
    """Speeds mm/s and accelerations mm/s² of the carriage and of z; square corner velocity, mm/s."""

    speed: float
    acceleration: float
    z_speed: float
    z_acceleration: float
    corner: float


@dataclass(slots=True)
class Move:
    """A straight move; squares of speeds: `most` at its start, `gain` that it can add, `cruise` it may reach."""

    start: Vector
    way: Vector
    mm: float
    acceleration: float
    cruise: float
    most: float = 0.0
    gain: float = 0.0
    entry: float = 0.0
    events: list[Event] = field(default_factory=list)  # at its end


@dataclass(slots=True)
class _Settled:
    """A move in time: when it begins, s; speeds; times of its three parts."""

    move: Move
    begin: float
    entry: float
    top: float
    times: tuple[float, float, float]

    @property
    def end(self) -> float:
        return self.begin + sum(self.times)

    def place_at(self, now: float) -> Vector:
        """The place, mm."""
        t, (up, level, _), a = min(max(now - self.begin, 0.0), sum(self.times)), self.times, self.move.acceleration
        if t <= up:
            gone = self.entry * t + 0.5 * a * t * t
        elif t <= up + level:
            gone = 0.5 * (self.entry + self.top) * up + self.top * (t - up)
        else:
            left = t - up - level
            gone = 0.5 * (self.entry + self.top) * up + self.top * (level + left) - 0.5 * a * left * left
        share = min(gone / self.move.mm, 1.0)
        x, y, z = (at + share * by for at, by in zip(self.move.start, self.move.way, strict=True))
        return x, y, z


class Toolhead:
    """Moves and what happens between them, in print time, which is the plotter's clock.

    moved : told where the carriage is when, in steps; steps : steps/mm.

    now : s; print_time : when all that is settled is done; at : where the last move that was taken leads to, mm.
    """

    def __init__(self, limits: ToolheadLimits, steps: list[float], moved: Callable[[float, Steps], None]) -> None:
        self.limits, self.steps, self._moved = limits, steps, moved
        self.now = self.print_time = 0.0
        self._looked = -1.0
        self.at: Vector = (0.0, 0.0, 0.0)
        self.forget()

    def forget(self) -> None:
        """Forget all moves that wait or are under way."""
        self._waiting: list[Move] = []
        self._settled: deque[_Settled] = deque()
        self._events: deque[tuple[float, Event]] = deque()
        self._until = HIGH  # s of motion that still have to come until it looks what is settled
        self._stands, self._primes = True, math.inf
        self.print_time, self._sampled = max(self.print_time, self.now), self.now
        self._live = self.at

    @property
    def live(self) -> Vector:
        """Where the carriage is, mm."""
        return self._settled[0].place_at(self.now) if self._settled else self._live

    @property
    def full(self) -> bool:
        """Whether it takes no more for now."""
        return self.print_time - self.now > HIGH + _INSTANT

    @property
    def resting(self) -> bool:
        """Whether nothing is left to do."""
        return not (self._waiting or self._settled or self._events) and self.print_time <= self.now

    def move(self, to: Vector, speed: float) -> None:
        """Take a move to a place, mm, at a speed in mm/s."""
        way = (to[0] - self.at[0], to[1] - self.at[1], to[2] - self.at[2])
        mm = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
        if mm == 0.0:
            return
        limits, rise = self.limits, abs(way[2]) / mm
        speed, acceleration = min(speed, limits.speed), limits.acceleration
        if rise > 0:
            speed, acceleration = min(speed, limits.z_speed / rise), min(acceleration, limits.z_acceleration / rise)
        made = Move(self.at, way, mm, acceleration, speed * speed, gain=2.0 * acceleration * mm)
        if self._waiting:
            made.most = self._junction(self._waiting[-1], made)
        self._waiting.append(made)
        self.at = to
        if len(self._waiting) > 1:
            self._until -= mm / speed
            if self._until <= 0:
                self._settle(lazy=True)
        if self._stands:
            self._primes = self.now + max(_PATIENT, self.print_time - self.now - LOW)

    def _junction(self, before: Move, move: Move) -> float:
        """Square of the greatest speed between two moves."""
        cosine = -sum(a * b for a, b in zip(before.way, move.way, strict=True)) / (before.mm * move.mm)
        most = min(move.cruise, before.cruise, before.most + before.gain)
        if cosine > _STRAIGHT:
            return 0.0
        cosine = max(cosine, -_STRAIGHT)
        half = math.sqrt(0.5 * (1.0 - cosine))
        tangent = half / math.sqrt(0.5 * (1.0 + cosine))
        radius = self.limits.corner**2 * (math.sqrt(2.0) - 1.0) / self.limits.acceleration * half / (1.0 - half)
        for one in (before, move):
            most = min(most, radius * one.acceleration, 0.5 * one.mm * tangent * one.acceleration)
        return most

    def _settle(self, lazy: bool = False) -> None:
        """Give the waiting moves their speeds and times: all of them, to a stop; `lazy`: those that are settled."""
        self._until, many = _SETTLES, len(self._waiting)
        stop, free = 0.0, math.inf
        settled = 0
        for number in range(many - 1, -1, -1):
            move = self._waiting[number]
            stop, free = min(move.most, stop + move.gain), min(move.most, free + move.gain)
            move.entry = stop
            if settled == 0 and free - stop <= 1e-9:
                settled = number
        count = settled if lazy else many
        if count == 0:
            return
        if self._stands:
            self._stands, self._primes = False, math.inf
            self.print_time = max(self.print_time, self.now + _BEGINS)
        for number, move in enumerate(self._waiting[:count]):
            self._time(move, self._waiting[number + 1].entry if number + 1 < many else 0.0)
        del self._waiting[:count]

    def _time(self, move: Move, leave: float) -> None:
        """Append a move whose squared speeds at its ends are known."""
        top = min(move.cruise, 0.5 * (move.entry + leave + move.gain))
        u, v, w, a = math.sqrt(move.entry), math.sqrt(leave), math.sqrt(max(top, leave, move.entry)), move.acceleration
        up, down = (w - u) / a, (w - v) / a
        level = max(move.mm - 0.5 * (u + w) * up - 0.5 * (v + w) * down, 0.0) / w
        self._settled.append(_Settled(move, self.print_time, u, w, (up, level, down)))
        self.print_time = self._settled[-1].end
        self._events.extend((self.print_time, event) for event in move.events)

    def _stop(self) -> None:
        self._settle()
        self._stands, self._until, self._primes = True, HIGH, math.inf

    def last_move_time(self) -> float:
        """When what has been taken is done, s; it is settled, to a stop."""
        if self._stands:
            self._stop()
            self.print_time = max(self.print_time, self.now + _BEGINS)
        else:
            self._settle()
        return self.print_time

    def dwell(self, seconds: float) -> None:
        """Stand for a time after the moves that were taken."""
        self.print_time = self.last_move_time() + seconds

    def call_after(self, event: Event) -> None:
        """Call `event` when the last move is done; the carriage need not stop there."""
        if self._waiting:
            self._waiting[-1].events.append(event)
        else:
            self._events.append((self.last_move_time(), event))

    @property
    def next_event(self) -> float:
        """When something happens next, s; infinite: nothing will."""
        due = self._events[0][0] if self._events else math.inf
        if self._settled:
            due = min(due, max(self._sampled + _SAMPLE, self._settled[0].begin), max(self._settled[0].end, self.now))
        low = self.print_time - LOW if not self._stands else math.inf
        # it has room again; it has done all
        waited = (time for time in (self.print_time - HIGH, self.print_time) if time > self._looked)
        return max(min(due, self._primes, low, *waited), self.now)

    def step(self) -> None:
        """It happens now."""
        self._looked = now = self.now
        while self._settled and self._settled[0].end <= now:
            self._live = self._settled.popleft().place_at(math.inf)
            self._tell()
        if self._settled and self._settled[0].begin <= now and self._sampled + _SAMPLE <= now + _INSTANT:
            self._tell()
        while self._events and self._events[0][0] <= now:
            self._events.popleft()[1](now)
        if self._primes <= now or (not self._stands and self.print_time - now <= LOW + _INSTANT):
            self._stop()

    def _tell(self) -> None:
        self._sampled = self.now
        x, y, z = (math.floor(at * per + 0.5) for at, per in zip(self.live, self.steps, strict=True))
        self._moved(self.now, (x, y, z))

    def set_position(self, to: Vector) -> None:
        """Set the place where it stands."""
        self.last_move_time()
        self.at = self._live = to
