"""`handout style`: handstyles, learned from examples, and edited by hand."""

from __future__ import annotations

from pathlib import Path

import click

from handout import units
from handout.cli.console import Console
from handout.cli.options import LISTENING, UNSEEN, verb
from handout.pipeline.declarations import argument, output
from handout.pipeline.options import LessonOptions


@click.group("style")
def command() -> None:
    """Learn handstyles, and edit them."""


@verb("learn", command)
def learn(
    console: Console,
    examples: tuple[Path, ...] = argument(required=True, metavar="EXAMPLE..."),
    output: Path = output("The .style file to write."),
    lesson: LessonOptions = LessonOptions(),
) -> None:
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


@verb("edit", command)
def edit(
    style: str,
    port: int | None = LISTENING,
    no_browser: bool = UNSEEN,
) -> None:
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
