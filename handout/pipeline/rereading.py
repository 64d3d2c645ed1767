"""What is written in a scanned hand is read before it is handed over; what a stranger misreads is written again.

Words are read by a reader that knows no author (`reading.pictures`), as the people who get them do: one that has
learnt the author's own words forgives what strangers misread.  Where a second reader is installed
(`reading.second_reader`), it reads beside it.  What they see of each letter in its place, and how often its glyph and
its letter are misread in other words of this hand (`writing.legibility`), make one probability that a stranger misreads
it (`reading.misreading`): a word is written again where that is high, and told, with the letter, where it stays so.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from handout.hand.author_reader import picture_of_ink, readable
from handout.hand.places import graphemes
from handout.hand.scanned import ScannedHand
from handout.networks import one_thread
from handout.pipeline.results import Facts
from handout.reading import misreading, pictures, second_reader
from handout.reading.misreading import MisreadWeights, shares_seen
from handout.reading.pictures import PictureReading, Reader
from handout.reading.second_reader import SecondReader
from handout.reading.word_space import X_HEIGHT, drawn
from handout.values import Array, Drawing, Indices, Manuscript
from handout.writing.choosing import GlyphChooser, choices
from handout.writing.compose import Proofreader
from handout.writing.legibility import misread_shares
from handout.writing.pages import Sheet
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
    price : of a glyph that made a word doubtful, in its place: more than all other costs together.
    """

    tries: int = 8
    price: float = 100.0


SETTINGS = RereadingSettings()
# tangents by which moved words are set upright, and pixels of word space, half the width of their lines: they have to
# read in all of these, since among many forms of a word there is always one that is read by chance
_SHOWN = ((-0.1, 0.7), (0.1, 1.1), (0.3, 0.9))
_MOST_KNOWN = 500  # words that were read last: 20 MB
_Look: TypeAlias = tuple[tuple[InkGlyph, ...], str]  # how a word is set, and its letters
_UNREAD = 6.0  # nat: of a letter that is not seen at all


def _open_readers() -> list[Reader | SecondReader]:
    second = second_reader.load()
    return [pictures.load(), *([second] if second else [])]


def read(shown: Sequence[Array]) -> list[tuple[PictureReading, ...]]:
    """What each reader that is there sees in some pictures, in word space."""
    return list(zip(*(reader.read_all(shown) for reader in _open_readers()), strict=True))


