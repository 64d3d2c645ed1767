"""A pen plotter: plot a text or a drawing, preview it, go on with a plot that broke off.

A plot is a job in a folder of its own (`handout.plotting.jobs`): whatever ends it, `resume` goes on with it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import math
import re
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Self

import msgspec

from handout import atomic, profiles, units
from handout.errors import DeviceError, InputError
from handout.pipeline import job_pages
from handout.pipeline.inputs import Source
from handout.pipeline.lined_paper import page_name
from handout.pipeline.options import Length, millimetres
from handout.pipeline.plot_jobs import name_job, outlook, state_of
from handout.pipeline.plot_request import AttendanceOptions, PartOptions, PlotOptions, PlotRequest
from handout.pipeline.programs import apply_hooks, pressed_evenly
from handout.pipeline.results import SILENT, Attendant, Delivery, Facts, Listener, Tally, Told
from handout.pipeline.texts import STROKES, TextDocument, style_notes
from handout.pipeline.writing import Document, deliver, describe_asked, one_pen, open_document
from handout.plotting import fit_to_bed, open_port, plan, plot_report
from handout.plotting.connections import is_simulated as is_simulated
from handout.plotting.connections import surroundings
from handout.plotting.driver import PlotReport
from handout.plotting.jobs import pages as kept_pages
from handout.plotting.jobs import parts, runner, store
from handout.plotting.jobs.pages import NewPage, laid_out
from handout.plotting.jobs.store import JobOptions, PlotJob, load
from handout.plotting.overlap import OVERLAP, usual_overlap
from handout.plotting.pen_heights import replace_heights
from handout.plotting.planning.hooking import tell_hooks
from handout.plotting.planning.plan import Plan
from handout.plotting.ports import Port
from handout.profiles import PenTurn, Plotter
from handout.sinks import Look, check_outputs, write_drawings
from handout.values import Drawing

# s that a plotter may stand on hold where nobody is asked: long enough for somebody at the machine to look at the pen
_UNWATCHED = 120.0
_REST = "#d2d2d2"  # of what a preview shows and is not plotted


@dataclass(frozen=True)
class AtPlotter:
    """An attendant at one plotter, a `runner.Person`: of a simulated one nothing is asked.

    name : of one of several plotters, by which it is spoken of; asking : held while one of them asks.
    """

    attendant: Attendant
    address: str
    name: str = ""
    asking: contextlib.AbstractContextManager[object] = dataclasses.field(default_factory=contextlib.nullcontext)

    def do(self, request: str) -> None:
        if not is_simulated(self.address):
            with self.asking:
                self.attendant.do(f"{request} at {self.name}" if self.name else request)

    def try_again(self, error: DeviceError) -> bool:
        if is_simulated(self.address):
            return False
        with self.asking:
            return self.attendant.try_again(DeviceError(f"{self.name}: {error}") if self.name else error)

    def paused(self, pressed: Callable[[], bool]) -> None:
        if self.name:
            self.say("it is paused.")
        self.attendant.paused(pressed)

    def answer(self, question: str, answers: Mapping[str, str]) -> str:
        return self.attendant.answer(question, answers)

    def say(self, sentence: str) -> None:
        """Tell the attendant."""
        self.attendant.say(f"{self.name}: {sentence}" if self.name else sentence)


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """What plotters did; reports : of every part that was plotted."""

    reports: tuple[PlotReport, ...] = ()

    @property
    def executed_s(self) -> float:
        """Time that it took, s."""
        return round(sum(report.executed_s for report in self.reports), 2)

    @property
    def fidelity(self) -> str:
        """How faithful the plot was, in one sentence; "" if nothing was plotted."""
        return plot_report.sentence(self.reports)

    def executed_facts(self) -> Facts:
        """For JSON."""
        return {
            "planned_s": round(sum(report.announced_s for report in self.reports), 2),
            "executed_s": self.executed_s,
            "stretched": greatest_stretch(self.reports),
            **plot_report.facts(self.reports),
        }


@dataclass(frozen=True, kw_only=True)
class Plotted(Drawn, Delivery):
    """What was plotted; job : as it stands now."""

    job: PlotJob

    @property
    def sheets(self) -> int:
        """Sheets in all."""
        return self.job.pages * self.job.options.copies

    def tell_as(self, written: Delivery) -> Plotted:
        """The same, told as what was written on the sheets."""
        told = {**written.told, **self.executed_facts(), "copies": self.job.options.copies, "job": self.job.name}
        more: Told = {"tally": written.tally, "seed": written.seed, "notes": written.notes}
        return dataclasses.replace(self, told=told, **more)


class ReportFile:
    """The file with the report on how faithful the motion was, or will be; without a path none is written.

    Raises InputError: the file could not be written; asked before any work is done.
    """

    def __init__(self, path: str | Path | None) -> None:
        self.path, self.rows = None if path is None else Path(path), list[dict[str, Any]]()
        self._lock = threading.Lock()  # several plotters may tell of their sheets at once
        if self.path is not None:
            atomic.check_writable(self.path)

    def write_plans(self, plans: Sequence[Plan]) -> None:
        """Write what is predicted of every page."""
        if self.path is not None:
            plot_report.write(self.path, [plot_report.row(plan, page) for page, plan in enumerate(plans, 1)])

    def add_report(self, report: PlotReport, port: Port) -> None:
        """Write what is to be said of all parts up to the one that has just been plotted."""
        if self.path is not None:
            with self._lock:
                self.rows.append(plot_report.tell_plotted_page(report, port, len(self.rows) + 1))
                plot_report.write(self.path, self.rows)


@dataclass
class AttendedPlotter:
    """A plotter with who attends to it, and what is done while it draws.

    account : where it is written how faithful the motion was; port : open, if it was opened before the first job.
    reports : of every part that was plotted.
    """

    profile: Plotter
    person: AtPlotter
    attendance: AttendanceOptions = AttendanceOptions()
    account: ReportFile = dataclasses.field(default_factory=lambda: ReportFile(None))
    port: Port | None = None
    reports: list[PlotReport] = dataclasses.field(default_factory=list)

    def open(self) -> Self:
        """Open the port before any work is done for the machine."""
        try:
            self.port = open_port(self.person.address, self.profile)
        except DeviceError as error:
            raise type(error)(f"{error} No job was begun.") from error
        return self

    def close(self) -> None:
        """Close the port, if it is open and nothing was plotted over it."""
        port, self.port = self.port, None
        if port is not None:
            port.close()

    def plot_new(
        self, begin: Callable[[], PlotJob], *, before: str = "", behind: str = "", notes: Sequence[str] = ()
    ) -> Plotted:
        """Open the port, begin a job, say what it is, and plot it; what ends it says how to go on.

        before, behind : words before its amount and behind its name; notes : said before the sheet is laid in.
        """
        self.open()
        try:
            job = begin()
        except BaseException:
            self.close()
            raise
        amount = f"about {job.ink / 1000:.1f} m of ink; the other sheets are written while the first are drawn"
        if job.whole:
            amount = f"{units.count(job.pages * job.options.copies, 'sheet')}, {job.ink / 1000:.2f} m of ink"
        self.person.say(f"{self.profile.title}: {before}{amount}, job {job.name}{behind}.")
        self.person.attendant.note(*notes)
        return self.plot(job, new=True)

    def plot(self, job: PlotJob, *, new: bool = False) -> Plotted:
        """Plot a job, or what is left of it; what ends it says how to go on."""
        with _advise_at_end(job, new=new):
            self.draw(job)
        job, drawn = load(job.folder), Drawn(reports=tuple(self.reports))
        tally = sum((Tally(**counts) for counts in job.told), Tally())
        return Plotted(job=job, reports=drawn.reports, tally=tally, told={**state_of(job), **drawn.executed_facts()})

    def draw(self, job: PlotJob) -> None:
        """Draw a job, or what is left of it, at first over a port that is open."""
        attendance, person = self.attendance, self.person
        usual = math.inf if person.attendant.watches else _UNWATCHED
        limit = attendance.hold_limit
        patience = usual if limit is None else units.parse(limit, "time", "hold limit")

        def open_first() -> Port:
            first, self.port = self.port, None
            return first or open_port(person.address, job.profile)

        # several plotters are one block to who attends to them, and show no share
        block = contextlib.nullcontext() if person.name else person.attendant.plotting()
        with job_pages.producer(job) as producer, surroundings(person.address), block as progress:
            self.reports += runner.run_job(
                job,
                open_first,
                person,
                runner.RunOptions(attendance.at_zero, attendance.home_after, patience, attendance.reached),
                supply=producer,
                progress=progress,
                plotted=self.account.add_report,
                log=person.say,
            )


@dataclass(frozen=True)
class _Asked:
    """A request, checked: what is written, by which machine, how, and what is said of it."""

    request: PlotRequest
    profile: Plotter
    document: Document
    options: JobOptions
    notes: tuple[str, ...]
    drawing: Facts


def _check_request(request: PlotRequest, port: str | None) -> _Asked:
    """Check a request; `port` : see `preview`."""
    profile = asked_machine(request.plotting, port)
    document = open_document(request.source, request.writing, request.sheet, request.picture)
    task, options = document.task, job_options(request.plotting, profile, document.task.fast, document.timed)
    sentences, drawing = describe_asked(document)
    even = None if task.pose.pose is None else pressed_evenly(profile)
    inks = [] if options.layers == "colour" else one_pen(document)
    notes = (*sentences, *document.notes, *inks, *task.given_notes, *([even] if even else []))
    return _Asked(request, profile, document, options, notes, drawing)


def plot(
    request: PlotRequest | str,
    port: str,
    attendance: AttendanceOptions = AttendanceOptions(),
    *,
    attendant: Attendant = SILENT,
) -> Plotted:
    """Plot a text or a drawing; whatever ends it, `resume` goes on with it.

    request : what is plotted and how, or just a text.
    port : see `plotting.open_port`.

    Raises InputError, DeviceError, KeyboardInterrupt: the message says how to go on, if anything has been begun.
    """
    request = PlotRequest(Source(request)) if isinstance(request, str) else request
    account = ReportFile(attendance.report)
    work = _check_request(request, port)
    station = AttendedPlotter(work.profile, AtPlotter(attendant, port), attendance, account)
    plotted = station.plot_new(partial(_begin_job, work, port, attendant), notes=work.notes)
    return plotted.tell_as(deliver(plotted.tally, work.document.task, (), work.notes, behind=work.drawing))


def keep(request: PlotRequest, port: str | None = None) -> tuple[PlotJob, tuple[str, ...]]:
    """A plot as a job that is begun with `resume`, and what the user is told of it; `port` : see `preview`."""
    work = _check_request(request, port)
    return _begin_job(work, port or "", SILENT), work.notes


def preview(
    request: PlotRequest,
    outputs: Sequence[str | Path],
    *,
    show_travel: bool = False,
    report: str | Path | None = None,
    port: str | None = None,
    listener: Listener = SILENT,
) -> Delivery:
    """Write what would be plotted to files; `port` : that it would be plotted at, for the usual device of that."""
    paths = [Path(name) for name in outputs]
    check_outputs(paths)
    account, work = ReportFile(report), _check_request(request, port)
    profile, task = work.profile, work.document.task
    pages = work.document.draw(STROKES, tell=listener.progress)
    drawings = pages.drawings
    if request.writing.fit:
        drawings = [fit_to_bed(drawing, profile) for drawing in drawings]
    shown, plans = shown_pages(drawings, request.part, profile, work.options, listener)
    besides = tell_hooks([planned.drawing for planned in plans], profile)
    notes = (*work.notes, *style_notes(task, drawings), *besides)
    listener.note(*notes)
    files = write_drawings(shown, paths, dataclasses.replace(task.look, show_travel=show_travel))
    account.write_plans(plans)
    tally = Tally.from_pages(pages.manuscripts, [planned.drawing for planned in plans])
    return deliver(tally, task, files, notes, behind={**work.drawing, **_plan_facts(plans)})


def resume(
    name: str | None = None,
    port: str | None = None,
    attendance: AttendanceOptions = AttendanceOptions(),
    *,
    attendant: Attendant = SILENT,
) -> Plotted:
    """Go on with a job, at the port where it was begun or another; None: of those that can, the one drawn last."""
    account = ReportFile(attendance.report)
    job = store.find(name, unfinished=True)
    if job.standing().finished:
        raise InputError(f"The job {job.name} is finished: nothing is left of it.")
    attendant.say(outlook(job))
    return AttendedPlotter(job.profile, AtPlotter(attendant, port or job.port), attendance, account).plot(job)


def machine(device: str | None, port: str | None) -> Plotter:
    """The plotter that is named, or the usual one."""
    profile = profiles.find(device or usual_device(port), "plotter")
    assert isinstance(profile, Plotter)
    return profile


def usual_device(port: str | None) -> str:
    """The name of the plotter that is meant where none is named."""
    return "simulated" if port is not None and is_simulated(port) else "grbl-servo"


def plot_drawings(
    drawings: Sequence[Drawing],
    profile: Plotter,
    port: str,
    title: str,
    attendant: Attendant = SILENT,
    *,
    fast: bool = False,
) -> Plotted:
    """Plot some drawings, a sheet each, as a job like any other, at the pace of their clocks or as fast as it goes."""
    options = JobOptions(speed="fast" if fast else 1.0, overlap=usual_overlap(profile, True) if fast else OVERLAP)
    begin = partial(store.create, drawings, profile, options, title=title, port=port)
    return AttendedPlotter(profile, AtPlotter(attendant, port)).plot_new(begin, before=f"{title}, ")


def asked_machine(plotting: PlotOptions, port: str | None) -> Plotter:
    """The plotter, with the pen heights and the hooks that are asked for."""
    profile = machine(plotting.device, port)

    def height(text: str | None, what: str) -> float | None:
        if text is None:
            return None
        if profile.pen.in_mm:
            return units.length(text, what)
        try:
            return float(text)
        except ValueError:
            raise InputError(f"{what}: {text!r} is not a number, as pen.up and pen.down in the profile are.") from None

    if plotting.pen_up is not None or plotting.pen_down is not None:
        profile = replace_heights(profile, height(plotting.pen_up, "pen up"), height(plotting.pen_down, "pen down"))
    return apply_hooks(profile, plotting.hooks)


def job_options(plotting: PlotOptions, profile: Plotter, fast: bool, timed: bool = True) -> JobOptions:
    """How a job is to be drawn; `timed` : whether the times of its strokes mean anything."""
    usual = usual_overlap(profile, fast or not timed)
    return JobOptions(
        speed="fast" if fast else 1.0,
        order=plotting.order,
        overlap=usual if plotting.overlap is None else _positive(plotting.overlap, "overlap"),
        copies=plotting.copies,
        layers=plotting.layers,
        turns=_read_turns(plotting),
        pause_every=None if plotting.pause_every is None else _positive(plotting.pause_every, "pause every"),
    )


def _read_turns(plotting: PlotOptions) -> tuple[PenTurn, ...]:
    """The turns that --layer asks for."""
    if plotting.layer and plotting.layers == "none":
        raise InputError(
            "--layer says how a layer is drawn: say what makes one, with --layers name or --layers colour."
        )
    turns = []
    for text in plotting.layer:
        name, *rest = re.split(r",\s*(?=speed=|pen=|out$|out,)", text)
        told = {word.partition("=")[0]: word.partition("=")[2].strip("\"'") for word in rest}
        try:
            speed = float(told.get("speed", "100%").removesuffix("%")) / 100
            turn = {"layer": name, "speed": speed, "pen": told.get("pen", ""), "out": "out" in told}
            if math.isnan(speed):
                raise ValueError("no speed")
            turns.append(msgspec.convert(turn, PenTurn))
        except (ValueError, msgspec.ValidationError) as error:
            way = "write its name, and after commas speed=50% (5% to 2000%), pen=red (60 characters) or out"
            raise InputError(f"--layer {text}: {way}.") from error
    return tuple(turns)


def check_turns(pages: Sequence[Drawing], options: JobOptions) -> None:
    """Refuse a turn of a layer that is on no page."""
    there = {parts.layer_of(stroke, options.layers): None for page in pages for stroke in page.strokes if options.turns}
    for turn in options.turns:
        if turn.layer not in there:
            raise InputError(f"There is no layer {turn.layer!r}; there are {', '.join(map(repr, there))}.")


def _positive(text: Length, what: str) -> float:
    length = millimetres(text, what)
    if not length > 0:
        raise InputError(f"{what}: {text} is not more than 0.")
    return length


def _begin_job(work: _Asked, port: str, listener: Listener) -> PlotJob:
    """The job, with the first page of a text and what the others are made from, or with all pages, or the part of them
    that is asked for; the listener hears which."""
    request, document, rest = work.request, work.document, None
    produced = job_pages.make_pages(document, work.profile, request.writing.fit)
    pages = [next(produced)]
    more = isinstance(document, TextDocument) and pages[0].share < 1.0 and not request.part
    if more and isinstance(request.writing.hand, str):
        page = page_name(request.sheet, request.picture)
        rest = job_pages.inputs(request.source.text, document.task, request.writing, request.sheet, page)
    else:  # a hand that is in memory alone cannot be found again
        pages += produced
    if request.part:
        pages = _part(pages, request.part, work.profile, work.options, listener)
    elif rest is None:
        check_turns([page.drawing for page in pages], work.options)
    title = " ".join(request.source.text.split())[:40]
    return store.begin(pages, work.profile, work.options, rest, title=title, port=port)


def _part(
    pages: Sequence[NewPage], part: PartOptions, profile: Plotter, options: JobOptions, listener: Listener
) -> list[NewPage]:
    """The pages with the part alone that is asked for; the listener hears which that is."""
    _, laid = _lay_out([page.drawing for page in pages], profile, options)
    chosen = parts.pieces(laid, partial(_plan_page, profile, options), **dataclasses.asdict(part))
    listener.say(parts.name_stretch(chosen, laid))
    kept = []
    for number, piece in enumerate(chosen, 1):
        drawing = cut_out(laid[piece.sheet], piece)
        figures = {"strokes": len(drawing.strokes), "duration": drawing.duration}
        figures |= {"pen_down": drawing.pen_down, "pen_up": drawing.pen_up}
        told = pages[piece.sheet].told
        kept.append(NewPage(drawing, number / len(chosen), {**told, **figures} if told else {}))
    return kept


def cut_out(page: Drawing, piece: parts.SheetStretch) -> Drawing:
    """The strokes of a page that are drawn."""
    return dataclasses.replace(page, strokes=page.strokes[piece.first : piece.stop])


def with_rest(page: Drawing, piece: parts.SheetStretch, plans: Sequence[Plan]) -> Drawing:
    """A page of a preview: what is plotted, by one plan or several, and all else pale."""
    ways = [way for planned in plans for way in planned.hook_ways()]
    part = dataclasses.replace(page, strokes=tuple(stroke for planned in plans for stroke in planned.drawing.strokes))
    if ways:  # what it does besides, for pictures of the travel
        part = dataclasses.replace(part, about={**part.about, "hooks": ways})
    if (piece.first, piece.stop) == (0, len(page.strokes)):
        return part
    rest = [dataclasses.replace(stroke, colour=_REST) for stroke in page.strokes]
    strokes = (*rest[: piece.first], *part.strokes, *rest[piece.stop :])
    about = {**part.about, "part": [piece.first, piece.first + len(part.strokes), _REST]}
    return dataclasses.replace(part, strokes=strokes, about=about)


def plot_again(
    name: str | None,
    part: PartOptions,
    port: str | None = None,
    attendance: AttendanceOptions = AttendanceOptions(),
    *,
    attendant: Attendant = SILENT,
) -> Plotted:
    """Plot a kept job, or a part of it, once more, as a job of its own; None: the one that was drawn last.

    Raises InputError, DeviceError, KeyboardInterrupt: as `plot`; or its drawings are not kept any more.
    """
    account, before = ReportFile(attendance.report), store.drawn_before(name)
    address, profile = port or before.port, before.profile

    def begin() -> PlotJob:
        options = msgspec.structs.replace(before.options, copies=1)
        pages = _part(_kept_pages(before, attendant), part, profile, options, attendant)
        return store.begin(pages, profile, options, None, title=before.title, port=address)

    station = AttendedPlotter(profile, AtPlotter(attendant, address), attendance, account)
    return station.plot_new(begin, behind=f", of {name_job(before)}")


def _kept_pages(job: PlotJob, listener: Listener) -> list[NewPage]:
    if not job.whole:
        count = units.count(job.pages, "sheet")
        listener.say(f"Only {count} of {job.name} had been written: the rest of its text is left out here.")
    told = [*job.told, *[{}] * (job.pages - len(job.told))]
    return [NewPage(kept_pages.read_drawing(job.folder, number), 1.0, told[number]) for number in range(job.pages)]


def preview_again(
    name: str | None,
    part: PartOptions,
    outputs: Sequence[str | Path],
    *,
    show_travel: bool = False,
    listener: Listener = SILENT,
) -> Delivery:
    """Write to files what `plot_again` would plot."""
    paths = [Path(path) for path in outputs]
    check_outputs(paths)
    before = store.drawn_before(name)
    listener.say(f"From the plot {name_job(before)}.")
    kept = _kept_pages(before, listener)
    drawings, plans = shown_pages([page.drawing for page in kept], part, before.profile, before.options, listener)
    files = write_drawings(drawings, paths, Look(show_travel=show_travel))
    tally = sum((Tally(**page.told) for page in kept if page.told), Tally())
    about = kept[0].drawing.about
    told = {"job": before.name, "files": [str(file) for file in files], **_plan_facts(plans)}
    return Delivery(tally=tally, seed=int(about.get("seed") or 0), files=tuple(files), told=told)


def shown_pages(
    pages: Sequence[Drawing], part: PartOptions, profile: Plotter, options: JobOptions, listener: Listener
) -> tuple[list[Drawing], list[Plan]]:
    """The pages as a preview shows them, and the plan of each."""
    whole, laid = _lay_out(pages, profile, options)
    chosen = [parts.SheetStretch(number, 0, len(page.strokes)) for number, page in enumerate(laid)]
    if part:
        chosen = parts.pieces(laid, partial(_plan_page, profile, options), **dataclasses.asdict(part))
        listener.say(parts.name_stretch(chosen, laid))
    shown, plans = [], list[Plan]()
    for piece in chosen:
        drawn = cut_out(laid[piece.sheet], piece)
        made = _plan_page(profile, options, drawn)
        shown.append(with_rest(whole[piece.sheet], piece, made))
        plans += made
    if not plans:
        raise InputError("All layers are left out: there is nothing to plot.")
    return shown, plans


def _lay_out(pages: Sequence[Drawing], profile: Plotter, options: JobOptions) -> tuple[list[Drawing], list[Drawing]]:
    """The pages as a job keeps them, with the layers that are left out at their ends, and as it draws them."""
    check_turns(pages, options)
    laid = [laid_out(page, profile, options.layers, options.order, options.turns) for page in pages]
    return laid, [parts.without(page, options.layers, options.turns) for page in laid]


def paced(page: Drawing, options: JobOptions) -> Iterator[tuple[Drawing, float]]:
    """The strokes of a page that is laid out, parted where the pace of their layers changes, with each pace."""
    paces = [parts.turn_of(parts.layer_of(stroke, options.layers), options.turns).speed for stroke in page.strokes]
    for pace, run in itertools.groupby(zip(paces, page.strokes, strict=True), lambda each: each[0]):
        yield dataclasses.replace(page, strokes=tuple(stroke for _, stroke in run)), pace


def _plan_page(profile: Plotter, options: JobOptions, page: Drawing) -> list[Plan]:
    """The plans of a page that is laid out, one after the other: one for each pace of its layers."""
    return [plan(run, profile, speed=options.speed, pace=pace) for run, pace in paced(page, options)]


def _plan_facts(plans: Sequence[Plan]) -> Facts:
    """The seconds that plotting would take, how often the pen dips, and the seconds for that and other hooks."""
    dips, hooks_s = sum(planned.dips for planned in plans), sum(planned.hook_time for planned in plans)
    hooks: Facts = {"dips": dips, "hooks_s": round(hooks_s, 2)} if hooks_s else {}
    seconds = round(sum(planned.duration for planned in plans), 2)
    return {"planned_s": seconds, "stretched": greatest_stretch(plans), **hooks}


def greatest_stretch(parts: Sequence[Plan] | Sequence[PlotReport]) -> float:
    """The greatest of the sheets' stretches: time the strokes take over the time they were meant to take."""
    return round(max((part.stretched for part in parts), default=1.0), 4)


@contextlib.contextmanager
def _advise_at_end(job: PlotJob, *, new: bool) -> Iterator[None]:
    """A block whose errors say how to go on with a job; a new job of which nothing could be drawn is forgotten."""
    try:
        yield
    except DeviceError as error:
        if advice := how_to_go_on(job):
            raise type(error)(f"{error} {advice}") from error
        raise
    except InputError as error:
        standing = None
        with contextlib.suppress(InputError):  # what is wrong has been said
            standing = job.standing()
        if not new or (standing is not None and (standing.begun or standing.part > 0)):
            raise type(error)(f"{error} {how_to_go_on(job)}".strip()) from error
        with contextlib.suppress(InputError):
            store.forget(job)
        raise
    except BaseException as stop:  # an interrupt, here or in a question to the operator
        if advice := how_to_go_on(job):
            stop.add_note(advice)
        raise


def how_to_go_on(job: PlotJob) -> str:
    """The sentence on how to go on with a job; it names the job, since --resume alone may take another."""
    try:
        job.standing()
    except InputError:  # what is wrong has been said
        return ""
    return f"The job is kept; go on with: handout plot --resume {job.name}"
