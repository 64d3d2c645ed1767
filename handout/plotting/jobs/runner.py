"""Plots a job, or the rest of it, part by part: decides where it goes on, asks for pens and sheets, writes the journal.

The pages of a long text may still be made while the first are drawn: those that are lacking come from a `PageProducer`.

After something has gone wrong nothing moves by itself.  When a person has taken the job up again, the machine looks for
its zero, or is told where that is, or still knows; then it goes, pen lifted, to where drawing has to go on.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Protocol

import msgspec
import numpy as np

from handout.errors import DeviceAlarm, DeviceError, DeviceGarbled, InputError
from handout.plotting import bed
from handout.plotting.dialects import BUTTON_LOOK, ButtonPressed, Controller, dialect
from handout.plotting.driver import Monitor, PlotReport, Progress, connect, draw, halting, park
from handout.plotting.jobs import store
from handout.plotting.jobs.journal import PlotJournal
from handout.plotting.jobs.pages import PageProducer
from handout.plotting.jobs.parts import PlotPart, list_requests, turn_of
from handout.plotting.jobs.places import START, DrawnPlace, Milestones, find_place, onward, remaining
from handout.plotting.jobs.store import PlotJob, load
from handout.plotting.planning import hooking
from handout.plotting.planning.plan import Plan
from handout.plotting.planning.planner import plan
from handout.plotting.ports import Port
from handout.values import Drawing

_ZERO = 0.02  # mm; a machine that says it stands in its zero may just have been switched on
_REACH = 1.1  # ink on the drawing's path for ink in straight pieces
_FARTHER = 20.0  # times that reach at most, where a disk was slow; set by eye: some words
_WRITTEN = 1.0  # mm of ink between two lines of the journal


class Person(Protocol):
    """The person at the plotter."""

    def do(self, request: str) -> None:
        """Ask for something and wait until it is done; InputError if nobody is there."""

    def try_again(self, error: DeviceError) -> bool:
        """Report a fault and wait until it is mended; False if the job is to end."""

    def paused(self, pressed: Callable[[], bool]) -> None:
        """Wait, with the pen lifted, until the plotter's button is `pressed` or the person says to go on."""


def is_about_zero(request: str) -> bool:
    """Whether only a person at the plotter can fulfil a request: to push the pen above its zero."""
    return "plotter's zero" in request


@dataclass(frozen=True)
class RunOptions:
    """What happens at the machine while a job is drawn.

    at_zero : the pen of a job that is resumed stands above the machine's zero, lifted.
    home_after : the pen goes back to zero after an interrupt too, if the machine knows the way; at the end of every
        part it does so anyway.
    patience : s that the machine may stand on hold, or wait for its button to be pressed; then the job ends as after a
        break, the pen lifted.
    reached : told of the number of the part that is drawn and the place on it, as often as `progress`.
    """

    at_zero: bool = False
    home_after: bool = False
    patience: float = math.inf
    reached: Callable[[int, DrawnPlace], None] | None = None


def run_job(
    job: PlotJob,
    open_port: Callable[[], Port],
    person: Person,
    options: RunOptions = RunOptions(),
    *,
    supply: PageProducer | None = None,
    progress: Progress | None = None,
    plotted: Callable[[PlotReport, Port], None] | None = None,
    log: Callable[[str], None] | None = None,
) -> list[PlotReport]:
    """Plot what is left of a job.

    open_port : opens the way to the machine, and again after a break.
    supply : whence the pages come that are not made yet, if there are such.
    progress : called with the share of the job that is done, 0 to 1, and about how much time is left, s; where it
        raises `ButtonPressed` the plot pauses as by the plotter's own button.
    plotted : told of every part that has been plotted.

    Returns one for every part that was plotted, without its plan and its strokes: a job may have many.

    Raises DeviceError, KeyboardInterrupt: the journal knows how far it has come. InputError: nobody is there to be
    asked; the journal or a drawing is damaged; another program plots the job; a page cannot be made.
    """
    with job.open() as journal:
        run = _JobRun(job, journal, supply, person, progress, plotted, log or (lambda _: None), options.reached)
        at_zero = options.at_zero
        run.ask_to_look()
        while not run.is_done():
            try:
                with contextlib.closing(open_port()) as port:
                    run.parts(port, at_zero, options.home_after, options.patience)
            except DeviceError as error:
                at_zero = False
                if not person.try_again(error):
                    raise
        store.drop_drawings(job.folder.parent)
    return run.reports


