"""What a person is asked of a scanned hand: which of its letters read badly in the words that it writes.

Words are written in the hand as texts are, and read by a reader that knows no author.  Glyphs of a letter that look
alike are asked about together, and so are all of a letter that strangers mostly take for others: answered, it is lent.
Those come first that read worse than others of their letter: a few answers mend most.  A sheet shows each question as a
row: the letter in its own word, then in words that were made.  A file beside it holds which glyphs are meant, so that
answers by number (`1 4b 7=o`) become corrections; any letter of a word may be named (`4b2`).

Source: own method.
"""

from __future__ import annotations

import string
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
import regex
from numpy.typing import NDArray

from handout.errors import InputError
from handout.hand import report
from handout.hand.author_reader import readable
from handout.hand.corrections import AnyCorrection, KeepOut, Label
from handout.hand.glyph_features import glyph_features
from handout.hand.scanned import ScannedHand
from handout.pipeline import rereading
from handout.pipeline.rereading import ReadWord, Rereader, write_words
from handout.prompting import corpus
from handout.reading.word_space import HEIGHT
from handout.writing.legibility import unclear_letters


@dataclass(frozen=True)
class QuestionSettings:
    """What is written, and what is asked together.

    words : that are written, about as many different ones as a page has: ten seconds.
    alike : distance of glyphs, in standard deviations of a hand's features, up to which they are one question; by eye.
    shown : words a question, at most.
    """

    words: int = 300
    alike: float = 4.5
    shown: int = 5


SETTINGS = QuestionSettings()
_SCALE = 2  # pixels of the sheet a pixel of word space
_ROW, _LEFT, _OWN, _WORD = HEIGHT * _SCALE + 44, 90, 160, 250  # pixels of the sheet: a row, its name, its cells
_MEANT, _HALF = (232, 128, 0), 8  # under the letter that is meant; half the width of that mark at least, pixels
_ANSWER = regex.compile(r"(?<number>\d+)(?:(?<cell>[a-z])(?<letter>\d*))?(?:=(?<text>\S+))?")


@dataclass(frozen=True, eq=False)
class WrittenUse:
    """A glyph in a word that was written: which letter of it, and how probably it reads as another."""

    glyph: int
    word: ReadWord
    index: int
    left: float
    right: float
    wrong: float


@dataclass(frozen=True, eq=False)
class LetterQuestion:
    """Glyphs of a letter that look alike.

    glyphs : those that are written first, the most used before; then their likes.
    wrong : letters that read wrong by them in the words that were written, more than by others of their letter, or by
        other letters where there are none; uses : in all.
    shown : some of the words, those that read worst first.
    """

    letter: str
    glyphs: tuple[int, ...]
    wrong: float
    uses: int
    shown: tuple[WrittenUse, ...]


class AskedGlyph(msgspec.Struct, frozen=True):
    """A glyph that stands for `letter`. page : from 0; at : pixels of the scan."""

    letter: str
    page: int
    at: tuple[float, float]


class AskedWord(msgspec.Struct, frozen=True):
    """A word of a sheet. meant : which of its letters is asked about, from 0; glyphs : all of them."""

    text: str
    meant: int
    glyphs: tuple[AskedGlyph, ...]


class AskedLetter(msgspec.Struct, frozen=True):
    """A question as it is kept in a file; see `LetterQuestion`."""

    letter: str
    wrong: float
    uses: int
    words: tuple[AskedWord, ...]
    glyphs: tuple[AskedGlyph, ...]


class QuestionFile(msgspec.Struct, frozen=True):
    """The questions of a sheet, in order."""

    questions: tuple[AskedLetter, ...]


def ask_letters(hand: ScannedHand, most: int) -> list[LetterQuestion]:
    """At most so many questions, those first whose answers mend most.

    Of 278 words in five hands (csafe w0122 w0182 w0277, cvl 0027, Copiste 0178) strangers misread 37, and 12 after two
    to five answers.  By a reader that had no part in it the first ten mend 25, 20 and 1 letters of 300 words in three
    of them (w0277, w0182, 0178); 14 in the second, and less than none in the others, where those came first that read
    wrong most often in all; in small letters alone, that is.
    """
    uses = list(_write_uses(hand))
    if not uses:
        return []
    features = glyph_features(hand)
    features = (features - features.mean(axis=0)) / np.maximum(features.std(axis=0), 1e-9)
    usual, unclear = float(np.mean([use.wrong for use in uses])), unclear_letters(hand)
    questions = list[LetterQuestion]()
    for letter in sorted({hand.glyphs[use.glyph].letter for use in uses}):
        numbers = hand.numbers_of_letter(letter)
        written = [use for use in uses if hand.glyphs[use.glyph].letter == letter]
        for group in [np.arange(len(numbers))] if letter in unclear else _group_likes(features[numbers]):
            questions += _question(letter, numbers[group].tolist(), written, usual)
    return sorted(questions, key=lambda question: -question.wrong)[:most]


