"""`handout restyle`: a drawing in another handstyle."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from handout.cli import options, results, styling


@click.command("restyle")
@click.argument("source", metavar="DRAWING", type=click.Path(path_type=Path))
@click.option("--output", "-o", multiple=True, required=True, type=click.Path(path_type=Path), help="SVG, PNG, PDF …")
@styling.style_options("fast-tag")
@options.picture_options
@results.output_options
def command(source: Path, output: tuple[Path, ...], **given: Any) -> None:
    """Draw DRAWING (SVG, InkML, JSON, UNIPEN, SVC or GML) in another handstyle.

    Every line is taken as a letter is: its extremes and corners become targets, which a hand in that style moves
    through. What `handout write` wrote as SVG, InkML or JSON can be restyled too.

    \b
    handout restyle drawing.svg -o tag.svg --style fast-tag --seed 1
    """
    from dataclasses import replace

    import numpy as np

    from handout.cli import jobs
    from handout.errors import InputError
    from handout.motion.styles.restyling import losses, restyle
    from handout.sinks import Look, check_outputs, write_drawings
    from handout.sources import read_drawing

    check_outputs(output)
    look, style, seed = styling.look(given), styling.style(given), jobs.seed(given)
    try:
        made = restyle(drawing := read_drawing(source), style, np.random.default_rng(seed))
    except InputError as error:
        raise InputError(str(error) if str(source) in str(error) else f"{source}: {error}") from error
    made = replace(made, about={**made.about, "seed": seed})
    files = write_drawings([made], output, Look(**look))
    left_out = [str(one) for one in drawing.about.get("left_out", [])]
    facts = {
        "style": style.name,
        "seed": seed,
        "strokes_before": len(drawing.strokes),
        "strokes": len(made.strokes),
        "duration_s": round(made.duration, 2),
        "left_out": left_out,
        "warnings": (warnings := losses(drawing, made, style)),
        "files": [str(path) for path in files],
    }
    left = f" Left out: {', '.join(left_out)}." if left_out else ""
    several = drawing.about.get("drawings")
    laid = f" The file's {several} drawings lie beside and below one another." if several else ""
    doubts = "".join(f" Warning: {one}" for one in warnings)
    results.report(facts, styling.said(facts) + left + laid + doubts, as_json=given["as_json"], quiet=given["quiet"])
