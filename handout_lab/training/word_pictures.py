"""Pictures of words to train readers on: written by synthetic writers, and set in handwriting fonts, much distorted.

``python -m handout_lab.training.word_pictures --fonts FOLDER -o WORDS.npz`` makes a set of them.  The fonts are .woff
or .ttf files under licences that allow it (docs/bibliography.md names them).  About a quarter of the texts are random
letters and a third of the words have a wrong letter: what is read must be what is there, not what would be likely.
"""

from __future__ import annotations

import argparse
import string
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from handout import alphabet
from handout.hand.drawn import Hand
from handout.prompting import corpus
from handout.reading import word_space
from handout.reading.word_space import ABOVE, HEIGHT, X_HEIGHT
from handout.tagging import line_space
from handout.tagging.synthetic_lines import SyntheticLine, built_in_hands, random_habits, random_writer, write_lines
from handout.values import Array, Glyph
from handout.writing.variation import warp

Image = NDArray[np.uint8]
_FONT_X = 36  # pixels: x-height at which letters of fonts are drawn
_FONT_ABOVE, _FONT_BELOW = 3.2, 2.2  # x-heights of paper over and under the baseline of a font's word
_CAPITALS = ("rock-salt",)  # fonts whose small letters are capitals: nobody can tell which is meant
_CHARACTERS = "".join(letter for letter in alphabet.LETTERS if letter not in alphabet.SPACE + alphabet.JUNK)
_WIDEST = 320  # columns: wider pictures are left out
_DRAWN_WORDS = 24  # that one synthetic writer writes
_SHAPED = 0.5  # share of a font's words that are set with its own ways of joining letters
# standard deviations of what makes a writer's form of a letter his own, set by eye: letters stay what they are
_OWN_BREADTH, _OWN_HEIGHT, _OWN_LEAN = 0.14, 0.14, 0.08
_OWN_BEND = 0.11  # greatest, of a smooth field that bends a form, x-heights …
_OWN_WAVES = (0.9, 2.6)  # … with waves of these lengths
_HELD = 0.5  # x-heights from where a letter is joined, within which its form is bent less
_LIFTS, _LIFTED = 0.35, 0.4  # share of writers who lift the pen after some letters, and greatest share of those
_OWN = 0.75  # share of the synthetic writers whose letters have forms of their own
_CRISP = 0.65  # share of the pictures in even ink without paper, as lines that were traced are drawn
_FILLED = 0.15  # share of the words whose narrow loops are full of ink
_OTHER_PEN = 0.4  # share of the pictures of pages that come with another pen
_REMNANTS = 0.12  # share of the pictures with pieces of other lines
_NEIGHBOURS = 64  # pictures from which remnants of other lines are taken


@dataclass(frozen=True)
class WordPicture:
    """A word, or a few, as read.

    picture : (HEIGHT, w) uint8, 255 is ink.
    text : what was written.
    source : the font or hand.
    """

    picture: Image
    text: str
    source: str


@dataclass(frozen=True)
class Source:
    """A word before it is distorted: picture (h, w) of some x-height, its baseline's row and its pen's width."""

    picture: Image
    x_height: float
    baseline: float
    pen: float
    text: str
    name: str


