"""What the simulated plotter is asked for beyond plotting: `faults`, and a real socket in between (`network`).

The entry points of the group ``handout.simulated`` lead here, from ``sim:?fault=jam``, ``?network=ws``, ``?disk=1s``.
"""

from handout.profiles import Plotter
from handout.simulated.plotter.options import SimulatorOptions
from handout_lab.simulated.faults import FaultyPlotter, disturb_computer
from handout_lab.simulated.network import NetworkedPlotter

__all__ = ["FaultyPlotter", "NetworkedPlotter", "disturb_computer", "plotter"]


def plotter(profile: Plotter, options: SimulatorOptions) -> FaultyPlotter:
    """The machine that an address asks for; InputError if there is no such fault or network."""
    return (NetworkedPlotter if options.network else FaultyPlotter)(profile, options)
