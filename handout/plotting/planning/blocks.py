"""What a machine is told, free of any dialect."""

from __future__ import annotations

from typing import NamedTuple


class Move(NamedTuple):
    """A straight move to x, y (mm, machine coordinates) at a feed in mm/min; z: height of the pen, if it changes."""

    x: float
    y: float
    feed: float
    z: float | None = None


class Timed(NamedTuple):
    """A straight move to x, y (mm, machine coordinates) in exactly that many seconds, for machines that keep time.

    servo : value of the pen's from here on, if it changes.
    """

    x: float
    y: float
    seconds: float
    servo: float | None = None


class Pen(NamedTuple):
    """The pen is lowered or lifted, and waited for."""

    down: bool


class Pause(NamedTuple):
    """The machine stands still, s."""

    seconds: float


Block = Move | Timed | Pen | Pause
