"""Giving the networks a little of the page's own writing.

The lines are dealt into two halves.  Copies of the networks learn from what was found on one half, and then read the
other, so that no network confirms its own mistakes.  Renders of the page's own words keep them from forgetting.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from handout.hand import library
from handout.hand.places import graphemes
from handout.progress import Tell, silent
from handout.tagging import network
from handout.tagging.alphabet import JUNK, fold
from handout.tagging.features import ABOVE, HEIGHT, X_HEIGHT, Image, describe
from handout.tagging.network import Network
from handout.tagging.training import Examples, column_states, examples, written

FOLDS = 2
_COPIES = 4
_REHEARSED = 45  # lines
_EPOCHS, _RATE = 2, 4e-4
_OWN = 2.0  # weight of a column of the page, one of a render being 1
_BREADTH, _HEIGHT, _SHEAR, _SHIFT = 0.06, 0.04, 0.06, 0.8 / X_HEIGHT

Spans = Sequence[tuple[str, float, float]]


def folds(count: int) -> NDArray[np.intp]:
    """(count,) the half that each line is dealt to."""
    return np.arange(count) % FOLDS


def rehearsal(text: Sequence[str], rng: np.random.Generator) -> Examples:
    """Renders of the lines of a transcript, by all kinds of writers, with other words among them."""
    plain = ["".join(fold(unit) for unit in graphemes(line)).replace(JUNK, "").strip() for line in text]
    hands = [library.load(name) for name in library.names() if name.startswith("house-")]
    return joined(
        [examples(made, rng) for made in written(hands, [line for line in plain if line] or ["a"], _REHEARSED, rng)]
    )


def joined(parts: Sequence[Examples]) -> Examples:
    """All examples in one."""
    return Examples(np.concatenate([p.features for p in parts]), np.concatenate([p.states for p in parts]))


def own(images: Sequence[Image], spans: Sequence[Spans], rng: np.random.Generator) -> Examples:
    """Examples from the lines of a page and what was found on them, each line as it is bent in several ways."""
    parts = []
    for image, found in zip(images, spans, strict=True):
        for _ in range(_COPIES):
            bent, scale = _bent(image, rng)
            features = describe(bent)
            parts.append(
                Examples(features, column_states([(c, a * scale, b * scale) for c, a, b in found], len(features)))
            )
    return joined(parts)


def _bent(image: Image, rng: np.random.Generator) -> tuple[Image, float]:
    """The line broader or narrower, taller, leaning or higher, and how much broader."""
    import cv2

    breadth, height = np.exp(rng.normal(0.0, [_BREADTH, _HEIGHT]))
    shear, shift = rng.normal(0.0, [_SHEAR, _SHIFT * X_HEIGHT])
    matrix = np.array([[breadth, shear, -shear * ABOVE], [0, height, ABOVE - height * ABOVE + shift]])
    width = int(image.shape[1] * breadth) + 1
    return np.asarray(cv2.warpAffine(image, matrix, (width, HEIGHT))), float(breadth)


def adapted(
    networks: Sequence[Network],
    page: Examples,
    rehearsed: Examples,
    rng: np.random.Generator,
    tell: Tell = silent,
) -> tuple[Network, ...]:
    """Copies of the networks that have learned from examples of the page and from renders."""
    both = joined([page, rehearsed])
    share = np.ones(len(both.states), dtype=np.float32)
    share[: len(page.states)] = _OWN
    share /= share.mean()
    made = []
    for number, one in enumerate(networks):
        tell(number / len(networks), "learning from the page")
        made.append(
            network.trained(one, both.features, both.states, epochs=_EPOCHS, rate=_RATE, rng=rng, importance=share)
        )
    return tuple(made)
