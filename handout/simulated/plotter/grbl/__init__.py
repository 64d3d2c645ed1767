"""A controller that is GRBL 1.1: lines, real-time bytes, planner, steps; it shares no planning with the host."""

from handout.simulated.plotter.grbl.firmware import Firmware
from handout.simulated.plotter.wire import Framing

__all__ = ["Firmware", "framing"]


def framing() -> Framing:
    """Lines end with a line feed or a carriage return; all that is beyond ASCII acts on reception, or is dropped."""
    return Framing(b"\n\r", b"?!~\x18" + bytes(range(128, 256)))
