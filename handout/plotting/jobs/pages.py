"""The pages of a job on the disk: for each its drawing, and beside it a record that can be read without the drawing.

``page-3.json.gz`` is a drawing in the form of `sinks.drawing_json`; ``page-3.json``, written after it, is its `Record`:
a page is there when that is.  Each file is there whole or not at all, whenever the power goes.

Missing pages are made in a process of its own (`ProducerProcess`), which runs ahead of the pen.  It adds to the job's
folder what is lacking and prints a line for every page; when the program that plots has gone, and nobody reads these
lines, it stops at the next page.  What it has made is on the disk, so that neither of them holds more than a page.
"""

from __future__ import annotations

import dataclasses
import gzip
import itertools
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import msgspec
import numpy as np

import handout
from handout import atomic
from handout.errors import InputError
from handout.plotting import bed
from handout.plotting.jobs.parts import Layers, PageLayer, arrange_layers, survey, without
from handout.plotting.planning.hooking import part_strokes
from handout.plotting.planning.order import shorten_travel
from handout.plotting.planning.plan import Order
from handout.profiles import PenTurn, Plotter
from handout.sinks.drawing_json import to_json
from handout.sources.drawing_json import from_json
from handout.values import Drawing, Stroke

_CHANGE = 1.0  # s on the clock of a page between two layers


class NewPage(NamedTuple):
    """A page on its way into a job.

    share : how much of the text is on it and those before it, 0 to 1; 1 on the last page alone.
    told : facts that are kept for whoever asks at the end.
    """

    drawing: Drawing
    share: float = 1.0
    told: dict[str, Any] = {}  # noqa: RUF012 - never written to


class Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The record of a stored page; `share` and `told` as in `NewPage`."""

    layers: tuple[PageLayer, ...]
    share: float
    told: dict[str, Any]


def keep(
    page: NewPage,
    folder: Path,
    number: int,
    profile: Plotter,
    layers: Layers,
    order: Order,
    turns: Sequence[PenTurn] = (),
) -> Record:
    """Write the drawing of page `number`, from 0, with its strokes in the order in which they are to be drawn.

    Raises DoesNotFit: it has strokes outside the bed.
    """
    if page.drawing.strokes:
        placed = bed.place(page.drawing.page, profile)
        for stroke in page.drawing.strokes:
            bed.check(placed.to_machine(stroke.xy), profile)
    drawing = laid_out(page.drawing, profile, layers, order, turns)
    atomic.write(_drawing(folder, number), gzip.compress(to_json(drawing), 1))
    drawn, told = without(drawing, layers, turns), page.told
    if told and (order == "travel" or drawn is not drawing):
        told = {**told, "pen_up": drawn.pen_up, "duration": drawn.duration}
        told |= {} if drawn is drawing else {"strokes": len(drawn.strokes), "pen_down": drawn.pen_down}
    return Record(survey(drawing, layers), page.share, told)


def laid_out(
    drawing: Drawing, profile: Plotter, layers: Layers, order: Order, turns: Sequence[PenTurn] = ()
) -> Drawing:
    """The drawing with its strokes as a job draws them: layer after layer, each by itself, and none with more ink than
    the pen has between two dips."""
    drawing = part_strokes(arrange_layers(drawing, layers, turns), profile.hooks.dip_every)
    if order == "writing" or not drawing.strokes:
        return drawing
    home = bed.place(drawing.page, profile).to_page(np.zeros((1, 2)))[0]
    clock, strokes = 0.0, list[Stroke]()
    for layer in survey(drawing, layers):
        run = shorten_travel(dataclasses.replace(drawing, strokes=drawing.strokes[layer.first : layer.ends[-1]]), home)
        later = max(clock - float(run[0].t[0]), 0.0) + (_CHANGE if strokes else 0.0)
        strokes += [dataclasses.replace(stroke, t=stroke.t + later) for stroke in run] if later else run
        clock = float(run[-1].t[-1]) + later
    return dataclasses.replace(drawing, strokes=tuple(strokes))


def enter(record: Record, folder: Path, number: int) -> None:
    """Write the record of a page whose drawing is written; from now on the page exists."""
    atomic.write(_record(folder, number), msgspec.json.encode(record))


def records(folder: Path) -> list[Record]:
    """The records of the pages that exist, from the first on. Raises OSError, msgspec.MsgspecError: one is damaged."""
    entries = []
    for number in itertools.count():
        try:
            entries.append(msgspec.json.decode(_record(folder, number).read_bytes(), type=Record))
        except FileNotFoundError:
            return entries
    raise AssertionError


def read_drawing(folder: Path, number: int) -> Drawing:
    """The drawing of a page. Raises InputError: it is missing or damaged."""
    path = _drawing(folder, number)
    try:
        return from_json(gzip.decompress(path.read_bytes()))
    except (OSError, EOFError, InputError) as error:
        raise InputError(f"{path} is missing or damaged.") from error


def are_kept(folder: Path) -> bool:
    """Whether the drawings of a job are there."""
    return _drawing(folder, 0).exists()


def drop(folder: Path) -> None:
    """Delete all pages, and what an interrupted write left."""
    tidy(folder)
    for path in folder.glob("page-*.json*"):
        path.unlink(missing_ok=True)


def tidy(folder: Path) -> None:
    """Delete what an interrupted write left."""
    for path in folder.glob(".*"):
        path.unlink(missing_ok=True)


def _drawing(folder: Path, number: int) -> Path:
    return folder / f"page-{number + 1}.json.gz"


def _record(folder: Path, number: int) -> Path:
    return folder / f"page-{number + 1}.json"


ADDED, FAILED = "added", "failed"  # what its lines begin with


class PageProducer(Protocol):
    """Makes the pages that a job lacks, in order."""

    def wait(self) -> None:
        """Return when one more page may exist, or all do; InputError if the next cannot be made."""

    def trouble(self) -> str:
        """Why a page will be missing, as soon as that is known; else ""."""


class ProducerProcess:
    """A program that makes the pages of a job.

    command : what is run; it says ``added 7`` when page 7 is there, ``failed`` and one sentence if one cannot be made,
        and ends when there is nothing more to make.
    """

    def __init__(self, command: Sequence[str]) -> None:
        self._failed, self._ended = "", False
        path = os.pathsep.join(filter(None, [str(Path(handout.__file__).parents[1]), os.environ.get("PYTHONPATH")]))
        try:
            # of a session of its own: Ctrl-C is for the program that plots
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                text=True,
                encoding="utf-8",
                env={**os.environ, "PYTHONPATH": path},
                start_new_session=True,
            )
        except OSError as error:
            raise InputError(f"{command[0]} cannot be started to make the other pages: {error.strerror}.") from error

    def wait(self) -> None:
        """Wait until the process has printed another line, or has ended."""
        assert self._process.stdout is not None
        self._hear(self._process.stdout.readline())
        if self._failed:
            raise InputError(self._failed)

    def trouble(self) -> str:
        """Why the process ended early."""
        if not self._failed and self._process.poll():
            assert self._process.stdout is not None
            for line in [*self._process.stdout, ""]:
                self._hear(line)
        return self._failed

    def _hear(self, line: str) -> None:
        word, _, rest = line.strip().partition(" ")
        if word == FAILED:
            self._failed = rest
        elif word != ADDED:
            if (self._process.wait() or self._ended) and not self._failed:
                code = self._process.returncode
                self._failed = f"The other pages cannot be made: the program for that ended with {code}."
            self._ended = True

    def close(self) -> None:
        """End the process; the page under way is made again next time."""
        self._process.terminate()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
