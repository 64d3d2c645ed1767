"""Reads words as pictures: what stands there, letter by letter, and how likely it is what it should be.

A small convolutional network gives the posteriors of letters for every second column of word space; `ctc` makes texts
of them.  It sees a letter and its neighbours and knows no words, so that "loocs" is read as that.  Letters
that nobody tells apart without the word around them (l, I and 1; s and S) count as one where a text is judged.

Source: own method; the network learned from drawn hands, fonts, and lines of 63 people (`training.picture_reader`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from hashlib import blake2b
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.alphabet import JUNK, fold
from handout.errors import InputError
from handout.networks import log_softmax, one_thread
from handout.reading import ctc
from handout.reading.word_space import MARGIN, normalised
from handout.values import Array, Indices

Floats = NDArray[np.float32]
NETWORK = Path(__file__).parent / "networks" / "pictures.npz"
STEP = 2  # columns of word space a step of the network
# told apart by nothing but size, if at all; the first of each stands for them
ALIKE = ("cC", "kK", "oO0", "pP", "sS", "uU", "vV", "wW", "xX", "zZ", "lI1|", "-–", "'`")
_TOGETHER = 32  # pictures that go through the network at once, by the memory that they take
_SEEN = 2000  # pictures of which features are kept: twice the letters of a full page, 40 MB
_CERTAIN = 0.5  # a text with that probability is the likeliest: no search is needed
_BEAM = 6  # prefixes kept where other texts are looked for: more change no verdict in 500 words


@dataclass(frozen=True)
class ReadLetter:
    """One letter of a text in its place in a picture.

    left, right : where it is seen, columns of word space.
    probability : that this letter stands there, no other and none more beside it, the rest of the text being right.
    reads_as : the likeliest letter in its place; "" for none at all.
    """

    letter: str
    left: float
    right: float
    probability: float
    reads_as: str


@dataclass(frozen=True)
class Verdict:
    """Whether a picture reads as a text.

    probability : that it does, letters alike counted as one.
    reads_as : the likeliest text; `text` itself where nothing is likelier.
    other : its probability, or that of `text`.
    """

    text: str
    probability: float
    reads_as: str
    other: float

    @property
    def doubtful(self) -> bool:
        """Whether a reader would rather see another text."""
        return self.reads_as != self.text


@dataclass(frozen=True, eq=False)
class PictureReading:
    """A picture that was looked at.

    logits : (steps, classes) of the network, every `STEP` columns; class 0 is no letter.
    letters : of the classes from 1 on.
    temperature : by which the logits are divided, so that probabilities mean what they say.
    """

    logits: Array
    letters: str
    temperature: float

    @cached_property
    def log_posteriors(self) -> Array:
        """(steps, classes), natural logarithms."""
        return log_softmax(np.asarray(self.logits, dtype=np.float64) / self.temperature)

    @cached_property
    def grouped(self) -> tuple[Array, str]:
        """Log posteriors of groups of letters that look alike, and the letter that stands for each."""
        groups, order, starts = group_alike(self.letters)
        return np.logaddexp.reduceat(self.log_posteriors[:, order], starts, axis=1), groups

    @cached_property
    def best(self) -> tuple[str, float]:
        """The likeliest text and its probability, of letters as they look."""
        found = ctc.beams(self.log_posteriors, _BEAM)
        return _spell(found[0].labels, self.letters), float(np.exp(found[0].log_probability))

    @property
    def text(self) -> str:
        """The likeliest text."""
        return self.best[0]

    @property
    def probability(self) -> float:
        """Of that text."""
        return self.best[1]

    def log_probability(self, text: str) -> float:
        """Natural logarithm of the probability that the picture reads as `text`, letters alike counted as one."""
        return float(log_probabilities([self], [text])[0])

    def labels(self, text: str) -> tuple[int, ...]:
        """Groups of a text's letters. Raises ValueError: one of them is no letter that is read."""
        return _labels(text, self.grouped[1])

    def verdict(self, text: str) -> Verdict:
        """Whether it reads as `text`, and as what else."""
        logs, groups = self.grouped
        labels = _labels(text, groups)
        probability = float(np.exp(ctc.log_probability(logs, labels)))
        if probability >= _CERTAIN:
            return Verdict(text, probability, text, probability)
        best = ctc.beams(logs, _BEAM)[0]
        other = float(np.exp(best.log_probability))
        if best.labels == labels or other <= probability:
            return Verdict(text, probability, text, probability)
        # a letter that looks like that of `text` in its place is written as there
        seen, wanted = _spell(best.labels, groups), "".join(_stand_ins("".join(map(fold, text))))
        same = len(seen) == len(wanted)
        seen = "".join(text[k] if same and letter == wanted[k] else letter for k, letter in enumerate(seen))
        return Verdict(text, probability, seen, other)

    def rivals(self, text: str, count: int) -> list[str]:
        """Of each letter of `text` the likeliest others in its place."""
        logs, groups = self.grouped
        labels = _labels(text, groups)
        each = ctc.edits(logs, labels)[1::2]
        each[:, ctc.BLANK] = each[np.arange(len(labels)), labels] = -np.inf
        return ["".join(groups[label - 1] for label in row) for row in np.argsort(-each, axis=1)[:, :count].tolist()]

    def spans(self, text: str) -> tuple[ReadLetter, ...]:
        """Every letter of `text` with its place, and what is seen there.

        Raises ValueError: the picture is too narrow for the text.
        """
        logs, groups = self.grouped
        labels = _labels(text, groups)
        borders = ctc.alignment(logs, labels) * STEP - MARGIN
        shares, names = letter_shares([self], [labels])[0], ["", *groups]
        return tuple(
            ReadLetter(
                letter,
                float(left),
                float(right),
                float(share[label]),
                letter if share.argmax() == label else names[int(share.argmax())],
            )
            for letter, (left, right), share, label in zip(text, borders, shares, labels, strict=True)
        )


