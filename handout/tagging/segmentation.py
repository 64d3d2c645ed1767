"""The method "segments": networks read every column, the transcript is laid along that, and the networks adapt.

Adapting is one round of self-training.  The lines of the page are dealt into two folds.  Copies of the networks learn
from the letters found in one fold and then read the other, so that no network confirms its own mistakes.  Synthetic
lines of the page's own words, mixed in, keep the networks from forgetting the letters that the page lacks.

Source: seed 000, §5.1.3 for the task; own method.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from handout.alphabet import JUNK, LETTERS, SPACE, resemble, state
from handout.hand.places import graphemes
from handout.networks import Floats
from handout.progress import Tell, narrow_reports, silent
from handout.tagging import network
from handout.tagging.decoder import ColumnReading, Decoded, Held, decode, read_line
from handout.tagging.line_space import ABOVE, HEIGHT, INKY, X_HEIGHT, Image, column_count, describe
from handout.tagging.network import LabelledColumns, RectifierNetwork, average_logs, join_columns
from handout.tagging.synthetic_lines import (
    SHARE,
    SHARE_OF_SPACE,
    built_in_hands,
    column_states,
    sampled_columns,
    synthetic_lines,
)
from handout.tagging.transcript import TranscriptLine
from handout.values import Array

_WORD_GAP = 0.45  # x-heights: wider gaps are not counted as the width of letters
_FOUND = 0.2  # of the work, when the networks have read the page that have not learned from it; measured
_DOUBT = 0.35  # of a letter's tolerance: a difference that halves confidence


@dataclass(frozen=True)
class Adaptation:
    """The round of self-training; measured on five real pages (docs/bibliography.md)."""

    folds: int = 2  # with one, 93.5 and 93.0 % of two hard pages; with two, 98.4 and 95.6; a second round gains nothing
    copies: int = 4  # of each line of the page, differently distorted; five did no better
    rehearsed: int = 12  # synthetic lines; 24 and 45 did no better
    # of the columns, since neighbours are nearly alike: all did no better (96.3 %, 96.7 with these; three seeds)
    share: float = 0.33
    epochs: int = 1  # two where a person confirmed letters; else a second found no more on five real pages
    rate: float = 8e-4  # of learning
    page_weight: float = 2.0  # of a column of the page; a synthetic one has 1
    known_weight: float = 8.0  # of a column of a letter that a person confirmed; 24 mended no more of a simulated page
    # standard deviations of the distortions of a line
    breadth: float = 0.06  # relative
    height: float = 0.04  # relative
    shear: float = 0.06  # tangent
    shift: float = 0.8 / X_HEIGHT  # x-heights


_ADAPTATION = Adaptation()
Spans = Sequence[tuple[str, float, float]]


def page_scale(images: Sequence[Image], lines: Sequence[TranscriptLine], widths: Array) -> float:
    """How broad this page's letters are against the usual ones: median over the lines."""
    usual = dict(zip(LETTERS, widths, strict=True))
    scales = []
    for image, line in zip(images, lines, strict=True):
        x = np.flatnonzero((image > INKY).any(axis=0))
        expected = X_HEIGHT * sum(usual[letter] for letter in line.letters if letter != SPACE)
        if len(x) > 1 and expected > 0:
            gaps = np.diff(x)
            scales.append((np.ptp(x) - gaps[gaps > _WORD_GAP * X_HEIGHT].sum()) / expected)
    return float(np.median(scales)) if scales else 1.0


