"""`handout calibrate`: verify, show and export calibrations that are stored."""

from __future__ import annotations

import json
from pathlib import Path

import click

from handout.cli import results
from handout.colour import exports
from handout.errors import InputError

_PATH = click.Path(path_type=Path)


@click.command()
@click.option("--printer", required=True, help="The printer that was calibrated.")
@click.option("--paper", default="", help="The paper; without it the printer's newest calibration.")
@click.option("--hand", default="", help="Take the ink of this hand instead of usual inks.")
@click.option("--sheet", default="A4", show_default=True, help="A4 or letter.")
@click.option("-o", "--output", type=_PATH, help="Write the strip as .pdf or .png instead of printing it.")
@click.option("--scan", "scans", type=_PATH, multiple=True, help="The scanned strip: say how well colours match.")
@click.option("--report", "report_", type=_PATH, help="With --scan: a page with pictures of before and after, .html.")
@results.output_options
def verify(printer: str, paper: str, hand: str, sheet: str, output: Path | None, scans: tuple[Path, ...],
           report_: Path | None, as_json: bool, quiet: bool) -> int:  # fmt: skip
    """Print a verification strip, and read its scan: ΔE00 with the calibration and without it.

    \b
    handout calibrate verify --printer epson -o strip.pdf
    handout calibrate verify --printer epson --scan strip-scan.png
    """
    from handout.calibrating import pages, reporting, store, verification
    from handout.printing.printers import resolve

    found = store.wanted(printer, paper)
    if scans:
        made = verification.verify(found, scans)
        if report_ is not None:
            reporting.write(found, report_)
        said = "\n".join([*(f"warning: {one}" for one in made.findings), f"{found.described()}:", *made.lines()])
        results.report(made.facts(), said, as_json=as_json, quiet=quiet)
        return 0
    profile = resolve(printer)
    if profile.file and output is None:
        raise InputError(f"{printer} writes a file: name it with -o strip.pdf.")
    strip = verification.prepare(found, hand, sheet)
    printed = verification.pages(strip, found, profile)
    if output is not None:
        files, jobs = [str(path) for path in pages.write(printed, output)], []
    else:
        files, jobs = [], list(pages.send(printed, profile))
    then = f"handout calibrate verify --printer {found.printer} --paper {found.paper} --scan SCAN"
    where = ", ".join(files) or "sent to the printer"
    said = f"Strip of {found.described()}: {where}. Scan it like the chart, then: {then}"
    results.report({"files": files, "jobs": jobs, "calibration": found.name}, said, as_json=as_json, quiet=quiet)
    return 0


@click.command()
@click.option("--printer", default="", help="Only of this printer.")
@click.option("--paper", default="", help="Only of this paper.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
def show(printer: str, paper: str, as_json: bool) -> int:
    """The stored calibrations, the newest first; the first of a printer and paper is the one that is used.

    \b
    handout calibrate show --printer epson
    """
    from handout.calibrating import store, verification

    if printer:
        store.wanted(printer, paper)
    found = [
        one
        for one in store.every()
        if (not printer or one.printer == store.key(printer)) and (not paper or one.paper == store.key(paper))
    ]
    if as_json:
        click.echo(json.dumps({"calibrations": [one.facts() for one in found]}, ensure_ascii=False))
        return 0
    if not found:
        click.echo("Nothing is calibrated yet: handout calibrate wizard --printer NAME")
    for one in found:
        misses = "" if one.misses is None else f", misses its patches by ΔE00 {one.misses:.2f}"
        click.echo(f"{one.described()}: {one.method}{misses}, scanner {one.scanner or 'not named'}; {one.folder}")
        facts = one.verification()
        for line in ["not verified"] if facts is None else verification.table_lines(facts):
            click.echo(f"  {line}")
    return 0


@click.command()
@click.option("--printer", required=True, help="The printer that was calibrated.")
@click.option("--paper", default="", help="The paper; without it the printer's newest calibration.")
@click.option("--format", "kind", type=click.Choice(list(exports.FORMATS)), required=True, help="What to write.")
@click.option("-o", "--output", type=_PATH, required=True)
@results.output_options
def export(printer: str, paper: str, kind: str, output: Path, as_json: bool, quiet: bool) -> int:
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
    from handout import atomic
    from handout.calibrating import store

    found = store.wanted(printer, paper)
    atomic.check_writable(output)
    title = f"{found.name} {found.made:%Y-%m-%d}"
    source = exports.Source(found.table(), found.made, title, found.table_file, found.patches_file)
    atomic.write(output, exports.FORMATS[kind](source))
    results.report({"files": [str(output)]}, f"{found.described()}: {output}.", as_json=as_json, quiet=quiet)
    return 0


COMMANDS = (verify, show, export)
