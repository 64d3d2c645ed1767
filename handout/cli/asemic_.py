"""`handout asemic`: a tag in letters of no alphabet."""

from __future__ import annotations

from pathlib import Path

from handout import page_sizes
from handout.cli.console import Console
from handout.cli.options import verb
from handout.cli.restyle_ import sentence
from handout.pipeline.declarations import option, output
from handout.pipeline.options import PictureOptions, StyleOptions


@verb("asemic")
def command(
    console: Console,
    letters: int | None = option(None, "How many letters, 1 to 60; default: 5."),
    structure: str | None = option(
        None, "A learned style whose examples the tag is built like; default: that of --style."
    ),
    output: tuple[Path, ...] = output("SVG, PNG, PDF …"),
    page_name: str = option("148x105mm", page_sizes.HELP, flags=("--page",)),
    styling: StyleOptions = StyleOptions(),
    picture: PictureOptions = PictureOptions(),
) -> None:
    """Invent letters that mean nothing, and write them as a tag.

    \b
    handout asemic --letters 5 --seed 3 -o tag.svg
    handout asemic --style mine.style --structure hers.style -o mixed.svg
    """
    from handout.pipeline.drawings import asemic

    result = asemic(output, letters, styling, picture, page_name=page_name, structure=structure)
    console.report(result, sentence(result))
