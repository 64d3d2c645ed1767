"""Letters left out of a hand and made again: how near to the author's own they come, and whether they read as theirs.

Of each hand up to twelve letters are left out in turn (`kept_out`), and made again twice: as a drawn form, slanted,
widened and as tall as the author's, which is what a hand with very few letters gets, and after the author's other
letters.  How far each lies from the author's own glyphs is told in the mean distance of those from one another.
In the author's words the letter is then put in the place of his own, whose ligatures stay; it is read as what it is if
no other letter of its kind makes the word more probable to the reader, which has learnt nothing of this author.

The manner knows nothing of the letter that is left out; slant, width of the line and, for the drawn forms, heights and
breadth are measured with it.  The shipped hands are measured; with HANDOUT_HANDS set, the .hand files of that folder.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import ascii_lowercase, ascii_uppercase, digits

import numpy as np
from numpy.typing import NDArray

from handout.completion.drawn_letters import DrawnLetters
from handout.completion.specimens import Specimen
from handout.hand import library, measures
from handout.hand.author_reader import OwnWord, own_words, picture_of
from handout.hand.scanned import ScannedHand
from handout.hand.vetting import vet
from handout.reading import pictures
from handout.reading.word_space import X_HEIGHT, drawn
from handout.values import Array, LineGraph

LETTERS, OTHERS = 12, 4  # of a hand, and how many of those are no small letters
GLYPHS, MADE, WORDS = 6, 3, 3  # of a letter: own that are compared, made ones, and words that are read
_FIRST = "hgdbkypfltrsnmeauw"  # small letters, those that differ most between people before others
SEED = 1


def sure(hand: ScannedHand, letter: str) -> list[int]:
    """Glyphs of a letter of which there is no doubt, the surest first."""
    probability = vet(hand).probability
    numbers = sorted(hand.numbers_of_letter(letter).tolist(), key=lambda i: -probability[i])
    return [i for i in numbers if vet(hand).sure[i]][:GLYPHS]


def kept_out(hand: ScannedHand) -> list[str]:
    """The letters of a hand that are left out in turn: those of which there are two to compare."""
    others = [x for x in ascii_uppercase + digits if len(sure(hand, x)) > 1][:OTHERS]
    small = [x for x in _FIRST if len(sure(hand, x)) > 1]
    return [*small[: LETTERS - len(others)], *others]


@dataclass(frozen=True, eq=False)
class Glyph:
    """A line in line space with which of its vertices are the letter's own."""

    xy: Array
    own: NDArray[np.bool_]


def own_glyph(hand: ScannedHand, number: int) -> Glyph:
    """A glyph of the author, upright."""
    xy = hand.outline(number)
    upright = np.column_stack([xy[:, 0] - measures.slant(hand) * xy[:, 1], xy[:, 1]])
    return Glyph(upright, np.isin(hand.glyphs[number].vertices, hand.body(number)))


def made_body(specimen: Specimen) -> LineGraph:
    """The line of a made letter without its ligatures."""
    graph = specimen.parts[0].graph
    gone = [*(path[:-1] for path in specimen.entries), *(path[1:] for path in specimen.exits)]
    return graph.take(np.setdiff1d(np.arange(len(graph)), np.concatenate([np.zeros(0, dtype=np.intp), *gone])))


def made_glyph(hand: ScannedHand, specimen: Specimen) -> Glyph:
    """A made letter, upright."""
    xy = made_body(specimen).xy
    upright = np.column_stack([xy[:, 0] - measures.slant(hand) * xy[:, 1], xy[:, 1]])
    return Glyph(upright, np.ones(len(xy), dtype=bool))


def apart(a: Glyph, b: Glyph) -> float:
    """How far the own vertices of two glyphs lie from the other's line, best moved along the line; line space."""
    from scipy.spatial import cKDTree

    shift = np.array([np.median(b.xy[b.own, 0]) - np.median(a.xy[a.own, 0]), 0.0])
    for _ in range(4):
        moved = a.xy + shift
        (there, i), (back, j) = cKDTree(b.xy).query(moved[a.own]), cKDTree(moved).query(b.xy[b.own])
        aside = np.concatenate([b.xy[i, 0] - moved[a.own, 0], b.xy[b.own, 0] - moved[j, 0]])
        shift[0] += np.median(aside)
    return float(0.5 * (there.mean() + back.mean()))


def rivals(letter: str) -> str:
    """Letters of the same kind."""
    return next(kind for kind in (ascii_lowercase, ascii_uppercase, digits) if letter in kind)


def words_with(hand: ScannedHand, letter: str) -> list[tuple[OwnWord, int]]:
    """The author's words with a letter whose glyph is sure, and where in them it stands."""
    found = []
    for word in own_words(hand):
        for at, number in enumerate(word.glyphs.tolist()):
            if hand.glyphs[number].letter == letter and vet(hand).sure[number] and pictures.known(word.text):
                found.append((word, at))
                break
    return found[:WORDS]


