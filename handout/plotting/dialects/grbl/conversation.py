"""A conversation with a GRBL controller: lines out by counting characters, replies in, silence noticed.

A controller has a receive buffer of a few bytes and says nothing when it overflows.  So every line under way is
remembered with its length until its ``ok`` comes, and no line is sent that the buffer might not hold.  While it writes
into its memory it hears nothing at all: a line that makes it do so is sent alone.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from handout.errors import DeviceAlarm, DeviceGarbled, DeviceHeld, DeviceSilent
from handout.plotting.dialect import Log
from handout.plotting.dialects.base import GLANCE, RESTARTED, Conversation, never_answered, silence_error
from handout.plotting.dialects.grbl import protocol
from handout.plotting.dialects.grbl.protocol import Alarm, Banner, Error, Ok, Reply, Status
from handout.plotting.ports import Port

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

    Parameters
    ----------
    buffer : bytes the controller can receive before it reads them.

    Attributes
    ----------
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
