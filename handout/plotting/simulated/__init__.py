"""A plotter that exists only in the computer, down to its controller: for trying things out, and for tests.

It reads bytes as the controller of its dialect does, plans and steps by itself, and shares no planning with the host:
what the host announces is measured against it.
"""

from handout.plotting.simulated.port import SimulatedPlotter

__all__ = ["SimulatedPlotter"]
