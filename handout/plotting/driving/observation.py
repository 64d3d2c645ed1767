"""Works out from a machine's answers what it did with a plan: when it was where, and where the pen rested.

Each answer says that at a time t (this computer's clock) the machine had carried out the plan up to the plan's time p.
An answer is never heard before it is true, so p was reached at t or earlier.  A machine is never faster than its plan,
so it takes at least p' − p from p to a later p'.  Its delay at p is therefore at most the least t' − p' of this answer
and all later ones, which makes late answers harmless.  Where the delay grows within a stroke, time was lost: a rest if
it grows much at once, slow going if it grows a little everywhere.

Not seen are rests shorter than `Observation.least_s`, and those before the first or after the last answer of a stroke;
two rests between the same two answers count as one.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handout.plotting.dialect import Command
from handout.plotting.driving import fidelity
from handout.plotting.planning.plan import Plan
from handout.plotting.planning.toolpath import Toolpath
from handout.values import Array, Drawing

REST = 0.02  # s; a shorter stop leaves no more ink than a sharp corner
_USUAL = 25.0  # percentile of the time lost between two answers that is put down to slow going
_UNUSUAL = 6.0  # times the usual loss make a rest
_FINE = 17  # samples of a move between which its place is interpolated
_NEAR = 0.03  # mm by which a reported place may be off: steps, and rounded digits
_GAIN = 0.005  # s that a machine may gain on its plan between two answers
_MANY = 3  # answers within strokes: with fewer nothing can be said

Place = tuple[float, float]


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
    least_s : shorter rests may have been missed, s; every_s : median time between two answers in a stroke, s.
    correlation : of executed with planned speeds at the same times; None if no stroke is long enough.
    stretched : duration of the strokes over their planned duration.
    executed : the predicted strokes with the observed delays; None if nothing was observed.
    """

    unknown: str = ""
    rests: tuple[Rest, ...] = ()
    least_s: float = REST
    every_s: float = 0.0
    correlation: float | None = None
    stretched: float = 1.0
    executed: Drawing | None = None

    @property
    def rested_s(self) -> float:
        """How long the pen stood within strokes, s."""
        return sum(rest.seconds for rest in self.rests)


