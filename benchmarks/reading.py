"""How well a scanned page is read, measured where the truth is known: on pages of the simulated author.

Mask: intersection over union with the true mask; in brackets with a mask whose edge lies half way between paper and
one usual pass.  Path, within 0.06 mm: how much of the found way is true, and how much of the pen's way was met; both
where the pen's way is clear, in brackets everywhere it is visible (`PathScore`).  A figure that misses its goal has
a "!" behind it.
Ink: greatest difference after putting the ink back on
the found paper, and the share of inked pixels that lighten another paper.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from unittest.mock import patch

import numpy as np

from handout.hand.library import load
from handout.inking.pen import usual
from handout.page_sizes import page
from handout.scanning.mask import hysteresis
from handout.scanning.scan import Scan
from handout.scanning.written_page import WrittenPage, read_page
from handout.writing.layout import Layout
from handout_lab.author import ground_truth_score
from handout_lab.author.simulate import Desk, simulate
from handout_lab.author.truth import Simulated

PENS = ("ballpoint", "fineliner", "fountain", "pencil")
HANDS = ("house-joined", "house-quick")
TEXT = (Path(__file__).parent / "three-hundred-words.txt").read_text(encoding="utf-8").strip()[:900]
GOALS = {300: 0.85, 600: 0.90}
PENCIL, PATH, RECOMPOSED = 0.80, 0.97, 1.0
BY_HYSTERESIS = patch(
    "handout.scanning.mask.cut_ink", lambda scan, density, weights: hysteresis(density.values, density)
)


def written(pen: str, hand: str, dpi: int, seed: int = 5) -> Simulated:
    """A page of A5."""
    layout = Layout(page("A5"), x_height=2.2, fit=True)
    return simulate(TEXT, load(hand), Desk(usual(pen), layout=layout, dpi=dpi), rng=np.random.default_rng(seed))


def scores(simulated: Simulated, read: WrittenPage, seconds: float) -> dict[str, float]:
    """All figures of a page."""
    truth, (x, y), (height, width) = simulated.truth, read.scan.origin, read.scan.shape
    whole = (slice(y, y + height), slice(x, x + width))
    mask = np.zeros(truth.mask.shape, dtype=bool)
    mask[whole] = read.mask.ink
    paper, rgba = truth.paper.copy(), np.zeros((*mask.shape, 4), dtype=np.uint8)
    paper[whole], rgba[whole] = read.matte.paper, read.matte.rgba
    path = ground_truth_score.path(truth, read.graph.uv + np.array([x, y]), read.graph.edges)
    matte = ground_truth_score.matte(simulated.image, truth, rgba[:, :, :3] / 255, rgba[:, :, 3] / 255, paper / 255)
    return {
        "iou": ground_truth_score.overlap(mask, truth.mask),
        "half": ground_truth_score.overlap(mask, truth.covered(0.5)),
        "met": path.recall,
        "anywhere": path.recall_all,
        "true": path.precision,
        "sound": path.precision_all,
        "error": path.error,
        "recomposed": 255 * matte.recomposed,
        "alpha": matte.alpha,
        "halo": matte.halo,
        "seconds": seconds / mask.size * 1e6,
    }


def measure(simulated: Simulated, dpi: int) -> dict[str, float]:
    """Read a page and score it."""
    begin = time.process_time()
    read = read_page(Scan(simulated.image, float(dpi)))
    return scores(simulated, read, time.process_time() - begin)


def row(name: str, s: dict[str, float], goal: float) -> str:
    """A line of the table; ! marks what misses its goal."""

    iou, met, true, again = s["iou"], s["met"], s["true"], s["recomposed"]
    good = {"i": iou >= goal, "t": true >= PATH, "m": met >= PATH, "r": again <= RECOMPOSED}
    flag = {name: " " if reached else "!" for name, reached in good.items()}
    return (
        f"{name:<28} {iou:.3f}{flag['i']}({s['half']:.3f})  {true:.3f}{flag['t']}({s['sound']:.3f})  "
        f"{met:.3f}{flag['m']}({s['anywhere']:.3f}) {s['error']:.3f}  "
        f"{again:5.2f}{flag['r']} {s['alpha']:.4f} {s['halo']:.4f}  {s['seconds']:5.2f}"
    )


def ablations() -> Iterator[tuple[str, AbstractContextManager[object]]]:
    """Name, and what is changed while it is read."""
    yield "all steps", nullcontext()
    yield "no smoothing", patch("handout.scanning.mask.smooth", lambda ink: ink)
    yield "hysteresis for the cut", BY_HYSTERESIS
    whole = patch("handout.scanning.line_graph.separate_strokes", lambda xy, edges, *_: (xy, edges))
    yield "strokes not taken apart", whole


def main() -> None:
    """Print the table, then what single steps are worth."""
    print(f"{'':<28} mask IoU       path true (all) path met (all) mm rms recomp. alpha   halo   CPU s/MP")
    print(
        f"{'goal, 300 / 600 dpi':<28} {GOALS[300]:.2f} / {GOALS[600]:.2f}    {PATH:.2f}            {PATH:.2f}"
        f"                 {RECOMPOSED:.0f}"
    )
    print(f"{'goal, pencil':<28} {PENCIL:.2f}")
    for dpi in GOALS:
        for pen in PENS:
            for hand in HANDS:
                goal = PENCIL if pen == "pencil" else GOALS[dpi]
                print(row(f"{dpi} {pen} {hand}", measure(written(pen, hand, dpi), dpi), goal), flush=True)
    for dpi in GOALS:
        for pen in ("ballpoint", "pencil"):
            simulated = written(pen, HANDS[0], dpi)
            for name, change in ablations():
                with change:
                    goal = PENCIL if pen == "pencil" else GOALS[dpi]
                    print(row(f"{dpi} {pen} {name}", measure(simulated, dpi), goal), flush=True)
