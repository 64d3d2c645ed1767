"""`handout proof`: every page of a table's letters and envelopes, small, before anything is printed or plotted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from handout import units
from handout.cli import sentences
from handout.cli.console import Console
from handout.cli.options import given_names, verb
from handout.pipeline.declarations import FILES, bundle, option
from handout.pipeline.options import MergeOptions, PictureOptions, ProofOptions, WritingOptions


@verb("proof")
def command(
    console: Console,
    table: Path,
    output: tuple[Path, ...] = option((), "proof.html or proof.pdf.", FILES, flags=("--output", "-o")),
    proofing: ProofOptions = bundle(ProofOptions(), leave_out=("copies", "resume", "again", "afresh")),
    merge: MergeOptions = MergeOptions(),
    writing: WritingOptions = WritingOptions(),
    picture: PictureOptions = PictureOptions(),
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
        asked = replace(merge, given=given_names())
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
