"""`handout plot`: a text through a pen plotter."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from handout import units
from handout.cli import drawings as drawn_
from handout.cli import jobs, making, options, plotting_, progress, results
from handout.errors import DeviceError, InputError

if TYPE_CHECKING:
    from handout.plotting import Plan, Report
    from handout.plotting.jobs.job import Job, Options
    from handout.profiles import Plotter
    from handout.values import Drawing

_LATEST = "the latest"
# what may be given with --resume
_RESUMING = {"resume", "port", "report", "at_zero", "home_after", "hold_limit", "yes", "as_json", "quiet"}


@click.command("plot")
@click.argument("text", nargs=-1)
@click.option("--file", "-f", help="Read the text from a file; - for standard input.")
@click.option("--port", help="/dev/ttyUSB0, COM3, socket://host:port, auto, or sim: (simulated).")
@click.option("--device", help="The plotter's profile; see: handout devices list.")
@click.option("--dry-run", multiple=True, type=click.Path(path_type=Path), help="Write a preview instead of plotting.")
@click.option("--show-travel", is_flag=True, help="In previews (SVG, PDF, PNG): show how the lifted pen travels.")
@click.option("--report", type=click.Path(path_type=Path), help="Write how faithful the motion is, as JSON.")
@click.option("--copies", type=click.IntRange(1, 1000), default=1, show_default=True)
@click.option(
    "--order",
    type=click.Choice(["writing", "travel"]),
    default="writing",
    show_default=True,
    help="Of words; travel moves the strokes of a drawing about in any way.",
)
@click.option(
    "--layers",
    type=click.Choice(["none", "name", "colour"]),
    default="none",
    show_default=True,
    help="Stop for another pen before every layer.",
)
@click.option("--pause-every", metavar="LENGTH", help="Stop for a look at the pen after so much ink, e.g. 20m.")
@click.option("--overlap", metavar="LENGTH", help="Ink that may be drawn twice after a break; default: 20mm.")
@click.option(
    "--resume",
    is_flag=False,
    flag_value=_LATEST,
    metavar="[JOB]",
    help="Go on with a plot that broke off, or the last.",
)
@click.option("--at-zero", is_flag=True, help="With --resume: the pen stands above the zero, lifted.")
@click.option("--pen-up", metavar="HEIGHT", help="Lift the pen to this height, instead of the profile's (pen.up).")
@click.option("--pen-down", metavar="HEIGHT", help="Lower it to this height, instead of the profile's (pen.down).")
@click.option("--home-after", is_flag=True, help="Back to zero when it ends, after Ctrl-C too.")
@click.option(
    "--hold-limit",
    metavar="TIME",
    help="How long the plotter may stand on hold before the plot ends, its pen lifted; default: 2min with --yes or "
    "without a terminal, else for ever.",
)
@click.option("--yes", "-y", is_flag=True, help="Do not stop between sheets and pens.")
@options.sheet_options("A5")
@options.writing_options
@options.slips_option
@options.picture_options
@click.pass_context
def command(context: click.Context, /, text: tuple[str, ...], file: str | None, **given: Any) -> None:
    """Write TEXT (or a file, or - for standard input) with a pen plotter, or draw the drawing that TEXT names.

    \b
    handout plot --port /dev/ttyUSB0 "Dear Ada, …"
    handout plot --port /dev/ttyUSB0 letter.txt
    handout plot --port /dev/ttyUSB0 drawing.svg --order travel
    handout plot --port sim: "to see that it works"
    handout plot --dry-run preview.svg "to see how it looks"

    A plot that breaks off is kept:

    \b
    handout plot --resume [JOB]     go on with it
    handout plot jobs               list all that are kept
    handout plot show JOB           how far it has come
    handout plot forget JOB         delete it
    """
    port, dry_run = given["port"], given["dry_run"]
    if given["resume"] is not None:
        _check_resuming(context, text)
        _resume(given)
        return
    if given["at_zero"]:
        raise InputError("--at-zero says where the pen of a plot stands that is resumed: give it with --resume.")
    if port is None and not dry_run:
        if text and text[0] in plotting_.WORDS and file is None:
            plotting_.manage(text[0], text[1:], given["as_json"])
            return
        raise InputError("Where to? Give --port /dev/ttyUSB0 (or COM3, or sim:), or --dry-run preview.svg.")
    if given["show_travel"] and not dry_run:
        raise InputError("--show-travel is seen in a preview: give it with --dry-run preview.svg.")
    from handout.sinks import check_outputs

    check_outputs(dry_run)
    told = plotting_.Account(given["report"])
    look = options.look(given)
    wanted = _wanted(text, file, given)
    if dry_run:
        _preview(wanted, dry_run, told, look, given)
    else:
        _plot(wanted, port, told, given)


@dataclass(frozen=True)
class _Wanted:
    """What is to be plotted: a text, or the drawing that it names."""

    text: str
    drawing: Drawing | None
    job: jobs.Setup
    profile: Plotter


def _wanted(text: tuple[str, ...], file: str | None, given: dict[str, Any]) -> _Wanted:
    profile = plotting_.profile(given["device"], given["port"])
    given["page_name"] = options.page_of(given)
    if given["pen_up"] is not None or given["pen_down"] is not None:
        profile = plotting_.with_heights(profile, given["pen_up"], given["pen_down"])
    job = jobs.setup(given, given["page_name"], given["margin"], given["pages"])
    drawing = drawn_.given(text, file, quiet=given["quiet"])
    job = job if drawing is not None else jobs.on_paper(job, given)
    if drawing is not None:
        return _Wanted(Path(file or text[0]).name, drawing, job, profile)
    return _Wanted(options.text_of(*drawn_.named_file(text, file, given["quiet"])), None, job, profile)


def _plot(wanted: _Wanted, port: str, told: plotting_.Account, given: dict[str, Any]) -> None:
    """--port."""
    from handout.plotting import open_port
    from handout.plotting.driving import plot_report
    from handout.plotting.jobs import job as kept_

    asked, profile, quiet = _asked(wanted, given), wanted.profile, given["quiet"]
    try:
        connected = open_port(port, profile)  # before any work is done for it
    except DeviceError as error:
        raise type(error)(f"{error} No job was begun.") from error
    try:
        kept = _begun(wanted, asked, port, given)
    except BaseException:
        connected.close()
        raise
    if kept.whole:
        much = f"{_sheets(kept.pages * asked.copies)}, {kept.ink / 1000:.2f} m of ink"
    else:
        much = f"about {kept.ink / 1000:.1f} m of ink; the other sheets are written while the first are drawn"
    results.talk(quiet)(f"{profile.title}: {much}, job {kept.name}.")
    paper = results.noted(results.of_paper(wanted.job), wanted.job, quiet)  # before the sheet is laid in
    asked_now = {name: given[name] for name in ("yes", "home_after", "hold_limit", "quiet")}
    reports = plotting_.run(kept, port, told, connected, at_zero=False, **asked_now)
    kept = kept_.load(kept.folder)
    tally = results.Tally().plus(kept.told)
    result = {**tally.facts(wanted.job, []), **_executed(reports), "copies": asked.copies, "job": kept.name, **paper}
    sheets = _sheets(kept.pages * asked.copies)
    said = f"Plotted {sheets} in {units.duration(result['executed_s'])}; seed {wanted.job.seed}."
    said = f"{said}{results.lent(result)}{results.slipped(result)}\n{plot_report.sentence(reports)}".strip()
    results.report(result, said, as_json=given["as_json"], quiet=quiet)


def _asked(wanted: _Wanted, given: dict[str, Any]) -> Options:
    """How the job is to be drawn."""
    from handout.plotting.driving.overlap import usual_overlap
    from handout.plotting.jobs.job import Options

    fast, drawing, every = wanted.job.fast, wanted.drawing, given["pause_every"]
    usual = usual_overlap(wanted.profile, fast or (drawing is not None and not drawing.timed))
    return Options(
        speed="fast" if fast else 1.0,
        order=given["order"],
        overlap=usual if given["overlap"] is None else _positive(given["overlap"], "overlap"),
        copies=given["copies"],
        layers=given["layers"],
        pause_every=None if every is None else _positive(every, "pause every"),
    )


def _begun(wanted: _Wanted, asked: Options, port: str, given: dict[str, Any]) -> Job:
    """The job, with the first page of a text and what the others are made from, or with the drawing."""
    from handout.plotting import fit_to_bed
    from handout.plotting.jobs import store
    from handout.plotting.jobs.pages import Made

    job, profile = wanted.job, wanted.profile
    if wanted.drawing is None:
        first = next(making.made(wanted.text, job, profile, given["fit"], []))
        rest = None if first.share >= 1.0 else making.inputs(wanted.text, given, job)
    else:
        tally, rest = results.Tally(), None
        tally.add([drawn_.unwritten(wanted.drawing)], [wanted.drawing])
        drawing = fit_to_bed(wanted.drawing, profile) if given["fit"] else wanted.drawing
        first = Made(drawing, 1.0, dataclasses.asdict(tally))
    title = " ".join(wanted.text.split())[:40]
    return store.begin([first], profile, asked, rest, title=title, port=port)


def _check_resuming(context: click.Context, text: tuple[str, ...]) -> None:
    """Refuse what cannot be changed any more."""
    if text:
        raise InputError(f"--resume goes on with a plot whose text is known: leave {text[0]!r} out.")
    for name in context.params:
        if name not in _RESUMING and context.get_parameter_source(name) == ParameterSource.COMMANDLINE:
            option = next(p.opts[0] for p in context.command.params if p.name == name)
            raise InputError(f"{option} cannot be changed any more: a plot that is resumed goes on as it began.")


def _resume(given: dict[str, Any]) -> None:
    """--resume."""
    from handout.plotting.driving import plot_report
    from handout.plotting.jobs import job as kept_
    from handout.plotting.jobs import store

    told = plotting_.Account(given["report"])
    job = store.find(None if given["resume"] == _LATEST else given["resume"])
    if job.standing().finished:
        raise InputError(f"The job {job.name} is finished: nothing is left of it.")
    quiet = given["quiet"]
    results.talk(quiet)(plotting_.outlook(job))
    port = given["port"] or job.port
    asked = {name: given[name] for name in ("yes", "at_zero", "home_after", "hold_limit", "quiet")}
    reports = plotting_.run(job, port, told, **asked)
    result = {**plotting_.facts(kept_.load(job.folder)), **_executed(reports)}
    said = f"Plotted the rest of {job.name} in {units.duration(result['executed_s'])}.{results.lent(result)}"
    said = f"{said}\n{plot_report.sentence(reports)}".strip()
    results.report(result, said, as_json=given["as_json"], quiet=quiet)


def _positive(text: str, what: str) -> float:
    length = units.length(text, what)
    if not length > 0:
        raise InputError(f"{what}: {text} is not more than 0.")
    return length


def _preview(
    wanted: _Wanted, files: tuple[Path, ...], told: plotting_.Account, look: dict[str, Any], given: dict[str, Any]
) -> None:
    """--dry-run."""
    from handout.plotting import fit_to_bed, plan
    from handout.plotting.jobs.pages import laid_out
    from handout.sinks import write_drawings

    job, profile = wanted.job, wanted.profile
    if wanted.drawing is None:
        with progress.shown(given["quiet"]) as tell:
            pages, drawings = jobs.compose_and_trace(wanted.text, job, shown=jobs.STROKES, tell=tell)
    else:
        pages, drawings = [drawn_.unwritten(wanted.drawing)], [wanted.drawing]
    if given["fit"]:
        drawings = [fit_to_bed(drawing, profile) for drawing in drawings]
    drawings = [laid_out(drawing, profile, given["layers"], given["order"]) for drawing in drawings]
    plans = [plan(drawing, profile, speed="fast" if job.fast else 1.0) for drawing in drawings]
    planned = sum(p.duration for p in plans)
    result = results.summary(pages, drawings, job, files)
    result |= results.noted(results.of_paper(job), job, given["quiet"])
    written = write_drawings(drawings, files, show_travel=given["show_travel"], **jobs.on_sheet(look, job))
    told.planned(plans)
    result |= {"files": [str(f) for f in written], "planned_s": round(planned, 2), "stretched": _stretched(plans)}
    said = f"Wrote {', '.join(map(str, written))}; plotting would take {units.duration(planned)}; seed {job.seed}."
    results.report(
        result, said + results.lent(result) + results.slipped(result), as_json=given["as_json"], quiet=given["quiet"]
    )


def _sheets(number: int) -> str:
    return units.count(number, "sheet")


def _executed(reports: list[Report]) -> dict[str, Any]:
    """What `--json` prints of a plot."""
    from handout.plotting.driving import plot_report

    return {
        "planned_s": round(sum(report.announced_s for report in reports), 2),
        "executed_s": round(sum(report.executed_s for report in reports), 2),
        "stretched": _stretched(reports),
        **plot_report.facts(reports),
    }


def _stretched(parts: list[Plan] | list[Report]) -> float:
    """The greatest of the sheets' stretches: time the strokes take over the time they were meant to take."""
    return round(max((part.stretched for part in parts), default=1.0), 4)
