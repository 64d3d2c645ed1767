"""What a scanned hand measures, one definition each; x-height in mm and pitch are properties of `ScannedHand`.

Lengths are in line space, whose unit is the pitch of the lines, unless said otherwise.  They are medians, so that a
page that was measured wrongly, or a letter that was cut wrongly, does not count.  The two means are of what letters of
all pages, weighed alike, are compared with when a text is written with all of them: their spread and their spaces.
The colour of an ink is that of the middle of its strokes; `ink_colours` tells the inks of a hand apart.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from handout import hues
from handout.branching import number_pieces
from handout.hand.diacritics import NOT_ABOVE, decompose_grapheme
from handout.hand.learnt import learnt
from handout.hand.letter_classes import FULL_ASCENDERS, NEVER_DESCENDING, X_HEIGHT
from handout.hand.scanned import NOBODY, ScannedHand
from handout.values import Array, Indices

_BELOW, _ABOVE = -0.15, 0.3  # x-heights beyond another line's feet: long tails reach −.2, stems of tight lines .2
VERSION = 1  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it
JOINED_SHARE = 0.45  # `Joins.share` from which a hand counts as joined; set by eye on joined and printed pages
_CAPITAL = 1.9  # x-heights: height of a capital where the hand has none to measure
_TALLEST = (1.3, 4.0)  # x-heights: bounds of an ascender's height
_HIGHEST = (1.3, 3.5)  # x-heights: bounds of a capital's height
_SLANTLESS = 0.6  # x-heights: a body that is lower has no slant of its own


@dataclass(frozen=True)
class Joins:
    """How often letters are joined: `joined` of `pairs` letters that follow another in one word."""

    joined: int
    pairs: int

    @property
    def share(self) -> float:
        """0–1; 0 for a hand without pairs."""
        return self.joined / max(self.pairs, 1)


def joins(hand: ScannedHand) -> Joins:
    """How often the letters of a hand are joined to the one before them in their word."""
    following = [glyph for glyph in hand.glyphs if glyph.before != NOBODY]
    return Joins(sum(bool(hand.glyphs[glyph.before].ligatures) for glyph in following), len(following))


def x_height(hand: ScannedHand) -> float:
    """Height of a small letter without ascender."""
    return float(np.median([page.x_height / page.pitch for page in hand.pages]))


def slant(hand: ScannedHand) -> float:
    """dx/dy of the letters, upwards."""
    return float(np.median([page.slant for page in hand.pages]))


def mean_x_height(hand: ScannedHand) -> float:
    """Height of a small letter, the mean of the pages."""
    return float(np.mean([page.x_height / page.pitch for page in hand.pages]))


def mean_slant(hand: ScannedHand) -> float:
    """dx/dy of the letters, the mean of the pages."""
    return float(np.mean([page.slant for page in hand.pages]))


def half_width(hand: ScannedHand) -> float:
    """Half the width of the line, mm, along all of the ink."""
    return float(np.median(np.concatenate([page.graph.radius for page in hand.pages])))


def letter_half_width(hand: ScannedHand) -> float:
    """Half the width of the line along the letters alone."""
    pages = [hand.pages[glyph.page] for glyph in hand.glyphs]
    radii = [page.graph.radius[g.vertices] / page.pitch for page, g in zip(pages, hand.glyphs, strict=True)]
    return float(np.median(np.concatenate(radii)))


def x_height_in_half_widths(hand: ScannedHand) -> float:
    """Height of a small letter in half widths of the usual page's line."""
    return x_height(hand) / float(np.median([float(np.median(p.graph.radius)) / p.pitch for p in hand.pages]))


def capital_height(hand: ScannedHand) -> float:
    """Height of a capital; of a hand without capitals, that of most hands."""
    tops = [_top(hand, i) for i, glyph in enumerate(hand.glyphs) if glyph.letter.isupper()]
    return _bounded_median(tops, x_height(hand), _HIGHEST) or _CAPITAL * x_height(hand)


