"""`handout print`: envelopes from a table of addresses."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from handout import page_sizes, units
from handout.cli import jobs, options, progress, results
from handout.errors import InputError

if TYPE_CHECKING:
    from handout.calibrating.through import Ink, Through
    from handout.printing.journal import Journal
    from handout.printing.report import Report
    from handout.printing.rows import Row
    from handout.profiles import Printer
    from handout.values import Drawing, Raster
    from handout.writing.layout import Layout

_MOST_NAMED = 12
_MOST_NUDGE = 50.0  # mm, as in a profile
# options that change nothing on paper
_NOT_OF_THE_BATCH = {"resume", "again", "afresh", "as_json", "quiet", "dpi", "paper", "transparent"}


@click.command("print")
@click.argument("table", type=click.Path(path_type=Path))
@click.option("--printer", default="pdf", show_default=True, help="A printer's profile (epson), queue, or ipp://…")
@click.option("--queue", default="", help="Where the pages go: a CUPS queue, ipp://HOST/ipp/print, or file:FOLDER.")
@click.option("--dry-run", type=click.Path(path_type=Path), help="Write .pdf, .png or .svg instead of printing.")
@click.option("--page", "page_name", default="DL", show_default=True, help=page_sizes.HELP)
@click.option("--rows", default="", help="Rows by their numbers in the file, the header is 1: 3-7,9 or 7-.")
@click.option("--columns", multiple=True, metavar="WHAT=COLUMN", help='What columns hold: "name=Guest(s)" or "1=name".')
@click.option("--address", default="", help="Of several addresses of a row: home, business, 2 …")
@click.option("--no-name", is_flag=True, help="Print a table that has no names.")
@click.option("--copies", type=int, default=1, show_default=True, help="Envelopes for each row.")
@click.option("--resume", is_flag=True, help="Go on with a batch that broke off: print exactly the rest of it.")
@click.option("--again", default="", metavar="ROWS", help="With --resume: print these whatever became of them.")
@click.option("--afresh", is_flag=True, help="Print all of it, though an earlier run of it broke off.")
@click.option("--tray", default="", help="Feed from this tray, as the printer calls it (rear, main …).")
@click.option("--feed", type=click.Choice(["short", "long"]), help="The edge of the sheet that goes in first.")
@click.option(
    "--flap",
    type=click.Choice(["left", "right", "leading", "trailing"]),
    help="Where an envelope's flap is, print side towards you, the edge that goes in first upwards.",
)
@click.option("--nudge", metavar="X,Y", help="Move the writing to the right and down: 1.5mm,-0.5mm.")
@click.option("--format", type=click.Choice(["pdf", "pwg", "urf", "png"]), help="Of what is sent; default: the best.")
@click.option("--calibration", default="", help="A printer/paper, a file, or none; default: the printer's newest.")
@click.option("--stock", default="", help="What paper is in the printer, as it was called when it was calibrated.")
@options.writing_options
@options.slips_option
@options.picture_options
def command(table: Path, dry_run: Path | None, page_name: str, **given: Any) -> int:
    """Address an envelope for every row of TABLE (CSV, or .xlsx) and print it.

    \b
    handout print --printer epson envelope.csv
    handout print --printer epson envelope.csv --dry-run preview.pdf --rows 2-4
    handout print --printer epson --calibration epson/cream envelope.csv
    handout print --printer epson --queue ipp://192.168.1.7/ipp/print envelope.csv
    handout print --printer epson --queue ipp://192.168.1.7/ipp/print envelope.csv --resume
    """
    from click.core import ParameterSource

    from handout.printing import media
    from handout.printing.address_table import read_addresses
    from handout.printing.batch import UNCALIBRATED, PrintingStopped, print_rows
    from handout.printing.journal import Journal
    from handout.printing.printers import resolve
    from handout.sinks import write_drawings

    if given["slips"]:
        raise InputError("slips: an envelope has to arrive, so addresses are written without slips; leave --slips out.")
    profile = resolve(given["printer"], given["queue"])
    if profile.file and not profile.simulated and dry_run is None:
        raise InputError(
            f"{given['printer']} writes a file: name it with --dry-run out.pdf, or name a printer with --printer."
        )
    addresses = read_addresses(table, given["columns"], given["address"], given["no_name"])
    say = results.talk(given["quiet"])
    for note in addresses.notes:
        say(f"{table}: {note}.")
    prints = dry_run is None or (profile.simulated and dry_run.suffix == "")
    job = jobs.setup(given, page_name, "0mm", 1)
    profile = _fed(media.printer_for(job.layout.page, profile), given)
    notes = results.noted(jobs.unheeded(job, given, True), job, given["quiet"])
    if prints:
        told = given | {"page_name": page_name, "columns": ",".join(given["columns"])}
        journal = _journal(table, addresses, told, job.seed)
        job = replace(job, seed=journal.seed)
    elif given["resume"] or given["afresh"]:
        raise InputError("--resume and --afresh are for printing: leave them out of a --dry-run.")
    else:
        journal = Journal()
    look = options.look(given)
    chosen = click.get_current_context().get_parameter_source("x_height") == ParameterSource.COMMANDLINE
    tally = results.Tally()

    def write(text: str, layout: Layout, row: int) -> Drawing:
        layout = _with_options(layout, job)
        pages, drawings = jobs.compose_and_trace(text, job, layout, row)
        tally.add(pages, drawings)
        return drawings[0]

    def ink(drawing: Drawing, dpi: int) -> Raster:
        from handout.inking import pens

        return pens.ink(drawing, dpi, look["pen"], pens.noise(drawing.about))

    through = _through(given, ink, say)
    if through is None and dry_run is None and not given["calibration"]:
        say(UNCALIBRATED)
    try:
        with journal, progress.shown(given["quiet"]) as tell:
            done = print_rows(
                addresses,
                write,
                profile,
                job.layout.page,
                out=dry_run,
                select=given["rows"],
                copies=given["copies"],
                x_height=job.layout.x_height if chosen else None,
                ink=through or ink,
                sink=lambda drawing, path: write_drawings([drawing], [path], **look),
                about={"seed": job.seed, "hand": job.hand.name},
                progress=lambda done, total, stage: tell(done / max(total, 1), f"{stage} {done}/{total}"),
                journal=journal,
                again=given["again"],
                say=say,
            )
    except PrintingStopped as stopped:
        _say_problems(stopped.report, given["quiet"])
        raise
    _say_problems(done, given["quiet"])
    result = tally.facts(job, done.files) | _facts(done) | {"columns": addresses.facts()} | notes
    if through is not None and through.pages:
        result["calibration"] = through.facts()
        say(through.said())
    said = f"{_told(done, profile.queue or given['printer'])}; {results.writing_time(result)}seed {job.seed}."
    results.report(result, said + results.lent(result), as_json=given["as_json"], quiet=given["quiet"])
    return done.exit_code


def _through(given: Mapping[str, Any], ink: Ink, say: Callable[[str], None]) -> Through | None:
    """The way of pages through the printer's calibration; None if there is none, or none is wanted."""
    from handout.calibrating import through

    found, doubts = through.choose(given["printer"], given["stock"], given["calibration"])
    for doubt in doubts:
        say(f"warning: {doubt}")
    if found is None:
        return None
    return through.Through(ink, found, through.pen_of(found, given["hand"], say), given["hand"], options.pen(given))


