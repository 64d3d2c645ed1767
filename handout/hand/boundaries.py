"""Where one letter ends and the next begins, put right by how letters read and by how much they look like their likes.

Letters are cut where their transcript fits best (`tagging`).  Some cuts that fit give a stroke away: the first stem of
a w to the o before it, a bar to the letter beside it, a speck to whoever is near.  Such a pair reads badly, letter by
letter, and neither looks like its siblings.  Every stroke that might be the neighbour's, and every loose piece of a
letter, is tried elsewhere; what gains by both kinds of evidence together stays there.

A letter is read alone, with the beginning of the strokes that lead to it and away from it: an r without its upstroke
reads as nothing in any hand.

Source: own method.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.branching import number_pieces
from handout.hand import outlier_score
from handout.hand.author_reader import author_reader, picture_of_vertices, reads_alone, surprises
from handout.hand.glyph_features import glyph_features
from handout.hand.ligatures import find_again
from handout.hand.scanned import NOBODY, ScannedGlyph, ScannedHand, ScannedPage
from handout.libraries import spatial
from handout.networks import one_thread
from handout.peaks import peaks
from handout.values import Array, Indices


@dataclass(frozen=True)
class BoundarySettings:
    """Chosen by looking at what moved on four people's pages (csafe w0018 w0180, cvl 0013 0052).

    gain : nats of surprise, and units of the score of shapes, that a move has to be worth.
    least : nats of two neighbours together below which the cut between them is not doubted.
    rounds : times that moves are looked for; what moved may let others move.
    reach : x-heights of a stroke that may be the neighbour's; turn : by which it goes up and down where it turns.
    context : x-heights of the strokes around a letter with which it is read.
    near : x-heights from a loose piece to a letter that it may belong to.
    """

    gain: float = 1.8
    least: float = 0.5
    rounds: int = 2
    reach: float = 1.6
    turn: float = 0.12
    context: float = 0.35
    near: float = 1.2


_SETTINGS = BoundarySettings()
_FEWEST = 4  # vertices of a stroke that is worth a move, and of a letter that is left: less has no shape


@dataclass(frozen=True, eq=False)
class _Move:
    """Ink that might be another letter's.

    giver, taker : numbers of glyphs; the taker is `NOBODY` for what is no letter's.
    vertices : (n,) int, rising.
    gain : nats by which both read better.
    """

    giver: int
    taker: int
    vertices: Indices
    gain: float = 0.0


@one_thread
def mend_boundaries(hand: ScannedHand) -> tuple[ScannedHand, int]:
    """The hand with its cuts put right, and how many strokes and pieces changed their letter.

    What a person confirmed stays as it is, and so do pages that were recorded from a pen.
    """
    count = 0
    for _ in range(_SETTINGS.rounds):
        mender = _Mender(hand)
        moves = mender.worthwhile_moves()
        if not moves:
            break
        hand, count = mender.move_ink(moves), count + len(moves)
    return hand, count


class _Mender:
    """One round: what of a hand's ink might be another letter's, and what that is worth."""

    def __init__(self, hand: ScannedHand) -> None:
        self._hand, self._reader = hand, author_reader(hand)
        self._owners = [np.full(len(page.graph), NOBODY, dtype=np.intp) for page in hand.pages]
        for number, glyph in enumerate(hand.glyphs):
            self._owners[glyph.page][glyph.vertices] = number
        self._free = [
            reads_alone(glyph.letter)
            and not (glyph.confirmed or glyph.ways)
            and len(glyph.vertices) >= _FEWEST
            and hand.pages[glyph.page].moments is None
            for glyph in hand.glyphs
        ]
        self._surprise = np.zeros(len(hand.glyphs))
        free = np.flatnonzero(self._free)
        self._surprise[free] = self._surprises([(n, hand.glyphs[n].vertices) for n in free.tolist()])

    def worthwhile_moves(self) -> list[_Move]:
        """Moves that gain enough, no glyph in two of them."""
        tried = self._gains([*self._strokes(), *self._pieces()])
        chosen, taken = list[_Move](), set[int]()
        for move in sorted(tried, key=lambda move: -move.gain):
            if move.gain > 0 and not taken & {move.giver, move.taker}:
                chosen.append(move)
                taken |= {move.giver, move.taker} - {NOBODY}
        if not chosen:
            return []
        before, after = self._scores(self._hand.glyphs), self._scores(self._glyphs_after(chosen))
        sides = [[n for n in (move.giver, move.taker) if n != NOBODY] for move in chosen]
        likeness = [float((before[numbers] - after[numbers]).sum()) for numbers in sides]
        return [move for move, more in zip(chosen, likeness, strict=True) if move.gain + more > _SETTINGS.gain]

    def move_ink(self, moves: Sequence[_Move]) -> ScannedHand:
        """The hand after some moves, with the ligatures of all that they touch."""
        touched = {n for move in moves for n in (move.giver, move.taker)} - {NOBODY}
        return replace(self._hand, glyphs=find_again(self._glyphs_after(moves), self._hand.pages, touched))

    def _glyphs_after(self, moves: Sequence[_Move]) -> list[ScannedGlyph]:
        """All glyphs after some moves; their ligatures are as they were."""
        glyphs = list(self._hand.glyphs)
        for move in moves:
            for number, vertices in self._sides_after(move):
                glyphs[number] = replace(glyphs[number], vertices=vertices)
        return glyphs

    def _sides_after(self, move: _Move) -> Iterator[tuple[int, Indices]]:
        """The glyphs of a move, with the vertices that they have then."""
        glyphs = self._hand.glyphs
        yield move.giver, np.setdiff1d(glyphs[move.giver].vertices, move.vertices)
        if move.taker != NOBODY:
            yield move.taker, np.union1d(glyphs[move.taker].vertices, move.vertices)

    def _gains(self, moves: Sequence[_Move]) -> list[_Move]:
        """Moves with what they gain, as their letters read."""
        items = [(n, item) for n, move in enumerate(moves) for item in self._sides_after(move)]
        gains = np.zeros(len(moves))
        for (n, (number, _)), surprise in zip(items, self._surprises([item for _, item in items]), strict=True):
            gains[n] += self._surprise[number] - surprise
        return [replace(move, gain=gain) for move, gain in zip(moves, gains.tolist(), strict=True)]

    def _surprises(self, items: Sequence[tuple[int, Indices]]) -> Array:
        """(n,) nats: how glyphs read alone, had they these vertices."""
        hand = self._hand
        each = [hand.glyphs[number] for number, _ in items]
        seen = [
            picture_of_vertices(hand.pages[glyph.page], glyph.line, self._in_context(number, vertices))
            for glyph, (number, vertices) in zip(each, items, strict=True)
        ]
        return surprises(self._reader, seen, [glyph.letter for glyph in each])

    def _scores(self, glyphs: Sequence[ScannedGlyph]) -> Array:
        """(n,): how unlike its siblings each glyph is."""
        shapes = glyph_features(replace(self._hand, glyphs=tuple(glyphs)))
        return outlier_score.load_model().score(shapes, [glyph.letter for glyph in glyphs])

    def _in_context(self, number: int, vertices: Indices) -> Indices:
        """The vertices of a glyph with those of the strokes around it that are its neighbours'."""
        glyph = self._hand.glyphs[number]
        page, owner = self._hand.pages[glyph.page], self._owners[glyph.page]
        beside, begin = page.graph.neighbour_lists
        allowed = np.isin(owner, [number, *({glyph.before, glyph.after} - {NOBODY})])
        allowed[vertices] = False
        added = list[int]()
        for v in vertices.tolist():
            for w in beside[begin[v] : begin[v + 1]].tolist():
                if allowed[w]:
                    added += _stroke(page, w, v, allowed, _SETTINGS.context)
        return np.union1d(vertices, np.array(added, dtype=np.intp))

    def _strokes(self) -> Iterator[_Move]:
        """Strokes on either side of a cut that might be the other letter's."""
        pages = zip(self._hand.pages, self._owners, strict=True)
        sides = [np.sort(owner[page.graph.edges], axis=1) for page, owner in pages]
        for first, glyph in enumerate(self._hand.glyphs):
            second = glyph.after
            if second == NOBODY or not (self._free[first] and self._free[second]):
                continue
            if self._surprise[first] + self._surprise[second] < _SETTINGS.least:
                continue
            page, owner = self._hand.pages[glyph.page], self._owners[glyph.page]
            across = (sides[glyph.page] == sorted((first, second))).all(axis=1)
            for a, b in page.graph.edges[across].tolist():
                for inside, outside in ((a, b), (b, a)):
                    giver = int(owner[inside])
                    path = _stroke(page, inside, outside, owner == giver, _SETTINGS.reach, whole=False)
                    most = len(self._hand.glyphs[giver].vertices) - _FEWEST
                    up = -page.graph.uv[path, 1] * page.pixel / page.x_height
                    for end in _new_cuts(up, backwards=giver == first):
                        if _FEWEST <= end < most:
                            yield _Move(giver, first + second - giver, np.sort(path[: end + 1]))

    def _pieces(self) -> Iterator[_Move]:
        """Loose pieces of letters that might be other letters', or nobody's."""
        trees = [spatial.cKDTree(page.graph.uv) for page in self._hand.pages]
        for number in np.flatnonzero(self._free).tolist():
            glyph = self._hand.glyphs[number]
            page, owner = self._hand.pages[glyph.page], self._owners[glyph.page]
            piece = number_pieces(page.graph.edges_between(glyph.vertices), len(glyph.vertices))
            sizes = np.bincount(piece)
            for k in np.delete(np.arange(len(sizes)), sizes.argmax()).tolist():
                vertices = glyph.vertices[piece == k]
                near = trees[glyph.page].query_ball_point(
                    page.graph.uv[vertices], _SETTINGS.near * page.x_height / page.pixel
                )
                around = set(owner[np.concatenate(near).astype(np.intp)].tolist()) - {number, NOBODY}
                marked = len(unicodedata.normalize("NFD", glyph.letter)) > 1  # an accent is small, and no speck
                for taker in [*([] if marked else [NOBODY]), *sorted(n for n in around if self._free[n])]:
                    yield _Move(number, taker, vertices)


