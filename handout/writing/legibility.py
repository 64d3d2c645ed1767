"""How often strangers misread each glyph of a scanned hand, put in words of letters that never stood beside it.

A glyph that reads well where its author wrote it may lean on its neighbours, be cut a little wrong, or be a letter that
only he takes for it.  So every glyph is written in several words that nobody wrote, whose letters follow one another as
they do on the hand's pages and whose other glyphs are drawn by lot, and read by the reader that knows no author.  The
choice of glyphs is paid by that (`glyph_index`).

Source: own method.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from string import ascii_lowercase

import numpy as np

from handout.errors import InputError
from handout.hand.author_reader import misread_letters, picture_of_ink, reads_alone
from handout.hand.learnt import learnt, share_learnt
from handout.hand.places import graphemes
from handout.hand.scanned import ScannedHand
from handout.networks import one_thread
from handout.values import Array
from handout.writing.variation import Chances
from handout.writing.word_layout import layout_model

VERSION = 6  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it


@dataclass(frozen=True)
class LegibilitySettings:
    """How glyphs are tried: as much as takes four seconds for a page, the rest set beforehand and never tuned.

    words : that each glyph is written in, at most and at least; glyphs : at which there are no more than the least.
    length : letters of a word, from and to.
    together : words that are set as one line.
    worst : share of the words in which a glyph reads worst that are not counted: its neighbours were bad there.
    clearest : glyphs of a letter by which it is judged; unclear : share of misreadings above which it is told:
        of fifteen hands k, u, x, v, b, c, g and w then; the k, u and x that were looked at were so by eye.
    """

    words: tuple[int, int] = (6, 2)
    glyphs: int = 2500
    length: tuple[int, int] = (3, 6)
    together: int = 40
    worst: float = 0.15
    clearest: int = 3
    unclear: float = 0.6


_SETTINGS = LegibilitySettings()


def misreadings(hand: ScannedHand) -> Array:
    """(n,) 0–1: how often each glyph is taken for another letter by strangers; 0 for what is not read alone."""
    return learnt(hand, "misreadings", VERSION, len(hand.glyphs), lambda: _measure_misreadings(hand).round(3))


def misread_shares(hand: ScannedHand) -> tuple[Array, Array]:
    """(n,) twice: `misreadings`, and how often glyphs of each one's letter are misread on average."""
    shares = misreadings(hand)
    _, of = np.unique(np.array([glyph.letter for glyph in hand.glyphs], dtype=str), return_inverse=True)
    return shares, (np.bincount(of, shares) / np.maximum(np.bincount(of), 1))[of]


@lru_cache(maxsize=4)
def prefer_legible(hand: ScannedHand, wish: float) -> ScannedHand:
    """The same hand, whose glyphs are chosen more by how strangers read them: `wish` 0 as usual, 1 as far as it goes.

    Raises InputError: a wish outside 0 to 1.
    """
    if not 0 <= wish <= 1:
        raise InputError(f"legible: {wish:g} is outside 0 (as the author writes) to 1 (as legible as the hand can be).")
    wished = replace(hand, legible=wish)
    share_learnt(hand, wished)
    return wished


def unclear_letters(hand: ScannedHand) -> dict[str, float]:
    """The small letters that strangers mostly take for others, worst first: how often the clearest glyphs of each are.

    Of capitals, digits and accents the reader knows too little to say so of an author.
    """
    shares = misreadings(hand)
    clearest = {
        letter: float(np.sort(shares[hand.numbers_of_letter(letter)])[: _SETTINGS.clearest].mean())
        for letter in hand.letters
        if letter in ascii_lowercase
    }
    return {
        letter: round(share, 2)
        for letter, share in sorted(clearest.items(), key=lambda item: -item[1])
        if share > _SETTINGS.unclear
    }


