"""A plotter's pen: the test sheet that shows what to set, its heights found or tried, and the pen moved by hand."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from handout import profiles
from handout.errors import InputError
from handout.inking.pen import usual
from handout.page_sizes import page as page_of
from handout.pipeline.options import Length, millimetres, seed_of
from handout.pipeline.plot_request import HeightOptions
from handout.pipeline.plotting import AtPlotter, machine, plot_drawings, usual_device
from handout.pipeline.programs import Programs
from handout.pipeline.results import SILENT, Attendant, Delivery, Facts, Listener, Result
from handout.plotting import driver, open_port, pen_heights, plan, setup_sheet
from handout.plotting.dialects import Controller
from handout.plotting.pen_heights import Heights
from handout.sinks import Look, check_outputs, write_drawings

_NO_PORT = "Where is the plotter? Give --port /dev/ttyUSB0 (or COM3, auto, or sim:)."


@dataclass(frozen=True)
class PenMove(Result):
    """What was done with a pen, in words, and where the machine stands then, mm; None if it does not know."""

    device: str
    title: str
    done: str
    position: tuple[float, float] | None

    def facts(self) -> Facts:
        return {"device": self.device, "done": self.done, "position": self.position and list(self.position)}


def test_sheet(
    port: str | None,
    device: str | None = None,
    *,
    page: str | None = None,
    seed: int = 1,
    outputs: Sequence[str | Path] = (),
    attendant: Attendant = SILENT,
) -> tuple[Delivery, list[str]]:
    """Draw the sheet that shows what to set of a plotter, on paper at a port, or in files; how to read it, in lines."""
    profile = machine(device, port)
    size = page_of(page) if page else setup_sheet.usual_page(profile)
    drawing = setup_sheet.test_sheet(profile, size, np.random.default_rng(seed_of(seed)))
    how_to_read = setup_sheet.how_to_read(profile)
    if outputs:
        paths = [Path(name) for name in outputs]
        programs = Programs(profile.name or None, paths)
        check_outputs(paths, programs.sinks)
        look = Look(usual("plain", float(profile.pen.width)))
        files = write_drawings([drawing], paths, look, extra=programs.sinks)
        planned = round(plan(drawing, profile).duration, 2)
        told = {"files": [*map(str, files)], "device": profile.name, "planned_s": planned}
        return Delivery(files=tuple(files), told=told), how_to_read
    if port is None:
        raise InputError(_NO_PORT)
    plotted = plot_drawings([drawing], profile, port, "test sheet", attendant)
    (report,) = plotted.reports
    times = {"planned_s": round(report.announced_s, 2), "executed_s": round(report.executed_s, 2)}
    return Delivery(told={"device": profile.name, **times, "job": plotted.job.name}), how_to_read


def find_heights(
    port: str | None, device: str | None, options: HeightOptions, attendant: Attendant = SILENT
) -> Delivery:
    """Find how high a pen is lifted and how low it is let down with a person who looks, or try two heights.

    The keys of a profile's group ``[pen]`` that were found or tried are told, and the file that has them now.

    Raises InputError: there is nothing to set, or the options contradict each other; nothing has moved then.
    """
    if port is None:
        raise InputError(_NO_PORT)
    profile = machine(device, port)
    pen_heights.check(profile)
    if (options.up is None) != (options.down is None):
        raise InputError("--up and --down are tried together: give both, or neither to be asked.")
    if options.again and options.save is None:
        raise InputError("--again replaces a profile that is saved: give it with --save NAME.")
    source = profiles.locate(device or usual_device(port), "plotter")
    path = None if options.save is None else pen_heights.find_copy(options.save, options.again)
    trial = None if options.up is None or options.down is None else Heights(options.up, options.down)
    if trial is not None:
        pen_heights.check_copy(source, pen_heights.list_changes(trial, profile))
    with contextlib.closing(open_port(port, profile)) as opened:
        controller = driver.connect(opened, profile, attendant.say)
        bench = pen_heights.begin(controller, opened, AtPlotter(attendant, port), attendant.say)
        if trial is None:
            heights = pen_heights.find(bench)
        else:
            heights = trial
            pen_heights.draw_trial(bench, trial)
    keys = pen_heights.list_changes(heights, profile)
    if path is not None:
        pen_heights.save_copy(source, path, keys)
    told = {**keys, "file": None if path is None else str(path)}
    return Delivery(files=() if path is None else (path,), told=told)


Move = Literal["up", "down", "home", "jog", "release"]
# what is done with a pen, and what does it; jog has a distance, too
_MOVES: dict[str, tuple[str, Callable[[Controller], None]]] = {
    "up": ("the pen is up", lambda controller: controller.pen(False)),
    "down": ("the pen is down", lambda controller: controller.pen(True)),
    "home": ("the pen is above its zero", pen_heights.home),
    "release": ("its motors are off", lambda controller: controller.release()),
}


def move_pen(
    how: Move,
    port: str | None,
    device: str | None = None,
    x: Length = 0.0,
    y: Length = 0.0,
    *,
    listener: Listener = SILENT,
) -> PenMove:
    """Lift the pen, lower it onto the paper, where it stays, or go to the machine's zero; travel so far along its axes;
    or take the power from the motors: the machine forgets where it is."""
    move: Callable[[Controller], None]
    if how == "jog":
        dx, dy = millimetres(x, "jog x"), millimetres(y, "jog y")
        done, move = f"moved by {dx:g}, {dy:g} mm", partial(pen_heights.jog, dx=dx, dy=dy)
    else:
        done, move = _MOVES[how]
    if port is None:
        raise InputError(_NO_PORT)
    profile = machine(device, port)
    with contextlib.closing(open_port(port, profile)) as opened:
        place = pen_heights.move_and_locate(driver.connect(opened, profile, listener.say), move)
    position = None if place is None or how == "release" else (round(place[0], 3), round(place[1], 3))
    return PenMove(profile.name, profile.title, done, position)
