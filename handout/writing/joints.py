"""Which ligatures lead from one glyph to the next: those that the author made, and where he would have joined but
made none, new ones in the shape of his others.

A glyph that stood at the end of a word, or after which the pen was lifted, has no way out of it.  Where its letter is
mostly joined to the next one, a gap in the middle of a word would be no habit of the author's.  Such a way leaves the
glyph where its letter's other ways do, has the shape of one that leaves at about that height, and is inked with the
stroke that it goes on from, mirrored there: ink of that pen, at that place, of that darkness.

Capitals are not joined to what follows them, nor letters to one that the author enters nowhere: such ways cross the
letter.  Of 48 words of three joined hands (csafe w0154 w0180, cvl 0013), shown with new ligatures and without in an
order that nobody knew, 15 looked better with them, 13 without and 20 alike; of those that are joined still, 14 and 3.

Source: own method; seed 000, §6.4, joins what was joined and no more.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from handout.branching import branches
from handout.hand.measures import mean_slant, mean_x_height
from handout.hand.scanned import NOBODY
from handout.values import Array, Indices
from handout.writing.forms import Connector, Forms, GlyphLine
from handout.writing.joining import matches

Joint = tuple[Connector, Connector]

_PRIOR = 2.0  # pairs of two letters that the habits of each of them count for
_JOINED = 0.8  # share of a pair that the author joins, from which on it is joined; a lift of one in four is his habit
_NEAR = 0.5  # x-heights that the end of a stroke may be from where other ways leave the letter; set by eye
# how far from a stroke, how high, and how well ways fit: set by eye (csafe w0076 w0139 w0277)
_ON = 0.2  # x-heights: from a stroke that goes on there, no further
_LEAST = 3  # vertices of a way
_HIGH = 0.5  # x-heights: letters are left by their feet, or above this
_FIT = 0.5  # x-heights that the ends of a new way may be higher or lower in the one letter than in the other
_ROUNDING = 1e-9  # line space: places nearer than that are one


class Joints:
    """The ligatures between glyphs of a hand.

    forms : of the hand.
    """

    def __init__(self, forms: Forms) -> None:
        self._forms = forms
        self._made: dict[tuple[int, bool], Connector | None] = {}

    def is_new(self, first: int, second: int) -> bool:
        """Whether a ligature leads from one glyph to the next that its author did not make."""
        return bool(self.joints_between(first, second)) and not matches(self._forms[first], self._forms[second])

    def joints_between(self, first: int, second: int) -> tuple[Joint, ...]:
        """The way out of one glyph and the way into the next, of each ligature; none where the pen is lifted."""
        one, two = self._forms[first], self._forms[second]
        made = tuple((one.exits[i], two.entries[j]) for i, j in matches(one, two))
        if made or not self._usual(first, second):
            return made
        out = one.exits[0] if one.exits else self._new(first, leaving=True)
        into = two.entries[0] if two.entries else self._new(second, leaving=False)
        if out is None or into is None:
            return ()
        rises = (out.xy[[0, -1], 1] + self._forms.centre[first, 1]) - (
            into.xy[[0, -1], 1] + self._forms.centre[second, 1]
        )
        return ((out, into),) if np.abs(rises).max() < _FIT * mean_x_height(self._forms.hand) else ()

    def _usual(self, first: int, second: int) -> bool:
        """Whether the author mostly joins two letters; never for neighbours of the source, which stay as they are."""
        glyphs = self._forms.hand.glyphs
        if glyphs[first].after == second or not glyphs[first].letter.islower() or not glyphs[second].letter.islower():
            return False
        pairs, leaving, entered = self._shares
        one, two = glyphs[first].letter, glyphs[second].letter
        count, joined = pairs.get((one, two), (0, 0))
        usual = leaving.get(one, leaving[""]) * entered.get(two, entered[""])
        return (joined + _PRIOR * usual) / (count + _PRIOR) >= _JOINED

    @cached_property
    def _shares(self) -> tuple[dict[tuple[str, str], tuple[int, int]], dict[str, float], dict[str, float]]:
        """How often pairs of letters occur and are joined, and what share of the pairs of each letter is; "" of all."""
        glyphs = self._forms.hand.glyphs
        pairs: dict[tuple[str, str], tuple[int, int]] = {}
        for glyph in glyphs:
            if glyph.after != NOBODY and glyph.letter.islower() and glyphs[glyph.after].letter.islower():
                key = glyph.letter, glyphs[glyph.after].letter
                count, joined = pairs.get(key, (0, 0))
                pairs[key] = count + 1, joined + bool(glyph.ligatures)
        counts = np.array(list(pairs.values()), dtype=np.float64).reshape(-1, 2)
        usual = float(counts[:, 1].sum() / max(counts[:, 0].sum(), 1))
        sides = []
        for side in (0, 1):
            of = {
                letter: [n for pair, n in pairs.items() if pair[side] == letter] for letter in {p[side] for p in pairs}
            }
            share = {
                letter: (sum(j for _, j in each) + _PRIOR * usual) / (sum(n for n, _ in each) + _PRIOR)
                for letter, each in of.items()
            }
            sides.append(share | {"": usual})
        return pairs, sides[0], sides[1]

    def _new(self, number: int, *, leaving: bool) -> Connector | None:
        """A way out of a glyph, or into it, in the shape of another; None where no stroke of it ends there."""
        key = number, leaving
        if key not in self._made:
            self._made[key] = self._shape_joint(number, leaving)
        return self._made[key]

    def _shape_joint(self, number: int, leaving: bool) -> Connector | None:
        forms, ways, hand = self._forms, self._forms.connectors(leaving=leaving), self._forms.hand
        if not len(ways.of):
            return None
        form, height, letter = forms[number], float(forms.centre[number, 1]), hand.glyphs[number].letter
        lines = ways.lines  # anchors : (m, 2), where each way leaves its glyph, or comes to it, from the glyph's centre
        anchors = lines.xy[lines.first[:-1] if leaving else lines.first[1:] - 1]
        theirs = np.array([hand.glyphs[of].letter == letter for of in ways.of.tolist()], dtype=bool)
        if not (leaving or theirs.any()):
            return None
        x_height = mean_x_height(hand)
        high = anchors[:, 1] + forms.centre[ways.of, 1] > _HIGH * x_height  # by the bar of a t, not by its foot
        theirs &= high if 2 * (theirs & high).sum() > theirs.sum() else ~high
        usual = np.median(anchors[theirs], axis=0) if theirs.any() else None
        across = np.array([1.0, -mean_slant(hand)]) * (1 if leaving else -1)  # how far from the body a place is
        start = _start(form, usual, across, x_height)
        stroke = _stroke(form, start) if start is not None else None
        if start is None or stroke is None:
            return None
        root = form.xy[start] if usual is None else usual
        away = np.abs(anchors[:, 1] + forms.centre[ways.of, 1] - root[1] - height)
        if theirs.any():
            away[~theirs] = np.inf
        way = int(away.argmin())
        shape = (ways.lines[way].xy - anchors[way] + root)[:: 1 if leaving else -1]
        return _ink_way(form, _lead_over(shape, form.xy[start], across), stroke, leaving, height)


def _start(form: GlyphLine, usual: Array | None, across: Array, x_height: float) -> int | None:
    """The vertex of a body at which a new way leaves it, or comes to it: the end of a stroke, best the furthest out.

    usual : (2,) where ways of other glyphs of the letter do; None for a letter that has none.
    """
    ends = np.flatnonzero(np.bincount(form.edges.ravel(), minlength=len(form.xy)) == 1)
    out = form.xy @ across
    if usual is None:
        return int(ends[out[ends].argmax()]) if len(ends) else None
    away = form.xy - usual
    # a word's last letter has the first part of a way already
    along = (out[ends] > usual @ across - _NEAR * x_height) & (np.abs(away[ends, 1]) < _NEAR * x_height)
    if along.any():
        return int(ends[along][out[ends[along]].argmax()])
    nearest = int(np.hypot(*away.T).argmin())  # of a ring; the foot of an r that ends with its arm is too far
    return nearest if np.hypot(*away[nearest]) < _ON * x_height else None


def _lead_over(shape: Array, start: Array, across: Array) -> Array:
    """What of a way (n, 2), outwards, lies beyond a place (2,), led over to it."""
    beyond = int(np.argmax(np.append((shape - start) @ across > _ROUNDING, True)))
    rest = shape[min(beyond, len(shape) - _LEAST) :] if len(shape) > _LEAST else shape
    if rest[-1] @ across <= start @ across:  # all of it is there already
        rest = rest - rest[0] + start
    return np.asarray(rest + np.linspace(1, 0, len(rest))[:, None] * (start - rest[0]))


def _stroke(form: GlyphLine, start: int) -> Indices | None:
    """The vertices of the longest branch of a body, from a given vertex on; None for a dot."""
    found: list[Indices] = []
    for branch in branches(form.edges, len(form.xy)):
        at = np.flatnonzero(branch == start)
        if len(at):
            found += [branch[at[0] :], branch[at[0] :: -1]]
    longest = max(found, key=len, default=np.zeros(0, dtype=np.intp))
    return longest if len(longest) > 1 else None


def _ink_way(form: GlyphLine, outwards: Array, stroke: Indices, leaving: bool, centre: float) -> Connector:
    """A way (n, 2) from its letter with the ink of a stroke, over and over, there and back."""
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(outwards, axis=0).T))])
    own = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(form.xy[stroke], axis=0).T))])
    long = float(own[-1])
    if long <= 0:
        place = np.zeros(len(run))
    else:
        place = long - np.abs(run % (2 * long) - long)
    order = slice(None, None, 1 if leaving else -1)
    xy = outwards[order]
    radius, density, u, v = (
        np.interp(place, own, values[stroke])[order] for values in (form.radius, form.density, *form.uv.T)
    )
    height = float((xy[0, 1] + xy[-1, 1]) / 2) + centre
    half = max(len(xy) // 2, 1)
    return Connector(xy, radius, density, np.column_stack([u, v]), int(stroke[0]), half, 1, height)
