"""The dialect of the EBB, the board of the AxiDraw and its kin: a machine that keeps time."""

from __future__ import annotations

from handout.plotting.dialect import Controller, Log
from handout.plotting.dialects.ebb.controller import Ebb
from handout.plotting.dialects.ebb.words import opening, program, set_pen
from handout.plotting.planning.plan import Plan
from handout.plotting.ports import Port
from handout.profiles import Plotter

__all__ = ["connect", "file", "opening", "program", "set_pen", "suffixes"]

suffixes: tuple[str, ...] = (".ebb",)


def file(plan: Plan, profile: Plotter) -> bytes:
    """A plan as the stream of commands that the board reads, each ended by CR; the language has no comments.

    Notes
    -----
    Without `firmware` in the profile the commands are those that every board understands.  They are relative to where
    the carriage stands: the machine's zero, with the pen lifted.  Whoever sends the file waits for the answer to each
    command before the next.
    """
    return b"".join(command.data for command in program(plan.blocks, profile))


def connect(port: Port, profile: Plotter, log: Log) -> Controller:
    """Find out which board this is and whether its motors have power; see `dialect.Dialect.connect`."""
    return Ebb(port, profile, log)
