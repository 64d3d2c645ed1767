"""`handout calibrate`: match a printer's colours to the ink; what is done afterwards is in `calibrated_`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from handout import units
from handout.cli import calibrated_, progress, results
from handout.cli.calibrating_ import Run
from handout.errors import InputError

F = TypeVar("F", bound=Callable[..., Any])
_PATH = click.Path(path_type=Path)
_METHODS = click.Choice(["forward", "tps", "tps-haines2016"])

paper_option = click.option("--paper", default="plain", show_default=True, help="What the paper is called; any name.")
printer_option = click.option("--printer", required=True, help="A printer's profile (epson), a queue, or sim.")
method_option = click.option(
    "--method", type=_METHODS, default="forward", show_default=True, help="How the table is made of the patches."
)


def _beside(patches: Path) -> Path:
    """Where what the pen wrote in the chart's frame lies beside a table of its patches."""
    return patches.with_suffix(".pen.npz")


def _chart_options(function: F) -> F:
    for option in reversed((
        click.option("--sheet", default="A4", show_default=True, help="A4 or letter."),
        click.option("--pages", "pages_", type=int, help="1, or 2 where the printer's margins are wide."),
    )):  # fmt: skip
        function = option(function)
    return function


@click.group("calibrate")
def command() -> None:
    """Make a printer's colours those of the ink: print a chart, scan it, and pages go through what it shows.

    \b
    handout calibrate wizard --printer epson      step by step
    handout calibrate wizard --printer sim        to see how it goes, without a printer
    """


for _command in calibrated_.COMMANDS:
    command.add_command(_command)


@command.command()
@printer_option
@paper_option
@_chart_options
@click.option(
    "--scanner", help="Scan through SANE with this scanner (scanimage -L lists them) instead of giving files."
)
@click.option("--scanner-name", default="", help="What the scanner that makes the files is called, for the record.")
@click.option("--hand", default="", help="Verify with the ink of this hand; compare the scan with its pages.")
@click.option("-o", "--output", type=_PATH, help="Folder for chart and strip as PDF, if you print them yourself.")
@method_option
@click.option("--no-verify", is_flag=True, help="Store the table without printing a verification strip.")
@click.option("--accept", is_flag=True, help="Calibrate with the print as it is, though inks are weak in it.")
@click.option("--afresh", is_flag=True, help="Begin anew instead of going on where the last run was left.")
@click.option("--fault", "faults", multiple=True, help="With sim: something wrong with printer or scanner.")
@results.output_options
def wizard(**given: Any) -> int:
    """Calibrate a printer step by step; a run that was left is gone on with.

    \b
    handout calibrate wizard --printer epson --paper plain
    handout calibrate wizard --printer epson --scanner "epson2:libusb:001:004"
    handout calibrate wizard --printer pdf -o charts       print the files yourself
    handout calibrate wizard --printer sim --paper cream
    """
    from handout.calibrating.session import Step
    from handout.calibrating.wizard import Wizard
    from handout.printing.printers import resolve
    from handout.simulated.print_and_scan import simulated

    profile = resolve(given["printer"])
    if profile.file and not profile.simulated and given["output"] is None:
        raise InputError(f"{given['printer']} writes files: name a folder for chart and strip with -o.")
    say = results.talk(given["quiet"])
    loop = simulated(profile, given["paper"], given["faults"], given["hand"]) if profile.simulated else None
    made = Wizard(
        profile, given["printer"], given["paper"], sheet=given["sheet"], page_count=given["pages_"],
        scanner=given["scanner"] or given["scanner_name"] or ("simulated flatbed" if loop else ""),
        hand=given["hand"], afresh=given["afresh"], accept=given["accept"],
    )  # fmt: skip
    if made.resumed:
        say(f"Going on with the calibration of {made.name} begun on {made.session.state.begun} (--afresh begins anew).")
    run = Run(made, loop, given, say)
    try:
        with progress.shown(given["quiet"]) as tell:
            while made.step is not Step.DONE:
                tell(run.share, made.step.value)
                run.step()
    except (click.Abort, KeyboardInterrupt) as stop:
        again = f"handout calibrate wizard --printer {given['printer']} --paper {given['paper']}"
        stop.add_note(f"What was done so far is kept; go on with: {again}")
        raise
    assert run.stored is not None
    said = f"Stored: {run.stored.described()}; report: {run.stored.report}."
    facts = run.stored.facts()
    if run.reference is not None:
        facts["pen"] |= run.reference.facts()
    results.report(facts, said, as_json=given["as_json"], quiet=given["quiet"])
    return 0


