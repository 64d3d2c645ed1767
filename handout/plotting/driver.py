"""From a plan to a machine: stream it, tell how far it is, and whatever happens leave the pen lifted."""

from __future__ import annotations

import contextlib
import gc
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import msgspec
import numpy as np

from handout import signals
from handout.errors import DeviceError, DeviceGarbled
from handout.plotting import bed
from handout.plotting.dialects import Controller, StateReport, dialect
from handout.plotting.observation import Observation, Observer, measure_stretch
from handout.plotting.overlap import OVERLAP, OverlapGuard, Secure
from handout.plotting.planning import hooking
from handout.plotting.planning.plan import Plan
from handout.plotting.planning.planner import plan as replan
from handout.plotting.planning.toolpath import DRAW
from handout.plotting.ports import InstrumentedPort, Port, clock_of
from handout.profiles import Plotter
from handout.values import Array

Progress = Callable[[float, float], None]
Watch = Callable[[int, int, int, int], None]
_OFTEN = 0.2  # s of plotting between two calls of `progress`; a terminal is redrawn four times a second


@dataclass(frozen=True)
class PlotReport:
    """How a plot went.

    executed_s : s, of the machine's clock if it is simulated, else measured here.
    announced_s : s, as the plan said.
    stretched : time the strokes took over the time they were meant to take; as the machine's answers tell, or else as
        the plan predicts.
    lines : commands of the program, all executed.
    segments : straight pieces that were drawn.
    min_queue : the fewest moves the machine had in hand in the middle of a stroke; None: no stroke was long enough to
        fill its queue, or it does not say.
    unsecured : mm of ink at most that were sent and not certain on the disk: what a power cut may have drawn twice.
    observation : what was executed, as far as the machine's answers tell.
    dips, hooked_s : how often the pen was dipped, and what of the announced time hooks take, s.
    plan : what was plotted: the plan that was given, or the one made anew for the machine's own limits; None where
        reports are kept for long.
    """

    executed_s: float
    announced_s: float
    stretched: float
    lines: int
    segments: int
    min_queue: int | None
    unsecured: float
    observation: Observation
    plan: Plan | None
    dips: int = 0
    hooked_s: float = 0.0


@dataclass(frozen=True)
class Monitor:
    """Who follows a plot, and how much of it may be under way.

    progress : called with the share that is done, 0 to 1, and the time that is left, s.
    watch : called whenever a count changes, with how many commands have been sent, taken and certainly executed, and
        how many blocks of the plan have certainly been done.
    proved : called before `watch` whenever more is known to be right, with how many blocks that are.
    secure : begins to make sure that what `watch` was told last outlives a power cut, and says when that is done; only
        what is secured counts as executed.  It is waited for with the pen lifted.
    overlap : mm of ink that may be sent without being certainly executed, so that a plot that breaks off can be gone on
        with by drawing no more than that twice; more where `secure` takes too long, which is told.
    log : told in plain words what the user should know, such as limits of the machine that differ from the profile's.
    """

    progress: Progress | None = None
    watch: Watch | None = None
    proved: Callable[[int], None] | None = None
    secure: Secure | None = None
    overlap: float = OVERLAP
    log: Callable[[str], None] = lambda _: None


def run(
    plan: Plan,
    port: Port,
    profile: Plotter,
    *,
    progress: Progress | None = None,
    watch: Watch | None = None,
    secure: Secure | None = None,
    overlap: float = OVERLAP,
    log: Callable[[str], None] = lambda _: None,
) -> PlotReport:
    """Plot a plan from the machine's zero, on a fresh sheet; see `draw`, and `Monitor` for the other parameters."""
    controller = connect(port, profile, log)
    bed.check(plan.toolpath.points[:, :2], controller.profile)
    with halting(controller):
        if profile.homing:
            controller.home()
        elif profile.bed.zero == "here":
            controller.zero()
    try:
        monitor = Monitor(progress=progress, watch=watch, secure=secure, overlap=overlap, log=log)
        return draw(plan, controller, port, profile, monitor)
    except KeyboardInterrupt:
        park(controller)
        raise


def park(controller: Controller) -> None:
    """Go back to zero after a stop that was asked for, if the machine knows the way; a further interrupt ends that."""
    with contextlib.suppress(DeviceError, KeyboardInterrupt):
        if controller.position() is not None:
            with halting(controller):
                controller.go(0.0, 0.0)


