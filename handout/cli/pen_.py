"""`handout pen`: a plotter's pen set up: a test sheet, the heights to which it is lifted and lowered, moves by hand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from handout import page_sizes, units
from handout.cli import sentences
from handout.cli.console import Console
from handout.cli.options import verb
from handout.errors import InputError
from handout.pipeline.declarations import MACHINE, option, port, shared
from handout.pipeline.plot_request import HeightOptions

if TYPE_CHECKING:
    from handout.pipeline.pen_setup import Move


@dataclass(frozen=True)
class _Plotter:
    """Which plotter, and where it is."""

    port: str | None = port(None)
    device: str | None = shared(None, "The plotter's profile; see: handout devices list.", MACHINE)


@click.group("pen")
def command() -> None:
    """Set up the pen of a plotter: a test sheet, its heights; move it by hand."""


@verb("test", command)
def test(
    console: Console,
    plotter: _Plotter,
    page: str | None = option(None, f"{page_sizes.HELP} default: A5, or a smaller machine's whole bed."),
    dry_run: tuple[Path, ...] = option((), "Write the sheet instead of plotting."),
    seed: int = option(1, "Of the writing on it."),
) -> None:
    """Draw a sheet that shows what to set: steps, play, speeds, waits for the pen.

    \b
    handout pen test --device plotter-axidraw-v3 --port auto
    handout pen test --device eleksdraw --port /dev/ttyUSB0 --page A4
    handout pen test --device creality-ender-3 --dry-run sheet.svg --dry-run sheet.png
    """
    if plotter.port is None and not dry_run:
        raise InputError("Where to? Give --port /dev/ttyUSB0 (or COM3, or sim:), or --dry-run sheet.svg.")
    from handout.pipeline.pen_setup import test_sheet

    console.yes = True
    result, how_to_read = test_sheet(
        plotter.port, plotter.device, page=page, seed=seed, outputs=dry_run, attendant=console
    )
    if "executed_s" in result.told:
        took = units.duration(result.told["executed_s"])
        console.report(result, f"Plotted the test sheet in {took}. How to read it:")
    else:
        duration = units.duration(result.told["planned_s"])
        console.report(result, f"Wrote {sentences.names(result.files)}; plotting would take {duration}.")
    console.say(*(f"  {line}" for line in how_to_read))


@verb("heights", command)
def heights(
    console: Console,
    plotter: _Plotter,
    heights: HeightOptions,
    yes: bool = option(False, "Do not ask before the pen moves.", flags=("--yes", "-y")),
) -> None:
    """Find how far the pen is to be lifted and lowered, step by step.

    The pen moves only after you have said so. Ctrl-C lifts it.

    \b
    handout pen heights --device axidraw-v3 --port auto
    handout pen heights --device eleksdraw --port /dev/ttyUSB0 --save my-eleksdraw
    handout pen heights --device eleksdraw --port /dev/ttyUSB0 --up 12 --down 36
    """
    from handout.pipeline.pen_setup import find_heights

    console.yes = yes
    result = find_heights(plotter.port, plotter.device, heights, console)
    if not console.as_json:
        click.echo("[pen]\n" + "\n".join(f"{key} = {value:g}" for key, value in result.told.items() if key != "file"))
    if not result.files:
        console.report(result, "Write these lines into the profile, or do this again with --save NAME.")
    else:
        name = result.files[0].stem.removeprefix("plotter-")
        console.report(result, f"Wrote {result.files[0]}; use it with: --device {name}")


def _move(how: Move, plotter: _Plotter, console: Console, x: str = "0", y: str = "0") -> None:
    """Move the pen, and say what has been done, and where it is."""
    from handout.pipeline.pen_setup import move_pen

    move = move_pen(how, plotter.port, plotter.device, x, y, listener=console)
    where = "" if move.position is None else f", at {move.position[0]:g}, {move.position[1]:g} mm"
    console.report(move, f"{move.title}: {move.done}{where}.")


def _add_move(name: str, how: Move, help_: str) -> None:
    """Add a command that moves the pen."""

    @verb(name, command, help=f"{help_}\n\n\b\nhandout pen {name} --device axidraw-v3 --port auto")
    def move(console: Console, plotter: _Plotter) -> None:
        _move(how, plotter, console)


_add_move("up", "up", "Lift the pen.")
_add_move("down", "down", "Lower the pen onto the paper, where it stays.")
_add_move("home", "home", "Lift the pen and go to the machine's zero: by its switches, or as it knows the way.")
_add_move(
    "motors-off",
    "release",
    "Take the power from the motors, so that the carriage can be pushed by hand; the machine forgets where it is.",
)


@verb("jog", command, context_settings={"ignore_unknown_options": True})
def jog(console: Console, x: str, y: str, plotter: _Plotter) -> None:
    """Lift the pen and travel by X and Y along the machine's axes: mm, or lengths such as 2cm.

    \b
    handout pen jog 20 0 --device axidraw-v3 --port auto
    handout pen jog -5mm 12.5mm --device eleksdraw --port /dev/ttyUSB0
    """
    _move("jog", plotter, console, x, y)
