"""Letters with marks as a pen writes them: which letter, and which strokes are set on it.

A mark is named in hand files (`NAMES`), set on its letter by `writing.drawn_forms`, and drawn in the TOML of a hand.
Unicode's canonical decomposition says most of which letter has which.  It has none for letters with a stroke through
them, and it calls marks after their history where people write something else: a comma under ņ, an apostrophe beside ď.
"""

from __future__ import annotations

import unicodedata

# name in the file → combining character
NAMES = {
    "grave": "\u0300",
    "acute": "\u0301",
    "circumflex": "\u0302",
    "tilde": "\u0303",
    "diaeresis": "\u0308",
    "ring": "\u030a",
    "caron": "\u030c",
    "cedilla": "\u0327",
    "macron": "\u0304",
    "breve": "\u0306",
    "dot": "\u0307",
    "double-acute": "\u030b",
    "ogonek": "\u0328",
    "comma-below": "\u0326",
    "turned-comma": "\u0312",
    "apostrophe": "\u0315",
    "slash": "\u0338",
    "bar": "\u0335",
}
CEDILLA, COMMA_BELOW, OGONEK = "\u0327", "\u0326", "\u0328"
TURNED_COMMA, APOSTROPHE = "\u0312", "\u0315"  # over g, and beside a letter's top
SLASH, BAR = "\u0338", "\u0335"  # through a letter
DOTLESS = "ı"  # no stroke, but one less
BELOW, THROUGH = frozenset({CEDILLA, COMMA_BELOW}), frozenset({SLASH, BAR})
NOT_ABOVE = BELOW | THROUGH | {OGONEK, APOSTROPHE}
# where a stroke goes through a letter, shares of its height; through other letters it goes in the middle
STROKE_HEIGHT = {"d": 0.78, "h": 0.74, "t": 0.36, "H": 0.73, "l": 0.53, "L": 0.47}

_WRITTEN = {
    **{letter: base + BAR for letter, base in zip("đĐħĦŧŦ", "dDhHtT", strict=True)},
    **{letter: base + SLASH for letter, base in zip("łŁ", "lL", strict=True)},
    **{letter: base + APOSTROPHE for letter, base in zip("ďťľĽ", "dtlL", strict=True)},
    **{letter: base + COMMA_BELOW for letter, base in zip("ĢĶķĻļŅņŖŗŢţ", "GKkLlNnRrTt", strict=True)},
    "ģ": "g" + TURNED_COMMA,
    "ı": "i" + DOTLESS,
    "ȷ": "j" + DOTLESS,
}
_READ = {written: letter for letter, written in _WRITTEN.items() if letter not in "Ţţ"}


def decompose_grapheme(grapheme: str) -> tuple[str, tuple[str, ...]]:
    """A grapheme as the letter that is written and the marks on it, from the inner to the outer one."""
    written = _WRITTEN.get(grapheme) or unicodedata.normalize("NFD", grapheme)
    return written[:1], tuple(written[1:])


def compose_grapheme(base: str, marks: tuple[str, ...]) -> str:
    """The grapheme that a letter and its marks are, NFC."""
    written = base + "".join(marks)
    return _READ.get(written) or unicodedata.normalize("NFC", written)