class Texts:
    """What is written: words, words with a wrong letter, made-up words, random letters, numbers, with marks around."""

    def __init__(self, sentences: Sequence[str]) -> None:
        counts = Counter(word for sentence in sentences for word in sentence.split())
        self._words = np.array(sorted(counts), dtype=object)
        self._follow: dict[str, str] = defaultdict(str)
        for word in counts:
            plain = f"^^{word.lower().strip(string.punctuation)}$"
            for a, b, c in zip(plain, plain[1:], plain[2:], strict=False):
                self._follow[a + b] += c

    def text(self, rng: np.random.Generator) -> str:
        """One word, or two or three with spaces between them."""
        count = int(rng.choice(3, p=(0.8, 0.14, 0.06))) + 1
        return " ".join(self._dressed(self._word(rng), rng) for _ in range(count))

    def _word(self, rng: np.random.Generator) -> str:
        kind = rng.random()
        if kind < 0.36:
            return str(rng.choice(self._words))
        if kind < 0.60:
            return self._misspelt(str(rng.choice(self._words)), rng)
        if kind < 0.76:
            return self._made_up(rng)
        if kind < 0.95:
            return _random_letters(rng)
        return _number(rng)

    def _made_up(self, rng: np.random.Generator) -> str:
        word = "^^"
        while len(word) < 14:
            letter = str(rng.choice(list(self._follow[word[-2:]])))
            if letter == "$":
                break
            word += letter
        return word[2:]

    @staticmethod
    def _misspelt(word: str, rng: np.random.Generator) -> str:
        at = int(rng.integers(len(word)))
        letter = str(rng.choice(list(string.ascii_lowercase)))
        chance = rng.random()
        if chance < 0.6:
            return word[:at] + letter + word[at + 1 :]
        return word[:at] + letter + word[at:] if chance < 0.8 else word[:at] + word[at + 1 :] or letter

    @staticmethod
    def _dressed(word: str, rng: np.random.Generator) -> str:
        chance = rng.random()
        if chance < 0.12:
            return word.capitalize()
        if chance < 0.17:
            return word.upper()
        if chance < 0.20:
            mark = str(rng.choice(["''", '""', "()"]))
            return mark[0] + word + mark[-1]
        return word + (str(rng.choice(list(",.,.;:!?-"))) if chance < 0.34 else "")


def _random_letters(rng: np.random.Generator) -> str:
    length = int(rng.integers(1, 9))
    kind = rng.random()
    if kind < 0.75:
        return "".join(rng.choice(list(string.ascii_lowercase), length))
    if kind < 0.9:
        return "".join(rng.choice(list(string.ascii_letters), length))
    return "".join(rng.choice(list(_CHARACTERS), min(length, 5)))


def _number(rng: np.random.Generator) -> str:
    digits = "".join(rng.choice(list(string.digits), int(rng.integers(1, 6))))
    kind = int(rng.integers(6))
    if kind == 0:
        return f"{digits[:2]}{rng.choice(list('.:,/-'))}{rng.integers(100):02d}"
    if kind == 1:
        return f"{rng.choice(list('£$€#'))}{digits}"
    return digits + (str(rng.choice(["%", "th", "st", "nd", "rd", "am", "pm"])) if kind == 2 else "")


@dataclass(frozen=True)
class FontLetter:
    """A letter of a font as a picture, where that stands from the pen's place, and by how far the pen moves on."""

    picture: Image
    left: int
    top: int
    advance: float