def ascender_height(hand: ScannedHand) -> float:
    """Height of a small letter with an ascender; of a hand without any, that of a capital."""
    tops = [_top(hand, i) for i, glyph in enumerate(hand.glyphs) if glyph.letter in FULL_ASCENDERS]
    return _bounded_median(tops, x_height(hand), _TALLEST) or capital_height(hand)


def _top(hand: ScannedHand, number: int) -> float:
    return float(hand.outline(number)[:, 1].max())


_CASED = frozenset("ckopsuvwxz")  # whose capitals have the same shape, only larger
_CASED_BETWEEN = (0.3, 0.6)  # shares of the way from x-height to capitals: below the one no capital, above the other
_LEAST_CAPITAL = 1.35  # x-heights: what is lower is no capital in place of a small letter, however low those are
_ARM = 0.6  # of the width of a k, from which on its arm tells its case, since its stem is as high in both
_NEAR, _LEAST_NEAR = 12, 4  # letters on each side that a letter is measured by, and how many of them there must be
_LEAST_SIBLINGS = 4  # small letters of a name that show how high it is with this author


def reaching_lines(hand: ScannedHand) -> NDArray[np.bool_]:
    """(n,): glyphs that reach down to the foot of the letters on the line below, or well over that of the line above.

    They hold ink of that line.  Bounds: set on 8,500 letters of 25 people (csafe, cvl), of which four reach so far.

    Source: own method.
    """
    found = np.zeros(len(hand.glyphs), dtype=bool)
    for number, glyph in enumerate(hand.glyphs):
        page = hand.pages[glyph.page]
        uv = page.graph.uv[glyph.vertices]
        for line, down, over in ((glyph.line + 1, 1, _BELOW), (glyph.line - 1, -1, _ABOVE)):
            if 0 <= line < len(page.baselines):
                beyond = (uv[:, 1] - page.base(line, uv[:, 0])) * down * page.pixel / page.x_height
                found[number] |= beyond.max() > over
    return found


def contradicted_cases(hand: ScannedHand) -> NDArray[np.bool_]:
    """(n,): glyphs of c k o p s u v w x z that are as large on their page as the other case of their letter is.

    A letter's top is measured over the feet of the letters around it, in heights of the small letters there, and
    compared with the capitals of other shapes on the page; where a small letter is always high, with that.

    Set on five people's pages (csafe w0029 w0040 w0122 w0180 w0238), of whose transcripts an eighth of these letters
    had the other case on purpose (43 of 52 found, 6 of 342 right ones doubted), with a look at five more (cvl 0001 0002
    0012 0013, csafe w0145: 82 of 85, and 1 of 442).  On eight people's pages that were read after that (csafe w0018
    w0031 w0076 w0139 w0154 w0182 w0191 w0411) 81 of 87 were found, and 10 of 535 right ones doubted, of 2,833 letters
    in all.

    Source: own method.
    """
    found = np.zeros(len(hand.glyphs), dtype=bool)
    for number in range(len(hand.pages)):
        here = np.array([i for i, glyph in enumerate(hand.glyphs) if glyph.page == number], dtype=np.intp)
        letters = [hand.glyphs[i].letter for i in here]
        judged = np.array([letter.lower() in _CASED for letter in letters], dtype=bool)
        if not judged.any():
            continue
        height, capitals = _heights(hand, here, letters)
        capital = float(np.clip(np.median(capitals) if len(capitals) > 2 else _CAPITAL, *_HIGHEST))
        for k in np.flatnonzero(judged).tolist():
            letter = letters[k]
            if letter.isupper():
                found[here[k]] = height[k] < 1 + _CASED_BETWEEN[0] * (capital - 1)
                continue
            like = height[[other == letter for other in letters]]
            usual = max(1.0, float(np.median(like))) if len(like) >= _LEAST_SIBLINGS else 1.0
            found[here[k]] = height[k] > max(usual + _CASED_BETWEEN[1] * (capital - 1), _LEAST_CAPITAL)
    return found


