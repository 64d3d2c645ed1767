"""The words of a scanned hand as pictures in word space, for readers: each with its own lines and no neighbour's.

Lines are drawn as they were traced, as wide as they are, in even ink: words that are written anew are drawn alike
(`pipeline.rereading`), and a picture costs a millisecond, where ink that is cut out of its page costs ten.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from handout.hand.scanned import NOBODY, ScannedHand, ScannedPage
from handout.reading.word_space import X_HEIGHT, drawn
from handout.values import Array, Indices


@dataclass(frozen=True, eq=False)
class OwnWord:
    """A word as its author wrote it.

    glyphs : (n,) int, numbers in the hand, in order.
    text : its letters.
    picture : (HEIGHT, w) density in word space, 0 paper.
    """

    glyphs: Indices
    text: str
    picture: Array


def own_words(hand: ScannedHand) -> Iterator[OwnWord]:
    """The words on a hand's pages of which every letter was found beside the one before."""
    starts = [n for n, glyph in enumerate(hand.glyphs) if glyph.before == NOBODY and glyph.letter and glyph.at >= 0]
    of_word: dict[tuple[int, int], int] = {}
    for start in starts:
        key = hand.glyphs[start].page, hand.glyphs[start].word
        of_word[key] = of_word.get(key, 0) + 1
    for start in starts:
        chain = [start]
        while (after := hand.glyphs[chain[-1]].after) != NOBODY:
            chain.append(after)
        first = hand.glyphs[start]
        whole = of_word[first.page, first.word] == 1 and all(hand.glyphs[n].letter for n in chain)
        if whole:
            numbers = np.array(chain, dtype=np.intp)
            yield OwnWord(numbers, "".join(hand.glyphs[n].letter for n in chain), picture_of(hand, numbers))


def picture_of(hand: ScannedHand, numbers: Indices) -> Array:
    """(HEIGHT, w): the lines of neighbouring glyphs of one written line, in word space."""
    first = hand.glyphs[int(numbers[0])]
    vertices = np.unique(np.concatenate([hand.glyphs[int(n)].vertices for n in numbers]))
    return picture_of_vertices(hand.pages[first.page], first.line, vertices)


def picture_of_vertices(page: ScannedPage, line: int, vertices: Indices) -> Array:
    """(HEIGHT, w): some vertices (n,) of a page's graph, rising, and the lines between them, in word space."""
    scale = X_HEIGHT / (page.x_height / page.pixel)  # pixels of word space one of the page
    uv = page.graph.uv[vertices]
    up = page.base(line, uv[:, 0]) - uv[:, 1]
    places = np.column_stack([uv[:, 0] - page.slant * up, up]) * scale
    edges = page.graph.edges_between(vertices)
    return drawn(places, page.graph.radius[vertices] / page.pixel * scale, edges)
