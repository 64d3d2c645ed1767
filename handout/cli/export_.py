"""`handout export`: a text as the program of a plotter, in a file."""

from __future__ import annotations

from pathlib import Path

from handout import units
from handout.cli import sentences
from handout.cli.console import Console
from handout.cli.options import given_names, verb
from handout.pipeline.declarations import FILES, option, output
from handout.pipeline.options import SheetOptions, WritingOptions
from handout.pipeline.plot_request import DrawingOptions, ExportOptions
from handout.pipeline.programs import SUFFIXES, check_suffixes


@verb("export")
def command(
    console: Console,
    text: tuple[str, ...],
    file: str | None = option(None, "Read the text from a file; - for standard input.", FILES, flags=("--file", "-f")),
    output: tuple[Path, ...] = output(f"{' '.join(SUFFIXES)}", FILES),
    drawing: DrawingOptions = DrawingOptions(),
    export: ExportOptions = ExportOptions(),
    sheet: SheetOptions = SheetOptions(usual_page="A5"),
    writing: WritingOptions = WritingOptions(),
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
    source = read_source(text, file, console, given_names(), svg_text=drawing.svg_text)
    result = pipeline.export(source, output, writing, sheet, export)
    told = result.told
    dips = "".join(f", {units.count(many, 'dip')} on {name}" for name, many in told.get("dips", {}).items() if many)
    times = ", ".join(f"{units.duration(seconds)} on {name}" for name, seconds in told["devices"].items())
    sentence = f"Wrote {sentences.names(result.files)}: {times}{dips}; seed {result.seed}."
    console.report(result, sentence + sentences.tell_letters(result.tally))
