"""How fast text becomes strokes, and how little a page repeats itself.

Times are CPU seconds after start-up; the yardstick beside them is a numpy matrix product on the same machine in the
same run, so that figures from two machines can be compared.  Those of whole commands are `benchmarks.speed`'s.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from handout.hand.drawn import Hand
from handout.hand.library import load, names
from handout.inking.plain import flatten, ink
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.values import Drawing
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout_lab.score.repetition import components, repetition

GOAL_SECONDS = 1.0
GOAL_REPETITION = {"house-joined": 0.02, "house-quick": 0.02, "house-print": 0.05}
SENTENCE = "Dear Anna, thank you for the lovely parcel that came on Friday."
TEXT = (Path(__file__).parent / "three-hundred-words.txt").read_text(encoding="utf-8").strip()


def _written(text: str, hand: Hand, seed: int, engine: str = "optimal-control") -> Drawing:
    rng = np.random.default_rng(seed)
    sheet, *_ = compose(text, hand, Layout(page("A4"), x_height=2.2), rng)
    return trace(sheet, hand, rng, engine)


def yardstick() -> float:
    """CPU seconds of a fixed piece of numpy work."""
    a = np.random.default_rng(0).normal(size=(400, 400))
    start = time.process_time()
    for _ in range(20):
        a = a @ a.T / 400
    return time.process_time() - start


def main() -> None:
    """Print the measurements."""
    print(f"yardstick: {yardstick() * 1e3:.0f} ms of CPU")
    thousand = TEXT[:1000]
    for name in names():
        hand = load(name)
        for engine in ("optimal-control", "sigma-lognormal"):
            _written(thousand[:200], hand, 0, engine)
            start = time.process_time()
            drawing = _written(thousand, hand, 1, engine)
            spent = time.process_time() - start
            points = sum(len(stroke.t) for stroke in drawing.strokes)
            print(
                f"{name} {engine}: 1000 characters to {len(drawing.strokes)} strokes, {points} samples in "
                f"{spent:.2f} s of CPU (goal {GOAL_SECONDS:.1f}), {1000 / drawing.duration:.2f} characters a second"
            )
    for name in names():
        hand = load(name)
        shares = []
        for seed in (1, 2, 3):
            raster = ink(_written(TEXT, hand, seed), 300, width=0.35)
            grey = flatten(raster).mean(axis=2).astype(np.uint8)
            shares.append(repetition(grey))
        words = len(TEXT.split())
        print(
            f"{name}: repetition on a page of {words} words, three seeds: "
            f"{', '.join(f'{share:.3f}' for share in shares)} (goal {GOAL_REPETITION.get(name, 0.02)}; "
            f"{len(components(grey))} components)"
        )
