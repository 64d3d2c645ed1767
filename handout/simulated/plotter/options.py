"""What can be asked of the simulated plotter in its address, ``sim:?fault=alarm&after=40&buffer=64&realtime=1``."""

from __future__ import annotations

import difflib
import re
from typing import Any
from urllib.parse import parse_qsl

import msgspec

from handout import units
from handout.errors import InputError

_NUMBERS = {
    "after": (0, 10**9), "at": (0, 10**9), "bit": (0, 7), "as": (0, 255), "buffer": (16, 65536), "queue": (2, 2000),
    "realtime": (0, 1), "blank": (0, 1), "motors": (0, 1), "busy": (0, 64),
}  # fmt: skip
_QUANTITIES = {"late": "time", "disk": "time", "latency": "time", "acceleration": "acceleration", "speed": "speed"}


class SimulatorOptions(msgspec.Struct, frozen=True, kw_only=True):
    """How a simulated plotter differs from its profile.

    fault : what goes wrong, one of the laboratory's `FAULTS`; after : instructions of the plot that are read before.
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
        busy (see `handout_lab.simulated`).
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

    Raises InputError: an unknown option or fault, or a value that cannot be read.
    """
    values: dict[str, Any] = {"settings": []}
    for name, text in parse_qsl(query, keep_blank_values=True):
        if name == "fault":  # looked up by what makes faults
            values[name] = text
        elif name in _QUANTITIES:
            values[name] = units.parse(text, _QUANTITIES[name], name)
        elif name == "variant":
            values[name] = choose_one(text, ["grblhal", "fluidnc"], "variant")
        elif name == "network":
            values[name] = choose_one(text, ["tcp", "ws"], "network")
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
            choose_one(name, names, "option")
    for name, usual in (("realtime", False), ("blank", False), ("motors", True)):
        values[name] = bool(values.get(name, usual))
    return msgspec.convert(values, SimulatorOptions)


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f"sim: {name}={text} is not a number.") from error


def choose_one(text: str, names: list[str], what: str) -> str:
    """The text if it is one of the names; else InputError, with the nearest."""
    if text in names:
        return text
    near = difflib.get_close_matches(text, names, 1)
    hint = f" (did you mean {near[0]}?)" if near else ""
    raise InputError(f"The simulated plotter has no {what} {text!r}{hint}; it knows {', '.join(names)}.")
