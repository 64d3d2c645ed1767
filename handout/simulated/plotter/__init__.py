"""A plotter that exists only in the computer, down to its controller: for trying things out, and for tests.

It reads bytes as the controller of its dialect does, plans and steps by itself, and shares no planning with the host:
what the host announces is measured against it.

- `port`: the plotter as a port, with its clock; `options`: what can be asked of it; `paper`: carriage, pen, and what is
  drawn.  What goes wrong with it, and networks in between, are the laboratory's, which an entry point finds.
- `firmware`: what every controller has in common, and bytes on their way to it; `grbl_firmware`, `marlin_firmware`,
  `ebb_firmware`, `hpgl_firmware`, `klipper_firmware`: the controllers; `planner`: the queue and the steps of those
  that plan.

To add a controller: a file with a `Firmware`, which its dialect names.
"""

from __future__ import annotations

import contextlib
from contextlib import AbstractContextManager
from typing import Any, cast

from handout.errors import InputError
from handout.profiles import Plotter
from handout.simulated.plotter import options
from handout.simulated.plotter.port import SimulatedPlotter

__all__ = ["SimulatedPlotter", "disturb_computer", "plotter"]


def plotter(profile: Plotter, query: str) -> SimulatedPlotter:
    """The machine that an address asks for with what follows ``sim:?``; InputError if it has no such option."""
    asked = options.parse(query)
    if asked.fault or asked.network:
        return cast(SimulatedPlotter, _load_laboratory("plotter")(profile, asked))
    return SimulatedPlotter(profile, asked)


def disturb_computer(query: str) -> AbstractContextManager[None]:
    """A slow disk and a busy processor, if an address asks for them (``sim:?disk=1s&busy=2``), until the block ends."""
    asked = options.parse(query)
    if asked.disk or asked.busy:
        return cast(AbstractContextManager[None], _load_laboratory("computer")(asked))
    return contextlib.nullcontext()


def _load_laboratory(name: str) -> Any:
    """What the laboratory simulates, found by its entry point."""
    from importlib.metadata import entry_points

    for point in entry_points(group="handout.simulated", name=name):
        return point.load()
    raise InputError(
        "sim: faults, networks and busy computers are simulated by the laboratory that comes with handout, which "
        "is not found here: install handout-driver anew."
    )
