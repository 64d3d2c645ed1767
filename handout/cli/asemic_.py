"""`handout asemic`: a tag in letters of no alphabet."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from handout import page_sizes
from handout.cli import options, results, styling


@click.command("asemic")
@click.option("--letters", type=int, default=5, show_default=True, help="How many letters, 1 to 60.")
@click.option("--output", "-o", multiple=True, required=True, type=click.Path(path_type=Path), help="SVG, PNG, PDF …")
@click.option("--page", "page_name", default="148x105mm", show_default=True, help=page_sizes.HELP)
@styling.style_options("fast-tag")
@options.picture_options
@results.output_options
def command(letters: int, output: tuple[Path, ...], page_name: str, **given: Any) -> None:
    """Invent letters that mean nothing, and write them as a tag.

    \b
    handout asemic --letters 5 --seed 3 -o tag.svg
    """
    from dataclasses import replace

    import numpy as np

    from handout.cli import jobs
    from handout.motion.styles.asemic import tag
    from handout.page_sizes import page
    from handout.sinks import Look, check_outputs, write_drawings

    check_outputs(output)
    look, style, seed = styling.look(given), styling.style(given), jobs.seed(given)
    made = tag(letters, style, page(page_name), np.random.default_rng(seed))
    made = replace(made, about={**made.about, "seed": seed})
    files = write_drawings([made], output, Look(**look))
    facts = {
        "style": style.name,
        "seed": seed,
        "letters": letters,
        "strokes": len(made.strokes),
        "duration_s": round(made.duration, 2),
        "files": [str(path) for path in files],
    }
    results.report(facts, styling.said(facts), as_json=given["as_json"], quiet=given["quiet"])
