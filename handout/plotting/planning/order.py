"""In which order strokes are drawn.

Order is part of how a page looks written, and so is the direction of a stroke: nothing is reordered unless it is asked
for, of writing whole words at most, and no stroke of it is ever turned round.  Where times mean nothing, in a drawing,
strokes are drawn in any order, from either end, and closed ones from anywhere, by the shortest way that is found.

Every stroke has two points: ``2 s`` where it begins in its drawing and ``2 s + 1`` where it ends.  A tour is a list of
the points at which strokes are entered; ``p ^ 1`` is the other end of the stroke of point p.  A tour is closed: the
last stroke is followed by the first.

A first tour is put together from the shortest links.  Then it is improved between neighbouring points: two links are
exchanged, or a run of up to three strokes is moved to another place.  Then, again and again, two short stretches of the
tour change places, the tour is improved around them, and the result is kept if it is shorter.

Source: J. L. Bentley, *Fast algorithms for geometric traveling salesman problems*, ORSA J. Computing 4 (1992), for the
first tour, neighbour lists and the queue; O. Martin, S. W. Otto, E. W. Felten, *Large-step Markov chains for the
traveling salesman problem*, Complex Systems 5 (1991), for the disturbances.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from handout.libraries import spatial
from handout.values import Array, Drawing, Indices, Stroke

_NEAR = 7  # neighbours of a point that are tried
_RUN = 3  # strokes that are moved together, at most
_EPS = 1e-9  # mm; less is no gain
_STRETCH = 30  # strokes of a stretch that changes places, at most
_WORK = 60_000_000  # strokes reversed in one pass over all of them, at most: large tours make no long exchanges
_APART = 1e-6  # mm by which ends in one place are moved apart
_Six = tuple[int, int, int, int, int, int]
_GOLDEN = 0.6180339887498949  # its multiples fall evenly, and never twice in one place


def shortest(ends: Array, kicks: int) -> list[int]:
    """A short closed tour through strokes.

    ends : (n, 2, 2) float, mm: first and last point of every stroke.
    kicks : how often the tour is disturbed to get it out of where it is stuck.

    Returns the point at which each stroke is entered, in order; every stroke once.
    """
    if len(ends) < 2:
        return [2 * stroke for stroke in range(len(ends))]
    if len(ends) == 2:  # the longer of its two links will be left out
        points = ends.reshape(-1, 2)
        links = [np.hypot(*(points[tour] - points[np.roll(tour, 1) ^ 1]).T).min() for tour in ([0, 2], [0, 3])]
        return [0, 2] if links[0] <= links[1] else [0, 3]
    points = ends.reshape(-1, 2)
    search = _Search(_fragments(points), points)
    search.improve(range(len(points)))
    search.disturb(kicks)
    return search.tour


def _fragments(points: Array) -> list[int]:
    """A tour put together from the shortest links between ends that are still free."""
    link = np.full(len(points), -1, dtype=np.intp)
    root = list(range(len(points) // 2))  # of the fragment that a stroke belongs to
    places = _move_apart(points)
    free = np.arange(len(points))
    near = _NEAR
    while len(free) > 2:
        near = min(near, len(free))
        gap, other = _nearest(places[free], near)
        a, b = np.repeat(free, near), free[other.ravel()]
        tied = sum(_tie(int(a[i]), int(b[i]), link, root) for i in np.argsort(gap.ravel(), kind="stable").tolist())
        # where many ends lie in one place, neighbours may all belong to one's own fragment
        near = _NEAR if tied else 4 * near
        free = np.flatnonzero(link < 0)
    link[free] = free[::-1]
    tour = [0]
    while len(tour) < len(root):
        tour.append(int(link[tour[-1] ^ 1]))
    return tour


def _move_apart(points: Array) -> Array:
    """The points, each moved by next to nothing in a direction of its own, so that no two are in one place."""
    angle = np.arange(len(points)) * (2 * np.pi * _GOLDEN)
    far = _APART * (1.0 + np.arange(len(points)) / len(points))
    return points + np.column_stack([np.cos(angle), np.sin(angle)]) * far[:, None]


def _tie(a: int, b: int, link: NDArray[np.intp], root: list[int]) -> bool:
    """Link two ends, if both are free and belong to different fragments; whether they were."""
    if link[a] >= 0 or link[b] >= 0:
        return False
    first, second = _root(a >> 1, root), _root(b >> 1, root)
    if first == second:
        return False
    link[a], link[b], root[first] = b, a, second
    return True


def _root(stroke: int, root: list[int]) -> int:
    while root[stroke] != stroke:
        root[stroke] = stroke = root[root[stroke]]
    return stroke


class _Search:
    """A tour while it is made shorter.

    tour : points of entry; place : where in the tour each stroke is.
    """

    def __init__(self, tour: list[int], points: Array) -> None:
        self.tour, self.n = tour, len(tour)
        self.place = [0] * self.n
        for at, point in enumerate(tour):
            self.place[point >> 1] = at
        self._at: list[complex] = (points @ np.array([1, 1j])).tolist()
        self._near = _neighbours(points)
        self._turned: list[tuple[int, int]] = []
        self._reach = max(_WORK // self.n, 200)

    def improve(self, points: Iterable[int]) -> float:
        """Exchange links at some points, and wherever that leads, until nothing is gained; the gain, mm."""
        queue = list(points)
        waiting = set(queue)
        total = 0.0
        while queue:
            point = queue.pop()
            waiting.discard(point)
            gain, touched = self._better(point)
            total += gain
            for other in touched:
                if other not in waiting:
                    waiting.add(other)
                    queue.append(other)
        return total

    def disturb(self, times: int) -> None:
        """Exchange two neighbouring stretches of the tour, improve, and go back unless that was worth it."""
        n = self.n
        if n < 8:
            return
        reach = min(_STRETCH, n // 3)
        for count in range(1, times + 1):
            self._turned.clear()
            first = int(n * (count * _GOLDEN % 1.0))
            left = 1 + int(reach * (count * _GOLDEN * 7 % 1.0))
            right = 1 + int(reach * (count * _GOLDEN * 31 % 1.0))
            cuts = [self.tour[(first + at) % n] for at in (0, left, left + right)]
            links = [(point, self._link(point)) for point in cuts]
            before = sum(self._gap(a, b) for a, b in links)
            self._turn(first, first + left - 1)
            self._turn(first + left, first + left + right - 1)
            self._turn(first, first + left + right - 1)
            touched = [point for link in links for point in link]
            gain = before - sum(self._gap(point, self._link(point)) for point in touched) / 2
            if gain + self.improve(touched) < -_EPS:
                for i, j in self._turned[::-1]:
                    self._turn(i, j)

    def _gap(self, a: int, b: int) -> float:
        return abs(self._at[a] - self._at[b])

    def _link(self, point: int) -> int:
        """The point that the pen comes from, or goes to, through the air."""
        at = self.place[point >> 1]
        return self.tour[at - 1] ^ 1 if self.tour[at] == point else self.tour[at + 1 - self.n]

    def _better(self, p: int) -> tuple[float, tuple[int, ...]]:
        """Make the first exchange found that links `p` to something nearer; the gain, and the points it touches."""
        at, tour, place, n = self._at, self.tour, self.place, self.n
        q = self._link(p)
        present = abs(at[p] - at[q])
        here = place[p >> 1]
        enters = tour[here] == p
        for c, gap in self._near[p]:
            spare = present - gap
            if spare <= _EPS:
                break
            where = place[c >> 1]
            apart = abs(where - here)
            if min(apart, n - apart) > self._reach:
                continue
            same = enters == (tour[where] == c)
            r = tour[where - 1] ^ 1 if tour[where] == c else tour[where + 1 - n]
            old = spare + abs(at[c] - at[r])
            if same:
                gain = old - abs(at[q] - at[r])
                if gain > _EPS:
                    self._exchange(p, c)
                    return gain, (p, q, c, r)
            carried = self._find_better_run(c, r, p, q, old) or self._find_better_run(p, q, c, r, old)
            if carried:
                self._carry(*carried[1], turned=same)
                return carried[0], carried[1]
        return 0.0, ()

    def _find_better_run(self, c: int, r: int, p: int, q: int, spare: float) -> tuple[float, _Six] | None:
        """A run of strokes from `c`, which comes after `r`, that is better carried between p and q, c next to p.

        The gain, and the six points of the three links.
        """
        at, tour, n = self._at, self.tour, self.n
        strokes = (p >> 1, q >> 1)
        far = self.place[c >> 1]
        step = 1 if tour[far] == c else -1
        for _ in range(_RUN):
            if tour[far] >> 1 in strokes:
                return None
            following = (far + step) % n
            t, u = (tour[far] ^ 1, tour[following]) if step == 1 else (tour[far], tour[following] ^ 1)
            gain = spare + abs(at[t] - at[u]) - abs(at[t] - at[q]) - abs(at[r] - at[u])
            if gain > _EPS:
                return gain, (p, q, c, r, t, u)
            far = following
        return None

    def _carry(self, p: int, q: int, c: int, r: int, t: int, u: int, *, turned: bool) -> None:
        """Carry the run from `c` to `t` out of its place between r and u, to one between p and q."""
        if turned:  # the run is turned round on its way
            self._exchange(p, c)
            self._exchange(q, t)
        else:
            self._exchange(r, t)
            self._exchange(p, c)
            self._exchange(q, t)

    def _exchange(self, a: int, c: int) -> None:
        """Link `a` with `c`, and what they were linked with: turn all that lies between; both enter, or both leave."""
        i, j = self.place[a >> 1], self.place[c >> 1]
        if self.tour[i] == a:
            self._turn(i, j - 1)
        else:
            self._turn(i + 1, j)

    def _turn(self, i: int, j: int) -> None:
        """Turn the part of the tour from place i to place j round; or all else, which comes to the same."""
        n, tour, place = self.n, self.tour, self.place
        size = (j - i) % n + 1
        if 2 * size > n:
            i, j, size = j + 1, i - 1, n - size
        i, j = i % n, j % n
        self._turned.append((i, j))
        if size == 0:
            return
        if i <= j:
            part = [point ^ 1 for point in tour[i : j + 1]]
            part.reverse()
            tour[i : j + 1] = part
            for at, point in enumerate(part, i):
                place[point >> 1] = at
            return
        part = [point ^ 1 for point in tour[i:] + tour[: j + 1]]
        part.reverse()
        tour[i:], tour[: j + 1] = part[: n - i], part[n - i :]
        for at, point in enumerate(part, i - n):
            place[point >> 1] = at % n


def _neighbours(points: Array) -> list[list[tuple[int, float]]]:
    """For every point the nearest points of other strokes, each with its distance."""
    near = min(_NEAR + 2, len(points))
    places = _move_apart(points)
    other = _nearest(places, near)[1]
    gap = np.linalg.norm(points[other] - points[:, None], axis=2)  # as it is: a gain that is none would never end
    strokes = np.arange(len(points))[:, None] >> 1
    foreign = (other >> 1) != strokes
    return [
        [pair for pair, keep in zip(zip(o, g, strict=True), f, strict=True) if keep][:_NEAR]
        for o, g, f in zip(other.tolist(), gap.tolist(), foreign.tolist(), strict=True)
    ]


def _nearest(places: Array, count: int) -> tuple[Array, NDArray[np.intp]]:
    """The `count` points nearest to every point: distances and numbers, both (n, count)."""
    gap, other = spatial.cKDTree(places).query(places, count)
    return gap, other


_ROUNDS = 30  # at most, in which words are moved about: pages of writing need 3 or 4, 200 words in any places 7
_CLOSED = 0.02  # mm between the ends of a stroke that is closed
_LIFT = 0.1  # s between the strokes of a drawing
_KICKS, _SPENT = 5, 800_000  # disturbances a stroke, and strokes turned round by all of them: about half a second


def shorten_travel(drawing: Drawing, home: Array | None = None) -> tuple[Stroke, ...]:
    """The strokes on one clock, ordered so that the pen travels less; unchanged if that gains nothing.

    drawing : of one that is timed only whole words are moved, in one that is not strokes may also be turned round.
    home : (2,) float, mm, page coordinates, optional: where the pen comes from and goes back to; the way from there and
        back counts for drawings without times.
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
