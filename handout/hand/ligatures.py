"""Where the pen goes from one letter to the next: the paths of ligatures in a line graph.

A ligature is cut where two letters meet.  It is the stroke that rises there from one letter to the next: from the turn
where the first letter's last stroke has come down, to the turn at the top where the next one's first stroke goes down,
a junction or an end.  Strokes that go down are the letters' own: the last leg of the n in "and", were it taken for a
part of the way to d, would come along to every other letter before that d.  Where nothing rises (after o and b) it
runs level as far as it goes; after v and w, whose own last stroke rises, it begins at their top.

Lengths were set by eye on one page (csafe w0076).  Of 599 words in the hands of six other people (csafe w0087 w0139
w0182 w0277 w0471 w0515), read letter by letter by readers who did not know them, 59 were misread; 93 where ways ran on
into the letters.  That was before v and w were told apart, which was set by eye on house-joined-ballpoint.

Source: seed 000, §5.1.3, §6.4.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from handout.hand.letter_classes import ENDING_HIGH
from handout.hand.scanned import NOBODY, Ligature, ScannedGlyph, ScannedPage
from handout.peaks import peaks
from handout.values import Array, Indices

_BEFORE, _BEYOND = 1.1, 0.6  # x-heights of path before and beyond the joint: down to the line, and not all of an e
_TURN = 0.06  # x-heights back: a stroke that turns belongs to its letter from there on
_NEAR = 0.35  # x-heights of path from a cut to the stroke that rises: cuts lie on either side of its ends
_HIGH = 0.5  # x-heights: a way that begins higher goes down to nothing, a lower one comes down from nothing


def find_again(
    glyphs: Sequence[ScannedGlyph], pages: Sequence[ScannedPage], changed: Collection[int] | None = None
) -> tuple[ScannedGlyph, ...]:
    """Glyphs with their ligatures to the next as they are found now, whatever they had.

    changed : numbers of the glyphs whose ligatures, on both sides, are found; None: all.
    """
    owners = [np.full(len(page.graph), NOBODY) for page in pages]
    for number, glyph in enumerate(glyphs):
        owners[glyph.page][glyph.vertices] = number
    finders = [LigatureFinder(page, owner) for page, owner in zip(pages, owners, strict=True)]
    return tuple(
        glyph
        if glyph.after == NOBODY or not (changed is None or number in changed or glyph.after in changed)
        else replace(glyph, ligatures=finders[glyph.page].ligatures_between(number, glyph, glyph.after))
        for number, glyph in enumerate(glyphs)
    )


class LigatureFinder:
    """The ligatures of one page, found from which glyph each vertex belongs to.

    owner : (n,) int: number of each vertex's glyph, −1 for none; it is looked at anew each time.
    """

    def __init__(self, page: ScannedPage, owner: Indices) -> None:
        self._page = page
        self._owner = owner
        self._beside, self._begin = page.graph.neighbour_lists
        self._unit = page.x_height / page.pixel

    def ligatures_between(self, first: int, glyph: ScannedGlyph, second: int) -> tuple[Ligature, ...]:
        """The ways from a glyph, of number `first`, to glyph `second`, the lowest first; none leads to ink of both."""
        paths: list[list[int]] = []
        # the edges from one glyph to the other, in the same order from either side
        vertices = np.flatnonzero(self._owner == first)
        count = self._begin[vertices + 1] - self._begin[vertices]
        beside = self._beside[
            np.repeat(self._begin[vertices] - np.cumsum(count) + count, count) + np.arange(count.sum())
        ]
        there = (self._owner[beside] == second) & ~np.isin(beside, glyph.vertices)
        across = zip(np.repeat(vertices, count)[there].tolist(), beside[there].tolist(), strict=True)
        for v, w in sorted(across, key=lambda edge: (min(edge), max(edge))):
            path = self._find_way(v, w, glyph)
            # where strokes meet at a joint, several edges lead across: one way is enough
            if all(len(set(path) & set(other)) < len(path) / 2 for other in paths):
                paths.append(path)
        ways = [self._page.ligature(glyph.line, path) for path in paths]
        return tuple(sorted(ways, key=lambda way: (way.start[1], int(way.path[0]))))

    def _find_way(self, v: int, w: int, glyph: ScannedGlyph) -> list[int]:
        """The vertices of the way over the edge from a vertex of one letter to one of the next."""
        before = list(self._follow_stroke(v, w))
        path, cut = [*before[::-1], *self._follow_stroke(w, v)], len(before) - 1
        uv = self._page.graph.uv[path]
        run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(uv, axis=0).T))]) / self._unit
        height = self._page.to_line(glyph.line, uv)[:, 1] * self._page.unit / self._unit
        turns = sorted({0, *peaks(height, prominence=_TURN), *peaks(-height, prominence=_TURN), len(path) - 1})
        rising = [(i, j) for i, j in pairwise(turns) if height[j] > height[i]]
        away = [max(run[i] - run[cut + 1], run[cut] - run[j], 0.0) for i, j in rising]
        if glyph.letter in ENDING_HIGH:
            joint, (first, last) = cut, _from_top(turns, height, cut)
        elif rising and min(away) <= _NEAR:
            first, last = rising[int(np.argmin(away))]
            joint = min(max(cut, first), last)
        else:
            joint, high = cut, height[cut] > _HIGH
            low, over = np.flatnonzero(height < height[cut] - _TURN), np.flatnonzero(height > height[cut] + _TURN)
            first = 0 if high else max((k + 1 for k in over.tolist() if k < cut), default=0)
            last = min((k - 1 for k in low.tolist() if k > cut and high), default=len(path) - 1)
        first = max(first, int(np.searchsorted(run, run[joint] - _BEFORE)))
        last = min(last, int(np.searchsorted(run, run[joint] + _BEYOND, side="right")) - 1)
        return path[min(first, cut) : max(last, cut + 1) + 1]

    def _follow_stroke(self, vertex: int, before: int) -> Iterator[int]:
        """Vertices of one letter along a stroke, up to the next junction or end, or as far as a ligature may reach."""
        letter, length = self._owner[vertex], 0.0
        uv = self._page.graph.uv
        while True:
            yield vertex
            around = self._beside[self._begin[vertex] : self._begin[vertex + 1]].tolist()
            ahead = [v for v in around if v != before]
            if len(ahead) != 1 or self._owner[ahead[0]] != letter:
                return
            length += float(np.hypot(*(uv[ahead[0]] - uv[vertex])))
            if length > (_BEFORE + _NEAR) * self._unit:
                return
            before, vertex = vertex, ahead[0]


def _from_top(turns: Sequence[int], height: Array, cut: int) -> tuple[int, int]:
    """From which to which of its turns a way runs that begins at the top of its letter, or at the cut if that is it."""
    before, beyond = [k for k in turns if k <= cut], [k for k in turns if k > cut]
    tops = [k for k in before if height[k] >= height[cut]]
    first = tops[-1] if tops else cut
    last = beyond[0]
    dips = _HIGH < height[last] < height[cut]
    if dips and len(beyond) > 1:  # and goes up again
        last = beyond[1]
    return first, last
