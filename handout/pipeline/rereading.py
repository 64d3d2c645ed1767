"""What is written in a scanned hand is read before it is handed over; what reads as something else is written again.

Words are read by a reader that knows no author (`reading.pictures`), as the people who get them do: one that has
learnt the author's own words forgives what strangers misread.  A word's surprise is the negative logarithm of the
probability that its picture reads as its text.  How surprising words in a hand are is known from words that nobody
wrote, written in it; how surprising words with a wrong letter are, from the same pictures under texts that are wrong by
a letter.  Where a second reader is installed (`reading.second_reader`), its surprise is added.  What a word's surprise
says, and what the vetting says of its glyphs, make one probability that it is written wrong: a hand that is hard to
read is not doubted everywhere, and says less of what is wrong.

Source: own method (Bayes' rule with two normal distributions of one variance).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import islice, pairwise
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from handout.hand.author_reader import picture_of_ink, readable
from handout.hand.learnt import learnt
from handout.hand.places import graphemes
from handout.hand.scanned import ScannedHand
from handout.hand.vetting import vet
from handout.networks import one_thread
from handout.pipeline.results import Facts
from handout.reading import pictures, second_reader
from handout.reading.pictures import PictureReading, Verdict
from handout.reading.second_reader import SecondReader
from handout.reading.word_space import X_HEIGHT, drawn
from handout.values import Array, Drawing, Indices, Manuscript
from handout.writing.choosing import GlyphChooser, choices
from handout.writing.compose import Proofreader
from handout.writing.legibility import made_words
from handout.writing.pages import Sheet, Word
from handout.writing.scanned_words import InkGlyph, ScannedHandwriting, SetParagraph, SetUnit
from handout.writing.text import paragraphs_of

if TYPE_CHECKING:
    from handout.motion.styles.word_paths import ReadingOf, WordReading


@dataclass(frozen=True)
class RereadingSettings:
    """How what was written is read again.

    tries : times that a word is written again.  With eight and `again`, a reader of another make is surprised by words
        in eight hands 14 of 100 less than with five and .01; by eye 31 of 480 in four hands are misspelt, 49
        before.
    wrong : share of the words that come out misspelt: 3 to 8 of 100 in four hands from paper, counted by eye.
    again, told : probability of being wrong above which a word is written again, and told as doubtful after that.  Of
        720 words in six hands, read by eye, 25 are told, 11 of the 41 that are misspelt and 14 others.
    worst : surprise that a word counts with at most, a letter; nats: a wrong transcript says nothing of the author.
    right, misspelt, spread : usual surprise (`scale`) of words that are right, of wrong ones, and standard deviation;
        medians of sixteen pages that were read from paper (csafe, cvl).
    trust : words' worth of certainty that an author is like those.
    price : of a glyph that made a word doubtful, in its place: more than all other costs together.
    """

    tries: int = 8
    wrong: float = 0.05
    again: float = 0.002
    told: float = 0.01
    worst: float = 6.0
    right: float = 0.35
    misspelt: float = 1.77
    spread: float = 0.37
    trust: float = 8.0
    price: float = 100.0


SETTINGS = RereadingSettings()
_OF_TWO = 0.66, 2.44, 0.53  # right, misspelt and spread of what surprises two readers; of the same pages
_MADE = 100  # words that are written to know what surprise means in a hand; half a second
_TAKEN_FOR = 5  # other letters that are the likeliest in a letter's place: what is misspelt looks much like it
# tangents by which moved words are set upright, and pixels of word space, half the width of their lines: they have to
# read in all of these, since among many forms of a word there is always one that is read by chance
_SHOWN = ((-0.1, 0.7), (0.1, 1.1), (0.3, 0.9))
_UNREAD = 6.0  # nat: of a letter that is not seen at all
_TAIL = 0.16  # of a normal distribution lies so far out that it is a standard deviation off, on either side
VERSION = 7  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it


@dataclass(frozen=True, eq=False)
class StrangerReader:
    """A reader that knows no author, and what its surprise means in a hand.

    second : that reads beside it, where one is installed: surprises add up.
    right, misspelt, spread : of `scale`: the means for words that are right and wrong, and the standard deviation.
    """

    right: float
    misspelt: float
    spread: float
    second: SecondReader | None = None

    def read(self, shown: Sequence[Array]) -> list[tuple[PictureReading, ...]]:
        """What each reader sees in some pictures."""
        seen = [pictures.load().read_all(shown), *([self.second.read_all(shown)] if self.second else [])]
        return list(zip(*seen, strict=True))

    def wrong(self, word: str, surprise: float, before: float) -> float:
        """The probability that a word is not what it should be, after it was read; `before`: before that."""
        off = scale(word, surprise) - (self.right + self.misspelt) / 2
        odds = np.log(before / (1 - before)) + off * (self.misspelt - self.right) / self.spread**2
        return float(1 / (1 + np.exp(-np.clip(odds, -50, 50))))


def scale(word: str, surprise: float) -> float:
    """Surprise on a scale on which that of words of any length is spread about alike, and normally."""
    return float(np.log1p(surprise / np.sqrt(len(word))))


@dataclass(frozen=True)
class Doubt:
    """A word that reads as another after all.

    page, line : where it stands, from 1.
    letter : which of its letters is most probably at fault.
    probability : that it is written right all the same, reckoned so that an even chance is told; no frequency.
    """

    word: str
    page: int
    line: int
    reads_as: str
    letter: str
    probability: float

    def facts(self) -> Facts:
        """What ``--json`` prints of it."""
        return {
            "word": self.word,
            "page": self.page,
            "line": self.line,
            "reads_as": self.reads_as,
            "letter": self.letter,
            "probability": round(self.probability, 3),
        }


def surprises(
    readings: Sequence[tuple[PictureReading, ...]], words: Sequence[str], settings: RereadingSettings = SETTINGS
) -> Array:
    """(n,) nats, at least 0: how little each word's readings look like it, added up."""
    most = settings.worst * np.array([len(word) for word in words])
    each = [np.clip(-pictures.log_probabilities(seen, words), 0.0, most) for seen in zip(*readings, strict=True)]
    return np.asarray(sum(each, np.zeros(len(words))))


