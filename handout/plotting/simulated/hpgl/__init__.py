"""A simulated pen plotter of the eighties: HP-GL over RS-232, a small buffer, a pen carousel, a front panel."""

from handout.plotting.simulated.hpgl.firmware import Firmware
from handout.plotting.simulated.hpgl.framing import Escapes


def framing() -> Escapes:
    """How it cuts what it receives into instructions."""
    return Escapes()


__all__ = ["Firmware", "framing"]