class Observer:
    """Collects the answers of a machine during a plot.

    Parameters
    ----------
    commands : the program of the plan.
    """

    def __init__(self, plan: Plan, commands: Sequence[Command]) -> None:
        self.plan = plan
        self._done = np.array([0, *(command.done for command in commands)])
        self._times: list[float] = []
        self._executed: list[int] = []
        self._places: list[Place] = []

    def note(self, time: float, executed: int, place: Place | None) -> None:
        """Add an answer: its time, s, the number of commands certainly executed by then, and the reported place, mm."""
        if executed > 0:
            self._times.append(time)
            self._executed.append(executed)
            self._places.append(place or (np.nan, np.nan))

    def observation(self, unknown: str = "") -> Observation:
        """Evaluate the answers at the end of a plot.

        unknown : why the answers say nothing, where the caller knows that.
        """
        if unknown:
            return Observation(unknown)
        time = np.array(self._times)
        if not (len(time) and self.plan.toolpath.draws.any()):
            return Observation("The strokes are too short for the plotter's answers.")
        stroke, reached = self._reached()
        drawn = stroke >= 0
        if np.count_nonzero(drawn) < _MANY:
            return Observation("The strokes are too short for the plotter's answers.")
        delays, apart, lost = dict[int, tuple[Array, Array]](), list[Array](), list[Array]()
        for number in np.unique(stroke[drawn]).tolist():
            within = np.flatnonzero(stroke == number)
            at = np.arange(within[0], _next(stroke, within[-1]))  # answers up to the next stroke bound the delay too
            delay = np.minimum.accumulate((time[at] - reached[at])[::-1])[::-1][within - within[0]]
            delays[number] = reached[within], delay - delay[0]
            apart.append(np.diff(time[within]))
            lost.append(np.diff(delay))
        usual = float(np.percentile(np.append(np.concatenate(lost), 0.0), _USUAL))
        least = max(REST, _UNUSUAL * usual)
        rests = [rest for number, delay in delays.items() for rest in self._rests(number, *delay, least)]
        every, intended, executed = np.concatenate(apart), self.plan.intended(), self._drawing(delays)
        return Observation(
            rests=tuple(rests),
            least_s=least,
            every_s=float(np.median(every)) if every.size else 0.0,
            correlation=fidelity.timed(intended, executed),
            stretched=fidelity.stretched(intended, executed),
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
        last = -2
        for at in np.flatnonzero(lost > 0.5 * least).tolist():
            if rests and at == last + 1:
                rests[-1] = rests[-1]._replace(seconds=rests[-1].seconds + float(lost[at]))
            else:
                rests.append(Rest(number, word, text, max(float(where[at + 1]) - begin, 0.0), float(lost[at])))
            last = at
        return [rest for rest in rests if rest.seconds > least]

    def _reached(self) -> tuple[NDArray[np.intp], Array]:
        """For every answer the stroke being drawn, −1 for none, and the time of the plan that had been reached, s."""
        plan, toolpath = self.plan, self.plan.toolpath
        rows = np.array([row if block is None else -1 for block, row in toolpath.instructions])
        block = self._done[np.array(self._executed, dtype=np.intp)]
        inside = block < len(rows)
        block = np.minimum(block, len(rows) - 1)
        row = np.where(inside, rows[block], -1)
        stroke = np.where((row >= 0) & toolpath.draws[row], toolpath.stroke[row], -1)
        reached = np.where(inside, plan.begins[block], plan.duration)
        reached[row >= 0] = plan.starts[row[row >= 0]]
        behind, ahead = _along(toolpath)
        for at in np.flatnonzero(stroke >= 0).tolist():
            if not np.isnan(self._places[at][0]):
                same = at > 0 and stroke[at - 1] == stroke[at]
                planned = self._times[at] - (self._times[at - 1] - reached[at - 1]) if same else -np.inf
                move, gone, reached[at] = self._furthest(int(row[at]), np.array(self._places[at]), planned + _GAIN)
                if ahead[move] - gone <= _NEAR:  # it has stopped to lift the pen
                    stroke[at] = -1
                elif same:
                    reached[at] = self._soonest(behind, move, gone, planned)
        return stroke, np.maximum.accumulate(reached)

    def _soonest(self, behind: Array, row: int, gone: float, planned: float) -> float:
        """Of the plan's times at which the pen is near a place, the one nearest to `planned`, s.

        A place is known to some hundredths of a millimetre, which a slow pen takes long to cross.

        behind : (n + 1,) mm, length of the path before each move; row, gone : the place.
        """
        toolpath = self.plan.toolpath
        same = np.flatnonzero(toolpath.stroke == toolpath.stroke[row])
        first, last = behind[same[0]], behind[same[-1] + 1]
        near = np.clip(behind[row] + gone + np.array([-_NEAR, _NEAR]), first, last)
        rows = np.clip(np.searchsorted(behind, near, side="right") - 1, same[0], same[-1])
        low, high = (
            float(self.plan.starts[at]) + self._since(int(at), float(come - behind[at]))
            for at, come in zip(rows, near, strict=True)
        )
        return min(max(planned, low), high)

    def _furthest(self, row: int, place: Array, most: float) -> tuple[int, float, float]:
        """The latest of the plan's times, no later than `most`, at which the pen is at a place.

        Lines cross and retrace themselves; since a machine is never faster than its plan, the last move that passes
        the place in time is the right one.

        row : the first move that may have been under way.

        Returns
        -------
        tuple
            The move, how far it has come, mm, and the time, s.
        """
        plan, toolpath = self.plan, self.plan.toolpath
        many = int(np.argmax(np.append(toolpath.stroke[row:] != toolpath.stroke[row], True)))
        rows = np.arange(row, row + max(int(np.searchsorted(plan.starts[row : row + many], most)), 1))
        begin, end = toolpath.points[rows, :2], toolpath.points[rows + 1, :2]
        length = np.maximum(np.hypot(*(end - begin).T), 1e-9)
        gone = np.clip(((place - begin) * (end - begin)).sum(axis=1) / length, 0.0, length)
        off = np.hypot(*(begin + (gone / length)[:, None] * (end - begin) - place).T)
        latest = (row, 0.0, float(plan.starts[row]))
        for at in [0, *np.flatnonzero(off <= _NEAR).tolist()]:
            move, come = int(rows[at]), float(gone[at])
            time = float(plan.starts[move]) + self._since(move, come)
            if time <= most or at == 0:
                latest = move, come, time
        return latest

    def _since(self, row: int, gone: float) -> float:
        """Time from the beginning of a move until it has gone so far, s."""
        t = np.linspace(0.0, float(self.plan.motion.duration[row]), _FINE)
        return float(np.interp(gone, self.plan.motion.travelled(np.full(_FINE, row), t), t))

    def _drawing(self, delays: dict[int, tuple[Array, Array]]) -> Drawing:
        predicted = self.plan.predicted()
        strokes = list(predicted.strokes)
        for number, (where, delay) in delays.items():
            stroke = strokes[number]
            strokes[number] = replace(stroke, t=stroke.t + np.interp(stroke.t, where, delay))
        return replace(predicted, strokes=tuple(strokes))


def _along(toolpath: Toolpath) -> tuple[Array, Array]:
    """mm: length of the path before each move and in all (n + 1,); from each move's start to its stroke's end (n,)."""
    length = np.hypot(*np.diff(toolpath.points[:, :2], axis=0).T)
    behind = np.append(0.0, np.cumsum(length))
    last = np.append(np.flatnonzero(np.diff(toolpath.stroke) != 0), len(toolpath.kind) - 1)
    return behind, np.asarray(behind[last + 1][np.searchsorted(last, np.arange(len(toolpath.kind)))] - behind[:-1])


def _next(stroke: NDArray[np.intp], last: int) -> int:
    """Index of the first answer of the next stroke."""
    later = np.flatnonzero(stroke[last + 1 :] >= 0)
    return last + 1 + int(later[0]) if len(later) else len(stroke)
