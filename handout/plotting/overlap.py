"""How much ink may be on its way: no more than may be drawn twice, and never at the price of a rest on the paper.

When the power goes, commands that were sent may have been executed; which of them were is known as far as the disk has
kept it.  So ink that is sent and not secured is ink that may be drawn twice, and `overlap` bounds it.  Two are waited
for: the machine, which has to execute, and the disk, which has to keep.

The machine may be waited for anywhere, it draws meanwhile.  The disk is waited for before a stroke begins, with the pen
lifted; within a stroke only as long as the machine has enough in hand.  Where a slow disk would let it run dry the pen
goes on: then more than the overlap may be drawn twice, and that is told.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from concurrent.futures import Future

import numpy as np

from handout.plotting.dialects import Command, PenBlock, dialect
from handout.plotting.planning.lookahead import Flags
from handout.plotting.planning.plan import Plan
from handout.profiles import Plotter
from handout.values import Array

Secure = Callable[[], "Future[None]"]
OVERLAP = 20.0  # mm of ink that may be under way if nothing else is asked for: a letter or two
_AHEAD = 0.25  # s at full speed; with less on its way a machine that draws as fast as it can would brake in mid-line
_WORTH = 0.25  # share of the overlap that is secured at a time
_EARLY = 0.5  # share of the overlap that may be on its way before the disk is asked
_RESERVE = 0.12  # s of motion that a machine keeps in hand, or half of it all; what is heard of it is 0.06 s old
_BRIEF = 0.02  # s that a pen may stand: it leaves no more ink than in a sharp corner


def usual_overlap(profile: Plotter, fast: bool) -> float:
    """mm of ink that may be under way where nothing else is asked for; more for what is drawn as fast as can be."""
    return max(OVERLAP, _AHEAD * profile.limits.draw_speed) if fast else OVERLAP


class OverlapGuard:
    """What of a program has been secured, and whether its next command may be sent.

    secure : begins to secure what is known to be executed; done when that is so, or with the error of the disk.  None:
        what is executed is secured.
    overlap : mm of ink that may be sent and not secured; what the machine draws in the `in_hand` of its dialect may be
        more.
    clock : the time by which the machine lives, s; None: that stands still while the disk is waited for, so that it may
        be waited for anywhere.
    log : told once if the overlap cannot be kept.

    most : mm of ink at most that were sent and not secured.
    """

    def __init__(
        self,
        plan: Plan,
        commands: Sequence[Command],
        secure: Secure | None,
        overlap: float,
        clock: Callable[[], float] | None,
        log: Callable[[str], None],
    ) -> None:
        self.overlap, self.most, self._time, self._log = overlap, 0.0, clock, log
        self._secure = secure or _at_once
        done = np.array([0, *(command.done for command in commands)])
        drawn = np.append(0.0, np.cumsum(ink(plan)))
        self._ink = drawn[done]  # mm, of so many commands
        self._clock = np.append(plan.begins, plan.duration)[done]  # s, by the plan, when so many have been executed
        self._lowers = _lowering(plan, done)
        ends = np.append(np.flatnonzero(self._lowers), len(commands))
        self._stroke = self._ink[ends[np.searchsorted(ends, np.arange(len(commands)), side="right")]]  # mm, at its end
        self._longest = float(np.diff(self._ink[ends]).max(initial=0.0))
        self._least = dialect(plan.profile.dialect).in_hand
        self._secured, self._took = 0, 0.0  # commands; s that the disk needed the last time
        self._pending: tuple[int, Future[None], float] | None = None  # for so many commands, since when
        self._outruns = self._told = False

    def ready(self, number: int, executed: int) -> bool:
        """Whether command `number` may be sent when `executed` have been executed; if not, hear the machine first."""
        while not self._may_go(number, executed):
            if self._pending is None and self._is_worth_it(number, executed):
                self._ask(executed)
            if self._pending is None or not (self._time is None or executed >= number):
                return False
            self._wait()
        self.most = max(self.most, self._way(number))
        return True

    def finish(self, executed: int) -> None:
        """Wait until everything that was executed is secured."""
        while self._secured < executed:
            if self._pending is None:
                self._ask(executed)
            self._wait()

    def draws(self, number: int) -> bool:
        """Whether command `number` draws."""
        return bool(self._ink[number + 1] > self._ink[number])

    def _may_go(self, number: int, executed: int) -> bool:
        if self._pending is not None and self._pending[1].done():
            self._wait()
        early = self._time is not None and self._way(number) > _EARLY * self.overlap
        if early and self._pending is None and self._is_worth_it(number, executed):
            self._ask(executed)
        if self._secured >= number:
            self._outruns &= not self._lowers[number]
            return True
        if self._lowers[number]:
            self._outruns = False
            # if the stroke may have to outrun a slow disk, only once all before it is secured
            whole = self._way(number) + float(self._stroke[number] - self._ink[number + 1])
            return self._fits(number) and (whole <= self.overlap or not self._is_slow())
        return self._fits(number) or not self.draws(number) or self._may_exceed(number, executed)

    def _fits(self, number: int) -> bool:
        """Whether no more is on its way once command `number` is sent than may be, or than the machine needs."""
        if self._way(number) <= self.overlap:
            return True
        return float(self._clock[number + 1] - self._clock[self._secured]) <= self._least

    def _may_exceed(self, number: int, executed: int) -> bool:
        """Whether a stroke may go on beyond the overlap: where the machine would run dry before the disk is done."""
        in_hand = float(self._ink[number + 1] - self._ink[executed])  # mm, once the command is sent
        if self._time is None or (in_hand > self.overlap and executed < number):
            return False
        if self._pending is None and not self._is_worth_it(number, executed):
            return False  # the machine's turn
        has = float(self._clock[number] - self._clock[executed])
        spare = max(has - _RESERVE, 0.5 * has, _BRIEF)
        if not self._outruns and not self._is_slow() and self._is_kept_within(spare, executed):
            return self._may_go(number, executed)
        self._outruns = True  # for the rest of the stroke the disk is not waited for
        if not self._told:
            self._told = True
            self._log(
                f"The disk is too slow for an overlap of {self.overlap:g} mm, and the pen does not wait for it within "
                f"a stroke: after a power cut up to {max(self._longest, self.overlap):.0f} mm may be drawn twice."
            )
        return True

    def _is_kept_within(self, seconds: float, executed: int) -> bool:
        """Wait for the disk, but no longer than the machine has enough in hand."""
        if self._pending is None:
            self._ask(executed)
        assert self._pending is not None
        with contextlib.suppress(TimeoutError):
            self._pending[1].exception(seconds)
        done = self._pending[1].done()
        if done:
            self._wait()
        return done

    def _way(self, number: int) -> float:
        """Ink that is not secured once command `number` is sent, mm."""
        return float(self._ink[number + 1] - self._ink[self._secured])

    def _is_worth_it(self, number: int, executed: int) -> bool:
        """Whether enough has been executed since the last time, or all that was sent."""
        gained = float(self._ink[executed] - self._ink[self._secured])
        return executed > self._secured and (executed >= number or gained >= _WORTH * self.overlap)

    def _ask(self, executed: int) -> None:
        since, done = self._now(), self._secure()
        self._pending = executed, done, since

        def note_time(_: Future[None]) -> None:  # it may be looked at much later
            self._took = self._now() - since

        done.add_done_callback(note_time)

    def _wait(self) -> None:
        assert self._pending is not None
        executed, done, _ = self._pending
        done.result()
        self._secured, self._pending = executed, None

    def _is_slow(self) -> bool:
        """Whether the disk takes longer than a machine can go on with what it has in hand."""
        waiting = 0.0 if self._pending is None else self._now() - self._pending[2]
        return max(self._took, waiting) > _RESERVE

    def _now(self) -> float:
        return 0.0 if self._time is None else self._time()


def ink(plan: Plan) -> Array:
    """(blocks,) float, mm: what each block of a plan draws."""
    length = np.linalg.norm(np.diff(plan.toolpath.points, axis=0), axis=1) * plan.toolpath.draws
    return np.array([length[row] if block is None else 0.0 for block, row in plan.toolpath.instructions])


def _lowering(plan: Plan, done: Array) -> Flags:
    """(commands,) bool: the first command of each that lowers the pen.

    done : (commands + 1,) int: blocks that are done when so many commands have been executed.
    """
    pens = [block.down if isinstance(block, PenBlock) else None for block in plan.blocks]
    down, lowering = False, []
    for block, change in enumerate(pens):
        if change and not down:
            lowering.append(block)
        down = down if change is None else change
    # a block that takes several commands is done with the last of them
    first = np.searchsorted(done, np.array(lowering, dtype=int), side="right") - 1
    first = np.searchsorted(done, done[first], side="left")
    first_commands = np.zeros(len(done) - 1, dtype=bool)
    first_commands[first] = True
    return first_commands


def _at_once() -> Future[None]:
    """Nothing has to be kept."""
    done: Future[None] = Future()
    done.set_result(None)
    return done
