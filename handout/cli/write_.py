"""`handout write`: a text to files."""

from __future__ import annotations

import click

from handout import units
from handout.cli import options, sentences
from handout.cli.commands import VerbCommand, group_under
from handout.cli.console import Console
from handout.pipeline.declarations import FILES, MACHINE
from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions


@click.command("write", cls=VerbCommand)
@click.argument("text", nargs=-1)
@group_under(
    FILES,
    click.option("--file", "-f", help="Read the text from a file; - for standard input."),
    click.option(
        "--output",
        "-o",
        multiple=True,
        required=True,
        help=".svg .png .pdf .eps .dxf .inkml .json .gcode …; repeatable.",
    ),
)
@group_under(
    MACHINE,
    options.shared("--device", help="The plotter that a .gcode, .hpgl or .ebb file is for; default: a common one."),
)
@options.sheet("A4")
@options.writing
@options.picture
@options.console
def command(
    text: tuple[str, ...],
    file: str | None,
    output: tuple[str, ...],
    device: str | None,
    sheet: SheetOptions,
    writing: WritingOptions,
    picture: PictureOptions,
    console: Console,
) -> None:
    """Write TEXT (or a file, or - for standard input) in handwriting; a .md file is a letter with a layout.

    \b
    handout write "Dear Ada, …" -o letter.svg
    handout write --file letter.txt --page A5 --hand house-quick -o letter.pdf -o letter.png
    handout write letter.md -o letter.pdf -o letter.svg
    """
    from handout.pipeline.inputs import written_source
    from handout.pipeline.writing import write

    source = written_source(text, file, console, options.given_names())
    with console.working():
        result = write(source, output, writing, sheet, picture, device=device, listener=console)
    console.report(
        result,
        f"Wrote {sentences.names(result.files)}: {units.count(result.tally.lines, 'line')} on "
        f"{units.count(result.tally.pages, 'page')}; {sentences.writing_time(result.tally)}seed {result.seed}."
        f"{sentences.tell_letters(result.tally)}",
    )
