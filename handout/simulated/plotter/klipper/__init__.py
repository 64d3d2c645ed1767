"""A controller that is Klipper behind Moonraker: JSON-RPC, scripts of G-code, moves settled ahead of time."""

from handout.simulated.plotter.klipper.firmware import KlipperFirmware as Firmware

__all__ = ["Firmware"]
