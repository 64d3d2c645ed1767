"""`handout pen up`, `down`, `home`, `jog` and `motors-off`: a plotter moved by hand."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from handout import units
from handout.cli import plotting_, results
from handout.errors import InputError

if TYPE_CHECKING:
    from handout.plotting.dialect import Controller

_port = click.option("--port", help="/dev/ttyUSB0, COM3, socket://host:port, auto, or sim: (simulated).")
_device = click.option("--device", help="The plotter's profile; see: handout devices list.")
# a way may be negative, and is no option then
_WAYS = {"ignore_unknown_options": True}


def _do(given: dict[str, Any], done: str, move: Callable[[Controller], None], knows: bool = True) -> None:
    """Connect, move, and say what has been done; `knows` : whether the machine still knows where it is."""
    port, quiet = given["port"], given["quiet"]
    if port is None:
        raise InputError("Where is the plotter? Give --port /dev/ttyUSB0 (or COM3, auto, or sim:).")
    from handout.plotting import open_port
    from handout.plotting.driving import driver
    from handout.plotting.setup import manual

    profile = plotting_.profile(given["device"], port)
    with contextlib.closing(open_port(port, profile)) as opened:
        place = manual.moved(driver.connect(opened, profile, results.talk(quiet)), move)
    at = None if place is None or not knows else [round(value, 3) for value in place]
    result = {"device": profile.name, "done": done, "position": at}
    where = "" if at is None else f", at {at[0]:g}, {at[1]:g} mm"
    results.report(result, f"{profile.title}: {done}{where}.", as_json=given["as_json"], quiet=quiet)


@click.command("up")
@_port
@_device
@results.output_options
def up(**given: Any) -> None:
    """Lift the pen.

    \b
    handout pen up --device axidraw-v3 --port auto
    """
    _do(given, "the pen is up", lambda controller: controller.pen(False))


@click.command("down")
@_port
@_device
@results.output_options
def down(**given: Any) -> None:
    """Lower the pen onto the paper, where it stays.

    \b
    handout pen down --device axidraw-v3 --port auto
    """
    _do(given, "the pen is down", lambda controller: controller.pen(True))


@click.command("home")
@_port
@_device
@results.output_options
def home(**given: Any) -> None:
    """Lift the pen and go to the machine's zero: by its switches, or as it knows the way.

    \b
    handout pen home --device axidraw-v3 --port auto
    """
    from handout.plotting.setup import manual

    _do(given, "the pen is above its zero", manual.home)


@click.command("jog", context_settings=_WAYS)
@click.argument("x")
@click.argument("y")
@_port
@_device
@results.output_options
def jog(x: str, y: str, **given: Any) -> None:
    """Lift the pen and travel by X and Y along the machine's axes: mm, or lengths such as 2cm.

    \b
    handout pen jog 20 0 --device axidraw-v3 --port auto
    handout pen jog -5mm 12.5mm --device eleksdraw --port /dev/ttyUSB0
    """
    from handout.plotting.setup import manual

    dx, dy = units.length(x, "jog x"), units.length(y, "jog y")
    _do(given, f"moved by {dx:g}, {dy:g} mm", lambda controller: manual.jog(controller, dx, dy))


@click.command("motors-off")
@_port
@_device
@results.output_options
def motors_off(**given: Any) -> None:
    """Take the power from the motors, so that the carriage can be pushed by hand; the machine forgets where it is.

    \b
    handout pen motors-off --device axidraw-v3 --port auto
    """
    _do(given, "its motors are off", lambda controller: controller.release(), knows=False)


COMMANDS = (up, down, home, jog, motors_off)
