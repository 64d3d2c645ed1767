"""How the simulated plotter cuts what it receives: instructions are buffered, device control acts on reception."""

from __future__ import annotations

from collections.abc import Iterator

from handout.simulated.plotter.wire import Framing

_ESCAPE = 0x1B
_WITH_PARAMETERS = frozenset(b"@HIMN")
_PARAMETER = frozenset(b"0123456789;")


class Escapes(Framing):
    """Instructions end with a semicolon; ``ESC .`` and a letter, some with parameters up to a colon, never wait."""

    def __init__(self) -> None:
        super().__init__(b";")
        self._held = b""  # of a device control instruction that is not complete

    def cut(self, data: bytes) -> Iterator[tuple[bytes, bool]]:
        """See `Framing.cut`."""
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
