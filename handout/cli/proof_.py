"""`handout proof`: every page of a table's letters and envelopes, small, before anything is printed or plotted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from handout import page_sizes, units
from handout.cli import options, sentences
from handout.cli.commands import FILES, MACHINE, PAGE, TABLE, Command, under
from handout.cli.console import Console
from handout.pipeline.options import MergeOptions, PictureOptions, TableOptions, WritingOptions


@click.command("proof", cls=Command)
@click.argument("table", type=click.Path(path_type=Path))
@under(
    FILES,
    click.option("--output", "-o", multiple=True, type=click.Path(path_type=Path), help="proof.html or proof.pdf."),
)
@options.bind(
    "proofing",
    dict,
    under(
        PAGE,
        click.option("--page", help=f"{page_sizes.HELP}  [default: A4, of a plotter A5, without a letter DL]"),
        click.option("--margin", help=f"Of letters: {options.SIDES}"),
        click.option("--pages", type=click.IntRange(1), help="How many pages a letter may have."),
    ),
    under(
        MACHINE,
        click.option("--printer", default="", help="Whose reach is looked at: a printer's profile, or its queue."),
        click.option("--device", default="", help="Whose reach and time are looked at: a plotter's profile."),
    ),
    under(
        TABLE,
        click.option("--prices", default="", metavar="NAME=…,…", help="sheet=0.02,envelope=0.1,hour=4,currency=EUR …"),
    ),
)
@options.bind("batch", options.batch, options.ROWS, options.LETTERS, options.ENVELOPES)
@options.writing
@options.picture
@options.console
def command(
    table: Path,
    output: tuple[Path, ...],
    proofing: dict[str, object],
    batch: tuple[TableOptions, MergeOptions],
    writing: WritingOptions,
    picture: PictureOptions,
    console: Console,
) -> int:
    """Show every page of the letters and envelopes that TABLE makes, with what to look at first.

    \b
    handout proof people.csv --letter letter.md -o proof.html
    handout proof people.csv --letter letter.md --with-envelopes --printer epson -o proof.html -o proof.pdf
    handout print people.csv --letter letter.md --printer epson --approved proof.json

    proof.json says what was looked at: a run that is told of it refuses whatever has changed since.
    """
    from handout.pipeline.proofing import ProofOptions, proof

    with console.working():
        asked = ProofOptions(**{**vars(batch[0]), **proofing})
        merge = replace(batch[1], given=options.given())
        result = proof(table, output, asked, writing, picture, merge, listener=console)
    for row, reason in result.failed.items():
        click.echo(f"row {row}: {reason}", err=True)
    rows = units.count(len(result.rows), "row")
    look = f"; look first at {units.count(len(result.looked), 'row')}" if result.looked else ""
    pages = units.count(sum(result.sheets.values()), "page")
    console.report(
        result,
        f"Wrote {sentences.names(result.files)}: {rows}, {pages}{look}; seed {result.seed}. {result.costs.sentence()}",
    )
    return 0 if not result.failed else 4 if result.rows else 2
