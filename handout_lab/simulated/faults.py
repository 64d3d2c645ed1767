"""What goes wrong with a simulated plotter, on demand, and around it: ``sim:?fault=alarm&after=40``, ``sim:?disk=1s``.

A fault strikes once, after so many instructions of the plot have been read (`after`); the faults of `BYTE_FAULTS` can
instead be told the byte, counted from 0 over all that is written to the port, at which they strike (`at`); those of
`ANSWER_FAULTS` strike at a byte of all that the plotter says.  To add a fault: a line in `FAULTS`, what it does to the
bytes in `Faults` or to the machine in `FaultyPlotter._fails`.
"""

from __future__ import annotations

import contextlib
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

from handout.profiles import Plotter
from handout.simulated.plotter.options import SimulatorOptions, choose_one
from handout.simulated.plotter.port import Clock, SimulatedPlotter

FAULTS = {
    "jam": "it stands still and never answers again",
    "late": "every ok comes late by the time `late`",
    "lost-byte": "the end of a line, or the byte `at`, is lost on the way to it",
    "flipped-byte": "the same byte comes with its bit number `bit` turned over",
    "doubled-byte": "the same byte comes twice",
    "changed-byte": "the byte `at` comes as the byte of number `as`",
    "lost-answer": "the byte `at` of all that it says is lost on the way back",
    "flipped-answer": "the same byte comes back with its bit number `bit` turned over",
    "changed-answer": "the same byte comes back as the byte of number `as`",
    "lost-ok": "one ok is lost on the way back",
    "resend-loop": "it takes every line for damaged and asks for it again (Marlin)",
    "error": "it refuses a line (error:33)",
    "alarm": "a limit switch is hit (ALARM:1)",
    "lost-board": "its board is gone, which its host program notices five seconds later (Klipper)",
    "hold": "it is put on hold (GRBL, HP-GL), or waits for somebody to press its button (Marlin)",
    "view": "someone presses VIEW on its panel, and again after a while (HP-GL)",
    "button": "someone presses its button, and again after a while (EBB)",
    "reset": "it starts again, as after a break in its power",
    "stall": "nothing is carried either way for three seconds, then all of it at once",
    "unplugged": "the connection is gone; it goes on with what it has received",
    "power-cut": "it has no power any more: it stands, its pen where it is, and is silent",
}
BYTE_FAULTS = ("lost-byte", "flipped-byte", "doubled-byte", "changed-byte", "unplugged", "power-cut", "reset")
ANSWER_FAULTS = ("lost-answer", "flipped-answer", "changed-answer")
_STALL = 3.0  # s; less than any machine's time-out, as a radio that loses its network for a moment


class Faults:
    """The fault that was asked for.

    lines : instructions of a plot that were read so far, the one being read included.
    written, said : bytes of the host and of the plotter so far.
    """

    def __init__(self, options: SimulatorOptions) -> None:
        self.options = options
        self.lines = 0
        self.written = self.said = 0
        self._ends = 0  # ends of instructions among them
        self._struck = False

    def past(self, fault: str) -> bool:
        """Whether it is this fault, and its time has come."""
        return self.options.fault == fault and self.options.at < 0 and self.lines > self.options.after

    def strikes(self, fault: str) -> bool:
        """Whether it is this fault and it happens now."""
        if self._struck or not self.past(fault):
            return False
        self._struck = True
        return True

    def damage_bytes(self, data: bytes, ends: bytes) -> tuple[bytes, str]:
        """Damage what the host writes: the bytes that set off on the wire, and the fault that cuts them short, if any.

        A fault at the byte `at` of all that the host writes strikes there; without `at`, at the end of instruction
        number `after`.
        """
        fault, begin = self.options.fault, self.written
        self.written += len(data)
        if self._struck or fault not in BYTE_FAULTS:
            return data, ""
        place = self.options.at - begin if self.options.at >= 0 else self._end(data, ends)
        if not 0 <= place < len(data):
            return data, ""
        self._struck = True
        before, byte, rest = data[:place], data[place : place + 1], data[place + 1 :]
        if fault in ("unplugged", "power-cut", "reset"):
            return before, fault
        return before + self._instead(byte) + rest, ""

    def damage_answer(self, data: bytes) -> bytes:
        """Damage an answer: what of it comes back to the host."""
        place, self.said = self.options.at - self.said, self.said + len(data)
        if self._struck or self.options.fault not in ANSWER_FAULTS or not 0 <= place < len(data):
            return data
        self._struck = True
        return data[:place] + self._instead(data[place : place + 1]) + data[place + 1 :]

    def _instead(self, byte: bytes) -> bytes:
        """What comes in the place of a byte."""
        kind = self.options.fault.partition("-")[0]
        if kind == "flipped":
            return bytes([byte[0] ^ (1 << self.options.bit)])
        return {"lost": b"", "doubled": byte + byte, "changed": bytes([self.options.value])}[kind]

    def _end(self, data: bytes, ends: bytes) -> int:
        """Where the end of instruction number `after` is among the bytes; −1: not among them."""
        if self.options.fault in ("unplugged", "power-cut", "reset"):
            return -1  # these strike when it is read
        for place, byte in enumerate(data):
            if byte in ends:
                self._ends += 1
                if self._ends > self.options.after:
                    return place
        return -1


