"""What can be asked of the simulated plotter in its address, ``sim:?fault=alarm&after=40&buffer=64&realtime=1``.

A fault strikes once, after so many instructions of the plot have been read (`after`); the faults of `BYTE_FAULTS` can
instead be told the byte, counted from 0 over all that is written to the port, at which they strike (`at`); those of
`ANSWER_FAULTS` strike at a byte of all that the plotter says.  To add a fault: a line in `FAULTS`, what it does to the
bytes in `Faults` or to the machine in `port.SimulatedPlotter._fails`.
"""

from __future__ import annotations

import difflib
import re
from typing import Any
from urllib.parse import parse_qsl

import msgspec

from handout import units
from handout.errors import InputError

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
_NUMBERS = {
    "after": (0, 10**9), "at": (0, 10**9), "bit": (0, 7), "as": (0, 255), "buffer": (16, 65536), "queue": (2, 2000),
    "realtime": (0, 1), "blank": (0, 1), "motors": (0, 1), "busy": (0, 64),
}  # fmt: skip
_QUANTITIES = {"late": "time", "disk": "time", "latency": "time", "acceleration": "acceleration", "speed": "speed"}


class SimulatorOptions(msgspec.Struct, frozen=True, kw_only=True):
    """How a simulated plotter differs from its profile.

    fault : what goes wrong, one of `FAULTS`; after : how many instructions of the plot are read before that.
    at : the byte at which one of `BYTE_FAULTS` (−1: after `after` instructions) or of `ANSWER_FAULTS` strikes; bit :
        that is turned over; value : the byte that comes instead (``as`` in the address; 33 is the ``!`` of GRBL).
    buffer, queue : bytes and moves it can hold (0: as the profile says).
    late, latency : s, of an ok with ``fault=late``, and of every byte.
    acceleration, speed : mm/s², mm/s, of its own settings (0: as the profile says).
    settings : numbers and values of its own settings, as ``$20=1`` in the address (GRBL).
    variant : a relative of the controller that it is instead: "grblhal" or "fluidnc" (GRBL).
    blank : its memory is blank (GRBL).
    realtime : live by the computer's clock, as a real machine does, whether it is spoken to or not.
    disk, busy : s that the computer's disk takes longer to keep anything; how many other programs keep its processor
        busy (see `surroundings`).
    firmware : its version, such as 2.6.5, of a dialect in which that makes a difference (EBB); "": a usual one.
    motors : whether its motors have power.
    network : how it is reached, over a real socket of this computer: "tcp" or "ws", a WebSocket; "": not so (GRBL).
    """

    fault: str = ""
    after: int = 20
    at: int = -1
    bit: int = 0
    value: int = 33
    buffer: int = 0
    queue: int = 0
    late: float = 0.5
    latency: float = 0.001
    acceleration: float = 0.0
    speed: float = 0.0
    realtime: bool = False
    disk: float = 0.0
    busy: int = 0
    settings: tuple[tuple[int, float], ...] = ()
    variant: str = ""
    blank: bool = False
    firmware: str = ""
    motors: bool = True
    network: str = ""


def parse(query: str) -> SimulatorOptions:
    """Options from what follows ``sim:?``.

    Raises
    ------
    InputError
        An unknown option or fault, or a value that cannot be read.
    """
    values: dict[str, Any] = {"settings": []}
    for name, text in parse_qsl(query, keep_blank_values=True):
        if name == "fault":
            values[name] = _one_of(text, list(FAULTS), "fault")
        elif name in _QUANTITIES:
            values[name] = units.parse(text, _QUANTITIES[name], name)
        elif name == "variant":
            values[name] = _one_of(text, ["grblhal", "fluidnc"], "variant")
        elif name == "network":
            values[name] = _one_of(text, ["tcp", "ws"], "network")
        elif re.fullmatch(r"\$\d{1,3}", name):
            values["settings"].append((int(name[1:]), _number(name, text)))
        elif name in _NUMBERS:
            least, greatest = _NUMBERS[name]
            if not text.isascii() or not text.isdigit() or not least <= int(text) <= greatest:
                raise InputError(f"sim: {name}={text} is not a whole number from {least} to {greatest}.")
            values["value" if name == "as" else name] = int(text)
        elif name == "firmware":
            if not re.fullmatch(r"\d{1,3}(\.\d{1,3}){1,2}", text, re.ASCII):
                raise InputError(f"sim: firmware={text} is not a version such as 2.8.1.")
            values[name] = text
        else:
            names = ["fault", "variant", "network", "firmware", *_NUMBERS, *_QUANTITIES, "$20 and so on"]
            _one_of(name, names, "option")
    for name, usual in (("realtime", False), ("blank", False), ("motors", True)):
        values[name] = bool(values.get(name, usual))
    return msgspec.convert(values, SimulatorOptions)


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f"sim: {name}={text} is not a number.") from error


def _one_of(text: str, names: list[str], what: str) -> str:
    if text in names:
        return text
    near = difflib.get_close_matches(text, names, 1)
    hint = f" (did you mean {near[0]}?)" if near else ""
    raise InputError(f"The simulated plotter has no {what} {text!r}{hint}; it knows {', '.join(names)}.")


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