@lru_cache(maxsize=4)
def stranger_reader(hand: ScannedHand, settings: RereadingSettings = SETTINGS) -> StrangerReader:
    """The reader, with what its surprise means in a hand."""
    second = second_reader.load()
    name = f"surprise{' of two' if second else ''}, {settings}"
    figures = learnt(hand, name, VERSION, 3, lambda: _figures(hand, second, settings))
    right, misspelt, spread = figures.tolist()
    return StrangerReader(right, misspelt, spread, second)


def _figures(hand: ScannedHand, second: SecondReader | None, settings: RereadingSettings) -> Array:
    """(3,): what `StrangerReader` has of a hand's author, of words that are written in his hand as texts are.

    Words that he wrote would not do: their glyphs stand where they were learnt, and what is written anew reads worse.
    """
    words, rng = _made_words(hand), np.random.default_rng(1)
    reader = StrangerReader(0.0, 0.0, 1.0, second)
    pairs = list(zip(reader.read([picture for _, picture in words]), (text for text, _ in words), strict=True))
    others = [(reading, other) for reading, text in pairs for other in _misspelt(reading[0], text, rng)]
    count = len(pairs) if others else 0
    share = count / (count + settings.trust)
    means, spreads = (0.0, 0.0), (0.0, 0.0)
    if count:
        scales = [
            np.array(list(map(scale, texts, surprises(readings, texts, settings).tolist())))
            for readings, texts in (tuple(zip(*some, strict=True)) for some in (pairs, others))
        ]
        means, spreads = zip(*map(_normal, scales), strict=True)
    before = np.array(_OF_TWO if second else (settings.right, settings.misspelt, settings.spread))
    own = np.array([*means, float(np.hypot(*spreads)) / np.sqrt(2)])
    return np.asarray(share * own + (1 - share) * before)


