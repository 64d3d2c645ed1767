"""A connected plotter moved by hand: its pen up and down, its carriage to its zero or a little way, its motors off."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from handout.errors import DeviceAlarm, DoesNotFit, InputError
from handout.plotting import bed
from handout.plotting.dialect import Controller
from handout.plotting.driving.driver import halting

Place = tuple[float, float]
_ZERO = 0.02  # mm; a machine that says it stands in its zero may just have been switched on


def home(controller: Controller) -> None:
    """Lift the pen and go to zero: by its switches, or as it knows the way.

    Raises
    ------
    DeviceAlarm
        It has no switches, and does not know where it stands.
    """
    if controller.profile.homing:
        controller.home()
        controller.go(0.0, 0.0)  # some know their zero without going there
    elif controller.position() is None:
        corner = bed.CORNERS[controller.profile.bed.origin]
        raise DeviceAlarm(
            "The plotter does not know where it stands, since it was switched on or has restarted: push its pen above "
            f"its zero by hand, the {corner}."
        )
    else:
        controller.go(0.0, 0.0)


def jog(controller: Controller, dx: float, dy: float) -> None:
    """Lift the pen and travel so far along the machine's axes, mm.

    Raises
    ------
    DoesNotFit
        That would leave its bed; of a machine that may not know where it stands, that is longer than its bed.
    """
    profile, at = controller.profile, controller.position()
    for way, most, axis in ((dx, profile.bed.width, "x"), (dy, profile.bed.height, "y")):
        if abs(way) > most:
            raise DoesNotFit(f"jog: {way:g} mm along {axis} is more than the bed of {profile.title}, {most:g} mm.")
    if at is not None and max(map(abs, at)) > _ZERO:
        bed.check(np.array([[at[0] + dx, at[1] + dy]]), profile, "a shorter way")
    controller.jog(dx, dy)


def move_and_locate(controller: Controller, move: Callable[[Controller], None]) -> Place | None:
    """Make a move; returns its place then, mm, None if unknown.  If anything goes wrong the pen is lifted."""
    with halting(controller, harmless=(InputError,)):
        move(controller)
    return controller.position()
