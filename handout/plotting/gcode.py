"""What G-code files of all dialects begin with: comments that say what they are, harmless to every machine."""

from __future__ import annotations

import unicodedata

from handout import units
from handout.plotting.planning.plan import Plan
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
    kept = "".join(" " if char in "\r\n\t" else char for char in plain if char.isprintable() or char in "\r\n\t")
    return " ".join("".join(char for char in kept if char not in "?!~").split())
