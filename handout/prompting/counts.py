"""How often letters and pairs of letters stand in a text, as frequencies and as matrices over many sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from handout.values import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def letters(text: str) -> Counter[str]:
    """Characters of the text, spaces left out."""
    return Counter(char for char in text if not char.isspace())


def pairs(text: str) -> Counter[str]:
    """Characters that follow one another within a word."""
    return Counter(a + b for word in text.split() for a, b in pairwise(word))


@dataclass(frozen=True)
class Frequencies:
    """Of letters and of pairs in the text that the author will want written; the commonest of each is 1."""

    letters: Mapping[str, float]
    pairs: Mapping[str, float]


def frequencies(texts: Iterable[str]) -> Frequencies:
    """Frequencies in some texts, scaled so that the commonest letter and the commonest pair are 1."""
    single: Counter[str] = Counter()
    double: Counter[str] = Counter()
    for text in texts:
        single.update(letters(text))
        double.update(pairs(text))
    return Frequencies(_scaled(single), _scaled(double))


def _scaled(counts: Counter[str]) -> dict[str, float]:
    most = max(counts.values(), default=1)
    return {key: count / most for key, count in counts.items()}


@dataclass(frozen=True, eq=False)
class Table:
    """Counts of every unit (letter or pair) in every sentence.

    units : the letters or pairs that have a frequency in the target, one a column.
    counts : (sentences, units) sparse float.
    frequency : (units,) of the target.
    """

    units: tuple[str, ...]
    counts: csr_array
    frequency: Array


def table(counted: Sequence[Counter[str]], frequency: Mapping[str, float]) -> Table:
    """The matrix of counts; units that the target lacks are worth nothing and left out."""
    from scipy.sparse import csr_array

    units = tuple(sorted(frequency))
    column = {unit: i for i, unit in enumerate(units)}
    found = [(row, column[u], n) for row, count in enumerate(counted) for u, n in count.items() if u in column]
    rows, columns, values = np.array(found, dtype=np.float64).reshape(-1, 3).T
    place = (rows.astype(np.intp), columns.astype(np.intp))
    matrix = csr_array((values, place), shape=(len(counted), len(units)))
    return Table(units, matrix, np.array([frequency[unit] for unit in units], dtype=np.float64))
