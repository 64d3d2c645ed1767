"""The method "haines_2016": a random forest on line features and a chain with one state a letter.

Every column of a line has the mean of its vertices' random-walk features; a forest says which letter it may belong to;
the chain of letters with a spacer before and after each is laid along the columns by dynamic programming, free to stay
or to go on.  There are no widths and nothing is learned from the page.  It is kept for the comparison.

Source: seed 000, §5.1.3, §7.3 and Appendix D.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from handout.progress import Tell, silent
from handout.scanning.feature import SIZE, line_features
from handout.scanning.skeleton import skeleton_graph
from handout.tagging.alphabet import LETTERS, SPACE, THIRDS
from handout.tagging.decoder import Decoded
from handout.tagging.features import INKY, STEP, X_HEIGHT, Image
from handout.tagging.transcript import Written
from handout.values import Array, LineGraph

if TYPE_CHECKING:
    from sklearn.ensemble import RandomForestClassifier

    from handout.tagging.segments import Page

TREES = 64
_MM = 2.5  # the x-height that a line is given, so that a walk reaches as far as on paper
_LINES = 80  # rendered to train the forest
_FLOOR = 1e-3  # of probabilities: a class the forest never saw here is not impossible


def column_features(image: Image) -> NDArray[np.float32]:
    """(n, 216): mean line feature of every described column of a straightened line, 0 where there is no ink."""
    import cv2

    ink = image > INKY
    count = -(-image.shape[1] // STEP)
    total = np.zeros((count, SIZE), dtype=np.float32)
    xy, edges = skeleton_graph(ink, np.asarray(cv2.distanceTransform(ink.astype(np.uint8), cv2.DIST_L2, 5)))
    if not len(xy):
        return total
    ones = np.ones(len(xy))
    graph = LineGraph(xy * (_MM / X_HEIGHT), ones, ones, xy, edges)
    column = np.clip(np.rint(xy[:, 0] / STEP).astype(np.intp), 0, count - 1)
    np.add.at(total, column, line_features(graph))
    often = np.maximum(np.bincount(column, minlength=count), 1).astype(np.float32)
    return np.asarray(total / often[:, None], dtype=np.float32)


def train(rng: np.random.Generator, lines: int = _LINES) -> RandomForestClassifier:
    """A forest that tells the letters of columns, trained on lines written by the built-in hands."""
    from sklearn.ensemble import RandomForestClassifier

    from handout.prompting import corpus
    from handout.tagging.synthetic_lines import column_states, synthetic_lines
    from handout.tagging.synthetic_writers import built_in_hands

    features, letters = [], []
    for made in synthetic_lines(built_in_hands(), corpus.shipped(), lines, rng):
        columns = column_features(made.image)
        states = column_states([(s.letter, s.left, s.right) for s in made.spans], len(columns)) // THIRDS
        inky = columns.any(axis=1)
        features.append(columns[inky])
        letters.append(states[inky])
    forest = RandomForestClassifier(TREES, max_features="sqrt", random_state=int(rng.integers(2**31)))
    return forest.fit(np.concatenate(features), np.concatenate(letters))


@lru_cache(maxsize=1)
def _forest() -> RandomForestClassifier:
    return train(np.random.default_rng(0))


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


def haines_2016(
    page: Page, lines: Sequence[Written], rng: np.random.Generator, tell: Tell = silent
) -> list[list[Decoded]]:
    """For every line its one decoding."""
    forest = _forest()
    return [[laid(log_probability(forest, i), line.letters)] for i, line in zip(page.images, lines, strict=True)]
