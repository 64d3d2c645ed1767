"""How fast text is written in a scanned hand, stage by stage, and whether a seed says all and two seeds differ.

Times are CPU seconds once the hand is loaded.  What is worked out once for a hand is a stage by itself, "preparing",
with a goal of its own; sentence and page have theirs without it.  The yardstick is `benchmarks.write`'s, so that
figures from two machines can be compared.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from hashlib import sha256
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.parts import manuscripts
from benchmarks.write import TEXT, yardstick
from handout.hand import library
from handout.hand.scanned import ScannedHand
from handout.inking.pen_replacement import ink_drawing
from handout.inking.plain import flatten
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.pipeline.rereading import reread
from handout.values import Manuscript
from handout.writing import scanned_words
from handout.writing.compose import compose, each_page
from handout.writing.layout import Layout, author_baselines

HANDS = ("house-joined-ballpoint", "house-print-fountain")
DPI = 600
GOAL_PREPARING, GOAL_SENTENCE, GOAL_PAGE, GOAL_SHARED, GOAL_READ = 1.5, 1.0, 20.0, 0.05, 2.0
SENTENCE = "We walked home along the river while the rain fell on us"
_WORDS, _LAYOUT, _TEXTURE = "handout.writing.scanned_words", "handout.writing.word_layout", "handout.inking.texture"
STAGES = {
    "preparing": tuple(f"{_WORDS}.{name}" for name in ("index_glyphs", "layout_model", "author_baselines")),
    "choosing": ("handout.writing.choosing.GlyphChooser.word",),
    "setting": (
        "handout.writing.spacing.SpacingModel.between",
        "handout.writing.spacing.HeightModel.heights_of",
        *(f"{_LAYOUT}.{name}" for name in ("LayoutModel.bends", "resolve_collisions", "set_line")),
    ),
    "texture: warping": (f"{_TEXTURE}.warp",),
    "texture: seams": (f"{_TEXTURE}.part_layers",),
    "paper": (f"{__name__}.flatten",),
}


class Clock:
    """CPU seconds of each stage, without what others take within it, and of all."""

    def __init__(self) -> None:
        self.spent = dict.fromkeys(STAGES, 0.0)
        self.all = 0.0
        self._others = [0.0]  # what was told to stages within each that is running

    def timed(self, stage: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, its time told to a stage."""

        def run(*given: Any, **named: Any) -> Any:
            start = time.process_time()
            self._others.append(0.0)
            try:
                return function(*given, **named)
            finally:
                spent = time.process_time() - start
                self.spent[stage] += spent - self._others.pop()
                self._others[-1] += spent

        return run

    @contextmanager
    def running(self) -> Iterator[None]:
        """Time what is done meanwhile."""
        with ExitStack() as stack:
            for stage, names in STAGES.items():
                for name in names:
                    stack.enter_context(patch(name, self.timed(stage, _found(name))))
            start = time.process_time()
            yield
            self.all = time.process_time() - start

    def __str__(self) -> str:
        rest = self.all - sum(self.spent.values())
        shares = {**self.spent, "rest": rest}
        return ", ".join(f"{stage} {spent:.2f}" for stage, spent in shares.items())


def written(text: str, hand: ScannedHand, seed: int, name: str = "A4") -> list[bytes]:
    """Pixels of the pages of a text in a hand, on white."""
    layout = Layout(page(name), x_height=hand.x_height if name != "A4" else min(hand.x_height, 2.2))
    return [_pixels(sheet, hand) for sheet in compose(text, hand, layout, np.random.default_rng(seed))]


def _pixels(sheet: Manuscript, hand: ScannedHand) -> bytes:
    ink = ink_drawing(sheet, hand).ink
    assert ink is not None
    return flatten(ink(DPI)).tobytes()


def shared(hand: ScannedHand, text: str, often: int = 25) -> tuple[float, float]:
    """How often two texts of one wording have the same glyph in one place, and how often pure chance would.

    Both of letters that the hand has at least `often` times; nan where there is none.
    """
    first, second = (_numbers(manuscripts(hand, text, seed)) for seed in (1, 2))
    counts = hand.letters
    places = [i for i, number in enumerate(first) if counts[hand.glyphs[number].letter] >= often]
    if not places:
        return float("nan"), float("nan")
    chance = np.mean([1 / counts[hand.glyphs[first[i]].letter] for i in places])
    return float(np.mean([first[i] == second[i] for i in places])), float(chance)


