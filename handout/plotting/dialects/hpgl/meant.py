"""Where a plotter must stand, from the instructions that were sent to it."""

from __future__ import annotations

from handout.plotting.dialects.hpgl import words


class Meant:
    """Follows the instructions; at : plotter units, None as long as it has not been sent to a place."""

    def __init__(self) -> None:
        self.at: tuple[int, int] | None = None

    def send(self, data: bytes) -> None:
        """Instructions are sent: a relative list goes on from where the last one led."""
        for instruction in words.read(data):
            for x, y in instruction.points if instruction.name in ("PA", "PU", "PD", "PR") else []:
                before = self.at if instruction.name == "PR" and self.at is not None else (0, 0)
                self.at = round(before[0] + x), round(before[1] + y)

    def is_missed(self, x: float, y: float) -> bool:
        """Whether a plotter that stands there is not where it was sent; rounding may leave it a unit beside."""
        return self.at is not None and max(abs(x - self.at[0]), abs(y - self.at[1])) > _NEAR


_NEAR = 1.5  # plotter units
