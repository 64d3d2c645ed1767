"""The alignment of Haines, Mac Aodha and Brostow (2016): a random forest on line features and a chain of letters.

Every column of a line has the mean of its vertices' random-walk features; a forest says which letter it may belong to;
the chain of letters with a spacer before and after each is laid along the columns by dynamic programming, free to stay
or to go on.  There are no widths and nothing is learned from the page.  It is kept for the comparison: give `by_chain`
to `align` as its method.

The feature of a place is where a random walk along the line gets to, as 216 numbers.  A walk leaves a vertex along one
of its edges, takes one of the exits of each junction at random, never goes back, and is over at the end of a line.
After each step the travelled distance, the change of density and the place relative to the start are noted, in the
frame whose x axis is the first part of the way.  All walks are computed at once, exactly: a sparse matrix hands on the
probability of being on each directed edge.  The graph is first cut in even steps of a length in mm, so that scans of
any resolution give the same numbers.

Source: seed 000, §5.1.3, §7.3 and Appendix D.  Chosen for what §7.3 leaves open: the bins of δx, δy have centres at
−½, 0, ½ of the travelled distance, those of the change of density at −½, 0, ½; a walk that is over adds nothing more.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from handout.alphabet import LETTERS, SPACE, THIRDS
from handout.progress import Tell, silent
from handout.scanning.skeleton import skeleton, without_spurs
from handout.tagging.decoder import Decoded
from handout.tagging.line_space import INKY, STEP, X_HEIGHT, Image
from handout.tagging.transcript import TranscriptLine
from handout.values import Array, LineGraph

if TYPE_CHECKING:
    from sklearn.ensemble import RandomForestClassifier

    from handout.tagging.segmentation import PageReader
from dataclasses import dataclass

from scipy.sparse import csr_matrix

from handout.values import Indices

TREES = 64
_MM = 2.5  # the x-height that a line is given, so that a walk reaches as far as on paper
_LINES = 80  # rendered to train the forest
_FLOOR = 1e-3  # of probabilities: a class the forest never saw here is not impossible


def column_features(image: Image) -> NDArray[np.float32]:
    """(n, 216): mean line feature of every described column of a straightened line, 0 where there is no ink."""
    import cv2

    ink = image > INKY
    count = -(-image.shape[1] // STEP)
    total = np.zeros((count, FEATURES), dtype=np.float32)
    inside = np.asarray(cv2.distanceTransform(ink.astype(np.uint8), cv2.DIST_L2, 5), dtype=np.float32)
    xy, edges = without_spurs(*skeleton(ink), inside)
    if not len(xy):
        return total
    ones = np.ones(len(xy))
    graph = LineGraph(xy * (_MM / X_HEIGHT), ones, ones, xy, edges)
    column = np.clip(np.rint(xy[:, 0] / STEP).astype(np.intp), 0, count - 1)
    np.add.at(total, column, line_features(graph))
    often = np.maximum(np.bincount(column, minlength=count), 1).astype(np.float32)
    return np.asarray(total / often[:, None], dtype=np.float32)


def trained_forest(rng: np.random.Generator, lines: int = _LINES) -> RandomForestClassifier:
    """A forest that tells the letters of columns, trained on lines written by the built-in hands."""
    from sklearn.ensemble import RandomForestClassifier

    from handout.prompting import corpus
    from handout.tagging.synthetic_lines import built_in_hands, column_states, synthetic_lines

    features, letters = [], []
    for made in synthetic_lines(built_in_hands(), corpus.shipped_sentences(), lines, rng):
        columns = column_features(made.image)
        states = column_states([(s.letter, s.left, s.right) for s in made.spans], len(columns)) // THIRDS
        inky = columns.any(axis=1)
        features.append(columns[inky])
        letters.append(states[inky])
    forest = RandomForestClassifier(TREES, max_features="sqrt", random_state=int(rng.integers(2**31)))
    return forest.fit(np.concatenate(features), np.concatenate(letters))


@lru_cache(maxsize=1)
def _forest() -> RandomForestClassifier:
    return trained_forest(np.random.default_rng(0))


def log_probability(forest: RandomForestClassifier, image: Image) -> Array:
    """(n, letters) log of the probability of each letter in every column; without ink there is only space."""
    features = column_features(image)
    result = np.full((len(features), len(LETTERS)), _FLOOR)
    inky = features.any(axis=1)
    if inky.any():
        result[np.ix_(np.flatnonzero(inky), forest.classes_)] += forest.predict_proba(features[inky])
    result[~inky, LETTERS.index(SPACE)] = 1.0
    return np.asarray(np.log(result / result.sum(axis=1, keepdims=True)))


def laid(log: Array, letters: Sequence[str]) -> Decoded:
    """The chain spacer, letter, spacer, letter … along the columns; each state may last or give way to the next.

    Source: seed 000, Appendix D.  A spacer may also be passed over, since letters of joined writing touch.
    """
    states = [LETTERS.index(SPACE)]
    for letter in letters:
        states += [LETTERS.index(letter), LETTERS.index(SPACE)]
    score = log[:, states]
    count = len(states)
    best = np.full(count, -np.inf)
    best[:2] = score[0, :2]
    came = np.zeros(score.shape, dtype=np.int8)
    may_skip = np.arange(count) % 2 == 1
    for row in range(1, len(score)):
        ways = np.full((3, count), -np.inf)
        ways[0], ways[1, 1:] = best, best[:-1]
        ways[2, 2:] = np.where(may_skip[2:], best[:-2], -np.inf)
        came[row] = ways.argmax(axis=0)
        best = ways.max(axis=0) + score[row]
    return _traced(came, best, len(letters))


def _traced(came: NDArray[np.int8], best: Array, count: int) -> Decoded:
    state = len(best) - 1 if best[-1] >= best[-2] else len(best) - 2
    left, right = np.zeros(count), np.zeros(count)
    total = float(best[state])
    for row in range(len(came) - 1, -1, -1):
        if state % 2:
            left[state // 2] = row
            right[state // 2] = max(right[state // 2], row + 1)
        state -= int(came[row, state])
    return Decoded(left * STEP, right * STEP, total, right > left)


def by_chain(
    page: PageReader, lines: Sequence[TranscriptLine], rng: np.random.Generator, tell: Tell = silent
) -> list[list[Decoded]]:
    """For every line its one decoding."""
    forest = _forest()
    return [[laid(log_probability(forest, i), line.letters)] for i, line in zip(page.images, lines, strict=True)]


_UNIT = 25.4 / 600  # mm: the paper's pixel
_FARTHEST = 512 * _UNIT
_FORWARD = 12 * _UNIT
_TRAVEL, _RATIO = 8, 1.25
FEATURES = _TRAVEL * 27
EVEN_STEP = _FORWARD  # 0.51 mm
_TOGETHER = 1500  # starts at a time: memory


def line_features(graph: LineGraph, step: float = EVEN_STEP) -> NDArray[np.float32]:
    """(n, 216) float32 for every vertex of a graph in mm: shares that sum to 1.

    Index: ((travel·3 + density)·3 + x)·3 + y.

    Parameters
    ----------
    graph : LineGraph, in mm.
    step : mm: the features are worked out about so far apart, and in steps of that length, and interpolated between.
    """
    steps = even_steps(graph, step)
    own = walk_features(steps.xy, steps.density, steps.edges, steps.step)
    part = steps.part[:, None]
    return np.asarray(own[steps.low] * (1 - part) + own[steps.high] * part, dtype=np.float32)


def walk_features(xy: Array, density: Array, edges: Indices, step: float) -> Array:
    """(n, 216) float: the feature of every vertex of a graph, each edge counted as `step` mm of travel.

    Parameters
    ----------
    xy : (n, 2) float, mm.
    density : (n,) float.
    edges : (m, 2) int.
    step : mm.
    """
    walk = _walk(edges, len(xy))
    result = np.zeros((len(xy), FEATURES))
    for start in range(0, len(xy), _TOGETHER):
        starts = np.arange(start, min(start + _TOGETHER, len(xy)))
        result[starts] = _from(starts, xy, density, walk, step)
    return result


@dataclass(frozen=True)
class _Walk:
    """Directed edges (2m), where they lead, and the chances of what follows."""

    origin: Indices
    target: Indices
    onward: csr_matrix


def _walk(edges: Indices, count: int) -> _Walk:
    both = np.concatenate([edges, edges[:, ::-1]])
    order = np.argsort(both[:, 0], kind="stable")
    origin, target = both[order].T
    place = np.empty(len(order), dtype=np.intp)
    place[order] = np.arange(len(order))
    back = place[(order + len(edges)) % len(order)] if len(order) else place
    first, exits = np.searchsorted(origin, np.arange(count)), np.bincount(origin, minlength=count)
    # every edge out of the end of an edge may follow, its own way back excepted
    follow = exits[target]
    row = np.repeat(np.arange(len(order)), follow)
    column = np.repeat(first[target] - (np.cumsum(follow) - follow), follow) + np.arange(int(follow.sum()))
    onward = column != back[row]
    row, column = row[onward], column[onward]
    chance = 1.0 / np.maximum(exits[target] - 1, 1)[row]
    return _Walk(origin, target, csr_matrix((chance, (row, column)), shape=(len(order), len(order))))


def _from(starts: Indices, xy: Array, density: Array, walk: _Walk, step: float) -> Array:
    """(k, 216): the features of the vertices `starts`."""
    ways, chance, owner, frame = _launched(starts, xy, walk, step)
    count = len(chance)
    total = np.zeros((count, _TRAVEL, 27))
    origin, seed = xy[starts[owner]], density[starts[owner]]
    on: csr_matrix | None = None
    for k in range(1, int(_FARTHEST / step) + 1):
        if k <= len(ways):
            at = ways[k - 1]
            alive = at >= 0
            on = csr_matrix((chance[alive], (np.flatnonzero(alive), at[alive])), shape=(count, len(walk.target)))
        else:
            assert on is not None
            on = on @ walk.onward
        if on.nnz == 0:
            break
        travelled = k * step
        seen = _seen(on, walk, xy, density, origin, seed, frame, travelled)
        weights = _travel_weights(travelled, step)
        for bin_ in np.flatnonzero(weights):
            total[:, bin_] += weights[bin_] * seen
    feature = np.zeros((len(starts), _TRAVEL, 27))
    np.add.at(feature, owner, total)
    flat = feature.reshape(len(starts), FEATURES)
    whole = flat.sum(axis=1)
    flat[whole == 0, 13] = 1.0  # a dot goes nowhere
    return flat / np.where(whole == 0, 1.0, whole)[:, None]


def _launched(starts: Indices, xy: Array, walk: _Walk, step: float) -> tuple[list[Indices], Array, Indices, Array]:
    """All beginnings of walks, until they have gone far enough to have a direction.

    Returns
    -------
    ways : for each step the directed edge (m,) of every beginning, −1 where it was over before.
    chance : (m,) float.
    owner : (m,) int: which start.
    frame : (m, 2) float: unit vector of the direction.
    """
    exits = np.searchsorted(walk.origin, starts, side="right") - np.searchsorted(walk.origin, starts)
    owner = np.repeat(np.arange(len(starts)), exits)
    first = np.searchsorted(walk.origin, starts)
    edge = np.repeat(first - (np.cumsum(exits) - exits), exits) + np.arange(int(exits.sum()))
    chance = 1.0 / np.maximum(exits, 1)[owner]
    ways, last = [edge], edge
    for _ in range(max(1, int(np.ceil(_FORWARD / step - 1e-9))) - 1):
        at = ways[-1]
        follow = np.where(at >= 0, np.diff(walk.onward.indptr)[at], 0)
        copies = np.maximum(follow, 1)  # one that is over stays as it is
        row = np.repeat(np.arange(len(at)), copies)
        slot = np.arange(len(row)) - np.repeat(np.cumsum(copies) - copies, copies)
        goes = follow[row] > 0
        entry = np.where(goes, walk.onward.indptr[at[row]] + slot, 0)
        following = walk.onward.indices[entry] if len(walk.onward.indices) else np.zeros(len(row), dtype=np.intp)
        chance = chance[row] * (np.where(goes, walk.onward.data[entry], 1.0) if len(walk.onward.data) else 1.0)
        ways = [way[row] for way in ways] + [np.where(goes, following, -1).astype(np.intp)]
        owner, last = owner[row], np.where(goes, following, last[row]).astype(np.intp)
    way = xy[walk.target[last]] - xy[starts[owner]]
    size = np.linalg.norm(way, axis=1)
    frame = np.where(size[:, None] > 1e-9, way / np.maximum(size, 1e-9)[:, None], [1.0, 0.0])
    return ways, chance, owner, frame


def _seen(
    on: csr_matrix,
    walk: _Walk,
    xy: Array,
    density: Array,
    origin: Array,
    seed: Array,
    frame: Array,
    travelled: float,
) -> Array:
    """(k, 27): where the walks are, in bins of density change, δx and δy."""
    row = np.repeat(np.arange(on.shape[0]), np.diff(on.indptr))
    at = walk.target[on.indices]
    away = (xy[at] - origin[row]) / travelled
    forward, aside = frame[row, 0], frame[row, 1]
    x = away[:, 0] * forward + away[:, 1] * aside
    y = away[:, 1] * forward - away[:, 0] * aside
    change, across, down = (_three_bins(value) for value in (density[at] - seed[row], x, y))
    plane = (across[:, :, None] * down[:, None, :]).reshape(-1, 1, 9)
    cells = (change[:, :, None] * plane).reshape(-1, 27)
    gather = csr_matrix((on.data, np.arange(len(row)), on.indptr), shape=(on.shape[0], len(row)))
    return np.asarray(gather @ cells)


def _three_bins(value: Array) -> Array:
    """(n, 3) float: shares of a value in overlapping bins with centres −½, 0, ½; farther out is the outer one's."""
    upper, lower = np.clip(2 * value, 0, 1), np.clip(-2 * value, 0, 1)
    return np.stack([lower, 1 - lower - upper, upper], axis=1)


