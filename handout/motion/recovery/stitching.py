"""Movements of a joined hand that go on in one another over ink that is there already.

Where a stem is gone over twice, or a letter is closed by retracing, the line shows one way only, and it is easily taken
for the end of a movement.  Who joins letters does not lift the pen there: it goes back over its own ink.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TypeAlias

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from handout.motion.recovery.failing import bridges
from handout.motion.recovery.network import complexes
from handout.motion.recovery.placing import PlacedGlyph
from handout.values import Indices

_GRAIN = 1e-5  # mm: places nearer to one another are one
_FAILED = 2.0  # so much longer a way without ink counts
Part: TypeAlias = "tuple[PlacedGlyph, Indices]"


class Ink:
    """The line of a whole word, letters and ligatures in one.

    rate : share of letters that the hand joins to the next.
    """

    def __init__(self, glyphs: Sequence[PlacedGlyph], rate: float) -> None:
        self._glyphs = glyphs
        self._first = np.cumsum([0, *(len(glyph.graph) for glyph in glyphs)])
        self._number = {id(glyph): k for k, glyph in enumerate(glyphs)}
        xy = np.concatenate([glyph.graph.xy for glyph in glyphs])
        # complex numbers are sorted far faster than pairs
        _, self._one, self._of = np.unique(complexes(np.rint(xy / _GRAIN)), return_index=True, return_inverse=True)
        edges = self._of[np.concatenate([g.graph.edges + f for g, f in zip(glyphs, self._first[:-1], strict=True)])]
        place = xy[self._one]
        length = np.hypot(*(place[edges[:, 0]] - place[edges[:, 1]]).T) + 1e-9
        count = len(place)
        # an edge that two letters share is there once
        _, kept = np.unique(edges.min(axis=1) * count + edges.max(axis=1), return_index=True)
        pairs = np.sort(edges[kept], axis=1)
        radius = np.concatenate([glyph.graph.radius for glyph in glyphs])
        owner = np.repeat(np.arange(len(glyphs)), np.diff(self._first))[self._one]
        over = bridges(place, radius[self._one], pairs, float(np.median(radius)), owner, rate)
        far = np.hypot(*(place[over[:, 0]] - place[over[:, 1]]).T)
        pairs, length = np.concatenate([pairs, over]), np.concatenate([length[kept], _FAILED * far])
        self._lengths = csr_array((length, (pairs[:, 0], pairs[:, 1])), shape=(count, count))

    def way(self, before: Part, after: Part, most: float) -> list[Part] | None:
        """The shortest way over ink from the end of one part to the start of another; None if longer than `most` mm."""
        here, there = self._at(before, -1), self._at(after, 0)
        if here == there:
            return []
        far, back = dijkstra(self._lengths, directed=False, indices=there, limit=most, return_predecessors=True)
        if not np.isfinite(far[here]):
            return None
        nodes = []
        node = int(back[here])
        while node != there:
            nodes.append(node)
            node = int(back[node])
        return self._parts(nodes)

    def _at(self, part: Part, index: int) -> int:
        glyph, vertices = part
        return int(self._of[self._first[self._number[id(glyph)]] + vertices[index]])

    def _parts(self, nodes: Sequence[int]) -> list[Part]:
        owned = self._one[nodes]
        whose = np.searchsorted(self._first, owned, side="right") - 1
        return [
            (self._glyphs[k], np.array([v - self._first[k] for v, _ in some], dtype=np.intp))
            for k, some in groupby(zip(owned.tolist(), whose.tolist(), strict=True), key=lambda one: one[1])
        ]
