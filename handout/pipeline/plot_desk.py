"""Plots as a page attends to them: kept first, looked at on the bed, then drawn, paused and stopped, step by step.

A plot is a job before it has a machine, so that what is looked at is what is drawn; the same journal as ever says where
it goes on.  What the page wants while the pen moves comes as words through a `PageWire`.
"""

from __future__ import annotations

import contextlib
import functools
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Literal, Protocol, Self

import numpy as np
from msgspec import structs

from handout import profiles
from handout.errors import DeviceError, HandoutError, InputError
from handout.pipeline import pen_setup, plotting
from handout.pipeline.devices import list_devices, probe, serial_devices
from handout.pipeline.inputs import sent_source
from handout.pipeline.plot_jobs import find_job, list_jobs, outlook, state_of
from handout.pipeline.plot_request import AttendanceOptions, PlotRequest
from handout.pipeline.results import SILENT, Attendant, Facts, Listener
from handout.plotting import bed
from handout.plotting.dialects import ButtonPressed
from handout.plotting.jobs import pages
from handout.plotting.jobs.pages import Record
from handout.plotting.jobs.parts import in_turn, survey, turn_of
from handout.plotting.jobs.places import DrawnPlace
from handout.plotting.jobs.store import PlotJob
from handout.plotting.planning.planner import plan
from handout.printing.printers import queues
from handout.profiles import LaidSheet, Length, PenTurn, Plotter
from handout.signals import interrupt
from handout.sinks.svg import to_svg
from handout.values import Array, Drawing, Page, Stroke

SIMULATED = {"sim:": "simulated, without waiting", "sim:?realtime=1": "simulated, at true speed"}
_OFTEN = 0.1  # s of the clock between two places that are told: a screen shows no more of a pen
_LOOK = 0.25  # s that a paused plot waits for a word before it looks at the plotter's button
_STOPS = {"stop": "it was stopped at the page", "gone": "the studio was closed"}


class PageWire(Listener, Protocol):
    """The page: hears sentences and how far it is, and says words."""

    def live(self, facts: Facts) -> None:
        """Hear what is so at this moment: what is asked, whether the plot pauses, where the pen is; never waits."""

    def word(self, seconds: float = 0.0) -> str:
        """What the page says next, waited for so long: "pause", "on" or "stop"; "gone" where it is; "" for nothing."""


class AtPage(Attendant):
    """The person at a page of the studio, whose work ends where the page says stop.

    shared : whether several threads do it: what stops it stops all, by the first of them, which enters and leaves this.
    """

    def __init__(self, wire: PageWire, shared: bool = False) -> None:
        self._wire, self._told, self._shared = wire, 0.0, shared
        self._on, self._over, self._lock = threading.Event(), False, threading.Lock()
        self._first = threading.get_ident()

    def _word(self, seconds: float = 0.0) -> str:
        """As `PageWire.word`; threads that share work hear only "on", and only where they wait for it."""
        if not self._shared:
            return self._wire.word(seconds)
        if not seconds or not self._on.wait(seconds):
            return ""
        self._on.clear()
        return "on"

    def __enter__(self) -> Self:
        if self._shared:
            threading.Thread(target=self._watch, daemon=True).start()
        return self

    def __exit__(self, *error: object) -> None:
        with self._lock:
            self._over = True

    def _watch(self) -> None:
        while not self._over:
            word = self._wire.word(_LOOK)
            if word == "on":
                self._on.set()
            elif word in _STOPS:
                with self._lock:
                    if not self._over:
                        interrupt(self._first)
                return

    @property
    def watches(self) -> bool:
        """Somebody does."""
        return True

    def do(self, request: str, needed: bool = True) -> None:
        """Ask, and wait."""
        self._ask(f"{request}.")

    def try_again(self, error: DeviceError) -> bool:
        """Say what is wrong, and wait."""
        self._ask(f"{error} Put it right, then go on.")
        return True

    def paused(self, pressed: Callable[[], bool]) -> None:
        """Until the page or the plotter's button says to go on."""
        self._ask("The plot pauses, its pen lifted.", pressed)

    def _ask(self, question: str, answered: Callable[[], bool] = lambda: False) -> None:
        self._wire.live({"question": question})
        while (word := self._word(_LOOK)) != "on" and not answered():
            if word in _STOPS:
                raise KeyboardInterrupt(_STOPS[word])
        self._wire.live({})

    @contextlib.contextmanager
    def plotting(self) -> Iterator[Callable[[float, float], None] | None]:
        """How far it is, and what the page wants meanwhile."""
        yield self._progress

    def _progress(self, share: float, left: float) -> None:
        word = self._word()
        if word in _STOPS:
            raise KeyboardInterrupt(_STOPS[word])
        if word == "pause":
            raise ButtonPressed
        if (now := time.monotonic()) - self._told >= _OFTEN or share >= 1.0:
            self._told = now
            self._wire.progress(share, f"drawing, {left / 60:.0f} min left" if left > 90 else "drawing")

    def tell_place(self, job: PlotJob) -> Callable[[int, DrawnPlace], None]:
        """Tells the page where the pen is."""

        drawings = dict[int, Drawing]()  # of the part that is drawn

        def tell(number: int, place: DrawnPlace) -> None:
            nonlocal job
            if number >= len(job.parts):  # its pages are made while it is drawn
                job = find_job(job.name)
            if time.monotonic() - self._told >= _OFTEN:
                if number not in drawings:
                    drawings.clear()
                    drawings[number] = job.drawing(number)
                self._wire.live({"place": _place(job, number, place, drawings[number])})

        return tell

    def say(self, *sentences: str) -> None:
        """The page hears it."""
        self._wire.say(*sentences)

    note = say

    def progress(self, share: float, stage: str) -> None:
        """The page hears it, too."""
        if (word := self._word()) in _STOPS:
            raise KeyboardInterrupt(_STOPS[word])
        if word == "pause":
            self._ask("It waits: nothing more is begun until you continue.")
        self._wire.progress(share, stage)


