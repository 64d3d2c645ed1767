"""What was written in a scanned hand is read before it is handed over; what reads as something else is written again.

A word's surprise is the negative logarithm of the probability that its picture reads as its text.  How surprising an
author's own letters are, one by one, is learned from his own words: a hand that is hard to read is not doubted
everywhere, and one letter that he writes like another is not doubted wherever it comes.  A word is doubtful that is
more surprising beyond its letters than nearly all of his own, and that reads as another.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from handout.hand.learnt import learnt
from handout.hand.scanned import ScannedHand
from handout.hand.word_pictures import own_words
from handout.pipeline.results import Facts
from handout.reading import pictures
from handout.reading.made_words import MadeWord, made_words
from handout.reading.pictures import Reading, Verdict
from handout.values import Array
from handout.writing.choosing import Prices
from handout.writing.pages import Sheet


@dataclass(frozen=True)
class RereadingSettings:
    """How what was written is read again.

    tries : times that the text is set anew; each costs as much as setting it, and the third mends hardly a word more.
    own_words : of an author by which the others are judged; a quarter of a second.
    quantile : of them that are as surprising at most as what is not doubted.
    shrinkage : words' worth of certainty that all letters are as surprising as the usual one.
    worst : surprise that a word counts with at most, a letter; nats: a wrong transcript says nothing of its letters.
    price : of a glyph that made a word doubtful, in its place: more than all other costs together.
    """

    tries: int = 2
    own_words: int = 80
    quantile: float = 0.95
    shrinkage: float = 2.0
    worst: float = 6.0
    price: float = 100.0


SETTINGS = RereadingSettings()
_MAKERS = (
    *("pipeline/rereading.py", "hand/word_pictures.py", "hand/scanned.py", "alphabet.py"),
    *("reading/pictures.py", "reading/ctc.py", "reading/word_space.py", "reading/networks/pictures.npz"),
)


@dataclass(frozen=True, eq=False)
class Level:
    """How surprising an author's own words are.

    letters : of each of his letters, nats; usual : of any other.
    bound : surprise beyond that of its letters, over the square root of their number, above which a word is doubted.
    """

    letters: dict[str, float]
    usual: float
    bound: float

    def excess(self, word: str, surprise: float) -> float:
        """By how much a word is more surprising than its letters let expect, a letter's worth."""
        expected = sum(self.letters.get(letter, self.usual) for letter in word)
        return (surprise - expected) / float(np.sqrt(len(word)))


@dataclass(frozen=True)
class Doubt:
    """A word that reads as another after all.

    page, line : where it stands, from 1.
    probability : that it reads as itself.
    """

    word: str
    page: int
    line: int
    reads_as: str
    probability: float

    def facts(self) -> Facts:
        """What ``--json`` prints of it."""
        return {
            "word": self.word,
            "page": self.page,
            "line": self.line,
            "reads_as": self.reads_as,
            "probability": round(self.probability, 3),
        }


def surprise(reading: Reading, word: str, settings: RereadingSettings = SETTINGS) -> float:
    """Nats, at least 0."""
    return float(min(max(-reading.log_probability(word), 0.0), settings.worst * len(word)))


@lru_cache(maxsize=4)
def level(hand: ScannedHand, settings: RereadingSettings = SETTINGS) -> Level:
    """How surprising the words of a hand's author are, by ridge regression on the counts of their letters."""

    def figures() -> list[float]:
        own = _own_level(hand, settings)
        return [own.usual, own.bound, *(part for letter, more in own.letters.items() for part in (ord(letter), more))]

    usual, bound, *each = learnt(hand, f"level, {settings}", _MAKERS, None, figures).tolist()
    return Level({chr(int(letter)): more for letter, more in zip(each[::2], each[1::2], strict=False)}, usual, bound)


def _own_level(hand: ScannedHand, settings: RereadingSettings) -> Level:
    reader = pictures.load()
    words, seen = list[str](), list[float]()
    for word in own_words(hand):
        if readable(word.text):
            words.append(word.text)
            seen.append(surprise(reader.read(word.picture), word.text, settings))
        if len(words) == settings.own_words:
            break
    return _level(words, np.array(seen), settings)


def _level(words: Sequence[str], seen: Array, settings: RereadingSettings) -> Level:
    if not words:
        return Level({}, 0.0, settings.worst)
    letters = sorted(set("".join(words)))
    root = np.sqrt([len(word) for word in words])
    counts = np.array([[word.count(letter) for letter in letters] for word in words]) / root[:, None]
    usual = float(seen.sum() / (root**2).sum())
    normal = counts.T @ counts + settings.shrinkage * np.eye(len(letters))
    hat = counts @ np.linalg.solve(normal, counts.T)
    target = seen / root - usual * root
    more = np.linalg.solve(normal, counts.T @ target)
    # each word as if it had not been there
    left_out = (target - hat @ target) / (1 - np.diag(hat))
    bound = float(np.quantile(left_out, settings.quantile))
    return Level({letter: usual + float(m) for letter, m in zip(letters, more, strict=True)}, usual, max(bound, 0.0))