def _question(
    letter: str, likes: Sequence[int], written: Sequence[WrittenUse], usual: float
) -> Iterator[LetterQuestion]:
    """What is asked of some glyphs of a letter; nothing if none of them was written.

    written : all uses of the letter; usual : how probably letters read as others on average.
    """
    here = sorted((use for use in written if use.glyph in likes), key=lambda use: -use.wrong)
    if here:
        times = Counter(use.glyph for use in here)
        instead = [use.wrong for use in written if use.glyph not in likes] or [usual]
        wrong = sum(use.wrong for use in here) - len(here) * float(np.mean(instead))
        glyphs = tuple(sorted(likes, key=lambda number: (-times[number], number)))
        yield LetterQuestion(letter, glyphs, wrong, len(here), tuple(_choose_shown(here)))


def _write_uses(hand: ScannedHand) -> Iterator[WrittenUse]:
    """Every letter of some words as they are written in a hand."""
    rng = np.random.default_rng(0)
    plain = [word.strip(string.punctuation) for text in corpus.shipped_sentences() for word in text.split()]
    names = dict.fromkeys(word for word in plain if readable(word) and set(word) <= hand.letters.keys())
    if not names:
        return
    paragraph = write_words(hand, rng.permutation(list(names))[: SETTINGS.words].tolist(), rng)
    rereader = Rereader(hand, hand, rereading.SETTINGS.tries)
    rereader(paragraph)
    for word, readings in zip(rereader.words, rereading.read([w.picture for w in rereader.words]), strict=True):
        try:
            spans = readings[0].spans(word.text)
        except ValueError:  # too narrow to be read letter by letter
            continue
        for index, (number, span) in enumerate(zip(word.numbers.tolist(), spans, strict=True)):
            yield WrittenUse(number, word, index, span.left, span.right, 1.0 - span.probability)


def _group_likes(features: NDArray[np.float64]) -> Iterator[NDArray[np.intp]]:
    """Which glyphs of a letter, by their features (n, k), look alike."""
    from sklearn.cluster import AgglomerativeClustering

    if len(features) < 2:
        yield np.arange(len(features))
        return
    groups = AgglomerativeClustering(n_clusters=None, linkage="average", distance_threshold=SETTINGS.alike)
    labels = groups.fit_predict(features)
    for label in range(int(labels.max()) + 1):
        yield np.flatnonzero(labels == label)


def _choose_shown(uses: Sequence[WrittenUse]) -> Iterator[WrittenUse]:
    """Some of the words, each glyph once before any comes again, no word twice."""
    words, counts = set[str](), dict[int, int]()
    ranked = []
    for use in uses:
        counts[use.glyph] = counts.get(use.glyph, 0) + 1
        ranked.append((counts[use.glyph], use))
    for _, use in sorted(ranked, key=lambda pair: pair[0]):
        if use.word.text not in words and len(words) < SETTINGS.shown:
            words.add(use.word.text)
            yield use


