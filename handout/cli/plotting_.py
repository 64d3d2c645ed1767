"""Plots that are kept: running one, going on with one, listing and showing them; for `handout plot`."""

from __future__ import annotations

import contextlib
import json
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from handout import units
from handout.cli import making, progress
from handout.cli.voice import Voice
from handout.errors import DeviceError, InputError

if TYPE_CHECKING:
    from handout.plotting import Plan, Port, Report
    from handout.plotting.jobs.job import Job
    from handout.plotting.jobs.journal import Standing
    from handout.profiles import Plotter

_SIMULATED = "sim"
# s that a plotter may stand on hold where nobody is asked: long enough for somebody at the machine to look at the pen
_UNWATCHED = 120.0
WORDS = ("jobs", "show", "forget")


def usual_device(port: str | None) -> str:
    """The name of the plotter that is meant where none is named."""
    return "simulated" if port is not None and port.partition(":")[0] == _SIMULATED else "grbl-servo"


def profile(device: str | None, port: str | None) -> Plotter:
    """The plotter that is named, or the usual one."""
    from handout import profiles

    found = profiles.find(device or usual_device(port), "plotter")
    assert isinstance(found, profiles.Plotter)
    return found


def with_heights(profile: Plotter, up: str | None, down: str | None) -> Plotter:
    """The profile with other heights of the pen: servo values, or of a Z axis lengths."""
    from handout.plotting.setup.pen_heights import replaced

    def height(text: str | None, what: str) -> float | None:
        if text is None:
            return None
        if profile.pen.lift == "z":
            return units.length(text, what)
        try:
            return float(text)
        except ValueError:
            raise InputError(f"{what}: {text!r} is not a number, as pen.up and pen.down in the profile are.") from None

    return replaced(profile, height(up, "pen up"), height(down, "pen down"))


class _AtTheTerminal:
    """The person at the plotter, asked at the terminal; a `runner.Person`.

    yes : nothing is asked about sheets and pens; voice : what is still to be said comes before a question.
    """

    def __init__(self, address: str, yes: bool, voice: Voice) -> None:
        self.voice = voice
        self.simulated = address.partition(":")[0] == _SIMULATED
        self.yes = yes

    def do(self, request: str) -> None:
        """Ask, and wait for Enter."""
        if self.simulated or (self.yes and "plotter's zero" not in request):
            return
        if not sys.stdin.isatty():
            way = "--at-zero when it is done" if "plotter's zero" in request else "--yes to go on unasked"
            raise InputError(f"{request}: nobody can be asked to; use {way}.")
        self.voice.wait()
        with progress.hidden():
            click.prompt(f"{request} and press Enter", default="", show_default=False, prompt_suffix=" ", err=True)

    def try_again(self, error: DeviceError) -> bool:
        """Say what is wrong, and wait for Enter."""
        if self.simulated or not sys.stdin.isatty():
            return False
        self.voice.wait()
        request = "Put it right and press Enter to go on; Ctrl-C stops, and the job is kept"
        with progress.hidden():
            click.echo(f"handout: {error}", err=True)
            click.prompt(request, default="", show_default=False, prompt_suffix=" ", err=True)
        return True

    def paused(self, pressed: Callable[[], bool]) -> None:
        """Until the button of the plotter is pressed once more, or Enter."""
        enter = ", or Enter," if sys.stdin.isatty() else ""
        with progress.hidden():
            click.echo(
                f"Paused, the pen is lifted: press the plotter's button again{enter} to go on; Ctrl-C stops, and the "
                "job is kept.",
                err=True,
            )
            while not (pressed() or _entered()):
                pass
            click.echo("It goes on.", err=True)


def _entered() -> bool:
    """Whether somebody at the terminal has pressed Enter."""
    import select

    with contextlib.suppress(OSError, ValueError):  # what cannot be looked at is not waited for
        if sys.stdin.isatty() and select.select([sys.stdin], [], [], 0)[0]:
            return bool(sys.stdin.readline())
    return False