def _made_words(hand: ScannedHand) -> list[tuple[str, Array]]:
    """Words that nobody wrote, and pictures of them, (HEIGHT, w) in word space, as they are written in a hand."""
    rng = np.random.default_rng(0)
    made = ["".join(hand.glyphs[n].letter for n in word) for word in islice(made_words(hand, rng), _MADE)]
    if not made:
        return []
    paragraph, words = write_words(hand, made, rng), list[tuple[str, Array]]()
    for unit in paragraph.units:
        numbers = np.array([glyph.number for glyph in unit.word.glyphs], dtype=np.intp)
        words.append(("".join(unit.word.spelt), picture_of_ink(hand, numbers, paragraph.ink(unit), hand.pitch)))
    return [(text, picture) for text, picture in words if readable(text)]


def write_words(hand: ScannedHand, words: Sequence[str], rng: np.random.Generator) -> SetParagraph:
    """Words of letters that a hand has, one at least, as they are written in it."""
    handwriting = ScannedHandwriting(hand, rng, 1.0)
    chooser = GlyphChooser(handwriting.stock, rng)
    (chosen,) = choices(paragraphs_of(" ".join(words), handwriting.repertoire), [chooser, chooser])
    return SetParagraph(handwriting, chooser, list(chosen))


def _misspelt(reading: PictureReading, text: str, rng: np.random.Generator) -> list[str]:
    """A text with a letter for which another is taken easily, with one more, and with one less, if they look unlike."""
    at = int(rng.integers(len(text)))
    new = str(rng.choice(list(reading.rivals(text, _TAKEN_FOR)[at])))
    others = (text[:at] + new + text[at + 1 :], text[:at] + new + text[at:], text[:at] + text[at + 1 :])
    return [other for other in others if other and not pictures.alike(other, text)]


def _normal(values: Array) -> tuple[float, float]:
    """Mean and standard deviation of most of the values: those far out are wrong transcripts, or letters not found."""
    low, middle, high = np.quantile(values, (_TAIL, 0.5, 1 - _TAIL))
    return float(middle), float(high - low) / 2


@dataclass(frozen=True, eq=False)
class ReadWord:
    """A word as it was written, and how it reads.

    numbers : (n,) int: its glyphs; at: place of its first letter in the text.
    picture : (HEIGHT, w) density in word space.
    wrong : the probability that it is not what it should be; verdict : how it reads where that is likely.
    worst : which letter of it is most probably wrong.
    """

    text: str
    at: int
    numbers: Indices
    picture: Array
    wrong: float = 0.0
    verdict: Verdict | None = None
    worst: int = 0