def _stroke(
    page: ScannedPage, start: int, before: int, allowed: NDArray[np.bool_], most: float, whole: bool = True
) -> list[int]:
    """The vertices from `start` on, away from `before`, up to a fork, the end, or what is not allowed.

    most : x-heights of its length.
    whole : whether the vertex of the fork is with it.
    """
    beside, begin = page.graph.neighbour_lists
    uv, length, here = page.graph.uv, 0.0, start
    path = list[int]()
    while length <= most * page.x_height / page.pixel:
        ahead = [v for v in beside[begin[here] : begin[here + 1]].tolist() if v != before]
        if whole or len(ahead) < 2:
            path.append(here)
        if len(ahead) != 1 or not allowed[ahead[0]]:
            break
        length += float(np.hypot(*(uv[ahead[0]] - uv[here])))
        before, here = here, ahead[0]
    return path


def _new_cuts(up: Array, backwards: bool) -> list[int]:
    """Where else a stroke from a cut might be cut: on its tops, and in the middle of what rises as the pen goes.

    up : (n,) x-heights; backwards : whether the pen came the other way.
    """
    last = len(up) - 1
    tops, bottoms = (
        peaks(np.append(side, side.min(initial=0.0) - 1.0), prominence=_SETTINGS.turn).tolist() for side in (up, -up)
    )
    turns = sorted([*((at, True) for at in tops), *((at, False) for at in bottoms if at < last)])
    cuts = list[int]()
    for (at, top), (following, _) in pairwise([*turns, (last, False)]):
        cuts += [at] if top else []
        cuts += [(at + following) // 2] if top == backwards and following - at > _FEWEST else []
    return cuts
