"""Ink along a way of the pen in one sweep: width, darkness and edge as a writer's own strokes have them there.

The lines of a writer's pages that lie clear are known at every pixel, walked either way, by where the pen comes from
and goes, and by how near the ends of the stroke are (`Stock`).  Along a new way those places of them are taken that are
alike in this, best one after the other as they were written: a row of long stretches, found by a beam search.  Their
cross sections are laid side by side in the frame of the way, blended where one stretch gives way to the next, and bent
onto it.  So stems are as dark, turns as wide and ends as pointed as the writer's, and the ink goes on without a seam.
Where a way crosses or meets itself, what covers more is seen.

Source: own method; strokes made of stretches of other strokes: seed 001; Lu, Barnes, DiVerdi &
Finkelstein 2013, RealBrush.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.errors import InputError
from handout.hand.scanned import ScannedHand, ScannedPage
from handout.inking.source import source_of
from handout.inking.swatches import clear, letter_vertices
from handout.inking.warping import nearest_points
from handout.libraries import spatial
from handout.motion.timing import arc_length
from handout.peaks import peaks
from handout.values import Array, Indices

_Pixels = NDArray[np.float32]

# set by eye on letters made for csafe w0154 and cvl 0002 and 0013, unless said otherwise
_JUNCTION = 1.5  # radii from a junction, within which the width of a line is none of its own
_WIDEST = 1.5  # radii: what is wider is a blot, or two lines side by side
_FEWEST = 200  # pixels of clear line that ink can be taken from
_ENOUGH = 50_000  # of them: of half a million, places are .051 unlike those asked for, not .074; the ink looks alike
_AHEAD = 3.0  # radii before and after a place, whose directions count
_END, _NEAR = 1.6, 1.6  # what the nearness of an end counts beside a direction; radii at which it is 1/e
_EVEN = 1.2  # radii over which a line's middle is smoothed: its waver is part of its ink
_STRIDE = 2  # pixels from one place that is looked for to the next
_LIKE, _BEAM = 12, 24  # places looked at for each; rows that are gone on with
_JUMP = 1.5  # cost of a place that does not follow the one before
_WIDTH, _DARK = 2.0, 3.0  # cost of a jump by relative width, by darkness
_AGAIN = 0.4  # cost of a place just used
_LATELY, _FORGOTTEN = 0.8, 1000  # share of that left after each stroke; strokes after which there is none
_BLEND = 1.2  # radii on either side of a jump over which two stretches are blended
_ACROSS = 2.0  # radii on either side of a line that its cross sections show, and two pixels
_RIM = 1.5  # pixels beyond its radius over which a line fades, at most
_FAINT = 0.12  # opacity at which a stroke is at its end
_END_AT = 1.0  # radii from its line's end, within which a place ends a way as that line ends
_FINE = 2  # cross sections a pixel, and their samples
_ARM = 1.5  # radii before and after a place, between which its turn is measured
_CUSP = 2.2  # rad of turn, from which on the way turns back there
_TURN = 1.6  # rad by which the way may turn in what is bent at once


class _StockLine(NamedTuple):
    """Places of a `Stock` on one line; see there."""

    xy: Array
    along: Array
    radius: Array
    features: Array
    free: NDArray[np.bool_]
    loose: NDArray[np.bool_]

    def reverse(self) -> _StockLine:
        """The same from its other end."""
        features = np.concatenate([-self.features[:, [4, 5, 2, 3, 0, 1]], self.features[:, [7, 6]]], axis=1)[::-1]
        free, loose = self.free[::-1], self.loose[::-1, ::-1]
        return _StockLine(self.xy[::-1], -self.along[::-1], self.radius[::-1], features, free, loose)


@dataclass(frozen=True, eq=False)
class Stock:
    """Places on the clear lines of a hand, a pixel of its first page apart, line after line, each line there and back.

    xy : (n, 2) in such pixels; along : (n, 2) unit vectors; radius : (n,); features : (n, 8), see `_features`.
    free : (n,) whether it may be taken: not where other ink is near, nor beyond a stroke's end.
    loose : (n, 2) whether its line begins, and ends, without touching another.
    first, last : (n,) the numbers between which those of its line lie; page : (n,) of the hand.
    dark : (n,) mean opacity around it.
    usual : median radius.
    """

    xy: Array
    along: Array
    radius: Array
    features: Array
    free: NDArray[np.bool_]
    loose: NDArray[np.bool_]
    first: Indices
    last: Indices
    page: Indices
    dark: Array
    usual: float

    @cached_property
    def places(self) -> Indices:
        """(m,): the numbers of those that may be taken."""
        return np.flatnonzero(self.free)

    @cached_property
    def tree(self) -> spatial.cKDTree:
        """Of the features of those."""
        return spatial.cKDTree(self.features[self.places])


@lru_cache(maxsize=2)
def stock(hand: ScannedHand) -> Stock:
    """Places on a hand's lines, as many as serve.

    Raises InputError: there are too few.
    """
    unit, ink = hand.pages[0].pixel, [letter_vertices(hand, k) for k in range(len(hand.pages))]
    radii = [page.graph.radius[some] / unit for page, some in zip(hand.pages, ink, strict=True)]
    usual = float(np.median(np.concatenate(radii))) if sum(map(len, radii)) else 1.0
    each, free_count = list[list[_StockLine]](), 0
    for scan, some in zip(hand.pages, ink, strict=True):
        if free_count < _ENOUGH:
            each.append(list(_lines(scan, some, usual, unit)))
            free_count += sum(int(line.free.sum()) for line in each[-1])
    lines = [line for lines in each for line in lines]
    if free_count < _FEWEST:
        raise InputError(
            f"{hand.name}: there are too few clear pieces of line to take a pen from; scribble half a page of loose "
            "waves and strokes with it, not over each other."
        )
    xy, along, radius, features, free, loose = (np.concatenate(part) for part in zip(*lines, strict=True))
    sizes = [len(line.xy) for line in lines]
    ends = np.cumsum([0, *sizes])
    page = np.repeat(np.arange(len(each)), [sum(len(line.xy) for line in lines) for lines in each])
    dark = np.concatenate([_darkness(hand.pages[k], xy[page == k], unit) for k in range(len(each))])
    first, last = np.repeat(ends[:-1], sizes), np.repeat(ends[1:] - 1, sizes)
    return Stock(xy, along, radius, features, free, loose, first, last, page, dark, usual)


def _lines(page: ScannedPage, ink: NDArray[np.bool_], usual: float, unit: float) -> Iterator[_StockLine]:
    """Lines of a page that lie clear somewhere, led on beyond their ends, each there and back."""
    graph, more = page.graph, tip(usual)
    clear_ink, out = (clear(graph) & ink).astype(np.float64), np.arange(1, more + 1)[:, None]
    for path in graph.branches[:: max(1, int(2 * clear_ink.sum() / _ENOUGH))]:
        run = arc_length(graph.xy[path] / unit)
        if run[-1] < 2 * usual or not clear_ink[path].any():
            continue
        at = np.linspace(0, run[-1], round(float(run[-1])) + 1)
        xy = _interpolate(at, run, (graph.uv[path] + 0.5) * (page.pixel / unit) - 0.5)
        radius = _interpolate(at, run, graph.radius[path] / unit)
        loose = graph.degree[path[[0, -1]]] < 2
        away = np.minimum(np.where(loose[0], np.inf, at), np.where(loose[1], np.inf, at[-1] - at))
        free = (_interpolate(at, run, clear_ink[path]) > 0.99) & (away > _JUNCTION * usual) & (radius < _WIDEST * usual)
        if free.any():
            xy = _smooth_line(xy, _EVEN * usual)
            along, features = _find_directions(xy), _features(xy, loose, usual)
            longer = np.concatenate([xy[0] - out[::-1] * along[0], xy, xy[-1] + out * along[-1]])
            held = np.clip(np.arange(-more, len(xy) + more), 0, len(xy) - 1)
            free = np.concatenate([np.zeros(more, dtype=bool), free, np.zeros(more, dtype=bool)])
            line = _StockLine(longer, along[held], radius[held], features[held], free, np.tile(loose, (len(held), 1)))
            yield from (line, line.reverse())


def tip(usual: float) -> int:
    """Pixels by which ink may go beyond the end of its line."""
    return int(np.ceil(1.5 * usual)) + 2


def _darkness(page: ScannedPage, xy: Array, unit: float) -> Array:
    """(n,): mean opacity around places (n, 2), pixels of `unit` mm."""
    import cv2

    if not len(xy):
        return np.zeros(0)
    texture = page.texture
    mean = cv2.blur(texture.rgba[:, :, 3], (3, 3))
    x, y = np.rint(_to_page(xy, unit, page) - texture.corner).astype(np.intp).T
    h, w = texture.shape
    return np.asarray(mean[np.clip(y, 0, h - 1), np.clip(x, 0, w - 1)] / 255, dtype=np.float64)


def _to_page(xy: Array, unit: float, page: ScannedPage) -> Array:
    """Pixels of a page, of places in pixels of `unit` mm."""
    return np.asarray((xy + 0.5) * (unit / page.pixel) - 0.5)


def _interpolate(at: Array, run: Array, values: Array) -> Array:
    if values.ndim == 1:
        return np.interp(at, run, values)
    return np.column_stack([np.interp(at, run, column) for column in values.T])


def _smooth_line(xy: Array, reach: float) -> Array:
    """A line (n, 2) smoothed by a Gaussian; its ends stay."""
    wide = min(len(xy) - 1, int(3 * reach))
    if wide < 1:
        return xy
    kernel = np.exp(-0.5 * (np.arange(-wide, wide + 1) / reach) ** 2)
    kernel /= kernel.sum()
    padded = np.concatenate([2 * xy[0] - xy[wide:0:-1], xy, 2 * xy[-1] - xy[-2 : -wide - 2 : -1]])
    return np.column_stack([np.convolve(column, kernel, "valid") for column in padded.T])


def _find_directions(xy: Array) -> Array:
    way = np.gradient(xy, axis=0)
    return np.asarray(way / np.maximum(np.hypot(*way.T), 1e-9)[:, None])


def _features(xy: Array, ends: ArrayLike, usual: float) -> Array:
    """(n, 8) of a line's places, a pixel apart: where it goes before, at and after each; how near its ends are."""
    count, ahead = len(xy), max(1, round(_AHEAD * usual / 2))
    number = np.arange(count)
    courses = []
    for shift in (-2 * ahead, 0, 2 * ahead):
        low, high = (np.clip(number + shift + k, 0, count - 1) for k in (-ahead, ahead))
        low, high = np.minimum(low, max(count - 1 - ahead, 0)), np.maximum(high, min(ahead, count - 1))
        way = xy[high] - xy[low]
        courses.append(way / np.maximum(np.hypot(*way.T), 1e-9)[:, None])
    near = np.exp(-np.column_stack([number, number[::-1]]) / (_NEAR * usual)) * np.asarray(ends)
    return np.concatenate([*courses, _END * near], axis=1)