class Account:
    """The file of `--report`: how faithful the motion was, or will be; nothing without a file.

    Raises
    ------
    InputError
        The file could not be written; asked before any work is done.
    """

    def __init__(self, path: Path | None) -> None:
        from handout import atomic

        self.path, self.rows = path, list[dict[str, Any]]()
        if path is not None:
            atomic.check_writable(path)

    def planned(self, plans: Sequence[Plan]) -> None:
        """Write what is predicted of every page."""
        from handout.plotting.driving import plot_report

        if self.path is not None:
            plot_report.write(self.path, [plot_report.row(plan, page) for page, plan in enumerate(plans, 1)])

    def plotted(self, report: Report, port: Port) -> None:
        """Write what is to be said of all parts up to the one that has just been plotted."""
        from handout.plotting.driving import plot_report

        if self.path is not None:
            self.rows.append(plot_report.plotted(report, port, len(self.rows) + 1))
            plot_report.write(self.path, self.rows)


def run(
    job: Job,
    address: str,
    told: Account,
    port: Port | None = None,
    *,
    yes: bool,
    at_zero: bool,
    quiet: bool,
    home_after: bool = False,
    hold_limit: str | None = None,
) -> list[Report]:
    """Plot a job, or what is left of it, at first over a port that is open; whatever ends it says how to go on."""
    patience = _patience(hold_limit, yes)
    from handout.plotting.connections import open_port, surroundings
    from handout.plotting.jobs import runner

    def opened() -> Port:
        nonlocal port
        known, port = port, None
        return known or open_port(address, job.profile)

    with (
        _kept(job),
        making.supply(job) as supply,
        surroundings(address),
        progress.shown(quiet) as tell,
        Voice(quiet) as voice,
    ):
        return runner.run_job(
            job,
            opened,
            _AtTheTerminal(address, yes, voice),
            supply=supply,
            at_zero=at_zero,
            home_after=home_after,
            patience=patience,
            progress=(lambda share, left: tell(share, "plotting", left)) if progress.wanted(quiet) else None,
            plotted=told.plotted,
            log=voice.say,
        )


def _patience(hold_limit: str | None, yes: bool) -> float:
    """How long the plotter may stand on hold, s: where somebody can be asked, as long as they like."""
    if hold_limit is not None:
        return units.parse(hold_limit, "time", "hold limit")
    watched = not yes and sys.stdin.isatty() and sys.stderr.isatty()
    return math.inf if watched else _UNWATCHED


@contextlib.contextmanager
def _kept(job: Job) -> Iterator[None]:
    """Add to what ends a job how to go on with it; one that was refused before anything was drawn is forgotten."""
    from handout.plotting.jobs import store

    try:
        yield
    except DeviceError as error:
        if said := _how_to_go_on(job):
            raise type(error)(f"{error} {said}") from error
        raise
    except InputError as error:
        if _has_begun(job):
            raise type(error)(f"{error} {_how_to_go_on(job)}") from error
        with contextlib.suppress(InputError):
            store.forget(job)
        raise
    except (KeyboardInterrupt, click.Abort) as stop:
        if said := _how_to_go_on(job):
            stop.add_note(said)
        raise


def _has_begun(job: Job) -> bool:
    try:
        standing = job.standing()
    except InputError:  # what is wrong has been said
        return False
    return standing.begun or standing.part > 0


def _how_to_go_on(job: Job) -> str:
    """How to go on with a job, even one of which nothing is drawn: otherwise --resume would take one before it."""
    try:
        job.standing()
    except InputError:  # what is wrong has been said
        return ""
    return f"The job is kept; go on with: handout plot --resume {job.name}"


def outlook(job: Job) -> str:
    """What will happen when a job is gone on with."""
    standing = job.standing()
    if standing.part >= len(job.parts):
        return f"{_called(job)}: goes on with what is written next; {_drawn(job, standing) / 1000:.2f} m are drawn."
    if not standing.begun:
        return f"{_called(job)}: goes on with {_part(job, standing)}."
    strokes = job.drawing(standing.part).strokes
    words = job.drawing(standing.part).about.get("words") or []
    at = min(standing.place.stroke, len(strokes) - 1)
    number = strokes[at].word
    word = f', in the word "{words[number]}"' if 0 <= number < len(words) and words[number] else ""
    return (
        f"{_called(job)}: goes on with {_part(job, standing)}, at stroke {at + 1} of {len(strokes)}{word}; "
        f"{_drawn(job, standing) / 1000:.2f} of {'' if job.whole else 'about '}{job.ink / 1000:.2f} m are drawn, of "
        "which at most "
        f"{job.options.overlap:g} mm are drawn again."
    )


