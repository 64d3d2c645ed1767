"""`handout score`: measures of page images."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from handout.score.crowd import Standing, Style

_NEAREST = 5  # of a crowd, that are named
_DEGREES = ("slant", "slant_spread", "line_slope", "slope_spread", "margin_drift")
# name → what is said of it, and the unit after it
_SAID = {
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


@click.command("score")
@click.argument("pages", nargs=-1, required=True, metavar="PAGE...", type=click.Path(path_type=Path))
@click.option("--crowd", type=click.Path(path_type=Path), help="Folder of other people's pages to compare with.")
@click.option("--dpi", type=click.FloatRange(50, 2400), help="Of the images, where the files do not say.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
def command(pages: tuple[Path, ...], crowd: Path | None, dpi: float | None, as_json: bool) -> None:
    """Measure page images: repetition and statistics of one, distances of several.

    With --crowd also how far the nearest other page is, and for further pages the rank at which the first page
    retrieves them among the crowd.  Lengths in x are in heights of a small letter.

    \b
    handout score letter.png
    handout score letter.png scan.png --crowd scans/
    """
    from handout.score.crowd import distance, read_crowd, standing

    measured = [_measure(path, dpi) for path in pages]
    others = read_crowd(crowd, leave_out=pages) if crowd else {}
    found: dict[str, Any] = {"pages": [about for about, _ in measured]}
    first = measured[0][1]
    found["distances"] = [
        {"from": str(pages[0]), "to": str(path), **asdict(distance(first, style))}
        for path, (_, style) in zip(pages[1:], measured[1:], strict=True)
    ]
    if crowd:
        found["crowd"] = [
            _in_crowd(path, standing(style, others)) for path, (_, style) in zip(pages, measured, strict=True)
        ]
        for row, (_, style) in zip(found["distances"], measured[1:], strict=True):
            row["rank"] = standing(first, {**others, "\0": style}).rank("\0")
            row["among"] = len(others) + 1
    if as_json:
        click.echo(json.dumps(_rounded(found), ensure_ascii=False))
        return
    _say(found)


def _measure(path: Path, dpi: float | None) -> tuple[dict[str, Any], Style]:
    """Repetition and statistics of a page, and what of it is compared."""
    from handout.errors import InputError
    from handout.score.crowd import style
    from handout.score.pages import ink, read_page
    from handout.score.repetition import components, repetition
    from handout.score.statistics import page_statistics

    grey = read_page(path, dpi)
    try:
        statistics = asdict(page_statistics(grey))
        own = style(ink(grey))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    about = {"file": str(path), "repetition": repetition(grey), "components": len(components(grey))}
    return {**about, "statistics": statistics}, own


def _in_crowd(path: Path, found: Standing) -> dict[str, Any]:
    near, further = found.nearest, found.further()
    rows = zip(found.names[:_NEAREST], found.hinge, found.runs, strict=False)
    return {
        "file": str(path),
        "pages": len(found.names),
        "nearest_hinge": near.hinge,
        "nearest_runs": near.runs,
        "further_hinge": further.hinge,
        "further_runs": further.runs,
        "nearest": [{"file": name, "hinge": h, "runs": r} for name, h, r in rows],
    }


def _say(found: dict[str, Any]) -> None:
    """The figures as small tables."""
    from math import degrees

    for page in found["pages"]:
        click.echo(page["file"])
        count = page["components"]
        click.echo(f"  {'repetition':<26}{page['repetition']:8.3f}  of {count} pieces of ink (people: mostly 0.000)")
        for name, value in page["statistics"].items():
            said, unit = _SAID[name]
            shown = degrees(value) if name in _DEGREES else value
            click.echo(f"  {said:<26}" + (f"{shown:8d}" if isinstance(shown, int) else f"{shown:8.2f}  {unit}"))
    for row in found["distances"]:
        rank = f"; retrieved as number {row['rank']} of {row['among']}" if "rank" in row else ""
        click.echo(f"{row['from']} to {row['to']}: hinge {row['hinge']:.3f}, run lengths {row['runs']:.3f}{rank}")
    for row in found.get("crowd", []):
        click.echo(
            f"{row['file']} among {row['pages']}: nearest hinge {row['nearest_hinge']:.3f}, run lengths "
            f"{row['nearest_runs']:.3f}; {row['further_hinge']:.0%} and {row['further_runs']:.0%} of them are further "
            "from their own nearest"
        )
        for near in row["nearest"]:
            click.echo(f"  {near['file']:<40} hinge {near['hinge']:.3f}  run lengths {near['runs']:.3f}")


def _rounded(value: Any) -> Any:
    """The same with floats of five decimals."""
    if isinstance(value, float):
        return round(value, 5)
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return [_rounded(item) for item in value] if isinstance(value, list) else value