@dataclass(frozen=True, eq=False)
class InkedWay:
    """A way of the pen that is to be inked.

    xy : (n, 2), in the frame of whoever holds it; ends : whether the pen is set down, and lifted, at its ends.
    """

    xy: Array
    ends: tuple[bool, bool] = (True, True)


class Sweep:
    """Inks ways with a hand's lines, each with others than were just used."""

    def __init__(self, hand: ScannedHand) -> None:
        self._hand, self._stock = hand, stock(hand)
        self._used, self._now = np.full(len(self._stock.page), -_FORGOTTEN), 0

    def ink(self, page: _Pixels, way: InkedWay) -> None:
        """Lay the ink of a way, pixels of the page, on that (h, w, 4), premultiplied."""
        run = arc_length(way.xy)
        if run[-1] < 1.0:
            way = InkedWay(way.xy[:1] + np.array([[-0.5, 0.0], [0.5, 0.0]]), way.ends)
            run = arc_length(way.xy)
        at = np.linspace(0, run[-1], max(2, round(float(run[-1])) + 1))
        xy = _interpolate(at, run, way.xy)
        turns = _cusps(xy, self._stock.usual)
        for a, b in pairwise([0, *turns, len(xy) - 1]):
            self._ink(page, xy[a : b + 1], way.ends, (a > 0, b < len(xy) - 1))

    def _ink(self, page: _Pixels, xy: Array, ends: tuple[bool, bool], turns: tuple[bool, bool]) -> None:
        """Lay the ink of a way, places (n, 2) a pixel apart, that turns back at its ends alone."""
        ends = (ends[0] or turns[0], ends[1] or turns[1])
        strip, middle = self._strip(self._numbers(xy, ends), turns)
        more = tip(self._stock.usual)
        along, out = _find_directions(xy), np.arange(1, more + 1)[:, None]
        longer = np.concatenate([xy[0] - out[::-1] * along[0], xy, xy[-1] + out * along[-1]])
        first, last = (0 if ends[0] else more), len(longer) - (0 if ends[1] else more)
        for a, b in _even_parts(longer, first, last):
            _bend(page, longer, strip, middle, (a, b))

    def _numbers(self, xy: Array, ends: tuple[bool, bool]) -> Indices:
        """(n,): the place of the stock for each place (n, 2) of a way; those that follow each other are one stretch."""
        some = self._stock
        wanted = _features(xy, ends, some.usual)[::_STRIDE]
        near, at = some.tree.query(wanted, k=min(_LIKE, len(some.places)))
        found = _search(some, wanted, some.places[at], near**2, self._price_reuse)
        self._now += 1
        numbers = np.empty(len(xy), dtype=np.intp)
        for k in range(_STRIDE):
            part = numbers[k::_STRIDE]
            part[:] = np.clip(found + k, some.first[found], some.last[found])[: len(part)]
        for shift in range(-4, 5):
            self._used[np.clip(found + shift, 0, len(self._used) - 1)] = self._now
        return numbers

    def _price_reuse(self, places: Indices) -> Array:
        """Costs of taking places again that were taken lately."""
        return np.asarray(_AGAIN * _LATELY ** (self._now - self._used[places]))

    def _strip(self, numbers: Indices, turns: tuple[bool, bool]) -> tuple[_Pixels, int]:
        """((n + 2 tip) · fine, m, 4) cross sections of a way and what may lie beyond its ends; the middle column."""
        some = self._stock
        starts = np.flatnonzero(np.diff(numbers, prepend=-9) != 1)
        more, blend = tip(some.usual), max(1, round(_BLEND * some.usual))
        count = len(numbers)
        fine = np.arange(-more * _FINE, (count - 1 + more) * _FINE + 1) / _FINE
        half = int(np.ceil((_ACROSS * some.usual + 2) * _FINE))
        total, weights = np.zeros((len(fine), 2 * half + 1, 4), dtype=np.float32), np.zeros(len(fine))
        for a, b in pairwise([*starts.tolist(), count]):
            from_start = np.inf if a == 0 else fine - (a - 0.5)
            to_end = np.inf if b == count else b - 0.5 - fine
            weight = np.ones(len(fine))
            for inside in (from_start, to_end):
                weight = weight * (0.5 - 0.5 * np.cos(np.pi * np.clip(inside / (2 * blend) + 0.5, 0, 1)))
            rows = np.flatnonzero(weight > 0)
            place = np.clip(numbers[a] + fine[rows] - a, some.first[numbers[a]], some.last[numbers[a]])
            total[rows] += weight[rows, None, None].astype(np.float32) * self._sections(place, half)
            weights += weight
        total /= weights[:, None, None].astype(np.float32)
        for k, out in enumerate((-fine, fine - count + 1)):
            number = int(numbers[-k])
            left = (number - some.first[number], some.last[number] - number)[k] - more
            pointed = some.loose[number, k] and left < _END_AT * some.usual and not turns[k]
            total *= _cap(total, out, half, float(some.radius[number]), pointed)[:, :, None]
        return total, half

    def _sections(self, place: Array, half: int) -> _Pixels:
        """(n, 2 half + 1, 4): the ink across a line at places between two of one line of the stock."""
        import cv2

        some = self._stock
        low = np.minimum(place.astype(np.intp), some.last[place.astype(np.intp)] - 1)
        part = (place - low)[:, None]
        xy, along = (x[low] * (1 - part) + x[low + 1] * part for x in (some.xy, some.along))
        across = np.column_stack([-along[:, 1], along[:, 0]])
        page = self._hand.pages[int(some.page[low[0]])]
        offsets = np.arange(-half, half + 1) / _FINE
        where = _to_page(xy[:, None] + offsets[:, None] * across[:, None], self._hand.pages[0].pixel, page)
        where -= page.texture.corner
        picture = source_of(page).premultiplied_ink
        ink = cv2.remap(
            picture,
            where[..., 0].astype(np.float32),
            where[..., 1].astype(np.float32),
            cv2.INTER_CUBIC,
            borderMode=cv2.BORDER_CONSTANT,
        ).astype(np.float32) / np.float32(255)
        return _own_ink(ink, some.radius[low] * _FINE, half)


