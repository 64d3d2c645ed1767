"""What a plotter does besides drawing: dips, wipes, lines of the user's own, as steps that a person writes down.

    go X Y        travel to a place on the bed (machine coordinates); `go NAME`, if the place has a name
    down          lower the pen there; `down VALUE` to another value of its servo, or another height of its Z axis
    up            lift it
    wait TIME     stand still
    send LINE     a line in the machine's own words

A pen that is down when it is told to go draws along the way: a wipe.  It is lifted at the end of the steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from handout import units
from handout.errors import InputError

_LONGEST = 70  # characters of a line, as of the pen's own commands
_WAIT = 600.0  # s; whoever wants to wait longer wants to be asked


class Go(NamedTuple):
    """The pen travels to x, y, mm, machine coordinates."""

    x: float
    y: float


class Lower(NamedTuple):
    """The pen is lowered; value : of its servo, or a height, mm; None: the profile's own."""

    value: float | None = None


class Lift(NamedTuple):
    """The pen is lifted."""


class Wait(NamedTuple):
    """The machine stands still, s."""

    seconds: float


class Send(NamedTuple):
    """Lines in the machine's own words."""

    lines: tuple[str, ...]


Step = Go | Lower | Lift | Wait | Send
Steps = tuple[Step, ...]


def read_steps(texts: Sequence[str], places: Mapping[str, str], what: str) -> Steps:
    """Steps as they are written, one a text; `places` : name → "X Y"; `what` : whose steps, for messages.

    Raises InputError: something that is no step, a place without a name, or a pen that is lowered before it has gone
    anywhere.
    """
    steps: list[Step] = []
    for text in texts:
        step = _step(text, places, what)
        if isinstance(step, Lower) and not any(isinstance(before, Go) for before in steps):
            raise InputError(f"{what}: {text!r} comes before any go, and would mark the sheet: go to a place first.")
        last = steps[-1] if steps else None
        if isinstance(step, Send) and isinstance(last, Send):
            steps[-1] = Send((*last.lines, *step.lines))
        else:
            steps.append(step)
    return tuple(steps)


def _step(text: str, places: Mapping[str, str], what: str) -> Step:
    word, _, rest = text.strip().partition(" ")
    rest = rest.strip()
    if word == "go":
        numbers = places.get(rest, rest).split()
        if len(numbers) != 2:
            named = f"the places with names are {', '.join(places)}" if places else "no place has a name"
            raise InputError(f"{what}: {' '.join(['go', *numbers])}: not two lengths, such as 280mm 20mm; {named}.")
        x, y = (units.length(number, f"{what}, go {rest}") for number in numbers)
        return Go(x, y)
    if word == "wait":
        seconds = units.parse(rest, "time", f"{what}, {text!r}")
        if not 0 < seconds <= _WAIT:
            raise InputError(f"{what}, {text!r}: wait more than 0 s, and {_WAIT:g} s at most.")
        return Wait(seconds)
    if word == "down":
        return Lower(units.length(rest, f"{what}, {text!r}") if rest else None)
    if word == "send":
        return Send((line(rest, what),))
    if word == "up" and not rest:
        return Lift()
    raise InputError(f"{what}: {text!r} is none of: go X Y, go NAME, down, down VALUE, up, wait TIME, send LINE.")


def line(text: str, what: str) -> str:
    """A line of the user's own, one that a controller reads and that does not act out of turn.

    Raises InputError: it is empty, too long, not ASCII, or has one of GRBL's real-time commands in it.
    """
    if not text.strip() or len(text) > _LONGEST or not text.isascii() or not text.isprintable() or set("?!~") & {*text}:
        raise InputError(
            f"{what} has {text!r}, which is not a line of 1 to {_LONGEST} printable ASCII characters other than ? ! ~."
        )
    return text


def goes(steps: Steps) -> list[tuple[float, float]]:
    """The places that steps go to, in order, mm, machine coordinates."""
    return [(step.x, step.y) for step in steps if isinstance(step, Go)]