def doubt(job: PlotJob) -> str:
    """What a damaged journal leaves open, and the ways out, in a sentence; "" where it says all."""
    standing = job.standing()
    if not standing.uncertain:
        return f"Its journal is damaged, but what follows line {standing.damaged} says all." if standing.damaged else ""
    number = standing.part
    part = job.parts[number] if number < len(job.parts) else None
    sheet = f"sheet {part.copy * job.pages + part.page + 1}" if part is not None else "the next sheet"
    where = f"of {sheet} what lies behind stroke {standing.place.stroke + 1}" if standing.begun else sheet
    return (
        f"The journal of {job.name} is damaged at line {standing.damaged}: all before {where} is drawn, and whether "
        f"more is, is not known, so that it may be drawn twice. Look at the paper, and put in {sheet} as it lay; or "
        f"stop here and plot it anew, or the part that is missing, with handout plot --again {job.name}."
    )


class _JobRun:
    """One program's work on a job."""

    def __init__(
        self,
        job: PlotJob,
        journal: PlotJournal,
        supply: PageProducer | None,
        person: Person,
        progress: Progress | None,
        plotted: Callable[[PlotReport, Port], None] | None,
        log: Callable[[str], None],
        reached: Callable[[int, DrawnPlace], None] | None,
    ) -> None:
        self.job, self.journal, self.supply, self.person, self.log = job, journal, supply, person, log
        self.progress, self.plotted, self.reached = progress, plotted, reached
        self.reports: list[PlotReport] = []
        self.controller: Controller
        self._warned = False

    def ask_to_look(self) -> None:
        """Where the journal does not say all that was drawn, somebody has to look."""
        if self.journal.standing.uncertain:
            self.person.do(doubt(self.job).rstrip("."))

    def is_done(self) -> bool:
        """Whether nothing is left; a part whose strokes are all drawn counts as complete."""
        journal = self.journal
        if journal.standing.finished:
            return True
        part = self._take_next_part()
        if part is not None and journal.standing.begun and not self._is_left(journal.standing.part):
            journal.complete()
            part = self._take_next_part()
        if part is None:
            journal.finish()
        return part is None

    def _is_left(self, number: int) -> bool:
        """Whether anything of a part under way is left: strokes, or what comes after the page."""
        closes = bool(self.job.profile.hooks.after_page) and self._whole(number)[1]
        return closes or bool(remaining(self.job.drawing(number), self.journal.standing.place).strokes)

    def _whole(self, number: int) -> tuple[bool, bool]:
        """Whether a page begins with what is left of a part, and ends with it."""
        around = [None, *self.job.parts, None][number : number + 3]
        pages = [None if part is None else (part.copy, part.page) for part in around]
        begins = pages[0] != pages[1] and not self.journal.standing.opened
        return begins and self.journal.standing.place == START, pages[1] != pages[2]

    def _take_next_part(self) -> PlotPart | None:
        """The part under way or the next one, waiting until its page is made; None after the last."""
        number, waited = self.journal.standing.part, False
        if number >= len(self.job.parts) and not self.job.whole:
            self.job = load(self.job.folder)
        while number >= len(self.job.parts) and not self.job.whole:
            if self.supply is None:
                raise InputError(f"Only {self.job.pages} pages of the job {self.job.name} are made.")
            if not waited:
                self.log("The next sheet is still being written.")
            waited = True
            self.supply.wait()
            self.job = load(self.job.folder)
        return self.job.parts[number] if number < len(self.job.parts) else None

    def parts(self, port: Port, at_zero: bool, home_after: bool, patience: float) -> None:
        """All parts that are left, over one connection."""
        self.controller = self._meet(port, patience)
        try:
            self._find_zero(self.controller, at_zero)
            self._parts(port, patience)
        except KeyboardInterrupt:
            if home_after:
                park(self.controller)
            raise

    def _meet(self, port: Port, patience: float) -> Controller:
        controller = connect(port, self.job.profile, self.log)
        controller.patience = patience
        return controller

    def _parts(self, port: Port, patience: float) -> None:
        journal = self.journal
        while (part := self._take_next_part()) is not None:
            trouble = "" if self.supply is None or self._warned else self.supply.trouble()
            if trouble:  # a page will be missing
                self._warned = True
                self.log(f"{trouble} The pages before that are drawn.")
            number = journal.standing.part
            before = self.job.parts[number - 1] if number else None
            fresh = not journal.standing.begun and (
                before is None or (before.copy, before.page) != (part.copy, part.page)
            )
            if not journal.standing.begun:
                for request in list_requests(before, part, self.job.pages, self.job.layers, self.job.options.turns):
                    self.person.do(request)
                journal.begin(number)
            self._draw_with_pauses(number, port, fresh, patience)
            journal.complete()

    def _draw_with_pauses(self, number: int, port: Port, fresh: bool, patience: float) -> None:
        """Draw one part; a press of the plotter's button stops it with the pen lifted, as an interrupt does."""
        while True:
            self.controller.heed_button()
            try:
                self._draw(number, self.controller, port, fresh)
                return
            except ButtonPressed:
                self.person.paused(_for_a_while(self.controller.was_button_pressed, patience))
            if not self._is_left(number):
                return
            fresh = False
            self.controller = self._meet(port, patience)
            if self.controller.position() is None:
                self._find_zero(self.controller, at_zero=False)
            else:
                with halting(self.controller):
                    self.controller.go(0.0, 0.0)

    def _find_zero(self, controller: Controller, at_zero: bool) -> None:
        """Make sure that the machine knows its zero and stands in it."""
        profile, standing = self.job.profile, self.journal.standing
        resumed = standing.begun or standing.part > 0
        knows = resumed and not at_zero and self._look(controller)
        if profile.homing:
            with halting(controller):
                if knows:
                    controller.go(0.0, 0.0)  # which lifts the pen, wherever it was left
                controller.home()
        elif knows:
            self.log(
                "The plotter has kept its place: it goes back to its zero with the pen lifted, and on from there. If "
                "it was moved by hand, stop it now and use --at-zero."
            )
            with halting(controller):
                controller.go(0.0, 0.0)
        elif resumed or profile.bed.zero == "here":
            if resumed and not at_zero:
                corner = bed.CORNERS[profile.bed.origin]
                self.person.do(
                    f"Lift the pen and push it above the plotter's zero, the {corner} of the page as it lies"
                )
            controller.zero()

    def _look(self, controller: Controller) -> bool:
        """Whether the machine still knows its place; if so, the place tells how much is drawn.

        Its word alone does not tell that: another program may have counted from another zero since.  So the place must
        lie on the way of the plot: behind what is drawn, or from there to zero.  Where a command came over wrong it has
        left that way, and what is proven is gone back to.
        """
        standing, at = self.journal.standing, controller.position()
        if at is None or max(map(abs, at)) < _ZERO:
            return False
        if standing.doubtful:
            return True
        begun = standing.begun or standing.part == 0
        whole = self.job.drawing(standing.part if begun else standing.part - 1)
        to_page = bed.place(whole.page, self.job.profile).to_page
        xy, zero = to_page(np.array([at, (0.0, 0.0)]))
        detours = [to_page(way) for way in hooking.detours(self.job.profile)]
        held = dialect(self.job.profile.dialect).in_hand * float(self.job.profile.limits.draw_speed)
        reach = _REACH * max(self.job.options.overlap, held) + _WRITTEN
        drawn = standing.place if begun else DrawnPlace(len(whole.strokes))
        place = find_place(whole, drawn, xy, reach, zero, detours)
        if place is not None and standing.begun:
            self.journal.note_drawn(place)
        # farther on its way, where a slow disk let it be sent more: its zero is known, what is drawn is not
        elif place is None and find_place(whole, drawn, xy, _FARTHER * reach, zero, detours) is None:
            x, y = xy
            self.log(
                f"The plotter says that its pen is at {x:.1f}, {y:.1f} mm of the page, where this plot has not led it: "
                "that is not believed."
            )
            return False
        return True

    def _draw(self, number: int, controller: Controller, port: Port, fresh: bool) -> None:
        """One part, or what is left of it."""
        job, journal = self.job, self.journal
        whole = job.drawing(number)
        left = remaining(whole, journal.standing.place)
        profile = msgspec.structs.replace(controller.profile, bed=job.profile.bed)
        speed, pace = job.options.speed, turn_of(job.parts[number].layer, job.options.turns).speed
        if not left.strokes:  # what comes after a page that is drawn, from its beginning
            last = dataclasses.replace(whole, strokes=whole.strokes[-1:])
            closing = plan(last, profile, speed=speed, pace=pace, whole=(False, True)).after_page()
            if closing is not None:
                draw(closing, controller, port, job.profile, Monitor(log=self.log), fresh=False)
            return
        planned = plan(left, profile, speed=speed, pace=pace, whole=self._whole(number))
        keeper = _Keeper(journal, whole, left, planned)
        monitor = Monitor(
            progress=self._progress(number, planned, keeper),
            watch=keeper.note,
            proved=keeper.note_proved,
            secure=keeper.secure,
            overlap=job.options.overlap,
            log=self.log,
        )
        try:
            report = draw(planned, controller, port, job.profile, monitor, fresh=fresh)
        except BaseException as error:
            keeper.write()
            if isinstance(error, DeviceGarbled) or controller.spoilt:
                journal.doubt()
            elif not isinstance(error, DeviceError):  # the machine was stopped in good order
                with contextlib.suppress(DeviceError):
                    self._look(controller)
            raise
        if self.plotted is not None:
            self.plotted(report, port)
        observation = dataclasses.replace(report.observation, executed=None)
        self.reports.append(dataclasses.replace(report, observation=observation, plan=None))

    def _progress(self, number: int, planned: Plan, keeper: _Keeper) -> Progress | None:
        """The progress of a part converted into that of the whole job, by ink."""
        tell = self.progress
        if tell is None:
            return None
        if not self.job.whole:
            self.job = load(self.job.folder)
        parts = self.job.parts
        whole = max(self.job.ink, 1e-9)
        behind = sum(part.ink for part in parts[:number])
        later = max(whole - behind - parts[number].ink, 0.0)
        begun = behind + max(parts[number].ink - planned.pen_down, 0.0)
        pace = planned.duration / max(planned.pen_down, 1e-9)

        def progress(share: float, left: float) -> None:
            if self.reached is not None:
                self.reached(number, keeper.place)
            tell(min((begun + share * planned.pen_down) / whole, 1.0), left + pace * later)

        return progress