class FontWriter:
    """A handwriting font, upright, at an x-height of `_FONT_X` pixels; letters that it lacks are missing.

    Raises
    ------
    ValueError
        It has no x, or no picture of one.
    """

    def __init__(self, path: Path) -> None:
        from PIL import ImageFont

        self.name = path.name.split("-latin")[0]
        box = ImageFont.truetype(str(path), 200).getbbox("x", anchor="ls")
        if box[1] >= 0:
            raise ValueError(f"{path} has no small x")
        self._font = ImageFont.truetype(str(path), round(200 * _FONT_X / -box[1]))
        missing = bytes(self._font.getmask("\uffff"))
        self.letters = {
            letter: drawn
            for letter in _CHARACTERS + " "
            if (drawn := self._letter(letter)) and (letter == " " or bytes(self._font.getmask(letter)) != missing)
        }
        self.pen = self._pen()
        self.slant = line_space.median_slant([self._specimen()])

    def _letter(self, letter: str) -> FontLetter | None:
        mask, (left, top) = self._font.getmask2(letter, anchor="ls")
        width, height = mask.size
        picture = (
            np.array(mask, dtype=np.uint8).reshape(height, width) if width * height else np.zeros((0, 0), np.uint8)
        )
        if not picture.any() and letter != " ":
            return None
        return FontLetter(picture, int(left), int(top), float(self._font.getlength(letter)))

    def _pen(self) -> float:
        widths = [
            2.0 * float(np.quantile(inside[inside > 0], 0.8))
            for letter in "nolihu"
            if letter in self.letters
            and (
                inside := cv2.distanceTransform((self.letters[letter].picture > 127).astype(np.uint8), cv2.DIST_L2, 3)
            ).any()
        ]
        return float(np.median(widths))

    def _specimen(self) -> Image:
        picture, base = self.set("hlindtbkmu", 0.0, np.random.default_rng(0), 0.0)
        scale = line_space.X_HEIGHT / _FONT_X
        small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        top = line_space.ABOVE - round(base * scale)
        canvas = np.zeros((line_space.HEIGHT, small.shape[1]), np.uint8)
        rows = np.arange(small.shape[0]) + top
        fits = (rows >= 0) & (rows < line_space.HEIGHT)
        canvas[rows[fits]] = small[fits]
        return canvas

    def set(self, text: str, tracking: float, rng: np.random.Generator, jitter: float) -> tuple[Image, float]:
        """The text as a picture at an x-height of `_FONT_X`, and the row of its baseline; lengths in x-heights."""
        base = round(_FONT_ABOVE * _FONT_X)
        width = sum(self.letters[c].advance for c in text) + (4 + abs(tracking) * len(text)) * _FONT_X
        canvas = np.zeros((base + round(_FONT_BELOW * _FONT_X), int(width)), np.uint8)
        x = 2.0 * _FONT_X
        for character in text:
            letter = self.letters[character]
            dx, dy = rng.normal(0.0, jitter * _FONT_X, 2)
            _stamp(canvas, letter.picture, round(base + letter.top + dy), round(x + letter.left + dx))
            x += letter.advance + (tracking + rng.normal(0.0, jitter)) * _FONT_X
        return canvas, float(base)

    def shaped(self, text: str) -> tuple[Image, float]:
        """The text as the font joins its letters (where Pillow has Raqm), and the row of its baseline."""
        mask, (_, top) = self._font.getmask2(text, anchor="ls")
        base, margin = round(_FONT_ABOVE * _FONT_X), 2 * _FONT_X
        width, height = mask.size
        canvas = np.zeros((base + round(_FONT_BELOW * _FONT_X), width + 2 * margin), np.uint8)
        _stamp(canvas, np.array(mask, dtype=np.uint8).reshape(height, width), base + int(top), margin)
        return canvas, float(base)

    def write(self, text: str, rng: np.random.Generator) -> Source:
        """The text, as its font sets it or a little wider or closer."""
        tracking = float(rng.normal(0.0, 0.05))
        if rng.random() < _SHAPED:
            picture, base = self.shaped(text)
        else:
            picture, base = self.set(text, tracking, rng, float(rng.uniform(0.0, 0.06)))
        shear = np.array([[1, self.slant, -self.slant * base], [0, 1, 0]], dtype=np.float64)
        upright = cv2.warpAffine(picture, shear, (picture.shape[1], picture.shape[0]))
        return Source(np.asarray(upright, np.uint8), _FONT_X, base, self.pen, text, self.name)


def _stamp(canvas: Image, picture: Image, top: int, left: int) -> None:
    y, x = max(top, 0), max(left, 0)
    bottom, right = min(top + picture.shape[0], canvas.shape[0]), min(left + picture.shape[1], canvas.shape[1])
    if bottom > y and right > x:
        part = canvas[y:bottom, x:right]
        np.maximum(part, picture[y - top : bottom - top, x - left : right - left], out=part)


def fonts(folder: Path) -> list[FontWriter]:
    """The handwriting fonts of a folder, found by name; those of the Latin alphabet's usual weight."""
    paths = sorted(folder.rglob("*-latin-400-normal.woff")) + sorted(folder.rglob("*.ttf"))
    return [FontWriter(path) for path in paths if not path.name.startswith(_CAPITALS)]


def with_own_forms(hand: Hand, rng: np.random.Generator) -> Hand:
    """The same hand as a person with other forms writes it: every letter with proportions, lean and bends of its own.

    Ends at which letters are joined keep their height, so that joins still meet.  Some writers lift the pen after
    some letters.
    """
    lifts = float(rng.uniform(0.0, _LIFTED)) if rng.random() < _LIFTS else 0.0
    bend = float(rng.uniform(0.0, _OWN_BEND))
    glyphs = {}
    for letter, forms in hand.glyphs.items():
        seed, lifted = int(rng.integers(2**32)), rng.random() < lifts
        glyphs[letter] = tuple(_own_form(form, np.random.default_rng(seed), bend, lifted) for form in forms)
    return replace(hand, glyphs=glyphs)


