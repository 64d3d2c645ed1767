"""The simulated EBB: the board of the AxiDraw, from the documented accumulator up."""

from handout.simulated.plotter.ebb.firmware import Firmware
from handout.simulated.plotter.wire import Framing

__all__ = ["Firmware", "framing"]


def framing() -> Framing:
    """Commands end with CR; USB makes the sender wait while the board does not read."""
    return Framing(b"\r", blocks=True)
