"""`handout plot`: a text through a pen plotter."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from handout import units
from handout.cli import jobs, options, results
from handout.errors import InputError

if TYPE_CHECKING:
    from handout.plotting import Plan, Port, Report
    from handout.profiles import Plotter

_SIMULATED = "sim:"


@click.command("plot")
@click.argument("text", nargs=-1)
@click.option("--file", "-f", help="Read the text from a file (UTF-8); - for standard input.")
@click.option("--port", help="/dev/ttyUSB0, COM3, socket://host:port, or sim: for the simulated plotter.")
@click.option("--device", help="The plotter's profile; see: handout devices list.")
@click.option("--dry-run", multiple=True, type=click.Path(path_type=Path), help="Write a preview instead of plotting.")
@click.option("--copies", type=click.IntRange(1, 1000), default=1, show_default=True)
@click.option(
    "--order", type=click.Choice(["writing", "travel"]), default="writing", show_default=True, help="Of words."
)
@click.option("--journal", type=click.Path(path_type=Path), help="Keep what the machine acknowledged in this file.")
@click.option("--yes", "-y", is_flag=True, help="Do not stop between sheets.")
@options.sheet_options("A5")
@options.writing_options
@options.slips_option
@options.picture_options
def command(
    text: tuple[str, ...],
    file: str | None,
    port: str | None,
    device: str | None,
    dry_run: tuple[Path, ...],
    copies: int,
    order: Literal["writing", "travel"],
    journal: Path | None,
    yes: bool,
    **given: Any,
) -> None:
    """Write TEXT (or a file, or - for standard input) with a pen plotter.

    \b
    handout plot --port /dev/ttyUSB0 "Dear Ada, …"
    handout plot --port sim: "to see that it works"
    handout plot --dry-run preview.svg "to see how it looks"
    """
    from handout.plotting import fit_to_bed, plan
    from handout.sinks import check_outputs

    if port is None and not dry_run:
        raise InputError("Where to? Give --port /dev/ttyUSB0 (or COM3, or sim:), or --dry-run preview.svg.")
    check_outputs(dry_run)
    look = options.look(given)
    profile = _profile(device, port)
    words = options.text_of(text, file)
    job = jobs.setup(given, given["page_name"], given["margin"], given["pages"])
    pages, drawings = jobs.compose_and_trace(words, job, shown=jobs.STROKES)
    if given["fit"]:
        drawings = [fit_to_bed(drawing, profile) for drawing in drawings]
    plans = [plan(drawing, profile, speed="fast" if job.fast else 1.0, order=order) for drawing in drawings]
    result = results.summary(pages, drawings, job, dry_run)
    planned = sum(p.duration for p in plans)
    if dry_run:
        from handout.sinks import write_drawings

        files = write_drawings(drawings, dry_run, **look)
        result |= {"files": [str(f) for f in files], "planned_s": round(planned, 2), "stretched": _stretched(plans)}
        said = f"Wrote {', '.join(map(str, files))}; plotting would take {units.duration(planned)}; seed {job.seed}."
    else:
        assert port is not None
        reports = _plot(plans, port, profile, copies, journal, yes=yes, quiet=given["quiet"])
        executed = sum(report.executed_s for report in reports)
        result |= {
            "copies": copies,
            "planned_s": round(planned, 2),
            "executed_s": round(executed, 2),
            "stretched": _stretched(reports),
        }
        said = f"Plotted {_sheets(len(reports))} in {units.duration(executed)}; seed {job.seed}."
    said += results.slipped(result)
    results.report(result, said, as_json=given["as_json"], quiet=given["quiet"])


def _profile(device: str | None, port: str | None) -> Plotter:
    from handout import profiles

    name = device or ("simulated" if port is not None and port.startswith(_SIMULATED) else "grbl-servo")
    profile = profiles.find(name, "plotter")
    assert isinstance(profile, profiles.Plotter)
    return profile


def _sheets(number: int) -> str:
    return "1 sheet" if number == 1 else f"{number} sheets"


def _stretched(parts: list[Plan] | list[Report]) -> float:
    """The greatest of the sheets' stretches: time the strokes take over the time they were meant to take."""
    return round(max(part.stretched for part in parts), 4)


def _plot(
    plans: list[Plan], address: str, profile: Plotter, copies: int, journal: Path | None, *, yes: bool, quiet: bool
) -> list[Report]:
    """All sheets, one after the other, over one connection."""
    from handout.plotting import open_port, run

    say = results.talk(quiet)
    total = sum(p.duration for p in plans) * copies
    say(f"{profile.title}: {_sheets(len(plans) * copies)}, about {units.duration(total)}.")
    reports = []
    port = open_port(address, profile)
    try:
        for number, plan in enumerate(plans * copies):
            if number:
                _change_sheet(number + 1, yes or address.startswith(_SIMULATED), port)
            reports.append(run(plan, port, profile, progress=_progress(quiet), journal=journal, log=say))
    finally:
        port.close()
    return reports


def _change_sheet(number: int, go_on: bool, port: Port) -> None:
    if go_on:
        return
    if not sys.stdin.isatty():
        raise InputError(f"Sheet {number} is next, but nobody can be asked to change it: use --yes to go on unasked.")
    click.prompt(f"Put in sheet {number} and press Enter", default="", show_default=False, prompt_suffix=" ", err=True)


def _progress(quiet: bool) -> Any:
    if quiet or not sys.stderr.isatty():
        return None

    def show(share: float, left: float) -> None:
        click.echo(f"\r{share:4.0%}, {units.duration(left)} left\033[K", err=True, nl=share >= 1)

    return show
