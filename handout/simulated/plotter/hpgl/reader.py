"""How the simulated plotter reads instructions: two letters, numbers, a semicolon or the letters of the next one."""

from __future__ import annotations

import math
import re

_NAME = re.compile(r"[A-Za-z]{2}")
_REST = re.compile(r"[^A-Za-z;]*")
_SIGNED = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)")
_GREATEST = 32767


class Wrong(Exception):
    """What the plotter keeps as its last error: 1 unknown, 2 number of parameters, 3 out of range."""

    def __init__(self, number: int) -> None:
        super().__init__(str(number))
        self.number = number


def split(data: bytes) -> list[tuple[str, str]]:
    """Names and parameters of the instructions in some bytes; "" is the name of what is none."""
    text = data.decode("latin-1").replace("\r", "").replace("\n", "")
    found, at = [], 0
    while at < len(text):
        if text[at] in "; ":
            at += 1
            continue
        name = _NAME.match(text, at)
        if name is None:
            found.append(("", text[at]))
            at += 1
            continue
        rest = _REST.match(text, name.end())
        assert rest is not None
        found.append((name.group().upper(), rest.group()))
        at = rest.end()
    return found


def values(text: str) -> list[float]:
    """Parameters as numbers; raises `Wrong`."""
    parts = [part.strip() for part in text.replace(" ", ",").split(",") if part.strip()]
    if not all(_SIGNED.fullmatch(part) for part in parts):
        raise Wrong(1)
    numbers = [float(part) for part in parts]
    if any(abs(number) > _GREATEST for number in numbers):
        raise Wrong(3)
    return numbers


def places(numbers: list[float]) -> tuple[list[tuple[int, int]], bool]:
    """Coordinates in whole units, and whether one was left over."""
    whole = [math.floor(number) for number in numbers]
    return list(zip(whole[::2], whole[1::2], strict=False)), len(whole) % 2 == 1
