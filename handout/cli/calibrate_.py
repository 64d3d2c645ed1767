"""`handout calibrate`: match a printer's colours to the ink, and verify, show and export what is stored."""

from __future__ import annotations

import json
from pathlib import Path

import click

from handout import units
from handout.cli import options
from handout.cli.commands import VerbGroup
from handout.cli.console import Console
from handout.errors import InputError
from handout.pipeline.names import colour_formats
from handout.pipeline.options import CalibrationOptions, CalibrationPlace, ChartOptions

_PATH = click.Path(path_type=Path)

printer_option = options.shared("--printer", required=True, help="A printer's profile (epson), a queue, or sim.")
paper_option = click.option("--paper", default="plain", show_default=True, help="What the paper is called; any name.")
_stored_printer = options.shared("--printer", required=True, help="The printer that was calibrated.")
_stored_paper = click.option("--paper", default="", help="The paper; without it the printer's newest calibration.")

_chart = options.bind("sheets", ChartOptions)


@click.group("calibrate", cls=VerbGroup)
def command() -> None:
    """Make a printer's colours those of the ink: print a chart, scan it, and pages go through what it shows.

    \b
    handout calibrate wizard --printer epson      step by step
    handout calibrate wizard --printer sim        to see how it goes, without a printer
    """


@command.command()
@printer_option
@paper_option
@_chart
@options.bind("calibration", CalibrationOptions)
@click.option("--web", is_flag=True, help="In the browser: the studio, opened at its page Calibration.")
@options.console
def wizard(
    printer: str, paper: str, sheets: ChartOptions, calibration: CalibrationOptions, web: bool, console: Console
) -> None:
    """Calibrate a printer step by step; a run that was left is gone on with.

    \b
    handout calibrate wizard --printer epson --web
    handout calibrate wizard --printer epson --paper plain
    handout calibrate wizard --printer epson --scanner "epson2:libusb:001:004"
    handout calibrate wizard --printer pdf -o charts       print the files yourself
    handout calibrate wizard --printer sim --paper cream
    """
    from handout.pipeline.calibrating import calibrate

    if web:
        _in_browser(printer, paper, sheets, calibration)
        return
    try:
        with console.working():
            place = CalibrationPlace(printer, paper, sheets, calibration)
            result = calibrate(place, attendant=console)
    except (click.Abort, KeyboardInterrupt) as stop:
        again = f"handout calibrate wizard --printer {printer} --paper {paper}"
        stop.add_note(f"What was done so far is kept; go on with: {again}")
        raise
    stored = result.calibration
    console.report(result, f"Stored: {stored.describe()}; report: {stored.report}.")


def _in_browser(printer: str, paper: str, sheets: ChartOptions, calibration: CalibrationOptions) -> None:
    """The same as a page of the studio, which asks for all else itself."""
    from urllib.parse import quote

    from handout.cli.studio_ import open_studio
    from handout.pipeline.calibration_desk import check_printer

    if (sheets, calibration) != (ChartOptions(), CalibrationOptions()):
        raise InputError("--web takes --printer and --paper alone: the page asks for the rest.")
    check_printer(printer)
    open_studio((), f"calibration/{quote(printer)}/{quote(paper)}", None, browser=True, as_json=False)


@command.command()
@printer_option
@paper_option
@_chart
@click.option("-o", "--output", type=_PATH, help="PDF to print yourself; without it the chart goes to the printer.")
@click.option("--dry-run", type=_PATH, help="PNG: the very pixels that the printer would get.")
@options.console
def chart(
    printer: str, paper: str, output: Path | None, dry_run: Path | None, sheets: ChartOptions, console: Console
) -> None:
    """Print the calibration chart, or write it to a file.

    \b
    handout calibrate chart --printer epson -o chart.pdf
    handout calibrate chart --printer epson --dry-run chart.png
    """
    from handout.pipeline.calibrating import print_chart

    result = print_chart(printer, paper, sheets, outputs=[path for path in (output, dry_run) if path is not None])
    told = result.told
    where = ", ".join(map(str, result.files)) or f"{units.count(len(told['jobs']), 'job')} sent"
    console.report(result, f"Chart of {units.count(told['pages'], 'page')} for {told['dpi']} dpi: {where}.")


@command.command("read")
@click.argument("scans", nargs=-1, required=True, type=_PATH)
@click.option("-o", "--output", type=_PATH, required=True, help="The patches, as a .ti3 table.")
@click.option("--report", "report_file", type=_PATH, help="A page with pictures of what was read, .html.")
@click.option("--hand", default="", help="A scanned hand: was the chart scanned as its pages were?")
@click.option("--accept", is_flag=True, help="Take the print as it is, though inks are weak in it.")
@options.console
def read_chart(
    scans: tuple[Path, ...], output: Path, report_file: Path | None, hand: str, accept: bool, console: Console
) -> None:
    """Read scans of the chart: all its pages, any angle, 50 to 1200 dpi.

    \b
    handout calibrate read scan.tif -o patches.ti3 --report report.html
    """
    from handout.pipeline.calibrating import read_scans

    result = read_scans(scans, output, report_file=report_file, hand=hand, accept=accept, listener=console)
    console.report(result, f"{units.count(result.told['patches'], 'colour')} read: {output}.")


