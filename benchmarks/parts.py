"""Text written in a scanned hand with parts of the writing switched off, as the paper's Appendix F does it.

Nothing of this is in the product: what is switched off is replaced for as long as a text is written.

Source: seed 000, §8 and Appendix F.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import ScannedHand
from handout.inking.layers import GlyphLayer
from handout.inking.pen_replacement import ink_drawing
from handout.inking.plain import flatten
from handout.values import Array, Indices, LineGraph, Manuscript, Page
from handout.writing import glyph_index, scanned_words, word_layout
from handout.writing.bending import Bend, unbent
from handout.writing.choosing import GlyphChooser
from handout.writing.compose import compose
from handout.writing.forms import Forms, GlyphLine
from handout.writing.glyph_index import WEIGHTS
from handout.writing.layout import Layout
from handout.writing.neighbours import neighbours
from handout.writing.spacing import HeightModel, SpacingModel
from handout.writing.variation import Chances
from handout.writing.word_layout import LayoutModel

DPI = 300.0
LUMA = np.array([0.299, 0.587, 0.114])
_WIDE, _BORDER = 1.6, 15.0  # of the longest line, and mm: no line of the text may be broken

Grey = NDArray[np.uint8]


def write(hand: ScannedHand, text: str, seed: int, *, seams: bool = True, **switches: Any) -> list[Grey]:
    """Pages (h, w) uint8 at 300 dpi of a text at the hand's own size, on white; lines stay as they are.

    seams : without them the ink that covers more is seen wherever glyphs overlap.
    switches : see `manuscripts`.
    """
    sheets = manuscripts(hand, text, seed, **switches)
    with ExitStack() as stack:
        if not seams:
            stack.enter_context(patch("handout.inking.texture.part_layers", over))
        return [grey(sheet, hand) for sheet in sheets]


def manuscripts(
    hand: ScannedHand,
    text: str,
    seed: int,
    *,
    variation: float = 1.0,
    choice: str = "best",
    fit: bool = True,
    likeness: bool = True,
    spacing: str = "learned",
    heights: str = "learned",
    ligatures: bool = True,
    bending: bool = True,
) -> list[Manuscript]:
    """The same without ink.

    Parameters
    ----------
    choice : "best", or "random": any glyph of the letter, wherever in a word it stood.
    fit : without it any ligature is as good as any other, wherever on the line they lie; for the best choice alone.
    likeness : without it neighbours need not be alike in size, slant, width and darkness; for the best choice alone.
    spacing : "learned", or "constant": the same gap between the bounds of all bodies, and one between words, bent or
        not, and nothing is settled.
    heights : "learned", or "source": each glyph as high over the line as it stood on its page.
    ligatures : without them bodies alone are written.
    bending : without it glyphs are as they were on the page; the paper has none.
    """
    parts: list[tuple[object, str, object]] = []
    if choice == "random":
        parts.append((GlyphChooser, "_cheapest", any_glyphs))
    blind = [name for name, seen in (("fit", fit), ("unlike", likeness)) if not seen]
    # an index keeps the costs that it has worked out: this one is asked only here, and nothing was set before
    index, model = scanned_words._learnt(hand)[:2]
    given = lambda _: replace(index), lambda _: model
    with patch.multiple(scanned_words, index_glyphs=given[0], layout_model=given[1]):
        anew = scanned_words._learnt.__wrapped__(hand)
    parts.append((scanned_words, "_learnt", lambda hand: anew))
    if blind:
        parts.append((glyph_index, "WEIGHTS", replace(WEIGHTS, **dict.fromkeys(blind, 0.0))))
    if spacing == "constant":
        parts.append((SpacingModel, "between", constant_gaps))
        parts.append((word_layout, "resolve_collisions", constant_still))
    if heights == "source":
        parts.append((HeightModel, "heights_of", source_heights))
    if not ligatures:
        parts.append((word_layout, "set_line", bodies_alone))
    if not bending:
        parts.append((word_layout, "_bent", stiff))
    with ExitStack() as stack:
        for place, name, instead in parts:
            stack.enter_context(patch.object(place, name, instead))
        return compose(text, hand, own_size(hand, text, variation), np.random.default_rng(seed))


def grey(sheet: Manuscript, hand: ScannedHand, dpi: float = DPI) -> Grey:
    """Luma of a page on white."""
    ink = ink_drawing(sheet, hand).ink
    assert ink is not None
    return np.asarray(np.rint(flatten(ink(dpi)) @ LUMA), dtype=np.uint8)


def own_size(hand: ScannedHand, text: str, variation: float = 1.0) -> Layout:
    """A page on which no line of the text is broken, written as large as the hand's own pages are."""
    lines = text.split("\n")
    widest = max(map(len, lines)) * hand.x_height * _WIDE
    high = (len(lines) + 2) * hand.pitch * hand.x_height
    page = Page(widest + 2 * _BORDER, high + 2 * _BORDER, "own")
    return Layout(page, (_BORDER,) * 4, x_height=hand.x_height, jitter=variation)


