"""The reader of pictures that has learnt an author's words, and how oddly single glyphs read to it.

A glyph is read alone, as a word of one letter.  Some letters read badly alone in some hands (an r is a v there), so
what tells is how much worse a glyph reads than others of its letter: its strangeness.

Words are pictures in word space, each with its own lines and no neighbour's.  Lines are drawn as they were traced, as
wide as they are, in even ink: words that are written anew are drawn alike (`pipeline.rereading`), and a picture costs a
millisecond, where ink that is cut out of its page costs ten.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from handout.hand.learnt import learnt
from handout.hand.scanned import NOBODY, ScannedHand, ScannedPage
from handout.reading import pictures
from handout.reading.adaptation import adapted
from handout.reading.misreading import shares_seen
from handout.reading.pictures import Reader as Reader
from handout.reading.pictures import log_probabilities
from handout.reading.word_space import X_HEIGHT, drawn
from handout.values import Array, Indices, LineGraph

VERSION = 2  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it
OWN_WORDS = 100  # of an author that are learnt; half a second
_DIGITS = 4  # of a weight after the point, as it is kept


@dataclass(frozen=True)
class StrangenessSettings:
    """Chosen on three people's pages (csafe w0154 w0076 w0394), a seventh of whose letters was spoilt on purpose.

    most : surprise of a glyph, nats, beyond which it makes no difference.
    kin : glyphs of any letter that count as siblings of each.
    rare : glyphs of a small letter up to which none of them may be read by others; odd : nats beyond which it is not.
        Of 35 such letters of ten people the best glyph of 33 has at most 2.9, of the others (a k and a j) 5 and more.
    """

    most: float = 6.0
    kin: float = 2.0
    rare: int = 2
    odd: float = 4.0


SETTINGS = StrangenessSettings()


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


def picture_of_ink(hand: ScannedHand, numbers: Indices, graphs: Sequence[LineGraph], unit: float) -> Array:
    """(HEIGHT, w): a word that was written with glyphs (n,), upright, in word space.

    graphs : n, the ink of each; unit : x-heights of one of theirs.
    """
    slants = [page.slant for page in hand.pages]
    places, radius, edges, count = [], [], [], 0
    for number, graph in zip(numbers.tolist(), graphs, strict=True):
        x, up = (graph.xy * unit).T
        places.append(np.column_stack([x - slants[hand.glyphs[number].page] * up, up]) * X_HEIGHT)
        radius.append(graph.radius * unit * X_HEIGHT)
        edges.append(graph.edges + count)
        count += len(graph)
    return drawn(np.concatenate(places), np.concatenate(radius), np.concatenate(edges))


def readable(word: str) -> bool:
    """Whether the reader knows all letters of a word."""
    return bool(word) and pictures.known(word)


@lru_cache(maxsize=4)
def author_reader(hand: ScannedHand) -> Reader:
    """The reader that knows a hand."""
    weights = learnt(hand, "author's reader", VERSION, None, lambda: _weights(hand))
    return pictures.load().with_last_layer(np.array(weights)) if len(weights) else pictures.load()


def _weights(hand: ScannedHand) -> Array:
    """Of the reader's last layer; none where there is nothing to learn from."""
    reader, words = pictures.load(), [word for word in own_words(hand) if readable(word.text)][:OWN_WORDS]
    if not words:
        return np.zeros(0)
    seen = reader.features_of([word.picture for word in words])
    weights = np.vstack(adapted(reader, seen, [word.text for word in words]).columns[-1])
    return np.asarray(np.round(weights.ravel().astype(np.float64), _DIGITS))


def reads_alone(letter: str) -> bool:
    """Whether a letter is read alone: marks are not, which look like specks."""
    return letter.isalnum() and readable(letter)


def surprises(reader: Reader, pictures: Sequence[Array], letters: Sequence[str]) -> Array:
    """(n,) nats, at least 0: how little glyphs read as letters that `reads_alone`, given their pictures."""
    if not letters:
        return np.zeros(0)
    return np.clip(-log_probabilities(reader.read_all(pictures), letters), 0.0, SETTINGS.most)


def misread_letters(seen: Sequence[Array], words: Sequence[str]) -> list[Array]:
    """Of every letter of words, how probably it is another to who knows no author, given the words' pictures."""
    return shares_seen(pictures.load().read_all(seen), words)


def usual_surprise(surprises: Array, letters: Sequence[str], alone: NDArray[np.bool_]) -> Array:
    """(n,): how surprising other glyphs of each one's letter are; those that are not read `alone` (n,) have none."""
    names, of = np.unique(np.array(letters, dtype=str), return_inverse=True)
    total, count = (np.bincount(of, weights, len(names))[of] for weights in (surprises * alone, alone))
    middle = float(surprises[alone].mean()) if alone.any() else 0.0
    rest = np.maximum(count - 1, 0) + SETTINGS.kin
    return np.where(alone, (total - surprises + SETTINGS.kin * middle) / rest, 0.0)


def strangeness(hand: ScannedHand) -> Array:
    """(n,) nats: how much worse each glyph reads alone than others of its letter; 0 for what is not read alone."""
    reader = author_reader(hand)
    letters = [glyph.letter for glyph in hand.glyphs]
    alone = np.array([reads_alone(letter) for letter in letters], dtype=bool)
    glyphs = [hand.glyphs[number] for number in np.flatnonzero(alone).tolist()]
    seen = [picture_of_vertices(hand.pages[glyph.page], glyph.line, glyph.vertices) for glyph in glyphs]
    strange = np.zeros(len(letters))
    strange[alone] = surprises(reader, seen, [glyph.letter for glyph in glyphs])
    return strange - usual_surprise(strange, letters, alone)


def find_odd_rarities(hand: ScannedHand) -> NDArray[np.bool_]:
    """(n,): glyphs of rare small letters that read as something else to whoever does not know the author."""
    return np.asarray(learnt(hand, "misread", VERSION, len(hand.glyphs), lambda: _read_rare(hand)) > 0)


def _read_rare(hand: ScannedHand) -> Array:
    odd = np.zeros(len(hand.glyphs))
    for letter in hand.letters:
        numbers = hand.numbers_of_letter(letter)
        if not (letter.islower() and reads_alone(letter) and len(numbers) <= SETTINGS.rare):
            continue
        glyphs = [hand.glyphs[number] for number in numbers.tolist()]
        seen = [picture_of_vertices(hand.pages[glyph.page], glyph.line, glyph.vertices) for glyph in glyphs]
        odd[numbers] = surprises(pictures.load(), seen, [letter] * len(glyphs)) > SETTINGS.odd
    return odd