@one_thread
def _measure_misreadings(hand: ScannedHand) -> Array:
    rng = np.random.default_rng(0)
    words = list(made_words(hand, rng))
    if not words:
        return np.zeros(len(hand.glyphs))
    of_glyph: list[list[float]] = [[] for _ in hand.glyphs]
    texts = ["".join(hand.glyphs[n].letter for n in word) for word in words]
    for word, missed in zip(words, misread_letters(_written_words(hand, words, rng), texts), strict=True):
        for number, share in zip(word, missed.tolist(), strict=True):
            of_glyph[number].append(share)
    counted = [sorted(each)[: max(round(len(each) * (1 - _SETTINGS.worst)), 1)] for each in of_glyph]
    return np.array([float(np.mean(each)) if each else 0.0 for each in counted])


def made_words(hand: ScannedHand, rng: np.random.Generator) -> Iterator[list[int]]:
    """Words, as glyphs, that have every glyph which is read alone about as often as all others, none twice.

    Those that are not to be written are there as ever: otherwise each of them would change what is said of all others.
    """
    glyphs_of = dict[str, list[int]]()
    for number, glyph in enumerate(hand.glyphs):
        if reads_alone(glyph.letter):
            glyphs_of.setdefault(glyph.letter, []).append(number)
    letters = sorted(glyphs_of, key=lambda letter: (-len(glyphs_of[letter]), letter))
    small = [letter for letter in letters if letter.islower()] or letters
    following = {letter: list[str]() for letter in letters}
    before = {letter: list[str]() for letter in letters}
    for page in hand.pages:
        for word in page.transcript.split():
            of_word = [letter for letter in graphemes(word) if letter in small]
            for one, two in pairwise(of_word):
                following[one].append(two)
                before[two].append(one)
    most, least = _SETTINGS.words
    numbers = [number for letter in letters for number in glyphs_of[letter]]
    wanted = max(least, min(most, _SETTINGS.glyphs // max(len(numbers), 1)))
    stock: dict[str, list[int]] = {letter: [] for letter in letters}
    times = np.zeros(len(hand.glyphs), dtype=np.intp)

    def take(after: Sequence[str]) -> int:
        letter = str(rng.choice(after or small))
        stock[letter] = stock[letter] or rng.permutation(glyphs_of[letter]).tolist()
        return stock[letter].pop()

    for _ in range(wanted):
        for number in rng.permutation(numbers).tolist():
            if times[number] >= wanted:
                continue
            count, made = int(rng.integers(*_SETTINGS.length, endpoint=True)), [int(number)]
            ahead = int(rng.integers(count)) if hand.glyphs[number].letter in small else 0
            while len(made) < count - ahead:
                made.append(take(following[hand.glyphs[made[-1]].letter]))
            while len(made) < count:
                made.insert(0, take(before[hand.glyphs[made[0]].letter]))
            if len(set(made)) == len(made):
                times[made] += 1
                yield made


def _written_words(hand: ScannedHand, words: Sequence[Sequence[int]], rng: np.random.Generator) -> list[Array]:
    """Words as they are written in the hand, in word space."""
    model, found = layout_model(hand), list[Array]()
    for begin in range(0, len(words), _SETTINGS.together):
        line = words[begin : begin + _SETTINGS.together]
        first = np.cumsum([0, *map(len, line)])
        numbers = np.concatenate([np.array(word, dtype=np.intp) for word in line])
        starts = np.zeros(len(numbers), dtype=bool)
        starts[first[:-1]] = True
        apart, y, bends = model.place_glyphs(numbers, starts, Chances.draw(rng, len(numbers)))
        x = np.concatenate([[0.0], np.cumsum(apart)])
        for word, a, b in zip(line, first[:-1].tolist(), first[1:].tolist(), strict=True):
            graphs = model.lay_word(word, x[a:b] - x[a], y[a:b], bends[a:b])
            found.append(picture_of_ink(hand, numbers[a:b], graphs, hand.pitch))
    return found