def _cap(strip: _Pixels, out: Array, half: int, radius: float, pointed: bool) -> _Pixels:
    """(n, m): what is left of a strip's ink so many pixels (n,) beyond its end: all till it fades, or a round."""
    across = np.arange(-half, half + 1) / _FINE
    if not pointed:
        share = np.clip((radius + 1 - np.hypot(np.maximum(out, 0)[:, None], across)) / 2, 0, 1)
        return np.where(out[:, None] > 0, share, 1).astype(np.float32)
    order = np.argsort(out)
    order = order[out[order] > 0]
    dark = strip[order, :, 3][:, np.abs(across) <= max(radius, 1.0)].max(axis=1)
    share = np.ones((len(out), 1), dtype=np.float32)
    left = np.minimum.accumulate(dark)
    left = np.where(left > _FAINT, left, 0) * np.clip(radius + 2 - out[order], 0, 1)
    share[order, 0] = left / np.maximum(dark, 1e-6)
    return np.broadcast_to(share, strip.shape[:2])


def _own_ink(ink: _Pixels, radius: Array, half: int) -> _Pixels:
    """Cross sections without what other lines bring in: outwards from its edge ink only fades."""
    alpha = ink[:, :, 3].copy()
    inside = np.abs(np.arange(-half, half + 1)) <= radius[:, None]
    held = np.where(inside, 1.0, alpha).astype(np.float32)
    faded = np.empty_like(held)
    faded[:, half:] = np.minimum.accumulate(held[:, half:], axis=1)
    faded[:, half::-1] = np.minimum.accumulate(held[:, half::-1], axis=1)
    edge = np.clip(1 - (np.abs(np.arange(-half, half + 1)) - radius[:, None]) / (_RIM * _FINE) + 1, 0, 1)
    faded = np.minimum(faded, edge)
    share = np.where(inside, 1.0, faded / np.maximum(alpha, 1e-6)).astype(np.float32)
    return ink * np.minimum(share, 1.0)[:, :, None]


