"""Words of a scanned hand: glyphs spaced, raised, each a little bent, and laid on their lines as ink.

Distances are drawn for letters as they were written in the source.  A letter that is bent wider, or stands higher,
would come nearer to its neighbours than any two of the author's do: `spacing.resolve_collisions` moves them apart
again.

Source: seed 000, §6.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from handout.hand.scanned import ScannedHand
from handout.values import Array, Glyph, Indices, Ink, LineGraph, Placed
from handout.writing.bending import Bend, Spread, bend, spread
from handout.writing.choosing import Choice
from handout.writing.forms import Form, Forms
from handout.writing.glyph_index import GlyphIndex, Neighbours, index_glyphs, neighbours
from handout.writing.joining import set_line
from handout.writing.joints import Joint
from handout.writing.layout import author_baselines
from handout.writing.pages import ToPage, Unit, Word, wide_gap
from handout.writing.spacing import WORDS, HeightModel, SpacingModel, height_model, resolve_collisions, spacing_model
from handout.writing.text import spelt
from handout.writing.variation import walk


@dataclass(frozen=True, eq=False)
class LayoutModel:
    """Forms of a hand's glyphs, and how it places and varies them."""

    forms: Forms
    neighbours: Neighbours
    spacing: SpacingModel
    heights: HeightModel
    spread: Spread

    def reach(self, numbers: Indices, bends: Sequence[Bend]) -> Array:
        """(n, 2) float, line space: how far the ink of bent glyphs goes left (negative) and right of their centres.

        Strokes count that are its own part of a ligature: where it is joined, the next letter has more of it.
        """
        reaches = [_reach(self.forms[int(number)], bend) for number, bend in zip(numbers, bends, strict=True)]
        return np.array(reaches).reshape(-1, 2)

    def joints(self, numbers: Sequence[int], apart: Sequence[bool]) -> list[tuple[Joint, ...]]:
        """The ligatures from each of some glyphs to the next; `apart` says before which there is a space."""
        between = self.spacing.joints.between
        return [() if space else between(*pair) for pair, space in zip(pairwise(numbers), apart[1:], strict=True)]

    def bends(self, numbers: Indices, rng: np.random.Generator, variation: float = 1.0) -> list[Bend]:
        """How each of some glyphs (n,) is bent, never further than the author's own letters vary.

        variation : 0 not at all, 1 as much as is usual.
        """
        # size and slant drift, as people's do; a generator a glyph, so that another in its place changes no others
        drifts = np.stack([walk(rng, len(numbers), 1.0) for _ in range(3)], axis=1)
        seeds = rng.integers(2**63, size=len(numbers))
        return [
            _bent(self, number, tuple(drift), seed, variation)
            for number, drift, seed in zip(numbers.tolist(), drifts.tolist(), seeds.tolist(), strict=True)
        ]


@lru_cache(maxsize=4096)  # glyphs: 900 words, which are set several times when some of them read as others
def _bent(model: LayoutModel, number: int, drift: tuple[float, ...], seed: int, variation: float) -> Bend:
    """How a glyph is bent: as it was, where the same place is written with it again."""
    height, rng = float(model.heights.height[number]), np.random.default_rng(seed)
    return bend(model.forms[number], number, model.spread, height, np.array(drift), rng, variation)


def layout_model(hand: ScannedHand) -> LayoutModel:
    """The layout_model of a hand; takes about a third of a second for a page of a thousand letters."""
    forms = Forms(hand)
    near = neighbours(hand, forms.centre[:, 0])
    return LayoutModel(forms, near, spacing_model(forms, near), height_model(forms, near), spread(forms))


def _reach(form: Form, bend: Bend) -> tuple[float, float]:
    xy, radius = form.whole
    xy = bend.of_form(xy)
    return float((xy[:, 0] - radius).min()), float((xy[:, 0] + radius).max())


@lru_cache(maxsize=4)
def _learnt(hand: ScannedHand) -> tuple[GlyphIndex, LayoutModel]:
    """What is worked out once for a hand, however many texts are written in it."""
    return index_glyphs(hand), layout_model(hand)