def _own_form(form: Glyph, rng: np.random.Generator, bend: float, lifted: bool) -> Glyph:
    """One form, changed alike for the same state of the generator."""
    xy = np.vstack(form.strokes)
    breadth, tall = np.exp(rng.normal(0.0, (_OWN_BREADTH, _OWN_HEIGHT)))
    x, y = xy.T
    bent = np.column_stack(
        [x * breadth + rng.normal(0.0, _OWN_LEAN) * (y - 0.5), np.where(y > 1, 1 + (y - 1) * tall, y)]
    )
    bent = bent + warp(xy, rng, bend, *_OWN_WAVES)
    held = np.zeros(len(xy))
    for end, joins in ((form.strokes[0][0], form.entry), (form.strokes[form.last_main][-1], form.exit)):
        if joins != "lifted":
            held = np.maximum(held, np.clip(1 - np.hypot(*(xy - end).T) / _HELD, 0.0, 1.0))
    bent[:, 1] = held * y + (1 - held) * bent[:, 1]
    strokes: list[Array] = np.split(bent, np.cumsum([len(stroke) for stroke in form.strokes])[:-1])
    ends = "lifted" if lifted else form.exit
    return replace(form, strokes=tuple(strokes), width=form.width * float(breadth), exit=ends)


def drawn_words(texts: Texts, hands: Sequence[Hand], rng: np.random.Generator) -> Iterator[Source]:
    """Words of synthetic writers, without end."""
    while True:
        writer, habits = random_writer(hands, rng), random_habits(rng)
        writer = with_own_forms(writer, rng) if rng.random() < _OWN else writer
        asked = " ".join(texts.text(rng) for _ in range(_DRAWN_WORDS))
        usable = [word for word in asked.split() if all(alphabet.fold(c) == c for c in word)]
        for line in write_lines(" ".join(usable), writer, habits, rng):
            yield from _words_of(line, usable, habits.pen * line_space.X_HEIGHT, writer.name)


def _words_of(line: SyntheticLine, words: list[str], pen: float, name: str) -> Iterator[Source]:
    """The words at the head of a list that stand on a line; they are taken off the list."""
    spans = list(line.spans)
    while spans and words and "".join(s.letter for s in spans[: len(words[0])]) == words[0]:
        word = words.pop(0)
        letters = spans[: len(word)]
        del spans[: len(word)]
        before = (
            line.spans[len(line.spans) - len(spans) - len(word) - 1].right if letters[0] is not line.spans[0] else 0.0
        )
        after = spans[0].left if spans else float(line.image.shape[1])
        left, right = int((before + letters[0].left) / 2), int(np.ceil((letters[-1].right + after) / 2))
        if right - left > 4:
            piece = np.pad(line.image[:, max(left, 0) : right], ((0, 0), (line_space.X_HEIGHT, line_space.X_HEIGHT)))
            yield Source(piece, line_space.X_HEIGHT, line_space.ABOVE, pen, word, name)
    if spans:
        words.clear()


def distorted(source: Source, rng: np.random.Generator) -> Image | None:
    """(HEIGHT, w) uint8: a word in word space, as another person with another pen might write it; None: too wide."""
    picture = _another_pen(source, rng)
    scale = source.x_height / X_HEIGHT / float(np.exp(rng.normal(0.0, 0.12)))  # source pixels a pixel of word space
    across = scale / float(np.exp(rng.normal(0.03, 0.22)))
    ink = np.nonzero(picture.max(axis=0) > 60)[0]
    if not len(ink):
        return None
    margins = rng.uniform(4, 12, 2)
    width = int((ink[-1] - ink[0]) / across + margins.sum())
    if width > _WIDEST:
        return None
    u, v = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(HEIGHT, dtype=np.float32))
    up = ABOVE + rng.normal(0.0, 1.1) - v
    du, dv = _field(width, rng)
    # a slant that was not taken away, a baseline that rises and waves, ascenders and descenders of another length
    drift = rng.normal(0.0, 0.012) * (u - width / 2) + rng.normal(0.0, 0.5) * np.sin(
        u / rng.uniform(15, 50) + rng.uniform(0, 6)
    )
    up = up + dv + drift
    rising, falling = np.exp(rng.normal(0.0, 0.12, 2))
    up = np.where(up > X_HEIGHT, X_HEIGHT + (up - X_HEIGHT) * rising, np.where(up < 0, up * falling, up))
    lean = float(rng.normal(0.0, 0.12))
    x = ink[0] + (u - margins[0] + du - lean * (up - X_HEIGHT / 2)) * across
    y = source.baseline - up * scale
    crisp = rng.random() < _CRISP
    blur = 0.3 if crisp else 0.4 * float(rng.uniform(0.6, 1.5))
    blurred = cv2.GaussianBlur(picture, (0, 0), max(blur * scale, 0.3))
    drawn = cv2.remap(blurred, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR)
    return np.asarray(drawn, np.uint8) if crisp else _inked(np.asarray(drawn, np.float32) / 255, rng)


