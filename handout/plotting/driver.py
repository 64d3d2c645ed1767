"""From a plan to a machine: stream it, keep the journal, and whatever happens leave the pen lifted."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from handout.errors import DeviceError, DeviceSilent
from handout.plotting import bed, fidelity, grbl
from handout.plotting.connecting import connect, reset, state
from handout.plotting.journal import Journal
from handout.plotting.link import Link, Sent
from handout.plotting.planned import Plan
from handout.plotting.planning import plan as replan
from handout.plotting.ports import Port
from handout.plotting.simulated import SimulatedPlotter
from handout.profiles import Plotter

Progress = Callable[[float, float], None]
_OFTEN = 0.2  # s of plotting between two calls of `progress`
_MOMENT = 0.02  # s between two looks at a machine that brakes
_HURRY = 1.0  # s to wait for an answer when something has gone wrong already


@dataclass(frozen=True)
class Report:
    """How a plot went.

    executed_s : s, of the machine's clock if it is simulated, else measured here.
    announced_s : s, as the plan said.
    stretched : time the strokes took over the time they were meant to take; predicted for a real machine.
    lines : lines of the program, all acknowledged.
    plan : what was plotted: the plan that was given, or the one made anew for the machine's own limits.
    """

    executed_s: float
    announced_s: float
    stretched: float
    lines: int
    plan: Plan


def run(
    plan: Plan,
    port: Port,
    profile: Plotter,
    *,
    progress: Progress | None = None,
    journal: Path | None = None,
    log: Callable[[str], None] | None = None,
) -> Report:
    """Plot.

    Parameters
    ----------
    progress : called with the share that is done, 0 to 1, and the time that is left, s.
    journal : file that keeps what the machine has acknowledged; see `journal`.
    log : told in plain words what the user should know, such as limits of the machine that differ from the profile's.

    Raises
    ------
    DoesNotFit
        The machine's own settings leave less room than the drawing needs.
    DeviceSilent, DeviceAlarm, PortError
        The pen has been lifted then if the machine still answered.
    KeyboardInterrupt
        As it came; the machine has been stopped and its pen lifted.
    """
    log = log or (lambda _: None)
    link, own = connect(port, profile, log)
    bed.check(plan.course.points[:, :2], own)
    own = msgspec.structs.replace(own, bed=profile.bed)
    if _moves_differently(own, plan.profile):
        log("The plot is planned anew for the plotter's own limits.")
        plan = replan(plan.drawing, own, speed=plan.speed, order=plan.order)
    if plan.placement.turned:
        log("The page is turned to fit the bed: its top edge lies to the left.")
    if isinstance(port, SimulatedPlotter):
        port.lay(plan.drawing.page, plan.placement)
    before = time.monotonic()
    numbered = [(0, line) for line in grbl.opening(own)] + list(grbl.lines(plan.blocks, own))
    numbered += [(len(plan.blocks) - 1, line) for line in grbl.closing()]
    with Journal(journal, [line for _, line in numbered]) as kept:
        try:
            _stream(link, numbered, plan, kept, progress)
        except BaseException:  # an interrupt above all, but whatever it is: the pen must not stay on the paper
            _leave_lifted(link, own, log)
            raise
    return _report(plan, port, len(numbered), time.monotonic() - before)


def _moves_differently(own: Plotter, planned: Plotter) -> bool:
    return (own.limits, own.pen, own.port.queue) != (planned.limits, planned.pen, planned.port.queue)


def _stream(
    link: Link, numbered: list[tuple[int, bytes]], plan: Plan, kept: Journal, progress: Progress | None
) -> None:
    """Send all lines, and wait until the last is answered, which it is when the machine stands still."""
    told = 0.0
    begins, whole = plan.begins, max(plan.duration, 1e-9)

    def acknowledged(sent: Sent) -> None:
        nonlocal told
        kept.acknowledged(sent)
        block = numbered[max(sent.number - plan.profile.port.queue, 0)][0]  # what is acknowledged is only queued
        at = float(begins[block])
        if progress is not None and at - told >= _OFTEN:
            told = at
            progress(at / whole, whole - at)

    for number, (_, line) in enumerate(numbered):
        link.send(Sent(number, line), acknowledged)
    link.drain(acknowledged)
    if progress is not None:
        progress(1.0, 0.0)


def _leave_lifted(link: Link, profile: Plotter, log: Callable[[str], None]) -> None:
    """Stop the machine and lift the pen, as far as it still answers; never hides the error that led here."""
    link.timeout = min(link.timeout, _HURRY)
    try:
        with contextlib.suppress(DeviceSilent):  # after an alarm it hears nothing but the reset
            _hold(link)
        reset(link, _HURRY)
        if state(link) == "Alarm":
            link.ask(b"$X\n")
        for line in [*grbl.MODES, *grbl.pen(False, profile.pen), *grbl.closing()]:
            link.ask(line)
    except DeviceError:
        log("The pen could not be lifted and may stand on the paper: lift it by hand.")


def _hold(link: Link) -> None:
    """Brake, and wait until the machine stands: a reset while it moves would lose its place."""
    link.port.write(grbl.HOLD)
    link.forget()
    for _ in range(200):
        link.port.write(grbl.STATUS)
        for reply in link.attend():
            if isinstance(reply, grbl.Status) and reply.state != "Run" and (reply.state, reply.detail) != ("Hold", "1"):
                return
        link.replies(_MOMENT)


def _report(plan: Plan, port: Port, lines: int, wall: float) -> Report:
    if not isinstance(port, SimulatedPlotter):
        return Report(wall, plan.duration, plan.stretched, lines, plan)
    factor = 1.0 if plan.speed == "fast" else float(plan.speed)
    stretched = fidelity.stretched(plan.drawing, port.executed()) * factor
    return Report(port.executed_s, plan.duration, stretched, lines, plan)
