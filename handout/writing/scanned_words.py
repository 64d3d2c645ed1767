"""Words of a scanned hand: glyphs spaced, raised, each a little bent, and laid on their lines as ink.

Distances are drawn for letters as they were written in the source.  A letter that is bent wider, or stands higher,
would come nearer to its neighbours than any two of the author's do: `spacing.resolve_collisions` moves them apart
again.

Source: seed 000, §6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from handout.hand.scanned import ScannedHand
from handout.values import Glyph, Ink, LineGraph, Placed
from handout.writing.bending import Bend
from handout.writing.choosing import Choice, GlyphChooser, Prices, Rewrites, word_stream
from handout.writing.glyph_index import GlyphIndex, index_glyphs
from handout.writing.kept_text import Resumable
from handout.writing.layout import author_baselines
from handout.writing.pages import ToPage, Unit, Word, wide_gap
from handout.writing.spacing import WORDS
from handout.writing.text import spelt
from handout.writing.variation import Chances
from handout.writing.word_layout import LayoutModel, layout_model

if TYPE_CHECKING:
    from handout.mathematics.shapes import Wander

_MOST_KEPT = 500  # words of a hand that stay set, so that of a text that is typed on only what changed is: 20 MB
_EXACT = 9  # decimals of places in a word, x-heights: what stands before a word in its paragraph moves no letter in it


@dataclass(eq=False)
class Before:
    """Paragraphs as they were set in a hand, by all that they depend on."""

    paragraphs: dict[object, list[SetUnit]] = field(default_factory=dict)

    def keep(self, key: object, units: list[SetUnit]) -> None:
        """Keep a paragraph; the oldest go, so that there are not too many words."""
        self.paragraphs[key] = units
        while sum(1 + len(each) for each in self.paragraphs.values()) > _MOST_KEPT:
            self.paragraphs.pop(next(iter(self.paragraphs)))


@lru_cache(maxsize=4)
def _learnt(hand: ScannedHand) -> tuple[GlyphIndex, LayoutModel, Before, Callable[[_Glyphs], list[LineGraph]]]:
    """What is worked out once for a hand, however many texts are written in it, what was set last, and what lays the
    glyphs of a word, those that were laid last among them."""
    model, pitch = layout_model(hand), hand.pitch

    def lay(glyphs: _Glyphs) -> list[LineGraph]:
        parts = [(glyph.number, glyph.x / pitch, glyph.y, glyph.bend) for glyph in glyphs]
        numbers, x, y, bends = zip(*parts, strict=True)
        return model.lay_word(numbers, np.array(x), y, bends)

    return index_glyphs(hand), model, Before(), lru_cache(_MOST_KEPT)(lay)


@dataclass(frozen=True)
class InkGlyph:
    """A glyph in its word; it is another's equal that stands and is bent so, too.

    number : of the glyph in its hand.
    x : of its centre, x-heights; y : line space, how high it stands.
    bend : how it is bent.
    """

    number: int
    x: float
    y: float
    bend: Bend

    def move_by(self, x: float) -> InkGlyph:
        """See `pages.SetGlyph`."""
        return replace(self, x=self.x + x)


SetUnit: TypeAlias = Unit[InkGlyph]
_Glyphs: TypeAlias = tuple[InkGlyph, ...]


class ScannedHandwriting:
    """Writes one text in a scanned hand, a paragraph when it is asked for.

    rng : of how glyphs are set.
    variation : 0: where they fit best; 1: as the author varies.

    writers : none, since every word varies by itself.
    again, rewriting : seeds by which words are set that read as others, and those that are to be written again.
    """

    writers: Sequence[Resumable] = ()

    def __init__(self, hand: ScannedHand, rng: np.random.Generator, variation: float) -> None:
        self._hand, self._variation = hand, variation
        self._seed, self.again, self.rewriting = rng.integers(2**63, size=(3, 2)).tolist()
        self.stock, self._model, self._before, self._lay = _learnt(hand)
        self.name, self.pitch, self.baseline_model = hand.name, hand.pitch, author_baselines(hand)
        self.repertoire = hand.repertoire
        self.space = float(self._model.spacing.gaps.mean[WORDS]) * hand.pitch  # the usual gap between words, x-heights

    def wander(self, key: Sequence[int]) -> Wander:
        """See `pages.Handwriting`."""
        from handout.mathematics.shapes import Wander

        return Wander(word_stream(self._seed, (*key, 0)), self._variation)

    def ink_box(self, word: Word[InkGlyph]) -> tuple[float, float, float, float]:
        """See `pages.Handwriting`."""
        graphs = self.laid(word)
        xy, radius = np.concatenate([graph.xy for graph in graphs]), np.concatenate([graph.radius for graph in graphs])
        (left, bottom), (right, top) = (xy - radius[:, None]).min(axis=0), (xy + radius[:, None]).max(axis=0)
        return float(left) * self.pitch, float(bottom) * self.pitch, float(right) * self.pitch, float(top) * self.pitch

    def set_paragraph(self, words: Iterable[Choice]) -> Iterator[SetUnit]:
        """See `pages.Handwriting`; all words of the paragraph are set together, as one line."""
        choices = list(words)
        spelling = [(choice.key, choice.spaces, choice.intended, *map(spelt, choice.letters)) for choice in choices]
        numbers = [tuple(choice.numbers.tolist()) for choice in choices]
        key = (*self._seed, self._variation, tuple(spelling), tuple(numbers))
        units = self._before.paragraphs.pop(key, None)
        if units is None:
            units = list(self.set_words(choices, [word_stream(self._seed, choice.key) for choice in choices]))
        self._before.keep(key, units)
        for choice, unit in zip(choices, units, strict=True):  # which may stand elsewhere in the text since
            yield replace(unit, word=replace(unit.word, at=tuple(letter.at for letter in choice.letters)))

    def set_words(self, choices: Sequence[Choice], streams: Sequence[np.random.Generator]) -> Iterator[SetUnit]:
        """Words of a paragraph, each of which varies by a stream of its own."""
        if not choices:
            return
        model, variation = self._model, self._variation
        numbers = np.concatenate([choice.numbers for choice in choices])
        first = np.cumsum([0, *(len(choice.numbers) for choice in choices)])
        starts = np.zeros(len(numbers), dtype=bool)
        starts[first[:-1]] = [choice.spaces > 0 for choice in choices]
        parts = zip(choices, streams, strict=True)
        chances = Chances.join_words([Chances.draw(rng, len(choice.numbers)) for choice, rng in parts])
        apart, y, bends = model.place_glyphs(numbers, starts, chances, variation)
        x = np.concatenate([[0.0], np.cumsum(apart * self.pitch)])
        extents = x[:, None] + model.reach(numbers, bends) * self.pitch
        for choice, a, b in zip(choices, first.tolist(), first[1:].tolist(), strict=False):
            begin, end = float(extents[a, 0]), float(extents[b - 1, 1])
            own = extents[a:b] - begin
            followed = b < len(x) and not starts[b]
            word = Word(
                glyphs=tuple(
                    map(
                        InkGlyph,
                        numbers[a:b].tolist(),
                        (x[a:b] - begin).round(_EXACT).tolist(),
                        y[a:b].tolist(),
                        bends[a:b],
                    )
                ),
                extents=own,
                at=tuple(letter.at for letter in choice.letters),
                spelt=tuple(spelt(letter) for letter in choice.letters),
                advance=(float(extents[b, 0]) if followed else end) - begin,
                left=float(own[:, 0].min()),
                right=float(own[:, 1].max()),
                glued=a > 0 and not starts[a],
            )
            drawn = begin - float(extents[a - 1, 1]) if a else 0.0
            yield Unit(word, self._gap(drawn, choice.spaces, indent=not a), choice.intended)

    def _gap(self, drawn: float, spaces: int, *, indent: bool) -> float:
        """The gap before a word: several spaces are wider than one; a gap of nothing would mean that there is none."""
        if not spaces:
            return 0.0
        wider = wide_gap(self.space, spaces) - self.space
        return wider + (self.space if indent else max(drawn, 1e-3))

    def laid(self, word: Word[InkGlyph]) -> list[LineGraph]:
        """The ink of a word's glyphs, line space from where it begins on its line."""
        return self._lay(word.glyphs)

    def place(
        self, words: Sequence[Word[InkGlyph]], starts: Sequence[float], scale: float, to_page: ToPage
    ) -> Iterator[Placed]:
        """See `pages.Handwriting`."""
        unit = self.pitch * scale  # mm of one unit of line space
        heads = [k for k, word in enumerate(words) if not (k and word.glued)]
        for k, end in pairwise([*heads, len(words)]):
            glyphs = [(i, starts[i] - starts[k], glyph) for i in range(k, end) for glyph in words[i].glyphs]
            graphs = self._lay(
                words[k].glyphs if end == k + 1 else tuple(glyph.move_by(by / scale) for _, by, glyph in glyphs)
            )
            letters = [letter for word in words[k:end] for letter in zip(word.at, word.spelt, strict=True)]
            for (i, _, glyph), graph, (at, letter) in zip(glyphs, graphs, letters, strict=True):
                source = self._hand.glyphs[glyph.number]
                xy = to_page(graph.xy * unit + (starts[k], 0.0))
                laid = LineGraph(xy, graph.radius * unit, graph.density, graph.uv, graph.edges)
                yield Placed(
                    Glyph(letter, (), (), 0.0), (), source.before >= 0, i, at, Ink(laid, source.page, glyph.number)
                )


