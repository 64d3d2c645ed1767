"""How an author would enter a letter that he did not write, and leave it: as those of his letters that look like it
from that side.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.hand import measures
from handout.hand.scanned import ScannedHand
from handout.motion.timing import arc_length
from handout.values import Array
from handout.writing.forms import Forms, spread_evenly
from handout.writing.joining import cubic

_HEIGHTS = np.linspace(-0.5, 2.1, 14)  # x-heights over the baseline at which letters are compared
# set by eye on letters made for csafe w0154 w0238 and cvl 0013
_BAND = 0.15  # x-heights: half the height of the band that shows at each
_REACH = 0.7  # x-heights from the ligature's height, at which what letters look like counts 1/e
_INSIDE = 0.6  # x-heights: what lies further in than that is not seen from the side
_OUTER = 0.15  # x-heights that a ligature may begin inside its letter's side
_LEVEL = 0.12  # x-heights from a ligature's height to a place that it can begin at
_AT_END = 0.25  # x-heights from there to the end of a stroke that is taken for it
_LED = 0.35  # x-heights over which a ligature takes on the direction of the stroke that it goes on from
_ALIKE, _SOME, _COMPARED = 10, 6, 6  # ligatures that fit best; of those most like them one is taken; places compared


@dataclass(frozen=True, eq=False)
class NeighbourLigature:
    """A ligature to a letter's neighbour.

    xy : (n, 2) line space, from the letter outwards; the first place is where it touches the letter.
    own : how many of its places count as the letter's.
    stroke : of the letter's, that it goes on from, or comes to; -1: it begins beside an end.
    """

    xy: Array
    own: int
    stroke: int


class Links:
    """The ligatures of an author's letters on one side, with what each letter looks like from there.

    Parameters
    ----------
    leaving : whether they lead to the letter after.
    """

    def __init__(self, hand: ScannedHand, forms: Forms, *, leaving: bool) -> None:
        self._leaving, self._x_height, self._slant = leaving, measures.x_height(hand), measures.slant(hand)
        ways = forms.connectors(leaving=leaving)
        self._ways, self._kept, self._shapes, self._heights = ways, list[int](), list[Array](), list[float]()
        for way in range(len(ways.of)):
            number = int(ways.of[way])
            if not hand.glyphs[number].letter.islower() or ways.lines.count[way] < 4:
                continue
            body = forms.bodies[number].xy + forms.centre[number]
            anchor = body[ways.anchor[way]]
            look = self._look(body)
            side = self._side(anchor)
            at = int(np.abs(_HEIGHTS * self._x_height - anchor[1]).argmin())
            if look[at] - side < _OUTER * self._x_height:
                self._kept.append(way)
                self._shapes.append(look - side)
                self._heights.append(float(anchor[1]))

    def _side(self, xy: Array) -> Array:
        """How far out places (…, 2) are on this side, line space, upright."""
        out = xy[..., 0] - self._slant * xy[..., 1]
        return np.asarray(out if self._leaving else -out)

    def _look(self, xy: Array) -> Array:
        """(heights,): how far out a line (n, 2) reaches at each height; −inf where it does not."""
        out, y = self._side(xy), xy[:, 1] / self._x_height
        near = np.abs(y[:, None] - _HEIGHTS) <= _BAND
        return np.asarray(np.where(near, out[:, None], -np.inf).max(axis=0))

    def link(self, strokes: Sequence[Array], joined: int, rng: np.random.Generator) -> NeighbourLigature | None:
        """A ligature for a letter of strokes (n, 2); None if none fits.

        joined : the stroke that is written on with the neighbour, where it ends on this side.
        """
        x_height, body = self._x_height, np.concatenate(list(strokes))
        if not self._kept:
            return None
        heights, look = np.array(self._heights), self._look(body)
        starts = [self._start(body, strokes, joined, height) for height in heights]
        sides = np.array([np.nan if start is None else self._side(start[0]) for start in starts])
        apart = np.clip(look - sides[:, None], -_INSIDE * x_height, None)
        apart -= np.clip(np.array(self._shapes), -_INSIDE * x_height, None)
        weight = np.exp(-np.abs(_HEIGHTS - heights[:, None] / x_height) / _REACH)
        cost = (np.minimum(np.abs(apart), x_height) * weight).sum(axis=1) / weight.sum(axis=1)
        some = np.argsort(np.where(np.isnan(cost), np.inf, cost), kind="stable")[:_ALIKE]
        some = some[~np.isnan(cost[some])]
        if not len(some):
            return None
        # those that are most like all others of them come first
        lines = [self._ways.lines[self._kept[k]].xy[:: 1 if self._leaving else -1] for k in some.tolist()]
        each = np.array([spread_evenly(line - line[0], _COMPARED) for line in lines])
        between = np.hypot(*np.moveaxis(each[:, None] - each, -1, 0)).mean(axis=2)
        usual = some[np.median(between, axis=1).argsort(kind="stable")][:_SOME]
        which = int(usual[int(rng.integers(len(usual)))])
        start, way = starts[which], self._kept[which]
        assert start is not None
        line = self._ways.lines[way].xy[:: 1 if self._leaving else -1]
        line = line - line[0] + start[0]
        if start[1] >= 0:
            line = _lead_line(strokes[start[1]][:: 1 if self._leaving else -1], line, _LED * x_height)
        return NeighbourLigature(line, int(np.clip(self._ways.owned[way], 1, len(line) - 2)), start[1])

    def _start(self, body: Array, strokes: Sequence[Array], joined: int, height: float) -> tuple[Array, int] | None:
        """Where a ligature can begin at a height, and the number of the stroke that ends there, or else -1.

        It comes to, or leaves, the outermost place of a letter, or its stroke's end near there; a pen leaves at the
        height at which its last stroke ends.
        """
        end, near = strokes[joined][-1 if self._leaving else 0], _AT_END * self._x_height
        if self._leaving and abs(end[1] - height) > near:
            return None
        level = body[np.abs(body[:, 1] - height) < _LEVEL * self._x_height]
        if not len(level):
            return None
        furthest = level[self._side(level).argmax()]
        if np.hypot(*(end - furthest)) < near and len(strokes[joined]) > 1:
            return end, joined
        return furthest, -1


def _lead_line(stroke: Array, line: Array, reach: float) -> Array:
    """A line (n, 2) from the end of a stroke (m, 2), which it leaves in the stroke's direction."""
    run = arc_length(line)
    k = int(np.clip(np.searchsorted(run, reach), 1, len(line) - 1))
    back = stroke[-1] - stroke[max(len(stroke) - 4, 0)]
    ahead = line[min(k + 2, len(line) - 1)] - line[max(k - 2, 0)]
    if k < 2 or not back.any() or not ahead.any() or back @ (line[k] - line[0]) < 0:
        return line
    span = float(np.hypot(*(line[k] - line[0])))
    back, ahead = (span * way / np.hypot(*way) for way in (back, ahead))
    led = cubic(line[0], back, line[k], ahead, run[: k + 1] / run[k])
    return np.concatenate([led, line[k + 1 :]])
