"""The dialect of Marlin and its kin: 3D printers that carry a pen, and plotters built from their boards."""

from __future__ import annotations

import re

from handout.plotting.dialects import Dialect, PenValues, Question
from handout.plotting.dialects.gcode import header
from handout.plotting.dialects.marlin.controller import MarlinController
from handout.plotting.dialects.marlin.protocol import homing, program, set_pen
from handout.plotting.planning.plan import Plan
from handout.profiles import Plotter


def file(plan: Plan, profile: Plotter) -> bytes:
    """The plan as a program for a sender or the machine's own memory card.

    Senders add numbers and checksums themselves.  The program assumes that the machine's zero lies where the profile
    says (`bed.origin`), with the pen lifted; it ends there, with the motors powered.
    """
    lines = [*header(plan, profile), *(homing(profile) if profile.homing else [])]
    return b"".join([*lines, *(command.data for command in program(plan.blocks, profile))])


DIALECT = Dialect(
    program=program,
    file=file,
    set_pen=set_pen,
    connect=MarlinController,
    simulator="handout.simulated.plotter.marlin_firmware:MarlinFirmware",
    question=Question(b"M115\n", re.compile(rb"FIRMWARE_NAME:([^\r\n]*?)(?= [A-Z_]+:|[\r\n])"), (115200, 250000)),
    suffixes=(".gcode", ".g", ".gco"),
    usual_device="marlin-servo",
    motion="planned",
    curves="short",
    shortest_segment=9.0,  # moves of fewer than six steps of the longer axis (MIN_STEPS_PER_SEGMENT) join the next
    pen_values=PenValues(0.0, 180.0, lambda value: f"{value:g}°"),  # M280
    steps_setting="M92 X, Y",
)
