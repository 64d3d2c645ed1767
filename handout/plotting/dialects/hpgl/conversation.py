"""A conversation with an HP-GL plotter: its questions asked one at a time, and whether a person holds it.

Two answers must never be under way at once: the plotter takes that for an error and ignores the second question.
Instructions are written whole, and no question comes between their bytes.

Source: Hewlett-Packard 1983, interfacing and programming of the HP 7475A, and the same of the 7470A (device control).
"""

from __future__ import annotations

import re

from handout.errors import DeviceAlarm, DeviceGarbled, DeviceHeld, DeviceSilent
from handout.plotting.dialect import Log
from handout.plotting.dialects.base import GLANCE, Conversation
from handout.plotting.dialects.hpgl import protocol
from handout.plotting.ports import Port

_MOMENT = 0.05  # s between two moments in which old answers are listened for
_DREGS = 2.0  # s that old answers are listened for at most
_ANSWER = 80  # bytes that no answer has
_NO_PLOTTER = "Something answers, but not as an HP-GL plotter does: check baud, parity and dialect in the profile."
STARTED = "The plotter was switched off and on in between: load its paper as it was, and check its power."
_STATE = re.compile(rb"(?<![\d,])(\d+)[\r\n]")  # a number alone on its line
_END = re.compile(rb"[\r\n]")


class HpglConversation(Conversation[bytes]):
    """A port with a plotter behind it that speaks only when it is asked.

    restarted : whether it was off since its last plot; held : whether it is on hold.
    """

    def __init__(self, port: Port, timeout: float, log: Log) -> None:
        super().__init__(port, timeout, log, bytes)
        self.restarted = self.held = False
        self._stood = 0.0  # s that it has been on hold
        self._marked = False  # whether its answers end in a way that it forgets when it is switched off

    def ask(self, question: bytes, patience: float = 0.0, count: int = 1) -> tuple[float, ...]:
        """Ask for `count` numbers."""
        numbers = protocol.numbers(self.hear(question, patience))
        if numbers is None or len(numbers) != count:
            raise DeviceSilent(_NO_PLOTTER)
        return numbers

    def hear(self, question: bytes, patience: float = 0.0) -> bytes:
        """Ask, and wait for the answer, without its end."""
        self.port.write(question)
        begun, patience = self.time, patience or self.timeout
        while not (end := _END.search(self._partial)):
            waited = self.time - begun
            if len(self._partial) > _ANSWER or (waited > patience and self._partial):
                raise DeviceSilent(_NO_PLOTTER)
            if waited > patience and question.startswith(b"O") and self._is_held():
                self.pass_time(waited)
                begun = self.time
            elif waited > patience:
                raise DeviceSilent(
                    f"The plotter has not answered for {patience:g} s: check its cable and its power, that it listens "
                    "to this port, and its baud rate."
                )
            self._partial = (self._partial + self.read(GLANCE)).lstrip(b"\r\n")
        answer, self._partial = self._partial[: end.start()], self._partial[end.end() :].lstrip(b"\r\n")
        if self._marked and end.group() == b"\r":
            self.restarted, self._marked = True, False
            raise DeviceAlarm(STARTED)
        self._marked |= question == protocol.STATE and end.group() == b"\n"
        return answer.strip()

    def _is_held(self) -> bool:
        """Whether it is on hold; an answer that it still owes may come before the one to this question."""
        self.port.write(protocol.STATE)
        end = self.time + self.timeout
        while self.time < end:
            self._partial += self.read(GLANCE)
            if match := _STATE.search(self._partial):
                self._partial = self._partial[: match.start()] + self._partial[match.end() :]
                self._note_hold(bool(int(match.group(1)) & protocol.VIEWING))
                return self.held
        return False

    def check_state(self) -> None:
        """Ask whether the lever is raised (DeviceAlarm) or VIEW is pressed."""
        state = int(self.ask(protocol.STATE)[0])
        if state & protocol.LEVER:
            raise DeviceAlarm(
                "The paper lever of the plotter is raised, and the sheet may have moved: load it as it was, and lower "
                "the lever."
            )
        self._note_hold(bool(state & protocol.VIEWING))

    def _note_hold(self, held: bool) -> None:
        if held and not self.held:
            self.log("The plotter is on hold; it goes on when VIEW (or PAUSE) is pressed again.")
        self.held = held

    def check_line(self) -> None:
        """Whether something was lost on the way."""
        number = int(self.ask(protocol.LINE_ERROR)[0])
        if number in (15, 16):
            raise DeviceGarbled(f"Something was lost on the way to the plotter: {protocol.line_error(number)}.")
        if number:
            self.log(f"The plotter reports {protocol.line_error(number)}.")

    def pass_time(self, seconds: float) -> None:
        """Count time on hold; DeviceHeld if it was too long."""
        self._stood = self._stood + seconds if self.held else 0.0
        if self._stood > self.patience:
            raise DeviceHeld(
                f"The plotter has been on hold for {self._stood:.0f} s, and nobody pressed VIEW (or PAUSE) again."
            )

    def forget(self) -> None:
        """Discard answers to earlier questions."""
        end = self.time + _DREGS
        while self.read(_MOMENT) and self.time < end:
            pass
        self._partial = b""
