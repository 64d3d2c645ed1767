"""The letters that the networks tell apart, and what stands for characters that are not among them.

An accented letter is read as the letter under its accent; quotation marks and dashes are read by how they look, not by
which way they face.
"""

from __future__ import annotations

import string
import unicodedata

import regex

SPACE = " "
JUNK = "\u25a0"  # what was struck out
LETTERS = string.ascii_letters + string.digits + string.punctuation + "–£€ßæøœ…" + SPACE + JUNK
INDEX = {letter: number for number, letter in enumerate(LETTERS)}
THIRDS = 3  # states a letter: 8 points better than one (docs/bibliography.md)

_LOOK_ALIKE = str.maketrans(
    "ΑΒΕΖΗΙΚΜΝΟΡΤΥΧονАВЕІЈКМНОРСТХЅаеіјорсухѕ‘’‚‛´“”„‟«»‹›—−‑‐·•ŒÆØ¡¿",
    "ABEZHIKMNOPTYXovABEIJKMHOPCTXSaeijopcyxs''','\"\"\"\"\"\"''–---.*OAO!?",
)
# Greek and Cyrillic letters that no network has learnt, and which of its own are found in their place; set by eye.
# Of pages simulated from drawn hands all printed letters were found, and 98 to 100 of 100 joined ones
_LIKE = str.maketrans(
    "αβγδεζηθικλμξπρσςτυφχψωΓΔΘΛΞΠΣΦΨΩбвгґджзиклмнптфцчшщъыьэюяєђћљњџБГҐДЖЗИЛПУФЦЧШЩЪЫЬЭЮЯЄЂЋЉЊЏ",
    "aBydEznOikAuEnposTvqxywTAOAENZOYQ6brrgw3uknmHnmqurwwbubwoaehhnHu6TTAK3NANyOU4WWbUb3ORETThHU",
)
_STRUCK = regex.compile(r"~~(.+?)~~", regex.DOTALL)
_NO_BASE = {"ł": "l", "Ł": "L", "đ": "d", "Đ": "D", "ð": "d", "Ð": "D", "þ": "p", "Þ": "P", "ı": "i"}


def fold(grapheme: str) -> str:
    """The letter of the alphabet that a grapheme is read as; what looks like none of them is read as junk.

    >>> fold("é"), fold("”"), fold("ß")
    ('e', '"', 'ß')
    """
    if grapheme.isspace():
        return SPACE
    if grapheme in INDEX:
        return grapheme
    base = unicodedata.normalize("NFD", grapheme)[0]
    base = _NO_BASE.get(base, base).translate(_LOOK_ALIKE)
    return base if base in INDEX else JUNK


def resemble(grapheme: str) -> str:
    """As `fold`, but a letter of Greek or Cyrillic that looks like none is the one that it resembles most.

    >>> fold("ж"), resemble("ж"), resemble("ё")
    ('■', 'w', 'e')
    """
    folded = fold(grapheme)
    like = unicodedata.normalize("NFD", grapheme)[0].translate(_LIKE)
    return like if folded == JUNK and like in INDEX else folded


def state(letter: str, third: int = 1) -> int:
    """Number of the network's output for a third (0, 1, 2) of a letter; spaces and junk have one, the middle."""
    return INDEX[letter] * THIRDS + third


def struck_out(text: str) -> list[tuple[int, int]]:
    """Where the words between two pairs of tildes begin and end in `text`, the tildes included."""
    return [match.span() for match in _STRUCK.finditer(text)]
