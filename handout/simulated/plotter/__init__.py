"""A plotter that exists only in the computer, down to its controller: for trying things out, and for tests.

It reads bytes as the controller of its dialect does, plans and steps by itself, and shares no planning with the host:
what the host announces is measured against it.

- `port`: the plotter as a port, with its clock; `network`: the same behind a real socket; `options`: what can be asked
  of it, and faults; `paper`: carriage, pen, and what is drawn; `surroundings`: a slow disk, a busy processor.
- `firmware`: what every controller has in common, and bytes on their way to it; `grbl_firmware`, `marlin_firmware`,
  `ebb_firmware`, `hpgl_firmware`, `klipper_firmware`: the controllers; `planner`: the queue and the steps of those
  that plan.

To add a controller: a file with a `Firmware`, which its dialect names; a fault: see `options`.
"""

from handout.profiles import Plotter
from handout.simulated.plotter import options
from handout.simulated.plotter.network import NetworkedPlotter
from handout.simulated.plotter.port import SimulatedPlotter
from handout.simulated.plotter.surroundings import disturb_computer

__all__ = ["NetworkedPlotter", "SimulatedPlotter", "disturb_computer", "plotter"]


def plotter(profile: Plotter, query: str) -> SimulatedPlotter:
    """The machine that an address asks for with what follows ``sim:?``; InputError if it has no such option."""
    asked = options.parse(query)
    return (NetworkedPlotter if asked.network else SimulatedPlotter)(profile, asked)
