"""How faithfully strokes were executed, and what a machine did with a plan, worked out from its answers.

Two drawings are compared stroke by stroke, in their paths, speeds and time; strokes that go nowhere (dots) only count
for their place.

Each answer of a machine has come in between two moments: when this computer had listened last before, and when it was
heard (its clock, s). It says between which two of the plan's times the machine was. So the machine's delay on its
plan is known between two bounds, which are far apart where this computer was late. A machine is never faster than its
plan: its delay does not shrink, and a later answer's upper bound holds for all before it.

Time was lost only where the bounds leave no other way: the delay is taken to grow no more and no sooner than it must.
That is a rest if it grows much at once, slow going if it grows a little everywhere.  How far the upper bound is above
it at the end of a stroke is what may have been lost unnoticed: `Observation.least_s`.  Not seen either are rests before
the first or after the last answer of a stroke; two rests between the same two answers count as one.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handout.motion.timing import arc_length
from handout.plotting.dialects import Command
from handout.plotting.planning.plan import Plan
from handout.values import Array, Drawing, Stroke

_HALF = 0.005  # s; speeds are means over a hundredth of a second
_PATH_STEP = 0.02  # mm between points at which paths are compared
_LOOK = 0.6  # mm along the path within which the same place is looked for
_NEIGHBOURS = 25  # places over which the shift along the path is averaged
_LAGS = np.arange(-0.05, 0.0501, 0.0025)  # s


@dataclass(frozen=True)
class Fidelity:
    """Executed against intended.

    deviation : mm, greatest distance between the paths, either way.
    correlation, rms : of the speeds at the same places of the path; rms as a share of the greatest intended speed.
    timed, timed_rms : of the speeds at the same times, after the one shift of the clock that suits all strokes best.
    stretched : time the strokes took over the time they were meant to take.
    """

    deviation: float
    correlation: float
    rms: float
    timed: float
    timed_rms: float
    stretched: float


def compare_strokes(intended: Drawing, executed: Drawing) -> Fidelity:
    """Compare two drawings of the same strokes in the same order.

    Raises ValueError: they have not the same number of strokes, or none of them moves.
    """
    pairs = list(zip(intended.strokes, executed.strokes, strict=True))
    moving = [pair for pair in pairs if has_speed(*pair)]
    if not moving:
        raise ValueError("no stroke of the drawing moves")
    places = [_speeds_in_place(a, b) for a, b in moving]
    want, have = (np.concatenate(column) for column in zip(*places, strict=True))
    deviation = max(deviation_of(a, b) for a, b in pairs)
    return Fidelity(
        deviation,
        _correlation(want, have),
        _rms(want, have),
        *_compare_speeds(moving),
        measure_stretch(intended, executed),
    )


def measure_timing(intended: Drawing, executed: Drawing) -> float | None:
    """`Fidelity.timed` alone; None if no stroke is long enough to have a speed."""
    moving = [pair for pair in zip(intended.strokes, executed.strokes, strict=True) if has_speed(*pair)]
    return _compare_speeds(moving)[0] if moving else None


def measure_stretch(intended: Drawing, executed: Drawing) -> float:
    """Time the strokes took over the time they were meant to take; dots do not count."""
    planned, executed_time = measure_times(intended, executed)
    return executed_time / planned if planned > 0 else 1.0


def measure_times(intended: Drawing, executed: Drawing) -> tuple[float, float]:
    """Time the strokes were meant to take and took, s; dots do not count."""
    pairs = [(a, b) for a, b in zip(intended.strokes, executed.strokes, strict=False) if goes_somewhere(a, b)]
    return sum(float(a.t[-1] - a.t[0]) for a, _ in pairs), sum(float(b.t[-1] - b.t[0]) for _, b in pairs)


def goes_somewhere(intended: Stroke, executed: Stroke) -> bool:
    """Whether a stroke goes somewhere, as it was meant and as it was executed."""
    return intended.length > 0 and executed.length > 0


def has_speed(intended: Stroke, executed: Stroke) -> bool:
    """Whether a stroke moves, and for long enough to have a speed."""
    return goes_somewhere(intended, executed) and len(_grid(intended)) > 1


def deviation_of(a: Stroke, b: Stroke) -> float:
    """Greatest distance of a point of either path from the same stretch of the other, mm.

    It is never less than the Hausdorff distance of the two paths.
    """
    return max(_measure_distance(a.xy, b.xy), _measure_distance(b.xy, a.xy))


def _measure_distance(path: Array, other: Array) -> float:
    """Greatest distance of a point on one path from the other path at about the same share of its length."""
    points, at = _dense(path, 0.1)
    along = arc_length(other)
    if along[-1] == 0.0:
        return float(np.hypot(*(points - other[0]).T).max())
    guess = at * (along[-1] / at[-1] if at[-1] > 0 else 0.0)
    near = np.searchsorted(along, guess[:, None] + np.array([-_LOOK, _LOOK]))
    width = int(np.diff(near).max()) + 1
    index = np.clip(near[:, :1] - 1 + np.arange(width), 0, len(other) - 2)
    # x and y by themselves: an axis of two is slow
    (x, y), (way_x, way_y) = other[:-1].T, np.diff(other, axis=0).T
    square = np.maximum(way_x * way_x + way_y * way_y, 1e-12)
    off_x, off_y = points[:, :1] - x[index], points[:, 1:] - y[index]
    way_x, way_y = way_x[index], way_y[index]
    share = np.clip((off_x * way_x + off_y * way_y) / square[index], 0.0, 1.0)
    off_x -= share * way_x
    off_y -= share * way_y
    return float(np.sqrt((off_x * off_x + off_y * off_y).min(axis=1)).max())


def _dense(xy: Array, step: float = _PATH_STEP) -> tuple[Array, Array]:
    """Points every `step` mm along a path, corners included, and how far along they are."""
    arc = arc_length(xy)
    at = np.union1d(arc, np.arange(0.0, arc[-1], step))
    keep = np.append(True, np.diff(arc) > 0)
    return np.stack([np.interp(at, arc[keep], xy[keep, axis]) for axis in (0, 1)], axis=1), at


def _speed_at(t: Array, clock: Array, arc: Array) -> Array:
    """Mean speed along the path around times t, mm/s."""
    early, late = np.clip(t - _HALF, clock[0], clock[-1]), np.clip(t + _HALF, clock[0], clock[-1])
    way = np.interp(late, clock, arc) - np.interp(early, clock, arc)
    return np.asarray(way / np.maximum(late - early, 1e-9))


def _grid(stroke: Stroke) -> Array:
    return np.arange(stroke.t[0] + _HALF, stroke.t[-1] - _HALF / 2, _HALF)


def _speeds_in_place(a: Stroke, b: Stroke) -> tuple[Array, Array]:
    """Intended and executed speed where the pen was meant to be at equal steps of time."""
    t, arc_a, arc_b = _grid(a), arc_length(a.xy), arc_length(b.xy)
    xy = np.stack([np.interp(t, a.t, a.xy[:, axis]) for axis in (0, 1)], axis=1)
    along = _match(xy, np.interp(t, a.t, arc_a) * arc_b[-1] / arc_a[-1], b.xy)
    when = np.interp(along, arc_b, b.t)
    return _speed_at(t, a.t, arc_a), _speed_at(when, b.t, arc_b)


def _match(xy: Array, guess: Array, path: Array) -> Array:
    """How far along the path the places are, looked for around a guess, in order.

    Executed paths are a little shorter or longer than meant; that grows slowly along a stroke, so what is found for
    single places, to within a step of the motors, is averaged over their neighbours.
    """
    points, at = _dense(path)
    even = np.arange(0.0, at[-1] + _PATH_STEP, _PATH_STEP)
    points = np.stack([np.interp(even, at, points[:, axis]) for axis in (0, 1)], axis=1)
    reach = round(_LOOK / _PATH_STEP)
    index = np.clip(np.rint(guess / _PATH_STEP).astype(int)[:, None] + np.arange(-reach, reach + 1), 0, len(even) - 1)
    off = points[index] - xy[:, None]
    cost = (off * off).sum(axis=2) + 1e-3 * (even[index] - guess[:, None]) ** 2
    shift = even[index[np.arange(len(xy)), np.argmin(cost, axis=1)]] - guess
    window = np.ones(min(_NEIGHBOURS, len(shift)))
    mean = np.convolve(shift, window, "same") / np.convolve(np.ones(len(shift)), window, "same")
    return np.asarray(np.maximum.accumulate(np.clip(guess + mean, 0.0, at[-1])))


def _compare_speeds(moving: list[tuple[Stroke, Stroke]]) -> tuple[float, float]:
    """Correlation and rms, as a share of the peak, of the speeds at the same times, at the best lag of all."""
    wanted, executed = [], []  # at equal steps of time, (n,); at the same times and every lag, (n, lags)
    for a, b in moving:
        t = _grid(a)
        wanted.append(_speed_at(t, a.t, arc_length(a.xy)))
        executed.append(_speed_at((t - a.t[0] + b.t[0])[:, None] + _LAGS, b.t, arc_length(b.xy)))
    want, lagged = np.concatenate(wanted), np.concatenate(executed)
    best = int(np.argmin(((lagged - want[:, None]) ** 2).sum(axis=0)))
    return _correlation(want, lagged[:, best]), _rms(want, lagged[:, best])


def _rms(want: Array, have: Array) -> float:
    return float(np.sqrt(np.mean((want - have) ** 2)) / want.max())


def _correlation(a: Array, b: Array) -> float:
    if len(a) < 2 or np.ptp(a) < 1e-9 or np.ptp(b) < 1e-9:
        return 1.0
    return float(np.corrcoef(a, b)[0, 1])


REST = 0.02  # s; a shorter stop leaves no more ink than a sharp corner
_USUAL = 25.0  # percentile of the time lost between two answers that is put down to slow going
_UNUSUAL = 6.0  # times the usual loss make a rest
_FINE = 17  # samples of a move between which its place is interpolated
_NEAR = 0.03  # mm by which a reported place may be off: steps, and rounded digits
_GAIN = 0.005  # s that a machine may gain on its plan between two answers
# a loss of so much of a rest belongs to the rest so few answers before it: a machine has to start anew after one
_JOINED, _BESIDE = 0.25, 2
_MANY = 3  # answers within strokes: with fewer nothing can be said

Place = tuple[float, float]


class _Answer(NamedTuple):
    """What `Observer.note` was told."""

    since: float
    time: float
    executed: int
    sent: int
    place: Place | None = None


class Rest(NamedTuple):
    """A stop of the pen on the paper.

    stroke, word : their numbers, from 0 (word −1: unknown); text : of the word, "" if that is not known.
    at_s : s after the stroke's beginning in the plan.
    """

    stroke: int
    word: int
    text: str
    at_s: float
    seconds: float


@dataclass(frozen=True)
class Observation:
    """What was executed, according to the machine's answers.

    unknown : why nothing can be said; then the fields below are empty.
    rests : within strokes, in order.
    least_s : shorter rests may have been missed, or are not certain, s; every_s : median time between two answers in a
        stroke, s.
    correlation : of executed with planned speeds at the same times; None if no stroke is long enough;
        least_correlation : the same if as much time was lost as the answers allow.
    stretched : duration of the strokes over their planned duration.
    executed : the predicted strokes with the observed delays; None if nothing was observed.
    """

    unknown: str = ""
    rests: tuple[Rest, ...] = ()
    least_s: float = REST
    every_s: float = 0.0
    correlation: float | None = None
    least_correlation: float | None = None
    stretched: float = 1.0
    executed: Drawing | None = None

    @property
    def rested_s(self) -> float:
        """How long the pen stood within strokes, s."""
        return sum(rest.seconds for rest in self.rests)


class Observer:
    """Collects the answers of a machine during a plot; commands : the program of the plan."""

    def __init__(self, plan: Plan, commands: Sequence[Command]) -> None:
        self.plan = plan
        self._done = np.array([0, *(command.done for command in commands)])
        self._answers: list[_Answer] = []

    def note(
        self, time: float, executed: int, place: Place | None, since: float | None = None, sent: int | None = None
    ) -> None:
        """Add an answer.

        time, since : s, when it was heard, and when it had certainly not come in yet; None: it was heard at once.
        executed, sent : commands certainly executed by then, and all that can have been; None: no more than those.
        place : that is reported, machine coordinates, mm.
        """
        if executed > 0:
            answer = _Answer(time if since is None else since, time, executed, executed if sent is None else sent)
            self._answers.append(answer._replace(place=place))

    def observation(self, unknown: str = "") -> Observation:
        """Evaluate the answers at the end of a plot.

        unknown : why the answers say nothing, where the caller knows that.
        """
        if unknown:
            return Observation(unknown)
        plan, toolpath = self.plan, self.plan.toolpath
        if not (self._answers and toolpath.draws.any()):
            return Observation("The strokes are too short for the plotter's answers.")
        since, time = (np.array([getattr(answer, name) for answer in self._answers]) for name in ("since", "time"))
        stroke, low, high = self._match_answers()
        drawn = stroke >= 0
        if np.count_nonzero(drawn) < _MANY:
            return Observation("The strokes are too short for the plotter's answers.")
        delays, bounds = dict[int, tuple[Array, Array]](), dict[int, tuple[Array, Array]]()
        apart, lost, unsure = list[Array](), list[Array](), 0.0
        for number in np.unique(stroke[drawn]).tolist():
            within = np.flatnonzero(stroke == number)
            later = np.flatnonzero(stroke[within[-1] + 1 :] >= 0)
            # answers up to the next stroke bound the delay too
            at = np.arange(within[0], within[-1] + 1 + later[0] if len(later) else len(stroke))
            most = np.minimum.accumulate((time[at] - low[at])[::-1])[::-1][within - within[0]]
            drawn_rows = np.flatnonzero(toolpath.draws & (toolpath.stroke == number))
            end = float(plan.starts[drawn_rows[-1]] + plan.motion.duration[drawn_rows[-1]])
            # what may lie behind the stroke tells nothing of a loss within it
            least = np.where(high[within] <= end + 1e-9, since[within] - high[within], -np.inf)
            delay = _least_delay(least, most)
            where = np.maximum.accumulate(0.5 * (low + high)[within])
            delays[number], bounds[number] = (where, delay - delay[0]), (where, most - most[0])
            unsure = max(unsure, float(most[-1] - delay[-1]))
            apart.append(np.diff(time[within]))
            lost.append(np.diff(delay))
        usual = float(np.percentile(np.append(np.concatenate(lost), 0.0), _USUAL))
        shortest = max(REST, _UNUSUAL * usual, unsure)
        rests = [rest for number, delay in delays.items() for rest in self._rests(number, *delay, shortest)]
        every, intended, executed = np.concatenate(apart), self.plan.intended_drawing(), self._drawing(delays)
        correlation, other = (measure_timing(intended, one) for one in (executed, self._drawing(bounds)))
        return Observation(
            rests=tuple(rests),
            least_s=shortest,
            every_s=float(np.median(every)) if every.size else 0.0,
            correlation=correlation,
            least_correlation=None if correlation is None or other is None else min(correlation, other),
            stretched=measure_stretch(intended, executed),
            executed=executed,
        )

    def _rests(self, number: int, where: Array, delay: Array, least: float) -> list[Rest]:
        """The rests of a stroke: losses between successive answers, neighbouring ones joined."""
        lost = np.diff(delay)
        begin = float(self.plan.starts[self.plan.toolpath.first[number]])
        word = self.plan.drawing.strokes[number].word
        words = self.plan.drawing.about.get("words") or []
        text = str(words[word]) if 0 <= word < len(words) else ""
        rests: list[Rest] = []
        last = -_BESIDE - 1
        for at in np.flatnonzero(lost > _JOINED * least).tolist():
            if rests and at <= last + _BESIDE:
                more = float(delay[at + 1] - delay[last + 1])
                rests[-1] = rests[-1]._replace(seconds=rests[-1].seconds + more)
            else:
                rests.append(Rest(number, word, text, max(float(where[at + 1]) - begin, 0.0), float(lost[at])))
            last = at
        return [rest for rest in rests if rest.seconds > least]

    def _match_answers(self) -> tuple[NDArray[np.intp], Array, Array]:
        """For every answer the stroke being drawn, −1 for none, and the plan's times between which it was, s."""
        plan, toolpath = self.plan, self.plan.toolpath
        rows = np.array([row if block is None else -1 for block, row in toolpath.instructions])
        executed, sent = (np.array([getattr(one, name) for one in self._answers]) for name in ("executed", "sent"))
        block, ahead = self._done[executed], self._done[np.minimum(sent, len(self._done) - 1)]
        inside = block < len(rows)
        row = np.where(inside, rows[np.minimum(block, len(rows) - 1)], -1)
        stroke = np.where((row >= 0) & toolpath.draws[row], toolpath.stroke[row], -1)
        begins = np.append(plan.begins, plan.duration)
        low = np.where(row >= 0, plan.starts[row], begins[np.minimum(block, len(rows))])
        high = np.maximum(begins[np.minimum(ahead, len(rows))], low)
        length = np.hypot(*np.diff(toolpath.points[:, :2], axis=0).T)
        # mm: length of the path before each move and in all (n + 1,); from each move's start to its stroke's end (n,)
        behind = np.append(0.0, np.cumsum(length))
        last = np.append(np.flatnonzero(np.diff(toolpath.stroke) != 0), len(toolpath.kind) - 1)
        left = behind[last + 1][np.searchsorted(last, np.arange(len(toolpath.kind)))] - behind[:-1]
        delay, before = -np.inf, -1  # that it has at least, of the stroke of the answer before
        for at in np.flatnonzero(stroke >= 0).tolist():
            answer = self._answers[at]
            delay, before = delay if stroke[at] == before else -np.inf, int(stroke[at])
            if answer.place is not None:
                most = min(float(high[at]), answer.time - delay) + _GAIN
                (move, gone), *ends = self._passes(behind, int(row[at]), np.array(answer.place), most)
                low[at], high[at] = ends
                if toolpath.stroke[move] != before or not toolpath.draws[move] or left[move] - gone <= _NEAR:
                    # it may be past the stroke, or has stopped to lift the pen
                    stroke[at] = -1
            delay = max(delay, answer.since - float(high[at]))
        low = np.maximum.accumulate(low)
        return stroke, low, np.maximum(low, high)

    def _passes(self, behind: Array, row: int, place: Array, most: float) -> tuple[tuple[int, float], float, float]:
        """The plan's times, no later than `most`, between which the pen may be at a place.

        Lines cross and retrace themselves, and the lifted pen crosses them; and a place is known to some hundredths of
        a millimetre, which a slow pen takes long to cross.

        behind : (n + 1,) mm, length of the path before each move; row : the first that may have been under way.

        Returns the last move that passes the place in time and how far it has come then, mm; the times, s.
        """
        plan, toolpath = self.plan, self.plan.toolpath
        rows = np.arange(row, max(int(np.searchsorted(plan.starts[: len(toolpath.kind)], most)), row + 1))
        begin, end = toolpath.points[rows, :2], toolpath.points[rows + 1, :2]
        length = np.maximum(np.hypot(*(end - begin).T), 1e-9)
        gone = np.clip(((place - begin) * (end - begin)).sum(axis=1) / length, 0.0, length)
        off = np.hypot(*(begin + (gone / length)[:, None] * (end - begin) - place).T)
        near = [(int(rows[at]), float(gone[at])) for at in np.flatnonzero(off <= _NEAR)] or [(row, 0.0)]
        near = [at for at in near if float(plan.starts[at[0]]) + self._time_to_reach(*at) <= most] or near[:1]
        span = behind[row], behind[rows[-1] + 1]
        times = []
        for (move, come), way in ((near[0], -_NEAR), (near[-1], _NEAR)):
            along = float(np.clip(behind[move] + come + way, *span))
            move = int(np.clip(np.searchsorted(behind, along, side="right") - 1, row, rows[-1]))
            times.append(float(plan.starts[move]) + self._time_to_reach(move, along - float(behind[move])))
        return near[-1], times[0], times[1]

    def _time_to_reach(self, row: int, gone: float) -> float:
        """Time from the beginning of a move until it has gone so far, s."""
        t = np.linspace(0.0, float(self.plan.motion.duration[row]), _FINE)
        return float(np.interp(gone, self.plan.motion.distance_travelled(np.full(_FINE, row), t), t))

    def _drawing(self, delays: dict[int, tuple[Array, Array]]) -> Drawing:
        predicted = self.plan.predicted_drawing()
        strokes = list(predicted.strokes)
        for number, (where, delay) in delays.items():
            stroke = strokes[number]
            strokes[number] = replace(stroke, t=stroke.t + np.interp(stroke.t, where, delay))
        return replace(predicted, strokes=tuple(strokes))


def _least_delay(least: Array, most: Array) -> Array:
    """(n,) s, a delay that never shrinks, between bounds, and grows no more and no sooner than it must; but where it
    has grown by a rest, by as much as it may have, for answers are seldom late."""
    delay, beside = most.copy(), 0
    for at in range(1, len(most)):
        must = min(max(delay[at - 1], least[at]), most[at])
        grown = must - delay[at - 1]
        beside = _BESIDE if grown > (_JOINED * REST if beside > 0 else REST) else beside - 1
        delay[at] = most[at] if grown > 0.0 and beside > 0 else must
    return delay
