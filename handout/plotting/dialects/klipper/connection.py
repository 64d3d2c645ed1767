"""Connecting to Klipper through Moonraker: is it ready, has it what the pen needs, and what are its limits?"""

from __future__ import annotations

import math
from typing import Any

import msgspec

from handout.errors import DeviceAlarm
from handout.plotting import bed
from handout.plotting.dialect import Log
from handout.plotting.dialects.base import with_limits
from handout.plotting.dialects.klipper.conversation import MoonrakerConversation, first_line
from handout.profiles import Acceleration, Bed, Length, Limits, Plotter, Speed

_STARTS = 40.0  # s that Klipper may take to start
_LOOK = 0.5  # s between two looks at one that starts
_GOES = 5.0  # s that it may take until it begins to start anew; half a second was seen
_QUESTIONS = {
    "toolhead": None, "gcode_move": None, "configfile": ["settings"], "print_stats": ["state", "filename"],
}  # fmt: skip


def meet(conversation: MoonrakerConversation, profile: Plotter, log: Log) -> tuple[Plotter, float]:
    """See that Klipper is ready, and read its settings; it does not move.

    Returns the profile with the machine's own limits, where `log` is told that they differ; and its acceleration,
    mm/s².
    """
    state, why = conversation.state()
    if state == "shutdown":
        log(f"Klipper was shut down ({first_line(why)}); it is started anew (FIRMWARE_RESTART).")
        restart(conversation)
        if profile.pen.lift == "stepper":
            log(
                f"It takes the place where the motor of [manual_stepper {profile.pen.name}] stands for 0 now: if the "
                "pen is not on the paper there, interrupt, turn the motor down to it, and restart Klipper at its page."
            )
    elif state != "ready":
        log(f"Klipper is not ready ({first_line(why)}); it may take up to {_STARTS:.0f} s to start.")
        _wait_until_ready(conversation)
    _check_pen(conversation, profile)
    answer = conversation.result("printer.objects.query", {"objects": _QUESTIONS})
    found = answer.get("status", {}) if isinstance(answer, dict) else {}
    head, settings = found.get("toolhead", {}), found.get("configfile", {}).get("settings", {})
    print_ = found.get("print_stats", {})
    if print_.get("state") in ("printing", "paused"):  # it obeys whoever asks, even in the middle of a file
        raise DeviceAlarm(
            f"Klipper is {print_['state']} with the file {print_.get('filename') or '?'}: wait until that is done, or "
            "cancel it at its page in the browser."
        )
    acceleration = float(head.get("max_accel", profile.limits.acceleration))
    limits = _limits(profile, head, settings, log)
    pen = profile.pen
    if pen.lift == "z" and "max_z_velocity" in (own := settings.get("printer", {})):
        pen = msgspec.structs.replace(
            pen,
            z_speed=Speed(min(pen.z_speed, float(own["max_z_velocity"]))),
            z_acceleration=Acceleration(float(own.get("max_z_accel", pen.z_acceleration))),
        )
    machine = msgspec.structs.replace(profile, limits=limits, pen=pen, bed=_own_bed(profile, head, found))
    return machine, acceleration


def restart(conversation: MoonrakerConversation) -> None:
    """Have Klipper, which is shut down, and its board start anew, and wait until it is ready."""
    conversation.result("printer.firmware_restart", patience=_STARTS)
    _wait_until_ready(conversation, goes=_GOES)


def _wait_until_ready(conversation: MoonrakerConversation, goes: float = 0.0) -> None:
    """Wait until it has started; before that it may say for `goes` s that it is shut down."""
    begun = conversation.time
    while conversation.time < begun + _STARTS:
        state, why = conversation.state()
        if state == "ready":
            return
        if state in ("error", "shutdown") and conversation.time >= begun + goes:
            break
        goes *= state == "shutdown"
        for replies in conversation.listen(_LOOK, _LOOK):
            del replies  # it says that it is ready; that is asked for
    raise DeviceAlarm(f"Klipper is not ready ({first_line(why)}): look at its page in the browser.")


def _check_pen(conversation: MoonrakerConversation, profile: Plotter) -> None:
    """What moves the pen must be in Klipper's printer.cfg."""
    listed = conversation.result("printer.objects.list")
    objects = [str(name).lower() for name in listed.get("objects", [])] if isinstance(listed, dict) else []
    pen = profile.pen
    kind = {"servo": "servo", "stepper": "manual_stepper"}.get(pen.lift)
    if kind is not None and objects and f"{kind} {pen.name}" not in objects:
        there = ", ".join(name.split()[1] for name in objects if name.startswith(f"{kind} ")) or "none"
        raise DeviceAlarm(
            f"Klipper's printer.cfg has no [{kind} {pen.name}] (of this kind it has: {there}): add it, or set pen.name "
            "in the profile."
        )


def _limits(profile: Plotter, head: dict[str, Any], settings: dict[str, Any], log: Log) -> Limits:
    """The machine's own limits; of speeds the lesser, all else is the machine's."""
    limits, values = profile.limits, dict[str, float]()
    if "max_velocity" in head:
        fastest = float(head["max_velocity"])
        values["draw_speed"] = Speed(min(limits.draw_speed, fastest))
        values["travel_speed"] = Speed(min(limits.travel_speed, fastest))
    if "max_accel" in head:
        values["acceleration"] = Acceleration(float(head["max_accel"]))
        if "square_corner_velocity" in head:
            corner = float(head["square_corner_velocity"])
            values["junction_deviation"] = Length(corner**2 * (math.sqrt(2.0) - 1.0) / values["acceleration"])
    stepper = settings.get("stepper_x", {})
    if isinstance(distance := stepper.get("rotation_distance"), int | float) and distance > 0:
        steps = float(stepper.get("microsteps", 16)) * float(stepper.get("full_steps_per_rotation", 200))
        for driven, driving in stepper.get("gear_ratio") or []:
            steps *= float(driven) / float(driving)
        values["steps_per_mm"] = steps / distance
    others = {
        name: value for name, value in values.items() if not math.isclose(value, getattr(limits, name), rel_tol=1e-3)
    }
    return with_limits(profile, others, log)


def _own_bed(profile: Plotter, head: dict[str, Any], found: dict[str, Any]) -> Bed:
    """The part of the bed that the ends of its axes leave, in the coordinates of a program."""
    ends: list[Any] = [head.get("axis_minimum"), head.get("axis_maximum")]
    move = found.get("gcode_move", {})
    if not all(isinstance(end, list) and len(end) >= 2 for end in ends):
        return profile.bed
    shifts = move["homing_origin"] if profile.bed.zero == "kept" and "homing_origin" in move else (0.0, 0.0)
    low, high = ([float(end[axis]) - float(shifts[axis]) for axis in (0, 1)] for end in ends)
    refusals = [
        f"Klipper's axes (position_min, position_max of [stepper_{name}]) leave {{}} of a page laid at 0: set "
        "bed.origin and the size of the bed in the profile."
        for name in "xy"
    ]
    return bed.narrow(profile, list(zip(low, high, strict=True)), refusals)