def machines() -> Facts:
    """What can be chosen: ports, plotters with their beds, print queues and printers.

    The simulated plotter comes first, then ports of USB: a page begins with the first, so no machine unasked.
    """
    listed, ports = list_devices(), serial_devices()
    plotters = [(device, profiles.find(device.name, "plotter")) for device in listed if device.kind == "plotter"]
    return {
        "ports": [
            *({"name": name, "title": title} for name, title in SIMULATED.items()),
            *({"name": port.name, "title": port.title} for port in sorted(ports, key=lambda port: not port.usb)),
        ],
        "plotters": [
            {
                "name": device.name,
                "title": device.title,
                "bed": [float(plotter.bed.width), float(plotter.bed.height)],
                "away": 1 if plotter.bed.y == "up" else -1,  # which way along y is away from who stands there
            }
            for device, plotter in plotters
            if isinstance(plotter, Plotter)
        ],
        "queues": list(queues()),
        "printers": [{"name": device.name, "title": device.title} for device in listed if device.kind == "printer"],
    }


def who_answers(port: str) -> Facts:
    """The machine that answers at a port, as `devices.probe` tells it; nothing moves.

    Raises InputError, DeviceSilent: there is no such port; nobody answers.
    """
    known_port(port)
    return dict(probe(port))


def move_pen(
    port: str, device: str | None, move: pen_setup.Move, x: float, y: float, *, listener: Listener = SILENT
) -> Facts:
    """The pen up or down, to its zero, or so far along the machine's axes, mm; or the motors off."""
    known_port(port)
    return pen_setup.move_pen(move, port, device, x, y, listener=listener).facts()


def known_port(port: str) -> None:
    """Refuse a port that is not there: an address that is typed could lead anywhere."""
    if port not in SIMULATED and port not in {found.name for found in serial_devices()}:
        raise InputError(f"There is no port {port} here any more: is the plotter plugged in and switched on?")


def keep_plot(
    text: str, letter: bool, request: PlotRequest, pictures: Path | None = None, *, listener: Listener = SILENT
) -> Facts:
    """Keep a plot of what was sent (`inputs.sent_source`), which has not begun; how it lies on the bed."""
    listener.progress(0.0, "writing")
    job, notes = plotting.keep(replace(request, source=sent_source(text, letter, pictures)))
    listener.note(*notes)
    return {**show_plot(job.name), "notes": list(notes)}


