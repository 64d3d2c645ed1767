"""A hand with all letters of a text: which ones it lacks, and the page that is added for them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from handout.errors import InputError
from handout.writing.text import Borrowed, borrow, lacking, list_borrowed, normalise, spell, written_units

if TYPE_CHECKING:  # most texts lack nothing, and what makes letters takes longer to load than writing a sentence
    from handout.completion.letters import LetterMaker, Supply
    from handout.completion.specimens import Specimen
    from handout.hand.drawn import Hand
    from handout.hand.scanned import ScannedHand


def complete_hand(
    hand: Hand | ScannedHand, text: str, *, fallback: bool = False, seed: int = 0, marked: bool = False
) -> tuple[Hand | ScannedHand, list[Borrowed]]:
    """Add the letters of a text that a hand lacks; returns the hand and those letters.

    Letters of which all glyphs are doubtful are listed, and with `fallback`, or where the hand is wished legible, lent,
    too: these forms stand beside their own, and which is written is a question of price (`writing.glyph_index`).  A
    drawn hand stays as it is: it borrows similar forms as it writes, and only these are listed.

    hand : returned as it is where it lacks nothing.
    fallback : lend what the author never wrote; without it only accented letters are put together, of the author's own.
    seed : of the variation of what is drawn.
    marked : see `written_units`.

    Raises InputError: the hand holds no letters, or too little clear line to draw others with.
    Raises MissingCharacters: some letters are missing still; the message lists them with their places and says what
        `fallback` would supply.
    """
    if hand.pages is None:
        return hand, list_borrowed(normalise(text), hand.repertoire, marked=marked) if fallback else []
    if not hand.letters:
        raise InputError(
            f"{hand.name} holds ink without letters: it is a pen to write with, not a hand; give it as --pen, and a "
            "hand with letters as --hand."
        )
    text = normalise(text)
    places, doubted = lacking(text, hand.repertoire, marked=marked), _doubted_letters(hand, text, marked=marked)
    if not places and not doubted:
        return hand, []
    needed = tuple(sorted(places))
    completed, supplies = _add_supplies(hand, (needed, tuple(sorted(doubted))), fallback, seed)
    lendable = _lendable(_maker(hand, 0), needed)
    spell(text, replace(completed.repertoire, lendable=lendable), fallback=fallback, marked=marked)
    lent, worse = {x for x, _ in supplies}, "read worse" if hand.legible else "are doubtful"
    return completed, [
        *(Borrowed(x, supply.source, supply.of_author, tuple(places[x])) for x, supply in supplies if x in places),
        *(
            Borrowed(x, f"{supply.source}, as its own {worse}", False, tuple(doubted[x]), True)
            for x, supply in supplies
            if x in doubted
        ),
        *(Borrowed(x, "its own, all doubtful", True, tuple(at), True) for x, at in doubted.items() if x not in lent),
    ]


def _doubted_letters(hand: ScannedHand, text: str, *, marked: bool = False) -> dict[str, list[int]]:
    """The letters of a normalised text of which all glyphs of a hand are doubtful, and where they stand."""
    from handout.writing.glyph_index import better_lent

    places: dict[str, list[int]] = {}
    for at, letter in enumerate(written_units(text, marked=marked)[0]):
        if letter in hand.letters:
            places.setdefault(letter, []).append(at)
    return {letter: at for letter, at in places.items() if better_lent(hand, letter)}


@dataclass(frozen=True)
class Outlook:
    """How a letter can be written that a hand lacks: "composed" of what the author wrote, only "lent", or not at all.

    letter : what is wanted; how : "composed", "lent", "missing", or "doubted" where the hand has it, but only glyphs
    that are more doubtful than a lent one would be strange; source : what of, in words.
    """

    letter: str
    how: str
    source: str = ""


def outlook(hand: ScannedHand, text: str) -> tuple[Outlook, ...]:
    """How `complete_hand` would supply each letter of a text that a hand lacks, or doubts; in the order of the text."""
    text = normalise(text)
    needed, doubted = lacking(text, hand.repertoire), _doubted_letters(hand, text)
    if not (needed or doubted) or not hand.letters:
        return tuple(Outlook(letter, "missing") for letter in needed)
    maker = _maker(hand, 0)
    lendable = _lendable(maker, tuple(sorted(needed)))
    outlooks = list[Outlook]()
    for letter in needed:
        supply = maker.make(letter, fallback=False)
        if supply:
            outlooks.append(Outlook(letter, "composed", supply.source))
            continue
        source = (maker.make(letter, fallback=True) or maker.instead(letter)).source
        outlooks.append(Outlook(letter, "lent" if source and letter in lendable else "missing", source))
    lent = ((letter, maker.make(letter, fallback=True)) for letter in doubted)
    return (*outlooks, *(Outlook(letter, "doubted", supply.source) for letter, supply in lent if supply))


@lru_cache(maxsize=8)  # a batch asks for the same letters again and again
def _add_supplies(
    hand: ScannedHand, needed: tuple[tuple[str, ...], tuple[str, ...]], fallback: bool, seed: int
) -> tuple[ScannedHand, tuple[tuple[str, Supply], ...]]:
    """The hand with a page of supplied letters; each letter with its supply, lacking letters before doubted ones."""
    from handout.completion.specimens import add_page

    maker = _maker(hand, seed)
    supplies: list[tuple[str, Supply]] = []
    specimens: list[Specimen] = []
    missing, doubted = needed
    for letter in (*missing, *(doubted if fallback or hand.legible else ())):
        supply = maker.make(letter, fallback or letter in hand.letters)
        if not supply and fallback and letter not in hand.letters:
            supply = maker.instead(letter)
            present = {specimen.letter for specimen in specimens}
            supply = replace(supply, specimens=[form for form in supply.specimens if form.letter not in present])
        if supply or (fallback and supply.source):
            specimens += supply.specimens
            supplies.append((letter, supply))
    return (add_page(hand, specimens) if specimens else hand), tuple(supplies)


def _maker(hand: ScannedHand, seed: int) -> LetterMaker:
    from handout.completion.letters import LetterMaker

    return LetterMaker(hand, np.random.default_rng(seed))


def _lendable(maker: LetterMaker, needed: tuple[str, ...]) -> frozenset[str]:
    """Which of some letters could be lent."""
    all_lent = maker.repertoire
    return frozenset(letter for letter in needed if not lacking(letter, all_lent) or borrow(letter, all_lent, 0))
