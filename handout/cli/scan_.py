"""`handout hand read`: a hand from scanned pages or recorded pens, and their texts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from handout import units
from handout.cli import progress, results
from handout.errors import InputError
from handout.inking.pen import TEXTURED
from handout.progress import within

if TYPE_CHECKING:
    from handout.hand.scanned import ScannedHand
    from handout.tagging.page_sources import PageSource, Say
    from handout.tagging.page_tagging import TaggedPage
    from handout.tagging.recording import Recording

_MOST_TEXT = 200_000  # bytes; no page holds more
_OPENED, _MADE = 0.04, 0.97  # of the work on a page, when it is opened, and when its letters are found; measured
_LEAST_SURE = 0.7  # share of letters that are not doubtful, below which a look is advised


@click.command("read")
@click.argument("name")
@click.option(
    "--scan",
    "scans",
    multiple=True,
    help="A scanned page: PNG, JPEG, TIFF, PDF; of several pages all, or FILE:2, or FILE:2-4. Repeatable.",
)
@click.option(
    "--ink",
    "inks",
    multiple=True,
    help="A recorded pen: .inkml .dat .svc .gml .svg .json; or a single-line SVG font. Repeatable.",
)
@click.option("--text", "texts", multiple=True, help="A text file with what is on it, line by line; in the same order.")
@click.option("--output", "-o", required=True, help="The .hand file.")
@click.option("--dpi", type=float, help="Pixels an inch of the scans, where the files do not say.")
@click.option("--pen", type=click.Choice(TEXTURED), help="What it was written with; default: told from the ink.")
@click.option("--title", help="What to call the hand, for people.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Same seed, same hand.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
@click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors.")
def read(name: str, output: str, as_json: bool, quiet: bool, **given: Any) -> None:
    """Read a hand from scanned pages, or from recorded_pages of a pen, and their texts, and call it NAME.

    A sheet made with `handout hand prompt` needs no text: it says itself what is written on it, and may be
    photographed. A recording with labels of texts or words, as UNIPEN has, needs none either, nor does a
    font. Words that were struck out are ~~marked so~~ in the text. Look at what was found with `handout hand check`.

    \b
    handout hand read mine --scan page1.png --text page1.txt --scan page2.png --text page2.txt -o mine.hand
    handout hand read mine --scan both.pdf --text page1.txt --text page2.txt -o mine.hand
    handout hand read mine --scan sheet1.png --scan sheet2.png -o mine.hand
    handout hand read mine --ink page.inkml --text page.txt -o mine.hand
    """
    from handout import atomic
    from handout.hand import file, report
    from handout.tagging.page_sources import gather_sources, tagged_pages
    from handout.tagging.page_tagging import hand_of_pages

    path = hand_path(output)
    atomic.check_writable(path)
    say = results.talk(quiet)
    written = [(text, _text(Path(text))) for text in given["texts"]]
    scans, inks = given["scans"], given["inks"]
    if bool(scans) == bool(inks):
        raise InputError("A hand is read from scans or from recorded pens: give --scan or --ink, one of them.")
    with progress.shown(quiet) as tell:
        tell(0.0, "opening the pages")
        pages = _recorded(inks, written, say) if inks else gather_sources(scans, written, given["dpi"], say)
        made = list(tagged_pages(pages, given["seed"], given["pen"], say, tell=within(tell, _OPENED, _MADE)))
        tell(_MADE, "writing the hand")
        hand = hand_of_pages(name, made, given["title"] or "")
        file.save(hand, path)
    result = {**report.facts(hand), "files": [str(path)], "seed": given["seed"], "found": [_found(m) for m in made]}
    results.report(result, _said(hand, path, made), as_json=as_json, quiet=quiet)


def _recorded(inks: Sequence[str], texts: Sequence[tuple[str, str]], say: Say) -> list[PageSource]:
    """The pages of recorded pens."""
    from handout.tagging.recorded_pages import page_source, recorded_pages

    if texts and len(texts) != len(inks):
        raise InputError(
            f"{len(texts)} --text for {len(inks)} --ink: give one for each, in the same order, or none where the "
            "recordings have labels."
        )
    words = [text for _, text in texts] or [""] * len(inks)
    given = [one for ink, text in zip(inks, words, strict=True) for one in _recordings(ink, text)]
    return [page_source(one) for one in recorded_pages(given, say)]


def _recordings(ink: str, text: str) -> list[Recording]:
    from handout.hand import svg_font
    from handout.sources import read_drawing
    from handout.tagging.recorded_pages import font_specimen
    from handout.tagging.recording import Recording

    if svg_font.holds_font(Path(ink)):
        return font_specimen(ink, svg_font.read(Path(ink)))
    return [Recording(ink, read_drawing(ink), text)]


def _text(path: Path) -> str:
    from handout.cli.options import decoded

    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"Cannot read {path}: {error.strerror or error}.") from error
    if len(data) > _MOST_TEXT:
        raise InputError(f"{path}: {len(data)} bytes are more than a page holds; give the text of one page.")
    text = decoded(data, str(path))
    if not text.strip():
        raise InputError(f"{path} is empty: give what is written on the page, line by line.")
    return text


def _found(made: TaggedPage) -> dict[str, Any]:
    """What `--json` says of how a page was read; lines are numbered from 0."""
    return {
        "source": made.page.source,
        "glyphs": len(made.glyphs),
        "poor_lines": list(made.poor),
        "missing": [{"at": one.at, "letter": one.letter, "line": one.line} for one in made.missing],
        "fits": {str(line): round(fit, 3) for line, fit in made.fits},
        "notes": list(made.notes),
    }


def _said(hand: ScannedHand, path: Path, made: Sequence[TaggedPage]) -> str:
    from handout.hand import report

    missing, doubtful = sum(len(one.missing) for one in made), len(report.doubtful(hand))
    said = (
        f"Wrote {path}: {units.count(len(hand.glyphs), 'letter')} on {units.count(len(hand.pages), 'page')}, "
        f"{len(hand.letters)} different ones; {doubtful} doubtful, {missing} not found."
    )
    if doubtful + missing > (1 - _LEAST_SURE) * len(hand.glyphs):
        said += f" Many are doubtful: look at them with `handout hand check {path} -o overlay.png`."
    return said


def hand_path(output: str) -> Path:
    """The path of a .hand file that is to be written."""
    path = Path(output)
    if path.suffix.lower() != ".hand":
        raise InputError(
            f"Hands are kept in .hand files, not {path.suffix or 'without a suffix'}: use {path.stem}.hand."
        )
    return path