def plots(*, listener: Listener = SILENT) -> Facts:
    """The plots that are kept, the newest first."""
    return {"plots": list_jobs(listener)[::-1]}


def show_plot(name: str) -> Facts:
    """A plot: how far it has come, what happens when it goes on, how its sheet lies on the bed."""
    job = find_job(name)
    standing, profile = job.standing(), job.profile
    over = standing.finished or standing.part >= len(job.parts)
    facts: Facts = {
        **state_of(job),
        "outlook": "" if standing.finished else outlook(job, "It"),
        "bed": [float(profile.bed.width), float(profile.bed.height)],
        "pages": job.pages,
        "copies": job.options.copies,
        "place": None if over else _place(job, standing.part, standing.place, job.drawing(standing.part)),
        "pens": _pens(job, len(job.parts) if standing.finished else standing.part),
    }
    if not standing.finished:
        page = job.drawing(min(standing.part, len(job.parts) - 1)).page
        turn, shift, zero = _seen(page, profile)
        turned = bed.place(page, profile).turned
        lies = {"turned": turned, "quarters": bed.TOPS.index(turned), "zero": zero.tolist()}
        matrix = [round(value, 4) for value in (*turn.T.ravel().tolist(), *shift.tolist())]  # a, b, c, d, e, f of SVG
        facts |= {"page": [page.width, page.height], "lies": {"matrix": matrix, **lies}}
    return facts


def _pens(job: PlotJob, reached: int) -> list[Facts]:
    """The layers in the order in which they are drawn, those that are left out last: each with its `PenTurn`, its ink,
    mm, about how long that takes, s (0 once it is drawn), and whether all of it is drawn."""
    pens, turns, whole = list[Facts](), job.options.turns, job.ink / max(sum(part.ink for part in job.parts), 1e-9)
    for layer in in_turn(job.layers, turns):
        turn, numbers = turn_of(layer, turns), [n for n, part in enumerate(job.parts) if part.layer == layer]
        ink, drawn = whole * sum(job.parts[number].ink for number in numbers), max(numbers, default=reached) < reached
        each = 0.0 if drawn or turn.out else _plan_millimetre(job.name, job.begun, numbers[0], turn.speed)
        more = {"ink_mm": round(ink, 1), "seconds": round(ink * each), "drawn": drawn, "next": reached in numbers}
        pens.append({**structs.asdict(turn), **more})
    return pens


@functools.lru_cache(256)
def _plan_millimetre(name: str, begun: str, number: int, pace: float) -> float:
    """The s that a millimetre of ink takes on a part of a plot, with all travel."""
    job = find_job(name)
    planned = plan(job.drawing(number), job.profile, speed=job.options.speed, pace=pace)
    return planned.duration / max(planned.pen_down, 1e-9)


def _list_drawn_layers(job: PlotJob) -> list[str]:
    turns = job.options.turns
    return [layer for layer in in_turn(job.layers, turns) if not turn_of(layer, turns).out]


def turn_pens(name: str, turns: tuple[PenTurn, ...]) -> Facts:
    """Say what draws each layer of a plot, how fast and in which order, and tell the plot as `show_plot` does.

    Raises InputError: there is no such layer; nothing would be left to draw; some is drawn, after which the pens keep
    their order and none is left out.
    """
    job = find_job(name)
    if unknown := {turn.layer for turn in turns}.difference(job.layers):
        raise InputError(f"This plot has no layer {unknown.pop()!r}.")
    after = replace(job, options=structs.replace(job.options, turns=turns))
    if not job.standing().runs:
        surveys = [survey(pages.read_drawing(job.folder, page), job.options.layers) for page in range(job.pages)]
        shares = [1.0] * job.pages if job.whole else [page.share for page in pages.records(job.folder)]
        told = [*job.told, *[{}] * job.pages][: job.pages]
        after = after.with_pages([Record(*page) for page in zip(surveys, shares, told, strict=True)])
        if not after.parts:
            raise InputError("Something has to be drawn: leave one of the pens in.")
    elif _list_drawn_layers(job) != _list_drawn_layers(after):
        raise InputError("Some of this plot is drawn: its pens keep their order, and all of them draw.")
    after.write()
    return show_plot(name)


