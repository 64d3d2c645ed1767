"""`handout score`: measures of page images."""

from __future__ import annotations

from dataclasses import asdict
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING

import click

from handout.cli.console import Console
from handout.cli.options import JSON, verb
from handout.pipeline.declarations import argument, option

if TYPE_CHECKING:
    from handout_lab.pipeline.scoring import CrowdedPage, Distance, ScoredPage, ScoredPair

_DEGREES = ("slant", "slant_spread", "line_slope", "slope_spread", "margin_drift")  # kept in radians
# measure → its caption, and the unit behind it
_CAPTIONS = {
    "lines": ("lines", ""),
    "words": ("words", ""),
    "x_height": ("height of small letters", "mm"),
    "tall": ("height of tall letters", "x"),
    "slant": ("slant", "°"),
    "slant_spread": ("  between words ±", "°"),
    "size_spread": ("size between words ±", "x"),
    "top_spread": ("heights within words ±", "x"),
    "foot_spread": ("feet within words ±", "x"),
    "baseline_spread": ("words off the baseline ±", "x"),
    "line_bend": ("bend of lines", "x"),
    "line_slope": ("slope of lines", "°"),
    "slope_spread": ("  between lines ±", "°"),
    "word_gap": ("gap between words", "x"),
    "word_gap_cv": ("  varies by", "of it"),
    "left_edge": ("left edge ragged by", "x"),
    "margin_drift": ("left margin leans", "°"),
    "pitch": ("distance of lines", "mm"),
    "pitch_cv": ("  varies by", "of it"),
    "line_width": ("width of the stroke", "mm"),
    "width_cv": ("  varies by", "of it"),
    "tone_spread": ("darkness varies by", "of it"),
}


@verb("score", short_help="Measure how far page images look written by a person.")
def command(
    pages: tuple[Path, ...] = argument(required=True, metavar="PAGE..."),
    crowd: Path | None = option(None, "Folder of other people's pages to compare with."),
    dpi: float | None = option(None, "Of the images, where the files do not say.", least=50, most=2400),
    seed: int = option(0, "Of random halves and shuffles.", least=0),
    as_json: bool = JSON,
) -> None:
    """Measure page images: repetition and statistics of one, how like the first the others are.

    Of several pages the first is the author's own. The others are held against it: distances of hinge, run lengths
    and quill; how many times as far they are as the author's own halves from each other; and whether a classifier
    tells their lines from his. With --crowd also how far the nearest other page is, the rank at which the first page
    retrieves each among the crowd, and the rank of the author when it is asked whose that page is.

    \b
    handout score letter.png
    handout score real.png page.png --crowd scans/ --json
    """
    from handout_lab.pipeline.scoring import score

    scores = score(pages, crowd, dpi=dpi, seed=seed)
    if as_json:
        Console(as_json, quiet=True).report(scores, "")
        return
    for page in scores.pages:
        _print_page(page)
    for pair in scores.pairs:
        _print_pair(pair)
    for crowded in scores.crowded or ():
        _print_crowded(crowded)


def _print_page(page: ScoredPage) -> None:
    click.echo(page.path)
    click.echo(f"  {'repetition':<26}{page.repetition:8.3f}  of {page.components} pieces of ink (people: mostly 0.000)")
    for name, value in asdict(page.statistics).items():
        caption, unit = _CAPTIONS[name]
        shown = degrees(value) if name in _DEGREES else value
        click.echo(f"  {caption:<26}" + (f"{shown:8d}" if isinstance(shown, int) else f"{shown:8.2f}  {unit}"))


def _print_pair(pair: ScoredPair) -> None:
    click.echo(f"{pair.author} to {pair.page}: {_three(pair.distance)}")
    near, test = pair.lines.closeness, pair.lines.test
    if near:
        click.echo(f"  times as far as the author's own halves (goal: hinge ≤ 1.5): {_three(near.ratio, digits=2)}")
    if test:
        click.echo(
            f"  a classifier tells {test.accuracy:.0%} of the lines right (95 %: {test.low:.0%}–{test.high:.0%}; "
            f"{test.real} and {test.made} lines; p = {test.p:.3f}; goal ≤ 60 %): {test.verdict}"
        )
    for note in pair.lines.notes:
        click.echo(f"  {note}")
    if pair.among:
        click.echo(
            f"  retrieved as number {pair.rank} of {pair.among}; asked the other way, the author comes as number "
            f"{pair.author_rank}"
        )


def _print_crowded(page: CrowdedPage) -> None:
    further = page.ranking.further()
    click.echo(
        f"{page.path} among {len(page.ranking.names)}: nearest {_three(page.ranking.nearest)}; {further.hinge:.0%}, "
        f"{further.runs:.0%} and {further.quill:.0%} of them are further from their own nearest"
    )
    for name, apart in page.nearest:
        click.echo(f"  {name:<40} {_three(apart)}")


def _three(apart: Distance, digits: int = 3) -> str:
    return f"hinge {apart.hinge:.{digits}f}, run lengths {apart.runs:.{digits}f}, quill {apart.quill:.{digits}f}"