@contextlib.contextmanager
def halting(controller: Controller, harmless: tuple[type[Exception], ...] = ()) -> Iterator[None]:
    """Whatever breaks off what is done meanwhile, the machine is stopped and its pen lifted; no signal cuts that short.

    harmless : errors that are raised before anything moves.
    """
    with signals.defer_signals():
        try:
            with signals.heed_signals():
                yield
        except harmless:
            raise
        except BaseException:  # an interrupt above all, but whatever it is: the pen must not stay on the paper
            controller.halt()
            raise


def connect(port: Port, profile: Plotter, log: Callable[[str], None]) -> Controller:
    """Connect to a machine; it does not move."""
    return dialect(profile.dialect).connect(port, profile, log)


def draw(
    plan: Plan,
    controller: Controller,
    port: Port,
    profile: Plotter,
    monitor: Monitor | None = None,
    *,
    fresh: bool = True,
) -> PlotReport:
    """Plot a plan with a machine that is connected and stands at its zero.

    fresh : whether the sheet is new; a simulated plotter asks.

    Raises DoesNotFit: the machine's own settings leave less room than the drawing needs. DeviceSilent, DeviceAlarm,
    PortError: the pen has been lifted then if the machine still answered. KeyboardInterrupt: as it came; the machine
    has been stopped and its pen lifted.  It is still where it was stopped: see `park`.
    """
    monitor = monitor or Monitor()
    hooking.check(controller.profile)
    bed.check(plan.toolpath.points[:, :2], controller.profile)
    plan = _for_its_limits(plan, msgspec.structs.replace(controller.profile, bed=profile.bed), monitor)
    instrumented = port if isinstance(port, InstrumentedPort) else None
    if fresh:
        if plan.placement.turned:
            why = "to fit the bed" if controller.profile.laid.quarters is None else "as it was laid"
            monitor.log(f"The page is turned {why}: its top edge lies {plan.placement.turned}.")
        if (warning := bed.beyond_paper(plan.drawing)) is not None:
            monitor.log(warning)
        for sentence in hooking.tell_hooks([plan.drawing], plan.profile):
            monitor.log(sentence)
        if instrumented is not None:
            instrumented.lay(plan.drawing.page, plan.placement)
    stream = _CommandStream(plan, controller, monitor, port, instrumented)
    before = time.monotonic() if instrumented is None else instrumented.executed_s
    try:
        with halting(controller), _few_garbage():
            stream.send_all()
    except BaseException as error:
        stream.note()  # what had come to rest by then; or less than before, where it says that something was damaged
        if not isinstance(error, DeviceError):
            raise
        kind = DeviceGarbled if controller.spoilt else type(error)
        raise kind(f"{error} {stream.under_way()}".strip()) from error
    return _report(stream, instrumented, before, fresh)


def _for_its_limits(plan: Plan, profile: Plotter, monitor: Monitor) -> Plan:
    """The plan, made anew if the machine's own limits differ from those it was made for."""
    planned = plan.profile
    same = (profile.limits, profile.pen, profile.port.queue) == (planned.limits, planned.pen, planned.port.queue)
    if same or not plan.toolpath.draws.any():
        return plan
    monitor.log("The plot is planned anew for the plotter's own limits.")
    return replan(plan.drawing, profile, speed=plan.speed, order=plan.order, whole=plan.whole)


@contextlib.contextmanager
def _few_garbage() -> Iterator[None]:
    """Leave what there is out of the search for garbage, which would take a tenth of a second within a stroke."""
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