# x-heights. Of 145 letters of two people those with a mark reach 1.24 or more, or have a piece whose foot is at .94 or
# more; those without one reach 1.16 at most, with no foot above .29. Where bare letters are high, those that lost their
# mark reach 1.42; four that are joined to theirs (eleven people) reach 1.52 and more
_UNMARKED, _MARK = (1.22, 1.45), 0.6
_BARE = 0.95  # quantile of the tops of the author's letters without mark: what is lower has none
_OUTSIZED = 1.45  # times the usual height of a letter's siblings; by eye, see `outsized_letters`


def outsized_letters(hand: ScannedHand) -> NDArray[np.bool_]:
    """(n,): letters without ascender that are far higher than their siblings on the page.

    They hold a bar or a stroke of a letter beside them, or are written large to begin or end a word.  Of 1,666 letters
    of five people (cvl 0013, csafe w0018 w0076 w0200 w0515) 18 are so; by eye 6 hold ink that is not theirs, and 10
    are too large to stand inside another word.

    Source: own method.
    """
    found = np.zeros(len(hand.glyphs), dtype=bool)
    for number in range(len(hand.pages)):
        here = np.array([i for i, glyph in enumerate(hand.glyphs) if glyph.page == number], dtype=np.intp)
        letters = [hand.glyphs[i].letter for i in here]
        height = _heights(hand, here, letters)[0] if letters else np.zeros(0)
        for letter in X_HEIGHT & set(letters):
            like = np.flatnonzero([other == letter for other in letters])
            if len(like) >= _LEAST_SIBLINGS:
                found[here[like]] = height[like] > _OUTSIZED * np.median(height[like])
    return found


def unmarked_letters(hand: ScannedHand) -> NDArray[np.bool_]:
    """(n,): small letters with a mark above that hold none: a neighbour has it, or it was not written.

    They are no higher than the author's letters without mark.

    Source: own method.
    """
    found = np.zeros(len(hand.glyphs), dtype=bool)
    letters = np.array([glyph.letter for glyph in hand.glyphs])
    for name in {name for name in letters.tolist() if name.islower() and {*decompose_grapheme(name)[1]} - NOT_ABOVE}:
        body = decompose_grapheme(name)[0]
        bare = [_rise(hand, i).max() for i in np.flatnonzero(letters == body).tolist() if body in X_HEIGHT]
        enough = len(bare) >= _LEAST_SIBLINGS
        highest = np.clip(np.quantile(bare, _BARE), *_UNMARKED) if enough else _UNMARKED[0]
        for i in np.flatnonzero(letters == name).tolist():
            glyph, up = hand.glyphs[i], _rise(hand, i)
            piece = number_pieces(hand.pages[glyph.page].graph.edges_between(glyph.vertices), len(up))
            feet = np.full(len(up), np.inf)
            np.minimum.at(feet, piece, up)
            found[i] = up.max() < highest and feet[piece].max() < _MARK
    return found


def _rise(hand: ScannedHand, number: int) -> Array:
    """(k,): the heights of a glyph's line over its feet, in x-heights of its page."""
    glyph = hand.glyphs[number]
    page = hand.pages[glyph.page]
    up = page.to_line(glyph.line, page.graph.uv[glyph.vertices])[:, 1]
    return np.asarray(up * (page.pitch / page.x_height))


def _heights(hand: ScannedHand, here: Indices, letters: list[str]) -> tuple[Array, Array]:
    """(n,), (m,): the heights of some glyphs of one page, in those of small letters; those of its plain capitals."""
    top, foot = np.array([_reach(hand, i) for i in here.tolist()]).T
    line = np.array([hand.glyphs[i].line for i in here])
    small = np.array([letter in X_HEIGHT for letter in letters], dtype=bool)
    standing = np.array([letter in NEVER_DESCENDING for letter in letters], dtype=bool)
    plain = np.array([letter.isupper() and letter.lower() not in _CASED for letter in letters], dtype=bool)
    height, usual_top, usual_foot = np.empty(len(here)), _median(top[small], 1.0), _median(foot[standing], 0.0)
    for k in range(len(here)):
        near = slice(max(k - _NEAR, 0), k + _NEAR + 1)
        others = (line[near] == line[k]) & (np.arange(len(here))[near] != k)
        tops, feet = top[near][others & small[near]], foot[near][others & standing[near]]
        low = _median(feet, 0.0) if len(feet) >= _LEAST_NEAR else usual_foot
        high = _median(tops, 1.0) if len(tops) >= _LEAST_NEAR else usual_top
        height[k] = (top[k] - low) / max(high - low, 0.5)
    return height, height[plain]