def with_letter(hand: ScannedHand, word: OwnWord, at: int, specimen: Specimen) -> Array:
    """The picture of a word with a made letter in the place of the author's own."""
    number = int(word.glyphs[at])
    glyph, graph = hand.glyphs[number], made_body(specimen)
    page = hand.pages[glyph.page]
    vertices = np.unique(np.concatenate([hand.glyphs[int(n)].vertices for n in word.glyphs]))
    rest = page.graph.take(np.setdiff1d(vertices, hand.body(number)))
    own, made = own_glyph(hand, number), made_glyph(hand, specimen)
    shift = np.array([np.median(own.xy[own.own, 0]) - np.median(made.xy[:, 0]), 0.0])
    both = [(page.to_line(glyph.line, rest.uv), rest.radius / page.pitch), (graph.xy + shift, graph.radius)]
    scale = X_HEIGHT * page.pitch / page.x_height
    xy = np.concatenate([places for places, _ in both]) * scale
    radius = np.concatenate([half for _, half in both]) * scale
    edges = np.concatenate([rest.edges, graph.edges + len(rest)])
    upright = np.column_stack([xy[:, 0] - page.slant * xy[:, 1], xy[:, 1]])
    return drawn(upright, radius, edges)


def read_right(picture: Array, word: str, at: int) -> bool:
    """Whether no other letter of its kind makes a word more probable."""
    reading = pictures.load().read(picture)
    texts = [word[:at] + other + word[at + 1 :] for other in rivals(word[at])]
    likely = {text: reading.log_probability(text) for text in texts if pictures.known(text)}
    return max(likely, key=lambda text: likely[text]) == word


@dataclass(frozen=True)
class Row:
    """A letter left out: distances, and of how many words each kind of letter was read right."""

    letter: str
    own: float
    apart: tuple[float, float]
    words: int
    right: tuple[int, int, int]


def measured(hand: ScannedHand) -> Iterator[Row]:
    """Each letter that is left out."""
    drawn_letters = DrawnLetters(hand)
    for letter in kept_out(hand):
        own = [own_glyph(hand, number) for number in sure(hand, letter)]
        among = float(np.mean([apart(a, b) for i, a in enumerate(own) for b in own[:i]]))
        rng = np.random.default_rng(SEED)
        kinds = (drawn_letters.forms(letter, MADE, rng), drawn_letters.in_manner(letter, MADE, rng))
        away = [
            float(np.mean([apart(made_glyph(hand, specimen), glyph) for specimen in kind for glyph in own]))
            for kind in kinds
        ]
        words = words_with(hand, letter)
        right = [sum(read_right(picture_of(hand, word.glyphs), word.text, at) for word, at in words)]
        for kind in kinds:
            pictures_of = [with_letter(hand, word, at, kind[n % MADE]) for n, (word, at) in enumerate(words)]
            right.append(sum(read_right(p, word.text, at) for p, (word, at) in zip(pictures_of, words, strict=True)))
        yield Row(letter, among, (away[0], away[1]), len(words), (right[0], right[1], right[2]))


def told(rows: Sequence[Row]) -> str:
    """Distances by the author's own, and words read right."""
    ratios = np.array([[away / row.own for away in row.apart] for row in rows])
    count = sum(row.words for row in rows)
    right = [sum(row.right[kind] for row in rows) / max(count, 1) for kind in range(3)]
    middle, within = np.median(ratios, axis=0), (ratios <= 1.5).mean(axis=0)
    return (
        f"distance {middle[0]:.2f} -> {middle[1]:.2f}; letters within 1.5: {within[0]:.0%} -> {within[1]:.0%}; "
        f"nearer than the drawn form {np.mean(ratios[:, 1] < ratios[:, 0]):.0%}; "
        f"read right of {count} words: own {right[0]:.1%}, {right[1]:.1%} -> {right[2]:.1%}"
    )


def main() -> None:
    """Print a line for each hand, drawn form -> made after the other letters, and one for all."""
    folder = os.environ.get("HANDOUT_HANDS")
    names = [*map(str, sorted(Path(folder).glob("*.hand")))] if folder else sorted(library.scanned_files())
    every = []
    for name in names:
        hand = library.find(name)
        assert isinstance(hand, ScannedHand)
        rows = list(measured(hand))
        every += rows
        print(f"{hand.name}: {told(rows)}")
        each = (
            f"{row.letter} {row.apart[0] / row.own:.1f}->{row.apart[1] / row.own:.1f} "
            f"{row.right[0]},{row.right[1]}->{row.right[2]}/{row.words}"
            for row in rows
        )
        print("   " + "; ".join(each), flush=True)
    print(f"all {len(every)} letters: {told(every)}")


if __name__ == "__main__":
    main()