def _travel_weights(travelled: float, step: float) -> Array:
    """(8,) float: shares of a place at this distance in the travel bins, times the density of the prior.

    Bins grow by a quarter each and are equally likely, so that distances in a wide bin are less so.
    """
    widths = _RATIO ** np.arange(_TRAVEL)
    edges = np.concatenate([[0], np.cumsum(widths)]) * _FARTHEST / widths.sum()
    centres = (edges[1:] + edges[:-1]) / 2
    own = min(int(np.searchsorted(edges, travelled, side="left")) - 1, _TRAVEL - 1)
    place = np.interp(travelled, centres, np.arange(_TRAVEL))
    weights = np.maximum(0, 1 - np.abs(np.arange(_TRAVEL) - place))
    return np.asarray(weights * step / (edges[own + 1] - edges[own]))


@dataclass(frozen=True, eq=False)
class Steps:
    """A graph whose vertices lie about `step` apart along the line.

    xy : (k, 2) float, in the unit of the graph.
    density : (k,) float.
    edges : (m, 2) int.
    step : length of an edge.
    low, high, part : (n,): the vertex i of the graph lies between `low[i]` and `high[i]`, `part[i]` of the way.
    """

    xy: Array
    density: Array
    edges: Indices
    step: float
    low: Indices
    high: Indices
    part: Array