@dataclass(frozen=True, eq=False)
class Reader:
    """A network that reads pictures.

    stem : weights (size · size · in, out) and biases of the layers over rows and columns; one that gives as many
        channels as it is given is added to those.
    columns : the same of those over columns: the first and the last over one alone, the others over three.
    dilations : of those between.
    letters, temperature : as `PictureReading` has them.
    seen : features of the pictures that were read last, by digests of these: a letter is read again when it is vetted.
    """

    stem: tuple[tuple[Floats, Floats], ...]
    columns: tuple[tuple[Floats, Floats], ...]
    dilations: tuple[int, ...]
    letters: str
    temperature: float
    seen: dict[bytes, Floats] = field(default_factory=dict, repr=False)

    def read(self, picture: Array) -> PictureReading:
        """What stands in a density picture (HEIGHT, w) in word space, `MARGIN` columns of paper added at either end.

        Raises ValueError: the picture has another height.
        """
        return self.reading(self.features(picture))

    @one_thread
    def read_all(self, pictures: Sequence[Array]) -> list[PictureReading]:
        """`read` of some pictures, which takes less time than one by one."""
        return [self.reading(features) for features in self.features_of(pictures)]

    @one_thread
    def reading(self, features: Floats) -> PictureReading:
        """What is read from the features of a picture's steps."""
        weight, bias = self.columns[-1]
        return PictureReading((features @ weight + bias).astype(np.float64), self.letters, self.temperature)

    def labels(self, text: str) -> tuple[int, ...]:
        """Classes of a text's letters, each told from those that look alike."""
        return tuple(self.letters.index(fold(letter)) + 1 for letter in text)

    def with_last_layer(self, weights: Array) -> Reader:
        """The same network with other weights in the last layer, its biases below them, for a temperature of 1."""
        last = weights.reshape(-1, len(self.letters) + 1).astype(np.float32)
        return replace(self, columns=(*self.columns[:-1], (last[:-1], last[-1])), temperature=1.0)

    def features(self, picture: Array) -> Floats:
        """(steps, channels): what the last layer is given of a picture; raises as `read`."""
        return self.features_of([picture])[0]

    @one_thread
    def features_of(self, pictures: Sequence[Array]) -> list[Floats]:
        """`features` of some pictures: those of one width go through the network together."""
        ready = [normalised(picture) for picture in pictures]
        keys = [blake2b(picture.tobytes(), digest_size=16).digest() for picture in ready]
        found = {key: self.seen[key] for key in keys if key in self.seen}
        new = {key: picture for key, picture in zip(keys, ready, strict=True) if key not in found}
        for width in {picture.shape[1] for picture in new.values()}:
            alike = [key for key, picture in new.items() if picture.shape[1] == width]
            for begin in range(0, len(alike), _TOGETHER):
                some = alike[begin : begin + _TOGETHER]
                found |= zip(some, self._features(np.stack([new[key] for key in some])), strict=True)
        if len(self.seen) > _SEEN:
            self.seen.clear()
        self.seen.update(found)
        return [found[key] for key in keys]

    def _features(self, pictures: Floats) -> Floats:
        """(n, steps, channels) of pictures (n, HEIGHT, w).

        Each is a matrix product of its own, so that the last bits of a word do not depend on what is read with it.
        """
        x = np.pad(pictures, ((0, 0), (0, 0), (MARGIN, MARGIN)))[..., None]
        for number, (weight, bias) in enumerate(self.stem):
            if x.shape[3] == len(bias):
                x = x + _over_rows(x, weight, bias, (1, 1))
            else:
                x = _over_rows(x, weight, bias, (2, 2) if number == 0 else (2, 1))
        count, _, steps, _ = x.shape
        first, *between, _ = self.columns
        y = np.maximum(x.transpose(0, 2, 3, 1).reshape(count, steps, -1) @ first[0] + first[1], 0)
        for (weight, bias), dilation in zip(between, self.dilations, strict=True):
            padded = np.pad(y, ((0, 0), (dilation, dilation), (0, 0)))
            beside = np.concatenate([padded[:, k * dilation : k * dilation + steps] for k in range(3)], axis=2)
            y = y + np.maximum(beside @ weight + bias, 0)
        return np.asarray(y, dtype=np.float32)