@dataclass(eq=False)
class Rereader:
    """Reads the paragraphs of one text when they are set, and has their doubtful words written again.

    hand : that it is set in.
    tries : see `RereadingSettings`.
    words : those that were written.
    """

    hand: ScannedHand
    own: StrangerReader
    tries: int
    settings: RereadingSettings
    words: list[ReadWord] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._known = _read_before(self.hand, self.own, self.settings)
        wrong = 1.0 - vet(self.hand).plainness
        # so many of an average word's letters are wrong, and those more often of which the vetting thinks less
        usual_length = 4.5
        self._doubt = wrong / max(float(wrong.mean()), 1e-6) * self.settings.wrong / usual_length

    @property
    def manner(self) -> Hashable:
        """See `compose.Proofreader`."""
        return self.own, self.tries, self.settings

    def __call__(self, paragraph: SetParagraph, again: Sequence[int] | None = None) -> None:
        """Read a paragraph; what is struck out, and what is of a formula, is not read.

        again : of one that was read, the words that are others since: they are read, and left as they are.
        """
        if again is not None:
            read = self._read(paragraph, [paragraph.units[k] for k in again])
            new = {word.at: word for word in read}
            self.words[:] = [new.get(word.at, word) for word in self.words]
            return
        places = [k for k, each in enumerate(paragraph.choices) if each.intended is None and each.formula is None]
        read = self._read(paragraph, [paragraph.units[k] for k in places])
        self.words += [self._mended(paragraph, k, word) for k, word in zip(places, read, strict=True)]

    def doubts(self, places: Mapping[int, tuple[int, int]]) -> dict[int, Doubt]:
        """The words that read as others after all, by their places; of these `places` has the page and the line."""
        told, found = self.settings.told, dict[int, Doubt]()
        for word in self.words:
            if word.verdict is not None and word.wrong >= told and word.at in places:
                right = (1.0 - word.wrong) * told  # so reckoned that an even chance is told
                right /= right + word.wrong * (1.0 - told)
                letter = graphemes(word.text)[word.worst]
                found[word.at] = Doubt(word.text, *places[word.at], word.verdict.reads_as, letter, right)
        return found

    def _mended(self, paragraph: SetParagraph, k: int, word: ReadWord) -> ReadWord:
        """A word as it reads best of the times that it was written."""
        best, prices = word, dict[tuple[int, int], float]()
        for _ in range(self.tries):
            if best.verdict is None:
                break
            prices[paragraph.choices[k].letters[word.worst].at, int(word.numbers[word.worst])] = self.settings.price
            attempt = paragraph.again(k, prices)
            (word,) = self._read(paragraph, [attempt.unit])
            if word.wrong < best.wrong:
                best = word
                paragraph.keep(attempt)
        return best

    def _written(self, paragraph: SetParagraph, unit: SetUnit) -> ReadWord:
        numbers = np.array([glyph.number for glyph in unit.word.glyphs], dtype=np.intp)
        picture = picture_of_ink(self.hand, numbers, paragraph.ink(unit), self.hand.pitch)
        return ReadWord("".join(unit.word.spelt), unit.word.at[0], numbers, picture)

    def _read(self, paragraph: SetParagraph, units: Sequence[SetUnit]) -> list[ReadWord]:
        """The words of a paragraph as they read; those that were read before, set alike, are not read again."""
        new = [unit for unit in units if unit.word not in self._known]
        words = [self._written(paragraph, unit) for unit in new]
        known = [word for word in words if readable(word.text)]
        readings = self.own.read([word.picture for word in known])
        surprising = surprises(readings, [word.text for word in known], self.settings)
        found = iter(zip(readings, surprising.tolist(), strict=True))
        for unit, word in zip(new, words, strict=True):
            self._known[unit.word] = self._judged(word, *next(found)) if readable(word.text) else word
        return [self._known[unit.word] for unit in units]

    def _judged(self, word: ReadWord, readings: tuple[PictureReading, ...], surprise: float) -> ReadWord:
        doubt = self._doubt[word.numbers]
        wrong = self.own.wrong(word.text, surprise, float(np.clip(doubt.sum(), 1e-3, 0.5)))
        for reading in readings if wrong >= self.settings.again else ():
            if (verdict := reading.verdict(word.text)).doubtful:
                read = np.array([max(each.probability, 1e-9) for each in readings[0].spans(word.text)])
                worst = int(np.argmax(np.log(doubt + 1e-9) - np.log(read)))
                return replace(word, wrong=wrong, verdict=verdict, worst=worst)
        return replace(word, wrong=wrong)


@lru_cache(maxsize=2)
def _read_before(
    hand: ScannedHand, own: StrangerReader, settings: RereadingSettings
) -> WeakKeyDictionary[Word[InkGlyph], ReadWord]:
    """Words of a hand that were read by a reader, as long as they are kept where they were set."""
    return WeakKeyDictionary()


@one_thread
def reread(
    compose: Callable[[Proofreader], Iterable[Sheet]],
    hand: ScannedHand,
    author: ScannedHand,
    tries: int | None = None,
    settings: RereadingSettings = SETTINGS,
) -> tuple[list[Sheet], list[Doubt], list[ReadWord]]:
    """The pages of a text, of which no word reads as another where the hand has glyphs for that; those that do; all.

    compose : sets the text, with a proofreader of its paragraphs.
    hand : that it is set in; author : the same without lent letters.
    tries : those of the settings, if None.
    """
    rereader = Rereader(hand, stranger_reader(author, settings), settings.tries if tries is None else tries, settings)
    sheets = list(compose(rereader))
    lines = {
        placed.at: (sheet.number, count)
        for sheet in sheets
        for count, line in enumerate(sheet.manuscript.lines, 1)
        for placed in line.placed
    }
    return sheets, list(rereader.doubts(lines).values()), rereader.words


