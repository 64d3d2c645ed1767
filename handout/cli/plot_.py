"""`handout plot`: a text through a pen plotter."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click
from click.core import ParameterSource

from handout import units
from handout.cli import drawings as drawn_
from handout.cli import jobs, options, plotting_, results
from handout.errors import InputError

if TYPE_CHECKING:
    from handout.plotting import Plan, Report
    from handout.profiles import Plotter
    from handout.values import Drawing, Manuscript

_LATEST = "the latest"
_RESUMING = {"resume", "port", "report", "at_zero", "yes", "as_json", "quiet"}  # what may be given with --resume


@click.command("plot")
@click.argument("text", nargs=-1)
@click.option("--file", "-f", help="Read the text from a file (UTF-8); - for standard input.")
@click.option("--port", help="/dev/ttyUSB0, COM3, socket://host:port, auto, or sim: (simulated).")
@click.option("--device", help="The plotter's profile; see: handout devices list.")
@click.option("--dry-run", multiple=True, type=click.Path(path_type=Path), help="Write a preview instead of plotting.")
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
@click.option("--yes", "-y", is_flag=True, help="Do not stop between sheets and pens.")
@options.sheet_options("A5")
@options.writing_options
@options.slips_option
@options.picture_options
@click.pass_context
def command(
    context: click.Context,
    /,
    text: tuple[str, ...],
    file: str | None,
    port: str | None,
    device: str | None,
    dry_run: tuple[Path, ...],
    report: Path | None,
    copies: int,
    order: Literal["writing", "travel"],
    layers: Literal["none", "name", "colour"],
    pause_every: str | None,
    overlap: str | None,
    resume: str | None,
    at_zero: bool,
    yes: bool,
    **given: Any,
) -> None:
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
    if resume is not None:
        _check_resuming(context, text)
        told = plotting_.Account(report)
        _resume(None if resume == _LATEST else resume, port, told, at_zero=at_zero, yes=yes, given=given)
        return
    if at_zero:
        raise InputError("--at-zero says where the pen of a plot stands that is resumed: give it with --resume.")
    if port is None and not dry_run:
        if text and text[0] in plotting_.WORDS and file is None:
            plotting_.manage(text[0], text[1:], given["as_json"])
            return
        raise InputError("Where to? Give --port /dev/ttyUSB0 (or COM3, or sim:), or --dry-run preview.svg.")
    from handout.sinks import check_outputs

    check_outputs(dry_run)
    told = plotting_.Account(report)
    look = options.look(given)
    profile = plotting_.profile(device, port)
    job = jobs.setup(given, given["page_name"], given["margin"], given["pages"])
    drawing = drawn_.given(text, file, quiet=given["quiet"])
    pages: list[Manuscript]
    drawings: Iterator[Drawing]
    if drawing is None:
        words = options.text_of(*drawn_.named_file(text, file, given["quiet"]))
        pages, drawings = jobs.composed(words, job)
    else:
        words, pages, drawings = Path(file or text[0]).name, [drawn_.unwritten(drawing)], iter([drawing])
    drawings = _fitted(drawings, profile) if given["fit"] else drawings
    if dry_run:
        _preview(pages, list(drawings), profile, job, order, dry_run, told, look, given)
        return
    from handout.plotting import open_port
    from handout.plotting.driver import OVERLAP
    from handout.plotting.jobs import store

    assert port is not None
    asked = store.Options(
        speed="fast" if job.fast else 1.0,
        order=order,
        overlap=OVERLAP if overlap is None else _positive(overlap, "overlap"),
        copies=copies,
        layers=layers,
        pause_every=None if pause_every is None else _positive(pause_every, "pause every"),
    )
    tally, title = results.Tally(), " ".join(words.split())[:40]
    connected = open_port(port, profile)  # before any work is done for it
    try:
        drawn = _counted(pages, drawings, tally, given["quiet"])
        kept = store.create(drawn, profile, asked, title=title, port=port)
    except BaseException:
        connected.close()
        raise
    sheets = _sheets(kept.pages * copies)
    results.talk(given["quiet"])(f"{profile.title}: {sheets}, {kept.ink / 1000:.2f} m of ink, job {kept.name}.")
    reports = plotting_.run(kept, port, told, connected, yes=yes, at_zero=False, quiet=given["quiet"])
    result = {**tally.facts(job, []), **_executed(reports), "copies": copies, "job": kept.name}
    said = f"Plotted {sheets} in {units.duration(result['executed_s'])}; seed {job.seed}." + results.slipped(result)
    results.report(result, said, as_json=given["as_json"], quiet=given["quiet"])


def _check_resuming(context: click.Context, text: tuple[str, ...]) -> None:
    """Refuse what cannot be changed any more."""
    if text:
        raise InputError(f"--resume goes on with a plot whose text is known: leave {text[0]!r} out.")
    for name in context.params:
        if name not in _RESUMING and context.get_parameter_source(name) == ParameterSource.COMMANDLINE:
            option = next(p.opts[0] for p in context.command.params if p.name == name)
            raise InputError(f"{option} cannot be changed any more: a plot that is resumed goes on as it began.")


def _resume(
    name: str | None, port: str | None, told: plotting_.Account, *, at_zero: bool, yes: bool, given: dict[str, Any]
) -> None:
    from handout.plotting.jobs import store

    job = store.find(name)
    if job.standing().finished:
        raise InputError(f"The job {job.name} is finished: nothing is left of it.")
    results.talk(given["quiet"])(plotting_.outlook(job))
    reports = plotting_.run(job, port or job.port, told, yes=yes, at_zero=at_zero, quiet=given["quiet"])
    result = {**plotting_.facts(job), **_executed(reports)}
    said = f"Plotted the rest of {job.name} in {units.duration(result['executed_s'])}."
    results.report(result, said, as_json=given["as_json"], quiet=given["quiet"])


def _positive(text: str, what: str) -> float:
    length = units.length(text, what)
    if not length > 0:
        raise InputError(f"{what}: {text} is not more than 0.")
    return length


def _fitted(drawings: Iterator[Drawing], profile: Plotter) -> Iterator[Drawing]:
    from handout.plotting import fit_to_bed

    return (fit_to_bed(drawing, profile) for drawing in drawings)


def _counted(
    pages: list[Manuscript], drawings: Iterator[Drawing], tally: results.Tally, quiet: bool
) -> Iterator[Drawing]:
    """The drawings as they are made, each with its words, so that one can say where it broke off."""
    import dataclasses

    show = results.progress(quiet or len(pages) < 2)
    for number, (page, drawing) in enumerate(zip(pages, drawings, strict=True), 1):
        tally.add([page], [drawing])
        show(number, len(pages), "writing page")
        yield dataclasses.replace(drawing, about={**drawing.about, "words": _words(page)})


def _words(page: Manuscript) -> list[str]:
    words: dict[int, str] = {}
    for placed in (placed for line in page.lines for placed in line.placed):
        words[placed.word] = words.get(placed.word, "") + placed.glyph.letter
    return [words.get(number, "") for number in range(max(words, default=-1) + 1)]


def _preview(
    pages: list[Manuscript],
    drawings: list[Drawing],
    profile: Plotter,
    job: jobs.Setup,
    order: Literal["writing", "travel"],
    dry_run: tuple[Path, ...],
    told: plotting_.Account,
    look: dict[str, Any],
    given: dict[str, Any],
) -> None:
    """--dry-run."""
    from handout.plotting import plan
    from handout.sinks import write_drawings

    plans = [plan(drawing, profile, speed="fast" if job.fast else 1.0, order=order) for drawing in drawings]
    planned = sum(p.duration for p in plans)
    result = results.summary(pages, drawings, job, dry_run)
    files = write_drawings(drawings, dry_run, **look)
    told.planned(plans)
    result |= {"files": [str(f) for f in files], "planned_s": round(planned, 2), "stretched": _stretched(plans)}
    said = f"Wrote {', '.join(map(str, files))}; plotting would take {units.duration(planned)}; seed {job.seed}."
    results.report(result, said + results.slipped(result), as_json=given["as_json"], quiet=given["quiet"])


def _sheets(number: int) -> str:
    return "1 sheet" if number == 1 else f"{number} sheets"


def _executed(reports: list[Report]) -> dict[str, Any]:
    """What `--json` prints of a plot."""
    return {
        "planned_s": round(sum(report.announced_s for report in reports), 2),
        "executed_s": round(sum(report.executed_s for report in reports), 2),
        "stretched": _stretched(reports),
    }


def _stretched(parts: list[Plan] | list[Report]) -> float:
    """The greatest of the sheets' stretches: time the strokes take over the time they were meant to take."""
    return round(max((part.stretched for part in parts), default=1.0), 4)