def _over_rows(x: Floats, weight: Floats, bias: Floats, stride: tuple[int, int]) -> Floats:
    """(n, rows, columns, in) → (n, rows, columns, out): a convolution of odd size with paper around, negatives cut
    off."""
    size, (down, along) = math.isqrt(len(weight) // x.shape[3]), stride
    rows, columns = -(-x.shape[1] // down), -(-x.shape[2] // along)
    padded = np.pad(x, ((0, 0), (size // 2, size // 2), (size // 2, size // 2), (0, 0)))
    seen = np.concatenate(
        [
            padded[:, i : i + (rows - 1) * down + 1 : down, j : j + (columns - 1) * along + 1 : along]
            for i in range(size)
            for j in range(size)
        ],
        axis=3,
    )
    out = seen.reshape(len(x), rows * columns, -1) @ weight + bias
    return np.asarray(np.maximum(out, 0).reshape(len(x), rows, columns, len(bias)))


@lru_cache(maxsize=4)
def group_alike(letters: str) -> tuple[str, Indices, Indices]:
    """The letter that stands for each group of letters that look alike; classes by groups, and where each begins."""
    names = _stand_ins(letters)
    groups = "".join(dict.fromkeys(names))
    of = np.array([0] + [groups.index(name) + 1 for name in names])
    order = np.argsort(of, kind="stable")
    return groups, order, np.searchsorted(of[order], np.arange(len(groups) + 1))


def _stand_ins(letters: str) -> list[str]:
    """The letter that stands for each."""
    stands_for = {letter: group[0] for group in ALIKE for letter in group}
    return [stands_for.get(letter, letter) for letter in letters]


def alike(one: str, other: str) -> bool:
    """Whether two texts look the same, letter by letter."""
    return _stand_ins("".join(map(fold, one))) == _stand_ins("".join(map(fold, other)))


def log_probabilities(readings: Sequence[PictureReading], texts: Sequence[str]) -> Array:
    """(n,) `PictureReading.log_probability` of some readings, all at once."""
    labels = [reading.labels(text) for reading, text in zip(readings, texts, strict=True)]
    return ctc.log_probabilities([reading.grouped[0] for reading in readings], labels)


def letter_shares(readings: Sequence[PictureReading], labels: Sequence[Sequence[int]]) -> list[Array]:
    """Of each reading (letters, groups + 1): how probably each group, or none, stands in the place of each letter.

    labels : of the text of each; nan where its picture is too narrow for that.
    """
    found = list[Array]()
    for edits, own in zip(ctc.edits_of([reading.grouped[0] for reading in readings], labels), labels, strict=True):
        each, more = edits[1::2], np.logaddexp.reduce(edits[::2], axis=1)
        if len(own) and np.isneginf(each[0, own[0]]):
            found.append(np.full(each.shape, np.nan))
            continue
        # a letter too many is either neighbour's as likely
        beside = np.logaddexp(more[:-1], more[1:]) + np.log(0.5)
        found.append(np.exp(each - np.logaddexp(np.logaddexp.reduce(each, axis=1), beside)[:, None]))
    return found


def known(text: str) -> bool:
    """Whether every character of a text is a letter that is read, or looks like one."""
    return JUNK not in map(fold, text)


def _labels(text: str, groups: str) -> tuple[int, ...]:
    """Classes of a text's letters; a character that the network does not know is read as what it looks like.

    Raises ValueError: it looks like none.
    """
    seen = _stand_ins("".join(map(fold, text)))
    if JUNK in seen:
        raise ValueError(f"{text[seen.index(JUNK)]!r} is no letter that is read")
    return tuple(groups.index(letter) + 1 for letter in seen)


def _spell(labels: tuple[int, ...], letters: str) -> str:
    return "".join(letters[label - 1] for label in labels)


@lru_cache(maxsize=2)
def load(path: Path = NETWORK) -> Reader:
    """The reader that ships, or one that was trained. Raises InputError: the file is missing or is none."""
    try:
        with np.load(path) as file:
            count = sum(name.startswith("w") for name in file.files)
            layers = [(file[f"w{k}"], file[f"b{k}"].astype(np.float32)) for k in range(count)]
            dilations, letters = tuple(map(int, file["dilations"])), str(file["alphabet"])
            temperature = float(file["temperature"])
    except (OSError, KeyError, ValueError) as error:
        raise InputError(f"{path} is no reader of pictures: {error}.") from error
    stem = tuple((_matrix(weight), bias) for weight, bias in layers if weight.ndim == 4)
    columns = tuple((_matrix(weight), bias) for weight, bias in layers if weight.ndim == 3)
    return Reader(stem, columns, dilations, letters, temperature)


def _matrix(weight: NDArray[np.float16]) -> Floats:
    """(size · in, out) float32 of weights (out, in, *size), as they are multiplied with."""
    return np.ascontiguousarray(np.moveaxis(weight, (0, 1), (-1, -2)).reshape(-1, len(weight)), dtype=np.float32)
