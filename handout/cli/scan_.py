"""`handout hand read`: a hand from scanned pages or recorded pens, and their texts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from handout import units
from handout.cli import options
from handout.cli.console import Console
from handout.pipeline.options import TEXTURED, ReadingOptions

if TYPE_CHECKING:
    from handout.pipeline.hands import ReadHand

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
@options.bind(
    "reading",
    ReadingOptions,
    click.option("--dpi", type=float, help="Pixels an inch of the scans, where the files do not say."),
    click.option("--pen", type=click.Choice(TEXTURED), help="What it was written with; default: told from the ink."),
    click.option("--title", help="What to call the hand, for people."),
    click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Same seed, same hand."),
)
@options.console
def read(
    name: str,
    scans: tuple[str, ...],
    inks: tuple[str, ...],
    texts: tuple[str, ...],
    output: str,
    reading: ReadingOptions,
    console: Console,
) -> None:
    """Read a hand from scanned pages, or from recordings of a pen, and their texts, and call it NAME.

    A sheet made with `handout hand prompt` needs no text: it says itself what is written on it, and may be
    photographed. A recording with labels of texts or words, as UNIPEN has, needs none either, nor does a
    font. Words that were struck out are ~~marked so~~ in the text. Look at what was found with `handout hand check`.

    \b
    handout hand read mine --scan page1.png --text page1.txt --scan page2.png --text page2.txt -o mine.hand
    handout hand read mine --scan both.pdf --text page1.txt --text page2.txt -o mine.hand
    handout hand read mine --scan sheet1.png --scan sheet2.png -o mine.hand
    handout hand read mine --ink page.inkml --text page.txt -o mine.hand
    """
    from handout.pipeline import hands

    with console.working():
        result = hands.read(name, scans, texts, output, reading, inks=inks, listener=console)
    console.report(result, _sentence(result))


def _sentence(result: ReadHand) -> str:
    from handout.hand import report

    hand, doubtful = result.hand, len(report.doubtful(result.hand))
    sentence = (
        f"Wrote {result.path}: {units.count(len(hand.glyphs), 'letter')} on {units.count(len(hand.pages), 'page')}, "
        f"{len(hand.letters)} different ones; {doubtful} doubtful, {result.missing} not found."
    )
    if doubtful + result.missing > (1 - _LEAST_SURE) * len(hand.glyphs):
        sentence += f" Many are doubtful: look at them with `handout hand check {result.path} -o overlay.png`."
    return sentence
