"""A controller that is GRBL 1.1: lines, real-time bytes, planner, steps; it shares no planning with the host."""

from handout.simulated.plotter.grbl.firmware import GrblFirmware as Firmware

__all__ = ["Firmware"]
