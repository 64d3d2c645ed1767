"""`handout style`: handstyles, learned from examples, and edited by hand."""

from __future__ import annotations

from pathlib import Path

import click

from handout import units
from handout.cli import options
from handout.cli.commands import VerbGroup
from handout.cli.console import Console
from handout.pipeline.options import LessonOptions


@click.group("style", cls=VerbGroup)
def command() -> None:
    """Learn handstyles, and edit them."""


@command.command("learn")
@click.argument("examples", metavar="EXAMPLE...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--output", "-o", required=True, type=click.Path(path_type=Path), help="The .style file to write.")
@options.bind("lesson", LessonOptions)
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
        f"Wrote {output}: learned from {units.count(result.told['drawings'], 'drawing')}, "
        f"{units.count(result.told['strokes'], 'stroke')} of {1e3 * result.told['duration_s']:.0f} ms.",
    )


@command.command("edit")
@click.argument("style")
@click.option("--port", type=click.IntRange(1, 65535), help="Where it listens; default: 7217, or any that is free.")
@click.option("--no-browser", is_flag=True, help="Print the link and open nothing.")
def edit(style: str, port: int | None, no_browser: bool) -> None:
    """Edit a handstyle in the browser: STYLE is a .toml or .style file, which may be new, or the name of a style.

    \b
    handout style edit tag.toml
    handout style edit blackletter
    """
    from handout.cli.studio_ import open_studio
    from handout.pipeline.style_editor import open_style

    path = Path(style)
    given = path.suffix in (".toml", ".style")
    open_style(style)  # what cannot be read is said here
    open_studio(
        (style,) if given else (), f"style/{path.stem if given else style}", port, not no_browser, as_json=False
    )