def question_file(hand: ScannedHand, questions: Sequence[LetterQuestion]) -> QuestionFile:
    """Questions as they are kept."""

    def find(number: int) -> AskedGlyph:
        glyph = hand.glyphs[number]
        x, y = hand.pages[glyph.page].graph.uv[glyph.vertices[len(glyph.vertices) // 2]].round(1).tolist()
        return AskedGlyph(glyph.letter, glyph.page, (x, y))

    return QuestionFile(
        tuple(
            AskedLetter(
                asked.letter,
                round(asked.wrong, 2),
                asked.uses,
                tuple(
                    AskedWord(use.word.text, use.index, tuple(map(find, use.word.numbers.tolist())))
                    for use in asked.shown
                ),
                tuple(map(find, asked.glyphs)),
            )
            for asked in questions
        )
    )


def draw_questions(hand: ScannedHand, questions: Sequence[LetterQuestion]) -> report.Pixels:
    """(h, w, 3) uint8: a row a question: its number and letter, a glyph in its own word, then the words of `shown`."""
    from PIL import Image, ImageDraw, ImageFont

    size = _LEFT + _OWN + SETTINGS.shown * _WORD, _ROW * max(len(questions), 1)
    image = Image.new("RGB", size, "white")
    draw, large, small = ImageDraw.Draw(image), ImageFont.load_default(30.0), ImageFont.load_default(15.0)
    pages = {page: hand.pages[page].on_paper() for page in range(len(hand.pages))}
    for row, asked in enumerate(questions):
        top = row * _ROW
        draw.line([(0, top), (size[0], top)], fill=(220, 220, 220))
        draw.text((8, top + 34), f"{row + 1}", fill=(150, 150, 150), font=small)
        draw.text((40, top + 24), asked.letter, fill=(150, 0, 0), font=large)
        first = asked.glyphs[0]
        own = Image.fromarray(report.in_its_word(hand, first, pages[hand.glyphs[first].page]))
        image.paste(own, (_LEFT, top + 2))
        for column, use in enumerate(asked.shown):
            x, bottom = _LEFT + _OWN + column * _WORD, top + 2 + HEIGHT * _SCALE
            ink = Image.fromarray(np.rint(255 * (1 - np.clip(use.word.picture, 0, 1))).astype(np.uint8))
            scale = min(_SCALE, (_WORD - 20) / ink.width)
            ink = ink.resize((max(round(ink.width * scale), 1), max(round(ink.height * scale), 1)))
            image.paste(ink, (x, bottom - ink.height))
            middle, half = x + (use.left + use.right) / 2 * scale, max((use.right - use.left) / 2 * scale, _HALF)
            draw.rectangle([middle - half, bottom + 2, middle + half, bottom + 6], fill=_MEANT)
            draw.text((x, bottom + 10), f"{row + 1}{string.ascii_lowercase[column]}", fill=(150, 150, 150), font=small)
    return np.asarray(image)


def read_questions(data: bytes, name: str) -> Sequence[AskedLetter]:
    """The questions that a file keeps. Raises InputError: it holds something else."""
    try:
        return msgspec.json.decode(data, type=QuestionFile).questions
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{name} does not hold the questions of a sheet: {error}.") from error


def read_answers(data: bytes, name: str, answers: Sequence[str]) -> list[AnyCorrection]:
    """Corrections.

    `7` has all glyphs of question 7 written no more, `7b` the one of its second word, `7b1` the first letter of that
    word; `7b=o` says that it is an o.

    Raises InputError: the file is none of a sheet's questions; an answer cannot be read, or is to none of them.
    """
    questions = read_questions(data, name)
    found: list[AnyCorrection] = []
    for answer in " ".join(answers).replace(",", " ").split():
        match = _ANSWER.fullmatch(answer)
        try:
            if match is None:
                raise ValueError
            glyphs = _find_answered(questions, int(match["number"]), match["cell"], match["letter"])
        except (ValueError, IndexError) as error:
            raise InputError(
                f"Answer {answer!r} is to none of the {len(questions)} questions of {name}: expected a row, as in 7, a "
                "word of it, as in 7b, or a letter of that, as in 7b1; and, as in 7b=o, what it is."
            ) from error
        if match["text"]:
            found += [Label(page=glyph.page, at=glyph.at, text=match["text"]) for glyph in glyphs]
        else:
            found += [KeepOut(page=glyph.page, at=glyph.at, text=glyph.letter) for glyph in glyphs]
    if not found:
        raise InputError("No answer was given: name the rows that read badly, as in 1 4b 7=o.")
    return list(dict.fromkeys(found))


def _find_answered(
    questions: Sequence[AskedLetter], number: int, cell: str | None, letter: str | None
) -> Sequence[AskedGlyph]:
    """The glyphs that an answer is about; numbers count from 1. Raises IndexError where there are none."""
    if number < 1 or (letter and int(letter) < 1):
        raise IndexError
    asked = questions[number - 1]
    if not cell:
        return asked.glyphs
    word = asked.words[string.ascii_lowercase.index(cell)]
    return (word.glyphs[int(letter) - 1 if letter else word.meant],)
