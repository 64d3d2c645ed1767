"""A simulated pen plotter of the eighties: HP-GL over RS-232, a small buffer, a pen carousel, a front panel."""

from handout.simulated.plotter.hpgl.firmware import Firmware
from handout.simulated.plotter.hpgl.framing import Escapes


def framing() -> Escapes:
    """How it cuts what it receives into instructions."""
    return Escapes()


__all__ = ["Firmware", "framing"]
