"""The simulated EBB: the board of the AxiDraw, from the documented accumulator up."""

from handout.simulated.plotter.ebb.firmware import EbbFirmware as Firmware

__all__ = ["Firmware"]
