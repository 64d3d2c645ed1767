"""The parts of the test sheet, each with lines and words of its own; each shows one thing that a person can set.

All take the scale at which the sheet is drawn (1 on a page of A5), which changes room and letters but never what is
measured: a side of 80 is 80 mm long, a step of a vernier 0.05 mm.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from handout.profiles import Plotter
from handout.values import Array, Stroke


@dataclass(frozen=True)
class Caption:
    """Words on the sheet: x where they begin, y the line they stand on, mm; x_height: of the letters, mm."""

    text: str
    x: float
    y: float
    x_height: float


@dataclass(frozen=True, eq=False)
class Panel:
    """Lines in the order in which they have to be drawn, with words beside them; all in mm from its upper left corner.

    lines : each with a clock of its own.
    """

    name: str
    width: float
    height: float
    lines: tuple[Stroke, ...]
    captions: tuple[Caption, ...]


def line(points: Iterable[tuple[float, float]] | Array, speed: float, rest: float = 0.0) -> Stroke:
    """A line at a steady speed, mm/s; the pen rests so long on the paper, s, before it goes."""
    xy = np.asarray(list(points) if not isinstance(points, np.ndarray) else points, dtype=float)
    t = np.append(0.0, np.cumsum(np.hypot(*np.diff(xy, axis=0).T))) / speed
    if rest > 0:
        t, xy = np.append(0.0, t + rest), np.concatenate([xy[:1], xy])
    return Stroke(t, xy)


def dot(x: float, y: float, rest: float) -> Stroke:
    """The pen comes down, stays so long, s, and goes up."""
    return Stroke(np.array([0.0, max(rest, 1e-3)]), np.array([[x, y], [x, y]]))


STEP = 0.05  # mm that a mark of the vernier stands for
_LOOSE = (-4, 12)  # marks of the vernier: play from -0.2 to 0.6 mm
_RESTS = (0, 50, 100, 200, 400)  # ms
_DOTS = (0, 20, 50, 100, 200, 400)  # ms
_TAILS = (10, 20, 50, 100, 200)  # ms
_ROWS = 6  # of the ladders
_EASY = 0.85  # of the speed that acceleration allows, so that what is written is what is drawn
_LETTERS = 1.5  # mm


def letters(scale: float) -> float:
    """x-height of the captions, mm."""
    return float(max(_LETTERS * scale, 0.9))


def pace(profile: Plotter) -> float:
    """Of all lines that do not test speed, mm/s."""
    return min(40.0, float(profile.limits.draw_speed))


def square(side: float, names: tuple[str, str], profile: Plotter, scale: float) -> Panel:
    """A square with its diagonals: sides to measure for steps/mm, diagonals for whether the axes are square."""
    size, speed = letters(scale), pace(profile)
    left, top = 0.0, 0.0
    right, bottom = left + side, top + side
    outline = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]
    lines = (
        line(outline, speed),
        line([(left, top), (right, bottom)], speed),
        line([(right, top), (left, bottom)], speed),
    )
    captions = (
        Caption(f"{names[0]} {side:g} mm", left, bottom + 2.4 * size, size),
        Caption(f"{names[1]} {side:g}", left + size, top + side / 2 + size / 2, size),
        Caption(f"{side * math.sqrt(2):.1f}", right - 0.25 * side - 2 * size, bottom - 0.08 * side, size),
    )
    return Panel("square", side, side + 3.4 * size, lines, captions)


def vernier(along: int, name: str, profile: Plotter, scale: float) -> Panel:
    """Shows the play of an axis: marks drawn from one side, against marks from the other side 0.05 mm closer together.

    Where a pair of marks makes one straight line, its number is the play, mm.

    Parameters
    ----------
    along : 0 for marks along x, 1 along y.
    """
    pitch, reach, size, speed = 2.6 * scale, 3.4 * scale, letters(scale), pace(profile)
    first, last = _LOOSE
    start = (1.5 - first) * pitch  # where mark 0 is
    middle = 1.35 * reach

    def mark(where: float, side: float, number: int) -> Array:
        length = reach * (1.3 if number % 4 == 0 else 1.0) * side
        points = np.array([[where, middle], [where, middle + length]])
        return points if along == 0 else points[:, ::-1]

    numbers = range(first, last + 1)
    lead = mark(start + (first - 1.2) * pitch, -0.4, 1), mark(start + (last + 1.2) * pitch, 0.4, 1)
    up = [mark(start + number * pitch, -1.0, number) for number in numbers]
    down = [mark(start + number * (pitch - STEP), 1.0, number) for number in reversed(numbers)]
    lines = tuple(line(points, speed) for points in [lead[0], *up, lead[1], *down])
    length, across = start + (last + 1.5) * pitch, middle + 1.3 * reach
    captions = []
    for number in range(0, last + 1, 4):
        text = f"{number * STEP:.1f}".replace("0.", ".", 1).replace("-.0", "0").replace(".0", "0")
        where = start + number * pitch
        x, y = (where - 0.6 * size, across + 2.3 * size) if along == 0 else (across + 0.8 * size, where + size / 2)
        captions.append(Caption(text, x, y, size))
    if along == 0:
        captions.append(Caption(f"{name} play", 0.0, across + 5.0 * size, size))
        return Panel(f"play {name}", length, across + 6.0 * size, lines, tuple(captions))
    captions.append(Caption(f"{name} play", 0.0, length + 2.6 * size, size))
    return Panel(f"play {name}", across + 5.0 * size, length + 3.6 * size, lines, tuple(captions))


def _ladder(greatest: float) -> list[float]:
    """Rising speeds up to a greatest, mm/s, as whole as they can be told."""
    whole = 5.0 if greatest >= 30 else 1.0
    greatest = max(math.floor(greatest / whole) * whole, whole)
    rungs = [whole * round(greatest * (row + 1) / _ROWS / whole) for row in range(_ROWS)]
    return sorted({max(rung, whole) for rung in rungs})


def straight(profile: Plotter, scale: float) -> Panel:
    """The same zigzag at rising speeds: where it gets rough is too fast (`limits.draw_speed`)."""
    size, length = letters(scale), 42.0 * scale
    limits, row = profile.limits, 3.1 * letters(scale)
    speeds = _ladder(min(float(limits.draw_speed), _EASY * math.sqrt(limits.acceleration * length)))
    x, top = 5.5 * size, 3.2 * size
    lines, captions = [], [Caption("mm/s", 0.0, 1.4 * size, size)]
    for number, speed in enumerate(speeds):
        y, step = top + number * row, row / 5
        zigzag = [(x, y), (x + length, y + step), (x, y + 2 * step), (x + length, y + 3 * step)]
        lines.append(line(zigzag, speed))
        captions.append(Caption(f"{speed:g}", 0.0, y + 1.4 * size, size))
    return Panel("straight", x + length, top + len(speeds) * row, tuple(lines), tuple(captions))


def loops(profile: Plotter, scale: float) -> Panel:
    """The same loops at rising speeds: where they get rough, acceleration is too great."""
    size, radius = letters(scale), 1.7 * scale
    speeds = _ladder(min(float(profile.limits.draw_speed), _EASY * math.sqrt(profile.limits.acceleration * radius)))
    x, top, row = 5.5 * size, 2.6 * size, 2.6 * radius
    turns, advance = 9, 2.0 * scale
    lines, captions = [], [Caption("mm/s", 0.0, 1.4 * size, size)]
    phi = np.linspace(0.0, 2 * math.pi * turns, 48 * turns)
    for number, speed in enumerate(speeds):
        y = top + number * row + 1.1 * radius
        xy = np.column_stack(
            [x + radius + advance * phi / (2 * math.pi) - radius * np.cos(phi), y + radius * np.sin(phi)]
        )
        lines.append(line(xy, speed))
        captions.append(Caption(f"{speed:g}", 0.0, y + size / 2, size))
    width = x + turns * advance + 2 * radius
    return Panel("loops", width, top + len(speeds) * row, tuple(lines), tuple(captions))


def starts(profile: Plotter, scale: float) -> Panel:
    """Lines that begin at a rule, with growing rests: the first that is whole says what `pen.down_time` lacks, ms."""
    size, speed = letters(scale), pace(profile)
    x, top, row = 6.5 * size, 4.6 * size, 3.0 * size
    bottom = top + (len(_RESTS) - 0.4) * row
    lines = [line([(x, top - 0.6 * row), (x, bottom)], speed)]
    captions = [Caption("start +ms", 0.0, 1.6 * size, size)]
    for number, rest in enumerate(_RESTS):
        y = top + number * row
        lines.append(line([(x, y), (x + 12 * scale, y)], speed, rest / 1000))
        captions.append(Caption(f"{rest}", 0.0, y + size / 2, size))
    return Panel("starts", max(x + 12 * scale, 9 * size), bottom, tuple(lines), tuple(captions))


def left_behind(seconds: float, profile: Plotter) -> float:
    """How far the pen is from where a line ended, mm, so long after it has set out for the next."""
    limits = profile.limits
    speeding = float(limits.travel_speed) / float(limits.acceleration)
    early = min(seconds, speeding)
    return float(limits.acceleration) * early**2 / 2 + float(limits.travel_speed) * (seconds - early)


def ends(profile: Plotter, scale: float) -> Panel:
    """Lines that end at a rule, others beyond a gap: how far a tail reaches says what `pen.up_time` lacks, ms."""
    size, speed = letters(scale), pace(profile)
    # the longest delays whose tails have room, two if their numbers do not run into each other: ms, and mm
    ways = [(ms, left_behind(ms / 1000, profile)) for ms in _TAILS]
    fitting = [tail for tail in ways if 0.8 < tail[1] < 8.0 * scale] or ways[:1]
    apart = [tail for tail in fitting[:-1] if fitting[-1][1] - tail[1] > 4.5 * size]
    shown = [*apart[-1:], fitting[-1]]
    first, top, row, count = 8.0 * scale, 7.6 * size, 3.0 * size, 4
    far = max(2.0 * shown[-1][1], 6.0 * scale)  # the pen gathers speed up to the middle of its way
    bottom = top + (count - 0.4) * row
    lines = [line([(first, top - 0.6 * row), (first, bottom)], speed)]
    captions = [Caption("end +ms", 0.0, 1.6 * size, size)]
    for ms, way in shown:
        lines.append(line([(first + way, top - 0.6 * row - 1.2 * size), (first + way, top - 0.6 * row)], speed))
        captions.append(Caption(f"{ms}", first + way - 0.7 * size, top - 0.6 * row - 1.6 * size, size))
    for number in range(count):
        y = top + number * row
        lines.append(line([(0.0, y), (first, y)], speed))
        lines.append(line([(first + far, y), (first + far + 3 * scale, y)], speed))
    return Panel("ends", max(first + far + 3 * scale, 8 * size), bottom, tuple(lines), tuple(captions))


def dots(profile: Plotter, scale: float) -> Panel:
    """Dots for which the pen rests longer and longer, ms: the first are missing, the last blot."""
    size, gap = letters(scale), 5.0 * letters(scale)
    lines = [dot(gap * (number + 0.3), 3.2 * size, rest / 1000) for number, rest in enumerate(_DOTS)]
    captions = [Caption(f"{rest}", gap * number, 6.2 * size, size) for number, rest in enumerate(_DOTS)]
    captions.append(Caption("dots ms", 0.0, 1.6 * size, size))
    return Panel("dots", gap * len(_DOTS), 7.0 * size, tuple(lines), tuple(captions))


def circles(profile: Plotter, scale: float) -> Panel:
    """A circle each way: flats at the quarters are play, an end that misses its start is a pen that is not held."""
    radius, size = 8.0 * scale, letters(scale)
    lines = []
    for way, share in ((1.0, 1.0), (-1.0, 0.72)):
        phi = np.linspace(0.0, way * 2 * math.pi, 181)
        lines.append(line(radius + share * radius * np.column_stack([np.sin(phi), -np.cos(phi)]), pace(profile)))
    return Panel("circles", 2 * radius, 2 * radius + size, tuple(lines), ())


def sample(scale: float) -> Panel:
    """A little writing by hand."""
    size = 2.2 * scale
    words = ("The quick brown fox", "jumps over 13 dogs.")
    captions = tuple(Caption(text, 0.0, (2.4 + 3.6 * number) * size, size) for number, text in enumerate(words))
    return Panel("sample", 24.0 * size, 7.6 * size, (), captions)