def _fed(profile: Printer, given: Mapping[str, Any]) -> Printer:
    """The printer with what the options say otherwise than its profile."""
    import msgspec

    from handout.profiles import Length, Nudge

    changed: dict[str, Any] = {name: given[name] for name in ("feed", "flap", "format") if given[name]}
    if given["tray"]:
        changed["source"] = given["tray"]
    if given["nudge"] is not None:
        parts = given["nudge"].split(",")
        if len(parts) != 2:
            raise InputError(f"nudge: {given['nudge']!r} is not two lengths; write it as --nudge 1.5mm,-0.5mm.")
        x, y = (units.length(part, "nudge") for part in parts)
        if max(abs(x), abs(y)) > _MOST_NUDGE:
            raise InputError(f"nudge: {given['nudge']} moves the writing by more than {_MOST_NUDGE:g} mm.")
        changed["nudge"] = Nudge(x=Length(x), y=Length(y))
    return msgspec.structs.replace(profile, **changed)


def _journal(table: Path, addresses: Sequence[Row], given: Mapping[str, Any], seed: int) -> Journal:
    """The journal of this batch: a new one, or the one that is gone on with, which has the seed of its beginning."""
    from handout.hand import library
    from handout.printing import journal

    if given["resume"] and given["afresh"]:
        raise InputError("--resume goes on with a batch, --afresh prints all of it again: give one of them.")
    told = {name: value for name, value in given.items() if name not in _NOT_OF_THE_BATCH}
    what = journal.batch(table, addresses, library.path(given["hand"]), told)
    return journal.resume(what) if given["resume"] else journal.begin(what, seed, afresh=given["afresh"])


def _facts(done: Report) -> dict[str, Any]:
    """What `--json` prints of a batch."""
    return {
        "rows": len(done.rows),
        "failed": [{"row": failed.row, "reason": failed.reason} for failed in done.failed],
        "jobs": [sent.name for sent in done.jobs],
        "warnings": list(done.warnings),
        "before": list(done.before),
        "unknown": [{"row": one.row, "reason": one.reason} for one in done.unknown],
    }


def _told(done: Report, to: str) -> str:
    """What became of a batch, in a few words."""
    where = ", ".join(map(str, done.files[:_MOST_NAMED])) or f"{units.count(len(done.jobs), 'job')} to {to}"
    before = f", {len(done.before)} before" if done.before else ""
    return f"{len(done.rows)} of {units.count(len(done.rows) + len(done.failed), 'envelope')} done ({where}){before}"


def _with_options(layout: Layout, job: jobs.Setup) -> Layout:
    """The layout of an address with what the user asked for."""
    asked = job.layout
    return replace(
        layout, align=asked.align, jitter=asked.jitter, line_spacing=asked.line_spacing or layout.line_spacing
    )


def _say_problems(done: Report, quiet: bool) -> None:
    """Rows that failed are always named; warnings unless the user wants quiet."""
    for failed in done.failed:
        click.echo(f"row {failed.row}: {failed.reason}", err=True)
    for one in done.unknown:
        way = f"look whether the envelope is there; --resume --again {one.row} prints it again"
        click.echo(f"row {one.row}: {one.reason}; {way}.", err=True)
    if not quiet:
        for warning in done.warnings:
            click.echo(f"warning: {warning}", err=True)
