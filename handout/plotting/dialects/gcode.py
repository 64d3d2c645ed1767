"""What the dialects of G-code share: numbers, the pen, and the comments that a file begins with."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable

from handout import units
from handout.plotting import pen_lift
from handout.plotting.planning.blocks import Lines
from handout.plotting.planning.plan import Plan
from handout.profiles import Pen as PenProfile
from handout.profiles import Plotter

_LONGEST = 69  # characters of a line; some senders and controllers count those of comments too


def header(plan: Plan, profile: Plotter) -> list[bytes]:
    """Lines of comments that say what a program is."""
    about, page = plan.drawing.about, plan.drawing.page
    facts = [("title", about.get("title")), ("hand", about.get("hand")), ("seed", about.get("seed"))]
    turned = ", turned: its top lies to the left" if plan.placement.turned else ""
    facts += [
        ("page", f"{page.name} {page.width:g} x {page.height:g} mm{turned}"),
        ("machine", profile.name or profile.title),
        ("zero", f"{profile.bed.origin} of the page, pen lifted"),
        ("time", units.duration(plan.duration)),
        ("pen", f"{plan.pen_down / 1000:.2f} m drawn, {plan.pen_up / 1000:.2f} m travelled"),
    ]
    written = [f"; {name}: {comment(str(value))}"[:_LONGEST].rstrip() for name, value in facts if value is not None]
    return [b"; written by handout\n", *(line.encode("ascii") + b"\n" for line in written)]


def comment(text: str) -> str:
    """Text that can stand in a comment: ASCII, one line, and none of the bytes that act wherever they stand.

    ``?``, ``!`` and ``~`` are real-time commands of GRBL even within a comment: "Dear all!" would hold the machine.
    """
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    characters = "".join(" " if char in "\r\n\t" else char for char in plain if char.isprintable() or char in "\r\n\t")
    return " ".join("".join(char for char in characters if char not in "?!~").split())


def number(value: float, digits: int = 3) -> str:
    """A number as short as it can be written."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def lines(block: Lines) -> list[bytes]:
    """Lines of the user's own, as they are."""
    return [f"{line}\n".encode("ascii") for line in block.lines]


def pen(
    down: bool,
    profile: PenProfile,
    *,
    stand: bytes,
    servo: Callable[[float], bytes],
    pause: Callable[[float], bytes],
) -> list[bytes]:
    """Lower or lift the pen and wait for it.

    stand : answered when all motion is done, which lines of the user's own must wait for; servo : moves the servo.
    """
    if profile.lift == "command":
        lines = profile.down_command if down else profile.up_command
        rest = float(profile.down_time if down else profile.up_time)
        return [stand, *(f"{line}\n".encode("ascii") for line in lines), *([pause(rest)] if rest > 0 else [])]
    commands: list[bytes] = []
    speed = pen_lift.lowering_speed(profile) if down else profile.z_speed
    for value, wait in pen_lift.way(profile, down):
        z = f"G1Z{number(value)}F{number(speed * 60, 1)}\n".encode()
        commands += [z if profile.lift == "z" else servo(value), *([pause(wait)] if wait > 0 else [])]
    return commands
