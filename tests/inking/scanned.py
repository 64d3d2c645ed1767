"""Manuscripts of a scanned hand's own glyphs, moved about."""

from collections.abc import Callable, Iterable

import numpy as np
from scipy.spatial import cKDTree

from handout.hand.scanned import ScannedHand
from handout.values import Glyph, Ink, Line, LineGraph, Manuscript, Page, Placed

Move = Callable[[np.ndarray], np.ndarray]


def stay(xy: np.ndarray) -> np.ndarray:
    return xy


def ink(hand: ScannedHand, number: int, move: Move = stay, larger: float = 1.0) -> Ink:
    """A glyph with the whole of its ligatures."""
    glyph = hand.glyphs[number]
    ways = [way.path for way in glyph.ligatures]
    if glyph.before >= 0:
        ways += [way.path for way in hand.glyphs[glyph.before].ligatures]
    part = hand.pages[glyph.page].graph.take(np.unique(np.concatenate([glyph.vertices, *ways])))
    moved = LineGraph(move(part.xy), part.radius * larger, part.density, part.uv, part.edges)
    return Ink(moved, glyph.page, number)


def page_of(hand: ScannedHand, number: int = 0) -> Page:
    page = hand.pages[number]
    return Page(page.shape[1] * page.pixel, page.shape[0] * page.pixel)


def written(inks: Iterable[Ink], page: Page, words: Iterable[int] | None = None) -> Manuscript:
    inks = list(inks)
    words = [0] * len(inks) if words is None else words
    glyph = Glyph("x", (), (), 1.0)
    placed = [Placed(glyph, (), False, word, at, one) for at, (one, word) in enumerate(zip(inks, words, strict=True))]
    return Manuscript((Line("", tuple(placed), 10.0),), page, 2.0)


def whole(hand: ScannedHand, move: Move = stay) -> Manuscript:
    """A page written again with all its own glyphs."""
    numbers = range(len(hand.glyphs))
    return written([ink(hand, n, move) for n in numbers], page_of(hand), [hand.glyphs[n].word for n in numbers])


def letters(hand: ScannedHand, number: int = 0) -> np.ndarray:
    """(n,) bool: vertices of a page that belong to a letter; the edge of the sheet does not."""
    own = np.zeros(len(hand.pages[number].graph), dtype=bool)
    for glyph in hand.glyphs:
        own[glyph.vertices] = True
    return own


def owners(hand: ScannedHand, number: int = 0) -> np.ndarray:
    """(h, w) int: the nearest vertex of every inked pixel of a page, −1 where there is no ink."""
    inked = picture(hand, number)[..., 3] > 0
    near = np.full(inked.shape, -1)
    near[inked] = cKDTree(hand.pages[number].graph.uv).query(np.argwhere(inked)[:, ::-1])[1]
    return near


def picture(hand: ScannedHand, number: int = 0) -> np.ndarray:
    """(h, w, 4) uint8: all ink of a page where it was."""
    page = hand.pages[number]
    full = np.zeros((*page.shape, 4), dtype=np.uint8)
    (x, y), (h, w) = page.texture.corner, page.texture.shape
    full[y : y + h, x : x + w] = page.texture.rgba
    return full
