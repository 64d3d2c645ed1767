"""`handout export`: a text as the program of a plotter, in a file."""

from __future__ import annotations

from pathlib import Path

import click

from handout import units
from handout.cli import options, sentences
from handout.cli.commands import VerbCommand, group_under
from handout.cli.console import Console
from handout.pipeline.declarations import FILES
from handout.pipeline.options import SheetOptions, WritingOptions
from handout.pipeline.plot_request import DrawingOptions, ExportOptions
from handout.pipeline.programs import SUFFIXES, check_suffixes


@click.command("export", cls=VerbCommand)
@click.argument("text", nargs=-1)
@group_under(
    FILES,
    click.option("--file", "-f", help="Read the text from a file; - for standard input."),
    click.option(
        "--output", "-o", multiple=True, required=True, type=click.Path(path_type=Path), help=f"{' '.join(SUFFIXES)}"
    ),
)
@options.bind("drawing", DrawingOptions)
@options.bind("export", ExportOptions)
@options.sheet("A5")
@options.writing
@options.console
def command(
    text: tuple[str, ...],
    file: str | None,
    output: tuple[Path, ...],
    drawing: DrawingOptions,
    export: ExportOptions,
    sheet: SheetOptions,
    writing: WritingOptions,
    console: Console,
) -> None:
    """Write TEXT (a file, a drawing, or - for standard input) as the program of a plotter, for something else to send.

    \b
    handout export letter.txt -o job.gcode
    handout export letter.txt -o job.hpgl --device hp-7475a
    handout export drawing.svg -o job.gcode --order travel
    """
    from handout.pipeline import writing as pipeline
    from handout.pipeline.inputs import read_source

    check_suffixes(output)
    source = read_source(text, file, console, options.given_names(), svg_text=drawing.svg_text)
    result = pipeline.export(source, output, writing, sheet, export)
    told = result.told
    dips = "".join(f", {units.count(many, 'dip')} on {name}" for name, many in told.get("dips", {}).items() if many)
    times = ", ".join(f"{units.duration(seconds)} on {name}" for name, seconds in told["devices"].items())
    sentence = f"Wrote {sentences.names(result.files)}: {times}{dips}; seed {result.seed}."
    console.report(result, sentence + sentences.tell_letters(result.tally))
