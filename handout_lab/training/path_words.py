"""Words as pens write them, for training the reader of pen paths: drawn hands with strange habits, and line fonts.

Every word is pen-down pieces in the order of writing, x-heights, y up from the baseline.  The hands are the built-in
ones and single-line SVG fonts that are given; forms, slant, size, joins, motor engine, haste and the place of delayed
strokes vary far more than one writer's.  Part of the words are letters at random, so that nothing is learned of a
language but what single letters look like.
"""

from __future__ import annotations

import string
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from handout.hand.drawn import Hand
from handout.motion import ENGINES
from handout.tagging.synthetic_lines import WriterHabits, bend_space, random_habits, random_writer, texts, write_text
from handout.values import Array, Indices
from handout.writing.variation import warp

_WORDS = 16  # of one writer
_RANDOM = 0.4  # of the words are letters at random
_FONTS = 0.35  # of the writers write a font
_STRIDE = 0.08  # x-heights between points of a roughened piece
_TOUCHING = 0.12  # x-heights between a letter's end and the next one's start that a writer of a font may join


@dataclass(frozen=True)
class PathNoise:
    """How much the words of training are bent beyond what hands do; x-heights, tangents and shares.

    slant, turn : standard deviation of the tangent and of the direction of the line.
    size, rise : of the x-height that the reader is told, relative, and of the baseline.
    breadth, tall : of the logarithms of the breadth, and of the lengths of what stands above and below small letters.
    warp : greatest, of smooth fields that bend the word, with waves of the lengths `waves`: with a few hands to learn
        from, this is what stands for people's other forms.
    blur : greatest, of the points' moving average, which rounds corners as haste and thin ink do.
    jitter : greatest, of each point.
    cut : share of pieces that are cut in two by a lift.
    flat_bar : share of short flat pieces that go from right to left.
    """

    slant: float = 0.3
    turn: float = 0.03
    size: float = 0.13
    rise: float = 0.08
    breadth: float = 0.2
    tall: float = 0.2
    warp: float = 0.16
    waves: tuple[float, float] = (0.9, 3.5)
    blur: float = 0.16
    jitter: float = 0.02
    cut: float = 0.04
    flat_bar: float = 0.08


NOISE = PathNoise()


@dataclass(frozen=True, eq=False)
class PathWord:
    """What is written, its pieces (n, 2), the letter of the word that each point writes, and the hand."""

    text: str
    strokes: tuple[Array, ...]
    of: tuple[Indices, ...]
    source: str


def path_words(
    hands: Sequence[Hand], fonts: Sequence[Hand], sentences: Sequence[str], rng: np.random.Generator
) -> Iterator[PathWord]:
    """Words without end; every dozen are by another writer, of the fonts alone where there are no hands."""
    source = texts(sentences, rng)
    while True:
        text = " ".join(_random_word(rng) if rng.random() < _RANDOM else word for word in next(source).split()[:_WORDS])
        by_font = bool(fonts) and (not hands or rng.random() < _FONTS)
        hand = fonts[int(rng.integers(len(fonts)))] if by_font else random_writer(hands, rng)
        text = "".join(c for c in text if c == " " or c in hand.glyphs) if by_font else text
        name = hand.name
        hand = hand.with_haste(float(rng.uniform(-0.8, 1.0)))
        hand = replace(hand, delayed_after=("word", "letter")[int(rng.random() < 0.4)], slant=hand.slant)
        if not text.strip():
            continue
        habits = random_habits(rng)
        habits = replace(
            habits,
            # script fonts meet only as they were set
            tight=0.0 if by_font and rng.random() < 0.5 else habits.tight,
            ascender=float(np.clip(habits.ascender * np.exp(rng.normal(0, 0.1)), 0.55, 1.6)),
            breadth=habits.breadth * float(np.exp(rng.normal(0, 0.12))),
        )
        engine = ENGINES[int(rng.integers(len(ENGINES)))]
        for written, strokes, of in habitual_strokes(text, hand, habits, rng, engine):
            word = PathWord(written, tuple(strokes), tuple(of), name)
            yield _touching_joined(word) if by_font and rng.random() < 0.7 else word


def habitual_strokes(
    text: str, hand: Hand, habits: WriterHabits, rng: np.random.Generator, engine: str = "optimal-control"
) -> Iterator[tuple[str, list[Array], list[Indices]]]:
    """The words of `text`: the strokes of each in the order of writing (upright, x-heights, y up), and of every sample
    the letter of the word that it writes."""
    for line, strokes, letters in zip(*write_text(text, hand, habits, rng, engine), strict=True):
        if not strokes:
            continue
        paths = [line.upright(stroke.xy) for stroke in strokes]
        bent = np.split(bend_space(np.vstack(paths), habits, rng), np.cumsum([len(path) for path in paths])[:-1])
        for word, placed in groupby(line.line.placed, key=lambda unit: unit.word):
            at = {unit.at: unit.glyph.letter for unit in placed}
            own = [k for k, stroke in enumerate(strokes) if stroke.word == word]
            numbers = np.array(sorted(at))
            of = [np.searchsorted(numbers, letters[k]) for k in own]
            yield "".join(at.values()), [bent[k] for k in own], of


