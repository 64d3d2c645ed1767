"""The words of a manuscript as pictures in word space: what is read before it is handed over."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from handout.reading.word_space import X_HEIGHT, drawn
from handout.values import Array, Indices, Line, Manuscript, Placed


@dataclass(frozen=True, eq=False)
class MadeWord:
    """A word that was set in scanned glyphs.

    text : its letters; line : the number of its line, from 0.
    at, numbers : (n,) int: place of each letter in the text, and its glyph.
    picture : (HEIGHT, w) density in word space.
    """

    text: str
    line: int
    at: Indices
    numbers: Indices
    picture: Array


def made_words(manuscript: Manuscript, slants: Sequence[float]) -> Iterator[MadeWord]:
    """The words of a page that are written with scanned ink, none that was struck out.

    slants : tangent of the letters of each page that ink is taken from.
    """
    for number, line in enumerate(manuscript.lines):
        for _, group in groupby(line.placed, key=lambda placed: placed.word):
            word = list(group)
            letters = [placed for placed in word if placed.ink is not None]
            if len(letters) == len(word):
                yield MadeWord(
                    "".join(placed.glyph.letter for placed in letters),
                    number,
                    np.array([placed.at for placed in letters], dtype=np.intp),
                    np.array([placed.ink.number for placed in letters if placed.ink], dtype=np.intp),
                    _picture(letters, line, X_HEIGHT / manuscript.x_height, slants),
                )


def _picture(letters: Sequence[Placed], line: Line, scale: float, slants: Sequence[float]) -> Array:
    """(HEIGHT, w): the lines of some glyphs, `scale` pixels a mm."""
    places, radius, edges, count = [], [], [], 0
    for ink in (placed.ink for placed in letters if placed.ink is not None):
        x, y = ink.graph.xy.T
        up = line.height_at(x) - y
        places.append(np.column_stack([x - slants[ink.source] * up, up]) * scale)
        radius.append(ink.graph.radius * scale)
        edges.append(ink.graph.edges + count)
        count += len(x)
    return drawn(np.concatenate(places), np.concatenate(radius), np.concatenate(edges))
