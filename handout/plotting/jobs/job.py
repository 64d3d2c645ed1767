"""A stored plot: its facts, how it is drawn, and which of its pages exist.

``job.json`` in a job's folder is written when the job begins, and once more when all of its pages are made.  Until then
it holds what the pages are made from (`PlotJob.inputs`), and the parts are those of the pages that exist.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import msgspec

from handout import atomic
from handout.errors import InputError
from handout.plotting.driving.overlap import OVERLAP
from handout.plotting.jobs import journal, pages
from handout.plotting.jobs.journal import JobProgress, PlotJournal
from handout.plotting.jobs.pages import Record
from handout.plotting.jobs.parts import Layers, PlotPart, parts
from handout.plotting.planning.plan import Order
from handout.profiles import Plotter
from handout.values import Drawing

FACTS, JOURNAL = "job.json", "journal"


class JobOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How a job is drawn.

    speed, order : as `planning.plan` takes them.
    overlap : mm of ink at most that may be drawn twice after an interruption.
    copies : of all pages; layers : what makes a layer; pause_every : mm of ink after which a pen is looked at.
    """

    speed: float | Literal["fast"] = 1.0
    order: Order = "writing"
    overlap: float = OVERLAP
    copies: int = 1
    layers: Layers = "none"
    pause_every: float | None = None


class _Facts(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The content of ``job.json``."""

    format: Literal["handout-plot"] = "handout-plot"
    version: Literal[1] = 1
    title: str
    begun: str
    port: str
    pages: int
    layers: tuple[str, ...]
    options: JobOptions
    parts: tuple[PlotPart, ...]
    device: dict[str, Any]
    told: tuple[dict[str, Any], ...] = ()
    inputs: dict[str, Any] | None = None


@dataclass(frozen=True)
class PlotJob:
    """A stored plot.

    folder : named like the job.
    title : the beginning of its text; begun : when, ISO 8601; port : where to.
    profile : the machine, as its file said when the job began.
    pages : of one copy; layers : names of all layers; parts : in order; told : facts of every page, as they were given.
    inputs : what the missing pages are made from; None if none is missing.  While some are, the fields above describe
        the pages that exist, and their first copy.
    share : of the text, on the pages that exist, 0 to 1.
    """

    folder: Path
    title: str
    begun: str
    port: str
    profile: Plotter
    pages: int
    layers: tuple[str, ...]
    options: JobOptions
    parts: tuple[PlotPart, ...]
    told: tuple[dict[str, Any], ...] = ()
    inputs: dict[str, Any] | None = None
    share: float = 1.0

    @property
    def name(self) -> str:
        """The job's name."""
        return self.folder.name

    @property
    def whole(self) -> bool:
        """Whether all of its pages are made."""
        return self.inputs is None

    @property
    def ink(self) -> float:
        """mm that all parts draw; an estimate while the job is not `whole`."""
        length = sum(part.ink for part in self.parts)
        return length if self.whole else length * self.options.copies / max(self.share, 1e-9)

    def standing(self) -> JobProgress:
        """How far it has come."""
        return journal.read_progress(self.folder / JOURNAL)

    def open(self) -> PlotJournal:
        """Its journal, locked against other programs."""
        return PlotJournal(self.folder / JOURNAL)

    def drawing(self, number: int) -> Drawing:
        """What a part draws, read from the disk."""
        part = self.parts[number]
        try:
            page = pages.read_drawing(self.folder, part.page)
        except InputError as error:
            raise InputError(f"The job {self.name} cannot be gone on with: {error}") from error
        return dataclasses.replace(page, strokes=page.strokes[part.first : part.stop])

    def drop_drawings(self) -> None:
        """Delete its drawings: all of them are on paper, and have been for a while."""
        pages.drop(self.folder)

    def with_pages(self, records: list[Record]) -> PlotJob:
        """The job with these pages, and if it is `whole` with all copies of them."""
        layers = [record.layers for record in records]
        return dataclasses.replace(
            self,
            pages=len(records),
            layers=tuple(dict.fromkeys(layer.name for page in layers for layer in page)),
            parts=tuple(parts(layers, self.options.copies if self.whole else 1, self.options.pause_every)),
            told=tuple(record.told for record in records),
            share=1.0 if self.whole else records[-1].share if records else 0.0,
        )

    def write(self) -> None:
        """Write ``job.json``."""
        facts = _Facts(
            title=self.title,
            begun=self.begun,
            port=self.port,
            pages=self.pages,
            layers=self.layers,
            options=self.options,
            parts=self.parts if self.whole else (),
            device=msgspec.to_builtins(self.profile, enc_hook=float),  # mm, s, mm/s: what its quantities are inside
            told=self.told if self.whole else (),
            inputs=self.inputs,
        )
        atomic.write(self.folder / FACTS, msgspec.json.encode(facts))


def load(path: Path) -> PlotJob:
    """A job from its folder.

    Raises
    ------
    InputError
        It is not there, or cannot be read.
    """
    try:
        facts = msgspec.json.decode((path / FACTS).read_bytes(), type=_Facts)
        profile = msgspec.convert(facts.device, Plotter, dec_hook=lambda kind, value: kind(value))
        named = {name: getattr(facts, name) for name in ("title", "begun", "port", "pages", "layers", "parts", "told")}
        job = PlotJob(folder=path, profile=profile, options=facts.options, inputs=facts.inputs, **named)
        return job if job.whole else job.with_pages(pages.records(path))
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"The job {path.name} cannot be read ({path / FACTS}: {reason}).") from error
