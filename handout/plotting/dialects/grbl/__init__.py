"""The dialect of GRBL 1.1 and its relatives (grblHAL, FluidNC)."""

from __future__ import annotations

import re

from handout.plotting.dialects import Dialect, PenValues, Question
from handout.plotting.dialects.gcode import header
from handout.plotting.dialects.grbl.controller import GrblController
from handout.plotting.dialects.grbl.protocol import program, set_pen
from handout.plotting.planning.plan import Plan
from handout.profiles import Plotter


def to_gcode(plan: Plan, profile: Plotter | None = None) -> bytes:
    """A plan as a G-code file that any sender can run, with a header of comments.

    profile : whose dialect and pen are used; default: that of the plan.

    The program assumes that the machine's zero lies where the profile says (`bed.origin`), with the pen lifted; it
    ends there.  It does not end with M2 or M30, which would switch the servo off and drop the pen.
    """
    profile = profile or plan.profile
    lines = [*header(plan, profile)]
    lines += [b"$H\n"] if profile.homing else [b"G92X0Y0\n"] if profile.bed.zero == "here" else []
    return b"".join([*lines, *(command.data for command in program(plan.blocks, profile, absolute=True))])


DIALECT = Dialect(
    program=program,
    file=to_gcode,
    set_pen=set_pen,
    connect=GrblController,
    simulator="handout.simulated.plotter.grbl_firmware:GrblFirmware",
    clues=(b"$$\n",),  # its travel, and settings that only some have
    question=Question(b"$I\n", re.compile(rb"\[VER:([^\]\r\n]*)"), (115200,)),
    suffixes=(".gcode", ".nc", ".ngc"),
    usual_device="grbl-servo",
    motion="planned",
    pen_values=PenValues(1.0, 1000.0, lambda value: f"S{value:g}"),  # the usual range of its spindle ($30)
    steps_setting="$100 (x), $101 (y)",
)
