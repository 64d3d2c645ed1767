"""The dialect of Klipper behind Moonraker: scripts of G-code in JSON-RPC; the pen on a servo, a stepper, Z, or macros.

Sources: Moonraker's documentation (printer administration, JSON-RPC notifications, introduction) and Klipper's
(G-codes, status reference, kinematics, code overview), read for facts.
"""

from __future__ import annotations

import re

from handout.plotting.dialects import Dialect, PenValues, Question
from handout.plotting.dialects.gcode import header
from handout.plotting.dialects.klipper.controller import KlipperController
from handout.plotting.dialects.klipper.protocol import PEAKS, homing, program, request, set_pen
from handout.plotting.planning.plan import Plan
from handout.profiles import Plotter


def file(plan: Plan, profile: Plotter) -> bytes:
    """The plan as a file that Klipper prints; it assumes and does what a file for Marlin does."""
    peaks = PEAKS % round(profile.limits.acceleration)
    lines = [*header(plan, profile), *(homing(profile) if profile.homing else []), peaks]
    return b"".join([*lines, *(command.data for command in program(plan.blocks, profile))])


DIALECT = Dialect(
    program=program,
    file=file,
    set_pen=set_pen,
    connect=KlipperController,
    simulator="handout.simulated.plotter.klipper_firmware:KlipperFirmware",
    # no speeds: it is asked only where Moonraker is said to be
    question=Question(b"\n" + request(1, "server.info"), re.compile(rb'"moonraker_version": ?"([^"]+)"'), ()),
    suffixes=(".gcode", ".g"),
    usual_device="klipper-servo",
    motion="planned",
    curves="all",
    clues=(request(2, "printer.objects.list"),),
    pen_values=PenValues(0.0, 360.0, lambda value: f"{value:g}"),  # degrees, or mm of a stepper
    steps_setting="rotation_distance of [stepper_x], [stepper_y] (divided, not multiplied)",
    # Klipper holds two seconds of settled motion, and plans to stop with less than one; another quarter is not settled
    # yet, its place is up to a quarter old, and a pen that moves where the carriage stands cannot be seen.  With 3 s
    # strokes of the test page took 1.5 % longer than with 4, which is what Klipper takes of itself.
    in_hand=4.0,
)
