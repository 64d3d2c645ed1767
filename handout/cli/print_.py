"""`handout print`: envelopes from a table of addresses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from handout import page_sizes, units
from handout.cli import options, sentences
from handout.cli.console import Console
from handout.pipeline.options import PictureOptions, PrintOptions, WritingOptions

if TYPE_CHECKING:
    from handout.pipeline.printing import Printed, Report

_MOST_NAMED = 12  # files that are named at the end


_printing = options.bind(
    "printing",
    PrintOptions,
    click.option("--printer", default="pdf", show_default=True, help="A printer's profile (epson), queue, or ipp://…"),
    click.option("--queue", default="", help="Where the pages go: a CUPS queue, ipp://HOST/ipp/print, or file:FOLDER."),
    click.option("--dry-run", type=click.Path(path_type=Path), help="Write .pdf, .png or .svg instead of printing."),
    click.option("--page", default="DL", show_default=True, help=page_sizes.HELP),
    click.option("--rows", default="", help="Rows by their numbers in the file, the header is 1: 3-7,9 or 7-."),
    click.option(
        "--columns", multiple=True, metavar="WHAT=COLUMN", help='What columns hold: "name=Guest(s)" or "1=name".'
    ),
    click.option("--address", default="", help="Of several addresses of a row: home, business, 2 …"),
    click.option("--no-name", is_flag=True, help="Print a table that has no names."),
    click.option("--copies", type=int, default=1, show_default=True, help="Envelopes for each row."),
    click.option("--resume", is_flag=True, help="Go on with a batch that broke off: print exactly the rest of it."),
    click.option("--again", default="", metavar="ROWS", help="With --resume: print these whatever became of them."),
    click.option("--afresh", is_flag=True, help="Print all of it, though an earlier run of it broke off."),
    click.option("--tray", default="", help="Feed from this tray, as the printer calls it (rear, main …)."),
    click.option("--feed", type=click.Choice(["short", "long"]), help="The edge of the sheet that goes in first."),
    click.option(
        "--flap",
        type=click.Choice(["left", "right", "leading", "trailing"]),
        help="Where an envelope's flap is, print side towards you, the edge that goes in first upwards.",
    ),
    click.option("--nudge", metavar="X,Y", help="Move the writing to the right and down: 1.5mm,-0.5mm."),
    click.option(
        "--format", type=click.Choice(["pdf", "pwg", "urf", "png"]), help="Of what is sent; default: the best."
    ),
    click.option("--calibration", default="", help="A printer/paper, a file, or none; default: the printer's newest."),
    click.option("--stock", default="", help="What paper is in the printer, as it was called when it was calibrated."),
)


@click.command("print")
@click.argument("table", type=click.Path(path_type=Path))
@_printing
@options.writing
@options.picture
@options.console
def command(
    table: Path, printing: PrintOptions, writing: WritingOptions, picture: PictureOptions, console: Console
) -> int:
    """Address an envelope for every row of TABLE (CSV, or .xlsx) and print it.

    \b
    handout print --printer epson envelope.csv
    handout print --printer epson envelope.csv --dry-run preview.pdf --rows 2-4
    handout print --printer epson --calibration epson/cream envelope.csv
    handout print --printer epson --queue ipp://192.168.1.7/ipp/print envelope.csv
    handout print --printer epson --queue ipp://192.168.1.7/ipp/print envelope.csv --resume
    """
    from handout.pipeline.printing import PrintingStopped, print_

    try:
        with console.working():
            result = print_(table, printing, writing, picture, listener=console)
    except PrintingStopped as stopped:
        _name_problems(stopped.report, console)
        raise
    _name_problems(result.report, console)
    if result.calibration_note:
        console.say(result.calibration_note)
    sentence = f"{_summary(result)}; {sentences.writing_time(result.tally)}seed {result.seed}."
    console.report(result, sentence + sentences.lent(result.tally) + sentences.doubted(result.tally))
    return result.report.exit_code


def _summary(result: Printed) -> str:
    """What became of a batch, in a few words."""
    report = result.report
    files = ", ".join(map(str, report.files[:_MOST_NAMED]))
    where = files or f"{units.count(len(report.jobs), 'job')} to {result.destination}"
    before = f", {len(report.before)} before" if report.before else ""
    wanted = units.count(len(report.rows) + len(report.failed), "envelope")
    return f"{len(report.rows)} of {wanted} done ({where}){before}"


def _name_problems(report: Report, console: Console) -> None:
    """Rows that failed are always named; warnings unless the user wants quiet."""
    for failure in report.failed:
        click.echo(f"row {failure.row}: {failure.reason}", err=True)
    for row in report.unknown:
        way_out = f"look whether the envelope is there; --resume --again {row.row} prints it again"
        click.echo(f"row {row.row}: {row.reason}; {way_out}.", err=True)
    console.say(*(f"warning: {warning}" for warning in report.warnings))
