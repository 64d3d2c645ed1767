"""A controller that is Marlin 2: numbered lines, a queue of commands, a planner with junction deviation or jerk."""

from handout.simulated.plotter.marlin.firmware import MarlinFirmware as Firmware

__all__ = ["Firmware"]