def _search(some: Stock, wanted: Array, near: Indices, price: Array, again: Callable[[Indices], Array]) -> Indices:
    """(n,): the cheapest row of places found, one for each of the features (n, 8).

    near, price : (n, k) places that are like each, and how unlike; again : what it costs to take places again.
    """
    states, cost = near[0], price[0] + again(near[0])
    kept: list[tuple[Indices, Indices]] = [(states, np.full(len(states), -1))]
    for k in range(1, len(wanted)):
        onward = states + _STRIDE
        goes = onward <= some.last[states]
        goes &= some.free[np.minimum(onward, len(some.free) - 1)]
        on, back = onward[goes], np.flatnonzero(goes)
        on_cost = cost[goes] + ((some.features[on] - wanted[k]) ** 2).sum(axis=1)
        leap = cost[:, None] + _WIDTH * np.abs(some.radius[states][:, None] - some.radius[near[k]]) / some.usual
        leap += _DARK * np.abs(some.dark[states][:, None] - some.dark[near[k]])
        best = leap.argmin(axis=0)
        jump_cost = leap[best, np.arange(len(best))] + _JUMP + price[k]
        every, costs = np.concatenate([on, near[k]]), np.concatenate([on_cost, jump_cost])
        costs += again(every)
        come = np.concatenate([back, best])
        order = np.argsort(costs, kind="stable")[:_BEAM]
        states, cost = every[order], costs[order]
        kept.append((states, come[order]))
    found = np.empty(len(wanted), dtype=np.intp)
    at = int(cost.argmin())
    for k in range(len(wanted) - 1, -1, -1):
        states, come = kept[k]
        found[k], at = states[at], int(come[at])
    return found


