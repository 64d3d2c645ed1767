"""What goes wrong with a simulated plotter, and when: every fault strikes once."""

from __future__ import annotations

from handout.simulated.plotter.options import ANSWER_FAULTS, BYTE_FAULTS, Options


class Faults:
    """The fault that was asked for.

    lines : instructions of a plot that were read so far, the one being read included.
    written, said : bytes of the host and of the plotter so far.
    """

    def __init__(self, options: Options) -> None:
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

    def damaged(self, data: bytes, ends: bytes) -> tuple[bytes, str]:
        """What of the bytes the host writes sets off on the wire; and the fault that cuts the way short, if one does.

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

    def answered(self, data: bytes) -> bytes:
        """What of an answer comes back to the host."""
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