@command.command()
@printer_option
@paper_option
@_chart_options
@click.option("-o", "--output", type=_PATH, help="PDF to print yourself; without it the chart goes to the printer.")
@click.option("--dry-run", type=_PATH, help="PNG: the very pixels that the printer would get.")
@results.output_options
def chart(printer: str, paper: str, sheet: str, pages_: int | None, output: Path | None, dry_run: Path | None,
          as_json: bool, quiet: bool) -> int:  # fmt: skip
    """Print the calibration chart, or write it to a file.

    \b
    handout calibrate chart --printer epson -o chart.pdf
    handout calibrate chart --printer epson --dry-run chart.png
    """
    from handout.calibrating import pages, store
    from handout.calibrating.wizard import chart_pages, write_chart_file
    from handout.printing.charts import chart_for
    from handout.printing.printers import resolve

    profile = resolve(printer)
    if profile.file and output is None and dry_run is None:
        raise InputError(f"{printer} writes a file: name it with -o chart.pdf.")
    made, name = chart_for(profile, sheet, pages_), f"{store.key(printer)}/{store.key(paper)}"
    outs = [out for out in (output, dry_run) if out is not None]
    files = [str(path) for out in outs for path in write_chart_file(made, profile, name, out)]
    jobs = [] if files else list(pages.send(chart_pages(made, profile, name), profile))
    result = {"files": files, "jobs": jobs, "pages": len(made.pages), "dpi": profile.dpi}
    where = ", ".join(files) or f"{units.count(len(jobs), 'job')} sent"
    said = f"Chart of {units.count(len(made.pages), 'page')} for {profile.dpi} dpi: {where}."
    results.report(result, said, as_json=as_json, quiet=quiet)
    return 0


@command.command()
@click.argument("scans", nargs=-1, required=True, type=_PATH)
@click.option("-o", "--output", type=_PATH, required=True, help="The patches, as a .ti3 table.")
@click.option("--report", "report_", type=_PATH, help="A page with pictures of what was read, .html.")
@click.option("--hand", default="", help="A scanned hand: was the chart scanned as its pages were?")
@click.option("--accept", is_flag=True, help="Take the print as it is, though inks are weak in it.")
@results.output_options
def read(scans: Sequence[Path], output: Path, report_: Path | None, hand: str, accept: bool, as_json: bool,
         quiet: bool) -> int:  # fmt: skip
    """Read scans of the chart: all its pages, any angle, 50 to 1200 dpi.

    \b
    handout calibrate read scan.tif -o patches.ti3 --report report.html
    """
    from handout import atomic
    from handout.calibrating import inks, prints, reference
    from handout.calibrating.wizard import ScansRefused
    from handout.colour import cgats
    from handout.colour.chart_files import ti3
    from handout.colour.reading import read as read_chart
    from handout.colour.reading.pen_field import save as save_scribble
    from handout.colour.report import write_report

    atomic.check_writable(output)
    paper = inks.paper_of(hand) if hand else None
    reading = read_chart(scans, paper=None if paper is None else paper.tolist())
    known = reference.compared(reading.scribble, hand, inks.scanned_name(hand) if hand else "")
    reading = prints.judged(reading, known, accept=accept)
    if report_ is not None:
        write_report(report_, reading)
    if not quiet:
        for one in reading.findings:
            click.echo(f"{one.severity}: {one}", err=True)
    if not reading.usable:
        raise ScansRefused(reading.findings, report_file=report_)
    say = results.talk(quiet)
    say(f"{'warning: ' if known.doubtful else ''}{known.said}")
    cgats.write(output, ti3(reading))
    files = [str(output)]
    if reading.scribble is not None:
        save_scribble(reading.scribble, _beside(output))
        files.append(str(_beside(output)))
    findings = [{"code": one.code, "severity": one.severity, "sentence": str(one)} for one in reading.findings]
    result = {"patches": len(reading.device), "findings": findings, "files": files, "pen": known.facts()}
    read = units.count(len(reading.device), "colour")
    results.report(result, f"{read} read: {output}.", as_json=as_json, quiet=quiet)
    return 0


@command.command()
@click.argument("patches", type=_PATH)
@printer_option
@paper_option
@click.option("--scanner-name", default="", help="What the scanner is called, for the record.")
@method_option
@results.output_options
def build(patches: Path, printer: str, paper: str, scanner_name: str, method: str, as_json: bool, quiet: bool) -> int:
    """Build the table of PATCHES (.ti3) and store it for the printer.

    \b
    handout calibrate build patches.ti3 --printer epson
    """
    from handout.calibrating import store

    with progress.shown(quiet) as tell:
        tell(0.0, "building the table")
        made = store.build_stored(store.read_patches(patches), printer, paper, scanner_name, method)
    if _beside(patches).is_file():
        made.keep_scribble(_beside(patches), "")
    said = (
        f"Stored: {made.described()}; it misses its own patches by ΔE00 {made.misses:.2f} on the mean. Verify it: "
        f"handout calibrate verify --printer {made.printer} --paper {made.paper} -o strip.pdf"
    )
    results.report(made.facts(), said, as_json=as_json, quiet=quiet)
    return 0
