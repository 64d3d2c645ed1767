"""How lines reach a controller that plans: how many a second, and how many moves it has in hand at any moment.

Lines are read one after the other, each in `line_time`, as long as the queue has room.  After a rest the queue is
empty, and the machine waits for it to fill (`course.starts`); from then on a move is read while others are executed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.plotting import course
from handout.plotting.course import Course
from handout.plotting.lookahead import Motion
from handout.profiles import Plotter

_BUSY = 0.8  # share of what the controller can read that is asked of it
_LINE = 22.0  # bytes of a line at most


def capacity(profile: Plotter) -> float:
    """Lines a second that the connection carries and the controller reads, with something to spare."""
    return _BUSY / max(line_time(profile), 1e-4)


def line_time(profile: Plotter) -> float:
    """What a line takes to arrive and to be read, whichever is longer, s."""
    return max(float(profile.port.line_time), _LINE * 10 / profile.port.baud)


def depth(way: Course, motion: Motion, profile: Plotter) -> NDArray[np.intp]:
    """Moves in the machine's queue when each begins, that one included.  (n,) at least 1.

    A place in the queue counts as free when the move that held it begins; a GRBL frees it up to six moves earlier.
    """
    if len(way.kind) == 0:
        return np.zeros(0, dtype=np.intp)
    queue, each = profile.port.queue, line_time(profile)
    number = np.arange(len(way.kind))
    begins = course.starts(way, motion, profile)[:-1]
    first = _first(way)
    room = np.where(number - queue >= first, begins[np.maximum(number - queue, 0)], -np.inf)
    room[way.stands] = begins[way.stands] - course.filling(way, profile)
    read = each * (number + 1) + np.maximum.accumulate(room - each * number)
    have = np.searchsorted(read, begins + 1e-9, side="right") - number
    return np.asarray(np.clip(have, 1, queue), dtype=np.intp)


def least(way: Course, have: NDArray[np.intp], queue: int) -> int | None:
    """The fewest moves in the queue in the middle of a stroke, where there were more to come; None if there is none."""
    first = _first(way)
    ends = np.append(np.flatnonzero(way.stands)[1:], len(way.kind))
    after = ends[np.searchsorted(ends, np.arange(len(way.kind)), side="right")]
    middle = way.draws & (np.arange(len(way.kind)) > first) & (np.arange(len(way.kind)) + queue <= after)
    return int(have[middle].min()) if middle.any() else None


def _first(way: Course) -> NDArray[np.intp]:
    """Of every move, the first after the rest before it."""
    stand = np.flatnonzero(way.stands)
    return np.repeat(stand, np.diff(np.append(stand, len(way.kind))))
