"""How the simulated controller reads a line (words, modal state, error numbers of GRBL 1.1), and its own settings."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from handout.profiles import Plotter
from handout.simulated.plotter.options import SimulatorOptions
from handout.simulated.plotter.planner import Axes

_WORD = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))")
_COMMENT = re.compile(r"\([^)]*\)?|;.*")
# G and M words the machine knows, and the group of which a line may hold one
_GROUPS = {
    "G0": "motion", "G1": "motion", "G80": "motion", "G4": "other", "G92": "other", "G92.1": "other",
    "G10": "other", "G28.1": "other", "G30.1": "other", "G18": "plane", "G19": "plane",
    "G17": "plane", "G20": "units", "G21": "units", "G40": "radius", "G49": "tool", "G54": "system",
    "G90": "distance", "G91": "distance", "G94": "feed",
    "M0": "stop", "M1": "stop", "M2": "stop", "M30": "stop", "M3": "spindle", "M4": "spindle", "M5": "spindle",
    "M7": "coolant", "M8": "coolant", "M9": "coolant",
}  # fmt: skip


class Refused(Exception):
    """A line the controller answers with an error number."""

    def __init__(self, number: int) -> None:
        super().__init__(f"error:{number}")
        self.number = number


@dataclass
class Modes:
    """What one line leaves behind for the next."""

    motion: str = "G0"
    inches: bool = False
    relative: bool = False
    feed: float = 0.0  # mm/min
    spindle: bool = False
    power: float = 0.0
    offset: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])  # G92, mm
    work: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])  # G54, mm; kept in its memory

    @property
    def shift(self) -> list[float]:
        """From work to machine coordinates, mm."""
        return [a + b for a, b in zip(self.offset, self.work, strict=True)]

    def words(self) -> str:
        """As ``$G`` tells them."""
        units, distance = "G20" if self.inches else "G21", "G91" if self.relative else "G90"
        spindle = "M3" if self.spindle else "M5"
        return f"{self.motion} G54 G17 {units} {distance} G94 {spindle} M9 T0 F{self.feed:g} S{self.power:g}"


@dataclass
class Request:
    """What a line asks for: a move to `target` (mm, machine coordinates), a dwell, a change of the spindle."""

    target: tuple[float, float, float] | None = None
    rapid: bool = False
    dwell: float | None = None
    spindle: bool = False
    writes: bool = False  # into its memory, deaf meanwhile
    stops: bool = False  # until it is told to go on (M0)


def strip(line: str) -> str:
    """The line without comments and blanks, in capitals: what the controller stores of it."""
    return _COMMENT.sub("", line).replace(" ", "").replace("\t", "").upper()


def read_request(line: str, modes: Modes, at: tuple[float, float, float]) -> Request:
    """Read a stripped line of G-code and change the modes.

    at : where the machine will be when all queued moves are done, mm.

    Raises Refused: with GRBL's error number; the modes are as they were.
    """
    words, codes = _words(line)
    kinds = {_GROUPS[code]: code for code in codes}  # a group has one code in a line
    units = 25.4 if kinds.get("units", "G20" if modes.inches else "G21") == "G20" else 1.0
    coordinates = [None if axis not in words else words[axis] * units for axis in "XYZ"]
    motion, other = kinds.get("motion", modes.motion), kinds.get("other")
    feed = words["F"] * units if "F" in words else modes.feed
    moves = other is None and coordinates != [None, None, None]
    _check_other(other, words, coordinates)
    if moves:
        _check_motion(motion, feed)
    _set_modes(modes, codes, words, feed, motion)
    _offset(modes, other, coordinates, at)
    if other == "G10":
        _store(modes, coordinates, at if words["L"] == 20.0 else None)
    request = _request(words, kinds)
    if moves:
        request.target, request.rapid = _target(modes, coordinates, at), motion == "G0"
    if kinds.get("stop") in ("M2", "M30"):  # the end of a program: all is as it begins
        modes.motion, modes.relative = "G1", False
    return request


def _request(words: dict[str, float], kinds: dict[str, str]) -> Request:
    """What a line asks for apart from a move."""
    other, stop = kinds.get("other"), kinds.get("stop")
    request = Request(dwell=words["P"] if other == "G4" else None, writes=other in ("G10", "G28.1", "G30.1"))
    request.spindle = "S" in words or "spindle" in kinds or stop in ("M2", "M30")
    request.stops = stop == "M0"
    return request


def _check_other(other: str | None, words: dict[str, float], coordinates: list[float | None]) -> None:
    """The words that a command without a move needs."""
    if other == "G4" and "P" not in words:
        raise Refused(28)
    if other in ("G92", "G10") and coordinates == [None, None, None]:
        raise Refused(26)
    if other == "G10" and words.get("L") not in (2.0, 20.0):
        raise Refused(20 if "L" in words else 28)


def _check_motion(motion: str, feed: float) -> None:
    """Whether there can be a move in a mode of motion, at a feed."""
    if motion == "G80":
        raise Refused(31)
    if motion == "G1" and feed <= 0:
        raise Refused(22)


def _words(line: str) -> tuple[dict[str, float], list[str]]:
    words: dict[str, float] = {}
    codes: list[str] = []
    groups: set[str] = set()
    end = 0
    for match in _WORD.finditer(line):
        if match.start() != end:
            break
        end, letter = match.end(), match.group(1)
        if letter in "GM":
            code = letter + re.sub(r"\.0*$", "", match.group(2).lstrip("0") or "0")
            if code not in _GROUPS:
                raise Refused(20)
            if _GROUPS[code] in groups:
                raise Refused(21)
            groups.add(_GROUPS[code])
            codes.append(code)
        elif letter not in "FLNPSTXYZ":
            raise Refused(20)
        elif letter in words:
            raise Refused(25)
        else:
            words[letter] = float(match.group(2))
    if end != len(line):
        raise Refused(2 if line[end].isalpha() else 1)
    return words, codes


def _set_modes(modes: Modes, codes: list[str], words: dict[str, float], feed: float, motion: str) -> None:
    modes.feed, modes.motion = feed, motion
    modes.power = words.get("S", modes.power)
    for code in codes:
        if code in ("G20", "G21"):
            modes.inches = code == "G20"
        elif code in ("G90", "G91"):
            modes.relative = code == "G91"
        elif code in ("M3", "M4"):
            modes.spindle = True
        elif code in ("M5", "M2", "M30"):
            modes.spindle = False


def _offset(modes: Modes, other: str | None, coordinates: list[float | None], at: tuple[float, float, float]) -> None:
    if other == "G92":
        rows = zip(modes.offset, coordinates, at, modes.work, strict=True)
        modes.offset = [old if value is None else here - work - value for old, value, here, work in rows]
    elif other == "G92.1":
        modes.offset = [0.0, 0.0, 0.0]


def _store(modes: Modes, coordinates: list[float | None], at: tuple[float, float, float] | None) -> None:
    """G10: the work offset is given (L2), or such that the place where it stands is called so (L20)."""
    here = [0.0, 0.0, 0.0] if at is None else [a - b for a, b in zip(at, modes.offset, strict=True)]
    sign = 1.0 if at is None else -1.0
    rows = zip(modes.work, coordinates, here, strict=True)
    modes.work = [old if value is None else place + sign * value for old, value, place in rows]


def _target(
    modes: Modes, coordinates: list[float | None], at: tuple[float, float, float]
) -> tuple[float, float, float]:
    if modes.relative:
        x, y, z = (here + (value or 0.0) for value, here in zip(coordinates, at, strict=True))
    else:
        x, y, z = (
            here if value is None else value + shift
            for value, here, shift in zip(coordinates, at, modes.shift, strict=True)
        )
    return x, y, z


_Z_STEPS = 250.0  # of a Z axis; no profile says how fine it is, this is GRBL's default ($102)


class Settings:
    """A table of numbers, and what follows from it.

    table : number → value as it is told.
    axes : what the planner goes by.
    """

    def __init__(self, profile: Plotter, options: SimulatorOptions) -> None:
        self.table = _table(profile, options) | {number: f"{value:.3f}" for number, value in options.settings}
        self.axes = Axes([1.0] * 3, [1.0] * 3, [1.0] * 3, 0.0)
        self._obey()

    def value(self, number: int) -> float:
        """One setting."""
        return float(self.table[number])

    def change(self, number: int, value: float) -> None:
        """Take a new value; Refused if there is no such setting, or it needs another first."""
        if number not in self.table:
            raise Refused(3)
        if number == 20 and value and not self.homes:
            raise Refused(10)
        self.table[number] = f"{value:.3f}"
        self._obey()

    @property
    def homes(self) -> bool:
        """Whether it can find its zero, and is locked until it has."""
        return self.value(22) % 2 == 1

    @property
    def has_soft_limits(self) -> bool:
        """Whether targets beyond its travel are refused."""
        return self.value(20) > 0

    @property
    def report(self) -> int:
        """What it answers to ``?``: bit 0 machine coordinates, bit 1 its buffers."""
        return int(self.value(10))

    @property
    def power(self) -> tuple[float, float]:
        """Least and greatest value of the spindle output other than 0."""
        return self.value(31), self.value(30)

    def _obey(self) -> None:
        axes = self.axes
        axes.deviation, axes.steps[:] = self.value(11), [self.value(100 + axis) for axis in range(3)]
        axes.speed[:] = [self.value(110 + axis) / 60 for axis in range(3)]
        axes.acceleration[:] = [self.value(120 + axis) for axis in range(3)]


def _table(profile: Plotter, options: SimulatorOptions) -> dict[int, str]:
    limits, pen, bed = profile.limits, profile.pen, profile.bed
    fastest = options.speed or max(limits.draw_speed, limits.travel_speed)
    acceleration = options.acceleration or limits.acceleration
    table = {10: "3", 11: f"{limits.junction_deviation:.3f}", 13: "0", 20: "0", 21: "1", 22: f"{profile.homing:d}"}
    table |= {23: "0", 30: "1000", 31: "0", 32: "0"}
    rows = (
        (100, [limits.steps_per_mm, limits.steps_per_mm, _Z_STEPS]),
        (110, [fastest * 60, fastest * 60, pen.z_speed * 60]),
        (120, [acceleration, acceleration, pen.z_acceleration]),
        (130, [bed.width, bed.height, 50.0]),
    )
    return table | {first + axis: f"{value:.3f}" for first, values in rows for axis, value in enumerate(values)}
