"""From timed moves to the numbers a board steps by.

A board counts in ticks of 40 µs.  At every tick each motor's rate is added to its accumulator, and when that overflows
2³¹ the motor makes a step; an acceleration may be added to the rate at every tick.  Here the accumulators are followed
in whole numbers, so what the board will do is known to the step, and what one move leaves over the next makes good.

Source: Schmalz, EiBotBoard command set, operation of SM, LM and LT: rate = 2³¹ · 40 µs · steps/s; after T ticks the
accumulator has grown by rate·T + ½·acceleration·T².
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from handout.libraries import interpolate
from handout.plotting.dialects import Timed
from handout.profiles import Plotter
from handout.values import Array

TICKS = 25_000  # a second
WHOLE = 1 << 31  # of an accumulator: a step
_FASTEST = WHOLE - 1  # one step a tick
_STEEPEST = 0.75  # share of the change of speed that would bring a motor to rest at an end of a move counted in steps


class Version(NamedTuple):
    """Of the firmware of an EBB; (0, 0, 0): unknown."""

    major: int
    minor: int
    patch: int

    @classmethod
    def from_text(cls, text: str) -> Version:
        """From "2.8.1"; unknown from anything else."""
        match = re.fullmatch(r"(\d+)\.(\d+)(?:\.(\d+))?", text)
        return cls(*(int(part or 0) for part in match.groups())) if match else UNKNOWN

    @classmethod
    def from_answer(cls, text: str) -> Version | None:
        """From what the board answers to V, such as "EBBv13_and_above EB Firmware Version 2.8.1"."""
        match = re.search(r"Firmware Version (\d+\.\d+(?:\.\d+)?)", text)
        return cls.from_text(match.group(1)) if match else None

    def __str__(self) -> str:
        return f"{self.major}.{self.minor}.{self.patch}"


UNKNOWN = Version(0, 0, 0)

# the firmware since which there is what
CURRENT = Version(2, 2, 3)  # QC: the voltage of the motors' power
STOP = Version(2, 2, 7)  # ES
POSITION = Version(2, 4, 3)  # QS, CS
MOTION = Version(2, 4, 4)  # QM
BUTTON = POSITION  # QB is older, but who pauses must find its place again
STEPS = Version(2, 5, 3)  # LM
FLAGS = Version(2, 6, 2)  # QG: what it is doing, its pen and its button, in one byte
HOME = Version(2, 6, 2)  # HM; and EM sets the position to zero
TIME = Version(2, 7, 0)  # LT
ENABLED = Version(2, 8, 0)  # QE: which motors are on
SIGNED = Version(3, 0, 0)  # a rate may change its sign under way, and the queue be longer (CU,4)


class Slice(NamedTuple):
    """One move of one motor: where it begins and ends, steps, and its speeds there, steps a tick."""

    begin: float
    end: float
    before: float
    after: float


class Axis:
    """One motor: where it stands, in whole steps, and its accumulator.

    signed : whether rates have a sign (firmware 3); before that the accumulator grows in either direction.
    """

    def __init__(self, signed: bool) -> None:
        self.signed = signed
        self.at, self.filled = 0, 0

    def clear(self) -> None:
        """The accumulator starts anew."""
        self.filled = 0

    def count_steps(self, goal: float) -> int:
        """Steps of a move that is told by its steps."""
        steps = round(goal) - self.at
        self.at += steps
        return steps

    def find_rate(self, part: Slice, ticks: int, clear: bool) -> tuple[int, int]:
        """Rate and acceleration of a move that is told by its time; the accumulator does as the board's will.

        The half step lets a motor stand on the step that is nearest to where it should be.
        """
        way = 1 if self._steps_needed(part.end, 1) >= 0 else -1
        if clear:
            self.filled = _FASTEST if self.signed and way < 0 else 0
        needed = self._steps_needed(part.end, way)
        if self.signed and not clear:
            rate, gain = _ramp(needed, part, ticks, crossing=True)
        else:
            turned = part if way > 0 else Slice(*(-value for value in part))
            rate, gain = _ramp(max(needed * way, 0.0), turned, ticks, crossing=False)
            rate, gain = way * rate, (way * gain if self.signed else gain)
        grown = total(rate, gain, ticks) if self.signed else total(abs(rate), gain, ticks)
        self.at += (1 if self.signed else way) * ((self.filled + grown) // WHOLE)
        self.filled = (self.filled + grown) % WHOLE
        return rate, gain

    def _steps_needed(self, goal: float, way: int) -> float:
        """Steps from where the accumulator is to the goal, when the motor turns that way."""
        share = self.filled / WHOLE - 0.5
        return goal - self.at - (share if self.signed else way * share)


def _ramp(steps: float, part: Slice, ticks: int, crossing: bool) -> tuple[int, int]:
    """Rate and acceleration that make so many steps; without crossing zero the rate stays on one side of it.

    The acceleration is even: half of it is subtracted before the first tick, which has to come out whole.  A rate of
    nothing would have no sign, which is what tells the direction.
    """
    gain = (part.after - part.before) / ticks
    if not crossing:
        most = 2.0 * steps / max(ticks * (ticks - 1), 1)
        gain = min(max(gain, -most), most)
    even = 2 * int(gain * WHOLE / 2)
    rate = round((steps * WHOLE - even * ticks * ticks / 2) / ticks)
    if not crossing:
        rate = max(rate, even // 2 - even * ticks, 1 if even or rate > 0 else 0)
    top = max(abs(rate + even // 2), abs(rate - even // 2 + even * ticks))
    return (round(steps * WHOLE / ticks), 0) if top > _FASTEST else (rate, even)


def total(rate: int, gain: int, ticks: int) -> int:
    """What a move adds to an accumulator."""
    return rate * ticks + gain * ticks * ticks // 2


def mixing(profile: Plotter) -> Array:
    """(2, 2) float, steps of the motors from mm of x and y."""
    mixed = profile.bed.gantry == "corexy"
    return float(profile.limits.steps_per_mm) * (np.array([[1.0, 1.0], [1.0, -1.0]]) if mixed else np.eye(2))


class Motors:
    """Follows both motors through a program.

    begin : steps of both motors from the machine's zero, where the program begins.

    place : (2,) float, mm, machine coordinates, to which they have been told to go.
    """

    def __init__(self, profile: Plotter, begin: tuple[int, int] = (0, 0)) -> None:
        self.version = Version.from_text(profile.firmware)
        self.mix = mixing(profile)
        self.axes = [Axis(self.version >= SIGNED) for _ in range(2)]
        for axis, at in zip(self.axes, begin, strict=True):
            axis.at = at
        self.place = np.linalg.solve(self.mix, np.array(begin, dtype=float))
        self._clock, self._written = 0.0, 0  # s; ticks or ms that were told so far

    def command_moves(self, moves: Sequence[Timed]) -> Iterator[tuple[int, bytes]]:
        """The commands of moves in a row that begin and end at rest, each with the number of its move."""
        xy = np.array([self.place, *((move.x, move.y) for move in moves)])
        seconds = np.array([move.seconds for move in moves])
        self.place = xy[-1]
        places = xy @ self.mix.T
        unit = 1000 if self.version < STEPS else TICKS
        # where moves meet: those of the smoothest motion through all places, at rest at both ends
        at = np.append(0.0, np.cumsum(seconds))
        speeds = np.asarray(interpolate.CubicSpline(at, places, bc_type="clamped")(at, 1)) / TICKS
        for index, whole in enumerate(self._whole(seconds, unit)):
            parts = [
                Slice(*map(float, (places[index, a], places[index + 1, a], speeds[index, a], speeds[index + 1, a])))
                for a in (0, 1)
            ]
            yield index, self._encode(parts, whole, index == 0)

    def _whole(self, seconds: Array, unit: int) -> list[int]:
        """Durations in whole units; what is rounded off one is added to the next."""
        ends = self._clock + np.cumsum(seconds)
        ends_rounded = np.rint(ends * unit).astype(int).tolist()
        self._clock = float(ends[-1])
        whole = np.diff([self._written, *ends_rounded])
        self._written = ends_rounded[-1]
        return [max(int(count), 1) for count in whole]

    def _encode(self, parts: list[Slice], whole: int, first: bool) -> bytes:
        """One move, in so many ms or ticks."""
        pairs = list(zip(self.axes, parts, strict=True))
        if self.version < STEPS:
            steps_1, steps_2 = (axis.count_steps(part.end) for axis, part in pairs)
            return f"SM,{whole},{steps_1},{steps_2}\r".encode("ascii")
        if self.version < TIME:
            numbers: list[int] = []
            for axis, part in pairs:
                steps = axis.count_steps(part.end)
                numbers += [*_counted_ramp(steps, part, whole)] if steps else [0, 0, 0]
            stands = numbers[1] == numbers[4] == 0
            text = f"LM,{','.join(map(str, numbers))}\r"
        else:
            (r1, a1), (r2, a2) = (axis.find_rate(part, whole, first) for axis, part in pairs)
            stands = not (r1 or a1 or r2 or a2)
            text = f"LT,{whole},{r1},{a1},{r2},{a2}{',3' if first else ''}\r"
        if stands:
            text = f"SM,{max(round(1000 * whole / TICKS), 1)},0,0\r"
        return text.encode("ascii")


def _counted_ramp(steps: int, part: Slice, ticks: int) -> tuple[int, int, int]:
    """Rate, steps and acceleration of LM, so that the last step comes with the last tick.

    Before firmware 2.7 the rate is added first and changed afterwards: after T ticks the accumulator has grown by
    rate·T + acceleration·T·(T − 1)/2.  The rate is kept well away from zero, where a last step would never come.
    """
    count, way = abs(steps), 1 if steps > 0 else -1
    most = 2.0 * _STEEPEST * count / max(ticks * (ticks - 1), 1)
    gain = min(max(way * (part.after - part.before) / ticks, -most), most)
    mean = count / ticks
    last = mean + gain * (ticks - 1) / 2
    rate = min((count + last) / ticks - gain * (ticks - 1) / 2, 1.0 - 2.0**-31)
    return round(rate * WHOLE), steps, round(gain * WHOLE)


class StepCounter:
    """Where the board must stand by its own count of steps, from the commands that were sent to it.

    steps : of each motor since its counter was cleared.
    """

    def __init__(self, version: Version) -> None:
        self.signed, self.clears = version >= SIGNED, version >= HOME
        self.steps = [0, 0]
        self._filled = [0, 0]

    def send(self, data: bytes) -> None:
        """A command is sent."""
        name, *fields = data.decode("ascii").strip().split(",")
        numbers = [int(field) for field in fields] if name in ("SM", "LM", "LT") else []
        if name in ("CS", "HM") or (name == "EM" and self.clears):
            self.steps, self._filled = [0, 0], [0, 0]
        elif name == "SM":
            self._add(numbers[1:3])
        elif name == "LM":
            self._add([numbers[1], numbers[4]])
        elif name == "LT":
            self._add([self._count_timed(axis, numbers) for axis in (0, 1)])

    def _add(self, steps: list[int]) -> None:
        self.steps = [a + b for a, b in zip(self.steps, steps, strict=True)]

    def _count_timed(self, axis: int, numbers: list[int]) -> int:
        """Steps that a motor makes in a time."""
        ticks, rate, gain = numbers[0], numbers[1 + 2 * axis], numbers[2 + 2 * axis]
        if len(numbers) > 5:
            falls = rate < 0 or (rate == 0 and gain < 0)
            self._filled[axis] = WHOLE - 1 if self.signed and falls else 0
        grown = self._filled[axis] + total(rate if self.signed else abs(rate), gain, ticks)
        self._filled[axis] = grown % WHOLE
        return (1 if self.signed or rate >= 0 else -1) * (grown // WHOLE)
