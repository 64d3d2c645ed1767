"""Where the board must stand by its own count of steps, from the commands that were sent to it."""

from __future__ import annotations

from handout.plotting.dialects.ebb.firmware import HOME, SIGNED, Version
from handout.plotting.dialects.ebb.stepping import WHOLE, total


class StepCounter:
    """Follows both motors through commands; steps : of each since its counter was cleared."""

    def __init__(self, version: Version) -> None:
        self.signed, self.clears = version >= SIGNED, version >= HOME
        self.steps = [0, 0]
        self._filled = [0, 0]

    def send(self, data: bytes) -> None:
        """A command is sent."""
        name, *fields = data.decode("ascii").strip().split(",")
        numbers = [int(field) for field in fields]
        if name in ("CS", "HM") or (name == "EM" and self.clears):
            self.steps, self._filled = [0, 0], [0, 0]
        elif name == "SM":
            self._add(numbers[1:3])
        elif name == "LM":
            self._add([numbers[1], numbers[4]])
        elif name == "LT":
            self._add([self._timed(axis, numbers) for axis in (0, 1)])

    def _add(self, steps: list[int]) -> None:
        self.steps = [a + b for a, b in zip(self.steps, steps, strict=True)]

    def _timed(self, axis: int, numbers: list[int]) -> int:
        """Steps that a motor makes in a time."""
        ticks, rate, gain = numbers[0], numbers[1 + 2 * axis], numbers[2 + 2 * axis]
        if len(numbers) > 5:
            falls = rate < 0 or (rate == 0 and gain < 0)
            self._filled[axis] = WHOLE - 1 if self.signed and falls else 0
        grown = self._filled[axis] + total(rate if self.signed else abs(rate), gain, ticks)
        self._filled[axis] = grown % WHOLE
        return (1 if self.signed or rate >= 0 else -1) * (grown // WHOLE)
