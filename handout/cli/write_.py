"""`handout write`: a text to files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from handout import units
from handout.cli import jobs, options, programs, progress, results
from handout.progress import within

_WRITTEN = 0.35  # of the work on a page, when its strokes are known and it is yet to be drawn; measured, for PNG


@click.command("write")
@click.argument("text", nargs=-1)
@click.option("--file", "-f", help="Read the text from a file; - for standard input.")
@click.option(
    "--output", "-o", multiple=True, required=True, help=".svg .png .pdf .inkml .json .gcode .hpgl …; may be repeated."
)
@click.option("--device", help="The plotter that a .gcode, .hpgl or .ebb file is for; default: a common one.")
@options.sheet_options("A4")
@options.writing_options
@options.slips_option
@options.picture_options
def command(text: tuple[str, ...], file: str | None, output: tuple[str, ...], **given: Any) -> None:
    """Write TEXT (or a file, or - for standard input) in handwriting.

    \b
    handout write "Dear Ada, …" -o letter.svg
    handout write --file letter.txt --page A5 --hand house-quick -o letter.pdf -o letter.png
    """
    from handout.sinks import OF_INK, check_outputs, write_drawings

    paths = [Path(name) for name in output]
    extra = programs.Programs(given["device"], paths).sinks
    check_outputs(paths, extra)
    look = options.look(given)
    words = options.text_of(text, file)
    given["page_name"] = options.page_of(given)
    job = jobs.on_paper(jobs.setup(given, given["page_name"], given["margin"], given["pages"]), given)
    shown = frozenset[str]().union(*(jobs.INK if path.suffix.lower() in OF_INK else jobs.STROKES for path in paths))
    notes = [*jobs.unheeded(job, given, shown >= jobs.INK), *results.of_paper(job)]
    with progress.shown(given["quiet"]) as tell:
        pages, drawings = jobs.compose_and_trace(words, job, shown=shown, tell=within(tell, 0.0, _WRITTEN))
        files = write_drawings(
            drawings, paths, **jobs.on_sheet(look, job), extra=extra, tell=within(tell, _WRITTEN, 1.0)
        )
    result = results.summary(pages, drawings, job, files) | results.noted(notes, job, given["quiet"])
    said = (
        f"Wrote {', '.join(map(str, files))}: {units.count(result['lines'], 'line')} on "
        f"{units.count(result['pages'], 'page')}; "
        f"{results.writing_time(result)}seed {job.seed}.{results.lent(result)}{results.slipped(result)}"
    )
    results.report(result, said, as_json=given["as_json"], quiet=given["quiet"])
