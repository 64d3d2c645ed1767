"""HP-GL, the language of pen plotters from 1977 to today, over RS-232."""

from __future__ import annotations

import re

from handout.plotting import pen_lift
from handout.plotting.dialects import Dialect, Question
from handout.plotting.dialects.hpgl.controller import HpglController
from handout.plotting.dialects.hpgl.protocol import program
from handout.plotting.planning.plan import Plan
from handout.profiles import PenLift, Plotter


def file(plan: Plan, profile: Plotter) -> bytes:
    """The instructions, one a line: plotters pass over ends of lines.  HP-GL has no comments."""
    return b"".join(command.data + b"\n" for command in program(plan.blocks, profile, absolute=True))


def set_pen(pen: PenLift, value: float) -> list[bytes]:
    """There are no heights: InputError."""
    pen_lift.lower_at_once(pen, value)
    return []


DIALECT = Dialect(
    program=program,
    file=file,
    set_pen=set_pen,
    connect=HpglController,
    simulator="handout.simulated.plotter.hpgl_firmware:HpglFirmware",
    question=Question(b"OI;", re.compile(rb"^\s*([0-9A-Z][0-9A-Z-]{3,15})\s*[\r\n]", re.MULTILINE), (9600,)),
    suffixes=(".hpgl", ".plt"),
    usual_device="hpgl",
    motion="vectors",
    line_end="",
    pen_values=None,
    steps_setting="",  # its scale is set on itself (P1, P2)
    lowering_bytes=35.0,
)