@dataclass(frozen=True, eq=False)
class InkGlyph:
    """A glyph in its word.

    number : of the glyph in its hand.
    x : of its centre, x-heights; y : line space, how high it stands.
    bend : how it is bent.
    """

    number: int
    x: float
    y: float
    bend: Bend

    def moved(self, x: float) -> InkGlyph:
        """See `pages.SetGlyph`."""
        return replace(self, x=self.x + x)


class ScannedHandwriting:
    """Writes one text in a scanned hand, a paragraph when it is asked for.

    Parameters
    ----------
    rng : of how glyphs are set.
    variation : 0: where they fit best; 1: as the author varies.
    """

    def __init__(self, hand: ScannedHand, rng: np.random.Generator, variation: float) -> None:
        self._hand, self._rng, self._variation = hand, rng, variation
        self.stock, self._model = _learnt(hand)
        self.name, self.pitch, self.baseline_model = hand.name, hand.pitch, author_baselines(hand)
        self.repertoire = hand.repertoire
        self.space = float(self._model.spacing.gaps.mean[WORDS]) * hand.pitch  # the usual gap between words, x-heights

    def set_paragraph(self, words: Iterable[Choice]) -> Iterator[Unit[InkGlyph]]:
        """See `pages.Handwriting`; all words of the paragraph are set together, as one line."""
        choices = list(words)
        if not choices:
            return
        model, rng, variation = self._model, self._rng, self._variation
        numbers = np.concatenate([choice.numbers for choice in choices])
        first = np.cumsum([0, *(len(choice.numbers) for choice in choices)])
        starts = np.zeros(len(numbers), dtype=bool)
        starts[first[:-1]] = [choice.spaces > 0 for choice in choices]
        apart = model.spacing.between(numbers, starts, rng, variation)
        y = model.heights.heights_of(numbers, starts, rng, variation)
        bends = model.bends(numbers, rng, variation)
        apart = resolve_collisions(model.spacing, numbers, starts, apart, y, bends) * self.pitch
        x = np.concatenate([[0.0], np.cumsum(apart)])
        extents = x[:, None] + model.reach(numbers, bends) * self.pitch
        for choice, a, b in zip(choices, first.tolist(), first[1:].tolist(), strict=False):
            begin, end = float(extents[a, 0]), float(extents[b - 1, 1])
            own = extents[a:b] - begin
            followed = b < len(x) and not starts[b]
            word = Word(
                glyphs=tuple(
                    map(InkGlyph, numbers[a:b].tolist(), (x[a:b] - begin).tolist(), y[a:b].tolist(), bends[a:b])
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

    def place(
        self, words: Sequence[Word[InkGlyph]], starts: Sequence[float], scale: float, to_page: ToPage
    ) -> Iterator[Placed]:
        """See `pages.Handwriting`."""
        unit = self.pitch * scale  # mm of one unit of line space
        glyphs = [
            (i, start, glyph)
            for i, (word, start) in enumerate(zip(words, starts, strict=True))
            for glyph in word.glyphs
        ]
        centres = np.array([((start + glyph.x * scale) / unit, glyph.y) for _, start, glyph in glyphs])
        apart = [i == 0 and not word.glued for word in words for i in range(len(word.glyphs))]
        forms = [self._model.forms[glyph.number] for _, _, glyph in glyphs]
        bends = [glyph.bend for _, _, glyph in glyphs]
        numbers = [glyph.number for _, _, glyph in glyphs]
        graphs = set_line(forms, bends, centres, self._model.joints(numbers, apart), self._model.spread.x_height)
        letters = [letter for word in words for letter in zip(word.at, word.spelt, strict=True)]
        for (number, _, glyph), graph, (at, letter) in zip(glyphs, graphs, letters, strict=True):
            source = self._hand.glyphs[glyph.number]
            laid = LineGraph(to_page(graph.xy * unit), graph.radius * unit, graph.density, graph.uv, graph.edges)
            yield Placed(
                Glyph(letter, (), (), 0.0), (), source.before >= 0, number, at, Ink(laid, source.page, glyph.number)
            )