def _numbers(sheets: list[Manuscript]) -> list[int]:
    return [placed.ink.number for sheet in sheets for line in sheet.lines for placed in line.placed if placed.ink]


def _found(name: str) -> Callable[..., Any]:
    from pkgutil import resolve_name

    module, _, attribute = name.rpartition(".")
    found: Callable[..., Any] = getattr(resolve_name(module), attribute)
    return found


def main() -> None:
    """Print the measurements."""
    print(f"yardstick: {yardstick() * 1e3:.0f} ms of CPU")
    for name in HANDS:
        hand = library.find(name)
        assert isinstance(hand, ScannedHand)
        measure(hand)


def measure(hand: ScannedHand) -> None:
    """Print those of one hand."""
    words = [word for word in TEXT.split() if set(word) <= set(hand.letters)]
    page_text = " ".join((words * 3)[:300])
    sentence = " ".join(word for word in SENTENCE.split() if set(word) <= set(hand.letters))
    print(f"{hand.name}: {len(hand.glyphs)} glyphs")
    # modules that are imported on first use are no part of it
    written("a", hand, 0, "150x60mm")
    scanned_words._learnt.cache_clear()
    author_baselines.cache_clear()
    for said, text, paper, goal in (
        ("sentence, hand just loaded", sentence, "160x80mm", GOAL_SENTENCE),
        ("sentence, hand known", sentence, "160x80mm", GOAL_SENTENCE),
        ("page of 300 words", page_text, "A4", GOAL_PAGE),
    ):
        clock = Clock()
        with clock.running():
            pages = written(text, hand, 1, paper)
        prepared = clock.spent["preparing"]
        mark = "!" if clock.all - prepared > goal or prepared > GOAL_PREPARING else " "
        goals = f"goal {goal:g}" + (f" and {GOAL_PREPARING:g} for preparing" if prepared > 0 else "")
        said_pages = f"{len(pages)} page{'s' if len(pages) > 1 else ''}"
        print(f"  {said:<28}{clock.all:6.2f} s{mark} ({goals}; {said_pages}): {clock}", flush=True)
    print(f"  one seed, one picture: {_digest(sentence, hand, 3) == _digest(sentence, hand, 3)}")
    print(f"  two seeds, two pictures: {_digest(sentence, hand, 3) != _digest(sentence, hand, 4)}")
    read_again(hand, sentence)  # what is known of the hand
    plain, mended, traced = read_again(hand, page_text)
    print(
        f"  300 words set in {plain:.2f} s; read again and mended in {mended / plain:.2f} of that (goal "
        f"{GOAL_READ:g}; where all was set anew for some words, 3 to 5); traced as strokes in {traced / plain:.2f}"
    )
    same, chance = shared(hand, page_text)
    print(f"  two seeds, the same glyph in one place: {same:.3f} (chance {chance:.3f}; goal {GOAL_SHARED:g})")


def read_again(hand: ScannedHand, text: str) -> tuple[float, float, float]:
    """CPU seconds of setting a text, of setting and reading it and mending words, and of tracing it, the hand known."""
    layout = Layout(page("A4"), x_height=min(hand.x_height, 2.2))
    make = partial(each_page, text, hand, layout, (1,))
    spent, done = [], list[Any]()
    stages: tuple[Callable[[], Any], ...] = (
        lambda: list(make()),
        lambda: reread(lambda reader: make(proofread=reader), hand, hand)[0],
        lambda: [trace(sheet.manuscript, hand, np.random.default_rng(1)) for sheet in done[-1]],
    )
    for stage in stages:
        start = time.process_time()
        done.append(stage())
        spent.append(time.process_time() - start)
    return spent[0], spent[1], spent[2]


def _digest(text: str, hand: ScannedHand, seed: int) -> str:
    return sha256(b"".join(written(text, hand, seed, "160x80mm"))).hexdigest()


if __name__ == "__main__":
    main()
