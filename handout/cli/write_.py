"""`handout write`: a text to files."""

from __future__ import annotations

from handout import units
from handout.cli import sentences
from handout.cli.console import Console
from handout.cli.options import given_names, verb
from handout.pipeline.declarations import FILES, MACHINE, option, output, shared
from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions


@verb("write")
def command(
    console: Console,
    text: tuple[str, ...],
    file: str | None = option(None, "Read the text from a file; - for standard input.", FILES, flags=("--file", "-f")),
    output: tuple[str, ...] = output(".svg .png .pdf .eps .dxf .inkml .json .gcode …; repeatable.", FILES),
    device: str | None = shared(
        None, "The plotter that a .gcode, .hpgl or .ebb file is for; default: a common one.", MACHINE
    ),
    sheet: SheetOptions = SheetOptions(usual_page="A4"),
    writing: WritingOptions = WritingOptions(),
    picture: PictureOptions = PictureOptions(),
) -> None:
    """Write TEXT (or a file, or - for standard input) in handwriting; a .md file is a letter with a layout.

    \b
    handout write "Dear Ada, …" -o letter.svg
    handout write --file letter.txt --page A5 --hand house-quick -o letter.pdf -o letter.png
    handout write letter.md -o letter.pdf -o letter.svg
    """
    from handout.pipeline.inputs import written_source
    from handout.pipeline.writing import write

    source = written_source(text, file, console, given_names())
    with console.working():
        result = write(source, output, writing, sheet, picture, device=device, listener=console)
    console.report(
        result,
        f"Wrote {sentences.names(result.files)}: {units.count(result.tally.lines, 'line')} on "
        f"{units.count(result.tally.pages, 'page')}; {sentences.writing_time(result.tally)}seed {result.seed}."
        f"{sentences.tell_letters(result.tally)}",
    )