class PageReader:
    """The lines of a page while they are aligned: features are worked out once."""

    def __init__(self, images: Sequence[Image], networks: Sequence[RectifierNetwork]) -> None:
        self.images = tuple(images)
        self.networks = tuple(networks)
        self.features = [describe(image) for image in images]
        # text lines → the same broken as suits the page; line → what the networks together make of its columns
        self.broken: dict[tuple[TranscriptLine, ...], list[TranscriptLine]] = {}
        self.fits: dict[tuple[TranscriptLine, ...], list[float]] = {}  # how well text lines fit these
        self.chance: dict[tuple[TranscriptLine, ...], float] = {}  # what a column of them scores by chance
        self._together: dict[int, Floats] = {}
        self._prior = np.mean([network.log_prior for network in networks], axis=0)

    def part(self, lines: Sequence[int]) -> PageReader:
        """Some of the lines."""
        some = copy(self)
        some.images = tuple(self.images[i] for i in lines)
        some.features = [self.features[i] for i in lines]
        some.broken, some.fits, some.chance = {}, {}, {}
        some._together = {i: self._together[k] for i, k in enumerate(lines) if k in self._together}
        return some

    def reading(self, line: int) -> ColumnReading:
        """What the networks together read on a line."""
        if line not in self._together:
            self._together[line] = self._posteriors(line, self.networks)[-1]
        return self._read_line(line, self._together[line])

    def readings(self, line: int, networks: Sequence[RectifierNetwork]) -> list[ColumnReading]:
        """What each of some networks reads on a line, and last what they read together; one alone counts once."""
        return [self._read_line(line, posterior) for posterior in self._posteriors(line, networks)]

    def _posteriors(self, line: int, networks: Sequence[RectifierNetwork]) -> list[Floats]:
        each = [network.log_posterior(self.features[line]) for network in networks]
        return [*each, average_logs(each)] if len(each) > 1 else each

    def _read_line(self, line: int, posterior: Floats) -> ColumnReading:
        return read_line(self.images[line], posterior, self._prior)

    def widths(self, lines: Sequence[TranscriptLine]) -> dict[str, float]:
        """Letter → usual width on this page, pixels of line space, given what is written on its lines."""
        return usual_widths(self.images, lines, self.networks)


def usual_widths(
    images: Sequence[Image], lines: Sequence[TranscriptLine], networks: Sequence[RectifierNetwork]
) -> dict[str, float]:
    """Letter → usual width on a page, pixels of line space, given its lines and what is written on each."""
    mean = np.mean([network.widths for network in networks], axis=0).astype(np.float64)
    usual = np.maximum(mean * page_scale(images, lines, mean) * X_HEIGHT, 3.0)
    return dict(zip(LETTERS, usual.tolist(), strict=True))


def page_reader(images: Sequence[Image], networks: Sequence[RectifierNetwork]) -> PageReader:
    """The reader of some lines: the same one where they are asked for again."""
    return _page_reader(tuple((image.shape[1], image.tobytes()) for image in images), tuple(networks))


@lru_cache(maxsize=2)  # the lines as they were found, and as many as the text has
def _page_reader(images: tuple[tuple[int, bytes], ...], networks: tuple[RectifierNetwork, ...]) -> PageReader:
    pixels = [np.frombuffer(data, dtype=np.uint8).reshape(HEIGHT, width) for width, data in images]
    return PageReader(pixels, networks)


def spans(line: TranscriptLine, decoded: Decoded) -> list[tuple[str, float, float]]:
    """The letters with their ends, without spaces and without what was not found."""
    return [
        (letter, a, b)
        for letter, a, b in zip(line.letters, decoded.left.tolist(), decoded.right.tolist(), strict=True)
        if letter != SPACE and b > a
    ]


def by_segments(
    page: PageReader,
    lines: Sequence[TranscriptLine],
    rng: np.random.Generator,
    tell: Tell = silent,
    *,
    adapting: bool = True,
    held: Sequence[Mapping[int, Held]] = (),
) -> list[list[Decoded]]:
    """For every line its decodings: the last is the best, the others are by single networks, for comparison.

    held : what is known of the places of letters, for every line; letters that must be where they are teach, too.
    """
    tell(0.0, "the letters")
    widths = page.widths(lines)
    held = held or [{}] * len(lines)
    decoded = [_decode_line(page, i, line, widths, page.networks, held[i]) for i, line in enumerate(lines)]
    if not adapting or len(lines) < _ADAPTATION.folds:
        return decoded
    best = [of_line[-1] for of_line in decoded]
    # networks that have not learned from the page agree less than those that have learned from the same letters
    single = [of_line[: len(page.networks)] for of_line in decoded]
    fold = folds(len(lines))
    rehearsed = rehearsal([line.text for line in lines], rng)
    known = _known_columns(page, lines, best, held, rng)
    for half in range(_ADAPTATION.folds):
        learning = narrow_reports(
            narrow_reports(tell, _FOUND, 1.0), half / _ADAPTATION.folds, (half + 1) / _ADAPTATION.folds
        )
        others = np.flatnonzero(fold != half).tolist()
        letters = [spans(lines[i], best[i]) for i in others]
        learned = page_columns([page.images[i] for i in others], letters, rng)
        networks = adapt_networks(page.networks, learned, rehearsed, rng, learning, known)
        for i in np.flatnonzero(fold == half).tolist():
            single[i] += _decode_line(page, i, lines[i], widths, networks, held[i])
    return single


# the networks learn nothing from the page, which is quicker, and fewer letters are found
by_segments_once = partial(by_segments, adapting=False)


