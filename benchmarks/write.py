"""How fast text becomes strokes, pictures and files, and how little a page repeats itself.

Times are CPU seconds after start-up; the yardstick beside them is a numpy matrix product on the same machine in the
same run, so that figures from two machines can be compared.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from handout.hand.drawn import Hand
from handout.hand.library import find, load, names
from handout.inking.plain import flatten, ink
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.pipeline.options import PictureOptions, WritingOptions
from handout.pipeline.writing import drawings, write
from handout.values import Drawing
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout_lab.score.repetition import components, repetition

GOAL_SECONDS = 1.0
GOAL_START = 0.15
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


def _command(*arguments: str | Path) -> float:
    """Least CPU seconds of a whole command over some runs, the interpreter's own start included.

    As users run it: nothing tells it how many threads its linear algebra may take.
    """
    import resource

    own = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    least = float("inf")
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-m", "handout", *arguments], capture_output=True, check=True, env=own)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        least = min(least, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return least


def _spent(work: Callable[[], object]) -> float:
    """CPU seconds of some work in this process."""
    start = time.process_time()
    work()
    return time.process_time() - start


def _scanned(folder: Path) -> None:
    """A scanned hand: whole commands, and texts with the hand loaded."""
    for name, suffix, goal in (("house-joined-ballpoint", ".png", 1.5), ("house-joined", ".svg", 0.5)):
        spent = _command("write", SENTENCE, "--hand", name, "-o", folder / f"a{suffix}")
        print(
            f"handout write, {len(SENTENCE.split())} words in {name}, {suffix}: {spent:.2f} s of CPU (goal {goal:g}), "
            f"{spent / yardstick():.1f} yardsticks"
        )
    writing, fine = WritingOptions(hand=find("house-joined-ballpoint"), seed=1), PictureOptions(dpi=600)
    write(SENTENCE, [folder / "a.png"], writing)  # what is worked out of the hand once is not counted
    for what, goal, work in (
        ("12 words at 600 dpi", 0.6, lambda: write(SENTENCE, [folder / "a.png"], writing, picture=fine)),
        ("300 words at 600 dpi", 8.0, lambda: write(TEXT, [folder / "b.png"], writing, picture=fine)),
        ("300 words as strokes", 3.0, lambda: drawings(TEXT, writing)),
    ):
        print(f"{what}, scanned hand loaded: {_spent(work):.2f} s of CPU (goal {goal})")


def main() -> None:
    """Print the measurements."""
    print(f"start-up of handout --help: {_command('--help') * 1e3:.0f} ms of CPU (goal {GOAL_START * 1e3:.0f})")
    print(f"yardstick: {yardstick() * 1e3:.0f} ms of CPU")
    with tempfile.TemporaryDirectory() as folder:
        _scanned(Path(folder))
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
