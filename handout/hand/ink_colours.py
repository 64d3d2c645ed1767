"""The colours of the inks that a hand's pages are written in, to draw its strokes with.

Source: own method; the colour of an ink is that of the middle of strokes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from handout import hues
from handout.hand.scanned import ScannedHand
from handout.values import Array, Indices

_SHARE = 0.02  # of a page's letters, for an ink of its own: fewer are taken for one of the others
_SAME = 0.1  # distance of RGB in 0–1 below which two pages are written in one ink: scans differ by as much


@dataclass(frozen=True, eq=False)
class InkColours:
    """The inks of a hand, that of most letters first.

    colours : ``"#rrggbb"`` of each, as it looks on white paper, device RGB of the scan.
    of : (n,) int: the ink of every glyph of the hand.
    """

    colours: tuple[str, ...]
    of: Indices


@lru_cache(maxsize=4)
def ink_colours(hand: ScannedHand) -> InkColours:
    """The inks that the letters of a hand are written in; of a hand without letters, those of all that is drawn."""
    if hand.glyphs:
        pieces = [(glyph.page, glyph.vertices) for glyph in hand.glyphs]
    else:
        pieces = [(number, np.arange(len(page.graph))) for number, page in enumerate(hand.pages)]
    colour = np.full((len(pieces), 3), np.nan)
    group = np.full(len(pieces), -1, dtype=np.intp)
    page_of = np.array([page for page, _ in pieces], dtype=np.intp)
    for number in range(len(hand.pages)):
        own = np.flatnonzero(page_of == number)
        colour[own] = _usual(hand, number, [pieces[i][1] for i in own])
        known = own[np.isfinite(colour[own, 0])]
        group[known] = _kinds(colour[known]) + group.max() + 1
    inks = _merged(colour, group)
    of = np.zeros(len(pieces), dtype=np.intp)
    for number, members in enumerate(inks):
        of[members] = number
    return InkColours(tuple(_named(np.median(colour[members], axis=0)) for members in inks), of)


def _usual(hand: ScannedHand, number: int, pieces: list[Indices]) -> Array:
    """(k, 3), 0–1: the median colour along each piece of a page's line, laid on white; nan without ink."""
    page = hand.pages[number]
    rgba = page.texture.load()  # not kept: a page is large
    at = np.rint(page.graph.uv - np.array(page.texture.corner)).astype(np.intp)
    height, width = page.texture.shape
    inside = ((at >= 0) & (at < (width, height))).all(axis=1)
    pixels = np.zeros((len(at), 4))
    pixels[inside] = rgba[at[inside, 1], at[inside, 0]] / 255
    seen = 1 - pixels[:, 3:] * (1 - pixels[:, :3])
    inky = pixels[:, 3] > 0
    found = [seen[piece[inky[piece]]] for piece in pieces]
    return np.array([np.median(some, axis=0) if len(some) else np.full(3, np.nan) for some in found]).reshape(-1, 3)


def _kinds(colours: Array) -> Indices:
    """Which of a page's inks each of its letters (n, 3) is written in, from 0."""
    if not len(colours):
        return np.zeros(0, dtype=np.intp)
    away = colours - 1
    directions = away / np.maximum(np.linalg.norm(away, axis=1), 1e-9)[:, None]
    return _large(hues.kinds(directions, _SHARE), directions)


def _large(kind: Indices, directions: Array) -> Indices:
    """The kinds, with those of very few members joined to the nearest of the others, numbered from 0."""
    count = np.bincount(kind)
    large = np.flatnonzero(count >= max(_SHARE * len(kind), 1))
    centres = np.stack([directions[kind == number].mean(axis=0) for number in large])
    nearest = np.argmax(directions @ centres.T, axis=1)
    place = np.full(len(count), -1, dtype=np.intp)
    place[large] = np.arange(len(large))
    return np.where(place[kind] >= 0, place[kind], nearest)


def _merged(colour: Array, group: Indices) -> list[Indices]:
    """Members of each ink, the largest first: groups of the pages whose colours are alike are one ink."""
    groups = [np.flatnonzero(group == number) for number in range(int(group.max(initial=-1)) + 1)]
    inks: list[Indices] = []
    for members in sorted(groups, key=lambda some: -len(some)):
        middle = np.median(colour[members], axis=0)
        for number, others in enumerate(inks):
            if np.linalg.norm(np.median(colour[others], axis=0) - middle) < _SAME:
                inks[number] = np.concatenate([others, members])
                break
        else:
            inks.append(members)
    return sorted(inks, key=lambda some: -len(some))


def _named(colour: NDArray[np.float64]) -> str:
    return "#" + "".join(f"{round(255 * float(part)):02x}" for part in colour)