def _cusps(xy: Array, usual: float) -> list[int]:
    """Where a way, places (n, 2) a pixel apart, turns back on itself."""
    arm = max(2, round(_ARM * usual))
    if len(xy) < 2 * arm + 1:
        return []
    way = (xy[arm:] - xy[:-arm]) @ np.array([1, 1j])
    turn = np.abs(np.angle(way[arm:] * np.conj(way[:-arm])))
    return [int(k) + arm for k in peaks(turn, prominence=0.5, apart=arm) if turn[k] > _CUSP]


def _even_parts(xy: Array, first: int, last: int) -> Iterator[tuple[int, int]]:
    """Parts of a way, from one place to another, that turn so little that none crosses itself."""
    steps = np.diff(xy, axis=0) @ np.array([1, 1j])
    turn = np.abs(np.angle(steps[1:] * np.conj(steps[:-1])))
    begin, turned = first, 0.0
    for k in range(first + 1, last - 1):
        turned += float(turn[k - 1])
        if turned > _TURN:
            yield begin, k + 1
            begin, turned = k, 0.0
    yield begin, last


def _bend(page: _Pixels, xy: Array, strip: _Pixels, middle: int, part: tuple[int, int]) -> None:
    """Lay a part of a strip on a page along its places."""
    import cv2

    a, b = part
    some, reach = xy[a:b], middle / _FINE
    low = np.maximum(np.floor(some.min(axis=0) - reach).astype(np.intp), 0)
    high = np.minimum(np.ceil(some.max(axis=0) + reach).astype(np.intp) + 1, page.shape[1::-1])
    if (low >= high).any():
        return
    at = (some - low) @ np.array([1, 1j])
    shape = (int(high[1] - low[1]), int(high[0] - low[0]))
    _, near = nearest_points(at, shape)
    along = _find_directions(some)
    down, right = np.mgrid[: shape[0], : shape[1]]
    x, y = right - at.real[near], down - at.imag[near]
    on = x * along[near, 0] + y * along[near, 1]
    aside = y * along[near, 0] - x * along[near, 1]
    held = np.clip(on, -1.0 * (near > 0), 1.0 * (near < len(some) - 1))
    aside = np.copysign(np.hypot(aside, on - held), aside)  # beyond an end, round
    ink = cv2.remap(
        strip,
        (aside * _FINE + middle).astype(np.float32),
        ((near + a + held) * _FINE).astype(np.float32),
        cv2.INTER_CUBIC,
        borderMode=cv2.BORDER_CONSTANT,
    )
    ink = np.clip(ink, 0, 1)
    ink = np.minimum(ink, ink[:, :, 3:])
    under = page[low[1] : high[1], low[0] : high[0]]
    more = ink[:, :, 3] > under[:, :, 3]
    under[more] = ink[more]
