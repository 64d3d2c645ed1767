"""`handout pen`: a plotter's pen set up: a test sheet, and the heights to which it is lifted and lowered."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from handout import page_sizes, units
from handout.cli import jobs, moving_, plotting_, results
from handout.errors import InputError
from handout.pipeline import programs

if TYPE_CHECKING:
    from handout.profiles import Plotter
    from handout.values import Drawing

_port = click.option("--port", help="/dev/ttyUSB0, COM3, socket://host:port, auto, or sim: (simulated).")
_device = click.option("--device", help="The plotter's profile; see: handout devices list.")
_yes = click.option("--yes", "-y", is_flag=True, help="Do not ask before the pen moves.")


@click.group("pen")
def command() -> None:
    """Set up the pen of a plotter: a test sheet, its heights; move it by hand."""


@command.command("test")
@_port
@_device
@click.option("--page", "page_name", help=f"{page_sizes.HELP} Default: A5, or a smaller machine's whole bed.")
@click.option("--dry-run", multiple=True, type=click.Path(path_type=Path), help="Write the sheet instead of plotting.")
@click.option("--seed", type=int, default=1, show_default=True, help="Of the writing on it.")
@results.output_options
def test(
    port: str | None,
    device: str | None,
    page_name: str | None,
    dry_run: tuple[Path, ...],
    seed: int,
    as_json: bool,
    quiet: bool,
) -> None:
    """Draw a sheet that shows what to set: steps, play, speeds, waits for the pen.

    \b
    handout pen test --device plotter-axidraw-v3 --port auto
    handout pen test --device eleksdraw --port /dev/ttyUSB0 --page A4
    handout pen test --device creality-ender-3 --dry-run sheet.svg --dry-run sheet.png
    """
    if port is None and not dry_run:
        raise InputError("Where to? Give --port /dev/ttyUSB0 (or COM3, or sim:), or --dry-run sheet.svg.")
    import numpy as np

    from handout.page_sizes import page
    from handout.plotting.setup import sheet

    profile = plotting_.profile(device, port)
    size = page(page_name) if page_name else sheet.usual_page(profile)
    drawing = sheet.test_sheet(profile, size, np.random.default_rng(jobs.seed({"seed": seed})))
    if dry_run:
        result, said = _written(drawing, profile, dry_run)
    else:
        assert port is not None
        result, said = _plotted(drawing, profile, port, quiet=quiet)
    results.report(result, said, as_json=as_json, quiet=quiet)
    for line in [] if quiet else sheet.how_to_read(profile):
        click.echo(f"  {line}", err=True)


def _written(drawing: Drawing, profile: Plotter, files: tuple[Path, ...]) -> tuple[dict[str, Any], str]:
    """The sheet in files."""
    from handout.inking.pen import usual
    from handout.plotting import plan
    from handout.sinks import check_outputs, write_drawings

    made = programs.Programs(profile.name or None, files)
    check_outputs(files, made.sinks)
    planned = plan(drawing, profile)
    done = write_drawings([drawing], files, extra=made.sinks, pen=usual("plain", float(profile.pen.width)))
    result = {"files": [str(path) for path in done], "device": profile.name, "planned_s": round(planned.duration, 2)}
    return result, f"Wrote {', '.join(map(str, done))}; plotting would take {units.duration(planned.duration)}."


def _plotted(drawing: Drawing, profile: Plotter, port: str, *, quiet: bool) -> tuple[dict[str, Any], str]:
    """The sheet on paper, as a job like any other."""
    from handout.plotting import open_port
    from handout.plotting.driving.overlap import OVERLAP
    from handout.plotting.jobs import store
    from handout.plotting.jobs.job import Options

    connected = open_port(port, profile)
    try:
        kept = store.create([drawing], profile, Options(overlap=OVERLAP), title="test sheet", port=port)
    except BaseException:
        connected.close()
        raise
    results.talk(quiet)(f"{profile.title}: test sheet, {kept.ink / 1000:.2f} m of ink, job {kept.name}.")
    (report,) = plotting_.run(kept, port, plotting_.Account(None), connected, yes=True, at_zero=False, quiet=quiet)
    result = {
        "device": profile.name,
        "planned_s": round(report.announced_s, 2),
        "executed_s": round(report.executed_s, 2),
        "job": kept.name,
    }
    return result, f"Plotted the test sheet in {units.duration(report.executed_s)}. How to read it:"


for _command in moving_.COMMANDS:
    command.add_command(_command)


class _AtTheTerminal:
    """The person at the plotter, asked at the terminal; a `heights.Person`."""

    def __init__(self, address: str, yes: bool) -> None:
        self._asks = not yes and address.partition(":")[0] != "sim"
        self._told: dict[str, str] = {}

    def do(self, request: str) -> None:
        """Ask, and wait for Enter."""
        if not self._asks:
            return
        if not sys.stdin.isatty():
            raise InputError(f"{request}: nobody can be asked to; use --yes when it is done.")
        click.prompt(f"{request} and press Enter", default="", show_default=False, prompt_suffix=" ", err=True)

    def answer(self, question: str, answers: Mapping[str, str]) -> str:
        """One of the answers."""
        if (known := dict(answers)) != self._told:
            self._told = known
            click.echo("".join(f"  {key}  {means}\n" for key, means in answers.items()), err=True, nl=False)
        try:
            said: str = click.prompt(question, type=click.Choice(list(answers)), prompt_suffix=": ", err=True)
        except click.Abort as stop:
            if isinstance(stop.__context__, EOFError):
                raise InputError(
                    f"pen heights asks, and the input has ended: it needs {', '.join(answers)} typed at a terminal, or "
                    "--up and --down to try two heights without questions."
                ) from None
            raise
        return said

    def hear(self, text: str) -> None:
        """Tell something."""
        click.echo(text, err=True)


@command.command("heights")
@_port
@_device
@click.option("--up", type=float, help="Try this upper height at once, without questions; with --down.")
@click.option("--down", type=float, help="Try this lower height: a row is drawn with both.")
@click.option("--save", "name", metavar="NAME", help="Keep what was found as a profile of your own.")
@click.option("--again", is_flag=True, help="With --save: replace a profile of that name.")
@_yes
@results.output_options
def heights(
    port: str | None,
    device: str | None,
    up: float | None,
    down: float | None,
    name: str | None,
    again: bool,
    yes: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Find how far the pen is to be lifted and lowered, step by step.

    The pen moves only after you have said so. Ctrl-C lifts it.

    \b
    handout pen heights --device axidraw-v3 --port auto
    handout pen heights --device eleksdraw --port /dev/ttyUSB0 --save my-eleksdraw
    handout pen heights --device eleksdraw --port /dev/ttyUSB0 --up 12 --down 36
    """
    if port is None:
        raise InputError("Where is the plotter? Give --port /dev/ttyUSB0 (or COM3, auto, or sim:).")
    from handout import profiles
    from handout.plotting.setup import pen_heights as finding
    from handout.plotting.setup import saved_heights

    profile = plotting_.profile(device, port)
    finding.check(profile)
    if (up is None) != (down is None):
        raise InputError("--up and --down are tried together: give both, or neither to be asked.")
    if again and name is None:
        raise InputError("--again replaces a profile that is saved: give it with --save NAME.")
    source = profiles.locate(device or plotting_.usual_device(port), "plotter")
    path = None if name is None else saved_heights.place(name, again)
    given = None if up is None or down is None else finding.Heights(up, down)
    if given is not None:
        saved_heights.check(source, saved_heights.lines(given, profile))
    found = _found(profile, port, given, _AtTheTerminal(port, yes), results.talk(quiet))
    keys = saved_heights.lines(found, profile)
    if path is not None:
        saved_heights.save(source, path, keys)
    if as_json:
        results.report({**keys, "file": None if path is None else str(path)}, "", as_json=True, quiet=True)
    else:
        click.echo("[pen]\n" + "\n".join(f"{key} = {value:g}" for key, value in keys.items()))
    results.talk(quiet)(_what_now(path))


def _found(profile: Plotter, address: str, given: Any, person: _AtTheTerminal, log: Any) -> Any:
    """The heights that were given and tried, or those the person found."""
    from handout.plotting import open_port
    from handout.plotting.driving import driver
    from handout.plotting.setup import pen_heights as finding

    with contextlib.closing(open_port(address, profile)) as port:
        controller = driver.connect(port, profile, log)
        bench = finding.begin(controller, port, person, log)
        if given is None:
            return finding.find(bench)
        finding.tried(bench, given)
        return given


def _what_now(path: Path | None) -> str:
    if path is None:
        return "Write these lines into the profile, or do this again with --save NAME."
    return f"Wrote {path}; use it with: --device {path.stem.removeprefix('plotter-')}"
