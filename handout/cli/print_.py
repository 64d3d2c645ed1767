"""`handout print`: letters and envelopes from a table."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from handout import units
from handout.cli import sentences
from handout.cli.console import Console
from handout.cli.options import given_names, verb
from handout.pipeline.declarations import MACHINE, option
from handout.pipeline.options import MergeOptions, PictureOptions, PrintOptions, WritingOptions

if TYPE_CHECKING:
    from handout.pipeline.row_work import BatchDelivery

Made = TypeVar("Made", bound="BatchDelivery")


@verb("print")
def command(
    console: Console,
    table: Path,
    printing: PrintOptions,
    merge: MergeOptions,
    yes: bool = option(False, "Do not stop where other paper is to be put in.", MACHINE, flags=("--yes", "-y")),
    writing: WritingOptions = WritingOptions(),
    picture: PictureOptions = PictureOptions(),
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
    from handout.pipeline.printing import print_

    console.yes, asked = yes, replace(merge, given=given_names())
    make = partial(print_, table, printing, writing, picture, asked, attendant=console)
    result = make_rows(make, console.working(), console)
    if result.calibration_note:
        console.say(result.calibration_note)
    sentence = f"{summary(result)}; {sentences.writing_time(result.tally)}seed {result.seed}."
    console.report(result, sentence + sentences.tell_letters(result.tally))
    return result.report.exit_code


def summary(result: BatchDelivery) -> str:
    """What became of a batch, in a few words; of several devices which rows each made."""
    report = result.report
    files = ", ".join(map(str, report.files[: units.MOST_NAMED]))
    jobs = units.count(len({job.name for job in report.jobs}), "job")
    where = f" ({files or f'{jobs} to {result.shares or result.destination}'})" if files or report.jobs else ""
    before = f", {len(report.before)} before" if report.before else ""
    wanted = units.count(len(report.rows) + len(report.failed), "row" if result.letters else "envelope")
    return f"{len(report.rows)} of {wanted} done{where}{before}"


def make_rows(make: Callable[[], Made], block: contextlib.AbstractContextManager[object], console: Console) -> Made:
    """Make the rows of a table in a block; those that failed are always named, warnings unless the user wants quiet."""
    from handout.pipeline.printing import PrintingStopped, RowsRefused

    stopped: PrintingStopped | RowsRefused | None = None
    try:
        with block:
            report = (result := make()).report
    except (PrintingStopped, RowsRefused) as error:
        stopped, report = error, error.report
    for complaint in report.complaints():
        click.echo(complaint, err=True)
    for row in report.unknown:
        way_out = f"look whether the sheet is there; --resume --again {row.row} makes it again"
        click.echo(f"row {row.row}: {row.reason}; {way_out}.", err=True)
    console.say(*(f"warning: {warning}" for warning in report.warnings))
    if stopped is not None:
        raise stopped
    return result