def _median(values: Array, otherwise: float) -> float:
    return float(np.median(values)) if len(values) else otherwise


def _reach(hand: ScannedHand, number: int) -> tuple[float, float]:
    """How far a glyph's ink, without ligatures, reaches over the baseline and down, x-heights; of a k its arm."""
    glyph, page = hand.glyphs[number], hand.pages[hand.glyphs[number].page]
    body = hand.body(number)
    x, y = (page.to_line(glyph.line, page.graph.uv[body]) * (page.pitch / page.x_height)).T
    radius = page.graph.radius[body] / page.x_height
    if glyph.letter in ("k", "K"):
        x = x - page.slant * y
        arm = x >= x.min() + _ARM * float(np.ptp(x))
        return float((y + radius)[arm].max()), float((y - radius).min())
    return float((y + radius).max()), float((y - radius).min())


def _bounded_median(tops: list[float], unit: float, bounds: tuple[float, float]) -> float:
    """The median of some heights, within bounds in units; 0 if there are none."""
    return float(np.clip(np.median(tops), bounds[0] * unit, bounds[1] * unit)) if tops else 0.0


_INK_SHARE = 0.02  # of a page's letters, for an ink of its own: fewer are taken for one of the others
_DARKEST = 0.02  # of the paper's light: darker is not told from black
_SAME_INK = 0.1  # distance of RGB in 0–1 below which two pages are written in one ink: scans differ by as much


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
    count, *kept = learnt(hand, "inks", VERSION, None, lambda: _measure_inks(hand)).astype(np.intp).tolist()
    return InkColours(tuple(f"#{colour:06x}" for colour in kept[:count]), np.array(kept[count:], dtype=np.intp))


def in_other_ink(hand: ScannedHand) -> NDArray[np.bool_]:
    """(n,): glyphs of another ink than most of their page: a heading in red."""
    of, other = ink_colours(hand).of, np.zeros(len(hand.glyphs), dtype=bool)
    page_of = np.array([glyph.page for glyph in hand.glyphs], dtype=np.intp)
    for number in np.unique(page_of).tolist():
        here = page_of == number
        other[here] = of[here] != np.bincount(of[here]).argmax()
    return other


def _measure_inks(hand: ScannedHand) -> Sequence[int]:
    """How many inks a hand has, the colour of each as a number 0xrrggbb, and the ink of every glyph."""
    if hand.glyphs:
        pieces = [(glyph.page, glyph.vertices) for glyph in hand.glyphs]
    else:
        pieces = [(number, np.arange(len(page.graph))) for number, page in enumerate(hand.pages)]
    colour = np.full((len(pieces), 3), np.nan)
    group = np.full(len(pieces), -1, dtype=np.intp)
    page_of = np.array([page for page, _ in pieces], dtype=np.intp)
    for number in range(len(hand.pages)):
        numbers = np.flatnonzero(page_of == number)
        colour[numbers] = _usual(hand, number, [pieces[i][1] for i in numbers])
        inked = numbers[np.isfinite(colour[numbers, 0])]
        group[inked] = _kinds(colour[inked]) + group.max() + 1
    inks = _merge_inks(colour, group)
    of = np.zeros(len(pieces), dtype=np.intp)
    for number, members in enumerate(inks):
        of[members] = number
    usual = (np.rint(255 * np.median(colour[members], axis=0)) @ (1 << 16, 1 << 8, 1) for members in inks)
    return [len(inks), *map(int, usual), *of.tolist()]


