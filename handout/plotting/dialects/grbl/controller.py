"""A GRBL controller that is connected: commands out, counts in, hold, halt and home."""

from __future__ import annotations

import contextlib
import re

from handout.errors import DeviceError, DeviceSilent
from handout.plotting.blocks import Move, Pen
from handout.plotting.dialect import Log
from handout.plotting.dialects.grbl import connecting, words
from handout.plotting.dialects.grbl.connecting import reset, state
from handout.plotting.dialects.grbl.link import Sent
from handout.plotting.dialects.grbl.words import Status
from handout.plotting.ports import Port
from handout.profiles import Plotter

_AHEAD = 6  # moves that the controller has taken out of its queue and not yet executed, at most
_GLANCE = 16  # lines after which it is asked how full its queue is
_MOMENT = 0.02  # s between two looks at a machine that brakes
_HURRY = 1.0  # s to wait for an answer when something has gone wrong already


class Grbl:
    """The conversation with one machine; a `dialect.Controller`, whose words say what its methods do."""

    def __init__(self, port: Port, profile: Plotter, log: Log) -> None:
        self.log = log
        self.link, self.profile = connecting.connect(port, profile, log)
        self.sent = self.taken = self.executed = 0
        self.queued: int | None = None
        self._asked = False
        self.link.told = self._look

    def send(self, data: bytes) -> None:
        """Write a line as soon as the receive buffer has room for it."""
        self.link.send(Sent(self.sent, data), self._acknowledged)
        self.sent += 1
        if self.sent % _GLANCE == 0:
            self._ask()

    def wait(self) -> None:
        """Hear what it says next; it is asked for its state, of which its queue is a part."""
        self._ask()
        self.link.hear(self._acknowledged)

    def _ask(self) -> None:
        if not self._asked:
            self._asked = True
            self.link.port.write(words.STATUS)

    def finish(self) -> None:
        """Wait until the last line is acknowledged: a pause, which is when the machine stands still."""
        self.link.drain(self._acknowledged)
        self.executed = self.taken

    def _acknowledged(self, sent: Sent) -> None:
        self.taken = sent.number + 1
        self.executed = max(self.executed, self.taken - self.profile.port.queue - _AHEAD)

    def _look(self, status: Status) -> None:
        """Lines that are acknowledged and no longer in its queue have been executed, but for a few under its hands."""
        self._asked = False
        if status.state == "Idle" and self.taken == self.sent:
            self.executed, self.queued = self.taken, 0
        elif free := re.search(r"Bf:(\d+),", status.fields):
            self.queued = max(self.profile.port.queue - int(free.group(1)), 0)
            self.executed = max(self.executed, self.taken - self.queued - _AHEAD)

    def position(self) -> tuple[float, float] | None:
        """Machine coordinates, mm."""
        self.link.port.write(words.STATUS)
        for reply in self.link.attend():
            if isinstance(reply, Status) and (place := re.search(r"MPos:(-?[\d.]+),(-?[\d.]+)", reply.fields)):
                return float(place.group(1)), float(place.group(2))
        return None

    def zero(self) -> None:
        """``G92``, which it forgets with the next reset."""
        self.link.ask(b"G92X0Y0\n")

    def go(self, x: float, y: float) -> None:
        """As the beginning of a program would."""
        way = (Pen(down=False), Move(x, y, float(self.profile.limits.travel_speed) * 60))
        for command in words.program(way, self.profile):
            self.link.ask(command.data)

    def halt(self) -> None:
        """Stop the machine and lift the pen, as far as it still answers."""
        link, pen = self.link, self.profile.pen
        link.timeout = min(link.timeout, _HURRY)
        try:
            with contextlib.suppress(DeviceSilent):  # after an alarm it hears nothing but the reset
                self._hold()
            reset(link, _HURRY)
            if state(link) == "Alarm":
                link.ask(b"$X\n")
            for line in [*words.MODES, *words.pen(False, pen), *words.closing()]:
                link.ask(line)
        except DeviceError:
            self.log("The pen could not be lifted and may stand on the paper: lift it by hand.")

    def _hold(self) -> None:
        """Brake, and wait until the machine stands: a reset while it moves would lose its place."""
        link = self.link
        link.port.write(words.HOLD)
        link.forget()
        for _ in range(200):
            link.port.write(words.STATUS)
            for reply in link.attend():
                if isinstance(reply, Status) and reply.state != "Run" and (reply.state, reply.detail) != ("Hold", "1"):
                    return
            link.replies(_MOMENT)

    def home(self) -> None:
        """``$H``."""
        connecting.home(self.link, self.log)
