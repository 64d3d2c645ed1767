"""The dialect of the EBB, the board of the AxiDraw and its kin: a machine that keeps time."""

from __future__ import annotations

import re

from handout.plotting.dialects import Dialect, PenValues, Question
from handout.plotting.dialects.ebb.controller import EbbController
from handout.plotting.dialects.ebb.protocol import program, set_pen
from handout.plotting.planning.plan import Plan
from handout.profiles import Plotter


def file(plan: Plan, profile: Plotter) -> bytes:
    """A plan as the stream of commands that the board reads, each ended by CR; the language has no comments.

    Without `firmware` in the profile the commands are those that every board understands.  They are relative to where
    the carriage stands: the machine's zero, with the pen lifted.  Whoever sends the file waits for the answer to each
    command before the next.
    """
    return b"".join(command.data for command in program(plan.blocks, profile))


DIALECT = Dialect(
    program=program,
    file=file,
    set_pen=set_pen,
    connect=EbbController,
    simulator="handout.simulated.plotter.ebb_firmware:EbbFirmware",
    question=Question(b"\rV\r", re.compile(rb"(EBB[^\r\n]*)"), (115200,)),
    clues=(b"QT\r",),  # its nickname
    usb=frozenset({(0x04D8, 0xFD92)}),  # of the EiBotBoard, by its makers' documentation
    suffixes=(".ebb",),
    usual_device="axidraw-v3",
    motion="timed",
    line_end="\r",
    pen_values=PenValues(5400.0, 28500.0, lambda value: f"{value:g} ({value / 12:.0f} µs)"),  # 0.45 to 2.4 ms
    steps_setting="limits.steps_per_mm",
)
