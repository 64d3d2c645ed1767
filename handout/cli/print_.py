"""`handout print`: envelopes from a table of addresses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from handout.cli import jobs, options, results
from handout.errors import InputError

if TYPE_CHECKING:
    from handout.printing.batch import Report
    from handout.values import Drawing, Raster
    from handout.writing.layout import Layout

_MOST_NAMED = 12


@click.command("print")
@click.argument("table", type=click.Path(path_type=Path))
@click.option("--printer", default="pdf", show_default=True, help="A printer's profile (epson), or a CUPS queue.")
@click.option("--dry-run", type=click.Path(path_type=Path), help="Write .pdf, .png or .svg instead of printing.")
@click.option("--page", "page_name", default="DL", show_default=True, help="DL C6 C5 number-10 … or WxHmm.")
@click.option("--rows", default="", help="Rows by their numbers in the file, the header is 1: 3-7,9 or 7-.")
@click.option("--copies", type=int, default=1, show_default=True, help="Envelopes for each row.")
@options.writing_options
@options.slips_option
@options.picture_options
def command(
    table: Path, printer: str, dry_run: Path | None, page_name: str, rows: str, copies: int, **given: Any
) -> int:
    """Address an envelope for every row of TABLE (CSV) and print it.

    \b
    handout print --printer epson envelope.csv
    handout print --printer epson envelope.csv --dry-run preview.pdf --rows 2-4
    """
    from click.core import ParameterSource

    from handout.printing import media
    from handout.printing.batch import UNCALIBRATED, PrintingStopped, print_rows
    from handout.printing.submit import resolve
    from handout.printing.table import read_addresses
    from handout.sinks import write_drawings

    if given["slips"]:
        raise InputError("slips: an envelope has to arrive, so addresses are written without slips; leave --slips out.")
    profile = resolve(printer)
    if profile.file and not profile.simulated and dry_run is None:
        raise InputError(f"{printer} writes a file: name it with --dry-run out.pdf, or name a printer with --printer.")
    addresses = read_addresses(table)
    job = jobs.setup(given, page_name, "0mm", 1)
    profile = media.printer_for(job.layout.page, profile)
    look = options.look(given)
    say = results.talk(given["quiet"])
    chosen = click.get_current_context().get_parameter_source("x_height") == ParameterSource.COMMANDLINE
    tally = results.Tally()

    def write(text: str, layout: Layout, row: int) -> Drawing:
        layout = _with_options(layout, job)
        pages, drawings = jobs.compose_and_trace(text, job, layout, row)
        tally.add(pages, drawings)
        return drawings[0]

    def ink(drawing: Drawing, dpi: int) -> Raster:
        from handout.inking import pens

        return pens.ink(drawing, dpi, look["pen"], pens.noise(drawing.about))

    if dry_run is None:
        say(UNCALIBRATED)
    try:
        done = print_rows(
            addresses,
            write,
            profile,
            job.layout.page,
            out=dry_run,
            select=rows,
            copies=copies,
            x_height=job.layout.x_height if chosen else None,
            ink=ink,
            sink=lambda drawing, path: write_drawings([drawing], [path], **look),
            about={"seed": job.seed, "hand": job.hand.name},
            progress=results.progress(given["quiet"]),
        )
    except PrintingStopped as stopped:
        _say_problems(stopped.report, given["quiet"])
        raise
    _say_problems(done, given["quiet"])
    result = tally.facts(job, done.files) | {
        "rows": len(done.rows),
        "failed": [{"row": failed.row, "reason": failed.reason} for failed in done.failed],
        "jobs": [sent.name for sent in done.jobs],
        "warnings": list(done.warnings),
    }
    where = ", ".join(map(str, done.files[:_MOST_NAMED])) or f"{len(done.jobs)} jobs to {profile.queue or printer}"
    said = (
        f"{len(done.rows)} of {len(done.rows) + len(done.failed)} envelopes done ({where}); "
        f"{results.writing_time(result)}seed {job.seed}.{results.lent(result)}"
    )
    results.report(result, said, as_json=given["as_json"], quiet=given["quiet"])
    return done.exit_code


def _with_options(layout: Layout, job: jobs.Setup) -> Layout:
    """The layout of an address with what the user asked for."""
    from dataclasses import replace

    asked = job.layout
    return replace(
        layout, align=asked.align, jitter=asked.jitter, line_spacing=asked.line_spacing or layout.line_spacing
    )


def _say_problems(done: Report, quiet: bool) -> None:
    """Rows that failed are always named; warnings unless the user wants quiet."""
    for failed in done.failed:
        click.echo(f"row {failed.row}: {failed.reason}", err=True)
    if not quiet:
        for warning in done.warnings:
            click.echo(f"warning: {warning}", err=True)