def _usual(hand: ScannedHand, number: int, pieces: list[Indices]) -> Array:
    """(k, 3), 0–1: the median colour along each piece of a page's line, laid on white; nan without ink."""
    page = hand.pages[number]
    rgba = page.texture.load()  # not kept, nor put right as a whole: a page is large
    at = np.rint(page.graph.uv - np.array(page.texture.corner)).astype(np.intp)
    height, width = page.texture.shape
    inside = ((at >= 0) & (at < (width, height))).all(axis=1)
    pixels = np.zeros((len(at), 4))
    pixels[inside] = rgba[at[inside, 1], at[inside, 0]] / 255
    if page.texture.blue_first:
        pixels = pixels[:, [2, 1, 0, 3]]
    light = 1 - pixels[:, 3:] * (1 - pixels[:, :3])
    inky = pixels[:, 3] > 0
    colours = [light[piece[inky[piece]]] for piece in pieces]
    return np.array([np.median(some, axis=0) if len(some) else np.full(3, np.nan) for some in colours]).reshape(-1, 3)


def _kinds(colours: Array) -> Indices:
    """Which of a page's inks each of its letters (n, 3) is written in, from 0."""
    if not len(colours):
        return np.zeros(0, dtype=np.intp)
    # in densities, whose direction is the same however thin the line is: as light, a washed red is a neighbour of blue
    away = -np.log(np.maximum(colours, _DARKEST))
    directions = away / np.maximum(np.linalg.norm(away, axis=1), 1e-9)[:, None]
    # the kinds, with those of very few members joined to the nearest of the others, numbered from 0
    kind = hues.kinds(directions, _INK_SHARE)
    count = np.bincount(kind)
    large = np.flatnonzero(count >= max(_INK_SHARE * len(kind), 1))
    centres = np.stack([directions[kind == number].mean(axis=0) for number in large])
    nearest = np.argmax(directions @ centres.T, axis=1)
    place = np.full(len(count), -1, dtype=np.intp)
    place[large] = np.arange(len(large))
    return np.where(place[kind] >= 0, place[kind], nearest)


def _merge_inks(colour: Array, group: Indices) -> list[Indices]:
    """Members of each ink, the largest first: groups of the pages whose colours are alike are one ink."""
    groups = [np.flatnonzero(group == number) for number in range(int(group.max(initial=-1)) + 1)]
    inks: list[Indices] = []
    for members in sorted(groups, key=lambda some: -len(some)):
        middle = np.median(colour[members], axis=0)
        for number, others in enumerate(inks):
            if np.linalg.norm(np.median(colour[others], axis=0) - middle) < _SAME_INK:
                inks[number] = np.concatenate([others, members])
                break
        else:
            inks.append(members)
    return sorted(inks, key=lambda some: -len(some))


def body_sizes(xy: Array, radius: Array, first: Indices, x_height: float) -> Array:
    """(n, 4): logarithms of width, height and aspect of bodies, and their slants; 0 for one too low to have any.

    xy, radius : (v, 2), (v,) of n bodies, one behind the other from the vertices `first` (n + 1,) on.
    """
    begin, count = first[:-1], np.diff(first)
    low = np.minimum.reduceat(xy - radius[:, None], begin)
    high = np.maximum.reduceat(xy + radius[:, None], begin)
    x, y = (xy - np.repeat(np.add.reduceat(xy, begin) / count[:, None], count, axis=0)).T
    tall = high[:, 1] - low[:, 1] > _SLANTLESS * x_height
    square = np.add.reduceat(y * y, begin)
    slant = np.where(tall, np.add.reduceat(x * y, begin) / np.where(tall, square, 1.0), 0.0)
    # of a slanted letter the upright width is what varies by itself
    upright = xy[:, 0] - np.repeat(slant, count) * xy[:, 1]
    wide = np.maximum.reduceat(upright, begin) - np.minimum.reduceat(upright, begin)
    wide = np.log(wide + 2 * np.add.reduceat(radius, begin) / count)
    high = np.log(high[:, 1] - low[:, 1])
    return np.column_stack([wide, high, wide - high, slant])