@command.command()
@click.argument("patches", type=_PATH)
@printer_option
@paper_option
@options.from_dataclass(CalibrationOptions, only=("scanner_name", "method"))
@options.console
def build(patches: Path, printer: str, paper: str, scanner_name: str, method: str, console: Console) -> None:
    """Build the table of PATCHES (.ti3) and store it for the printer.

    \b
    handout calibrate build patches.ti3 --printer epson
    """
    from handout.pipeline.calibrating import build_table

    with console.working():
        result = build_table(patches, printer, paper, scanner_name=scanner_name, method=method, listener=console)
    calibration = result.calibration
    console.report(
        result,
        f"Stored: {calibration.describe()}; it misses its own patches by ΔE00 {calibration.misses:.2f} on the mean. "
        f"Verify it: handout calibrate verify --printer {calibration.printer} --paper {calibration.paper} -o strip.pdf",
    )


@command.command()
@_stored_printer
@_stored_paper
@click.option("--hand", default="", help="Take the ink of this hand instead of usual inks.")
@click.option("--sheet", default="A4", show_default=True, help="A4 or letter.")
@click.option("-o", "--output", type=_PATH, help="Write the strip as .pdf or .png instead of printing it.")
@click.option("--scan", "scans", type=_PATH, multiple=True, help="The scanned strip: say how well colours match.")
@click.option("--report", "report_file", type=_PATH, help="With --scan: pictures of before and after, .html.")
@options.console
def verify(
    printer: str,
    paper: str,
    hand: str,
    sheet: str,
    output: Path | None,
    scans: tuple[Path, ...],
    report_file: Path | None,
    console: Console,
) -> None:
    """Print a verification strip, and read its scan: ΔE00 with the calibration and without it.

    \b
    handout calibrate verify --printer epson -o strip.pdf
    handout calibrate verify --printer epson --scan strip-scan.png
    """
    from handout.pipeline import calibrating

    if scans:
        read = calibrating.verify(printer, paper, scans, report_file=report_file)
        warnings = (f"warning: {finding}" for finding in read.verification.findings)
        head = f"{read.calibration.describe()}:"
        console.report(read, "\n".join([*warnings, head, *read.verification.lines()]))
        return
    strip = calibrating.print_strip(printer, paper, hand=hand, sheet=sheet, output=output)
    calibration = strip.calibration
    where = ", ".join(map(str, strip.files)) or "sent to the printer"
    console.report(
        strip,
        f"Strip of {calibration.describe()}: {where}. Scan it like the chart, then: "
        f"handout calibrate verify --printer {calibration.printer} --paper {calibration.paper} --scan SCAN",
    )


@command.command()
@click.option("--printer", default="", help="Only of this printer.")
@click.option("--paper", default="", help="Only of this paper.")
@options.as_json
def show(printer: str, paper: str, as_json: bool) -> None:
    """The stored calibrations, the newest first; the first of a printer and paper is the one that is used.

    \b
    handout calibrate show --printer epson
    """
    from handout.pipeline.calibrating import stored_calibrations

    stored = stored_calibrations(printer, paper)
    if as_json:
        click.echo(json.dumps(stored.facts(), ensure_ascii=False))
        return
    if not stored.calibrations:
        click.echo("Nothing is calibrated yet: handout calibrate wizard --printer NAME")
    for line in stored.lines():
        click.echo(line)


@command.command()
@_stored_printer
@_stored_paper
@click.option("--format", "kind", type=click.Choice(colour_formats()), required=True, help="What to write.")
@click.option("-o", "--output", type=_PATH, required=True)
@options.console
def export(printer: str, paper: str, kind: str, output: Path, console: Console) -> None:
    """Write a calibration for other programs.

    \b
    icc       the printer's profile, for GIMP, Photoshop, CUPS; "absolute colorimetric" gives our colours
    icc-link  a device link: RGB as it was scanned to RGB to send
    cube      the same table as .cube
    ti3       the patches, for ArgyllCMS
    png, npz  a picture of the table, and the table itself

    \b
    handout calibrate export --printer epson --format icc -o epson.icc
    handout calibrate export --printer epson --format cube -o epson.cube
    handout print --calibration epson.npz --printer epson envelope.csv     (after --format npz)
    """
    from handout.pipeline.calibrating import export

    exported = export(printer, paper, kind, output)
    console.report(exported, f"{exported.calibration.describe()}: {output}.")
