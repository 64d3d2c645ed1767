"""Line graphs of letters drawn by hand: polylines at half a unit a vertex, joined where they share a named point."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from handout.motion.recovery.letter_line import LetterLine

STEP = 0.06  # x-heights between vertices
RADIUS = 0.08


def line(
    ways: Sequence[Sequence[tuple[float, float]]],
    begin: Sequence[tuple[float, float]] = (),
    finish: Sequence[tuple[float, float]] = (),
    through: Sequence[tuple[float, float]] = (),
) -> LetterLine:
    """The line of some ways, x-heights, y up; ways that end, or have a corner, in the same point meet there."""
    number: dict[tuple[float, float], int] = {}
    xy: list[tuple[float, float]] = []
    edges: list[tuple[int, int]] = []

    def vertex(place):
        if place not in number:
            number[place] = len(xy)
            xy.append(place)
        return number[place]

    for way in ways:
        before = vertex(way[0])
        for a, b in pairwise(way):
            count = max(1, round(float(np.hypot(b[0] - a[0], b[1] - a[1])) / STEP))
            for k in range(1, count + 1):
                if k == count:
                    here = vertex(b)
                else:
                    here = len(xy)
                    xy.append((a[0] + (b[0] - a[0]) * k / count, a[1] + (b[1] - a[1]) * k / count))
                edges.append((before, here))
                before = here
    places = np.array(xy)
    radius = np.full(len(places), RADIUS)
    tips = [tuple(number[place] for place in own) for own in (begin, finish, through)]
    return LetterLine(places, radius, np.ones(len(places)), np.array(edges, dtype=np.intp).reshape(-1, 2), 1.0, *tips)


def arc(centre, radius, first, last, count=12):
    """Points on a circle from one angle to another, degrees; anticlockwise where the angle grows."""
    angles = np.radians(np.linspace(first, last, count))
    return [(round(centre[0] + radius * np.cos(a), 6), round(centre[1] + radius * np.sin(a), 6)) for a in angles]


def strokes(one, written):
    """Places along each stroke."""
    return [one.xy[own] for own in written.strokes]
