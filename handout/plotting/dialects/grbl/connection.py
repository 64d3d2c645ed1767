"""Connecting to a GRBL controller: is it there, did it keep its place, is it locked, and what are its own limits?"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field

import msgspec

from handout.errors import DeviceAlarm, DeviceSilent
from handout.plotting import bed
from handout.plotting.dialect import Log
from handout.plotting.dialects.base import GLANCE, with_limits
from handout.plotting.dialects.grbl import protocol
from handout.plotting.dialects.grbl.conversation import GrblConversation
from handout.plotting.dialects.grbl.protocol import Banner, Modal, Offset, Reply, Setting, Sizes, Status, Version
from handout.plotting.ports import Port
from handout.profiles import Acceleration, Bed, Length, Plotter, Speed

_FINISHES = 300.0  # s a machine may take to finish what another conversation left it to do


@dataclass
class ControllerInfo:
    """What a controller said about itself.

    uninterrupted : whether it has not restarted since it was last driven, so that it may still know its place.
    offset : mm, what its program's coordinates lie away from the machine's; empty: it does not say.
    place : mm, where it stands, in the machine's coordinates; empty: it does not say.
    """

    version: str = ""
    uninterrupted: bool = False
    locked: bool = False
    offset: tuple[float, ...] = ()
    place: tuple[float, ...] = ()
    sizes: Sizes | None = None
    settings: dict[int, float] = field(default_factory=dict)

    @property
    def scale(self) -> float:
        """Millimetres in the unit of its reports, which are inches with ``$13=1``."""
        return 25.4 if self.settings.get(13) else 1.0

    def note(self, replies: list[Reply]) -> None:
        """Take in answers to ``$I``, ``$$``, ``$G``, ``$#``."""
        offsets = {reply.name: reply.place for reply in replies if isinstance(reply, Offset)}
        systems = ["G54"]
        for reply in replies:
            if isinstance(reply, Setting):
                self.settings[reply.number] = reply.value
            elif isinstance(reply, Sizes):
                self.sizes = reply
            elif isinstance(reply, Version):
                self.version = reply.text
            elif isinstance(reply, Modal):
                self.uninterrupted = not {"F0", "F0.0"} & set(reply.words)
                systems = [word for word in reply.words if word in protocol.SYSTEMS] or systems
        if (offset := offsets.get(systems[0])) is not None:
            more = offsets.get("G92", (0.0,) * len(offset))
            self.offset = tuple((a + b) * self.scale for a, b in zip(offset, more, strict=True))


def connect(port: Port, profile: Plotter, log: Log) -> tuple[GrblConversation, Plotter, ControllerInfo]:
    """Wake the controller, unlock it unless it can be homed, read its settings.

    Returns the conversation, ready for lines; the profile with the machine's own limits, where `log` is told that they
    differ; and what the controller said about itself.

    Raises DeviceSilent (nothing answers, or something that is not GRBL), DeviceAlarm (it refuses) or DoesNotFit (its
    own soft limits leave no bed).
    """
    conversation = GrblConversation(port, profile.port.buffer, profile.port.timeout, log)
    restarted = _wake(conversation, profile)
    info = _questions(conversation)
    info.uninterrupted &= not restarted
    status = conversation.status()
    info.locked, info.place = status.state == "Alarm", tuple(at * info.scale for at in status.field("MPos"))
    if info.sizes is None and len(free := status.field("Bf")) == 2 and status.state in ("Idle", "Alarm"):
        info.sizes = Sizes(int(free[0]), int(free[1]))  # nothing is in its hands: all it has is free
    machine = with_settings(profile, info, log)
    conversation.buffer = machine.port.buffer
    _unlock(conversation, profile, info, log)
    return conversation, machine, info


def _wake(conversation: GrblConversation, profile: Plotter) -> bool:
    """Wait for a greeting, or for the status of a controller that is awake already; whether it has just started.

    On a network a greeting may be for the one who has connected.
    """
    garbage = False
    for replies in conversation.listen(profile.port.start_up):
        if any(isinstance(reply, Banner) for reply in replies):
            conversation.hear_out()
            return not getattr(conversation.port, "greets", False)
        if states := [reply for reply in replies if isinstance(reply, Status)]:
            _let_finish(conversation, states[-1])
            return False
        garbage |= bool(replies)
        conversation.port.write(protocol.STATUS)
    conversation.reset(profile.port.timeout, garbage)
    return True


