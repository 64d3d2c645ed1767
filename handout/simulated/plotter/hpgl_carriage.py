"""The carriage of the simulated HP-GL plotter: how it moves, how far it reaches, how its coordinates are turned.

Vectors are run one after the other, each speeding up and braking.  A vector of (dx, dy) is as fast and speeds up as
quickly as its longer axis may.  What speed it may have where it meets the next one follows from the corner that the
plotter is said to cut; without one it stands at every end.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from handout.profiles import Plotter

Point = tuple[int, int]  # plotter units

_TICK = 0.004  # s between two places that are remembered


@dataclass
class Vector:
    """A straight line from a to b (units), and how it may be run (units/s, units/s²); entry: speed at its start."""

    a: Point
    b: Point
    speed: float
    push: float
    entry: float = 0.0

    @property
    def length(self) -> float:
        return math.dist(self.a, self.b)

    @property
    def way(self) -> tuple[float, float]:
        return (self.b[0] - self.a[0]) / self.length, (self.b[1] - self.a[1]) / self.length


class Carriage:
    """Runs vectors, and knows where it is.

    push : units/s² of each axis; cut : units by which a corner may be cut; room : vectors that it takes in advance.
    """

    def __init__(self, push: float, cut: float, room: int) -> None:
        self.push, self.cut, self.room = push, cut, room
        self.at: Point = (0, 0)
        self.waiting: deque[Vector] = deque()
        self.ahead: deque[tuple[float, Point]] = deque()  # when it will be where, of the vector under way

    @property
    def full(self) -> bool:
        return len(self.waiting) >= self.room

    @property
    def moving(self) -> bool:
        return bool(self.ahead)

    @property
    def end(self) -> Point:
        """Where it will stand when all is done."""
        if self.waiting:
            return self.waiting[-1].b
        return self.ahead[-1][1] if self.ahead else self.at

    @property
    def next_event(self) -> float:
        """When it gets to the next place, s."""
        return self.ahead[0][0] if self.ahead else math.inf

    def add(self, b: Point, speed: float) -> None:
        """Take a vector; speed : units/s of the faster axis."""
        a = self.end
        if a == b:
            return
        share = max(abs(b[0] - a[0]), abs(b[1] - a[1])) / math.dist(a, b)
        self.waiting.append(Vector(a, b, speed / share, self.push / share))

    def start(self, now: float) -> None:
        """Begin with the next vector if none is under way."""
        if self.ahead or not self.waiting:
            return
        # sets the entry speeds of all that wait but the first, from the last backwards, which ends at rest
        leave = 0.0
        for before, vector in reversed(list(zip(self.waiting, list(self.waiting)[1:], strict=False))):
            able = math.sqrt(leave**2 + 2 * vector.push * vector.length)
            vector.entry = leave = min(able, self._corner(before, vector), before.speed, vector.speed)
        vector = self.waiting.popleft()
        leave = self.waiting[0].entry if self.waiting else 0.0
        self._lay_out(vector, leave, now)

    def arrive(self) -> None:
        """Put the carriage at the next place."""
        now, self.at = self.ahead.popleft()
        if not self.ahead:
            self.start(now)

    def stop(self) -> None:
        """Stand still, forget everything."""
        self.waiting.clear()
        self.ahead.clear()

    def _corner(self, before: Vector, after: Vector) -> float:
        if self.cut <= 0:
            return 0.0
        (ax, ay), (bx, by) = before.way, after.way
        half = math.sqrt(max(0.5 * (1 + ax * bx + ay * by), 0.0))  # sine of half the angle between the lines
        if half > 0.9999999:
            return math.inf
        across = math.hypot(bx - ax, by - ay)
        push = self.push * across / max(abs(bx - ax), abs(by - ay))
        return math.sqrt(push * self.cut * half / (1 - half))

    def _lay_out(self, vector: Vector, leave: float, now: float) -> None:
        """Work out when the carriage will be where along a vector."""
        u, push, length = vector.entry, vector.push, vector.length
        leave = min(leave, math.sqrt(u * u + 2 * push * length))
        if self.waiting:
            self.waiting[0].entry = leave
        top = min(vector.speed, math.sqrt(push * length + 0.5 * (u * u + leave * leave)))
        top = max(top, u, leave)
        up, down = (top - u) / push, (top - leave) / push
        level = max(length - 0.5 * up * (u + top) - 0.5 * down * (top + leave), 0.0) / top
        whole = up + level + down
        ticks = max(math.ceil(whole / _TICK), 1)
        for tick in range(1, ticks):
            t = whole * tick / ticks
            if t < up:
                gone = u * t + 0.5 * push * t * t
            elif t < up + level:
                gone = 0.5 * up * (u + top) + top * (t - up)
            else:
                left = whole - t
                gone = length - leave * left - 0.5 * push * left * left
            x, y = (p + (q - p) * gone / length for p, q in zip(vector.a, vector.b, strict=True))
            self.ahead.append((now + t, (round(x), round(y))))
        self.ahead.append((now + whole, vector.b))


class CarriageLimits:
    """How far the pen reaches, in plotter units.

    `bare` coordinates are those of the machine as its profile describes it; RO turns what instructions mean.
    """

    def __init__(self, profile: Plotter, per_mm: float) -> None:
        width, height = (round(side * per_mm) for side in (profile.bed.width, profile.bed.height))
        self._described = profile.hpgl.rotation
        self._centred = profile.bed.origin == "centre"
        self._size = (height, width) if self._described in (90, 270) else (width, height)  # without a rotation
        self._rotation = 0

    def rotate(self, degrees: int) -> None:
        """Turn the coordinates."""
        self._rotation = degrees

    @property
    def corners(self) -> tuple[int, int, int, int]:
        """Least x and y, greatest x and y, as OH says them."""
        width, height = self._size if self._rotation in (0, 180) else self._size[::-1]
        if self._centred:
            return -(width // 2), -(height // 2), width // 2, height // 2
        return 0, 0, width, height

    def inside(self, place: Point) -> bool:
        """Whether the pen can go there."""
        least_x, least_y, most_x, most_y = self.corners
        return least_x <= place[0] <= most_x and least_y <= place[1] <= most_y

    def clip_line(self, a: Point, b: Point) -> tuple[Point, Point] | None:
        """The part of a line within reach; None if there is none."""
        least_x, least_y, most_x, most_y = self.corners
        begin, end = 0.0, 1.0
        for start, delta, least, most in (
            (a[0], b[0] - a[0], least_x, most_x),
            (a[1], b[1] - a[1], least_y, most_y),
        ):
            if delta == 0:
                if not least <= start <= most:
                    return None
                continue
            first, last = sorted(((least - start) / delta, (most - start) / delta))
            begin, end = max(begin, first), min(end, last)
        if begin > end:
            return None
        return self._point_on(a, b, begin), self._point_on(a, b, end)

    @staticmethod
    def _point_on(a: Point, b: Point, share: float) -> Point:
        return round(a[0] + (b[0] - a[0]) * share), round(a[1] + (b[1] - a[1]) * share)

    def bare(self, place: Point) -> Point:
        """From what instructions mean to the machine as its profile describes it."""
        return self._turn(self._undo_turn(place, self._rotation), self._described)

    def turn_back(self, bare: Point) -> Point:
        """Undo `bare`: from the machine's coordinates to those of instructions."""
        return self._turn(self._undo_turn(bare, self._described), self._rotation)

    def _turn(self, place: Point, degrees: int) -> Point:
        """From coordinates without a rotation to those with it."""
        x, y = place
        width, height = (0, 0) if self._centred else self._size
        return {0: (x, y), 90: (y, width - x), 180: (width - x, height - y), 270: (height - y, x)}[degrees]

    def _undo_turn(self, place: Point, degrees: int) -> Point:
        """From coordinates with a rotation to those without."""
        x, y = place
        width, height = (0, 0) if self._centred else self._size
        return {0: (x, y), 90: (width - y, x), 180: (width - x, height - y), 270: (y, height - x)}[degrees]
