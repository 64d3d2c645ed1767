"""Letters that the pen goes to and fro between: strokes of two neighbours that are one, cut several times.

Where the stem of one letter runs through what the tagger gave to the one before, each has bits that begin and end at
the other, and neither shows which way they were written; the way of the pen from letter to letter does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from handout.motion.recovery.placing import PlacedGlyph, PlacedStroke, trimmed
from handout.values import Indices

Part: TypeAlias = "tuple[PlacedGlyph, Indices]"


def weave(first: PlacedGlyph, second: PlacedGlyph, joins: dict[int, int]) -> None:
    """Puts strokes of two neighbours together that lead from one to the other and back, as strokes of the second.

    Parameters
    ----------
    joins : way into the second → way out of the first that is the same line.
    """
    back = {out: into for into, out in joins.items()}
    bits = [s for s in first.strokes if s.begin in back and s.end in back]
    leading = [s for s in first.strokes if s.end in back and s.begin not in back and not s.late]
    if not bits or len(leading) != 1:
        return
    assert leading[0].end is not None
    begun = _from(second.strokes, back[leading[0].end])
    if begun is None or begun.end not in joins:
        return
    woven, last = [begun], begun
    while last.end is not None and last.end in joins:
        bit = _from(bits, joins[last.end])
        if bit is None or bit.end is None:
            return
        following = _from([s for s in second.strokes if s not in woven], back[bit.end])
        if following is None:
            return
        begun.then += [(first, bit.vertices), (second, trimmed(second, following, joins))]
        bits.remove(bit)
        woven += [bit, following]
        last = following
    chain = second.chains[begun.end] if begun.end is not None else None
    assert chain is not None
    begun.vertices = begun.vertices[: len(begun.vertices) - len(chain) + 1]
    begun.end, begun.late = last.end, False
    first.strokes = [s for s in first.strokes if s not in woven]
    second.strokes = [begun, *(s for s in second.strokes if s not in woven)]


def _from(strokes: list[PlacedStroke], way: int) -> PlacedStroke | None:
    """The stroke that begins at a way, turned round if it ends there."""
    for stroke in strokes:
        if stroke.begin == way:
            return stroke
    for stroke in strokes:
        if stroke.end == way:
            stroke.vertices = stroke.vertices[::-1]
            stroke.begin, stroke.end = stroke.end, stroke.begin
            return stroke
    return None


def unwound(parts: Sequence[Part]) -> list[Part]:
    """A movement whose loop over two letters goes up on its right, as those of stems do, turned round if it does not.

    Parameters
    ----------
    parts : what it has in each glyph, in order; places have y down.
    """
    nodes = [(id(glyph), v) for glyph, own in parts for v in own.tolist()]
    of = np.repeat(np.arange(len(parts)), [len(own) for _, own in parts])
    seen: dict[tuple[int, int], int] = {}
    best: tuple[int, int] | None = None
    for at, node in enumerate(nodes):
        before = seen.get(node)
        over = before is not None and len({id(parts[k][0]) for k in range(of[before], of[at] + 1)}) > 1
        if before is not None and over and (best is None or at - before < best[1] - best[0]):
            best = before, at
        seen[node] = at
    if best is None:
        return list(parts)
    first, last = best
    xy = np.concatenate([glyph.graph.xy[own] for glyph, own in parts])
    x, y = xy[first:last].T
    if float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) <= 0:
        return list(parts)
    order = np.concatenate([np.arange(first), np.arange(last, first - 1, -1), np.arange(last + 1, len(nodes))])
    vertices = np.array([v for _, v in nodes], dtype=np.intp)[order]
    bounds = np.flatnonzero(np.diff(of[order])) + 1
    return [
        (parts[int(of[order[at]])][0], own) for at, own in zip([0, *bounds], np.split(vertices, bounds), strict=True)
    ]
