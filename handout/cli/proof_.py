"""`handout proof`: every page of a table's letters and envelopes, small, before anything is printed or plotted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from handout import units
from handout.cli import options, sentences
from handout.cli.commands import VerbCommand, group_under
from handout.cli.console import Console
from handout.pipeline.declarations import FILES
from handout.pipeline.options import MergeOptions, PictureOptions, ProofOptions, WritingOptions


@click.command("proof", cls=VerbCommand)
@click.argument("table", type=click.Path(path_type=Path))
@group_under(
    FILES,
    click.option("--output", "-o", multiple=True, type=click.Path(path_type=Path), help="proof.html or proof.pdf."),
)
@options.bind(
    "proofing",
    ProofOptions,
    options.from_dataclass(ProofOptions, leave_out=("copies", "resume", "again", "afresh", "jobs", "cluster")),
)
@options.bind("merge", MergeOptions)
@options.writing
@options.picture
@options.console
def command(
    table: Path,
    output: tuple[Path, ...],
    proofing: ProofOptions,
    merge: MergeOptions,
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
    from handout.pipeline.proofing import proof

    with console.working():
        asked = replace(merge, given=options.given_names())
        result = proof(table, output, proofing, writing, picture, asked, listener=console)
    told = result.told
    for failure in told["failed"]:
        click.echo(f"row {failure['row']}: {failure['reason']}", err=True)
    rows, pages = units.count(told["rows"], "row"), units.count(sum(told["sheets"].values()), "page")
    look = f"; look first at {units.count(len(told['look_at']), 'row')}" if told["look_at"] else ""
    console.report(
        result,
        f"Wrote {sentences.names(result.files)}: {rows}, {pages}{look}; seed {result.seed}. {result.costs.sentence()}",
    )
    return 0 if not told["failed"] else 4 if told["rows"] else 2