def varied(picture: Image, others: Sequence[Image], rng: np.random.Generator) -> Image:
    """(HEIGHT, w) uint8: writing from a page as the same hand might write it wider or narrower, more upright or less.

    Now and then with another pen, or with pieces of others above and below.
    """
    across, tall = float(np.exp(rng.normal(-0.05, 0.25))), float(np.exp(rng.normal(0.0, 0.09)))
    width = max(round(picture.shape[1] / across), 1)
    u, v = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(HEIGHT, dtype=np.float32))
    du, dv = _field(width, rng, 0.1, 1.2)
    up = (ABOVE + rng.normal(0.0, 0.9) - v + dv + rng.normal(0.0, 0.5) * np.sin(u / rng.uniform(30, 150))) / tall
    x = (u + du - rng.normal(0.0, 0.14) * (up - X_HEIGHT / 2)) * across
    drawn = cv2.remap(picture, x.astype(np.float32), (ABOVE - up).astype(np.float32), cv2.INTER_LINEAR)
    if rng.random() < _OTHER_PEN:
        # what a blurred stroke is darker than is a stroke of another width
        blurred = cv2.GaussianBlur(drawn, (0, 0), float(rng.uniform(0.5, 0.9))).astype(np.float32)
        drawn = np.clip((blurred - rng.uniform(45, 130)) * 3 + 128, 0, 255).astype(np.uint8)
    if rng.random() < _REMNANTS:
        drawn = _with_remnants(np.asarray(drawn, np.uint8), others, rng)
    return np.asarray(drawn, np.uint8)


def _another_pen(source: Source, rng: np.random.Generator) -> Image:
    """The word with a thicker or thinner line, its narrow loops filled now and then."""
    picture = source.picture
    if rng.random() < _FILLED:
        narrow = cv2.getStructuringElement(
            cv2.MORPH_ELLIPSE, (2 * round(rng.uniform(0.04, 0.1) * source.x_height) + 1,) * 2
        )
        picture = np.asarray(cv2.morphologyEx(picture, cv2.MORPH_CLOSE, narrow), np.uint8)
    wanted = float(rng.uniform(0.05, 0.2)) * source.x_height
    change = float(np.clip(wanted - source.pen, -0.5 * source.pen, 0.2 * source.x_height))
    size = 2 * round(abs(change) / 2) + 1
    if size < 3:
        return picture
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    change_of = cv2.dilate if change > 0 else cv2.erode
    return np.asarray(change_of(picture, kernel), dtype=np.uint8)


def _field(width: int, rng: np.random.Generator, least: float = 0.2, most: float = 1.5) -> tuple[Array, Array]:
    """Two smooth random fields (HEIGHT, width), pixels: what makes every letter differ from every other."""
    step = rng.uniform(7, 16)
    grid = (max(int(HEIGHT / step), 2) + 2, max(int(width / step), 2) + 2)
    strong = float(rng.uniform(least, most))
    coarse = rng.normal(0.0, strong, (*grid, 2)).astype(np.float32)
    fine = cv2.resize(coarse, (width, HEIGHT), interpolation=cv2.INTER_CUBIC)
    return np.asarray(fine[..., 0], np.float64), np.asarray(0.7 * fine[..., 1], np.float64)


