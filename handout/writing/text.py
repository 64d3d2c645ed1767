"""Text as it is typed, turned into what a hand can write: graphemes, each a letter and its accents."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import regex

from handout.errors import InputError, MissingCharacters
from handout.hand.places import graphemes

# Characters that look the same when written by hand; "" is not written at all
_SAME = str.maketrans(
    {
        "\t": "    ",
        "\u00ad": "",
        "\u200b": "",
        "\u200c": "",
        "\u200d": "",
        "\u2060": "",
        "\ufeff": "",
        "\u2010": "-",
        "\u2011": "-",
        "\u2012": "–",
        "\u2015": "—",
        "\u2212": "–",
        "\u2032": "’",
        "\u2033": "”",
        "\u02bc": "’",
        "\u2024": ".",
        "\u2044": "/",
        "\u037e": ";",
        "ﬀ": "ff",
        "ﬁ": "fi",
        "ﬂ": "fl",
        "ﬃ": "ffi",
        "ﬄ": "ffl",
        "\u0133": "ij",
        "\u0132": "IJ",
        "\u1e9e": "SS",
        "\u212b": "Å",
        "\u2126": "Ω",
        "\u00b4": "’",
        "º": "°",
    }
)
# what a pen writes alike; a scanned hand has them as its transcript was typed
_ALIKE = {
    "'": "’‘",
    "’": "'‘",
    "‘": "'’",
    '"': ("”", "“", "''"),
    "“": ('"', "”"),
    "”": ('"', "“"),
    "–": "-—",
    "—": "–-",
    "-": "–",
    "…": ("...",),
}
# without U+00A0, U+2007 and U+202F, at which a line must not break
_SPACES = str.maketrans(
    dict.fromkeys("\u1680\u2000\u2001\u2002\u2003\u2004\u2005\u2006\u2008\u2009\u200a\u205f\u3000", " ")
)
_NEWLINES = regex.compile(r"\r\n|[\r\v\f\x85\u2028\u2029]")
# What may stand for a letter when the user accepts borrowed forms
_BORROWED = {"ł": "l", "Ł": "L", "đ": "d", "Đ": "Ð", "ı": "i", "ħ": "h", "Ħ": "H", "™": "TM", "©": "(c)", "®": "(R)"}
_MOST_NAMED = 20
_FEW = 40  # letters of a hand that can be told one by one


@dataclass(frozen=True, slots=True)
class Letter:
    """What is written for one grapheme: a letter that the hand has, the accents on it, and where it stands."""

    base: str
    marks: tuple[str, ...]
    at: int


@dataclass(frozen=True)
class Repertoire:
    """What a hand can write: graphemes, and combining accents that it can put on them.

    lendable : graphemes that it could be lent, of which a complaint tells.
    """

    name: str
    letters: frozenset[str]
    marks: frozenset[str]
    lendable: frozenset[str] = frozenset()


def normalise(text: str) -> str:
    """Text in NFC, with one kind of newline and of space, and look-alikes as the hands have them."""
    text = unicodedata.normalize("NFC", _NEWLINES.sub("\n", text))
    return unicodedata.normalize("NFC", text.translate(_SAME).translate(_SPACES))


def spell(text: str, hand: Repertoire, *, fallback: bool = False) -> Iterator[Letter | str]:
    """The graphemes of normalised `text` as letters of a hand, one by one; spaces and newlines as they are.

    The whole text is checked before this returns.

    Parameters
    ----------
    fallback : bool
        Accept borrowed forms: an accent that the hand lacks is left out, a letter is taken from the other case.

    Raises
    ------
    InputError
        Nothing to write.
    MissingCharacters
        The hand lacks characters; the message lists all of them with their places.
    """
    units = graphemes(text)
    written = {unit for unit in units if not unit.isspace()}
    missing = {unit for unit in written if not _form(unit, hand, 0, fallback)}
    if missing:
        raise MissingCharacters(_complaint(_places(units, missing), hand, fallback))
    if not written:
        raise InputError("There is nothing to write: the text is empty.")
    return _spelt(units, hand, fallback)


def _spelt(units: Sequence[str], hand: Repertoire, fallback: bool) -> Iterator[Letter | str]:
    for at, unit in enumerate(units):
        if unit.isspace():
            yield unit
        else:
            yield from _form(unit, hand, at, fallback)


def _form(grapheme: str, hand: Repertoire, at: int, fallback: bool) -> list[Letter]:
    return _letters(grapheme, hand, at) or (borrow(grapheme, hand, at) if fallback else [])


def _places(units: Sequence[str], missing: set[str]) -> dict[str, list[str]]:
    """Where in a text some graphemes stand, in words."""
    found: dict[str, list[str]] = {}
    line, column = 1, 0
    for unit in units:
        column += 1
        if unit == "\n":
            line, column = line + 1, 0
        if unit in missing:
            found.setdefault(unit, []).append(f"line {line}, character {column}")
    return found


def lacking(text: str, hand: Repertoire) -> dict[str, list[int]]:
    """The graphemes of normalised `text` that a hand has no letter for, and where they stand, graphemes from 0."""
    found: dict[str, list[int]] = {}
    for at, grapheme in enumerate(graphemes(text)):
        if not grapheme.isspace() and not _letters(grapheme, hand, at):
            found.setdefault(grapheme, []).append(at)
    return found


def _letters(grapheme: str, hand: Repertoire, at: int) -> list[Letter]:
    """The grapheme as one letter of the hand, with accents where it has no form of its own; [] if it lacks it."""
    for same in (grapheme, *_ALIKE.get(grapheme, ())):
        if all(part in hand.letters for part in same):
            return [Letter(part, (), at) for part in same]
    base, *marks = list(unicodedata.normalize("NFD", grapheme))
    if base in hand.letters and marks and all(mark in hand.marks for mark in marks):
        return [Letter(base, tuple(marks), at)]
    return []


def borrow(grapheme: str, hand: Repertoire, at: int) -> list[Letter]:
    """What a hand writes for a grapheme that it lacks where similar forms are accepted; [] if there is nothing."""
    base, *marks = list(unicodedata.normalize("NFD", grapheme))
    kept = tuple(mark for mark in marks if mark in hand.marks)
    for choice in (_BORROWED.get(base, base), unicodedata.normalize("NFKC", base), base.swapcase()):
        if choice and all(part in hand.letters for part in choice):
            return [Letter(part, kept if i == 0 else (), at) for i, part in enumerate(choice)]
    return []


def _complaint(missing: dict[str, list[str]], hand: Repertoire, fallback: bool) -> str:
    named = [
        f"{_name(grapheme)} ({'; '.join(places[:3])}{f' and {len(places) - 3} more' if len(places) > 3 else ''})"
        for grapheme, places in list(missing.items())[:_MOST_NAMED]
    ]
    more = f", and {len(missing) - _MOST_NAMED} others" if len(missing) > _MOST_NAMED else ""
    way_out = "use another hand"
    if not fallback:
        given = [_name(grapheme) for grapheme in missing if grapheme in hand.lendable]
        which = (
            f", which can supply {'all' if len(given) == len(missing) else ' '.join(given)} of them" if given else ""
        )
        way_out += f", or --fallback to accept similar forms{which}"
    few = f"; it can write only {''.join(sorted(hand.letters))}" if 0 < len(hand.letters) < _FEW else ""
    return f"The hand {hand.name} has no form for {', '.join(named)}{more}{few}: {way_out}."


def _name(grapheme: str) -> str:
    if grapheme.isprintable():
        return f"'{grapheme}'"
    return "+".join(f"U+{ord(char):04X}" for char in grapheme)


def spelt(letter: Letter) -> str:
    """The grapheme that a letter and its accents are, NFC."""
    return unicodedata.normalize("NFC", letter.base + "".join(letter.marks))


def runs(letters: Sequence[Letter]) -> list[str]:
    """For each letter, its place in its word: "start", "middle", "end" or "alone".

    The place of a small letter is counted among small letters: a capital, a digit or a quotation mark is not
    joined to it, so what follows starts afresh.
    """

    bases = ["", *(letter.base for letter in letters), ""]
    places = []
    for before_it, base, after_it in zip(bases, bases[1:], bases[2:], strict=False):
        same = str.islower if base.islower() else str.isalpha
        before, after = same(before_it) and before_it.isalpha(), same(after_it) and after_it.isalpha()
        places.append("middle" if before and after else "end" if before else "start" if after else "alone")
    return places
