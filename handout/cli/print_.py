"""`handout print`: letters and envelopes from a table."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from handout import page_sizes, units
from handout.cli import options, sentences
from handout.cli.commands import ENVELOPES, FILES, MACHINE, PAGE, PARTS, Command, under
from handout.cli.console import Console
from handout.pipeline.options import MergeOptions, PictureOptions, PrintOptions, WritingOptions

if TYPE_CHECKING:
    from handout.pipeline.printing import Printed, Report

_MOST_NAMED = 12  # files that are named at the end


_printing = options.bind(
    "printing",
    PrintOptions,
    under(
        MACHINE,
        options.shared(
            "--printer", default="pdf", show_default=True, help="A printer's profile (epson), queue, or ipp://…"
        ),
        click.option(
            "--queue",
            multiple=True,
            help="Where pages go: a CUPS queue, ipp://HOST/ipp/print, file:FOLDER; several share.",
        ),
        click.option("--tray", default="", help="Feed from this tray, as the printer calls it (rear, main …)."),
        click.option("--feed", type=click.Choice(["short", "long"]), help="The edge of the sheet that goes in first."),
        click.option("--nudge", metavar="X,Y", help="Move the writing to the right and down: 1.5mm,-0.5mm."),
        click.option(
            "--format", type=click.Choice(["pdf", "pwg", "urf", "png"]), help="Of what is sent; default: the best."
        ),
        click.option(
            "--calibration", default="", help="A printer/paper, a file, or none; default: the printer's newest."
        ),
        click.option(
            "--stock", default="", help="What paper is in the printer, as it was called when it was calibrated."
        ),
    ),
    under(
        FILES,
        click.option(
            "--dry-run", type=click.Path(path_type=Path), help="Write .pdf, .png or .svg instead of printing."
        ),
    ),
    under(PAGE, click.option("--page", help=f"{page_sizes.HELP}  [default: A4, or without a letter DL]")),
    options.ROWS,
    options.AGAIN,
    options.AFRESH,
    options.WORKERS,
    under(
        PARTS,
        click.option("--copies", type=int, default=1, show_default=True, help="Of each row."),
        click.option("--resume", is_flag=True, help="Go on with a batch that broke off: print exactly the rest of it."),
    ),
    under(
        ENVELOPES,
        click.option(
            "--envelopes-to", multiple=True, metavar="PRINTER", help="Where envelopes go, if not with letters."
        ),
        click.option(
            "--flap",
            type=click.Choice(["left", "right", "leading", "trailing"]),
            help="Where an envelope's flap is, print side towards you, the edge that goes in first upwards.",
        ),
    ),
)
_merging = options.bind(
    "merge",
    MergeOptions,
    options.LETTERS,
    options.ENVELOPES,
    under(
        PAGE,
        click.option("--margin", help=f"Of letters: {options.SIDES}"),
        click.option("--pages", type=click.IntRange(1), help="How many pages a letter may have."),
    ),
)


@click.command("print", cls=Command)
@click.argument("table", type=click.Path(path_type=Path))
@_printing
@_merging
@under(MACHINE, click.option("--yes", "-y", is_flag=True, help="Do not stop where other paper is to be put in."))
@options.writing
@options.picture
@options.console
def command(
    table: Path,
    printing: PrintOptions,
    merge: MergeOptions,
    yes: bool,
    writing: WritingOptions,
    picture: PictureOptions,
    console: Console,
) -> int:
    """Print an envelope, a letter or both for every row of TABLE (CSV, or .xlsx).

    \b
    handout print --printer epson envelope.csv
    handout print --printer epson people.csv --letter letter.txt --with-envelopes
    handout print --printer epson envelope.csv --dry-run preview.pdf --rows 2-4
    handout print --printer epson --calibration epson/cream envelope.csv
    handout print --printer epson --queue ipp://192.168.1.7/ipp/print envelope.csv
    handout print --printer epson --queue ipp://192.168.1.7/ipp/print envelope.csv --resume
    handout print --printer epson --queue office --queue attic people.csv --letter letter.txt
    """
    from handout.pipeline.printing import PrintingStopped, RowsRefused, print_

    def change(request: str) -> None:
        if yes or not sys.stdin.isatty():
            console.say(f"{request}.")
        else:
            click.prompt(f"{request} and press Enter", default="", show_default=False, prompt_suffix=" ", err=True)

    try:
        with console.working():
            asked = replace(merge, given=options.given())
            result = print_(table, printing, writing, picture, asked, change=change, listener=console)
    except (PrintingStopped, RowsRefused) as stopped:
        name_problems(stopped.report, console)
        raise
    name_problems(result.report, console)
    if result.calibration_note:
        console.say(result.calibration_note)
    sentence = f"{summary(result)}; {sentences.writing_time(result.tally)}seed {result.seed}."
    console.report(result, sentence + sentences.lent(result.tally) + sentences.doubted(result.tally))
    return result.report.exit_code


def summary(result: Printed) -> str:
    """What became of a batch, in a few words; of several devices which rows each made."""
    report = result.report
    files = ", ".join(map(str, report.files[:_MOST_NAMED]))
    jobs = units.count(len({job.name for job in report.jobs}), "job")
    where = files or f"{jobs} to {result.shared or result.destination}"
    before = f", {len(report.before)} before" if report.before else ""
    wanted = units.count(len(report.rows) + len(report.failed), "row" if result.letters else "envelope")
    return f"{len(report.rows)} of {wanted} done ({where}){before}"


def name_problems(report: Report, console: Console) -> None:
    """Rows that failed are always named; warnings unless the user wants quiet."""
    for failure in report.failed:
        click.echo(f"row {failure.row}: {failure.reason}", err=True)
    for row in report.unknown:
        way_out = f"look whether the sheet is there; --resume --again {row.row} makes it again"
        click.echo(f"row {row.row}: {row.reason}; {way_out}.", err=True)
    console.say(*(f"warning: {warning}" for warning in report.warnings))
