"""`handout score`: measures of page images."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    import numpy as np

    from handout.score.comparison import WriterRanking
    from handout.score.features import LineFeatures, PageFeatures

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
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of random halves and shuffles.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
def command(pages: tuple[Path, ...], crowd: Path | None, dpi: float | None, seed: int, as_json: bool) -> None:
    """Measure page images: repetition and statistics of one, how like the first the others are.

    Of several pages the first is the author's own. The others are held against it: distances of hinge, run lengths
    and quill; how many times as far they are as the author's own halves from each other; and whether a classifier
    tells their lines from his. With --crowd also how far the nearest other page is, the rank at which the first page
    retrieves each among the crowd, and the rank of the author when it is asked whose that page is.

    \b
    handout score letter.png
    handout score real.png page.png --crowd scans/ --json
    """
    import numpy as np

    from handout.score.comparison import rank_writers, read_crowd

    measured = [_measure(path, dpi, lines=len(pages) > 1) for path in pages]
    others = read_crowd(crowd, leave_out=pages) if crowd else {}
    found: dict[str, Any] = {"pages": [page.about for page in measured]}
    found["distances"] = [_compared(measured[0], page, others, np.random.default_rng(seed)) for page in measured[1:]]
    if crowd:
        found["crowd"] = [_in_crowd(page.path, rank_writers(page.style, others)) for page in measured]
    found["seed"] = seed
    if as_json:
        click.echo(json.dumps(_rounded(found), ensure_ascii=False))
        return
    _say(found)


@dataclass(frozen=True)
class _Page:
    path: Path
    style: PageFeatures
    lines: list[LineFeatures]
    about: dict[str, Any]


def _measure(path: Path, dpi: float | None, lines: bool) -> _Page:
    """Repetition and statistics of a page, and what of it is compared; its lines one by one if they are wanted."""
    from handout.errors import InputError
    from handout.score.features import measure_lines, page_features
    from handout.score.repetition import components, repetition
    from handout.score.statistics import page_statistics
    from handout.score.written_lines import ink, read_page

    grey = read_page(path, dpi)
    try:
        statistics = asdict(page_statistics(grey))
        own = page_features(ink(grey))
        parts = measure_lines(grey) if lines else []
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    about = {"file": str(path), "repetition": repetition(grey), "components": len(components(grey))}
    return _Page(path, own, parts, {**about, "statistics": statistics})


def _compared(real: _Page, made: _Page, crowd: Mapping[str, PageFeatures], rng: np.random.Generator) -> dict[str, Any]:
    """A page held against the author's."""
    from handout.score.comparison import compare, rank_writers
    from handout.score.features import distance

    row: dict[str, Any] = {"from": str(real.path), "to": str(made.path), **asdict(distance(real.style, made.style))}
    found = compare(real.lines, made.lines, rng)
    near, test = found.closeness, found.test
    row["closeness"] = {**asdict(near), "ratio": asdict(near.ratio)} if near else None
    row["two_sample"] = {**asdict(test), "verdict": test.verdict} if test else None
    row["notes"] = list(found.notes)
    if crowd:
        row["rank"] = rank_writers(real.style, {**crowd, "\0": made.style}).rank("\0")
        row["author_rank"] = rank_writers(made.style, {**crowd, "\0": real.style}).rank("\0")
        row["among"] = len(crowd) + 1
    return row


def _in_crowd(path: Path, found: WriterRanking) -> dict[str, Any]:
    near, further = asdict(found.nearest), asdict(found.further())
    rows = zip(found.names[:_NEAREST], found.distances, strict=False)
    return {
        "file": str(path),
        "pages": len(found.names),
        **{f"nearest_{kind}": value for kind, value in near.items()},
        **{f"further_{kind}": value for kind, value in further.items()},
        "nearest": [{"file": name, **asdict(apart)} for name, apart in rows],
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
        _say_compared(row)
    for row in found.get("crowd", []):
        click.echo(
            f"{row['file']} among {row['pages']}: nearest {_three(row, 'nearest_')}; {row['further_hinge']:.0%}, "
            f"{row['further_runs']:.0%} and {row['further_quill']:.0%} of them are further from their own nearest"
        )
        for near in row["nearest"]:
            click.echo(f"  {near['file']:<40} {_three(near)}")


def _say_compared(row: dict[str, Any]) -> None:
    click.echo(f"{row['from']} to {row['to']}: {_three(row)}")
    near, test = row["closeness"], row["two_sample"]
    if near:
        click.echo(f"  times as far as the author's own halves (goal: hinge ≤ 1.5): {_three(near['ratio'], digits=2)}")
    if test:
        interval = f"{test['low']:.0%}–{test['high']:.0%}"
        click.echo(
            f"  a classifier tells {test['accuracy']:.0%} of the lines right (95 %: {interval}; {test['real']} and "
            f"{test['made']} lines; p = {test['p']:.3f}; goal ≤ 60 %): {test['verdict']}"
        )
    for note in row["notes"]:
        click.echo(f"  {note}")
    if "rank" in row:
        click.echo(
            f"  retrieved as number {row['rank']} of {row['among']}; asked the other way, the author comes as number "
            f"{row['author_rank']}"
        )


def _three(row: Mapping[str, Any], before: str = "", digits: int = 3) -> str:
    hinge, runs, quill = (f"{row[before + kind]:.{digits}f}" for kind in ("hinge", "runs", "quill"))
    return f"hinge {hinge}, run lengths {runs}, quill {quill}"


def _rounded(value: Any) -> Any:
    """The same with floats of five decimals."""
    if isinstance(value, float):
        return round(value, 5)
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return [_rounded(item) for item in value] if isinstance(value, list) else value