@dataclass(frozen=True)
class Doubt:
    """A word that strangers may misread after all.

    page, line : where it stands, from 1.
    reads_as : what it looks most like but itself.
    letter : which of its letters is most probably at fault.
    probability : that it is read right all the same.
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


def write_words(hand: ScannedHand, words: Sequence[str], rng: np.random.Generator) -> SetParagraph:
    """Words of letters that a hand has, one at least, as they are written in it."""
    handwriting = ScannedHandwriting(hand, rng, 1.0)
    chooser = GlyphChooser(handwriting.stock, rng)
    (chosen,) = choices(paragraphs_of(" ".join(words), handwriting.repertoire), [chooser, chooser])
    return SetParagraph(handwriting, chooser, list(chosen))


@dataclass(frozen=True, eq=False)
class ReadWord:
    """A word as it was written, and how it reads.

    numbers : (n,) int: its glyphs; at: place of its first letter in the text.
    picture : (HEIGHT, w) density in word space.
    misread : (n,) how probably strangers take each letter for another, 0 for what is not read; of a word that they
        hardly misread, whatever readers saw who did not look, at most that.
    readings : of each reader, where it may be misread.
    """

    text: str
    at: int
    numbers: Indices
    picture: Array
    misread: Array
    readings: tuple[PictureReading, ...] = ()

    @cached_property
    def wrong(self) -> float:
        """The probability that strangers misread it."""
        return float(1.0 - np.prod(1.0 - self.misread))

    @property
    def worst(self) -> int:
        """Which letter they most probably do."""
        return int(np.argmax(self.misread))

    def likeness(self) -> str:
        """What it looks most like but itself."""
        for reading in self.readings:
            if (verdict := reading.verdict(self.text)).doubtful:
                return verdict.reads_as
        rival = self.readings[0].rivals(self.text, 1)[self.worst]
        return self.text[: self.worst] + rival + self.text[self.worst + 1 :]


@dataclass(eq=False)
class Rereader:
    """Reads the paragraphs of one text when they are set, and has those words written again that strangers may misread.

    hand : that it is set in; author : the same without lent letters.
    tries : see `RereadingSettings`.
    words : those that were written.
    """

    hand: ScannedHand
    author: ScannedHand
    tries: int
    settings: RereadingSettings = SETTINGS
    words: list[ReadWord] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._weights = misreading.load(2 if second_reader.load() else 1)
        self._known = _read_before(self.hand, self._weights)
        of_glyph, of_letter = misread_shares(self.author)
        usual = float(of_glyph.mean()) if len(of_glyph) else 0.0
        lent = [usual] * (len(self.hand.glyphs) - len(of_glyph))  # of those nothing is known
        self._before = self._weights.before(np.append(of_glyph, lent), np.append(of_letter, lent))

    @property
    def manner(self) -> Hashable:
        return self._weights, self.tries, self.settings

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
        found = dict[int, Doubt]()
        for word in self.words:
            if word.wrong >= self._weights.told and word.at in places:
                letter = graphemes(word.text)[word.worst]
                found[word.at] = Doubt(word.text, *places[word.at], word.likeness(), letter, 1.0 - word.wrong)
        return found

    def _mended(self, paragraph: SetParagraph, k: int, word: ReadWord) -> ReadWord:
        """A word as it reads best of the times that it was written."""
        best, prices = word, dict[tuple[int, int], float]()
        for _ in range(self.tries):
            if best.wrong < self._weights.again:
                break
            prices[paragraph.choices[k].letters[word.worst].at, int(word.numbers[word.worst])] = self.settings.price
            attempt = paragraph.again(k, prices)
            (word,) = self._read(paragraph, [attempt.unit])
            if word.wrong < best.wrong:
                best = word
                paragraph.keep(attempt)
        return best

    def _read(self, paragraph: SetParagraph, units: Sequence[SetUnit]) -> list[ReadWord]:
        """The words of a paragraph as they read; those that were read before, set alike, are not read again."""
        looks, new = [(unit.word.glyphs, "".join(unit.word.spelt)) for unit in units], dict[_Look, ReadWord]()
        for look, unit in zip(looks, units, strict=True):
            if look not in self._known:
                numbers = np.array([glyph.number for glyph in unit.word.glyphs], dtype=np.intp)
                picture = picture_of_ink(self.hand, numbers, paragraph.ink(unit), self.hand.pitch)
                new[look] = ReadWord(look[1], unit.word.at[0], numbers, picture, np.zeros(len(numbers)))
        judged = iter(self._judge([word for word in new.values() if readable(word.text)]))
        self._known |= {look: next(judged) if readable(word.text) else word for look, word in new.items()}
        read = [
            replace(self._known[look], at=unit.word.at[0]) for look, unit in zip(looks, units, strict=True)
        ]  # which may stand elsewhere in the text since
        self._known |= {look: self._known.pop(look) for look in dict.fromkeys(looks)}
        for look in list(self._known)[:-_MOST_KNOWN]:
            del self._known[look]
        return read

    def _judge(self, words: Sequence[ReadWord]) -> list[ReadWord]:
        """Words with how probably strangers misread their letters.

        A reader after the first looks only at words that are doubtful if it sees the worst in them.
        """
        texts, before = [word.text for word in words], [self._before[word.numbers] for word in words]
        found, unsure, readers = list(words), list(range(len(words))), _open_readers()
        shares = [np.ones((len(readers), len(each))) for each in before]  # until it looks, a reader may see the worst
        readings = [list[PictureReading]() for _ in words]
        for number, reader in enumerate(readers):
            seen = reader.read_all([words[k].picture for k in unsure])
            for k, reading, share in zip(unsure, seen, shares_seen(seen, [texts[k] for k in unsure]), strict=True):
                shares[k][number] = share
                readings[k].append(reading)
                found[k] = replace(words[k], misread=self._weights.misread(before[k], shares[k]))
            unsure = [k for k in unsure if found[k].wrong >= self._weights.again]
        for k in unsure:
            found[k] = replace(found[k], readings=tuple(readings[k]))
        return found


@lru_cache(maxsize=2)
def _read_before(hand: ScannedHand, weights: MisreadWeights) -> dict[_Look, ReadWord]:
    """Words of a hand that were read by a reader, those that were asked for last at the end."""
    return {}


@one_thread
def reread(
    compose: Callable[[Proofreader], Iterable[Sheet]],
    hand: ScannedHand,
    author: ScannedHand,
    tries: int | None = None,
    settings: RereadingSettings = SETTINGS,
) -> tuple[list[Sheet], list[Doubt], list[ReadWord]]:
    """The pages of a text, of which no word is easily misread where the hand has glyphs for that; those that are; all.

    compose : sets the text, with a proofreader of its paragraphs.
    hand : that it is set in; author : the same without lent letters.
    tries : those of the settings, if None.
    """
    rereader = Rereader(hand, author, settings.tries if tries is None else tries, settings)
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
