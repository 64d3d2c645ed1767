"""`handout hand check`, `edit`, `export`, `import`, `remove`: what is done with hands read from scans; and `pen`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from handout import units
from handout.cli import jobs, results
from handout.errors import InputError
from handout.pipeline.inputs import hand_path

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from handout.completion.completed_hand import Outlook
    from handout.hand.scanned import ScannedHand
    from handout.prompting.coverage import Lack

_as_json = click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
_quiet = click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors.")


@click.command("check")
@click.argument("name")
@click.option("--output", "-o", help="A PNG file for the pages with what was found; several pages are numbered.")
@click.option("--for", "wanted", help="A text to be written: says how it comes by letters that are missing.")
@_as_json
@_quiet
def check(name: str, output: str | None, wanted: str | None, as_json: bool, quiet: bool) -> None:
    """Show what the scanned hand NAME (or a .hand file) holds, and what of it is doubtful.

    In the picture each letter is named: blue and green where sure, orange and red where doubtful, ligatures and what
    belongs to no letter in grey. A pixel of it is one of the scan, as corrections count them.

    \b
    handout hand check mine.hand -o overlay.png --for "Quick zebras jump"
    """
    from handout.completion.completed_hand import outlook
    from handout.hand import file, library, report
    from handout.prompting.coverage import lacks

    paths = _overlays(output)
    hand = file.load(library.scanned_file(name))
    supply = outlook(hand, wanted) if wanted else ()
    lacking = lacks(wanted, hand.instances, least=1) if wanted else ()
    files = _draw(hand, paths)
    missing = [
        {"letter": one.letter, "place": one.place, "needed": one.needed, "here": one.here, "anywhere": one.anywhere}
        for one in lacking
    ]
    result = {**report.facts(hand), "files": [str(path) for path in files]}
    if wanted is not None:
        result["lacks"] = missing
        result["supply"] = [{"letter": one.letter, "how": one.how, "from": one.source} for one in supply]
    if not as_json and not quiet:
        click.echo(report.table(hand))
    results.report(result, _checked(hand, files, lacking, supply, wanted), as_json=as_json, quiet=quiet)


def _overlays(output: str | None) -> Path | None:
    from handout import atomic

    if output is None:
        return None
    path = Path(output)
    if path.suffix.lower() != ".png":
        raise InputError(f"Overlays are written as PNG, not {path.suffix or 'without a suffix'}: use {path.stem}.png.")
    atomic.check_writable(path)
    return path


def _draw(hand: ScannedHand, path: Path | None) -> list[Path]:
    """The overlays as files."""
    from handout.hand import report

    if path is None:
        return []
    count = len(hand.pages)
    files = [path] if count == 1 else [path.with_name(f"{path.stem}-{n}{path.suffix}") for n in range(1, count + 1)]
    for number, file in enumerate(files):
        _write_png(file, report.overlay(hand, number), hand.pages[number].dpi)
    return files


def _write_png(path: Path, pixels: Any, dpi: float) -> None:
    import io

    from PIL import Image

    from handout import atomic

    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG", dpi=(dpi, dpi), compress_level=4)
    atomic.write(path, stream.getvalue())


def _checked(
    hand: ScannedHand, files: Sequence[Path], lacking: Sequence[Lack], supply: Sequence[Outlook], wanted: str | None
) -> str:
    from handout.hand import report

    few = [letter for letter, count in hand.letters.items() if count < report.LEAST]
    lines = [
        f"{hand.name}: {units.count(len(hand.glyphs), 'letter')} on {units.count(len(hand.pages), 'page')}, "
        f"{len(report.doubtful(hand))} doubtful; {len(few)} of {len(hand.letters)} fewer than {report.LEAST} times"
        + (": " + " ".join(f"{letter}({hand.letters[letter]})" for letter in few) if few else "")
        + "."
    ]
    if wanted is not None:
        other = sorted({f"{one.letter} ({one.place})" for one in lacking if one.anywhere})
        lines += _supplied(supply)
        if other:
            lines.append(f"In another place of a word only: {', '.join(other)}.")
    if files:
        lines.append(f"Wrote {', '.join(map(str, files))}.")
    return "\n".join(lines)


def _supplied(supply: Sequence[Outlook]) -> list[str]:
    """How a text comes by the letters that its hand lacks."""
    if not supply:
        return ["Every letter of that text is there."]
    composed, lent = (
        ", ".join(f"{one.letter} ({one.source})" for one in supply if one.how == how) for how in ("composed", "lent")
    )
    missing = ", ".join(one.letter for one in supply if one.how == "missing")
    lines = [f"Put together from what the author wrote: {composed}."] if composed else []
    lines += [f"Lent with --fallback, as the author never wrote it: {lent}."] if lent else []
    lines += [f"For that text there is no {missing}, and nothing to lend for it."] if missing else []
    return lines


@click.command("edit")
@click.argument("name")
@click.argument("corrections")
@click.option("--output", "-o", help="Another .hand file for the result; default: the same.")
@_as_json
@_quiet
def edit(name: str, corrections: str, output: str | None, as_json: bool, quiet: bool) -> None:
    """Make the corrections of a JSON file to the hand NAME (or a .hand file), after those that it has already.

    Places are pixels of the scan, as in the picture of `handout hand check`; pages are numbered from 0.

    \b
    {"corrections": [{"do": "label", "page": 0, "at": [812, 440], "text": "e"},
                     {"do": "remove", "page": 0, "at": [90, 1300]},
                     {"do": "merge", "page": 0, "at": [300, 200], "other": [320, 204]},
                     {"do": "split", "page": 0, "a": [500, 600], "b": [505, 660], "texts": ["r", "n"]}]}
    Others: unlink (at), link (at, other), place (at, place: start, middle, end or alone).
    """
    from handout import atomic
    from handout.hand import file, library
    from handout.hand.corrections import apply, read_corrections

    source = library.scanned_file(name)
    path = hand_path(output) if output else source
    if library.comes_with_program(path):
        raise InputError(f"{path.stem} comes with the program: give a .hand file for the result with --output.")
    try:
        data = Path(corrections).read_bytes()
    except OSError as error:
        raise InputError(f"Cannot read {corrections}: {error.strerror or error}.") from error
    new = read_corrections(data, corrections)
    found, made = file.read(source)
    atomic.check_writable(path)
    # made on the corrected hand, so that a message counts as the file does
    hand = apply(apply(found, made), new)
    file.save(found, path, (*made, *new))
    result = {"files": [str(path)], "made": len(new), "corrections": len(made) + len(new), "glyphs": len(hand.glyphs)}
    said = f"Wrote {path}: {len(new)} corrections made, {len(made) + len(new)} in all."
    results.report(result, said, as_json=as_json, quiet=quiet)


@click.command("pen")
@click.argument("scans", metavar="SCAN...", nargs=-1, required=True)
@click.option("--output", "-o", required=True, help="The .hand file.")
@click.option("--dpi", type=float, help="Pixels an inch of the scans, where the files do not say.")
@_as_json
@_quiet
def pen(scans: tuple[str, ...], output: str, dpi: float | None, as_json: bool, quiet: bool) -> None:
    """Keep a pen, to write in a scanned hand with: from scans of anything drawn with it, without a text.

    Half a page of loose waves, loops and strokes in all directions is enough, not over each other.

    \b
    handout hand pen scribble.png -o pen.hand
    """
    from dataclasses import replace

    from handout import atomic
    from handout.hand import file
    from handout.inking.swatches import swatches
    from handout.scanning.picture_files import read_scan
    from handout.scanning.written_page import read_page
    from handout.tagging.page_tagging import pen_of_pages

    path = hand_path(output)
    atomic.check_writable(path)
    # the size of what is drawn tells nothing of the resolution
    pages = [read_page(replace(read_scan(Path(scan), dpi), told=True)) for scan in scans]
    hand = pen_of_pages(path.stem, pages)
    radius, pieces = swatches(hand)[0].radius, sum(len(one.start) for one in swatches(hand))
    file.save(hand, path)
    result = {"files": [str(path)], "pieces": pieces, "width": round(2 * radius, 3)}
    said = f"Wrote {path}: a line {2 * radius:.2f} mm wide, {pieces} pieces of it."
    results.report(result, said, as_json=as_json, quiet=quiet)


@click.command("export")
@click.argument("name")
@click.option("--output", "-o", required=True, help="The .hand file.")
@_as_json
@_quiet
def export(name: str, output: str, as_json: bool, quiet: bool) -> None:
    """Copy the scanned hand NAME into a file, to be given to somebody or kept."""
    from handout import atomic
    from handout.hand import file, library

    source, path = library.scanned_file(name), hand_path(output)
    file.check(source)
    atomic.write(path, source.read_bytes())
    results.report({"files": [str(path)]}, f"Wrote {path}.", as_json=as_json, quiet=quiet)


@click.command("import")
@click.argument("source", metavar="FILE")
@click.option("--name", help="Call it so; default: the name of the file.")
@click.option("--replace", is_flag=True, help="In place of one that is there under that name.")
@_as_json
@_quiet
def import_(source: str, name: str | None, replace: bool, as_json: bool, quiet: bool) -> None:
    """Put a .hand FILE among your own hands, so that its name is enough to use it."""
    from handout import atomic
    from handout.hand import file, library

    hand = file.check(Path(source))  # its ink too: a damaged one would be found when it is written with
    called = name or Path(source).stem
    path = library.own_file(called)
    if path.exists() and not replace:
        raise InputError(f"There is a hand {called!r} already: give another --name, or --replace it.")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"Cannot make the folder {path.parent}: {error.strerror or error}.") from error
    atomic.write(path, Path(source).read_bytes())
    said = f"{called}: {units.count(len(hand.glyphs), 'letter')}; kept in {path}."
    results.report({"name": called, "files": [str(path)]}, said, as_json=as_json, quiet=quiet)


@click.command("remove")
@click.argument("name")
@_as_json
@_quiet
def remove(name: str, as_json: bool, quiet: bool) -> None:
    """Delete the scanned hand NAME from among your own hands."""
    from handout.hand import library

    known = library.own_scanned()
    if name not in known:
        raise InputError(f"Among your own hands there is none called {name!r}{_these(known)}.")
    try:
        known[name].unlink()
    except OSError as error:
        raise InputError(f"Cannot delete {known[name]}: {error.strerror or error}.") from error
    results.report({"name": name, "files": [str(known[name])]}, f"Deleted {known[name]}.", as_json=as_json, quiet=quiet)


def _these(known: dict[str, Path]) -> str:
    return f"; there are {', '.join(sorted(known))}" if known else ""


def show(hand: ScannedHand, output: Sequence[str], text: str | None, given: Mapping[str, Any]) -> None:
    """The letters of a scanned hand side by side, or those that would write a text, as PNG files."""
    from handout import atomic
    from handout.hand import report

    paths = [Path(file) for file in output]
    for path in paths:
        if path.suffix.lower() != ".png":
            raise InputError(f"The letters of a scanned hand are written as PNG: use {path.stem}.png.")
        atomic.check_writable(path)
    pixels, found = (report.contact_sheet(hand), report.facts(hand)) if text is None else _choices(hand, text, given)
    for path in paths:
        _write_png(path, pixels, 200.0)
    said = f"Wrote {', '.join(map(str, paths))}"
    said += f": {units.count(len(hand.glyphs), 'letter')}, {len(hand.letters)} different ones." if text is None else "."
    said += results.lent(found)
    found = {**found, "files": [str(path) for path in paths]}
    results.report(found, "\n".join([*found.get("why", ()), said]), as_json=given["as_json"], quiet=given["quiet"])


def _choices(hand: ScannedHand, text: str, given: Mapping[str, Any]) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    """Which letters of a hand would write a text: a picture, and why in words."""
    import numpy as np

    from handout.writing.scanned.explaining import choices_sheet, reasons
    from handout.writing.scanned.line_writer import ScannedLineWriter

    seed = jobs.seed(given)
    hand, borrowed = jobs.supplied(text, hand, given["fallback"], seed)
    writer = ScannedLineWriter(hand, np.random.default_rng([seed]), given["jitter"])
    explained = writer.explained(text)
    why = reasons(writer.index, explained)
    found = {"hand": hand.name, "text": text, "seed": seed, "why": why}
    return choices_sheet(hand, explained), found | ({"borrowed": borrowed} if borrowed else {})


COMMANDS = (check, edit, pen, export, import_, remove)
