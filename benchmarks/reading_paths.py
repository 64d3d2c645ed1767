"""How well the pen paths that handout writes in can be read, by readers of paths that see order and direction.

Each hand writes the same words; every word's strokes are read with their baseline and x-height known, letter by letter
and without a language.  Columns: character errors, words all right, and the mean logarithm of the probability of a
written letter, by the reader that ships, and by a second one (`second_path_reader.npz` beside this file, where it is),
which differs in architecture, features, fonts, hands and seed.  Drawn hands show what the readers cannot do: their
order is known.

With HANDOUT_HANDS, a folder of .hand files, these write as well.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np

from handout.alphabet import fold
from handout.hand import file, library
from handout.hand.drawn import Hand
from handout.hand.scanned import ScannedHand
from handout.motion.trace import trace
from handout.values import Array, Page
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout_lab.reading import pen_paths

TEXT = (Path(__file__).parent / "three-hundred-words.txt").read_text(encoding="utf-8")
WORDS = 120  # of the text, which is enough for a standard error of .02
SECOND = Path(__file__).parent / "second_path_reader.npz"
GOALS = {"house-joined-ballpoint": 0.10, "house-print-fountain": 0.10}
_GOAL = 0.15  # of a hand that was read from a page


@dataclass(frozen=True, eq=False)
class WrittenWord:
    """A word's text and its strokes (n, 2), mm, with the line it stands on."""

    text: str
    strokes: list[Array]
    baseline: float
    x_height: float


def written_words(hand: Hand | ScannedHand, text: str, seed: int = 1) -> Iterator[WrittenWord]:
    """The words of a text as the hand's pen writes them; words with letters that the hand lacks are left out."""
    known = set(hand.letters) if isinstance(hand, ScannedHand) else set(hand.glyphs)
    chosen = " ".join([word for word in text.split() if set(word) <= known][:WORDS])
    rng = np.random.default_rng(seed)
    layout = Layout(Page(190.0, 5000.0, "scroll"), x_height=hand.x_height)
    for sheet in compose(chosen, hand, layout, rng):
        drawing = trace(sheet, hand, rng)
        strokes = {word: [s.xy for s in own] for word, own in groupby(drawing.strokes, key=lambda stroke: stroke.word)}
        for line in sheet.lines:
            for word, units in groupby(line.placed, key=lambda unit: unit.word):
                letters = {unit.at: unit.glyph.letter for unit in units}
                own = strokes.get(word, [])
                if own:
                    middle = np.array([float(np.mean([xy[:, 0].mean() for xy in own]))])
                    yield WrittenWord("".join(letters.values()), own, float(line.height_at(middle)[0]), sheet.x_height)


def figures(words: list[WrittenWord], network: pen_paths.PathNetwork) -> tuple[float, float, float]:
    """Character error, share of words that are all right, mean log probability of a letter."""
    wrong, right, sure = 0, 0, 0.0
    for word in words:
        wanted = "".join(map(fold, word.text))
        seen = pen_paths.read(word.strokes, word.baseline, word.x_height, network=network)
        wrong += pen_paths.edits(wanted, seen.text)
        right += wanted == seen.text
        sure += max(
            -100.0, pen_paths.log_probability(word.strokes, word.text, word.baseline, word.x_height, network=network)
        )
    letters = sum(len(word.text) for word in words)
    return wrong / letters, right / len(words), sure / letters


def main() -> None:
    """Print the table."""
    readers = {"shipped": pen_paths.shipped()} | ({"second": pen_paths.load(SECOND)} if SECOND.is_file() else {})
    hands: dict[str, Hand | ScannedHand] = {
        name: library.find(name) for name in (*("house-joined", "house-quick", "house-print"), *library.scanned_files())
    }
    folder = os.environ.get("HANDOUT_HANDS")
    if folder:
        hands |= {path.stem: file.load(path) for path in sorted(Path(folder).glob("*.hand"))}
    print(f"{'':<26}{'words':>6}" + "".join(f"{name + ': error':>18}{'right':>8}{'log p':>8}" for name in readers))
    clock, count = 0.0, 0
    for name, hand in hands.items():
        words = list(written_words(hand, TEXT))
        shown = ""
        for network in readers.values():
            began = time.process_time()
            error, right, sure = figures(words, network)
            clock, count = clock + time.process_time() - began, count + 2 * len(words)
            shown += f"{error:>18.3f}{right:>8.2f}{sure:>8.2f}"
        goal = f"  goal {GOALS.get(name, _GOAL):.2f}" if isinstance(hand, ScannedHand) else ""
        print(f"{name:<26}{len(words):>6}{shown}{goal}", flush=True)
    print(f"a word takes {1e3 * clock / count:.1f} ms of CPU")


if __name__ == "__main__":
    main()
