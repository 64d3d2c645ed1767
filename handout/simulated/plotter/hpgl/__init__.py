"""A simulated pen plotter of the eighties: HP-GL over RS-232, a small buffer, a pen carousel, a front panel."""

from handout.simulated.plotter.hpgl.firmware import HpglFirmware as Firmware

__all__ = ["Firmware"]