class FaultyPlotter(SimulatedPlotter):
    """A simulated plotter with which things go wrong."""

    def __init__(self, profile: Plotter, options: SimulatorOptions | None = None, clock: Clock | None = None) -> None:
        asked = options or SimulatorOptions()
        if asked.fault:
            choose_one(asked.fault, list(FAULTS), "fault")
        self.faults = Faults(asked)
        self._dies = self._begins = math.inf  # when its power is cut, when it starts anew
        self._stalls = 0.0  # until then nothing is carried
        super().__init__(profile, asked, clock)

    def transmit(self, data: bytes) -> None:
        """Send off what a fault leaves of the bytes."""
        comes, cut = self.faults.damage_bytes(data, self._wire.framing.ends)
        arrives = self._wire.send_bytes(comes, max(self.now, self._stalls) + self.options.latency)
        if cut == "unplugged":
            self._gone = True
        elif cut == "power-cut":
            self._dies = arrives
        elif cut == "reset":
            self._begins = arrives
            self._wire.send_bytes(data[len(comes) :], arrives)  # comes to a machine that has forgotten what was before

    def _next_event(self) -> float:
        return math.inf if self._silent else min(super()._next_event(), self._dies, self._begins)

    def befall(self) -> None:
        """Cut its power, or start it anew, in its time."""
        if self.now >= self._dies:
            self.cut_power()
        if self.now >= self._begins:
            self._wire.receive(self.now)
            self._begin_anew()
            self._restart()

    def _say(self, data: bytes) -> None:
        ok = data.strip().lower().startswith(self.firmware.acknowledgement)
        if self._silent or (ok and self.faults.strikes("lost-ok")):
            return
        late = self.options.late if ok and self.faults.past("late") else 0.0
        soonest = max(self.now, self._stalls) + self.options.latency + len(data) * self._wire.byte + late
        self._out.append((max(soonest, self._out[-1][0] if self._out else 0.0), self.faults.damage_answer(data)))

    def is_struck(self) -> bool:
        """Count the instruction, and see whether the fault strikes."""
        self.faults.lines += self._began is not None
        return self._fails()

    def cut_power(self) -> None:
        """See `SimulatedPlotter`."""
        self._dies = math.inf
        super().cut_power()

    def _begin_anew(self) -> None:
        """As after a break in its power that was too short to be seen."""
        self._begins = math.inf
        self.firmware.stop()
        self.firmware.start()
        self._wire.clear()
        if self._wire.framing.blocks:
            self._wire.lose()
        self._gone = self._wire.framing.blocks  # what is on USB itself is gone from it for a moment

    def _fails(self) -> bool:
        """Let the fault that was asked for happen in its time; whether the line just read is lost to it."""
        fault = self.options.fault
        if not fault or not self.faults.past(fault):
            return False
        others: dict[str, Callable[[], None]] = {
            "error": self.firmware.refuse,
            "alarm": self.firmware.alarm,
            "lost-board": self.firmware.lose_board,
            "reset": self._begin_anew,
            "hold": self.firmware.hold,
        }
        known = {"jam", "unplugged", "power-cut", "stall", *others}
        if fault not in known or not self.faults.strikes(fault):
            return False
        if fault == "jam":
            self._silent = True
        elif fault == "unplugged":
            self._gone = True
        elif fault == "power-cut":
            self._dies = self.now
        elif fault == "stall":
            self._stalls = self.now + _STALL
        else:
            others[fault]()
        return fault not in {"unplugged", "hold", "stall", *self.firmware.obeys}  # what it has, it does


_SPINS = """
import os
if hasattr(os, "sched_setscheduler"):  # as other programs are, whatever this one is
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
parent = os.getppid()
while os.getppid() == parent:
    sum(range(100_000))
"""


@contextlib.contextmanager
def disturb_computer(options: SimulatorOptions) -> Iterator[None]:
    """Slow disk and processor as an address asks (``sim:?disk=1s&busy=2``), until the block ends."""
    with slow_disk(options.disk), busy_processor(options.busy):
        yield


@contextlib.contextmanager
def slow_disk(seconds: float) -> Iterator[None]:
    """Every time this program waits until the disk has kept something, it takes so much longer."""
    usual = os.fsync

    def late(handle: Any) -> None:
        time.sleep(seconds)
        usual(handle)

    setattr(os, "fsync", late if seconds > 0.0 else usual)  # noqa: B010 — a function of the system cannot be assigned
    try:
        yield
    finally:
        setattr(os, "fsync", usual)  # noqa: B010


@contextlib.contextmanager
def busy_processor(many: int) -> Iterator[list[subprocess.Popen[bytes]]]:
    """So many other programs work as hard as they can; each ends by itself when this one is gone."""
    others = [subprocess.Popen([sys.executable, "-c", _SPINS]) for _ in range(many)]
    try:
        yield others
    finally:
        for other in others:
            other.kill()
            other.wait()
