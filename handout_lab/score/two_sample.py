"""Can a machine that has seen both tell an author's real lines from lines made in his hand?

A classifier is trained on some real and some made lines and judged on others: a classifier two-sample test.  Half
right is as good as guessing.  A line is described by its hinge, run lengths, quill and what a ruler says of it; every
histogram bin counts in units of the root of its mean (as χ² does), every kind of measure weighs as much as the other,
and a linear discriminant with a ridge decides, its threshold half way between the classes.

Lines are left out in turn, whole, one part of each class at a time, so that never two pieces of one line stand on both
sides.  The interval is Wilson's at 95 % for as many lines as were judged; the p-value counts how often shuffled labels
do as well.

Source: D. Lopez-Paz, M. Oquab, "Revisiting Classifier Two-Sample Tests", 2017; E. B. Wilson, 1927; B. Phipson,
G. K. Smyth, "Permutation p-values should never be zero", 2010.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.values import Array, Indices
from handout_lab.score.features import LineFeatures

LEAST = 4  # lines of either kind
GOAL = 0.60
FOLDS, REPEATS, PERMUTATIONS = 8, 4, 199
_RIDGE = 1.0  # of the mean variance of a line
_FLOOR = 0.2  # of the mean of a histogram's bins: rarer bins weigh no more
_CLIP = 3.0  # standard deviations
_Z = 1.959964


@dataclass(frozen=True)
class TwoSample:
    """What the classifier makes of it.

    accuracy : mean of both classes' shares of lines that were told right, 0–1; 0.5 is guessing.
    low, high : 95 % interval of it.
    real, synthetic : lines of either kind.
    n : lines that such an accuracy would have been measured on, were there as many of either kind.
    p : how likely guessing would do as well.
    """

    accuracy: float
    low: float
    high: float
    real: int
    made: int
    n: float
    p: float

    @property
    def verdict(self) -> str:
        """In words: told apart, not told apart, or too few lines to say."""
        if self.low > GOAL:
            return "told apart"
        if self.high <= GOAL:
            return "not told apart"
        return "too few lines to say"


def two_sample(
    real: Sequence[LineFeatures],
    synthetic: Sequence[LineFeatures],
    rng: np.random.Generator,
    *,
    permutations: int = PERMUTATIONS,
) -> TwoSample:
    """Tell real lines of an author from made ones.

    Parameters
    ----------
    real, synthetic : at least `LEAST` lines each; the made ones in the same hand, and none of them made from `real`.
    permutations : of the labels, for the p-value.

    Raises
    ------
    InputError
        Too few lines.
    """
    if min(len(real), len(synthetic)) < LEAST:
        raise InputError(
            f"There are {len(real)} real and {len(synthetic)} made lines, too few to tell them apart: at least {LEAST} "
            "of each are needed, and 50 for an interval of ±0.1."
        )
    kernel = _kernel([*real, *synthetic])
    label = np.repeat([1.0, -1.0], [len(real), len(synthetic)])
    accuracy = _accuracy(kernel, label, rng)
    chance = [_accuracy(kernel, rng.permutation(label), rng) for _ in range(permutations)]
    n = 4 / (1 / len(real) + 1 / len(synthetic))
    low, high = wilson(accuracy, n)
    p = (1 + sum(other >= accuracy for other in chance)) / (1 + permutations)
    return TwoSample(accuracy, low, high, len(real), len(synthetic), n, p)


def together(tests: Sequence[TwoSample]) -> TwoSample:
    """Several tests as one: accuracies weighed by their lines; p is Fisher's combination.

    Source: R. A. Fisher, "Statistical Methods for Research Workers", 1925, §21.1.
    """
    from scipy.stats import chi2

    n = np.array([test.n for test in tests])
    accuracy = float(np.average([test.accuracy for test in tests], weights=n))
    low, high = wilson(accuracy, float(n.sum()))
    p = float(chi2.sf(-2 * np.sum(np.log([test.p for test in tests])), 2 * len(tests)))
    return TwoSample(accuracy, low, high, sum(t.real for t in tests), sum(t.made for t in tests), float(n.sum()), p)


def wilson(share: float, n: float, z: float = _Z) -> tuple[float, float]:
    """Wilson's interval of a share of n."""
    middle = (share + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    return float(max(0.0, middle - half)), float(min(1.0, middle + half))


def _kernel(lines: Sequence[LineFeatures]) -> Array:
    """(n, n) inner products of the lines, all kinds of measure weighing the same; no label is known here."""
    blocks = [_bins(np.array([line.hinge.ravel() for line in lines]))]
    blocks += [_bins(np.array([line.runs[k] for line in lines])) for k in range(4)]
    blocks.append(_bins(np.array([line.quill.ravel() for line in lines])))
    blocks.append(_figures(np.array([line.figures for line in lines])))
    total = np.zeros((len(lines), len(lines)))
    for block, weight in zip(blocks, (1, 0.25, 0.25, 0.25, 0.25, 1, 1), strict=True):
        gram = (block - block.mean(axis=0)) @ (block - block.mean(axis=0)).T
        total += weight * gram / max(float(np.trace(gram)) / len(lines), 1e-12)
    return total


def _bins(counts: Array) -> Array:
    """Shares (n, b) in units of the root of their mean."""
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    usual = shares.mean(axis=0)
    return np.asarray(shares / np.sqrt(usual + _FLOOR * usual.mean() + 1e-12))


def _figures(values: Array) -> Array:
    spread = values.std(axis=0)
    return np.asarray(np.clip((values - values.mean(axis=0)) / np.where(spread > 0, spread, 1.0), -_CLIP, _CLIP))


def _accuracy(kernel: Array, label: Array, rng: np.random.Generator) -> float:
    """Mean share told right of both classes, over several ways of leaving lines out."""
    folds = np.stack([_folds(label, rng) for _ in range(REPEATS)])
    out = (folds[:, None] == np.arange(int(folds.max()) + 1)[:, None]).reshape(-1, len(label))
    right = np.where(out, _told_right(kernel, label, out), 0.0).sum(axis=0) / REPEATS
    return float((right[label > 0].mean() + right[label < 0].mean()) / 2)


def _folds(label: Array, rng: np.random.Generator) -> Indices:
    """(n,) the fold of each line; every fold holds some of both classes."""
    least = int(min((label > 0).sum(), (label < 0).sum()))
    fold = np.zeros(len(label), dtype=np.intp)
    for side in (1, -1):
        members = np.flatnonzero(label == side)
        fold[rng.permutation(members)] = np.arange(len(members)) % min(FOLDS, least)
    return fold


def _told_right(kernel: Array, label: Array, out: NDArray[np.bool_]) -> Array:
    """(m, n): which lines are told right by those that are not in `out` (m, n): 1, 0, or ½ where it cannot decide.

    Lines that are left out have a weight of 0: their rows of the system are those of the identity.
    """
    included = (~out).astype(np.float64)
    positive, negative = included * (label > 0), included * (label < 0)
    positive, negative = positive / positive.sum(axis=1, keepdims=True), negative / negative.sum(axis=1, keepdims=True)
    size = included.sum(axis=1)
    # centred on what is known, as if the lines left out had never been seen
    mean = included @ kernel / size[:, None]
    middle = (mean * included).sum(axis=1) / size
    inner = kernel - mean[:, :, None] - mean[:, None, :] + middle[:, None, None]
    inner *= included[:, :, None] * included[:, None, :]
    ridge = _RIDGE * np.trace(inner, axis1=1, axis2=2) / size
    inner += np.eye(len(label)) * np.where(out, 1.0, ridge[:, None])[:, None, :]
    score = np.linalg.solve(inner, (positive - negative)[:, :, None])[:, :, 0] @ kernel
    between = ((positive + negative) * score).sum(axis=1, keepdims=True) / 2
    return np.asarray((np.sign(score - between) * label + 1) / 2)
