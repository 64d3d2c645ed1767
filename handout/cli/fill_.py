"""`handout fill`: the fields of a PDF form, by hand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from handout import units
from handout.cli import sentences
from handout.cli.console import Console
from handout.cli.options import given_names, verb
from handout.errors import InputError
from handout.pipeline.declarations import FILES, MACHINE, option, port
from handout.pipeline.options import FillOptions, PictureOptions, WritingOptions


@dataclass(frozen=True)
class _FillMode:
    """Where the filled-in forms go: to files, or to a plotter."""

    output: tuple[Path, ...] = option(
        (),
        ".pdf and .png: the form filled in; .svg .inkml .json .gcode …: the writing alone.  May be repeated.",
        FILES,
        flags=("--output", "-o"),
    )
    yes: bool = option(False, "With --port: do not stop between sheets.", MACHINE, flags=("--yes", "-y"))
    port: str | None = port(None)


@verb("fill")
def command(
    console: Console,
    form: Path,
    answers: Path | None,
    mode: _FillMode,
    filling: FillOptions,
    writing: WritingOptions,
    picture: PictureOptions,
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
        if mode.output or "port" in given_names():
            raise InputError(f"With what? Give answers, as handout fill {form} answers.csv.")
        listed = pipeline.fields_of(form)
        if not console.as_json:
            click.echo("\n".join(listed.lines))
        console.report(listed, f"{form}: {units.count(len(listed.lines), 'field')}.")
        return
    if (mode.port is None) == (not mode.output):
        raise InputError("Where to? Give -o filled.pdf, or --port /dev/ttyUSB0 (or COM3, or sim:).")
    if mode.port is not None:
        console.yes = mode.yes
        plotted = pipeline.plot_forms(form, answers, mode.port, filling, writing, attendant=console)
        console.report(plotted, sentences.tell_plotted(plotted))
        return
    with console.working():
        result = pipeline.fill(form, answers, mode.output, filling, writing, picture, listener=console)
    count = f"{units.count(result.told['entries'], 'field')} in {units.count(result.told['forms'], 'form')}"
    console.report(
        result,
        f"Filled in {count} ({sentences.names(result.files)}); {sentences.writing_time(result.tally)}seed "
        f"{result.seed}.{sentences.tell_letters(result.tally)}",
    )
