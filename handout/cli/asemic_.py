"""`handout asemic`: a tag in letters of no alphabet."""

from __future__ import annotations

from pathlib import Path

import click

from handout import page_sizes
from handout.cli import options
from handout.cli.commands import VerbCommand
from handout.cli.console import Console
from handout.cli.restyle_ import sentence
from handout.pipeline.options import PictureOptions, StyleOptions


@click.command("asemic", cls=VerbCommand)
@click.option("--letters", type=int, help="How many letters, 1 to 60; default: 5.")
@click.option("--structure", help="A learned style whose examples the tag is built like; default: that of --style.")
@click.option("--output", "-o", multiple=True, required=True, type=click.Path(path_type=Path), help="SVG, PNG, PDF …")
@click.option("--page", "page_name", default="148x105mm", show_default=True, help=page_sizes.HELP)
@options.style
@options.picture
@options.console
def command(
    letters: int | None,
    structure: str | None,
    output: tuple[Path, ...],
    page_name: str,
    styling: StyleOptions,
    picture: PictureOptions,
    console: Console,
) -> None:
    """Invent letters that mean nothing, and write them as a tag.

    \b
    handout asemic --letters 5 --seed 3 -o tag.svg
    handout asemic --style mine.style --structure hers.style -o mixed.svg
    """
    from handout.pipeline.drawings import asemic

    result = asemic(output, letters, styling, picture, page_name=page_name, structure=structure)
    console.report(result, sentence(result))
