"""A planning controller stepped through time, written from the rules of the specification and sharing no code with it.

At every moment the machine goes as fast as it may: not faster than a moment ago plus its acceleration, than the feed of
the line it is on, than lets it brake to every corner it knows of, and to a stand where its knowledge ends.  It knows of
the line it is on and of as many more as its queue holds; when there is room, the next is read, which takes a while.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

DT = 50e-6  # s


@dataclass
class Line:
    """One line of a program: to where, mm, and its greatest speed, mm/s."""

    to: tuple[float, float]
    speed: float


@dataclass
class Seen:
    """What was executed: when each line began, at what speed, s and mm/s; and samples (s, x, y, speed)."""

    begins: list[float]
    entries: list[float]
    samples: list[tuple[float, float, float, float]]


def whole_steps(value: float, per_mm: float) -> float:
    return math.floor(value * per_mm + 0.5) / per_mm


def weakest(x: float, y: float, limits: tuple[float, float]) -> float:
    """The greatest length of a vector in a direction of which no axis gets more than its limit."""
    return min(limit / abs(part) if part else math.inf for limit, part in zip(limits, (x, y), strict=True))


def corner(before, after, acceleration, deviation) -> float:
    """Square of the speed at a corner: v² = a δ sin(θ/2) / (1 − sin(θ/2)), θ the angle that the two lines enclose."""
    straight = before[0] * after[0] + before[1] * after[1]
    if straight > 0.999999:
        return math.inf
    if straight < -0.999999:
        return 0.0
    half = math.sin((math.pi - math.acos(straight)) / 2)
    x, y = after[0] - before[0], after[1] - before[1]
    size = math.hypot(x, y)
    return weakest(x / size, y / size, acceleration) * deviation * half / (1 - half)


def execute(lines, steps, acceleration, rate, deviation, queue, line_time=0.0) -> Seen:
    """Run lines from a stand at the zero to a stand at the end of the last."""
    at, length, unit, brake, top, limit = (0.0, 0.0), [], [], [], [], []
    places = [at]
    for number, line in enumerate(lines):
        to = tuple(whole_steps(value, per) for value, per in zip(line.to, steps, strict=True))
        size = math.dist(at, to)
        way = ((to[0] - at[0]) / size, (to[1] - at[1]) / size)
        length.append(size)
        brake.append(weakest(*way, acceleration))
        top.append(min(line.speed, weakest(*way, rate)))
        limit.append(min(corner(unit[-1], way, acceleration, deviation), top[-1] ** 2, top[-2] ** 2) if number else 0.0)
        unit.append(way)
        places.append(to)
        at = to
    now, here, gone, speed = 0.0, 0, 0.0, 0.0
    known, free_at = min(queue, len(lines)), 0.0  # lines read, the one under way among them; when reading could begin
    seen = Seen([0.0], [0.0], [])
    while here < len(lines):
        while known < min(here + queue + 1, len(lines)) and now >= free_at + line_time:
            known, free_at = known + 1, max(free_at + line_time, now)
        may = top[here] ** 2
        left, energy = length[here] - gone, 0.0
        for node in range(here + 1, known + 1):
            energy += 2 * brake[node - 1] * left
            may = min(may, energy + (limit[node] if node < known else 0.0))
            if node < known:
                left = length[node]
        faster = min(speed + brake[here] * DT, math.sqrt(max(may, 1e-8)))
        gone += 0.5 * (speed + faster) * DT
        speed, now = faster, now + DT
        while here < len(lines) and gone >= length[here] - 2e-5:
            if known == here + queue + 1:  # it was full until now
                free_at = now
            gone, here = max(gone - length[here], 0.0), here + 1
            seen.begins.append(now)
            seen.entries.append(speed)
        if here < len(lines):
            a, way = places[here], unit[here]
            seen.samples.append((now, a[0] + gone * way[0], a[1] + gone * way[1], speed))
    return seen
