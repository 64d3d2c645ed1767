"""Makes the learned style that ships: ``python -m handout_lab.training.styles -o styles/learned.style``.

Its examples are this project's own: tags that `asemic` invents, in three styles of rules, and pages of two
built-in hands.  Each of the five manners is a primer; the structure is that of the tags.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from handout import atomic
from handout.hand import library
from handout.motion.learned import dynamics, sequences, structure
from handout.motion.learned.model import PRIMERS, LearnedMovement, taken_apart
from handout.motion.learned.sequences import MovementSequence
from handout.motion.learned.training import SEVERAL_STYLES
from handout.motion.styles.asemic import tag
from handout.motion.styles.style import find
from handout.motion.styles.style_file import to_bytes
from handout.motion.styles.targets import letter_height
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.prompting import corpus
from handout.values import Drawing, Page
from handout.writing.compose import compose
from handout.writing.layout import Layout

TAGS = ("fast-tag", "blackletter", "calm")  # styles of rules, unlike each other in bends and overlaps
HANDS = ("house-joined", "house-print")
_EACH, _LETTERS, _WORDS = 16, 5, 60  # tags of a style, letters of a tag, words of a hand
_MOVES, _FORMS = 1200, 600  # steps of training: of the dynamics, and of the structure
_PRIMER = 64  # ways, as long as the windows of training
_TOML = """\
title = "Learned: five manners, by --prime: fast-tag, blackletter, calm, house-joined, house-print"
notes = "Learned from tags in three styles of rules and pages of two built-in hands."

[learned]
temperature = 0.5
hold = 1.0
keep = 0.75
duration = "200ms"

[brush]
kind = "speed"
width = 0.08
thin = 0.3
pace = 1.0
taper = 0.2
"""


def tags(name: str, count: int, rng: np.random.Generator) -> Iterator[Drawing]:
    """Tags in a style of rules."""
    for _ in range(count):
        yield tag(_LETTERS, find(name), Page(148.0, 105.0), rng)


def written(name: str, words: int, rng: np.random.Generator) -> Drawing:
    """About so many words of a built-in hand."""
    sentences = corpus.shipped_sentences()
    text, order = "", rng.permutation(len(sentences)).tolist()
    while len(text.split()) < words:
        text += f"{sentences[order.pop()]} "
    hand = library.load(name)
    layout = Layout(page=page("A4"), margin=(15.0, 15.0, 15.0, 15.0), x_height=hand.x_height)
    (manuscript, *_) = compose(text, hand, layout, rng)
    return trace(manuscript, hand, rng)


def examples(rng: np.random.Generator) -> dict[str, list[MovementSequence]]:
    """The examples of each manner."""
    found = {name: [_taken(drawing) for drawing in tags(name, _EACH, rng)] for name in TAGS}
    return found | {name: [_taken(written(name, _WORDS, rng))] for name in HANDS}


def _taken(drawing: Drawing) -> MovementSequence:
    return sequences.of_plans(taken_apart(drawing, letter_height(drawing)))


def _beginning(sequence: MovementSequence) -> MovementSequence:
    n = _PRIMER
    return replace(
        sequence, targets=sequence.targets[: n + 1], up=sequence.up[:n], dt=sequence.dt[:n], theta=sequence.theta[:n]
    )


def main(arguments: list[str] | None = None) -> None:
    """Learn all of it, and say how long it took."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    began, rng = time.process_time(), np.random.default_rng(given.seed)
    found = examples(rng)
    strung = {name: sequences.join_sequences(each) for name, each in found.items()}
    assert len(strung) <= PRIMERS
    moves = dynamics.learn(list(strung.values()), rng, replace(SEVERAL_STYLES, steps=_MOVES))
    forms = structure.learn([strung[name] for name in TAGS], rng, replace(SEVERAL_STYLES, steps=_FORMS))
    primers = {name: _beginning(sequence) for name, sequence in strung.items()}
    atomic.write(given.output, to_bytes(_TOML, LearnedMovement(moves, forms, primers)))
    strokes = sum(int((~sequence.up).sum()) for sequence in strung.values())
    print(f"{strokes} strokes of {len(strung)} manners; {time.process_time() - began:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