def even_steps(graph: LineGraph, step: float) -> Steps:
    """Each branch cut in parts of equal length, as near to `step` as goes; junctions and ends stay."""
    knots = np.flatnonzero(graph.degree != 2)
    number = np.full(len(graph), -1, dtype=np.intp)
    number[knots] = np.arange(len(knots))
    places, inks, pairs = [graph.xy[knots]], [graph.density[knots]], []
    low, high = np.zeros(len(graph), dtype=np.intp), np.zeros(len(graph), dtype=np.intp)
    part = np.zeros(len(graph))
    low[knots] = high[knots] = number[knots]
    count = len(knots)
    for path in graph.branches:
        if len(path) < 2:
            continue
        if number[path[0]] < 0:  # a loop without a junction: its first vertex becomes a knot
            number[path[0]] = low[path[0]] = high[path[0]] = count
            places.append(graph.xy[path[:1]])
            inks.append(graph.density[path[:1]])
            count += 1
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(graph.xy[path], axis=0), axis=1))])
        # a branch back to its own beginning needs two vertices on the way, or it would vanish
        parts = max(3 if path[0] == path[-1] else 1, round(along[-1] / step))
        at = np.linspace(0, along[-1], parts + 1)[1:-1]
        places.append(np.stack([np.interp(at, along, graph.xy[path, k]) for k in (0, 1)], axis=1))
        inks.append(np.interp(at, along, graph.density[path]))
        row = np.concatenate([[number[path[0]]], np.arange(count, count + parts - 1), [number[path[-1]]]])
        count += parts - 1
        pairs.append(np.stack([row[:-1], row[1:]], axis=1))
        place = along[1:-1] / max(along[-1], 1e-12) * parts
        left = np.minimum(place.astype(np.intp), parts - 1)
        low[path[1:-1]], high[path[1:-1]], part[path[1:-1]] = row[left], row[left + 1], place - left
    edges = np.concatenate(pairs) if pairs else np.zeros((0, 2), dtype=np.intp)
    edges = np.unique(np.sort(edges, axis=1), axis=0) if len(edges) else edges
    return Steps(np.concatenate(places), np.concatenate(inks), edges, step, low, high, part)
