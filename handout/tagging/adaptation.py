"""Adapts the networks to one page by a round of self-training.

The lines of the page are dealt into two folds.  Copies of the networks learn from the letters found in one fold and
then read the other, so that no network confirms its own mistakes.  Synthetic lines of the page's own words, mixed in,
keep the networks from forgetting the letters that the page lacks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from handout.hand.places import graphemes
from handout.progress import Tell, silent
from handout.tagging import network
from handout.tagging.alphabet import JUNK, fold
from handout.tagging.features import ABOVE, HEIGHT, X_HEIGHT, Image, describe
from handout.tagging.network import LabelledColumns, Network, joined
from handout.tagging.synthetic_lines import column_states, sampled_columns, synthetic_lines
from handout.tagging.synthetic_writers import built_in_hands

# Measured on five real pages: two folds read 98.4 % and 95.6 % of the letters of two hard ones, one fold 93.5 and 93.0;
# a second round gains nothing
FOLDS = 2
_COPIES = 4  # of each line of the page, differently distorted; five did no better
_REHEARSED = 45  # synthetic lines
_EPOCHS, _RATE = 2, 4e-4  # a third of the rate of training: the networks start from what they know
_PAGE_WEIGHT = 2.0  # of a column of the page; a synthetic one has 1
# standard deviations of the distortions of a line: breadth and height (relative), shear (tangent), shift (x-heights)
_BREADTH, _HEIGHT, _SHEAR, _SHIFT = 0.06, 0.04, 0.06, 0.8 / X_HEIGHT

Spans = Sequence[tuple[str, float, float]]


def folds(count: int) -> NDArray[np.intp]:
    """(count,) the fold that each line is dealt to: neighbouring lines are in different ones."""
    return np.arange(count) % FOLDS


def rehearsal(text: Sequence[str], rng: np.random.Generator) -> LabelledColumns:
    """Columns of synthetic lines by many writers, whose words are those of a transcript and random groups."""
    plain = ["".join(fold(unit) for unit in graphemes(line)).replace(JUNK, "").strip() for line in text]
    sentences = [line for line in plain if line] or ["a"]
    lines = synthetic_lines(built_in_hands(), sentences, _REHEARSED, rng)
    return joined([sampled_columns(line, rng) for line in lines])


def page_columns(images: Sequence[Image], spans: Sequence[Spans], rng: np.random.Generator) -> LabelledColumns:
    """Columns of the lines of a page, labelled by the letters found on them; every line is distorted several times."""
    parts = []
    for image, letters in zip(images, spans, strict=True):
        for _ in range(_COPIES):
            distorted, breadth = _distorted(image, rng)
            features = describe(distorted)
            scaled = [(letter, left * breadth, right * breadth) for letter, left, right in letters]
            parts.append(LabelledColumns(features, column_states(scaled, len(features))))
    return joined(parts)


def _distorted(image: Image, rng: np.random.Generator) -> tuple[Image, float]:
    """The line with a random breadth, height, slant and shift, and that breadth."""
    import cv2

    breadth, height = np.exp(rng.normal(0.0, [_BREADTH, _HEIGHT]))
    shear, shift = rng.normal(0.0, [_SHEAR, _SHIFT * X_HEIGHT])
    matrix = np.array([[breadth, shear, -shear * ABOVE], [0, height, ABOVE - height * ABOVE + shift]])
    width = int(image.shape[1] * breadth) + 1
    return np.asarray(cv2.warpAffine(image, matrix, (width, HEIGHT))), float(breadth)


def adapted(
    networks: Sequence[Network],
    page: LabelledColumns,
    rehearsed: LabelledColumns,
    rng: np.random.Generator,
    tell: Tell = silent,
) -> tuple[Network, ...]:
    """Copies of the networks, trained further on columns of the page and of synthetic lines."""
    columns = joined([page, rehearsed])
    weights = np.ones(len(columns), dtype=np.float32)
    weights[: len(page)] = _PAGE_WEIGHT
    weights /= weights.mean()
    copies = []
    for number, shipped in enumerate(networks):
        tell(number / len(networks), "learning from the page")
        copies.append(network.trained(shipped, columns, epochs=_EPOCHS, rate=_RATE, rng=rng, importance=weights))
    return tuple(copies)
