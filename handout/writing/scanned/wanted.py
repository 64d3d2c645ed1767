"""What a text asks of a scanned hand: letters in their places, and which of them it lacks.

Source: seed 000, §6.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from handout.errors import MissingCharacters
from handout.hand.places import Place
from handout.writing.scanned.stock import Stock

_MOST_NAMED = 20


@dataclass(frozen=True)
class Wanted:
    """One letter that is to be written.

    letter : a grapheme.
    place : in its word.
    word : number of its word in the text, rising.
    at : where it stands in the text, graphemes from 0.
    """

    letter: str
    place: Place
    word: int
    at: int


def stand_in(stock: Stock, letter: str) -> str:
    """The letter whose glyphs are written for one: itself, a small one for a capital there is none of, "" for none."""
    if letter and len(stock.of(letter)):
        return letter
    small = letter.lower()
    return small if letter and small != letter and len(stock.of(small)) else ""


def check(stock: Stock, wanted: Sequence[Wanted]) -> None:
    """See that there is something to write for every letter.

    Raises
    ------
    MissingCharacters
        There is not; the message lists all such letters with their places.
    """
    missing: dict[str, list[int]] = {}
    for one in wanted:
        if not stand_in(stock, one.letter):
            missing.setdefault(one.letter, []).append(one.at)
    if missing:
        named = ", ".join(f"'{letter}' ({_places(at)})" for letter, at in list(missing.items())[:_MOST_NAMED])
        more = f", and {len(missing) - _MOST_NAMED} others" if len(missing) > _MOST_NAMED else ""
        raise MissingCharacters(
            f"The hand {stock.hand.name} has no glyph of {named}{more}: use another hand, or scan a page with them."
        )


def _places(at: Sequence[int]) -> str:
    named = ", ".join(str(place + 1) for place in at[:3])
    more = f" and {len(at) - 3} more" if len(at) > 3 else ""
    return f"character{'s' if len(at) > 1 else ''} {named} of the text{more}"