def _called(job: Job) -> str:
    return f"{job.name} ({job.title})" if job.title else job.name


def _part(job: Job, standing: Standing) -> str:
    from handout.plotting.jobs.parts import named

    part = job.parts[standing.part]
    sheets = f" of {job.pages * job.options.copies}" if job.whole else ""
    layer = f", {named(part.layer)}" if len(job.layers) > 1 else ""
    return f"sheet {part.copy * job.pages + part.page + 1}{sheets}{layer}"


def _drawn(job: Job, standing: Standing) -> float:
    """mm of ink that are certainly on paper."""
    from handout.plotting.jobs.places import drawn

    whole = sum(part.ink for part in job.parts[: standing.part])
    if not standing.begun or standing.part >= len(job.parts):
        return whole
    return whole + drawn(job.drawing(standing.part), standing.place).pen_down


def facts(job: Job) -> dict[str, Any]:
    """A job as `--json` prints it."""
    standing = job.standing()
    done = job.ink if standing.finished else _drawn(job, standing)
    return {
        "job": job.name,
        "title": job.title,
        "begun": job.begun,
        "device": job.profile.name,
        "port": job.port,
        "sheets": job.pages * job.options.copies,
        "all_written": job.whole,
        "layers": [layer for layer in job.layers if layer],
        "parts": len(job.parts),
        "part": standing.part + (0 if standing.finished else 1),
        "finished": standing.finished,
        "stopped": standing.stopped,
        "runs": list(standing.runs),
        "drawn_mm": round(done, 1),
        "pen_down_mm": round(job.ink, 1),
    }


def manage(word: str, names: tuple[str, ...], as_json: bool) -> None:
    """``handout plot jobs``, ``show JOB`` and ``forget JOB``."""
    from handout.plotting.jobs import store

    if word == "jobs":
        if names:
            raise InputError(f"plot jobs takes no names; for one job use: handout plot show {names[0]}")
        jobs = [facts(job) for job in _readable(store.every())]
        click.echo(json.dumps(jobs, ensure_ascii=False) if as_json else _table(jobs), nl=bool(as_json or jobs))
        if not jobs and not as_json:
            click.echo("No plot is kept.", err=True)
        return
    if len(names) != 1:
        raise InputError(f"plot {word} needs the name of one job, such as handout plot {word} mar01-1; see: plot jobs.")
    job = store.find(names[0])
    if word == "forget":
        store.forget(job)
        click.echo(f"Forgot {_called(job)}.", err=True)
        return
    told = facts(job)
    if as_json:
        click.echo(json.dumps(told, ensure_ascii=False))
        return
    for name, value in told.items():
        click.echo(f"{name:12} {', '.join(map(str, value)) if isinstance(value, list) else value}")
    if not told["finished"]:
        click.echo(f"\n{outlook(job)}\nhandout plot --resume {job.name}")


def _readable(jobs: list[Job]) -> Iterator[Job]:
    for job in jobs:
        try:
            job.standing()
        except InputError as error:
            click.echo(f"handout: {error}", err=True)
        else:
            yield job


def _table(jobs: list[dict[str, Any]]) -> str:
    rows = []
    for job in jobs:
        share = job["drawn_mm"] / max(job["pen_down_mm"], 1e-9)
        state = "finished" if job["finished"] else f"{min(share, 0.99):.0%} drawn"
        sheets = units.count(job["sheets"], "sheet")
        sheets += "" if job["all_written"] else " so far"
        rows.append(f"{job['job']:9} {job['begun'].replace('T', ' ')}  {state:10} {sheets:9} {job['title']}".rstrip())
    return "\n".join(rows)
