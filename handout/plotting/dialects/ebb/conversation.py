"""A conversation with an EBB: every command and question is answered, in order; what each answer belongs to is kept."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from handout.errors import DeviceAlarm, DeviceGarbled, DeviceSilent
from handout.plotting.dialects.ebb import protocol
from handout.plotting.dialects.ebb.protocol import About, Error, Note, Ok, Reply, Values
from handout.plotting.ports import Port

_GLANCE = 0.25  # s of silence after which the time is looked at
_RECENT = 12  # commands that may have been answered and not be done
_ONE_LINE = frozenset({"V", "QM", "QG"})  # questions that are not followed by OK in the old form


class Asked(NamedTuple):
    """Something sent and not yet answered.  number : which command of a program it is; −1: none of it."""

    data: bytes
    name: str
    number: int
    seconds: float


Answered = Callable[[Asked, tuple[int, ...]], None]


class EbbConversation:
    """A port with a board behind it.

    Its methods raise DeviceSilent when nothing is answered or an answer was lost, DeviceAlarm when the board refuses a
    command or stops, PortError when the connection breaks.

    Parameters
    ----------
    timeout : s of silence before the board is given up, besides the time that its commands take.
    answered : told what has been answered, with the numbers that came.

    Attributes
    ----------
    open : what is not answered yet, in order.
    uniform : whether the board answers in one form (``CU,10,1``).
    struck : whether it has stopped at a limit switch.
    """

    def __init__(self, port: Port, timeout: float, answered: Answered) -> None:
        self.port, self.timeout, self.answered = port, timeout, answered
        self.open: deque[Asked] = deque()
        self.uniform = self.struck = False
        self._partial = b""
        self._numbers: tuple[int, ...] = ()
        self._recent: deque[float] = deque([0.0], maxlen=_RECENT)

    def put(self, data: bytes, number: int = -1) -> None:
        """Send a command or a question."""
        self.port.write(data)
        name = data[:-1].split(b",")[0].decode("ascii")
        self.open.append(Asked(data, name, number, protocol.seconds(data)))

    def replies(self, patience: float) -> list[Reply]:
        """What the board says within `patience` s; returns with the first complete lines, or with none."""
        complete, self._partial = protocol.lines(self._partial + self.port.read(patience))
        return [protocol.reply(line) for line in complete]

    def hear(self) -> None:
        """Wait for the next answers and make sense of them."""
        waited, most = 0.0, self.patience
        glance = min(_GLANCE, self.timeout / 2)
        while waited < most:
            if heard := self.replies(glance):
                for reply in heard:
                    self._take(reply)
                return
            waited += glance
        raise DeviceSilent(
            f"The plotter has not answered for {most:.0f} s: check its cable and its power, and that it moves freely."
        )

    @property
    def patience(self) -> float:
        """s that it may take to do all that it has been told."""
        return self.timeout + sum(asked.seconds for asked in self.open) + sum(self._recent)

    def port_says(self, patience: float) -> bool:
        """Wait a moment, and heed what is said meanwhile; whether anything was."""
        heard = self.replies(patience)
        for reply in heard:
            self._take(reply)
        return bool(heard)

    def ask(self, data: bytes) -> tuple[int, ...]:
        """Send something and wait until it and all before it is answered; the numbers that came with its answer."""
        self.put(data)
        self.drain()
        return self._numbers

    def drain(self) -> None:
        """Wait until everything is answered."""
        while self.open:
            self.hear()

    def _take(self, reply: Reply) -> None:
        if isinstance(reply, Error):
            sent = self.open[0].data.decode("ascii").strip() if self.open else "a command"
            raise DeviceGarbled(f"The plotter refused {sent!r}: {reply.words}.")
        if isinstance(reply, Note) and reply.text.startswith("Limit switch"):
            self.struck = True
            raise DeviceAlarm(
                "The plotter stopped at a limit switch and no longer knows where it is: bring it back to its zero."
            )
        if isinstance(reply, About):
            self.uniform = reply.uniform
        if not self.open or isinstance(reply, Note):
            return
        asked = self.open[0]
        question = asked.name == "V" or asked.name.startswith("Q") or asked.name == "ES"
        if isinstance(reply, Values):
            if not question or (reply.name and reply.name != asked.name):
                raise DeviceSilent(
                    "The plotter has answered a later command before an earlier one: an answer was lost on the way; "
                    "use a shorter cable, and no hub."
                )
            self._numbers = reply.numbers
            if self.uniform or asked.name in _ONE_LINE:
                self._done()
        elif isinstance(reply, (Ok, About)) and not (isinstance(reply, Ok) and asked.name in _ONE_LINE):
            self._numbers = self._numbers if question else ()
            self._done()

    def _done(self) -> None:
        asked = self.open.popleft()
        self._recent.append(asked.seconds)
        self.answered(asked, self._numbers)
