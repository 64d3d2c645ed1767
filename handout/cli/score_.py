"""`handout score`: measures of a page image."""

from __future__ import annotations

import json
from pathlib import Path

import click


@click.command("score")
@click.argument("page", type=click.Path(path_type=Path))
@click.option("--dpi", type=click.FloatRange(50, 2400), help="Of the image, where the file does not say.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
def command(page: Path, dpi: float | None, as_json: bool) -> None:
    """Measure how much the page image PAGE repeats itself (0 for people, 1 for a font).

    \b
    handout score letter.png
    """
    from handout.score.pages import read_page
    from handout.score.repetition import components, repetition

    grey = read_page(page, dpi)
    share, count = repetition(grey), len(components(grey))
    if as_json:
        click.echo(json.dumps({"file": str(page), "repetition": round(share, 4), "components": count}))
    else:
        click.echo(f"repetition {share:.3f} of {count} pieces of ink (people: mostly 0.000, at most about 0.018)")
