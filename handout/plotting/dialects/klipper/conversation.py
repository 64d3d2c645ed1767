"""A conversation with Moonraker: requests out, answers and notices in, one script of G-code under way at a time.

A script is answered when Klipper has taken its last line, which takes as long as Klipper has two seconds of motion in
hand.  Klipper does not say in which order it obeys scripts of several requests, and a script whose answer is lost may
have been obeyed: so no second is sent before the first is answered, and none twice.  Questions are answered meanwhile.
"""

from __future__ import annotations

import re
from typing import Any

from handout.errors import DeviceAlarm, DeviceSilent
from handout.plotting.dialect import Log
from handout.plotting.dialects.base import Conversation, never_answered, silence_error
from handout.plotting.dialects.klipper import protocol
from handout.plotting.dialects.klipper.protocol import Answer, Failure, Notice, Reply, Status
from handout.plotting.ports import Port

_AGAIN = 1.0  # s without a word after which a question counts as lost
_LONGEST = 600.0  # s that one script may take
_UNKNOWN = re.compile(r'Unknown command:\s*"([^"\s]+)')


class MoonrakerConversation(Conversation[Reply]):
    """A port with Moonraker behind it.

    Its methods raise DeviceSilent when nothing is answered; DeviceAlarm when Klipper refuses a line, shuts down or
    starts anew; PortError when the connection breaks.

    Attributes
    ----------
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
