"""`handout brush`: brushes learned from photographs of strokes."""

from __future__ import annotations

from pathlib import Path

import click

from handout import units
from handout.cli.console import Console
from handout.cli.options import verb
from handout.pipeline.declarations import argument, option, output


@click.group("brush")
def command() -> None:
    """Learn a brush from photographs of its strokes, and show it; --pen takes it then."""


@verb("learn", command)
def learn(
    console: Console,
    photographs: tuple[Path, ...] = argument(required=True, metavar="PHOTO..."),
    output: Path = output("A .brush file."),
    width: str | None = option(None, "Usual width of its line when it writes; default: 0.8mm."),
    title: str = option("", "What to call it, for people."),
) -> None:
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


@verb("show", command)
def show(
    console: Console,
    brush: str,
    output: Path = output("A PNG file."),
    seed: int = option(1, "Of the strokes on it.", least=0),
) -> None:
    """Show what BRUSH (a name, or a .brush file) was learned from, and how it paints.

    \b
    handout brush show dry.brush -o sheet.png
    """
    from handout.pipeline.brushes import show

    result = show(brush, output, seed)
    strokes = units.count(result.told["strokes"], "stroke")
    console.report(result, f"Wrote {output}: {strokes}, and what is made of them.")