def _let_finish(conversation: GrblConversation, status: Status) -> None:
    """Let it finish what it was left doing, for a reset would lose its place."""
    end, announced = conversation.time + _FINISHES, False
    while status.state not in ("Idle", "Alarm"):
        if status.state in (*protocol.HELD, "Sleep"):  # from which only a reset wakes it
            conversation.reset(conversation.timeout)
            return
        if not announced:
            conversation.log("The plotter is still busy with what it was sent before; waiting until it stands.")
            announced = True
        if conversation.time > end:
            raise DeviceSilent(f"The plotter did not come to rest within {_FINISHES:g} s: stop it, and start again.")
        conversation.port.write(protocol.STATUS)
        for reply in conversation.attend():
            status = reply if isinstance(reply, Status) else status
        conversation.replies(GLANCE)
    conversation.hear_out()  # what it still has to say to somebody else


def _questions(conversation: GrblConversation) -> ControllerInfo:
    """Ask who it is, again if the first question is refused: half a line from before may stand in front of it."""
    info = ControllerInfo()
    for _ in range(3):
        with contextlib.suppress(DeviceAlarm):
            info.note(conversation.ask(b"$I\n"))
            break
    if "FluidNC" in info.version:  # which reports by itself where it was told to, on a WebSocket always
        with contextlib.suppress(DeviceAlarm):
            conversation.ask(b"$RI=0\n")
    info.note(conversation.ask(b"$$\n"))
    info.note(conversation.ask(b"$G\n") + conversation.ask(b"$#\n"))
    return info


def _unlock(conversation: GrblConversation, profile: Plotter, info: ControllerInfo, log: Log) -> None:
    if profile.homing or not info.locked:
        return
    if info.settings.get(22, 0) % 2:
        log(
            "The plotter wants to be homed after it was switched on ($22=1), but its profile says that it cannot "
            "(homing = false); it is unlocked ($X): make sure that its zero is where the profile says."
        )
    else:
        log("The plotter was locked and is unlocked ($X): make sure that its zero is where the profile says.")
    conversation.ask(b"$X\n")


def with_settings(profile: Plotter, info: ControllerInfo, log: Log) -> Plotter:
    """The profile with what ``$$`` and ``$I`` said; `log` is told about every difference that changes the motion.

    Speeds are the lesser of the two, the travel only counts with soft limits on (``$20=1``), all else is the machine's.
    """
    settings, pen, port = info.settings, profile.pen, profile.port
    limits = with_limits(profile, _own_limits(profile, settings), log)
    if pen.lift == "z" and {112, 122} <= settings.keys():
        z_speed, z_acceleration = Speed(min(pen.z_speed, settings[112] / 60)), Acceleration(settings[122])
        pen = msgspec.structs.replace(pen, z_speed=z_speed, z_acceleration=z_acceleration)
    if settings.get(32) and pen.lift == "servo":
        log("Laser mode is on ($32=1): a servo may twitch on moves; switch it off with $32=0.")
    if info.sizes is not None:
        port = msgspec.structs.replace(port, queue=info.sizes.queue, buffer=info.sizes.buffer)
    return msgspec.structs.replace(profile, bed=_own_bed(profile, info), limits=limits, pen=pen, port=port)


def _own_limits(profile: Plotter, settings: dict[int, float]) -> dict[str, float]:
    """The machine's own values of keys of the profile's `limits`."""
    limits = profile.limits
    values: dict[str, float] = {}
    if {110, 111} <= settings.keys():
        fastest = min(settings[110], settings[111]) / 60
        values["draw_speed"] = Speed(min(limits.draw_speed, fastest))
        values["travel_speed"] = Speed(min(limits.travel_speed, fastest))
    if {120, 121} <= settings.keys():
        values["acceleration"] = Acceleration(min(settings[120], settings[121]))
    if 11 in settings:
        values["junction_deviation"] = Length(settings[11])
    if 100 in settings:
        values["steps_per_mm"] = settings[100]
    return values


def _own_bed(profile: Plotter, info: ControllerInfo) -> Bed:
    """The part of the bed that soft limits (``$20=1``) leave.

    Machine coordinates run from −travel to 0 (with the option Z of ``$I``, from 0 to travel where ``$23`` says so); a
    plot's coordinates lie the machine's offset (G54, G92) away from them.
    """
    settings = info.settings
    if not settings.get(20) or not {130, 131} <= settings.keys():
        return profile.bed
    ends, travels = [], (settings[130], settings[131])
    for axis, travel in enumerate(travels):
        ahead = info.sizes is not None and info.sizes.forward and int(settings.get(23, 0)) >> axis & 1
        zero = info.offset if profile.bed.zero == "kept" else info.place
        shift = zero[axis] if len(zero) > axis else 0.0
        low, high = (0.0, travel) if ahead else (-travel, 0.0)
        ends.append((low - shift, high - shift))
    refusals = [
        f"The plotter's soft limits ($20=1, ${130 + axis}={travel:g}) leave {{}} of a page laid at 0: set its work "
        "zero (G54) to that corner or switch them off ($20=0)."
        for axis, travel in enumerate(travels)
    ]
    return bed.narrow(profile, ends, refusals)
