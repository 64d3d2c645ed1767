"""How far the house hands' pages are from people's: hinge, run lengths, repetition and the statistics of a page.

The pages of real writers are read from the folder in the environment variable HANDOUT_DATA (`scans/cvl/*.png` and
`scans/csafe/*_s01_*.png`, one page a writer); without it only the house pages are measured.  Those scans hold
handwriting alone, prompts cut off by their makers; `score.written_lines.ink` drops what remains of the paper's edge.

A distance shrinks as there is more to measure, so of a house page excerpts of as many lines are taken as have about
as much ink contour as the middle real page, and the figures are means over excerpts.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.hand.library import load
from handout.inking import pens
from handout.inking.pen import PENS, usual
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.values import Drawing
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout_lab.score.comparison import own_nearest
from handout_lab.score.features import Distance, PageFeatures, distance, least, page_features
from handout_lab.score.repetition import repetition
from handout_lab.score.statistics import PageStatistics, page_statistics
from handout_lab.score.written_lines import find_lines, ink, read_page

HANDS = ("house-joined", "house-quick", "house-print")
SEEDS = (1, 2)
X_HEIGHT = 2.5  # mm, the default of the command, and the median of the real pages
REPETITION = 0.02
TEXT = (Path(__file__).parent / "three-hundred-words.txt").read_text(encoding="utf-8").strip()
_DEGREES = ("slant", "slant_spread", "line_slope", "slope_spread", "margin_drift")
_NOT_JUDGED = ("lines", "words", "x_height", "pitch")  # chosen by whoever writes, not by the hand

Grey = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Inker = Callable[[Drawing], Grey]


def inked(drawing: Drawing, pen: str) -> Grey:
    """A pen on plain white paper at 300 dpi, crisp, (h, w) uint8."""
    grey = pens.image(drawing, 300, usual(pen), pens.noise(drawing.about)).mean(axis=2)
    return np.asarray(grey, dtype=np.uint8)


def ballpoint(drawing: Drawing) -> Grey:
    """`inked` with the pen that the real pages were written with."""
    return inked(drawing, "ballpoint")


def house_page(name: str, seed: int, inker: Inker = ballpoint) -> Grey:
    """A page of three hundred words in a house hand."""
    rng = np.random.default_rng(seed)
    hand = load(name)
    sheet, *_ = compose(TEXT, hand, Layout(page("A4"), x_height=X_HEIGHT), rng)
    return inker(trace(sheet, hand, rng))


def real_pages(folder: Path) -> dict[str, Grey]:
    """Pages of real writers, one each."""
    files = sorted(folder.glob("scans/cvl/*.png")) + sorted(folder.glob("scans/csafe/*_s01_*.png"))
    return {path.stem: read_page(path) for path in files}


def excerpts(mask: Mask, amount: float) -> list[Mask]:
    """Parts of the page, cut between lines, of at least `amount` pixels of ink edge: one from every third line on."""
    found = find_lines(mask)
    cuts = [0, *(int(line.curve[0] + 0.9 * found.x_height) for line in found.lines[:-1]), len(mask)]
    parts = []
    for i in range(0, len(cuts) - 1, 3):
        end = next((cut for cut in cuts[i + 1 :] if edge_length(mask[cuts[i] : cut]) >= amount), None)
        if end is not None:
            parts.append(mask[cuts[i] : end])
    return parts or [mask]


def edge_length(mask: Mask) -> float:
    """Pixels where ink begins or ends along a row: what there is to measure on a page."""
    return float(np.count_nonzero(mask[:, 1:] != mask[:, :-1]))


def halves(mask: Mask) -> Distance:
    """From the upper half of the ink to the lower."""
    below = np.cumsum(mask.sum(axis=1))
    cut = int(np.searchsorted(below, below[-1] / 2))
    return distance(page_features(mask[:cut]), page_features(mask[cut:]))


def measure(
    inker: Inker = ballpoint, folder: Path | None = None
) -> tuple[dict[str, dict[str, Any]], dict[str, Any] | None]:
    """All figures: of each house hand by its name, and of the real pages."""
    real = _real(folder) if folder else None
    amount = real["amount"] if real else 45000.0
    hands = {name: _hand([house_page(name, seed, inker) for seed in SEEDS], amount, real) for name in HANDS}
    return hands, real


def _real(folder: Path) -> dict[str, Any] | None:
    pages = real_pages(folder)
    if not pages:
        print(f"No page in {folder}/scans/cvl or /csafe: only the house pages are measured.", file=sys.stderr)
        return None
    masks = [ink(grey) for grey in pages.values()]
    styles = [page_features(mask) for mask in masks]
    return {
        "names": list(pages),
        "styles": styles,
        "nearest": own_nearest(styles),
        "halves": [halves(mask) for mask in masks],
        "repetition": [repetition(grey) for grey in pages.values()],
        "statistics": [page_statistics(grey) for grey in pages.values()],
        "amount": float(np.median([edge_length(mask) for mask in masks])),
    }


def _hand(greys: Sequence[Grey], amount: float, real: dict[str, Any] | None) -> dict[str, Any]:
    masks = [ink(grey) for grey in greys]
    parts = [part for mask in masks for part in excerpts(mask, amount)]
    styles = [page_features(part) for part in parts]
    found: dict[str, Any] = {
        "styles": styles,
        "halves": [halves(part) for part in parts],
        "whole": [page_features(mask) for mask in masks],
        "repetition": [repetition(grey) for grey in greys],
        "statistics": [page_statistics(grey) for grey in greys],
    }
    if real:
        found["nearest"] = [_nearest(own, real["styles"]) for own in styles]
        found["who"] = real["names"][int(np.argmin([distance(styles[0], other).hinge for other in real["styles"]]))]
    return found


def _nearest(own: PageFeatures, others: Sequence[PageFeatures]) -> Distance:
    return least([distance(own, other) for other in others])


def main() -> None:
    """Print the measurements, with the goals where there are real pages to set them."""
    given = os.environ.get("HANDOUT_DATA")
    if not given:
        print("HANDOUT_DATA names no folder with scans of real pages: only the house pages are measured.")
    hands, real = measure(ballpoint, Path(given) if given else None)
    _print_distances(hands, real)
    _print_between(hands)
    _print_pens()
    _print_statistics(hands, real)


def _print_distances(hands: dict[str, dict[str, Any]], real: dict[str, Any] | None) -> None:
    print(f"\n{'':<34}" + "".join(f"{name:>16}" for name in hands) + (f"{'people':>22}  goal" if real else ""))
    for kind, said in (("hinge", "hinge"), ("runs", "run lengths"), ("quill", "quill")):
        if real:
            goal = _percentile(real["nearest"], kind, 90)
            own = [_mean(found["nearest"], kind) for found in hands.values()]
            people = f"{_percentile(real['nearest'], kind, 50):.3f}, 90 %: {goal:.3f}"
            _row(f"{said} to the nearest writer", own, [value <= goal for value in own], people, f"≤ {goal:.3f}")
        own = [_mean(found["halves"], kind) for found in hands.values()]
        if real:
            goal = _percentile(real["halves"], kind, 25)
            people = f"{_percentile(real['halves'], kind, 50):.3f}, 25 %: {goal:.3f}"
            _row(f"{said}, own half to half", own, [value >= goal for value in own], people, f"≥ {goal:.3f}")
        else:
            _row(f"{said}, own half to half", own)
    own = [max(found["repetition"]) for found in hands.values()]
    people = f"{np.median(real['repetition']):.3f}, most: {max(real['repetition']):.3f}" if real else ""
    _row("repetition, the worse page", own, [value <= REPETITION for value in own], people, f"≤ {REPETITION}")
    if real:
        print(f"{'nearest writer by hinge':<34}" + "".join(f"{found['who'][:14]:>15} " for found in hands.values()))


def _print_between(hands: dict[str, dict[str, Any]]) -> None:
    names = list(hands)
    print("\nbetween the hands (whole pages of three hundred words):")
    for i, one in enumerate(names):
        for other in names[:i]:
            apart = distance(hands[one]["whole"][0], hands[other]["whole"][0])
            print(f"  {other} to {one}: hinge {apart.hinge:.3f}, run lengths {apart.runs:.3f}")


def _print_pens() -> None:
    print("\nrepetition with each pen, one page:")
    for pen in PENS:
        own = [repetition(house_page(name, SEEDS[0], partial(inked, pen=pen))) for name in HANDS]
        _row(f"  {pen}", own, [value <= REPETITION for value in own], "", f"≤ {REPETITION}")


def _print_statistics(hands: dict[str, dict[str, Any]], real: dict[str, Any] | None) -> None:
    print(f"\n{'statistics of the page':<34}" + "".join(f"{name:>16}" for name in hands) + f"{'people, 5–95 %':>22}")
    for field in fields(PageStatistics):
        own = [float(np.mean([_shown(s, field.name) for s in found["statistics"]])) for found in hands.values()]
        if not real:
            _row(field.name, own)
            continue
        theirs = [_shown(s, field.name) for s in real["statistics"]]
        low, middle, high = np.percentile(theirs, [5, 50, 95])
        judged = [low <= value <= high for value in own] if field.name not in _NOT_JUDGED else None
        _row(field.name, own, judged, f"{low:.3f} … {middle:.3f} … {high:.3f}")
    print("slant, slopes and drift in degrees; lengths in heights of a small letter unless they are named mm; ! = out.")


def _row(said: str, own: Sequence[float], good: Sequence[bool] | None = None, people: str = "", goal: str = "") -> None:
    marks = [" " if fine else "!" for fine in good or [True] * len(own)]
    figures = "".join(f"{value:>15.3f}{mark}" for value, mark in zip(own, marks, strict=True))
    print(f"{said:<34}{figures}{people:>24}  {goal}".rstrip())


def _shown(statistics: PageStatistics, name: str) -> float:
    value = float(asdict(statistics)[name])
    return float(np.degrees(value)) if name in _DEGREES else value


def _mean(found: Sequence[Distance], kind: str) -> float:
    return float(np.mean([getattr(d, kind) for d in found]))


def _percentile(found: Sequence[Distance], kind: str, percent: float) -> float:
    return float(np.percentile([getattr(d, kind) for d in found], percent))


if __name__ == "__main__":
    main()
