"""In which order strokes are drawn.

Order is part of how a page looks written, and so is the direction of a stroke: nothing is reordered unless it is asked
for, of writing whole words at most, and no stroke of it is ever turned round.  Where times mean nothing, in a drawing,
strokes are drawn in any order, from either end, and closed ones from anywhere.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from handout.plotting.planning.tour import shortest
from handout.values import Array, Drawing, Indices, Stroke

_ROUNDS = 30  # at most, in which words are moved about: pages of writing need 3 or 4, 200 words in any places 7
_CLOSED = 0.02  # mm between the ends of a stroke that is closed
_LIFT = 0.1  # s between the strokes of a drawing
_KICKS, _SPENT = 5, 800_000  # disturbances a stroke, and strokes turned round by all of them: about half a second


def shorten_travel(drawing: Drawing, home: Array | None = None) -> tuple[Stroke, ...]:
    """The strokes on one clock, ordered so that the pen travels less; unchanged if that gains nothing.

    Parameters
    ----------
    drawing : Drawing
        Of one that is timed only whole words are moved, in one that is not strokes may also be turned round.
    home : (2,) float, mm, page coordinates, optional
        Where the pen comes from and goes back to; the way from there and back counts for drawings without times.
    """
    return _keep_pace(by_travel(drawing.strokes), drawing.strokes) if drawing.timed else by_tour(drawing.strokes, home)


def _keep_pace(ordered: tuple[Stroke, ...], written: tuple[Stroke, ...]) -> tuple[Stroke, ...]:
    """Reordered strokes, each with the pause before it that it had in the order of writing."""
    if ordered == written or not written:
        return ordered
    ends = [0.0, *(float(stroke.t[-1]) for stroke in written[:-1])]
    pause = {id(stroke): max(float(stroke.t[0]) - end, 0.0) for stroke, end in zip(written, ends, strict=True)}
    clock, paced = 0.0, []
    for stroke in ordered:
        clock += pause[id(stroke)]
        paced.append(dataclasses.replace(stroke, t=stroke.t - stroke.t[0] + clock))
        clock = float(paced[-1].t[-1])
    return tuple(paced)


def by_tour(strokes: tuple[Stroke, ...], home: Array | None = None) -> tuple[Stroke, ...]:
    """The strokes in any order and from either end, closed ones begun anywhere, so that the pen travels little.

    The times of each stroke are those of the way it is drawn; the clock of the page starts anew.
    """
    if len(strokes) < 2:
        return strokes
    begun = list(strokes)
    closed = []
    for at, stroke in enumerate(strokes):
        ends = stroke.xy[[0, -1]]
        if len(stroke.t) > 3 and np.hypot(*(ends[1] - ends[0])) < _CLOSED and stroke.length > 10 * _CLOSED:
            closed.append(at)
    order: list[int] = []
    for last in (False, False, True) if closed else (True,):
        ends = np.array([[stroke.xy[0], stroke.xy[-1]] for stroke in begun])
        order = _order(ends, home, thorough=last)
        _begin_anew(begun, closed, order, home)
    drawn = []
    for point in order:
        stroke = begun[point >> 1]
        if point & 1:  # drawn from its end
            t = stroke.t[0] + (stroke.t[-1] - stroke.t[::-1])
            stroke = _pick_samples(stroke, np.arange(len(stroke.t))[::-1], t)
        drawn.append(stroke)
    if _way(drawn, home) >= _way(strokes, home) - 1e-9:
        return strokes
    clock, timed = 0.0, []
    for stroke in drawn:
        timed.append(dataclasses.replace(stroke, t=stroke.t - stroke.t[0] + clock))
        clock = float(timed[-1].t[-1]) + _LIFT
    return tuple(timed)


def _order(ends: Array, home: Array | None, *, thorough: bool) -> list[int]:
    """Points at which the strokes are entered: from home on, or with the longest way of the tour left out."""
    n = len(ends)
    kicks = min(_KICKS * n, _SPENT // (n + 300)) if thorough else 0
    if home is not None:
        tour = shortest(np.concatenate([ends, np.broadcast_to(home, (1, 2, 2))]), kicks)
        first = [point >> 1 for point in tour].index(n) + 1
        return tour[first:] + tour[: first - 1]
    tour = shortest(ends, kicks)
    points, at = ends.reshape(-1, 2), np.array(tour)
    gap = np.hypot(*(points[at] - points[np.roll(at, 1) ^ 1]).T)
    first = int(gap.argmax())
    return tour[first:] + tour[:first]


def _begin_anew(strokes: list[Stroke], closed: list[int], order: list[int], home: Array | None) -> None:
    """Begin each closed stroke where the travels to it and on to the next stroke are shortest together."""
    place = {point >> 1: at for at, point in enumerate(order)}
    for index in closed:
        at = place[index]
        before = _end(strokes, order[at - 1] ^ 1) if at else home
        after = _end(strokes, order[at + 1]) if at + 1 < len(order) else home
        way = np.zeros(len(strokes[index].t))
        for other in (before, after):
            if other is not None:
                way += np.hypot(*(strokes[index].xy - other).T)
        strokes[index] = _roll_stroke(strokes[index], int(way[:-1].argmin()))


def _end(strokes: list[Stroke], point: int) -> Array:
    return np.asarray(strokes[point >> 1].xy[-1 if point & 1 else 0])


def _roll_stroke(stroke: Stroke, first: int) -> Stroke:
    """A closed stroke from sample `first` on round to it again."""
    if first == 0:
        return stroke
    at = np.r_[first : len(stroke.t), 1 : first + 1]
    step = np.diff(stroke.t)
    t = stroke.t[0] + np.concatenate([[0.0], np.cumsum(np.r_[step[first:], step[:first]])])
    return _pick_samples(stroke, at, t)


def _pick_samples(stroke: Stroke, at: Indices, t: Array) -> Stroke:
    """The samples `at` of a stroke at other times."""
    channels = ("pressure", "tilt", "azimuth", "rotation", "width")
    values_of = {name: values[at] for name in channels if (values := getattr(stroke, name)) is not None}
    return dataclasses.replace(stroke, t=t, xy=stroke.xy[at], **values_of)


def _way(strokes: Sequence[Stroke], home: Array | None) -> float:
    """Length of all moves through the air, mm."""
    ends = 0.0 if home is None else sum(np.hypot(*(xy - home)) for xy in (strokes[0].xy[0], strokes[-1].xy[-1]))
    return _travel(strokes) + float(ends)


def by_travel(strokes: tuple[Stroke, ...]) -> tuple[Stroke, ...]:
    """The strokes, whole words reordered so that the pen travels less; unchanged if that gains nothing.

    Strokes of one word stay in their order.  A stroke of no known word is a word of its own.
    """
    found: dict[tuple[str, int], list[int]] = {}  # strokes of each word, words in the order in which they were begun
    for index, stroke in enumerate(strokes):
        found.setdefault(("word", stroke.word) if stroke.word >= 0 else ("alone", index), []).append(index)
    words = list(found.values())
    if len(words) < 2:
        return strokes
    start = np.array([strokes[word[0]].xy[0] for word in words])
    end = np.array([strokes[word[-1]].xy[-1] for word in words])
    gap = np.hypot(*(start[None] - end[:, None]).transpose(2, 0, 1))  # from the end of row to the start of column
    order = list(range(len(words)))
    left, nearest = np.ones(len(gap), dtype=bool), [0]  # from the first word always on to the nearest that is left
    left[0] = False
    for _ in range(len(gap) - 1):
        nearest.append(int(np.argmin(np.where(left, gap[nearest[-1]], np.inf))))
        left[nearest[-1]] = False
    for candidate in (order, nearest):
        better = _move_words(candidate, gap)
        if _length(better, gap) < _length(order, gap) - 1e-9:
            order = better
    ordered = tuple(strokes[index] for word in order for index in words[word])
    return ordered if _travel(ordered) < _travel(strokes) - 1e-9 else strokes


def _travel(strokes: Sequence[Stroke]) -> float:
    start = np.array([stroke.xy[0] for stroke in strokes[1:]])
    end = np.array([stroke.xy[-1] for stroke in strokes[:-1]])
    return float(np.hypot(*(start - end).T).sum())


def _length(order: list[int], gap: Array) -> float:
    return float(gap[order[:-1], order[1:]].sum())


def _move_words(order: list[int], gap: Array) -> list[int]:
    """Move runs of one to three words to wherever that shortens the way, until nothing does."""
    order = list(order)
    for _ in range(_ROUNDS):
        gained = False
        for size in (1, 2, 3):
            for at in range(1, len(order) - size + 1):
                gained |= _move_run(order, at, size, gap)
        if not gained:
            break
    return order


def _move_run(order: list[int], at: int, size: int, gap: Array) -> bool:
    """Move the run of words at `at` to its best place (never before the first word); whether that gained anything."""
    run = order[at : at + size]
    rest = np.array(order[:at] + order[at + size :])
    tail = [gap[run[-1], rest[at]]] if at < len(rest) else [0.0]
    bridge = gap[rest[at - 1], rest[at]] if at < len(rest) else 0.0
    saved = gap[rest[at - 1], run[0]] + tail[0] - bridge
    into, out = gap[rest, run[0]], np.append(gap[run[-1], rest[1:]], 0.0)
    extra = into + out - np.append(gap[rest[:-1], rest[1:]], 0.0)
    best = int(np.argmin(extra))
    if extra[best] >= saved - 1e-9 or best == at - 1:
        return False
    order[:] = [*rest[: best + 1].tolist(), *run, *rest[best + 1 :].tolist()]
    return True