def any_glyphs(
    chooser: GlyphChooser, numbers: Sequence[Indices], unary: list[Array], again: list[Array], steps: Sequence[Array]
) -> Indices:
    """(n,) Random selection: of every letter any glyph, as likely as any other.  See `GlyphChooser._cheapest`."""
    stock = chooser._stock
    assert isinstance(stock, glyph_index.GlyphIndex)
    letters = [stock.letters[int(each[0])] for each in numbers]
    rng = np.random.default_rng([*chooser._seeds[0], len(chooser._written)])
    return np.array([rng.choice(stock.of(letter)) for letter in letters], dtype=np.intp)


def constant_gaps(
    model: SpacingModel, numbers: Indices, new_word: NDArray[np.bool_], chances: Chances, variation: float
) -> Array:
    """(n − 1,) Distances of centres with which all bodies of a word are equally far apart.  See `SpacingModel.between`.

    The two gaps, within words and between them, are the middle ones of the hand's own pages.
    """
    bounds, x = _bounds(model.forms), model.forms.centre[:, 0]
    beside, usual = neighbours(model.forms.hand, x), []
    for between in (False, True):
        first, second = beside.pairs(between).T
        found = x[second] + bounds[second, 0] - x[first] - bounds[first, 1]
        usual.append(float(np.median(found)) if len(found) else 0.05 + 0.25 * between)
    wide = np.take(usual, new_word[1:].astype(np.intp))
    return np.asarray(wide + bounds[numbers[:-1], 1] - bounds[numbers[1:], 0])


def constant_still(
    spacing: SpacingModel,
    numbers: Indices,
    new_word: NDArray[np.bool_],
    apart: Array,
    y: Array,
    bends: Sequence[Bend],
) -> Array:
    """(n − 1,) The same gaps between the bounds of bodies that are bent.  See `spacing.resolve_collisions`."""
    forms = [spacing.forms[int(number)] for number in numbers]
    bent = [_ends(bend(form.xy), form.radius) for form, bend in zip(forms, bends, strict=True)]
    wider = np.array(bent) - [_ends(form.xy, form.radius) for form in forms]
    return np.asarray(apart + wider[:-1, 1] - wider[1:, 0])


def source_heights(
    model: HeightModel, numbers: Indices, new_word: NDArray[np.bool_], chances: Chances, variation: float
) -> Array:
    """(n,) Heights of centres as they were in the source.  See `HeightModel.heights_of`."""
    return np.asarray(model.height[numbers])


def bodies_alone(
    forms: Sequence[GlyphLine], bends: Sequence[Bend], centres: Array, joints: object, x_height: float
) -> list[LineGraph]:
    """Glyphs without any ligature.  See `joining.set_line`."""
    return [
        LineGraph(bent(form.xy) + centre, form.radius, form.density, form.uv, form.edges)
        for form, bent, centre in zip(forms, bends, centres, strict=True)
    ]


def stiff(model: LayoutModel, number: int, drift: tuple[float, ...], seed: int, variation: float) -> Bend:
    """A glyph as it was on the page.  See `word_layout.LayoutModel.bends`."""
    return unbent()


def over(layers: Sequence[GlyphLayer]) -> list[GlyphLayer]:
    """Layers as they are.  See `layers.part_layers`."""
    return list(layers)


def _bounds(forms: Forms) -> Array:
    """(n, 2) How far the body of each glyph reaches left (negative) and right of its centre."""
    return np.array([_ends(forms[number].xy, forms[number].radius) for number in range(len(forms))])


def _ends(xy: Array, radius: Array) -> tuple[float, float]:
    return float((xy[:, 0] - radius).min()), float((xy[:, 0] + radius).max())