def open_stroke_reader(page: Manuscript, words: Sequence[str]) -> ReadingOf:
    """What reads the strokes of a page's words by their numbers; None: of a word with letters that it does not know."""
    lines = {placed.word: line for line in page.lines for placed in line.placed}
    return lambda number: (
        partial(_read_strokes, words[number], lines[number].height_at, page.x_height)
        if readable(words[number])
        else None
    )


def open_drawing_reader(drawing: Drawing) -> tuple[ReadingOf, list[str]]:
    """The same of a drawing's words, as they read in it, and what they read as; "" and None: they cannot be read."""
    from handout.motion.styles.targets import USUAL_HEIGHT, letter_height
    from handout.motion.styles.turns import find_turns

    x_height = letter_height(drawing) / USUAL_HEIGHT
    found = dict[int, tuple[str, float]]()
    for number in {stroke.word for stroke in drawing.strokes if stroke.word >= 0}:
        strokes = [stroke.xy for stroke in drawing.strokes if stroke.word == number]
        feet = [float(xy[at, 1]) for xy in strokes for at, side in find_turns(xy, USUAL_HEIGHT * x_height) if side > 0]
        low = float(np.median(feet or [xy[:, 1].max() for xy in strokes]))
        seen, _ = _see_strokes(strokes, _level_at(low), x_height)
        text = max(seen, key=lambda view: view.probability).text
        found[number] = (text if readable(text) else "", low)

    def read(number: int) -> Callable[[Sequence[Array]], WordReading] | None:
        text, low = found.get(number, ("", 0.0))
        return partial(_read_strokes, text, _level_at(low), x_height) if text else None

    return read, [found.get(number, ("", 0.0))[0] for number in range(max(found, default=-1) + 1)]


def _level_at(y: float) -> Callable[[Array], Array]:
    """A level baseline."""
    return lambda x: np.full(len(x), y)


def _see_strokes(
    strokes: Sequence[Array], baseline: Callable[[Array], Array], x_height: float
) -> tuple[list[PictureReading], list[Array]]:
    """How a word's strokes (n, 2), mm, are seen upright and leaning, thin and thick; columns (n,) of all their places.

    baseline : y of it, mm, at some x.
    """
    xy = np.concatenate(strokes)
    up = baseline(xy[:, 0]) - xy[:, 1]
    edges = np.column_stack([np.arange(len(xy) - 1), np.arange(1, len(xy))])
    edges = np.delete(edges, np.cumsum([len(stroke) for stroke in strokes])[:-1] - 1, axis=0)
    scale = X_HEIGHT / x_height
    shown = [scale * np.column_stack([xy[:, 0] - slant * up, up]) for slant, _ in _SHOWN]
    pens = [np.full(len(xy), pen) for _, pen in _SHOWN]
    views = [drawn(places, pen, edges) for places, pen in zip(shown, pens, strict=True)]
    return pictures.load().read_all(views), [
        places[:, 0] - (places[:, 0] - pen).min() for places, pen in zip(shown, pens, strict=True)
    ]


def _read_strokes(
    word: str, baseline: Callable[[Array], Array], x_height: float, strokes: Sequence[Array]
) -> WordReading:
    """A word as its strokes read, in each view; parameters as of `_see_strokes`."""
    from handout.motion.styles.word_paths import WordReading

    nats, of = np.full((len(_SHOWN), len(word)), _UNREAD), np.zeros(0, dtype=np.intp)
    for row, view, columns in zip(nats, *_see_strokes(strokes, baseline, x_height), strict=True):
        try:
            letters = view.spans(word)
        except ValueError:  # too narrow
            of = of if len(of) else np.zeros(len(columns), dtype=np.intp)
            continue
        row[:] = [-np.log(max(letter.probability, np.exp(-_UNREAD))) for letter in letters]
        of = np.searchsorted([0.5 * (a.right + b.left) for a, b in pairwise(letters)], columns)
    return WordReading(nats.T, np.split(of, np.cumsum([len(stroke) for stroke in strokes])[:-1]))
