"""What a machine did with a plan, as far as it says: when it was where, and where the pen rested on the paper.

All that is known of a real machine are its answers: at a time t, by the clock of this computer, it had carried out the
plan up to the plan's own time p.  Two things are certain.  An answer is never heard before it is true: p was reached at
t or earlier.  And a machine is not faster than its plan: from p to a later p' it needs p' − p or more.  So its delay at
p is at most the least of t' − p' over this answer and all later ones; answers that are heard late do not count.  Where
the delay grows within a stroke, time was lost there: much of it at once is a rest, a little everywhere is slow going.

What cannot be seen: a rest shorter than `Observed.least_s`; one before the first or behind the last answer within a
stroke; and two rests between the same two answers are one.

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

REST = 0.02  # s; a pen that stands for less leaves no more ink than in a sharp corner
_USUAL = 25.0  # percentile of the time that is lost between two answers: so much is lost by slow going
_UNUSUAL = 6.0  # times as much as usual is a rest
_FINE = 17  # times within a move at which its place is known
_NEAR = 0.03  # mm by which a place may be off: steps, and digits of what is told
_GAIN = 0.005  # s by which a machine may be ahead of its plan between two answers
_MANY = 3  # answers within strokes without which nothing can be said

Place = tuple[float, float]


class Rest(NamedTuple):
    """The pen stood on the paper.

    stroke, word : their numbers, from 0 (word −1: unknown); text : of the word, "" if that is not known.
    at_s : where, s after the stroke's beginning in the plan.
    """

    stroke: int
    word: int
    text: str
    at_s: float
    seconds: float


@dataclass(frozen=True)
class Observation:
    """What was executed, from the machine's own answers.

    unknown : why that cannot be told; "" if it can: else the fields below are empty.
    rests : within strokes, in order.
    least_s : rests that are shorter may not have been noticed, s; every_s : between two answers within a stroke, s.
    correlation : of the speeds with those that were meant, at the same times; None if no stroke moves for long enough.
    stretched : time the strokes took over the time they were meant to take.
    executed : the strokes as the plan predicts them, with the delays that were observed; None if nothing was.
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
    """Collects what is heard of a plot.

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
        """At a time, s, so many commands have certainly been executed; the machine said that it is at a place, mm."""
        if executed > 0:
            self._times.append(time)
            self._executed.append(executed)
            self._places.append(place or (np.nan, np.nan))

    def observation(self, unknown: str = "") -> Observation:
        """What can be said at the end.

        unknown : why the machine's answers say nothing.
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
            at = np.arange(within[0], _next(stroke, within[-1]))  # what follows, until the next stroke, bounds it too
            delay = np.minimum.accumulate((time[at] - reached[at])[::-1])[::-1][within - within[0]]
            delays[number] = reached[within], delay - delay[0]
            apart.append(np.diff(time[within]))
            lost.append(np.diff(delay))
        usual = float(np.percentile(np.append(np.concatenate(lost), 0.0), _USUAL))
        least = max(REST, _UNUSUAL * usual)
        rests = [rest for number, delay in delays.items() for rest in self._rests(number, *delay, least)]
        every, intended, executed = np.concatenate(apart), self.plan.intended(), self._drawing(delays)
        comparable = any(map(fidelity.comparable, intended.strokes, executed.strokes))
        return Observation(
            rests=tuple(rests),
            least_s=least,
            every_s=float(np.median(every)) if every.size else 0.0,
            correlation=fidelity.compare(intended, executed).timed if comparable else None,
            stretched=fidelity.stretched(intended, executed),
            executed=executed,
        )

    def _rests(self, number: int, where: Array, delay: Array, least: float) -> list[Rest]:
        """Times lost between two answers of a stroke; neighbouring ones are the same rest."""
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
        """Of every answer: the stroke that was being drawn, −1 for none; and the plan's time that was reached, s."""
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
                if ahead[move] - gone <= _NEAR:  # it stands there to lift the pen
                    stroke[at] = -1
                elif same:
                    reached[at] = self._soonest(behind, move, gone, planned)
        return stroke, np.maximum.accumulate(reached)

    def _soonest(self, behind: Array, row: int, gone: float, planned: float) -> float:
        """The one of the plan's times that is nearest to `planned`, of those at which the pen is near a place, s.

        Where the pen is slow, a hundredth of a millimetre is a long time, and no answer is finer than that.

        behind : (n + 1,) mm: how long the way is up to the beginning of each move; row, gone : the place.
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

        row : the move that is the first to come by there.  Lines cross and retrace themselves, and a machine is not
        faster than its plan: so the last move that comes by in time is the one.

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
        """How long a move has been under way when it has come so far, s."""
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
    """(n + 1,) mm: the way up to the beginning of each move, and all of it; (n,) mm: from there to the stroke's end."""
    length = np.hypot(*np.diff(toolpath.points[:, :2], axis=0).T)
    behind = np.append(0.0, np.cumsum(length))
    last = np.append(np.flatnonzero(np.diff(toolpath.stroke) != 0), len(toolpath.kind) - 1)
    return behind, np.asarray(behind[last + 1][np.searchsorted(last, np.arange(len(toolpath.kind)))] - behind[:-1])


def _next(stroke: NDArray[np.intp], last: int) -> int:
    """Where the next stroke after an answer has its first."""
    later = np.flatnonzero(stroke[last + 1 :] >= 0)
    return last + 1 + int(later[0]) if len(later) else len(stroke)
