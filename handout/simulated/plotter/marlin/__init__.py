"""A controller that is Marlin 2: numbered lines, a queue of commands, a planner with junction deviation or jerk."""

from handout.simulated.plotter.marlin.firmware import Firmware
from handout.simulated.plotter.marlin.reception import Framing

__all__ = ["Firmware", "framing"]


def framing() -> Framing:
    """Lines end with a line feed or a carriage return."""
    return Framing(b"\n\r")
