"""The dialect of GRBL 1.1 and its relatives (grblHAL, FluidNC)."""

from __future__ import annotations

from handout.plotting.dialect import Controller, Log
from handout.plotting.dialects.grbl.controller import Grbl
from handout.plotting.dialects.grbl.file import to_gcode as file
from handout.plotting.dialects.grbl.words import program, set_pen
from handout.plotting.ports import Port
from handout.profiles import Plotter

__all__ = ["connect", "file", "program", "set_pen", "suffixes"]

suffixes: tuple[str, ...] = (".gcode", ".nc", ".ngc")


def connect(port: Port, profile: Plotter, log: Log) -> Controller:
    """Wake the controller, find out who it is and what its limits are; see `dialect.Dialect.connect`."""
    return Grbl(port, profile, log)
