"""Meeting a plotter: is it there, has it paper, how far does it reach?"""

from __future__ import annotations

import msgspec

from handout.plotting.dialect import Log
from handout.plotting.dialects.hpgl import words
from handout.plotting.dialects.hpgl.controller import HpglController
from handout.plotting.ports import Port
from handout.profiles import Length, Plotter

_MOMENT = 0.05  # s in which it may say something by itself


def connect(port: Port, profile: Plotter, log: Log) -> HpglController:
    """Wake a plotter, empty its buffer, ask who it is and how far it reaches; it does not move.

    Raises
    ------
    DeviceSilent
        Nothing answers, or something that is no HP-GL plotter.
    DeviceAlarm
        It has no paper.
    """
    plotter = HpglController(port, profile, log)
    port.write(words.LISTEN + words.MARKED)
    port.read(_MOMENT)  # what it says by itself when it is switched on
    plotter.check_state()
    plotter.drop()
    plotter.size = int(plotter.ask(words.SIZE)[0])
    plotter.ask(words.ERROR)
    plotter.model = plotter.hear(words.WHO).decode("ascii", "replace")
    port.write(b"".join(words.turning(profile)))
    plotter.profile = _within(plotter, plotter.ask(words.LIMITS, count=4), log)
    plotter.started()
    plotter.drop()
    return plotter


def _within(plotter: HpglController, limits: tuple[float, ...], log: Log) -> Plotter:
    """The profile with the size of the plotter's buffer, and its bed where that is smaller."""
    profile, bed = plotter.profile, plotter.profile.bed
    per_mm = profile.limits.steps_per_mm
    left, low, right, high = (limit / per_mm for limit in limits)
    centred = bed.origin == "centre"
    width, height = (right - left, high - low) if centred else (right, high)
    if width < bed.width - 0.5 or height < bed.height - 0.5:
        log(f"The plotter reaches {width:.0f} × {height:.0f} mm, less than the profile says: is this its paper?")
        size = {"width": Length(min(width, bed.width)), "height": Length(min(height, bed.height))}
        bed = msgspec.structs.replace(bed, **size)
    own = msgspec.structs.replace(profile.port, buffer=plotter.size)
    return msgspec.structs.replace(profile, bed=bed, port=own)
