"""`handout plot`: a text through a pen plotter; and the plots that are kept."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from handout import units
from handout.cli import configuration, sentences
from handout.cli.console import Console
from handout.cli.options import given_names, verb
from handout.errors import InputError
from handout.pipeline.declarations import FILES, MACHINE, PARTS, bundle, option, port
from handout.pipeline.inputs import Source
from handout.pipeline.options import MergeOptions, TableOptions
from handout.pipeline.plot_request import AttendanceOptions, DrawingOptions, PartOptions, PlotRequest

if TYPE_CHECKING:
    from handout.pipeline.results import Told

_LAST = "last"  # of kept plots, in place of a name
# what may be given with --again
_AGAIN = {"again", "ports", "dry_run", "show_travel", "report", "home_after", "hold_limit", "yes", "as_json", "quiet"}
_AGAIN |= {"begin", "end", "from_word", "to_word", "sheets"}
# what may be given with --resume
_RESUMING = {"resume", "ports", "report", "at_zero", "home_after", "hold_limit", "yes", "as_json", "quiet"}


_AGAIN_TOO = {
    "heading": PARTS,
    "help": "Plot what is kept once more, the last or that one; with --resume of a table ROWS: these, whatever "
    "became of them.",
    "metavar": "[JOB]",
    "alone": _LAST,
}


@dataclass(frozen=True)
class _PlotMode:
    """What the command is to do: plot, write a preview, or go on with a job; and with whom at the plotter."""

    file: str | None = option(None, "Read the text from a file; - for standard input.", FILES, flags=("--file", "-f"))
    dry_run: tuple[Path, ...] = option((), "Write a preview instead of plotting.", FILES)
    show_travel: bool = option(False, "In previews (SVG, PDF, PNG): show how the lifted pen travels.", FILES)
    yes: bool = option(False, "Do not stop between sheets and pens.", MACHINE, flags=("--yes", "-y"))
    resume: str | None = option(
        None, "Go on with a plot that broke off, the last or that one.", PARTS, alone=_LAST, metavar="[JOB]"
    )
    ports: tuple[str, ...] = port(())
    attendance: AttendanceOptions = AttendanceOptions()

    @property
    def port(self) -> str | None:
        """The only port, or none."""
        if len(self.ports) > 1:
            raise InputError("Several plotters share the rows of a table, with --letter: name one --port.")
        return self.ports[0] if self.ports else None

    def check_place(self, rows: str = "") -> None:
        """Refuse to write nowhere, and `rows` where no table is plotted."""
        if rows:
            raise InputError("--rows and --address are of a table: give --letter card.md or --with-envelopes, too.")
        if not self.ports and not self.dry_run:
            raise InputError("Where to? Give --port /dev/ttyUSB0 (or COM3, or sim:), or --dry-run preview.svg.")

    @property
    def plots_anyway(self) -> bool:
        """Whether what is typed asks for a plot, whatever its text is."""
        return self.file is not None or bool(self.dry_run) or "ports" in given_names()


@verb("plot")
def command(
    console: Console,
    text: tuple[str, ...],
    mode: _PlotMode,
    drawing: DrawingOptions,
    table: TableOptions = bundle(TableOptions(), leave_out=("copies", "resume"), again=_AGAIN_TOO),
    merge: MergeOptions = bundle(MergeOptions(), leave_out=("margin", "pages")),
    request: PlotRequest = PlotRequest(Source("")),
) -> int | None:
    """Write TEXT (or a file, or - for standard input) with a pen plotter, or draw the drawing that TEXT names; or with
    --letter or --with-envelopes a letter, an envelope or both for every row of the table that TEXT names.

    \b
    handout plot --port /dev/ttyUSB0 "Dear Ada, …"
    handout plot --port /dev/ttyUSB0 letter.txt
    handout plot --port /dev/ttyUSB0 people.csv --letter card.md --page 100x70mm --grid 2x3
    handout plot --port /dev/ttyUSB0 --port /dev/ttyUSB1 people.csv --letter card.md
    handout plot --port /dev/ttyUSB0 drawing.svg --order travel
    handout plot --port sim: "to see that it works"
    handout plot --dry-run preview.svg "to see how it looks"

    A plot that breaks off is kept:

    \b
    handout plot --resume [JOB]     go on with it
    handout plot --again [JOB]      plot it once more, or a part: --from-word kindness --to 60%
    handout plot jobs               list all that are kept
    handout plot show [JOB]         how far it has come
    handout plot forget JOB         delete it

    Without a name the one that was drawn last is taken, of those for which it can be done.
    """
    console.yes = mode.yes
    if merge.letter is not None or merge.with_envelopes or table.columns:
        if request.part:
            raise InputError("--from, --to and --sheets take a part of a text or a drawing; of a table give --rows.")
        return _plot_rows(text, request, mode, table, merge, console)
    if _of_kept(text, mode, request.part, table.again, console):
        return None
    if mode.attendance.at_zero:
        raise InputError("--at-zero says where the pen of a plot stands that is resumed: give it with --resume.")
    if text and text[0] in configuration.JOB_WORDS and not mode.plots_anyway:
        _manage(text[0], text[1:], console)
        return None
    port = mode.port
    mode.check_place(table.rows or table.address)
    if mode.show_travel and not mode.dry_run:
        raise InputError("--show-travel is seen in a preview: give it with --dry-run preview.svg.")
    from handout.pipeline.inputs import read_source
    from handout.pipeline.texts import check_outputs

    check_outputs(mode.dry_run)
    source = read_source(text, mode.file, console, given_names(), svg_text=drawing.svg_text)
    request = replace(request, source=source)
    from handout.pipeline.plotting import plot, preview

    if port and not mode.dry_run:
        result = plot(request, port, mode.attendance, attendant=console)
        console.report(result, sentences.tell_plotted(result))
        return None
    travel, report = mode.show_travel, mode.attendance.report
    with console.working():
        shown = preview(request, mode.dry_run, show_travel=travel, report=report, port=port, listener=console)
    took = f"plotting would take {units.duration(shown.told['planned_s'])}{sentences.tell_hooks(shown.told)}"
    lent = sentences.tell_letters(shown.tally)
    console.report(shown, f"Wrote {sentences.names(shown.files)}; {took}; seed {shown.seed}.{lent}")
    return None


def _of_kept(text: tuple[str, ...], mode: _PlotMode, part: PartOptions, again: str, console: Console) -> bool:
    """--resume and --again, if one of them is given."""
    if mode.resume is not None:
        known, why = "--resume goes on with a plot whose text is known", "a plot that is resumed goes on as it began"
        _check_kept(text, _RESUMING, known, why)
        from handout.pipeline.plotting import resume

        result = resume(mode.resume, mode.port, mode.attendance, attendant=console)
        sentence = f"Plotted the rest of {result.job.name} in {units.duration(result.executed_s)}."
        console.report(result, f"{sentence}{sentences.tell_letters(result.tally)}\n{result.fidelity}".strip())
    elif again:
        _check_kept(text, _AGAIN, "--again plots what is kept", "a plot that is drawn again is drawn as it was")
        _plot_again(again, part, mode, console)
    return mode.resume is not None or bool(again)


def _plot_rows(
    text: tuple[str, ...],
    request: PlotRequest,
    mode: _PlotMode,
    table: TableOptions,
    merge: MergeOptions,
    console: Console,
) -> int:
    """--letter, --with-envelopes."""
    from handout.cli.print_ import make_rows, summary
    from handout.pipeline.plot_rows import plot_rows

    names = [*text, *([mode.resume] if mode.resume not in (None, _LAST) else [])]
    if len(names) != 1 or mode.file is not None:
        raise InputError("Which table? Name one, as in: handout plot --port /dev/ttyUSB0 people.csv --letter card.md")
    mode.check_place()
    rows, merge = replace(table, resume=mode.resume is not None), replace(merge, given=given_names())
    how = request, mode.ports, (rows, merge), mode.attendance
    make = partial(plot_rows, names[0], *how, outputs=mode.dry_run, attendant=console)
    result = make_rows(make, console.working() if mode.dry_run else contextlib.nullcontext(), console)
    took = f"in {units.duration(result.executed_s)}"
    if mode.dry_run:
        took = f"plotting would take {units.duration(result.told['planned_s'])}"
    sentence = f"{summary(result)}; {took}; seed {result.seed}."
    lent = sentences.tell_letters(result.tally)
    console.report(result, f"{sentence}{lent}\n{result.fidelity}".strip())
    return result.report.exit_code


def _check_kept(text: tuple[str, ...], allowed: Collection[str], known: str, why: str) -> None:
    """Refuse what cannot be changed any more."""
    context = click.get_current_context()
    if text:
        raise InputError(f"{known}: leave {text[0]!r} out.")
    for name in context.params:
        if name not in allowed and context.get_parameter_source(name) == ParameterSource.COMMANDLINE:
            option = next(p.opts[0] for p in context.command.params if p.name == name)
            raise InputError(f"{option} cannot be changed any more: {why}.")


def _plot_again(job: str, part: PartOptions, mode: _PlotMode, console: Console) -> None:
    """--again."""
    from handout.pipeline.plotting import plot_again, preview_again

    if mode.dry_run:
        shown = preview_again(job, part, mode.dry_run, show_travel=mode.show_travel, listener=console)
        took = f"plotting would take {units.duration(shown.told['planned_s'])}{sentences.tell_hooks(shown.told)}"
        console.report(shown, f"Wrote {sentences.names(shown.files)}; {took}.")
        return
    result = plot_again(job, part, mode.port, mode.attendance, attendant=console)
    console.report(
        result, f"Plotted {result.job.name} in {units.duration(result.executed_s)}.\n{result.fidelity}".strip()
    )


def _manage(word: str, names: tuple[str, ...], console: Console) -> None:
    """``handout plot jobs``, ``show [JOB]`` and ``forget JOB``."""
    from handout.pipeline import plot_jobs

    if word == "jobs":
        if names:
            raise InputError(f"plot jobs takes no names; for one job use: handout plot show {names[0]}")
        jobs = plot_jobs.list_jobs(console)
        if console.as_json:
            click.echo(json.dumps(jobs, ensure_ascii=False))
        elif jobs:
            click.echo("\n".join(map(_describe_job, jobs)))
        else:
            click.echo("No plot is kept.", err=True)
        return
    if len(names) > 1 or (word == "forget" and not names):
        raise InputError(f"plot {word} needs the name of one job, such as handout plot {word} mar01-1; see: plot jobs.")
    if word == "forget":
        click.echo(f"Forgot {plot_jobs.forget_job(names[0])}.", err=True)
        return
    job = plot_jobs.find_job(names[0] if names else None)
    state = plot_jobs.state_of(job)
    if console.as_json:
        click.echo(json.dumps(state, ensure_ascii=False))
        return
    for name, value in state.items():
        click.echo(f"{name:12} {', '.join(map(str, value)) if isinstance(value, list) else value}")
    if not state["finished"]:
        click.echo(f"\n{plot_jobs.outlook(job)}\nhandout plot --resume {job.name}")


def _describe_job(job: Told) -> str:
    """A job in the list of all."""
    share = min(job["drawn_mm"] / max(job["pen_down_mm"], 1e-9), 0.99)
    state = "finished" if job["finished"] else f"{share:.0%} drawn"
    sheets = units.count(job["sheets"], "sheet") + ("" if job["all_written"] else " so far")
    return f"{job['job']:9} {job['begun'].replace('T', ' ')}  {state:10} {sheets:9} {job['title']}".rstrip()