class SetParagraph:
    """A paragraph that was set, of which single words may be written again.

    choices, units : its words, those too that are struck out.
    """

    def __init__(self, handwriting: ScannedHandwriting, chooser: GlyphChooser, choices: Sequence[Choice]) -> None:
        self._handwriting, self._chooser = handwriting, chooser
        self.choices, self.units = list(choices), list(handwriting.set_paragraph(choices))
        self._tries: dict[int, int] = {}  # of each word, how many times it was tried again

    def ink(self, unit: SetUnit) -> list[LineGraph]:
        """The graphs of a word's glyphs, line space from where it begins on its line, y upwards."""
        return self._handwriting.laid(unit.word)

    def again(self, k: int, prices: Prices) -> Attempt:
        """A word chosen anew and set between those beside it, which stay as they are; see `GlyphChooser.again`."""
        self._tries[k] = self._tries.get(k, 0) + 1
        return self._set(k, self._chooser.again(self.choices[k], prices), self._handwriting.again, self._tries[k])

    def rewrite(self, rewrites: Rewrites) -> list[int]:
        """Write the words again that are to be, each by itself; which of the paragraph they are."""
        places = [k for k, unit in enumerate(self.units) if unit.intended is None and rewrites.of(unit.word.at[0])]
        for k in places:
            times = rewrites.of(self.units[k].word.at[0])
            other = self._chooser.other(self.choices[k], times)
            self._replace(self._set(k, other, self._handwriting.rewriting, times))
        return places

    def _set(self, k: int, choice: Choice, seed: Sequence[int], number: int) -> Attempt:
        begin, end = max(k - 1, 0), k + 2
        beside = [*self.choices[begin:k], choice, *self.choices[k + 1 : end]]
        units = list(self._handwriting.set_words(beside, word_stream(seed, (number, *choice.key)).spawn(len(beside))))
        others = zip(self.units[begin:end], units, strict=True)
        rises = [
            old.y - new.y
            for i, (before, now) in enumerate(others, begin)
            if i != k
            for old, new in zip(before.word.glyphs, now.word.glyphs, strict=True)
        ]
        rise = float(np.mean(rises)) if rises else 0.0  # it stands on the line of the words beside it
        word = units[k - begin].word
        raised = tuple(replace(glyph, y=glyph.y + rise) for glyph in word.glyphs)
        units[k - begin] = replace(units[k - begin], word=replace(word, glyphs=raised))
        return Attempt(k, choice, units[k - begin], tuple(units[: k - begin]), tuple(units[k - begin + 1 :]))

    def keep(self, attempt: Attempt) -> None:
        """Write a word as it was tried."""
        self._chooser.keep(attempt.choice)
        self._replace(attempt)

    def _replace(self, attempt: Attempt) -> None:
        k = attempt.place
        self.choices[k], self.units[k] = attempt.choice, attempt.unit
        for unit in attempt.after:
            self.units[k + 1] = replace(self.units[k + 1], gap=unit.gap)
        for unit in attempt.before if attempt.unit.word.glued else ():
            word = replace(self.units[k - 1].word, advance=unit.word.advance)
            self.units[k - 1] = replace(self.units[k - 1], word=word)


@dataclass(frozen=True, eq=False)
class Attempt:
    """A word of a paragraph as it was written again.

    place : its place there.
    before, after : the words beside it as they stand to it, if there are any.
    """

    place: int
    choice: Choice
    unit: SetUnit
    before: tuple[SetUnit, ...]
    after: tuple[SetUnit, ...]