def _for_a_while(pressed: Callable[[], bool], patience: float) -> Callable[[], bool]:
    """Whether a button is pressed, for so many seconds; DeviceAlarm when nobody has come."""
    waited = 0.0

    def see_place() -> bool:
        nonlocal waited
        waited += BUTTON_LOOK
        if waited > patience:
            raise DeviceAlarm(
                f"The plot was paused at the plotter's button, which nobody has pressed again for {patience:.0f} s: "
                "the pen is lifted."
            )
        return pressed()

    return see_place


class _Keeper:
    """Writes the progress of a part that the driver reports into the journal."""

    def __init__(self, journal: PlotJournal, whole: Drawing, left: Drawing, plan: Plan) -> None:
        self.journal, self.whole, self.left = journal, whole, left
        self.start, self.reached = journal.standing.place, Milestones(plan)
        self._done = self._written = self._proven = self._sure = 0
        self._opened = plan.opening_count

    def note(self, sent: int, taken: int, executed: int, done: int) -> None:
        """So many commands are certainly drawn; written to the journal at intervals."""
        self._done = done
        if 0 < self._opened <= done:
            self.journal.note_opened()
        if self.reached.ink[done] - self.reached.ink[self._written] >= _WRITTEN:
            self.write()

    def note_proved(self, done: int) -> None:
        """So many commands are proven right."""
        self._proven = done
        if self.reached.ink[done] - self.reached.ink[self._sure] >= _WRITTEN:
            self.write()

    @property
    def place(self) -> DrawnPlace:
        """What was noted last."""
        return self._place(self._done)

    def write(self) -> None:
        """Write down what was noted last."""
        self._written, self._sure = self._done, self._proven
        self.journal.note_drawn(self._place(min(self._proven, self._done)))
        if self._proven < self._done:
            self.journal.note_drawn(self._place(self._done), proven=False)

    def _place(self, done: int) -> DrawnPlace:
        return onward(self.start, self.left, self.whole, self.reached.place(done))

    def secure(self) -> Future[None]:
        """Begin to secure the last note against a power cut; the future ends when it is."""
        self.write()
        return self.journal.secure()
