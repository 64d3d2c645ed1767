"""A conversation with Moonraker: requests out, answers and notices in, one script of G-code under way at a time.

A script is answered when Klipper has taken its last line, which takes as long as Klipper has two seconds of motion in
hand.  Klipper does not say in which order it obeys scripts of several requests, and a script whose answer is lost may
have been obeyed: so no second is sent before the first is answered, and none twice.  Questions are answered meanwhile.

`meet_klipper` finds out whether it is ready, has what the pen needs, and what its limits are.
"""

from __future__ import annotations

import math
import re
from typing import Any

import msgspec

from handout.errors import DeviceAlarm, DeviceSilent
from handout.plotting import bed
from handout.plotting.dialects import Log
from handout.plotting.dialects.base import Conversation, never_answered, silence_error, with_limits
from handout.plotting.dialects.klipper import protocol
from handout.plotting.dialects.klipper.protocol import Answer, Failure, Notice, Reply, Status
from handout.plotting.ports import Port
from handout.profiles import Acceleration, Bed, Length, Limits, Plotter, Speed

_AGAIN = 1.0  # s without a word after which a question counts as lost
_LONGEST = 600.0  # s that one script may take
_UNKNOWN = re.compile(r'Unknown command:\s*"([^"\s]+)')


class MoonrakerConversation(Conversation[Reply]):
    """A port with Moonraker behind it.

    Its methods raise DeviceSilent when nothing is answered; DeviceAlarm when Klipper refuses a line, shuts down or
    starts anew; PortError when the connection breaks.

    script : number of the request whose script is under way; 0: none is.
    fallen : Klipper has shut down, or started anew: what it had in hand is lost.
    """

    def __init__(self, port: Port, timeout: float, log: Log) -> None:
        super().__init__(port, timeout, log, protocol.reply)
        self.script = 0
        self.fallen = False
        self._number = 0
        self._lines = ""  # of the last script
        self._question = 0  # number of the question for its status that is not answered yet
        self._quiet = self._asked = 0.0  # s of silence; when it was asked last

    def request(self, method: str, parameters: dict[str, Any] | None = None) -> int:
        """Send a request; returns its number."""
        self._number += 1
        self.port.write(protocol.request(self._number, method, parameters))
        return self._number

    def send(self, lines: bytes) -> None:
        """Send a script; the one before has been answered."""
        self.script = self._number + 1  # before it is written: an interrupt may come between
        self._lines = lines.decode("ascii").rstrip("\n")
        self.request("printer.gcode.script", {"script": self._lines})

    def ask_status(self) -> None:
        """Ask how Klipper is, unless it has been asked and has not answered."""
        if not self._question:
            self._question = self._number + 1
            self.request("printer.objects.query", {"objects": protocol.ASKED})

    def hear(self, patience: float) -> list[Status]:
        """Heed the messages of `patience` s and return its reports; a silent machine is asked for its state."""
        begun = self.time
        replies = self.replies(min(patience, self.glance))
        if not replies:
            self._quiet += self.time - begun
            if self._quiet > self.timeout:
                raise silence_error(f"{self._quiet:g}")
            if self._quiet - self._asked >= _AGAIN:
                self._asked, self._question = self._quiet, 0
            self.ask_status()
            return []
        self._quiet = self._asked = 0.0
        return [told for reply in replies if (told := self._heed_reply(reply)) is not None]

    def _heed_reply(self, reply: Reply) -> Status | None:
        if isinstance(reply, Notice):
            self._note(reply)
        elif isinstance(reply, Failure):
            if reply.number == self.script and self.script:
                self.script = 0
                state, why = self.state()
                if state != "ready":  # it may be told no sooner than this
                    self._fell(why)
                raise DeviceAlarm(f"Klipper refused a line: {first_line(reply.text)}.")
            if reply.number == self._question:
                self._question = 0
        elif reply.number == self.script and self.script:
            self.script = 0
        elif reply.number == self._question and self._question:
            self._question = 0
            told = protocol.status(reply.result)
            if told.state != "ready":
                self._fell(told.message)
            return told
        return None

    def _note(self, notice: Notice) -> None:
        if notice.kind in ("shutdown", "disconnected"):
            self._fell(self.state()[1] if notice.kind == "shutdown" else "it is starting anew")
        unknown = _UNKNOWN.search(notice.text) if notice.kind == "response" else None
        if unknown and unknown[1] in self._lines.upper():  # another program may have said another
            raise DeviceAlarm(
                f"Klipper does not know a line ({first_line(notice.text)}): its printer.cfg lacks the section that has "
                "it (servo, manual_stepper, gcode_macro, or force_move with enable_force_move)."
            )

    def _fell(self, why: str) -> None:
        self.fallen = True
        reason = f" ({first_line(why)})" if why else ""
        raise DeviceAlarm(
            f"Klipper has stopped{reason} and no longer knows where it is: look at its page in the browser, and bring "
            "the pen back to its zero."
        )

    def state(self) -> tuple[str, str]:
        """ "ready", "startup", "shutdown", "error" or "disconnected", and why, as Klipper itself says now."""
        info = self.result("printer.info")
        if not isinstance(info, dict):
            return "disconnected", "Moonraker does not reach it"
        return str(info.get("state")), str(info.get("state_message", ""))

    def status(self) -> Status:
        """How Klipper is."""
        self._question, end = 0, self.time + 2 * self.timeout  # it may say other things first
        while self.time < end:
            self.ask_status()
            if told := self.hear(self.glance):
                return told[-1]
        raise silence_error(f"{self.timeout:g}")

    def finish_script(self) -> list[Status]:
        """Wait until the script under way is answered; what it says of itself meanwhile."""
        told, begun = list[Status](), self.time
        while self.script:
            told += self.hear(self.glance)
            if (waited := self.time - begun) > _LONGEST:
                raise DeviceSilent(f"Klipper has been busy with one line for {waited:.0f} s: look at its page.")
        return told

    def ask(self, data: bytes) -> list[Status]:
        """Have lines obeyed after those under way; returns what it reports meanwhile."""
        self.finish_script()
        self.send(data)
        return self.finish_script()

    def result(self, method: str, parameters: dict[str, Any] | None = None, patience: float = 0.0) -> Any:
        """The result of a request that is no script; None if it ended with an error.  Notices are not heeded.

        patience : s to wait, the time-out if 0.
        """
        number, garbage = self.request(method, parameters), False
        for replies in self.listen(patience or self.timeout):
            for reply in replies:
                if isinstance(reply, Answer | Failure) and reply.number == number:
                    return reply.result if isinstance(reply, Answer) else None
                garbage |= isinstance(reply, Notice) and reply.kind == "garbage"
        raise never_answered("Moonraker", patience or self.timeout, garbage)


def first_line(text: str) -> str:
    """The first line of a text, without a full stop."""
    return next(iter(text.strip().splitlines()), "it does not say why").strip().rstrip(".")


_STARTS = 40.0  # s that Klipper may take to start
_LOOK = 0.5  # s between two looks at one that starts
_GOES = 5.0  # s that it may take until it begins to start anew; half a second was seen
_QUESTIONS = {
    "toolhead": None, "gcode_move": None, "configfile": ["settings"], "print_stats": ["state", "filename"],
}  # fmt: skip


def meet_klipper(conversation: MoonrakerConversation, profile: Plotter, log: Log) -> tuple[Plotter, float]:
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
