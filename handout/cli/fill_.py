"""`handout fill`: the fields of a PDF form, by hand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from handout import units
from handout.cli import options, sentences
from handout.cli.commands import FILES, MACHINE, TABLE, Command, under
from handout.cli.console import Console
from handout.errors import InputError
from handout.pipeline.options import FillOptions, PictureOptions, WritingOptions


@dataclass(frozen=True)
class _Mode:
    """Where the filled-in forms go: to files, or to a plotter."""

    output: tuple[Path, ...]
    port: str | None
    yes: bool


@click.command("fill", cls=Command)
@click.argument("form", type=click.Path(path_type=Path))
@click.argument("answers", type=click.Path(path_type=Path), required=False)
@options.bind(
    "mode",
    _Mode,
    under(
        FILES,
        click.option(
            "--output",
            "-o",
            multiple=True,
            type=click.Path(path_type=Path),
            help=".pdf and .png: the form filled in; .svg .inkml .json .gcode …: the writing alone.  May be repeated.",
        ),
    ),
    options.port(),
    under(MACHINE, click.option("--yes", "-y", is_flag=True, help="With --port: do not stop between sheets.")),
)
@options.bind(
    "filling",
    FillOptions,
    under(
        TABLE,
        click.option(
            "--columns",
            multiple=True,
            metavar="FIELD=COLUMN",
            help='Which column answers a field: "Surname=Last name"; "=Notes" leaves a column out.',
        ),
        click.option("--rows", default="", help="Rows by their numbers in the file, the header is 1: 3-7,9 or 7-."),
    ),
    click.option(
        "--mark", type=click.Choice(["cross", "tick"]), default="cross", show_default=True, help="In check boxes."
    ),
    click.option("--writing-only", is_flag=True, help="Without the form, for sheets that it is printed on already."),
    under(
        MACHINE,
        options.shared(
            "--device", help="The plotter, for --port and .gcode, .hpgl or .ebb files; default: a common one."
        ),
    ),
)
@options.writing
@options.picture
@options.console
def command(
    form: Path,
    answers: Path | None,
    mode: _Mode,
    filling: FillOptions,
    writing: WritingOptions,
    picture: PictureOptions,
    console: Console,
) -> None:
    """Fill in the fields of FORM, a PDF, by hand with ANSWERS (CSV, or .xlsx); without ANSWERS, list its fields.

    ANSWERS has a row a form and a column a field, or the two columns field and value for a single form.

    \b
    handout fill form.pdf
    handout fill form.pdf answers.csv -o filled.pdf
    handout fill form.pdf answers.csv --writing-only -o onto-printed-sheets.pdf
    handout fill form.pdf answers.csv --port /dev/ttyUSB0
    """
    from handout.pipeline import filling as pipeline

    if answers is None:
        if mode.output or "port" in options.given():
            raise InputError(f"With what? Give answers, as handout fill {form} answers.csv.")
        listed = pipeline.fields_of(form)
        if not console.as_json:
            click.echo("\n".join(listed.lines))
        console.report(listed, f"{form}: {units.count(len(listed.lines), 'field')}.")
        return
    if (mode.port is None) == (not mode.output):
        raise InputError("Where to? Give -o filled.pdf, or --port /dev/ttyUSB0 (or COM3, or sim:).")
    if mode.port is not None:
        _plot(form, answers, mode, filling, writing, console)
        return
    with console.working():
        result = pipeline.fill(form, answers, mode.output, filling, writing, picture, listener=console)
    count = f"{units.count(result.entries, 'field')} in {units.count(result.forms, 'form')}"
    console.report(
        result,
        f"Filled in {count} ({sentences.names(result.files)}); {sentences.writing_time(result.tally)}seed "
        f"{result.seed}.{sentences.lent(result.tally)}{sentences.doubted(result.tally)}",
    )


def _plot(
    form: Path, answers: Path, mode: _Mode, filling: FillOptions, writing: WritingOptions, console: Console
) -> None:
    """--port."""
    from handout.cli.operator import Operator
    from handout.pipeline.filling import plot_forms

    assert mode.port is not None
    operator = Operator(mode.port, mode.yes, console.quiet)
    result = plot_forms(form, answers, mode.port, filling, writing, operator=operator, listener=console)
    assert result.tally is not None
    sentence = (
        f"Plotted {units.count(result.sheets, 'sheet')} in {units.duration(result.executed_s)}; seed {result.seed}."
        f"{sentences.lent(result.tally)}{sentences.doubted(result.tally)}"
    )
    console.report(result, f"{sentence}\n{result.fidelity}".strip())
