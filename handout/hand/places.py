"""Where a letter stands in its word: one rule for prompts, for what is read and for what is written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate, groupby
from typing import Literal, get_args

import regex

Place = Literal["start", "middle", "end", "alone"]
PLACES: tuple[Place, ...] = get_args(Place)
_GRAPHEME = regex.compile(r"\X")
_LETTER, _DIGIT = regex.compile(r"\p{L}\p{M}*"), regex.compile(r"\p{N}")


def graphemes(text: str) -> list[str]:
    """The characters of a text as people count them."""
    return [str(unit) for unit in _GRAPHEME.findall(text)]


def runs(units: Sequence[str]) -> Iterator[range]:
    """The stretches of graphemes that are written together: letters, digits, or one other character; no spaces."""
    numbered = ((i, _kind(unit)) for i, unit in enumerate(units))
    for (kind, single), group in groupby(numbered, key=lambda item: (item[1], item[0] if item[1] == "other" else -1)):
        stretch = [i for i, _ in group]
        if kind != "space":
            yield range(stretch[0], stretch[-1] + 1) if single < 0 else range(single, single + 1)


def place(i: int, count: int) -> Place:
    """The place of number i of `count` that are written together."""
    if count == 1:
        return "alone"
    return "start" if i == 0 else "end" if i == count - 1 else "middle"


def places(units: Sequence[str]) -> list[Place]:
    """The place of every grapheme of a text; that of a space is "alone"."""
    all_places: list[Place] = ["alone"] * len(units)
    for run in runs(units):
        for i in run:
            all_places[i] = place(i - run.start, len(run))
    return all_places


def word_numbers(units: Sequence[str]) -> list[int]:
    """The number of the word, from 0, that each grapheme of a text stands in; a space has that of the word before."""
    begins = (not unit.isspace() and (i == 0 or units[i - 1].isspace()) for i, unit in enumerate(units))
    return [count - 1 for count in accumulate(begins)]


def word_at(units: Sequence[str], at: int) -> str:
    """The word of a text that grapheme `at` stands in, "" for a letter that is not in the text (−1)."""
    if at < 0:
        return ""
    first, last = at, at
    while first and not units[first - 1].isspace():
        first -= 1
    while last + 1 < len(units) and not units[last + 1].isspace():
        last += 1
    return "".join(units[first : last + 1])


def _kind(unit: str) -> str:
    if unit.isspace():
        return "space"
    return "letter" if _LETTER.fullmatch(unit) else "digit" if _DIGIT.fullmatch(unit) else "other"
