"""The method "segments": networks trained on the built-in hands, segments, one round on the page's own writing.

Source: seed 000, §5.1.3 for the task; the method is this project's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy

import numpy as np

from handout.progress import Tell, silent, within
from handout.tagging import adaptation
from handout.tagging.alphabet import LETTERS, SPACE
from handout.tagging.decoder import TERMS, Decoded, Reading, Terms, decode, read
from handout.tagging.features import INKY, X_HEIGHT, Image, describe
from handout.tagging.network import Network, averaged
from handout.tagging.transcript import Written
from handout.values import Array

_WORD_GAP = 0.45  # x-heights: wider gaps are not counted as the width of letters
_FOUND = 0.2  # of the work, when the networks have read the page that have not learned from it; measured
_DOUBT = 0.35  # of a letter's tolerance: a difference that halves confidence


def page_scale(images: Sequence[Image], lines: Sequence[Written], widths: Array) -> float:
    """How broad this page's letters are against the usual ones: median over the lines."""
    usual = dict(zip(LETTERS, widths, strict=True))
    found = []
    for image, line in zip(images, lines, strict=True):
        x = np.flatnonzero((image > INKY).any(axis=0))
        expected = X_HEIGHT * sum(usual[letter] for letter in line.letters if letter != SPACE)
        if len(x) > 1 and expected > 0:
            gaps = np.diff(x)
            found.append((np.ptp(x) - gaps[gaps > _WORD_GAP * X_HEIGHT].sum()) / expected)
    return float(np.median(found)) if found else 1.0


class Page:
    """The lines of a page while they are aligned: features are worked out once."""

    def __init__(self, images: Sequence[Image], networks: Sequence[Network], terms: Terms = TERMS) -> None:
        self.images = tuple(images)
        self.networks = tuple(networks)
        self.features = [describe(image) for image in images]
        self._terms = terms
        self._prior = np.mean([one.log_prior for one in networks], axis=0)

    def part(self, lines: Sequence[int]) -> Page:
        """Some of the lines."""
        some = copy(self)
        some.images = tuple(self.images[i] for i in lines)
        some.features = [self.features[i] for i in lines]
        return some

    def reading(self, line: int, networks: Sequence[Network] | None = None) -> Reading:
        """What the networks read on a line."""
        posterior = averaged(networks or self.networks, self.features[line])
        return read(self.images[line], posterior, self._prior, self._terms)

    def widths(self, lines: Sequence[Written]) -> dict[str, float]:
        """Letter → usual width on this page, pixels of line space, given what is written on its lines."""
        mean = np.mean([one.widths for one in self.networks], axis=0).astype(np.float64)
        usual = np.maximum(mean * page_scale(self.images, lines, mean) * X_HEIGHT, 3.0)
        return dict(zip(LETTERS, usual.tolist(), strict=True))


def spans(line: Written, found: Decoded) -> list[tuple[str, float, float]]:
    """The letters with their ends, without spaces and without what was not found."""
    return [
        (letter, a, b)
        for letter, a, b in zip(line.letters, found.left.tolist(), found.right.tolist(), strict=True)
        if letter != SPACE and b > a
    ]


def by_line(
    page: Page, lines: Sequence[Written], rng: np.random.Generator, tell: Tell = silent, *, adapting: bool = True
) -> list[list[Decoded]]:
    """For every line its decodings: the last is the best, the others are by single networks, for comparison."""
    tell(0.0, "the letters")
    widths = page.widths(lines)
    best = [decode(page.reading(i), line.letters, widths) for i, line in enumerate(lines)]
    # networks that have not learned from the page agree less than those that have learned from the same letters
    single = [_by_each_network(page, i, line, widths, page.networks) for i, line in enumerate(lines)]
    if not adapting or len(lines) < adaptation.FOLDS:
        return [[*others, one] if len(page.networks) > 1 else [one] for others, one in zip(single, best, strict=True)]
    fold = adaptation.folds(len(lines))
    rehearsed = adaptation.rehearsal([line.text for line in lines], rng)
    for half in range(adaptation.FOLDS):
        learning = within(within(tell, _FOUND, 1.0), half / adaptation.FOLDS, (half + 1) / adaptation.FOLDS)
        others = np.flatnonzero(fold != half).tolist()
        letters = [spans(lines[i], best[i]) for i in others]
        learned = adaptation.page_columns([page.images[i] for i in others], letters, rng)
        networks = adaptation.adapted(page.networks, learned, rehearsed, rng, learning)
        for i in np.flatnonzero(fold == half).tolist():
            if len(networks) > 1:
                single[i] += _by_each_network(page, i, lines[i], widths, networks)
            single[i].append(decode(page.reading(i, networks), lines[i].letters, widths))
    return single


def _by_each_network(
    page: Page, number: int, line: Written, widths: Mapping[str, float], networks: Sequence[Network]
) -> list[Decoded]:
    """A line of the page decoded from what each network reads alone."""
    return [decode(page.reading(number, [network]), line.letters, widths) for network in networks]


def confidence(decodings: Sequence[Decoded]) -> Array:
    """(m,) 0–1: how well the decodings agree on both ends of every letter."""
    best = decodings[-1]
    if len(decodings) == 1:
        return np.full(len(best.left), 0.5)
    tolerance = np.maximum((best.right - best.left) / 3, 0.15 * X_HEIGHT)
    off = np.mean(
        [np.maximum(np.abs(d.left - best.left), np.abs(d.right - best.right)) for d in decodings[:-1]], axis=0
    )
    return np.asarray(0.5 ** (off / tolerance / _DOUBT))
