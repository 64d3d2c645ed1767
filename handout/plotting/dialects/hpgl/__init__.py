"""HP-GL, the language of pen plotters from 1977 to today, over RS-232."""

from __future__ import annotations

from handout.plotting import pen_lift
from handout.plotting.dialect import Controller, Log
from handout.plotting.dialects.hpgl import words
from handout.plotting.planning.plan import Plan
from handout.plotting.ports import Port
from handout.profiles import Pen, Plotter

suffixes = (".hpgl", ".plt")
program = words.program


def file(plan: Plan, profile: Plotter) -> bytes:
    """The instructions, one a line: plotters pass over ends of lines.  HP-GL has no comments."""
    return b"".join(command.data + b"\n" for command in program(plan.blocks, profile, absolute=True))


def set_pen(pen: Pen, value: float) -> list[bytes]:
    """See `Dialect.set_pen`; there are no heights."""
    pen_lift.at(pen, value)
    return []


def connect(port: Port, profile: Plotter, log: Log) -> Controller:
    """See `Dialect.connect`."""
    from handout.plotting.dialects.hpgl import connecting

    return connecting.connect(port, profile, log)
