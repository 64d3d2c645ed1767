"""The dialect of Marlin and its kin: 3D printers that carry a pen, and plotters built from their boards."""

from __future__ import annotations

from handout.plotting.dialect import Controller, Log
from handout.plotting.dialects.marlin.controller import Marlin
from handout.plotting.dialects.marlin.words import program
from handout.plotting.ports import Port
from handout.profiles import Plotter

__all__ = ["connect", "file", "program", "suffixes"]

suffixes: tuple[str, ...] = (".gcode", ".g", ".gco")


def connect(port: Port, profile: Plotter, log: Log) -> Controller:
    """Wake the controller, find out who it is and what its limits are; see `dialect.Dialect.connect`."""
    return Marlin(port, profile, log)
