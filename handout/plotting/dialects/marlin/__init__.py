"""The dialect of Marlin and its kin: 3D printers that carry a pen, and plotters built from their boards."""

from __future__ import annotations

from handout.plotting.dialect import Controller, Log
from handout.plotting.dialects.marlin.controller import Marlin
from handout.plotting.dialects.marlin.words import homing, program, set_pen
from handout.plotting.gcode import header
from handout.plotting.planning.plan import Plan
from handout.plotting.ports import Port
from handout.profiles import Plotter

__all__ = ["connect", "file", "program", "set_pen", "suffixes"]

suffixes: tuple[str, ...] = (".gcode", ".g", ".gco")


def file(plan: Plan, profile: Plotter) -> bytes:
    """The plan as a program for a sender or the machine's own memory card; see `dialect.Dialect.file`.

    Notes
    -----
    Senders add numbers and checksums themselves.  The program assumes that the machine's zero lies where the profile
    says (`bed.origin`), with the pen lifted; it ends there, with the motors powered.
    """
    lines = [*header(plan, profile), *(homing(profile) if profile.homing else [])]
    return b"".join([*lines, *(command.data for command in program(plan.blocks, profile))])


def connect(port: Port, profile: Plotter, log: Log) -> Controller:
    """Wake the controller, find out who it is and what its limits are; see `dialect.Dialect.connect`."""
    return Marlin(port, profile, log)
