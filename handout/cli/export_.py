"""`handout export`: a text as the program of a plotter, in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import click

from handout import units
from handout.cli import drawings as drawn_
from handout.cli import jobs, options, results
from handout.errors import InputError
from handout.pipeline import programs


@click.command("export")
@click.argument("text", nargs=-1)
@click.option("--file", "-f", help="Read the text from a file; - for standard input.")
@click.option(
    "--output", "-o", multiple=True, required=True, type=click.Path(path_type=Path), help=f"{' '.join(programs.USUAL)}"
)
@click.option("--device", help="The plotter it is for; default: a common one that reads such files.")
@click.option(
    "--order", type=click.Choice(["writing", "travel"]), default="writing", show_default=True, help="Of words."
)
@options.sheet_options("A5")
@options.writing_options
@options.slips_option
def command(
    text: tuple[str, ...],
    file: str | None,
    output: tuple[Path, ...],
    device: str | None,
    order: Literal["writing", "travel"],
    **given: Any,
) -> None:
    """Write TEXT (a file, a drawing, or - for standard input) as the program of a plotter, for something else to send.

    \b
    handout export letter.txt -o job.gcode
    handout export letter.txt -o job.hpgl --device hp-7475a
    handout export drawing.svg -o job.gcode --order travel
    """
    from handout.sinks import check_outputs, write_drawings

    for path in output:
        if path.suffix.lower() not in programs.USUAL:
            raise InputError(
                f"{path}: programs of plotters end in {', '.join(programs.USUAL)}; handout write does the rest."
            )
    drawing = drawn_.given(text, file, quiet=given["quiet"])
    words = "" if drawing else options.text_of(*drawn_.named_file(text, file, given["quiet"]))
    job = jobs.setup(given, given["page_name"], given["margin"], given["pages"])
    made = programs.Programs(device, output, fast=job.fast, fit=given["fit"], order=order)
    check_outputs(output, made.sinks)
    if drawing is None:
        pages, drawings = jobs.compose_and_trace(words, job, shown=jobs.STROKES)
    else:
        pages, drawings = [drawn_.unwritten(drawing)], [drawing]
    files = write_drawings(drawings, output, extra=made.sinks)
    result = results.summary(pages, drawings, job, files)
    result["devices"] = {name: round(seconds, 2) for name, seconds in made.seconds.items()}
    times = ", ".join(f"{units.duration(seconds)} on {name}" for name, seconds in made.seconds.items())
    said = f"Wrote {', '.join(map(str, files))}: {times}; seed {job.seed}."
    said += results.lent(result) + results.slipped(result)
    results.report(result, said, as_json=given["as_json"], quiet=given["quiet"])
