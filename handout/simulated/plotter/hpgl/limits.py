"""The hard-clip limits of the simulated plotter, and the rotation of its coordinates."""

from __future__ import annotations

from handout.profiles import Plotter
from handout.simulated.plotter.hpgl.carriage import Point


class Limits:
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

    def clipped(self, a: Point, b: Point) -> tuple[Point, Point] | None:
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
        return self._on(a, b, begin), self._on(a, b, end)

    @staticmethod
    def _on(a: Point, b: Point, share: float) -> Point:
        return round(a[0] + (b[0] - a[0]) * share), round(a[1] + (b[1] - a[1]) * share)

    def bare(self, place: Point) -> Point:
        """From what instructions mean to the machine as its profile describes it."""
        return self._turn(self._back(place, self._rotation), self._described)

    def turned(self, bare: Point) -> Point:
        """The way back."""
        return self._turn(self._back(bare, self._described), self._rotation)

    def _turn(self, place: Point, degrees: int) -> Point:
        """From coordinates without a rotation to those with it."""
        x, y = place
        width, height = (0, 0) if self._centred else self._size
        return {0: (x, y), 90: (y, width - x), 180: (width - x, height - y), 270: (height - y, x)}[degrees]

    def _back(self, place: Point, degrees: int) -> Point:
        """From coordinates with a rotation to those without."""
        x, y = place
        width, height = (0, 0) if self._centred else self._size
        return {0: (x, y), 90: (width - y, x), 180: (width - x, height - y), 270: (y, height - x)}[degrees]
