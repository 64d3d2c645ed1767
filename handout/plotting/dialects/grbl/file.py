"""A plan as a G-code file that any sender can run."""

from __future__ import annotations

from handout.plotting.dialects.grbl import words
from handout.plotting.gcode import header
from handout.plotting.planning.plan import Plan
from handout.profiles import Plotter


def to_gcode(plan: Plan, profile: Plotter | None = None) -> bytes:
    """The plan as a complete program for GRBL, with a header of comments.

    Parameters
    ----------
    profile : whose dialect and pen are used; default: that of the plan.

    Notes
    -----
    The program assumes that the machine's zero lies where the profile says (`bed.origin`), with the pen lifted; it
    ends there.  It does not end with M2 or M30, which would switch the servo off and drop the pen.
    """
    profile = profile or plan.profile
    lines = [*header(plan, profile)]
    lines += [b"$H\n"] if profile.homing else [b"G92X0Y0\n"] if profile.bed.zero == "here" else []
    return b"".join([*lines, *(command.data for command in words.program(plan.blocks, profile, absolute=True))])
