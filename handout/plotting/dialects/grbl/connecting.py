"""Meeting a controller: is it there, is it locked, and what are its own limits?"""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from handout.errors import DeviceSilent
from handout.plotting.dialects.grbl import words
from handout.plotting.dialects.grbl.link import Link
from handout.plotting.dialects.grbl.words import Banner, Reply, Setting, Sizes, Status
from handout.plotting.ports import Port
from handout.profiles import Acceleration, Length, Plotter, Speed

_GLANCE = 0.25
_HOMING = 180.0  # s a machine may take to find its switches


def connect(port: Port, profile: Plotter, log: Callable[[str], None]) -> tuple[Link, Plotter]:
    """Wake the controller, unlock it unless it can be homed, read its settings.

    Returns
    -------
    Link
        Ready to send lines.
    Plotter
        The profile with the machine's own limits in place of the file's; `log` is told where they differ.

    Raises
    ------
    DeviceSilent
        Nothing answers, or something that is not GRBL.
    DeviceAlarm
        It refuses.
    """
    link = Link(port, profile.port.buffer, profile.port.timeout, log)
    _wake(link, profile)
    _unlock(link, profile, log)
    heard = link.ask(b"$I\n") + link.ask(b"$$\n")
    own = with_settings(profile, heard, log)
    link.buffer = own.port.buffer
    return link, own


def _wake(link: Link, profile: Plotter) -> None:
    """Wait for the greeting; a controller that is already awake is reset, which is harmless while it stands still."""
    waited, garbage = 0.0, False
    while waited < profile.port.start_up:
        heard = link.replies(_GLANCE)
        if any(isinstance(reply, Banner) for reply in heard):
            return
        if any(isinstance(reply, Status) for reply in heard):
            break
        garbage |= bool(heard)
        waited += _GLANCE
        link.port.write(words.STATUS)
    reset(link, profile.port.timeout, garbage)


def reset(link: Link, patience: float, garbage: bool = False) -> None:
    """Soft-reset the controller and wait for its greeting."""
    link.port.write(words.RESET)
    link.forget()
    waited, greeted = 0.0, False
    while waited < patience:
        heard = link.replies(_GLANCE)
        greeted |= any(isinstance(reply, Banner) for reply in heard)
        if greeted and not heard:
            return
        garbage |= bool(heard)
        waited += 0.0 if heard else _GLANCE
    if garbage:
        raise DeviceSilent(
            "Something answers, but not as a GRBL controller does: check baud and dialect in the profile."
        )
    raise DeviceSilent(
        f"The plotter does not answer within {patience:g} s: is it switched on, is this its port, "
        "is the baud rate of the profile right?"
    )


def _unlock(link: Link, profile: Plotter, log: Callable[[str], None]) -> None:
    if not profile.homing and state(link) == "Alarm":
        log("The plotter was locked and is unlocked ($X): make sure that its zero is where the profile says.")
        link.ask(b"$X\n")


def home(link: Link, log: Callable[[str], None]) -> None:
    """Let the machine find its zero by its switches."""
    log("Homing: the plotter looks for its zero.")
    link.ask(b"$H\n", _HOMING)


def state(link: Link) -> str:
    """The state the controller is in: Idle, Run, Hold, Alarm …"""
    link.port.write(words.STATUS)
    while True:
        for reply in link.attend():
            if isinstance(reply, Status):
                return reply.state


def with_settings(profile: Plotter, heard: list[Reply], log: Callable[[str], None]) -> Plotter:
    """The profile with what ``$$`` and ``$I`` said; `log` is told about every difference that changes the motion.

    Speeds are the lesser of the two, the travel only counts with soft limits on (``$20=1``), all else is the machine's.
    """
    settings = {reply.number: reply.value for reply in heard if isinstance(reply, Setting)}
    sizes = next((reply for reply in heard if isinstance(reply, Sizes)), None)
    own = _own_limits(profile, settings)
    for name, value in own.items():
        said = getattr(profile.limits, name)
        if abs(value - said) > 1e-3 * abs(said):
            log(f"{name.replace('_', ' ')}: the plotter's own {value:g} instead of the profile's {said:g}.")
    pen, bed, port = profile.pen, profile.bed, profile.port
    if pen.lift == "z" and {112, 122} <= settings.keys():
        z_speed, z_acceleration = Speed(min(pen.z_speed, settings[112] / 60)), Acceleration(settings[122])
        pen = msgspec.structs.replace(pen, z_speed=z_speed, z_acceleration=z_acceleration)
    if settings.get(32) and pen.lift == "servo":
        log("Laser mode is on ($32=1): a servo may twitch on moves; switch it off with $32=0.")
    if settings.get(20) and {130, 131} <= settings.keys():
        width, height = Length(min(bed.width, settings[130])), Length(min(bed.height, settings[131]))
        bed = msgspec.structs.replace(bed, width=width, height=height)
    if sizes is not None:
        port = msgspec.structs.replace(port, queue=sizes.queue, buffer=sizes.buffer)
    limits = msgspec.structs.replace(profile.limits, **own)
    return msgspec.structs.replace(profile, bed=bed, limits=limits, pen=pen, port=port)


def _own_limits(profile: Plotter, settings: dict[int, float]) -> dict[str, float]:
    """What the machine says in place of keys of the profile's `limits`."""
    limits = profile.limits
    own: dict[str, float] = {}
    if {110, 111} <= settings.keys():
        fastest = min(settings[110], settings[111]) / 60
        own["draw_speed"] = Speed(min(limits.draw_speed, fastest))
        own["travel_speed"] = Speed(min(limits.travel_speed, fastest))
    if {120, 121} <= settings.keys():
        own["acceleration"] = Acceleration(min(settings[120], settings[121]))
    if 11 in settings:
        own["junction_deviation"] = Length(settings[11])
    if 100 in settings:
        own["steps_per_mm"] = settings[100]
    return own
