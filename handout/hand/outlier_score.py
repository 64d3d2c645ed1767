"""How unlike its siblings a glyph is: one Gaussian for each letter of a hand, all of one shrunken covariance.

A letter's centre in a hand lies about its centre in all hands (`between`), its glyphs lie about that (`within`).  Both
are known from simulated writers; the centre of a hand's letter then follows from the siblings of a glyph, without the
glyph itself, and where these are few stays near that of all hands.  `within` is adapted to the hand: the covariance of
its own glyphs about their centres, shrunken towards that of the simulated writers by as much as Ledoit and Wolf's rule
says.  Glyphs that are far off hardly count as siblings.

From a glyph's distance, its distance to the nearest siblings, how much nearer another letter is, and how far each
single feature is off, `OutlierModel.score` makes one figure by weights learned from simulated pages with faults.

Source: Ledoit and Wolf 2004 (the shrinkage); otherwise own method.
"""

from __future__ import annotations

import unicodedata
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.hand.glyph_features import COUNT
from handout.values import Array, Indices


@dataclass(frozen=True)
class OutlierSettings:
    """Set on simulated writers that had no part in learning the weights."""

    rounds: int = 3  # of centres, covariance and which glyphs are far off
    far: float = 2.0  # times the usual squared distance, where a glyph counts as half a sibling
    steep: float = 0.25  # of how fast it counts less beyond that
    least: int = 30  # glyphs with siblings, below which the covariance is that of the simulated writers
    kin: int = 2  # nearest siblings, the last of which is looked at
    floor: float = 1e-3  # of distances, so that twins have a logarithm
    widest: float = 3.0  # of the logarithm of a ratio of distances
    clearest: float = 1.5  # of how much nearer another letter may be, a feature
    lone: float = 1.5  # times its distance from the centre, that of the nearest sibling where there is none


SETTINGS = OutlierSettings()
# Of the score, that a nat of strangeness (`author_reader`) counts; and share of what a shape says that is not believed
# of a letter without siblings, half of it with one, a third with two.  On pages of eight people (csafe w0076 w0122
# w0154 w0180 w0238 w0394, cvl 0012 0013), where letters were spoilt and siblings taken away on purpose, wrong ones
# ranked before right ones with a chance of .905 while shapes of lone letters were believed like all others and a nat
# counted .7, and .927 with these (of letters of which there are one or two, .863 and .897); on five others .900, .929
READING, LONE = 1.0, 0.7
_FAR = 1e6  # squared distance to the nearest other letter where there is none
# of the figures of the evidence, those that depend on the glyph and its siblings' centre alone
ALONE = [0, 1, *range(8, 8 + COUNT)]


@dataclass(frozen=True, eq=False)
class OutlierModel:
    """What is known of glyphs before a hand is seen, and what their evidence weighs.

    middle, spread : (d,) of the features; all that follows is of features less `middle`, over `spread`.
    within, between : (d, d) covariance of glyphs about their letter's centre in a hand, and of that about `centres`.
    centres : letter → (d,).
    anywhere, apart : (d,), (d, d) mean and covariance of all centres: of letters that are not among them.
    weights, bias : (8 + d,), of the evidence: the sum is the logarithm of the odds that a glyph is wrong.
    alone, alone_bias : (2 + d,), the same of what depends on the glyph and its siblings' centre alone (`ALONE`).
    """

    middle: Array
    spread: Array
    within: Array
    between: Array
    centres: Mapping[str, Array]
    anywhere: Array
    apart: Array
    weights: Array
    bias: float
    alone: Array
    alone_bias: float

    def score(self, features: Array, letters: Sequence[str]) -> Array:
        """(n,): how unlike their siblings glyphs with some features (n, d) are, which are called `letters` (n,)."""
        if not len(features):
            return np.zeros(0)
        siblings = Siblings(self, features, letters)
        return np.asarray((siblings.evidence() @ self.weights + self.bias) * siblings.trust)

    def evidence(self, features: Array, letters: Sequence[str]) -> Array:
        """(n, 8 + d): what the score is the weighted sum of."""
        return Siblings(self, features, letters).evidence()


