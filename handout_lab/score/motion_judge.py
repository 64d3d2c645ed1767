"""Can a machine that has seen both tell the motion of real pens from motion that was made?

A small recurrent network sees two seconds of writing, as velocities and lifts of the pen, learns on some writers and
judges others: its area under the curve (AUC) is how often it takes a made window for more likely made than a real one.
0.5 is guessing.  Nothing of it is kept.

What a tablet leaves in a recording must not tell: paths are smoothed alike and sampled alike, and speeds are in units
of the page's own, so that neither resolution nor the size of the writing counts.  Pressure is not looked at.

Source: own method; the network is that of `motion.learned.recurrent`; D. Lopez-Paz, M. Oquab, "Revisiting Classifier
Two-Sample Tests", 2017; the interval is B. Efron's percentile bootstrap, "Bootstrap methods", 1979, over writers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from handout.errors import InputError
from handout.motion.learned import recurrent
from handout.networks import Adam, Floats, clip_norm, one_thread
from handout.progress import Tell, silent
from handout.values import Array, Drawing, Indices, Stroke

_FINE = 0.005  # s: paths are smoothed at this pace
_SMOOTH = 0.015  # s, of a Gaussian: passes the 10 Hz of a hand and not the noise of tablets
_STEP = 0.02  # s between the samples that the network sees
_LENGTH = 100  # of them, with the pen down, a window
_LONGEST_LIFT = 3.0  # s: longer is thinking
_COLUMNS = (
    6  # velocity x, y; whether a stroke begins; the way of the lift before it x, y, and the logarithm of its time
)
_INPUTS = _COLUMNS + 2  # the same, with the logarithm of the speed and the turn since the sample before
_SLOWEST = 0.05  # of the page's speed: what is slower rests
_WARM = 20  # samples that the network has seen before what it says counts
# set by eye, not searched: with them both controls come out as they should
_HIDDEN, _BATCH, _UPDATES = 24, 32, 300  # units of the network; windows of an update, half of them made; updates
_RATE, _FINAL = 8e-3, 0.05  # of Adam at first, and the share that it falls to as a cosine
_DROPPED, _CLIP = 0.2, 1.0  # share of units that is left out in learning; greatest norm of a gradient
_SCALE, _TURN = 0.1, np.radians(4)  # by which windows are varied each time they are learned from
_FOLDS, _DRAWS = 5, 1000  # rounds of learning and judging; times that writers are drawn anew for the interval
LEAST = 2  # writers of either kind


@dataclass(frozen=True, eq=False)
class Sample:
    """Motion of one writer: windows (n, steps, columns), and whether it was made."""

    writer: str
    made: bool
    windows: Floats


@dataclass(frozen=True)
class Judgement:
    """What the judge makes of it.

    auc : 0–1; low, high : its 95 % interval, by drawing writers anew.
    real, made : windows of either kind; real_writers, made_writers : of how many.
    """

    auc: float
    low: float
    high: float
    real: int
    made: int
    real_writers: int
    made_writers: int

    @property
    def verdict(self) -> str:
        """In words: told apart, not told apart, or too few writers to say."""
        if self.low > 0.5:
            return "told apart"
        return "not told apart" if self.high < 0.75 else "too few writers to say"


def sample(drawing: Drawing, writer: str, made: bool) -> Sample:
    """What the judge sees of a drawing, as many whole windows as there are.

    Raises
    ------
    InputError
        The drawing has no times.
    """
    if not drawing.timed:
        raise InputError("The strokes have no times: the judge of motion needs a recorded pen, or what handout wrote.")
    parts, before = [], None
    for stroke in drawing.strokes:
        parts.append(_seen(stroke, before))
        before = stroke
    rows = np.concatenate(parts) if parts else np.zeros((0, _COLUMNS))
    pace = math.sqrt(float(np.square(rows[:, :2]).sum(axis=1).mean())) if len(rows) else 1.0
    rows[:, [0, 1, 3, 4]] /= max(pace, 1e-9)
    count = len(rows) // _LENGTH
    return Sample(writer, made, rows[: count * _LENGTH].reshape(count, _LENGTH, _COLUMNS).astype(np.float32))


def _seen(stroke: Stroke, before: Stroke | None) -> Array:
    """(n, columns): a stroke and the lift before it, in mm and s."""
    fine = np.arange(stroke.t[0], stroke.t[-1] + _FINE / 2, _FINE)
    xy = np.stack([np.interp(fine, stroke.t, side) for side in stroke.xy.T], axis=1)
    xy = gaussian_filter1d(xy, _SMOOTH / _FINE, axis=0, mode="nearest")[:: round(_STEP / _FINE)]
    rows = np.zeros((max(len(xy) - 1, 1), _COLUMNS))
    rows[: len(xy) - 1, :2] = np.diff(xy, axis=0) / _STEP
    if before is not None:
        rows[0, 2] = 1.0
        rows[0, 3:5] = stroke.xy[0] - before.xy[-1]
        rows[0, 5] = math.log1p(min(float(stroke.t[0] - before.t[-1]), _LONGEST_LIFT) / _STEP)
    return rows


def steady(drawing: Drawing) -> Drawing:
    """The same paths at the average speed of the drawing throughout, with its own lifts: crude motion, for control."""
    length = sum(stroke.length for stroke in drawing.strokes)
    speed = length / max(sum(float(stroke.t[-1] - stroke.t[0]) for stroke in drawing.strokes), 1e-9)
    strokes, clock, before = [], 0.0, None
    for stroke in drawing.strokes:
        clock += 0.0 if before is None else float(stroke.t[0] - before.t[-1])
        way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(stroke.xy, axis=0).T))])
        t = clock + way / speed + 1e-6 * np.arange(len(way))
        strokes.append(Stroke(t, stroke.xy))
        clock, before = float(t[-1]), stroke
    return replace(drawing, strokes=tuple(strokes))


@one_thread
def judge(samples: Sequence[Sample], rng: np.random.Generator, tell: Tell = silent) -> Judgement:
    """Tell made motion from real, writers kept apart.

    Parameters
    ----------
    samples : of at least `LEAST` writers of either kind; a writer of both is left out whole.

    Raises
    ------
    InputError
        Too few writers with a whole window.
    """
    samples = [sample for sample in samples if len(sample.windows)]
    writers = {made: sorted({s.writer for s in samples if s.made is made}) for made in (False, True)}
    if min(map(len, writers.values())) < LEAST:
        raise InputError(
            f"Motion of {len(writers[False])} real and {len(writers[True])} made writers is too little to keep writers "
            f"apart: at least {LEAST} of each are needed, with {_LENGTH * _STEP:g} s of pen on paper."
        )
    names = sorted({*writers[False], *writers[True]})
    fold = _folds(writers, rng)
    x = np.concatenate([sample.windows for sample in samples])
    made = np.repeat([sample.made for sample in samples], [len(sample.windows) for sample in samples])
    who = np.repeat([names.index(s.writer) for s in samples], [len(s.windows) for s in samples])
    out = np.array([fold[name] for name in names])[who]
    score = np.zeros(len(x))
    for number in range(max(fold.values()) + 1):
        tell(number / (max(fold.values()) + 1), "learning to tell motion")
        network = _trained(x[out != number], made[out != number], who[out != number], rng)
        score[out == number] = _logits(network, x[out == number])
    wins, pairs = _duels(score, made, who, out, len(names))
    drawn = rng.multinomial(len(names), np.full(len(names), 1 / len(names)), _DRAWS).astype(np.float64)
    counts = np.einsum("di,ij,dj->d", drawn, pairs, drawn)
    again = np.einsum("di,ij,dj->d", drawn, wins, drawn)[counts > 0] / counts[counts > 0]
    low, high = np.quantile(again, [0.025, 0.975]).tolist()
    sizes = int((~made).sum()), int(made.sum())
    return Judgement(float(wins.sum() / pairs.sum()), low, high, *sizes, len(writers[False]), len(writers[True]))


def _folds(writers: dict[bool, list[str]], rng: np.random.Generator) -> dict[str, int]:
    """The fold in which each writer is judged; every fold has some of both kinds, as far as they reach."""
    count, fold = min(_FOLDS, *map(len, writers.values())), dict[str, int]()
    both = {*writers[False]} & {*writers[True]}
    # writers of one kind go on where those of both end, so that no fold lacks either
    for names, begin in ((sorted(both), 0), (writers[False], len(both)), (writers[True], len(both))):
        left = [name for name in names if name not in fold]
        for at, name in enumerate(rng.permutation(np.array(left, dtype=object)).tolist(), begin):
            fold[name] = at % count
    return fold


def _trained(x: Floats, made: Array, who: Indices, rng: np.random.Generator) -> list[Floats]:
    """A network that says of windows (n, steps, columns) whether they were made; writers count alike."""
    parameters = recurrent.initial_weights(_INPUTS, (_HIDDEN,), 1, rng)
    adam = Adam(parameters)
    sides = [[np.flatnonzero((made == kind) & (who == one)) for one in np.unique(who[made == kind])] for kind in (0, 1)]
    label = np.repeat([0.0, 1.0], _BATCH // 2)
    for update in range(_UPDATES):
        rows = [rng.choice(side[rng.integers(len(side))]) for side in sides for _ in range(_BATCH // 2)]
        outputs, passes = recurrent.forward(parameters, _inputs(_varied(x[rows], rng)), _DROPPED, rng)
        logit = outputs[_WARM:, :, 0].mean(axis=0)
        slopes = np.zeros_like(outputs)
        slopes[_WARM:, :, 0] = (1 / (1 + np.exp(-logit)) - label) / (_BATCH * (_LENGTH - _WARM))
        gradients = recurrent.backward(parameters, passes, slopes)
        clip_norm(gradients, _CLIP)
        adam.step(gradients, _RATE * (_FINAL + (1 - _FINAL) * 0.5 * (1 + math.cos(math.pi * update / _UPDATES))))
    return parameters


def _varied(x: Floats, rng: np.random.Generator) -> Floats:
    """Windows, each a little larger or smaller and turned."""
    scale = np.exp(rng.normal(0, _SCALE, len(x)))
    angle = rng.normal(0, _TURN, len(x))
    turn = scale[:, None, None] * np.stack([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).T
    x = x.copy()
    x[..., :2], x[..., 3:5] = x[..., :2] @ turn, x[..., 3:5] @ turn
    return x


def _inputs(x: Floats) -> Floats:
    """(steps, n, inputs) of windows (n, steps, columns): speed and turn are told besides the velocity."""
    way = x[..., 0] + 1j * x[..., 1]
    speed = np.log(np.maximum(np.abs(way), _SLOWEST))
    turn = np.zeros_like(speed)
    turn[:, 1:] = np.angle(way[:, 1:] * way[:, :-1].conj()) * (x[:, 1:, 2] == 0)
    told = np.concatenate([x, speed[..., None], turn[..., None]], axis=2)
    return np.ascontiguousarray(np.swapaxes(told, 0, 1), dtype=np.float32)


def _logits(parameters: Sequence[Floats], x: Floats) -> Array:
    outputs, _ = recurrent.forward(parameters, _inputs(x))
    return np.asarray(outputs[_WARM:, :, 0].mean(axis=0), dtype=np.float64)


def _duels(score: Array, made: Array, who: Indices, fold: Indices, count: int) -> tuple[Array, Array]:
    """(writers, writers) how many made windows of one score above real ones of another, and how many met.

    Windows meet that the same network has judged; a tie is half a win.
    """
    wins, pairs = np.zeros((count, count)), np.zeros((count, count))
    for number in np.unique(fold):
        here = [np.flatnonzero((fold == number) & (made == kind)) for kind in (0, 1)]
        above = np.sign(score[here[1]][:, None] - score[here[0]]) / 2 + 0.5
        np.add.at(wins, (who[here[1]][:, None], who[here[0]]), above)
        np.add.at(pairs, (who[here[1]][:, None], who[here[0]]), 1.0)
    return wins, pairs
