"""A conversation with an EBB: every command and question is answered, in order; what each answer belongs to is kept.

Besides, what is asked of a board when it is met: which firmware it has, whether it has done what it was told before,
whether its motors have power, and whether it can know where it stands.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import msgspec

from handout.errors import DeviceAlarm, DeviceGarbled, DeviceSilent
from handout.plotting.dialects import Log
from handout.plotting.dialects.base import GLANCE, Conversation, silence_error
from handout.plotting.dialects.ebb import protocol
from handout.plotting.dialects.ebb.protocol import About, Error, Note, Ok, Reply, Values
from handout.plotting.dialects.ebb.stepping import CURRENT, ENABLED, MOTION, POSITION, SIGNED, UNKNOWN
from handout.plotting.ports import Port
from handout.profiles import Plotter

_MOMENT = 0.005  # s between two looks whether it is done
_RECENT = 12  # commands that may have been answered and not be done
_ONE_LINE = frozenset({"V", "QM", "QG"})  # questions that are not followed by OK in the old form
_VOLTS = 7.5  # less is no power supply, only what comes through USB
REST = b"SM,1,0,0\r"  # 1 ms; old boards have to be told one to find out that what came before it is done
QUEUE = 8  # commands in the queue of firmware 3, which has one unless it is told otherwise
_GARBLED = "Use a shorter cable, and no hub."


class Asked(NamedTuple):
    """A request that is not yet answered.  number : of the command in the program; −1: it is none."""

    data: bytes
    name: str
    number: int
    seconds: float

    @property
    def has_values(self) -> bool:
        """Whether its answer may hold numbers."""
        return self.name in ("V", "ES") or self.name.startswith("Q")


Answered = Callable[[Asked, tuple[int, ...]], None]


class EbbConversation(Conversation[Reply]):
    """A port with a board behind it.

    Its methods raise DeviceSilent when nothing is answered or an answer was lost, DeviceAlarm when the board refuses a
    command or stops, PortError when the connection breaks.

    answered : told what has been answered, with the numbers that came.

    open : what is not answered yet, in order.
    uniform : whether the board answers in one form (``CU,10,1``).
    struck : whether it has stopped at a limit switch.
    version : of its firmware; unknown until it has been met.
    """

    line_end = re.compile(rb"[\r\n]+")

    def __init__(self, port: Port, timeout: float, log: Log, answered: Answered) -> None:
        super().__init__(port, timeout, log, protocol.reply)
        self.answered, self.version = answered, UNKNOWN
        self.open: deque[Asked] = deque()
        self.uniform = self.struck = False
        self._numbers: tuple[int, ...] = ()
        self._recent: deque[float] = deque([0.0], maxlen=_RECENT)

    def send_request(self, data: bytes, number: int = -1) -> None:
        """Send a command or a question."""
        self.port.write(data)
        name = data[:-1].split(b",")[0].decode("ascii")
        self.open.append(Asked(data, name, number, protocol.seconds(data)))

    def hear(self) -> None:
        """Wait for the next answers and act on them."""
        most, glance = self.allowance, self.glance
        end = self.time + most
        while self.time < end:
            if self.heed_answers(glance):
                return
        raise silence_error(f"{most:.0f}")

    def heed_answers(self, patience: float) -> bool:
        """Act on what is said within `patience` s; whether anything was."""
        replies = self.replies(patience)
        for reply in replies:
            self._take(reply)
        return bool(replies)

    @property
    def allowance(self) -> float:
        """The longest time that it may need for all commands that were sent, s."""
        return self.timeout + sum(asked.seconds for asked in self.open) + sum(self._recent)

    def ask(self, data: bytes) -> tuple[int, ...]:
        """Send a request and wait until it and all before it are answered; returns the numbers of its answer."""
        self.send_request(data)
        self.drain()
        return self._numbers

    def drain(self) -> None:
        """Wait until everything is answered."""
        while self.open:
            self.hear()

    def _take(self, reply: Reply) -> None:
        if isinstance(reply, Error):
            command = self.open[0].data.decode("ascii").strip() if self.open else "a command"
            raise DeviceGarbled(f"The plotter refused {command!r}: {reply.description}.")
        if isinstance(reply, Note):
            if reply.text.startswith("Limit switch"):
                self.struck = True
                raise DeviceAlarm(
                    "The plotter stopped at a limit switch and no longer knows where it is: bring it back to its zero."
                )
            return
        if isinstance(reply, About):
            self.uniform = reply.uniform
        if self.open:
            self._take_answer(self.open[0], reply)

    def _take_answer(self, asked: Asked, reply: Ok | About | Values) -> None:
        """Match a reply with the oldest open command, which ends with one line, or with numbers and an OK."""
        if isinstance(reply, Values):
            if not asked.has_values or (reply.name and reply.name != asked.name):
                raise DeviceSilent(
                    "The plotter has answered a later command before an earlier one: an answer was lost on the way; "
                    "use a shorter cable, and no hub."
                )
            self._numbers = reply.numbers
            answered = self.uniform or asked.name in _ONE_LINE
        else:
            answered = isinstance(reply, About) or asked.name not in _ONE_LINE
            if answered and not asked.has_values:
                self._numbers = ()
        if answered:
            self._recent.append(self.open.popleft().seconds)
            self.answered(asked, self._numbers)

    def meet(self, profile: Plotter) -> Plotter:
        """Find out the firmware; the profile with it.  DeviceSilent: nothing answers, or something that is no EBB."""
        about = self._introduction(profile)
        self.version, self.uniform = about.version, about.uniform
        end = self.time + profile.port.timeout
        while self.replies(min(GLANCE, 0.05)) and self.time < end:
            pass  # answers to what was sent by whoever spoke to it before
        return msgspec.structs.replace(profile, firmware=str(about.version))

    def _introduction(self, profile: Plotter) -> About:
        garbage, end = False, self.time + profile.port.timeout
        while self.time < end:
            self.port.write(b"V\r")  # ends, and spoils, whatever was begun before a cable was pulled
            for _ in range(4):
                replies = self.replies(GLANCE)
                if abouts := [reply for reply in replies if isinstance(reply, About)]:
                    return abouts[0]
                garbage |= bool(replies)
        if garbage:
            raise DeviceSilent(
                "Something answers, but not as an EBB does: check the port, and the dialect in the profile."
            )
        raise DeviceSilent(
            f"The plotter does not answer within {profile.port.timeout:g} s: is this its port, is its cable plugged "
            "in, and is no other program connected to it?"
        )

    def settle(self) -> None:
        """Wait until all that was sent before is done; a rest is answered when it and one more command are left.

        Raises DeviceGarbled if that takes longer than anything that it was told.
        """
        if self.version < MOTION:
            for _ in range(3):
                self.ask(REST)
            return
        begun, most = self.time, self.allowance
        while self.ask(b"QM\r")[:1] != (0,):
            if (waited := self.time - begun) > most:
                raise DeviceGarbled(
                    f"The plotter is still busy {waited:.0f} s after its last command, which was to take less: a "
                    f"command came over wrong. {_GARBLED}"
                )
            self.heed_answers(_MOMENT)

    def ask_power(self) -> None:
        """See that the motors have power."""
        if self.version >= CURRENT:
            check_power(self.ask(b"QC\r"))

    def has_rested(self) -> bool:
        """Whether its motors have been off or might have been, so that the carriage may be anywhere.

        Boards that cannot say are taken at the word of their counters: not zero, they have been driven from it.
        """
        if self.version >= ENABLED:
            return self.has_other_steps()
        return self.version < POSITION or self.ask(b"QS\r") == (0, 0)

    def has_other_steps(self) -> bool:
        """Whether its motors do not make steps of a sixteenth, as far as it can tell."""
        return self.version >= ENABLED and self.ask(b"QE\r") != (16, 16)

    def lengthen_queue(self) -> int:
        """Make the queue longer if that is possible; returns how many commands it holds."""
        if self.version < SIGNED or self.version == UNKNOWN:
            return 1
        self.ask(f"CU,4,{QUEUE}\r".encode("ascii"))
        return QUEUE


def check_power(numbers: tuple[int, ...]) -> None:
    """Raise DeviceAlarm if the answer to QC says that the motors have no power.

    The second number is the voltage of the power supply behind a diode (0.3 V) and a divider (9.2), 3.3 V being 1023.
    """
    if len(numbers) < 2:
        return
    volts = numbers[1] / 1023 * 3.3 * 9.2 + 0.3
    if volts < _VOLTS:
        raise DeviceAlarm(
            f"The plotter's motors have no power ({volts:.1f} V): plug in its power supply and switch it on; "
            "the USB cable alone does not move it."
        )