class _CommandStream:
    """A program under way."""

    def __init__(
        self, plan: Plan, controller: Controller, monitor: Monitor, port: Port, instrumented: InstrumentedPort | None
    ) -> None:
        self.plan, self.controller, self.monitor = plan, controller, monitor
        self.commands = list(dialect(plan.profile.dialect).program(plan.blocks, controller.profile))
        self._clock = clock_of(port)
        stands = instrumented is not None and not instrumented.keeps_real_time
        self.guard = OverlapGuard(
            plan, self.commands, monitor.secure, monitor.overlap, None if stands else self._clock, monitor.log
        )
        self.min_queue: int | None = None
        self.observer = Observer(plan, self.commands)
        self._before = controller.sent  # commands of the programs before this one
        self._counts = (0, 0, 0)
        controller.listener = self._listen
        self._proven = 0
        self._told = 0.0
        self._strokes = _strokes(plan)[np.array([command.done for command in self.commands])]

    def send_all(self) -> None:
        """Send all commands, and wait until the last has been executed."""
        for number, command in enumerate(self.commands):
            while not self.guard.ready(number, max(self._counts[2], 0)):
                self.controller.wait()
                self.note()
            self.controller.send(command.data)
            self.note()
        self.controller.finish()
        self.note()
        self.guard.finish(self._counts[2])
        if self.monitor.progress is not None:
            self.monitor.progress(1.0, 0.0)

    def under_way(self) -> str:
        """A sentence that names the stroke that was being drawn, or was drawn last; empty before the first."""
        executed = max(self.controller.executed - self._before, 0)
        begun = self._strokes[: executed + 2]
        strokes = len(self.plan.drawing.strokes)
        return f"It happened at stroke {int(begun.max()) + 1} of {strokes}." if begun.max(initial=-1) >= 0 else ""

    def note(self) -> None:
        """Tell everyone who wants to know what has changed."""
        machine, first = self.controller, self._before
        before, self._counts = self._counts, (machine.sent - first, machine.taken - first, machine.executed - first)
        if (proven := machine.proven - first) > self._proven:  # no command up to there came over wrong
            self._proven = proven
            if self.monitor.proved is not None:
                self.monitor.proved(self.commands[proven - 1].done)
        if self._counts == before:
            return
        executed = max(self._counts[2], 0)
        done = self.commands[executed - 1].done if executed else 0
        if self.monitor.watch is not None:
            self.monitor.watch(*self._counts, done)
        at, whole = float(self.plan.begins[min(done, len(self.plan.begins) - 1)]), max(self.plan.duration, 1e-9)
        if self.monitor.progress is not None and at - self._told >= _OFTEN:
            self._told = at
            self.monitor.progress(at / whole, whole - at)

    def _listen(self, report: StateReport) -> None:
        """Note its answers as they come: they would be old by the time that the next command is sent."""
        machine, first = self.controller, self._before
        self.observer.note(
            self._clock(), report.executed - first, report.place, machine.earliest_arrival, machine.sent - first
        )
        taken, queued = report.taken - first, report.queued
        filled = taken - self.plan.profile.port.queue
        if queued is None or filled < 1 or taken >= len(self.commands) or not self.guard.draws(taken):
            return
        # in the middle of a stroke, when the queue has had time to fill, the machine must not run out of moves
        if self._strokes[filled] >= 0 and self._strokes[taken] == self._strokes[filled]:
            self.min_queue = queued if self.min_queue is None else min(self.min_queue, queued)


def _strokes(plan: Plan) -> Array:
    """(blocks + 1,) the stroke that is being drawn when so many blocks are done, −1 for none."""
    drawn = np.where(plan.toolpath.draws, plan.toolpath.stroke, -1).tolist()
    return np.array([-1, *(drawn[row] if block is None else -1 for block, row in plan.toolpath.instructions)])


def _report(stream: _CommandStream, instrumented: InstrumentedPort | None, before: float, fresh: bool) -> PlotReport:
    plan, stretched = stream.plan, stream.plan.stretched
    observation = stream.observer.observation(stream.controller.silent)
    if instrumented is not None:
        executed_s = instrumented.executed_s - (0.0 if fresh else before)
        if fresh:
            stretched = measure_stretch(
                plan.intended_drawing(), hooking.without_pots(instrumented.executed_drawing(), plan.profile)
            )
    else:
        executed_s = time.monotonic() - before
        stretched = stretched if observation.unknown else observation.stretched
    return PlotReport(
        executed_s=executed_s,
        announced_s=plan.duration,
        stretched=stretched,
        lines=len(stream.commands),
        segments=int(np.count_nonzero(plan.toolpath.kind == DRAW)),
        min_queue=stream.min_queue,
        unsecured=stream.guard.most,
        observation=observation,
        plan=plan,
        dips=plan.dips,
        hooked_s=plan.hook_time,
    )
