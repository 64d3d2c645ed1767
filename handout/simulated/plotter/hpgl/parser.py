"""How the simulated HP-GL plotter reads: what it receives is cut into instructions, these into names and numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from handout.simulated.plotter.wire import Framing

_NAME = re.compile(r"[A-Za-z]{2}")
_REST = re.compile(r"[^A-Za-z;]*")
_SIGNED = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)")
_GREATEST = 32767  # of a coordinate, by the manuals


class Wrong(Exception):
    """What the plotter keeps as its last error: 1 unknown, 2 number of parameters, 3 out of range."""

    def __init__(self, number: int) -> None:
        super().__init__(str(number))
        self.number = number


def split_instructions(data: bytes) -> list[tuple[str, str]]:
    """Split bytes into instructions, each with name and parameters; what is no instruction has the name ""."""
    text = data.decode("latin-1").replace("\r", "").replace("\n", "")
    instructions, at = [], 0
    while at < len(text):
        if text[at] in "; ":
            at += 1
            continue
        name = _NAME.match(text, at)
        if name is None:
            instructions.append(("", text[at]))
            at += 1
            continue
        rest = _REST.match(text, name.end())
        assert rest is not None
        instructions.append((name.group().upper(), rest.group()))
        at = rest.end()
    return instructions


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


_ESCAPE = 0x1B  # of device control instructions
_WITH_PARAMETERS = frozenset(b"@HIMN")
_PARAMETER = frozenset(b"0123456789;")


class Escapes(Framing):
    """Instructions end with a semicolon; ``ESC .`` and a letter, some with parameters up to a colon, never wait."""

    def __init__(self) -> None:
        super().__init__(b";")
        self._held = b""  # of a device control instruction that is not complete

    def cut_pieces(self, data: bytes) -> Iterator[tuple[bytes, bool]]:
        """See `Framing.cut_pieces`."""
        plain = b""
        for value in data:
            byte = bytes([value])
            if self._held:
                self._held += byte
                if _complete(self._held):
                    yield self._held, True
                    self._held = b""
            elif value == _ESCAPE:
                if plain:
                    yield plain, False
                plain, self._held = b"", byte
            else:
                plain += byte
                if byte == b";":
                    yield plain, False
                    plain = b""
        if plain:
            yield plain, False


def _complete(control: bytes) -> bool:
    """Whether a device control instruction ends with the last of these bytes, rightly or not."""
    if len(control) == 2:
        return control[1:] != b"."
    if len(control) == 3:
        return control[2] not in _WITH_PARAMETERS
    return control[-1] not in _PARAMETER
