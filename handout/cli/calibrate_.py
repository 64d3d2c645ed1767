"""`handout calibrate`: match a printer's colours to the ink, and verify, show and export what is stored."""

from __future__ import annotations

import json
from pathlib import Path

import click

from handout import units
from handout.cli.console import Console
from handout.cli.options import JSON, verb
from handout.errors import InputError
from handout.pipeline.declarations import argument, bundle, option, output, shared
from handout.pipeline.names import colour_formats
from handout.pipeline.options import CalibrationOptions, CalibrationPlace, ChartOptions

_PRINTER = shared(None, "A printer's profile (epson), a queue, or sim.", required=True)
_PAPER = option("plain", "What the paper is called; any name.")
_STORED_PRINTER = shared(None, "The printer that was calibrated.", required=True)
_STORED_PAPER = option("", "The paper; without it the printer's newest calibration.")


@click.group("calibrate")
def command() -> None:
    """Make a printer's colours those of the ink: print a chart, scan it, and pages go through what it shows.

    \b
    handout calibrate wizard --printer epson      step by step
    handout calibrate wizard --printer sim        to see how it goes, without a printer
    """


@verb("wizard", command)
def wizard(
    console: Console,
    printer: str = _PRINTER,
    paper: str = _PAPER,
    sheets: ChartOptions = ChartOptions(),
    calibration: CalibrationOptions = CalibrationOptions(),
    web: bool = option(False, "In the browser: the studio, opened at its page Calibration."),
) -> None:
    """Calibrate a printer step by step; a run that was left is gone on with.

    \b
    handout calibrate wizard --printer epson --web
    handout calibrate wizard --printer epson --paper plain
    handout calibrate wizard --printer epson --scanner "epson2:libusb:001:004"
    handout calibrate wizard --printer pdf -o charts       print the files yourself
    handout calibrate wizard --printer sim --paper cream
    """
    if web:
        from urllib.parse import quote

        from handout.cli.studio_ import open_studio
        from handout.pipeline.calibration_desk import check_printer

        if (sheets, calibration) != (ChartOptions(), CalibrationOptions()):
            raise InputError("--web takes --printer and --paper alone: the page asks for the rest.")
        check_printer(printer)
        open_studio((), f"calibration/{quote(printer)}/{quote(paper)}", None, browser=True, as_json=False)
        return
    from handout.pipeline.calibrating import calibrate

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


@verb("chart", command)
def chart(
    console: Console,
    printer: str = _PRINTER,
    paper: str = _PAPER,
    sheets: ChartOptions = ChartOptions(),
    output: Path | None = output("PDF to print yourself; without it the chart goes to the printer.", required=False),
    dry_run: Path | None = option(None, "PNG: the very pixels that the printer would get."),
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


@verb("read", command)
def read_chart(
    console: Console,
    scans: tuple[Path, ...] = argument(required=True),
    output: Path = output("The patches, as a .ti3 table."),
    report_file: Path | None = option(None, "A page with pictures of what was read, .html.", flags=("--report",)),
    hand: str = option("", "A scanned hand: was the chart scanned as its pages were?"),
    accept: bool = option(False, "Take the print as it is, though inks are weak in it."),
) -> None:
    """Read scans of the chart: all its pages, any angle, 50 to 1200 dpi.

    \b
    handout calibrate read scan.tif -o patches.ti3 --report report.html
    """
    from handout.pipeline.calibrating import read_scans

    result = read_scans(scans, output, report_file=report_file, hand=hand, accept=accept, listener=console)
    console.report(result, f"{units.count(result.told['patches'], 'colour')} read: {output}.")


@verb("build", command)
def build(
    console: Console,
    patches: Path,
    printer: str = _PRINTER,
    paper: str = _PAPER,
    asked: CalibrationOptions = bundle(CalibrationOptions(), only=("scanner_name", "method")),
) -> None:
    """Build the table of PATCHES (.ti3) and store it for the printer.

    \b
    handout calibrate build patches.ti3 --printer epson
    """
    from handout.pipeline.calibrating import build_table

    with console.working():
        result = build_table(
            patches, printer, paper, scanner_name=asked.scanner_name, method=asked.method, listener=console
        )
    calibration = result.calibration
    console.report(
        result,
        f"Stored: {calibration.describe()}; it misses its own patches by ΔE00 {calibration.misses:.2f} on the mean. "
        f"Verify it: handout calibrate verify --printer {calibration.printer} --paper {calibration.paper} -o strip.pdf",
    )


@verb("verify", command)
def verify(
    console: Console,
    printer: str = _STORED_PRINTER,
    paper: str = _STORED_PAPER,
    hand: str = option("", "Take the ink of this hand instead of usual inks."),
    sheet: str = option("A4", "A4 or letter."),
    output: Path | None = output("Write the strip as .pdf or .png instead of printing it.", required=False),
    scans: tuple[Path, ...] = option((), "The scanned strip: say how well colours match.", flags=("--scan",)),
    report_file: Path | None = option(None, "With --scan: pictures of before and after, .html.", flags=("--report",)),
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


@verb("show", command)
def show(
    printer: str = option("", "Only of this printer."),
    paper: str = option("", "Only of this paper."),
    as_json: bool = JSON,
) -> None:
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


@verb("export", command)
def export(
    console: Console,
    printer: str = _STORED_PRINTER,
    paper: str = _STORED_PAPER,
    kind: str = option(None, "What to write.", choices=colour_formats(), flags=("--format",), required=True),
    output: Path = output(None),
) -> None:
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
