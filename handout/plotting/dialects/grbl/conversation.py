"""A conversation with a GRBL controller: lines out by counting characters, replies in, silence noticed; and connecting.

A controller has a receive buffer of a few bytes and says nothing when it overflows.  So every line under way is
remembered with its length until its ``ok`` comes, and no line is sent that the buffer might not hold.  While it writes
into its memory it hears nothing at all: a line that makes it do so is sent alone.

`connect_grbl` finds out whether it is there, has kept its place and is locked, and what its own limits are.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import msgspec

from handout.errors import DeviceAlarm, DeviceGarbled, DeviceHeld, DeviceSilent
from handout.plotting import bed
from handout.plotting.dialects import Log
from handout.plotting.dialects.base import GLANCE, RESTARTED, Conversation, never_answered, silence_error, with_limits
from handout.plotting.dialects.grbl import protocol
from handout.plotting.dialects.grbl.protocol import (
    Alarm,
    Banner,
    Error,
    Modal,
    Offset,
    Ok,
    Reply,
    Setting,
    Sizes,
    Status,
    Version,
)
from handout.plotting.ports import Port
from handout.profiles import Acceleration, Bed, Length, Plotter, Speed

_LONGEST = 600.0  # s that it may take over one line that is asked alone
_HOMING = 180.0  # s a machine may take to find its switches
_LISTENS = 50.0  # s that answers are listened to for another


class Sent(NamedTuple):
    """A line under way: its number in the program, from 0, and its bytes."""

    number: int
    line: bytes


class GrblConversation(Conversation[Reply]):
    """A port with a GRBL controller behind it.

    Its methods raise DeviceSilent when nothing is answered, or when lines were lost; DeviceAlarm when a line is refused
    or the machine stops; PortError when the connection breaks.

    buffer : bytes the controller can receive before it reads them.

    stopping : whether it is held by us.
    told : called with every state that is heard.
    restarted : whether it has started by itself.
    """

    def __init__(self, port: Port, buffer: int, timeout: float, log: Log) -> None:
        super().__init__(port, timeout, log, protocol.reply)
        self.buffer = buffer
        self.restarted = self.stopping = False
        self.on_status: Callable[[Status], None] = lambda status: None
        self._under_way: deque[Sent] = deque()
        self._bytes = 0
        self._waited = 0.0  # s of silence since a line was answered
        self._stood = 0.0  # s that it has been on hold
        self._held = self._asked = False

    def send(self, sent: Sent, acknowledged: Callable[[Sent], None]) -> None:
        """Send a line as soon as the controller has room for it."""
        alone = protocol.writes_memory(sent.line)
        while self._under_way and (alone or self._bytes + len(sent.line) > self.buffer - 1):
            self.hear(acknowledged)
        self._under_way.append(sent)  # before it is written: an interrupt may come between
        self._bytes += len(sent.line)
        self.port.write(sent.line)
        if alone:
            self.drain(acknowledged)

    def drain(self, acknowledged: Callable[[Sent], None]) -> None:
        """Wait until every line has been acknowledged."""
        while self._under_way:
            self.hear(acknowledged)

    def ask_status(self) -> None:
        """Ask for its state, unless it has been asked and has not answered."""
        if not self._asked:
            self._asked = True
            self.port.write(protocol.STATUS)

    def ask(self, line: bytes, patience: float = 0.0) -> list[Reply]:
        """Send a line alone and wait for its ``ok``; returns all replies until then.

        patience : s to wait without asking for its state, for what it does with deaf ears (homing).
        """
        self.port.write(line)
        self._waited = 0.0
        answer: list[Reply] = []
        while True:
            replies = next(filter(None, self.listen(patience)), None) if patience else self.attend()
            if replies is None:
                raise DeviceSilent(f"The plotter did not finish within {patience:g} s.")
            for reply in replies:
                if isinstance(reply, Error):
                    raise DeviceAlarm(f"The plotter refused {line.decode().strip()!r}: {reply.description}.")
                self._check_stop(reply)
                answer.append(reply)
            if any(isinstance(reply, Ok) for reply in answer):
                return answer
            at_rest = any(isinstance(reply, Status) and reply.state in ("Idle", "Alarm") for reply in answer[-1:])
            if (at_rest and self._waited > self.timeout) or (self._waited > _LONGEST and not self._held):
                raise DeviceSilent(f"The plotter stands or is busy but has not answered {line.decode().strip()!r}.")

    def attend(self, glance: float = GLANCE) -> list[Reply]:
        """The next replies.  A controller that says nothing for the time of a glance, s, is asked for its state.

        Raises DeviceSilent if it does not even answer that.
        """
        begun, glance = self.time, min(glance, self.timeout / 2)
        while self.time < begun + self.timeout:
            before = self.time
            replies = self.replies(glance)
            self._waited += self.time - before
            self._stood += self.time - before
            if replies:
                for reply in replies:
                    if isinstance(reply, Status) and not self.stopping:
                        self._check_hold(reply)
                return replies
            self._asked = True
            self.port.write(protocol.STATUS)
        raise silence_error(f"{self.timeout:g}")

    def hear(self, acknowledged: Callable[[Sent], None], glance: float = GLANCE) -> None:
        """Wait for the next replies and heed them; a controller that says nothing is asked for its state."""
        for reply in self.attend(glance):
            if isinstance(reply, Status):
                self._look(reply)
                continue
            self._waited = 0.0
            if isinstance(reply, Ok):
                if self._under_way:
                    sent = self._under_way.popleft()
                    self._bytes -= len(sent.line)
                    acknowledged(sent)
            elif isinstance(reply, Error):
                where = "a line"
                if self._under_way:
                    where = f"line {self._under_way[0].number + 1}, {self._under_way[0].line.decode().strip()!r}"
                raise DeviceGarbled(f"The plotter refused {where}: {reply.description}.")
            self._check_stop(reply)

    def _check_stop(self, reply: Reply) -> None:
        """Raise DeviceAlarm for an alarm, and for the greeting of one that has started by itself."""
        if isinstance(reply, Alarm):
            raise DeviceAlarm(f"The plotter stopped with {reply.description}.")
        if isinstance(reply, Banner):
            self.restarted = True
            raise DeviceAlarm(RESTARTED)

    def _check_hold(self, status: Status) -> None:
        """See whether somebody holds it, and for how long."""
        if status.state == "Sleep":
            raise DeviceAlarm("The plotter is asleep, its motors without power: switch it off and on, and start again.")
        held = status.state in protocol.HELD
        self._stood = self._stood if held else 0.0
        if held and not self._held:
            self.log(protocol.HELD[status.state])
        self._held = held
        if self._stood > self.patience:
            raise DeviceHeld(
                f"The plotter has been on hold ({status.state}) for {self._stood:.0f} s, and nobody let it go on: "
                "somebody has held it, or a command came over wrong."
            )

    def _look(self, status: Status) -> None:
        """Act on a status: a machine at rest that has not answered all lines has lost something."""
        self._asked = False
        if status.state == "Alarm":
            raise DeviceAlarm("The plotter is locked after an alarm: bring it back to its zero and start again.")
        if status.state != "Idle" or not self._under_way:
            self._waited = 0.0
        if self._waited > self.timeout:
            raise DeviceGarbled(
                "The plotter is at rest but has not answered all lines it was sent: something was lost on the way; "
                "use a shorter or shielded cable."
            )
        self.on_status(status)

    def forget(self) -> None:
        """Forget what is under way (after a reset)."""
        self._under_way.clear()
        self._bytes, self._waited, self._asked = 0, 0.0, False

    def status(self) -> Status:
        """The answer to ``?``."""
        self.port.write(protocol.STATUS)
        end = self.time + _LISTENS
        while self.time < end:
            for reply in self.attend():
                if isinstance(reply, Status):
                    return reply
        raise DeviceSilent("Something answers, but does not say its state as a GRBL controller does: check its port.")

    def reset(self, patience: float, garbage: bool = False) -> None:
        """Soft-reset the controller and wait for its greeting; garbage : something has answered that is not GRBL."""
        self.port.write(protocol.RESET)
        self.forget()
        greeted = False
        for replies in self.listen(patience):
            if greeted and _only_reports(replies):
                return
            greeted |= any(isinstance(reply, Banner) for reply in replies)
            garbage |= bool(replies)
        raise never_answered("GRBL", patience, garbage)

    def home(self) -> None:
        """Let the machine find its zero by its switches."""
        self.log("Homing: the plotter looks for its zero.")
        self.ask(b"$H\n", _HOMING)

    def hear_out(self) -> None:
        """Listen until it is silent, or only reports, as some do by themselves."""
        reports = 0
        for replies in self.listen(_LISTENS):
            reports = reports + 1 if _only_reports(replies) else 0
            if not replies or reports == 2:
                return


def _only_reports(replies: list[Reply]) -> bool:
    return all(isinstance(reply, Status) for reply in replies)


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


def connect_grbl(port: Port, profile: Plotter, log: Log) -> tuple[GrblConversation, Plotter, ControllerInfo]:
    """Wake the controller, unlock it unless it can be homed, read its settings.

    Returns the conversation, ready for lines; the profile with the machine's own limits, where `log` is told that they
    differ; and what the controller said about itself.

    Raises DeviceSilent (nothing answers, or something that is not GRBL), DeviceAlarm (it refuses) or DoesNotFit (its
    own soft limits leave no bed).
    """
    conversation = GrblConversation(port, profile.port.buffer, profile.port.timeout, log)
    restarted = _wake(conversation, profile)
    # ask who it is, again if the first question is refused: half a line from before may stand in front of it
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