def _inked(drawn: Array, rng: np.random.Generator) -> Image:
    """Ink that is uneven, with gaps and flecks, on paper that is not quite white."""
    height, width = drawn.shape
    coarse = rng.uniform(0.0, 1.0, (height // 4 + 2, width // 4 + 2)).astype(np.float32)
    uneven = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_LINEAR)
    inked = drawn * (1.0 - rng.uniform(0.0, 0.6) * uneven)
    if rng.random() < 0.2:  # a pen that skips
        inked = np.where(uneven > rng.uniform(0.75, 0.95), inked * 0.2, inked)
    if rng.random() < 0.15:  # flecks
        for _ in range(int(rng.integers(1, 4))):
            at = (int(rng.integers(width)), int(rng.integers(height)))
            inked = cv2.circle(
                np.ascontiguousarray(inked, np.float32), at, int(rng.integers(0, 2)), float(rng.uniform(0.3, 1)), -1
            )
    inked = inked + rng.normal(0.0, rng.uniform(0.0, 0.04), inked.shape)
    level = float(rng.choice([1.0, rng.uniform(0.5, 1.0)]))
    return np.asarray(np.clip(inked * level * 255, 0, 255), dtype=np.uint8)


def _with_remnants(picture: Image, others: Sequence[Image], rng: np.random.Generator) -> Image:
    """Pieces of the lines above and below at the edges of the picture."""
    joined = picture.copy()
    other = others[int(rng.integers(len(others)))]
    down = int(rng.integers(24, 34)) * (1 if rng.random() < 0.5 else -1)
    left, start = int(rng.integers(0, max(picture.shape[1] - 8, 1))), int(rng.integers(0, max(other.shape[1] - 12, 1)))
    piece = other[:, start : start + int(rng.integers(8, 40))]
    _stamp(joined, np.ascontiguousarray(piece), down, left)
    return joined


def word_pictures(
    writers: Sequence[FontWriter], hands: Sequence[Hand], texts: Texts, rng: np.random.Generator, drawn: float = 0.35
) -> Iterator[WordPicture]:
    """Pictures of words, without end.

    drawn : share of them by synthetic writers; the others are set in fonts.
    """
    written = drawn_words(texts, hands, rng) if hands else iter(())
    recent: list[Image] = []
    while True:
        if not writers or (hands and rng.random() < drawn):
            source = next(written)
        else:
            writer, text = writers[int(rng.integers(len(writers)))], texts.text(rng)
            if not all(c in writer.letters for c in text):
                continue
            source = writer.write(text, rng)
        picture = distorted(source, rng)
        if picture is None:
            continue
        recent = [*recent[-_NEIGHBOURS:], picture]
        if rng.random() < _REMNANTS:
            picture = _with_remnants(picture, recent, rng)
        even = np.rint(word_space.normalised(picture.astype(np.float32) / 255) * 255).astype(np.uint8)
        yield WordPicture(even, source.text, source.name)


def save(pictures: Sequence[WordPicture], path: Path) -> None:
    """Writes a set: all pictures side by side, their widths, texts and sources."""
    np.savez_compressed(
        path,
        pictures=np.hstack([p.picture for p in pictures]),
        widths=np.array([p.picture.shape[1] for p in pictures]),
        texts=np.array([p.text for p in pictures]),
        sources=np.array([p.source for p in pictures]),
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Make a set and write it."""
    parser = argparse.ArgumentParser(
        prog="python -m handout_lab.training.word_pictures", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="the .npz to write")
    parser.add_argument("--fonts", type=Path, required=True, help="folder of handwriting fonts")
    parser.add_argument("--only", nargs="+", help="fonts to use, no others and no drawn hands")
    parser.add_argument("--without", nargs="+", default=[], help="fonts to leave out")
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    writers = [
        w
        for w in fonts(options.fonts)
        if w.name not in options.without and (not options.only or w.name in options.only)
    ]
    hands = [] if options.only else built_in_hands()
    source = word_pictures(writers, hands, Texts(corpus.shipped_sentences()), np.random.default_rng(options.seed))
    save([next(source) for _ in range(options.count)], options.output)
    print(f"{options.output}: {options.count} pictures, {len(writers)} fonts", file=sys.stderr)


if __name__ == "__main__":
    main()
