"""A plotter that exists only in the computer, down to its controller: for trying things out, and for tests.

It reads bytes as the controller of its dialect does, plans and steps by itself, and shares no planning with the host:
what the host announces is measured against it.
"""

from handout.profiles import Plotter
from handout.simulated.plotter import options
from handout.simulated.plotter.port import SimulatedPlotter
from handout.simulated.plotter.surroundings import disturbed

__all__ = ["SimulatedPlotter", "disturbed", "plotter"]


def plotter(profile: Plotter, query: str) -> SimulatedPlotter:
    """The machine that an address asks for with what follows ``sim:?``; InputError if it has no such option."""
    return SimulatedPlotter(profile, options.parse(query))