def lay_sheet(name: str, quarters: Literal[0, 1, 2, 3], x: float, y: float) -> Facts:
    """Lay the sheets of a plot that has not begun otherwise on the bed, and tell it as `show_plot` does.

    quarters : turned to the left; x, y : where the upper left corner is then, as it is seen, mm from that of the bed.

    Raises InputError: some of it is drawn. DoesNotFit: strokes would lie outside the bed.
    """
    job = find_job(name)
    if job.standing().runs:
        raise InputError("Some of this plot is drawn: its sheet stays where it lies.")
    page, profile = job.drawing(0).page, structs.replace(job.profile, laid=LaidSheet(quarters))
    turn, shift, _ = _seen(page, profile)
    usual = shift + np.minimum(turn @ (page.width, page.height), 0.0)
    right, down = [Length(value) for value in (np.array([x, y]) - usual).tolist()]
    laid = LaidSheet(quarters, right, down if profile.bed.y == "down" else Length(-down))
    job = replace(job, profile=structs.replace(profile, laid=laid))
    for drawing in map(job.drawing, range(len(job.parts))):
        placed = bed.place(drawing.page, job.profile)
        for stroke in drawing.strokes:
            bed.check(placed.to_machine(stroke.xy), job.profile, "another place for the sheet")
    job.write()
    return show_plot(name)


def _seen(page: Page, profile: Plotter) -> tuple[Array, Array, Array]:
    """How a page lies on the bed as it is seen: turn (2, 2) and shift (2,), and (2,) the machine's zero; mm from the
    bed's upper left, y towards the reader."""
    placed, (least, greatest) = bed.place(page, profile), bed.reach(profile)
    down = profile.bed.y == "down"
    flip = np.diag([1.0, 1.0 if down else -1.0])
    corner = np.array([-least[0], -least[1] if down else greatest[1]])
    return flip @ placed.turn, flip @ placed.shift + corner, corner


def _place(job: PlotJob, number: int, place: DrawnPlace, drawing: Drawing) -> Facts:
    """A place on a part, whose drawing is given, as one on its page: all before `stroke`, in the order of drawing, is
    drawn, and of that what takes `time`, s."""
    part = job.parts[number]
    before = [each.stop - each.first for each in job.parts[:number] if (each.page, each.copy) == (part.page, part.copy)]
    begins = drawing.strokes[min(place.stroke, len(drawing.strokes) - 1)].t[0]
    reached = None if np.isinf(place.time) else round(place.time - float(begins), 3)
    return {"page": part.page, "copy": part.copy, "stroke": sum(before) + place.stroke, "time": reached}


def plot_page(name: str, page: int) -> str:
    """A page of a plot as it is drawn, SVG, its strokes one after the other on one clock; InputError where there is
    none, or it was drawn and is let go."""
    job = find_job(name)
    numbers = [number for number, part in enumerate(job.parts) if part.page == page and not part.copy]
    if not numbers:
        raise InputError(f"The job {name} has no page {page + 1}.")
    whole, clock, strokes = pages.read_drawing(job.folder, page), 0.0, list[Stroke]()
    for stroke in [stroke for n in numbers for stroke in whole.strokes[job.parts[n].first : job.parts[n].stop]]:
        strokes.append(replace(stroke, t=stroke.t - stroke.t[0] + clock))
        clock = float(strokes[-1].t[-1]) + 0.1
    return to_svg(replace(whole, strokes=tuple(strokes)), pen_width=float(job.profile.pen.width)).decode()


def draw_plot(name: str, port: str, at_zero: bool, home_after: bool, *, listener: PageWire) -> Facts:
    """Draw a plot that is kept, or what is left of it, until it is finished or the page stops it.

    Raises InputError, DeviceError: the message says how to go on.
    """
    known_port(port)
    job, page = find_job(name), AtPage(listener)
    attendance = AttendanceOptions(at_zero, home_after, reached=page.tell_place(job))
    try:
        facts = plotting.resume(name, port, attendance, attendant=page).facts()
    except KeyboardInterrupt:
        return {**show_plot(name), "ended": False}
    except HandoutError as error:  # a page has a button for what the command is told to type
        said, typed, _ = str(error).partition(plotting.how_to_go_on(job) or "\n")
        raise type(error)(f"{said}The plot is kept, and can be gone on with." if typed else said) from error
    return {**facts, "ended": True}