def _random_word(rng: np.random.Generator) -> str:
    """One to eight letters, each as likely as any other; now and then a capital first, a digit or a mark last."""
    letters = rng.choice(list(string.ascii_lowercase), int(rng.integers(1, 9)))
    word = "".join(letters)
    if rng.random() < 0.12:
        word = str(rng.choice(list(string.ascii_uppercase))) + word[1:]
    return word


def _touching_joined(word: PathWord) -> PathWord:
    """The word with pieces of which one ends where the next begins made one."""
    strokes, letters = list[Array](), list[Indices]()
    for xy, of in zip(word.strokes, word.of, strict=True):
        if strokes and float(np.hypot(*(strokes[-1][-1] - xy[0]))) < _TOUCHING:
            strokes[-1], letters[-1] = np.vstack([strokes[-1], xy]), np.concatenate([letters[-1], of])
        else:
            strokes.append(xy)
            letters.append(of)
    return replace(word, strokes=tuple(strokes), of=tuple(letters))


def varied(word: PathWord, rng: np.random.Generator, noise: PathNoise = NOISE) -> PathWord:
    """The same word with another slant, size, line, roughness and other lifts."""
    turn, lean = rng.normal(0.0, noise.turn), rng.normal(0.1, noise.slant)
    size = float(np.exp(rng.normal(0.0, noise.size)))
    matrix = size * np.array([[1.0, np.tan(turn)], [lean, 1.0]])
    rise, blur, jitter = rng.normal(0.0, noise.rise), rng.uniform(0, noise.blur), rng.uniform(0, noise.jitter)
    strokes, letters = list[Array](), list[Indices]()
    for stroke, own in zip(_bent(word.strokes, rng, noise), word.of, strict=True):
        xy, of = _rough(stroke @ matrix + (0.0, rise), own, blur, jitter, rng)
        wide, high = np.ptp(xy, axis=0)
        if len(xy) > 2 and high < 0.4 * wide < 0.6 and rng.random() < noise.flat_bar:
            xy, of = xy[::-1], of[::-1]
        at = int(rng.integers(4, len(xy) - 4)) if len(xy) > 12 and rng.random() < noise.cut else 0
        strokes += [xy[: at + 1], xy[at:]] if at else [xy]
        letters += [of[: at + 1], of[at:]] if at else [of]
    return replace(word, strokes=tuple(strokes), of=tuple(letters))


def _bent(strokes: Sequence[Array], rng: np.random.Generator, noise: PathNoise) -> list[Array]:
    """The pieces with other proportions, bent by a smooth field."""
    xy = np.vstack(strokes)
    breadth, above, below = np.exp(rng.normal(0.0, (noise.breadth, noise.tall, noise.tall)))
    x, y = xy[:, 0] * breadth, xy[:, 1]
    xy = np.column_stack([x, np.where(y > 1, 1 + (y - 1) * above, np.where(y < 0, y * below, y))])
    xy = xy + warp(xy, rng, float(rng.uniform(0.0, noise.warp)), *noise.waves)
    return np.split(xy, np.cumsum([len(stroke) for stroke in strokes])[:-1])


def _rough(xy: Array, of: Indices, blur: float, jitter: float, rng: np.random.Generator) -> tuple[Array, Indices]:
    """Points 0.08 x-heights apart, blurred along the path and jittered, and their letters."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    if way[-1] < _STRIDE:
        return xy, of
    at = np.linspace(0.0, float(way[-1]), max(3, int(way[-1] / _STRIDE) + 1))
    of = of[np.minimum(np.searchsorted(way, at), len(of) - 1)]
    xy = np.column_stack([np.interp(at, way, xy[:, 0]), np.interp(at, way, xy[:, 1])])
    width = round(2 * blur / _STRIDE)
    if width > 1 and len(xy) > 3 * width:
        ends = xy[[0, -1]]
        padded = np.pad(xy, ((width, width), (0, 0)), mode="edge")
        kernel = np.ones(2 * width + 1) / (2 * width + 1)
        xy = np.column_stack([np.convolve(padded[:, k], kernel, "valid") for k in (0, 1)])
        xy[[0, -1]] = ends
    return np.asarray(xy + rng.normal(0.0, jitter, (len(xy), 2))), of
