"""`handout brush`: brushes learned from photographs of strokes."""

from __future__ import annotations

from pathlib import Path

import click

from handout import units
from handout.cli import options
from handout.cli.commands import VerbGroup
from handout.cli.console import Console


@click.group("brush", cls=VerbGroup)
def command() -> None:
    """Learn a brush from photographs of its strokes, and show it; --pen takes it then."""


@command.command("learn")
@click.argument("photographs", nargs=-1, required=True, metavar="PHOTO...", type=click.Path(path_type=Path))
@click.option("--output", "-o", required=True, type=click.Path(path_type=Path), help="A .brush file.")
@click.option("--width", help="Usual width of its line when it writes; default: 0.8mm.")
@click.option("--title", default="", help="What to call it, for people.")
@options.console
def learn(photographs: tuple[Path, ...], output: Path, width: str | None, title: str, console: Console) -> None:
    """Learn a brush from photographs or scans of strokes on light paper, one or several to a picture.

    Frames and numbers beside the strokes do not matter. Strokes need some paper all around, may not cross, and are
    longer than they are wide; three or more, wet and dry, make a better brush than one.

    \b
    handout brush learn stroke1.png stroke2.jpg -o dry.brush
    handout write "Happy birthday" --pen dry.brush --x-height 8mm --pen-width 2.5mm -o card.png
    """
    from handout.pipeline.brushes import learn

    with console.working():
        result = learn(photographs, output, width=width, title=title)
    lengths, strokes = result.told["lengths_in_widths"], units.count(result.told["strokes"], "stroke")
    wide = ", ".join(f"{length:g}" for length in lengths)
    console.report(result, f"Wrote {output}: {strokes}, {wide} times as long as wide.")


@command.command("show")
@click.argument("brush")
@click.option("--output", "-o", required=True, type=click.Path(path_type=Path), help="A PNG file.")
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Of the strokes on it.")
@options.console
def show(brush: str, output: Path, seed: int, console: Console) -> None:
    """Show what BRUSH (a name, or a .brush file) was learned from, and how it paints.

    \b
    handout brush show dry.brush -o sheet.png
    """
    from handout.pipeline.brushes import show

    result = show(brush, output, seed)
    strokes = units.count(result.told["strokes"], "stroke")
    console.report(result, f"Wrote {output}: {strokes}, and what is made of them.")
