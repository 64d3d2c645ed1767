"""How many instances of every letter and pair a prompt, or a hand, has, by their place in words.

A word is here a run of letters, or of digits: a comma or a quotation mark does not change how the letter beside it is
written. Every other character stands alone.

Source: seed 000, §4.1; the least number is that of §6.2.1.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from handout.hand.places import PLACES, Place, graphemes, place, runs
from handout.prompting import corpus

LEAST = 8  # instances that let the choice of glyphs vary
COMMONEST = 200  # pairs that are reported

Instances = Counter[tuple[str, Place]]


def letters(texts: Iterable[str]) -> Instances:
    """How often each letter (a grapheme) stands in each place."""
    instances: Instances = Counter()
    for run in _runs(texts):
        instances.update(zip(run, _places(len(run), 1), strict=True))
    return instances


def pairs(texts: Iterable[str]) -> Instances:
    """How often each pair of letters or digits within a word stands in each place."""
    instances: Instances = Counter()
    for run in _runs(texts):
        pairs_of_run = [a + b for a, b in pairwise(run)]
        instances.update(zip(pairs_of_run, _places(len(run), 2), strict=True))
    return instances


def _runs(texts: Iterable[str]) -> Iterable[list[str]]:
    for text in texts:
        units = graphemes(text)
        for run in runs(units):
            yield units[run.start : run.stop]


def _places(length: int, unit: int) -> list[Place]:
    """The places of the units of that size in a run of that length."""
    count = max(length - unit + 1, 0)
    return [place(i, count) for i in range(count)]


@dataclass(frozen=True)
class CoverageRow:
    """A letter or pair: its share of all in the target, and its instances by place."""

    unit: str
    share: float
    start: int
    middle: int
    end: int
    alone: int

    @property
    def total(self) -> int:
        """Instances in all places."""
        return self.start + self.middle + self.end + self.alone


@dataclass(frozen=True)
class Coverage:
    """What a prompt gives: a row for every letter and for the commonest pairs of the target, the commonest first."""

    letters: tuple[CoverageRow, ...]
    pairs: tuple[CoverageRow, ...]
    least: int = LEAST

    @property
    def short_letters(self) -> tuple[CoverageRow, ...]:
        """Letters with fewer instances than `least`."""
        return tuple(row for row in self.letters if row.total < self.least)

    @property
    def short_pairs(self) -> tuple[CoverageRow, ...]:
        """Pairs with fewer instances than `least`."""
        return tuple(row for row in self.pairs if row.total < self.least)

    def as_json(self) -> dict[str, Any]:
        """Plain lists and numbers, for `--json`."""
        return {
            "least": self.least,
            "letters": [_plain(row) for row in self.letters],
            "pairs": [_plain(row) for row in self.pairs],
            "short_letters": [row.unit for row in self.short_letters],
            "short_pairs": [row.unit for row in self.short_pairs],
        }

    def table(self) -> str:
        """The letters and pairs as plain text; * marks what stays below the least number."""
        head = f"{'':2}{'':8}{'share':>7}{'start':>7}{'middle':>7}{'end':>7}{'alone':>7}{'total':>7}"
        lines = ["Letters", head, *(self._line(row) for row in self.letters)]
        lines += ["", f"The {len(self.pairs)} commonest pairs", head, *(self._line(row) for row in self.pairs)]
        return "\n".join(lines)

    def summary(self) -> str:
        """What stays below the least number, in two lines."""
        named = (("letters", self.short_letters, self.letters), ("pairs", self.short_pairs, self.pairs))
        return "\n".join(
            f"{len(short)} of {len(every)} {name} fewer than {self.least} times"
            + (": " + " ".join(f"{row.unit}({row.total})" for row in short) if short else ".")
            for name, short, every in named
        )

    def short(self) -> str:
        """How many letters and pairs stay below the least number, in a few words."""
        letters, pairs = (
            f"{len(self.short_letters)} of {len(self.letters)}",
            f"{len(self.short_pairs)} of {len(self.pairs)}",
        )
        return f"{letters} letters and {pairs} common pairs will be there"

    def _line(self, row: CoverageRow) -> str:
        mark = "*" if row.total < self.least else " "
        counts = "".join(f"{n:7d}" for n in (row.start, row.middle, row.end, row.alone, row.total))
        return f"{mark} {row.unit:<8}{row.share:7.2%}{counts}"


def _plain(row: CoverageRow) -> dict[str, Any]:
    places: dict[str, int] = {place: getattr(row, place) for place in PLACES}
    return {"unit": row.unit, "share": round(row.share, 6), **places, "total": row.total}


def coverage(written: Iterable[str], target: Iterable[str], characters: str = "", *, least: int = LEAST) -> Coverage:
    """What the texts `written` give towards the texts `target`.

    Parameters
    ----------
    written, target : iterable of str
        What the author copies; what will be wanted later.
    characters : str
        Reported even if the target has none of them.
    least : int
        Below it a letter or pair counts as short.
    """
    written, target = list(written), list(target)
    asked_for = {char: 0 for char in characters if not char.isspace()}
    single, double = _shares(letters(target)), _shares(pairs(target))
    commonest = dict(sorted(double.items(), key=lambda item: (-item[1], item[0]))[:COMMONEST])
    return Coverage(_rows({**asked_for, **single}, letters(written)), _rows(commonest, pairs(written)), least)


def _shares(instances: Instances) -> dict[str, float]:
    summed: Counter[str] = Counter()
    for (unit, _), count in instances.items():
        summed[unit] += count
    return {unit: count / summed.total() for unit, count in summed.items()}


def _rows(shares: Mapping[str, float], instances: Instances) -> tuple[CoverageRow, ...]:
    ordered = sorted(shares.items(), key=lambda item: (-item[1], item[0]))
    return tuple(CoverageRow(unit, share, *(instances[unit, place] for place in PLACES)) for unit, share in ordered)


@dataclass(frozen=True)
class Lack:
    """A letter of which a text needs more in some place than there are: needed, there in that place, and in all."""

    letter: str
    place: Place
    needed: int
    here: int
    anywhere: int


def lacks(text: str, have: Mapping[tuple[str, Place], int], *, least: int = LEAST) -> tuple[Lack, ...]:
    """What is missing to write a text: letters that have, in the place where it needs them, too few instances.

    Parameters
    ----------
    text : str
        What is to be written.
    have : mapping
        (letter, place) → instances; what `letters` counts in a prompt, or the glyphs of a hand.
    least : int
        A letter that is needed more rarely than this needs only so many instances.

    Returns
    -------
    tuple of Lack
        Those of which there is none at all first, then the most needed.
    """
    needed = letters([corpus.as_typed(text)])
    every: Counter[str] = Counter()
    for (letter, _), count in have.items():
        every[letter] += count
    short = [
        Lack(letter, place, count, have.get((letter, place), 0), every[letter])
        for (letter, place), count in needed.items()
        if have.get((letter, place), 0) < min(least, count)
    ]
    return tuple(sorted(short, key=lambda lack: (lack.anywhere > 0, lack.here - lack.needed, lack.letter, lack.place)))