def _decode_line(
    page: PageReader,
    number: int,
    line: TranscriptLine,
    widths: Mapping[str, float],
    networks: Sequence[RectifierNetwork],
    held: Mapping[int, Held],
) -> list[Decoded]:
    """A line of the page decoded from what each network reads alone, and last from what they read together."""
    return [decode(reading, line.letters, widths, held) for reading in page.readings(number, networks)]


def _known_columns(
    page: PageReader,
    lines: Sequence[TranscriptLine],
    decoded: Sequence[Decoded],
    held: Sequence[Mapping[int, Held]],
    rng: np.random.Generator,
) -> LabelledColumns | None:
    """Columns of the letters that must be where they are: the truth, from which both folds learn."""
    known = [[(line.letters[k], float(one.left[k]), float(one.right[k])) for k, hold in of_line.items()
              if np.isinf(hold.gain)] for line, one, of_line in zip(lines, decoded, held, strict=True)]  # fmt: skip
    with_known = [i for i, spans_ in enumerate(known) if spans_]
    if not with_known:
        return None
    columns = page_columns([page.images[i] for i in with_known], [known[i] for i in with_known], rng)
    of_letters = columns.states != state(SPACE)
    return LabelledColumns(columns.features[of_letters], columns.states[of_letters])


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


def folds(count: int) -> NDArray[np.intp]:
    """(count,) the fold that each line is dealt to: neighbouring lines are in different ones."""
    return np.arange(count) % _ADAPTATION.folds


def rehearsal(text: Sequence[str], rng: np.random.Generator) -> LabelledColumns:
    """Columns of synthetic lines by many writers, whose words are those of a transcript and random groups."""
    plain = ["".join(resemble(unit) for unit in graphemes(line)).replace(JUNK, "").strip() for line in text]
    sentences = [line for line in plain if line] or ["a"]
    lines = synthetic_lines(built_in_hands(), sentences, _ADAPTATION.rehearsed, rng)
    share = _ADAPTATION.share
    return join_columns([sampled_columns(line, rng, share * SHARE, share * SHARE_OF_SPACE) for line in lines])


def page_columns(images: Sequence[Image], spans: Sequence[Spans], rng: np.random.Generator) -> LabelledColumns:
    """Columns of the lines of a page, labelled by the letters found on them; every line is distorted several times."""
    import cv2

    parts = []
    for image, letters in zip(images, spans, strict=True):
        for _ in range(_ADAPTATION.copies):
            # a random breadth, height, slant and shift
            breadth, height = np.exp(rng.normal(0.0, [_ADAPTATION.breadth, _ADAPTATION.height])).tolist()
            shear, shift = rng.normal(0.0, [_ADAPTATION.shear, _ADAPTATION.shift * X_HEIGHT])
            matrix = np.array([[breadth, shear, -shear * ABOVE], [0, height, ABOVE - height * ABOVE + shift]])
            width = int(image.shape[1] * breadth) + 1
            distorted = np.asarray(cv2.warpAffine(image, matrix, (width, HEIGHT)), dtype=np.uint8)
            scaled = [(letter, left * breadth, right * breadth) for letter, left, right in letters]
            states = column_states(scaled, column_count(distorted))
            chosen = np.flatnonzero(rng.random(len(states)) < _ADAPTATION.share)
            parts.append(LabelledColumns(describe(distorted, chosen), states[chosen]))
    return join_columns(parts)


def adapt_networks(
    networks: Sequence[RectifierNetwork],
    page: LabelledColumns,
    rehearsed: LabelledColumns,
    rng: np.random.Generator,
    tell: Tell = silent,
    known: LabelledColumns | None = None,
) -> tuple[RectifierNetwork, ...]:
    """Copies of the networks, trained further on columns of the page, of known letters and of synthetic lines."""
    columns = join_columns([page, rehearsed] if known is None else [page, rehearsed, known])
    weights = np.ones(len(columns), dtype=np.float32)
    weights[: len(page)] = _ADAPTATION.page_weight
    weights[len(page) + len(rehearsed) :] = _ADAPTATION.known_weight
    weights /= weights.mean()
    copies = []
    for number, shipped in enumerate(networks):
        tell(number / len(networks), "learning from the page")
        epochs, rate = _ADAPTATION.epochs * (1 if known is None else 2), _ADAPTATION.rate
        copies.append(network.train_network(shipped, columns, epochs=epochs, rate=rate, rng=rng, importance=weights))
    return tuple(copies)
