"""`handout restyle`: a drawing in another handstyle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from handout import units
from handout.cli import options
from handout.cli.console import Console
from handout.pipeline.options import PictureOptions, StyleOptions

if TYPE_CHECKING:
    from handout.pipeline.drawings import Styled


@click.command("restyle")
@click.argument("source", metavar="DRAWING", type=click.Path(path_type=Path))
@click.option("--output", "-o", multiple=True, required=True, type=click.Path(path_type=Path), help="SVG, PNG, PDF …")
@options.style
@options.picture
@options.console
def command(
    source: Path, output: tuple[Path, ...], styling: StyleOptions, picture: PictureOptions, console: Console
) -> None:
    """Draw DRAWING (SVG, InkML, JSON, UNIPEN, SVC or GML) in another handstyle.

    Every line is taken as a letter is: its extremes and corners become targets, which a hand in that style moves
    through. What `handout write` wrote as SVG, InkML or JSON can be restyled too.

    \b
    handout restyle drawing.svg -o tag.svg --style fast-tag --seed 1
    """
    from handout.pipeline.drawings import restyle

    result = restyle(source, output, styling, picture)
    left_out = f" Left out: {', '.join(result.left_out)}." if result.left_out else ""
    count = result.source.about.get("drawings") if result.source is not None else None
    several = f" The file's {count} drawings lie beside and below one another." if count else ""
    warnings = "".join(f" Warning: {loss}" for loss in result.losses)
    console.report(result, sentence(result) + left_out + several + warnings)


def sentence(result: Styled) -> str:
    """One sentence about a drawing in a handstyle."""
    return (
        f"Wrote {', '.join(map(str, result.files))}: {units.count(len(result.drawing.strokes), 'stroke')} in the style "
        f"{result.style}; {units.duration(round(result.drawing.duration, 2))} of writing; seed {result.seed}."
    )