class Siblings:
    """The glyphs of a hand in a frame in which glyphs differ from their centres by 1 in every direction.

    features : (n, d), n ≥ 1; letters : (n,) what the glyphs are called.
    """

    def __init__(self, model: OutlierModel, features: Array, letters: Sequence[str]) -> None:
        self._model, self._root = model, np.linalg.cholesky(model.within)
        self._features = (features - model.middle) / model.spread
        names: NDArray[np.str_] = np.array(letters)
        self._letters, self._of = np.unique(names, return_inverse=True)
        self._groups = [np.flatnonzero(self._of == number) for number in range(len(self._letters))]
        self._weight = np.ones(len(features))
        bare = np.array([unicodedata.normalize("NFD", letter)[:1].lower() for letter in self._letters.tolist()])
        self._alike = bare[:, None] == bare  # letters that are no rivals of one another
        for number in range(SETTINGS.rounds):
            self._fit(weighing=number < SETTINGS.rounds - 1)

    def right(self, glyphs: Indices, features: Array, strangeness: Array | float = 0.0) -> Array:
        """(k,): the probability that some glyphs (k,) would be right with other features (k, d).

        strangeness : (k,) of how they would read alone, see `author_reader`.
        """
        place = (features - self._model.middle) / self._model.spread @ self._frame
        off, variance = place - self._mean[glyphs], self._own[glyphs]
        residual = off @ self._back / np.sqrt(variance @ np.square(self._back))
        square = (np.square(off) / variance).mean(axis=1)
        distance = np.log(square / self._usual + SETTINGS.floor)
        evidence = np.column_stack([distance, distance**2, np.log1p(np.square(residual))])
        odds = (evidence @ self._model.alone + self._model.alone_bias) * self.trust[glyphs] + READING * strangeness
        return np.asarray(1 / (1 + np.exp(np.clip(odds, -50, 50))))

    def _fit(self, *, weighing: bool) -> None:
        """Adapt the frame, the centres and the distances to the siblings; then what counts as one, too."""
        from scipy.linalg import eigh

        within = self._root @ self._covariance() @ self._root.T
        variance, frame = eigh(self._model.between, within)
        self._frame, self._variance = frame, np.maximum(variance, 1e-6)
        self._place, self._back = self._features @ frame, np.linalg.inv(frame)
        self._strange = np.einsum("ji,jk,ki->i", frame, self._model.apart, frame)
        self._mean, self._own = np.empty_like(self._features), np.empty_like(self._features)
        square, self._own_density = np.empty(len(self._of)), np.empty(len(self._of))
        self._residual = np.empty_like(self._features)
        for number, group in enumerate(self._groups):
            weight = self._weight[group]
            total, place = weight.sum(), weight @ self._place[group]
            mean, variance = self._predict_glyphs(number, total - weight, place - weight[:, None] * self._place[group])
            self._mean[group], self._own[group] = mean, variance
            off = self._place[group] - mean
            square[group], self._own_density[group] = _sum_distances(np.square(off) / variance, variance)
            self._residual[group] = off @ self._back / np.sqrt(variance @ np.square(self._back))
        distance = square / self._features.shape[1]
        self._usual = float(np.median(distance))
        self._distance = distance / self._usual
        if weighing:
            off = np.clip((self._distance - SETTINGS.far) / SETTINGS.steep, -50, 50)
            self._weight = 1 / (1 + np.exp(off))

    def _predict_glyphs(self, number: int, total: Array, place: Array) -> tuple[Array, Array]:
        """(k, d), (k, d): mean and variance of glyphs, given what their siblings count (k,) and sum up to."""
        name = str(self._letters[number])
        known = name in self._model.centres
        centre = self._model.centres.get(name, self._model.anywhere) @ self._frame
        spread = self._variance if known else self._variance + self._strange
        count = np.maximum(total, 1e-9)[:, None]
        trust = spread / (spread + 1 / count)
        return centre + trust * (place / count - centre), 1 + spread - trust * spread

    def _rival(self) -> Array:
        """(n,): logarithm of the density of the most probable other letter, as of `_sum_distances`."""
        best = np.full(len(self._of), -np.inf)
        squares = np.square(self._place)
        for number, group in enumerate(self._groups):
            weight = self._weight[group]
            mean, variance = self._predict_glyphs(
                number, weight.sum(keepdims=True), (weight @ self._place[group])[None]
            )
            pull = (mean / variance)[0]
            away = squares @ (1 / variance[0]) - 2 * self._place @ pull + pull @ mean[0]
            density = -0.5 * (away + np.log(variance).sum())
            density[self._alike[self._of, number]] = -np.inf
            np.maximum(best, density, out=best)
        return best

    def _covariance(self) -> Array:
        """(d, d): of the glyphs about their siblings' mean, in the frame in which `within` is one, shrunken to that."""
        places = np.linalg.solve(self._root, self._features.T).T
        rows = []
        for group in self._groups:
            weight = self._weight[group]
            if len(group) < 3 or weight.sum() < 2:
                continue
            mean = weight @ places[group] / weight.sum()
            free = max(weight.sum() - 1, 0.5) / weight.sum()
            rows.append((places[group] - mean)[weight > 0.5] / np.sqrt(free))
        about = np.concatenate(rows) if rows else np.zeros((0, places.shape[1]))
        return shrunken(about) if len(about) >= SETTINGS.least else np.eye(places.shape[1])

    def evidence(self) -> Array:
        """(n, 8 + d): see `OutlierModel`."""
        width = self._features.shape[1]
        odds = (self._own_density - self._rival()) / width
        clear = np.clip(odds, -SETTINGS.clearest, SETTINGS.clearest)
        distance, alone = np.log(self._distance + SETTINGS.floor), 1 / np.sqrt(self._siblings)
        near, far = self._nearest(width)
        # glyphs of a page that is there twice have no distance
        kin = np.log(near / max(float(np.median(near)), SETTINGS.floor) + SETTINGS.floor)
        ratio = np.clip(np.log((near + SETTINGS.floor) / (far + SETTINGS.floor)), -SETTINGS.widest, SETTINGS.widest)
        shape = [distance, distance**2, clear, np.minimum(clear, 0), kin, ratio, alone, distance * alone]
        return np.column_stack([*shape, np.log1p(np.square(self._residual))])

    @property
    def trust(self) -> Array:
        """(n,): what share of what each glyph's shape says is believed."""
        return 1 - LONE / self._siblings

    @cached_property
    def _siblings(self) -> Array:
        """(n,): glyphs of the letter of each."""
        return np.bincount(self._of)[self._of].astype(np.float64)

    def _nearest(self, width: int) -> tuple[Array, Array]:
        """(n,), (n,): squared distance to one of the nearest siblings, and to one of the nearest of other letters."""
        length = np.square(self._place).sum(axis=1)
        near, far = SETTINGS.lone * self._distance, np.full(len(length), _FAR)
        for group in self._groups:
            away = length[group, None] + length - 2 * self._place[group] @ self._place.T
            kin = away[:, group]
            np.fill_diagonal(kin, np.inf)
            at = min(SETTINGS.kin, len(group) - 1)
            if at > 0:
                near[group] = np.partition(kin, at - 1, axis=1)[:, at - 1] / width
            away[:, group] = np.inf
            if away.shape[1] - len(group) >= SETTINGS.kin:
                far[group] = np.partition(away, SETTINGS.kin - 1, axis=1)[:, SETTINGS.kin - 1] / width
        return np.maximum(near, 0.0), np.maximum(far, 0.0)


