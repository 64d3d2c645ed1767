"""Where the pen goes from one letter to the next: the paths of ligatures in a line graph.

A ligature is cut where two letters meet, and reaches from there into both of them: as far as the stroke runs on without
a junction or an end, and without turning back up or down, and no further than a part of the height of small letters.

Source: seed 000, §5.1.3, §6.4.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from handout.hand.scanned import Ligature, ScannedPage
from handout.values import Indices

_REACH = 0.6  # x-heights of path on either side of the joint
_TURN = 0.06  # x-heights back: a stroke that turns belongs to its letter from there on


class LigatureFinder:
    """The ligatures of one page, found from which glyph each vertex belongs to.

    owner : (n,) int: number of each vertex's glyph, −1 for none; it is looked at anew each time.
    """

    def __init__(self, page: ScannedPage, owner: Indices) -> None:
        self._page = page
        self._owner = owner
        self._beside, self._begin = page.graph.neighbour_lists
        self._unit = page.x_height / page.pixel

    def ligatures_between(self, first: int, second: int, line: int) -> tuple[Ligature, ...]:
        """The ways from glyph `first` to glyph `second`, from the lowest upwards."""
        paths: list[list[int]] = []
        # the edges from one glyph to the other, in the same order from either side
        vertices = np.flatnonzero(self._owner == first)
        count = self._begin[vertices + 1] - self._begin[vertices]
        beside = self._beside[
            np.repeat(self._begin[vertices] - np.cumsum(count) + count, count) + np.arange(count.sum())
        ]
        there = self._owner[beside] == second
        across = zip(np.repeat(vertices, count)[there].tolist(), beside[there].tolist(), strict=True)
        for v, w in sorted(across, key=lambda edge: (min(edge), max(edge))):
            path = [*self._walk(v, w, line)[::-1], *self._walk(w, v, line)]
            # where strokes meet at a joint, several edges lead across: one way is enough
            if all(len(set(path) & set(other)) < len(path) / 2 for other in paths):
                paths.append(path)
        ways = [self._page.ligature(line, path) for path in paths]
        return tuple(sorted(ways, key=lambda way: (way.start[1], int(way.path[0]))))

    def _walk(self, start: int, before: int, line: int) -> list[int]:
        """The vertices from a joint into its letter, as far as the ligature goes."""
        path = list(self._follow_stroke(start, before))
        height = self._page.to_line(line, self._page.graph.uv[path])[:, 1] * self._page.unit / self._unit
        for sign in (1.0, -1.0):
            up = sign * height
            top = np.maximum.accumulate(up)
            turned = (top - up > _TURN) & (top - up[0] > _TURN)
            if turned.any():
                stop = int(np.argmax(up[: int(np.argmax(turned)) + 1]))
                return path[: stop + 1]
        return path

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
            if length > _REACH * self._unit:
                return
            before, vertex = vertex, ahead[0]