def readable(word: str) -> bool:
    """Whether the reader knows all letters of a word."""
    return bool(word) and pictures.known(word)


@dataclass(frozen=True, eq=False)
class _Trial:
    """A word as it was written once: its glyphs, by how much it surprises, and how it reads where that is too much."""

    word: MadeWord
    page: int
    excess: float
    verdict: Verdict | None

    @property
    def place(self) -> int:
        return int(self.word.at[0])


@dataclass(eq=False)
class _Rereader:
    """Reads the pages of one text, as often as it is set."""

    hand: ScannedHand
    own: Level
    settings: RereadingSettings
    seen: dict[tuple[str, bytes], tuple[float, Reading]] = field(default_factory=dict)

    def trials(self, sheets: Sequence[Sheet]) -> list[_Trial]:
        slants = [page.slant for page in self.hand.pages]
        words = [
            (number, word)
            for number, sheet in enumerate(sheets)
            for word in made_words(sheet.manuscript, slants)
            if readable(word.text)
        ]
        return [self._trial(number, word) for number, word in words]

    def _trial(self, page: int, word: MadeWord) -> _Trial:
        excess, reading = self._read(word)
        if excess <= self.own.bound:
            return _Trial(word, page, excess, None)
        verdict = reading.verdict(word.text)
        return _Trial(word, page, excess, verdict if verdict.doubtful else None)

    def _read(self, word: MadeWord) -> tuple[float, Reading]:
        key = word.text, word.picture.tobytes()
        if key not in self.seen:
            reading = pictures.load().read(word.picture)
            surprising = surprise(reading, word.text, self.settings)
            self.seen[key] = self.own.excess(word.text, surprising), reading
        return self.seen[key]

    def worst_letter(self, word: MadeWord) -> int:
        """Which letter of a word reads worst, beyond what is usual of it."""
        own = self.own
        letters = self._read(word)[1].spans(word.text)
        over = [-np.log(max(each.probability, 1e-9)) - own.letters.get(each.letter, own.usual) for each in letters]
        return int(np.argmax(over))


def reread(
    compose: Callable[[Prices], list[Sheet]],
    hand: ScannedHand,
    author: ScannedHand,
    tries: int | None = None,
    settings: RereadingSettings = SETTINGS,
) -> tuple[list[Sheet], list[Doubt]]:
    """The pages of a text, of which no word reads as another where the hand has glyphs for that; and the other words.

    compose : sets the text at some prices of glyphs, alike but for them.
    hand : that it is set in; author : the same without lent letters.
    tries : those of the settings, if None.
    """
    rereader = _Rereader(hand, level(author, settings), settings)
    prices: dict[tuple[int, int], float] = {}
    best: dict[int, _Trial] = {}
    tried: dict[int, list[_Trial]] = {}
    sheets = compose(Prices())
    trials = rereader.trials(sheets)
    for _ in range(settings.tries if tries is None else tries):
        doubtful = [trial for trial in trials if trial.verdict is not None]
        if not doubtful:
            break
        for trial in doubtful:
            tried.setdefault(trial.place, []).append(trial)
            k = rereader.worst_letter(trial.word)
            prices[int(trial.word.at[k]), int(trial.word.numbers[k])] = settings.price
        sheets = compose(Prices(prices))
        trials = rereader.trials(sheets)
    for trial in trials:
        before = min(tried.get(trial.place, [trial]), key=lambda each: each.excess)
        if trial.verdict and before.excess < trial.excess and len(before.word.at) == len(trial.word.at):
            best[trial.place] = before
    if best:
        sheets = compose(Prices(_back_to(best.values(), trials, prices, settings.price)))
        trials = rereader.trials(sheets)
    return sheets, [_doubt(trial) for trial in trials if trial.verdict is not None]


def _back_to(
    best: Iterable[_Trial], last: Iterable[_Trial], prices: Mapping[tuple[int, int], float], price: float
) -> dict[tuple[int, int], float]:
    """Prices at which some words are written as they were best, not as they were last."""
    changed = dict(prices)
    now = {trial.place: trial for trial in last}
    for trial in best:
        for at, was, number in zip(
            trial.word.at.tolist(), trial.word.numbers.tolist(), now[trial.place].word.numbers.tolist(), strict=True
        ):
            changed.pop((at, was), None)
            if was != number:
                changed[at, number] = price
    return changed


def _doubt(trial: _Trial) -> Doubt:
    assert trial.verdict is not None
    word, verdict = trial.word, trial.verdict
    return Doubt(word.text, trial.page + 1, word.line + 1, verdict.reads_as, verdict.probability)