def _sum_distances(squares: Array, variance: Array) -> tuple[Array, Array]:
    """(k,), (k,): squared distance, and logarithm of the density but for a constant."""
    square = squares.sum(axis=1)
    return square, -0.5 * (square + np.log(variance).sum(axis=1))


def shrunken(rows: Array) -> Array:
    """(d, d): covariance of rows (n, d) about 0, shrunken towards the unit matrix. Source: Ledoit and Wolf 2004."""
    count, width = rows.shape
    sample, unit = rows.T @ rows / count, np.eye(width)
    scatter = np.square(np.square(rows).sum(axis=1)).sum() / count**2 - np.square(sample).sum() / count
    share = float(np.clip(scatter / max(np.square(sample - unit).sum(), 1e-12), 0.0, 1.0))
    return np.asarray((1 - share) * sample + share * unit)


ARRAYS = ("middle", "spread", "within", "between", "anywhere", "apart", "weights", "alone")


def load(path: Path) -> OutlierModel:
    """Read a model. Raises InputError: not such a file."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name].astype(np.float64) for name in ARRAYS}
            centres = dict(zip(str(file["letters"]), file["centres"].astype(np.float64), strict=True))
            return OutlierModel(
                **arrays, centres=centres, bias=float(file["bias"]), alone_bias=float(file["alone_bias"])
            )
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise InputError(f"{path} cannot be read as a model of outliers: {error}.") from error


@lru_cache(maxsize=1)
def load_model() -> OutlierModel:
    """The model that handout comes with."""
    return load(Path(__file__).resolve().parent / "outliers.npz")
