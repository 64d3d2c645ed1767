"""Text written in a scanned hand with parts of the writing switched off, as the paper's Appendix F does it.

Nothing of this is in the product: what is switched off is replaced for as long as a text is written.

Source: seed 000, §8 and Appendix F.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.hand.scanned import ScannedHand
from handout.inking.layers import Layer
from handout.inking.pen_replacement import drawn
from handout.inking.plain import flatten
from handout.values import Array, Indices, LineGraph, Manuscript, Page
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout.writing.scanned.bending import Bend, Spread, bend
from handout.writing.scanned.candidates import TargetLetter, check_letters, substitute_letter
from handout.writing.scanned.choice_costs import WEIGHTS, UsageHistory
from handout.writing.scanned.choosing import choose
from handout.writing.scanned.forms import Form
from handout.writing.scanned.glyph_index import GlyphIndex
from handout.writing.scanned.layout_model import LayoutModel
from handout.writing.scanned.spacing import SpacingModel

DPI = 300.0
LUMA = np.array([0.299, 0.587, 0.114])
_WRITER, _LAYOUT = (f"handout.writing.scanned.{room}" for room in ("line_writer", "layout_model"))
_WEIGHTS = "handout.writing.scanned.choice_costs.WEIGHTS"
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
            stack.enter_context(patch("handout.inking.texture.parted", over))
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
    blind = [name for name, seen in (("fit", fit), ("unlike", likeness)) if not seen]
    parts = {
        "choose": any_glyphs if choice == "random" else bool(blind) and partial(blindly, blind=blind),
        "gaps": spacing == "constant" and constant_gaps,
        "resolve_collisions": spacing == "constant" and constant_still,
        "heights": heights == "source" and source_heights,
        "set_line": not ligatures and bodies_alone,
    }
    with ExitStack() as stack:
        for name, instead in parts.items():
            if instead:
                stack.enter_context(patch(f"{_WRITER}.{name}", instead))
        if not bending:
            stack.enter_context(patch(f"{_LAYOUT}.bend", stiff))
        return compose(text, hand, own_size(hand, text, variation), np.random.default_rng(seed))


def grey(sheet: Manuscript, hand: ScannedHand, dpi: float = DPI) -> Grey:
    """Luma of a page on white."""
    ink = drawn(sheet, hand).ink
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
    stock: GlyphIndex,
    wanted: Sequence[TargetLetter],
    rng: np.random.Generator,
    *,
    variation: float = 1.0,
    history: UsageHistory | None = None,
) -> Indices:
    """(n,) Random selection: of every letter any glyph, as likely as any other.  See `choosing.choose`."""
    check_letters(stock, wanted)
    return np.array([rng.choice(stock.of(substitute_letter(stock, one.letter))) for one in wanted], dtype=np.intp)


def blindly(
    stock: GlyphIndex,
    wanted: Sequence[TargetLetter],
    rng: np.random.Generator,
    *,
    variation: float = 1.0,
    history: UsageHistory | None = None,
    blind: Sequence[str],
) -> Indices:
    """(n,) The best glyphs, were some of the weights of `choice_costs` nothing.  See `choosing.choose`."""
    with ExitStack() as stack:
        stack.enter_context(patch(_WEIGHTS, replace(WEIGHTS, **dict.fromkeys(blind, 0.0))))
        # a stock keeps the costs that it has worked out: this one is asked only here
        return choose(replace(stock), wanted, rng, variation=variation, history=history)


def constant_gaps(
    manner: LayoutModel, numbers: ArrayLike, new_word: ArrayLike, rng: np.random.Generator, variation: float = 1.0
) -> Array:
    """(n − 1,) Distances of centres with which all bodies of a word are equally far apart.  See `layout_model.gaps`.

    The two gaps, within words and between them, are the middle ones of the hand's own pages.
    """
    glyphs, parted = np.asarray(numbers, dtype=np.intp), np.asarray(new_word, dtype=bool)[1:]
    bounds, x = _bounds(manner), manner.forms.centre[:, 0]
    usual = []
    for between in (False, True):
        first, second = manner.neighbours.pairs(between).T
        found = x[second] + bounds[second, 0] - x[first] - bounds[first, 1]
        usual.append(float(np.median(found)) if len(found) else 0.05 + 0.25 * between)
    return np.asarray(np.take(usual, parted.astype(np.intp)) + bounds[glyphs[:-1], 1] - bounds[glyphs[1:], 0])


def constant_still(
    spacing: SpacingModel,
    numbers: Indices,
    new_word: NDArray[np.bool_],
    apart: Array,
    y: Array,
    bends: Sequence[Bend],
) -> Array:
    """(n − 1,) The same gaps between the bounds of bodies that are bent.  See `layout_model.resolve_collisions`."""
    forms = [spacing.forms[int(number)] for number in numbers]
    bent = [_ends(bend(form.xy), form.radius) for form, bend in zip(forms, bends, strict=True)]
    wider = np.array(bent) - [_ends(form.xy, form.radius) for form in forms]
    return np.asarray(apart + wider[:-1, 1] - wider[1:, 0])


def source_heights(
    manner: LayoutModel, numbers: ArrayLike, new_word: ArrayLike, rng: np.random.Generator, variation: float = 1.0
) -> Array:
    """(n,) Heights of centres as they were in the source.  See `setting.heights`."""
    return np.asarray(manner.forms.centre[np.asarray(numbers, dtype=np.intp), 1])


def bodies_alone(
    manner: LayoutModel,
    numbers: ArrayLike,
    x: ArrayLike,
    y: ArrayLike,
    new_word: ArrayLike,
    bends: Sequence[Bend],
) -> list[LineGraph]:
    """Glyphs without any ligature.  See `setting.set_line`."""
    centres = np.column_stack([np.asarray(x, dtype=float), np.asarray(y, dtype=float)])
    forms = [manner.forms[int(number)] for number in np.asarray(numbers)]
    return [
        LineGraph(bent(form.xy) + centre, form.radius, form.density, form.uv, form.edges)
        for form, bent, centre in zip(forms, bends, centres, strict=True)
    ]


def stiff(
    form: Form, number: int, spread: Spread, height: float, rng: np.random.Generator, variation: float = 1.0
) -> Bend:
    """A glyph as it was on the page.  See `bending.bend`."""
    return bend(form, number, spread, height, rng, 0.0)


def over(a: Layer, b: Layer, *, gradient: float = 0.0) -> tuple[Layer, Layer]:
    """Two layers as they are.  See `seams.parted`."""
    return a, b


def _bounds(manner: LayoutModel) -> Array:
    """(n, 2) How far the body of each glyph reaches left (negative) and right of its centre."""
    forms = (manner.forms[number] for number in range(len(manner.forms)))
    return np.array([_ends(form.xy, form.radius) for form in forms])


def _ends(xy: Array, radius: Array) -> tuple[float, float]:
    return float((xy[:, 0] - radius).min()), float((xy[:, 0] + radius).max())
