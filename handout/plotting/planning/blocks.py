"""What a machine is told, free of any dialect."""

from __future__ import annotations

from typing import NamedTuple


class MoveBlock(NamedTuple):
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


class PenBlock(NamedTuple):
    """The pen is lowered or lifted, and waited for.

    value : to which it is lowered, of its servo or its Z axis; None: the profile's own; inks : it is for a stroke, and
        not for a hook.
    """

    down: bool
    value: float | None = None
    inks: bool = True


class Pause(NamedTuple):
    """The machine stands still, s."""

    seconds: float


class UserLines(NamedTuple):
    """Lines of the user's own, begun when the machine stands; what they may have changed is told anew."""

    lines: tuple[str, ...]


Block = MoveBlock | Timed | PenBlock | Pause | UserLines
