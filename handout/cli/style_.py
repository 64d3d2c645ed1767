"""`handout style`: handstyles, learned from examples."""

from __future__ import annotations

from pathlib import Path

import click

from handout import units
from handout.cli import options
from handout.cli.console import Console
from handout.pipeline.options import LessonOptions


@click.group("style")
def command() -> None:
    """Learn handstyles."""


@command.command("learn")
@click.argument("examples", metavar="EXAMPLE...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--output", "-o", required=True, type=click.Path(path_type=Path), help="The .style file to write.")
@options.bind(
    "lesson",
    LessonOptions,
    click.option("--title", help="What to call it, for people; default: the name of the file."),
    click.option(
        "--size",
        type=click.Choice(("small", "berio_2017")),
        default="small",
        show_default=True,
        help="Of the networks; berio_2017 is that of the paper, and takes hours.",
    ),
    click.option(
        "--inputs",
        type=click.Choice(("ahead", "local", "berio_2017", "berio_2017_no_history")),
        default="ahead",
        show_default=True,
        help="What they are told of a stroke.",
    ),
    click.option("--seed", type=int, default=0, show_default=True, help="Same seed, same style."),
)
@options.console
def learn(examples: tuple[Path, ...], output: Path, lesson: LessonOptions, console: Console) -> None:
    """Learn how a hand moves from drawings of it, GML, InkML, UNIPEN, SVC, SVG or JSON: one is enough.

    \b
    handout style learn tag.gml -o tag.style
    handout restyle drawing.svg --style tag.style -o out.svg
    """
    from handout.pipeline.styles import learn_style

    with console.working():
        result = learn_style(examples, output, lesson, console)
    console.report(
        result,
        f"Wrote {output}: learned from {units.count(result.drawings, 'drawing')}, "
        f"{units.count(result.strokes, 'stroke')} of {1e3 * result.duration_s:.0f} ms.",
    )
