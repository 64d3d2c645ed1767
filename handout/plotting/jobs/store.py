"""A stored plot and where it is kept: a folder in the user's state folder, under a name that is easy to type.

A job's folder holds ``job.json``, a drawing for every page (see `pages`), and the ``journal``. The drawings are kept
as they are to be drawn, so that what is left of a job can be drawn by another version of the program, or when the hand
has changed. Those of the last five finished jobs stay, so that a part can be drawn again; the rest of a finished job
is deleted after fifty more.

A long text need not be written before its first page is drawn: a job can be begun with that page and what the others
are made from (`PlotJob.inputs`), which are added as they are made. ``job.json`` is written when the job begins, and
once more when all of its pages are made; until then its parts are those of the pages that exist.
"""

from __future__ import annotations

import contextlib
import dataclasses
import errno
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

import msgspec

from handout import atomic, shipped
from handout.errors import InputError
from handout.plotting.jobs import journal, pages
from handout.plotting.jobs.journal import JobProgress, PlotJournal
from handout.plotting.jobs.pages import NewPage, Record
from handout.plotting.jobs.parts import Layers, PlotPart, parts
from handout.plotting.overlap import OVERLAP
from handout.plotting.planning.plan import Order
from handout.profiles import PenTurn, Plotter
from handout.values import Drawing

FACTS, JOURNAL = "job.json", "journal"


class JobOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How a job is drawn.

    speed, order : as `planning.plan` takes them.
    overlap : mm of ink at most that may be drawn twice after an interruption.
    copies : of all pages; layers : what makes a layer; turns : what draws them, in which order.
    pause_every : mm of ink after which a pen is looked at.
    """

    speed: float | Literal["fast"] = 1.0
    order: Order = "writing"
    overlap: float = OVERLAP
    copies: int = 1
    layers: Layers = "none"
    turns: tuple[PenTurn, ...] = ()
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
        layers, copies = [record.layers for record in records], self.options.copies if self.whole else 1
        return dataclasses.replace(
            self,
            pages=len(records),
            layers=tuple(dict.fromkeys(layer.name for page in layers for layer in page)),
            parts=tuple(parts(layers, copies, self.options.pause_every, self.options.turns)),
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
    """A job from its folder. Raises InputError: it is not there, or cannot be read."""
    try:
        facts = msgspec.json.decode((path / FACTS).read_bytes(), type=_Facts)
        profile = msgspec.convert(facts.device, Plotter, dec_hook=lambda kind, value: kind(value))
        named = {name: getattr(facts, name) for name in ("title", "begun", "port", "pages", "layers", "parts", "told")}
        job = PlotJob(folder=path, profile=profile, options=facts.options, inputs=facts.inputs, **named)
        return job if job.whole else job.with_pages(pages.records(path))
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"The job {path.name} cannot be read ({path / FACTS}: {reason}).") from error


LAST = "last"  # in place of a job's name
_KEPT = 50  # finished jobs
_DRAWABLE = 5  # of them, whose drawings are kept too: some MB at most
_NEW = ".new-"
_MONTHS = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"]


def folder() -> Path:
    """Where jobs are kept; it need not exist."""
    return shipped.own_folder("state") / "plots"


def create(
    drawings: Iterable[Drawing],
    profile: Plotter,
    options: JobOptions,
    *,
    title: str = "",
    port: str = "",
    place: Path | None = None,
) -> PlotJob:
    """Store a new job: all of it is on the disk when this returns, nothing if it fails.

    drawings : the pages; each is let go before the next is asked for.
    place : the folder in which jobs are kept, if it is another.

    Raises InputError: nothing to draw, or the folder cannot be written. DoesNotFit: a page has strokes outside the bed.
    """
    return begin(
        (NewPage(drawing) for drawing in drawings), profile, options, None, title=title, port=port, place=place
    )


def begin(
    new_pages: Iterable[NewPage],
    profile: Plotter,
    options: JobOptions,
    inputs: dict[str, Any] | None,
    *,
    title: str = "",
    port: str = "",
    place: Path | None = None,
) -> PlotJob:
    """Store a new job with its first pages, or all; they are on the disk when this returns.

    new_pages : its first pages.
    inputs : what the missing pages can be made from at any time; None if none is missing.
    """
    base = place or folder()
    with _new_folder(base) as work:
        begun = datetime.now().isoformat(timespec="seconds")
        job = PlotJob(work, title, begun, port, profile, 0, (), options, (), inputs=inputs)
        records = []
        for number, page in enumerate(new_pages):
            records.append(pages.keep(page, work, number, profile, options.layers, options.order, options.turns))
            if not job.whole:
                pages.enter(records[-1], work, number)
        job = job.with_pages(records)
        if job.whole and not job.parts:
            left_out = "All layers are left out" if job.layers else "There are no strokes"
            raise InputError(f"{left_out}: there is nothing to plot.")
        job.write()
        atomic.write(work / JOURNAL, b"")
        prune(base)
        return dataclasses.replace(job, folder=free_name(work, base))


def add(job: PlotJob, number: int, page: NewPage) -> None:
    """Add a page to a job that is not whole; page 0 is the first.

    Raises InputError: the folder cannot be written. DoesNotFit: the page has strokes outside the bed.
    """
    options = job.options
    record = pages.keep(page, job.folder, number, job.profile, options.layers, options.order, options.turns)
    pages.enter(record, job.folder, number)  # after the drawing is on the disk: it never outlives that


def complete(job: PlotJob) -> None:
    """Complete a job whose pages are all made: drop what they were made from."""
    records = pages.records(job.folder)
    dataclasses.replace(job, inputs=None).with_pages(records).write()


@contextlib.contextmanager
def _new_folder(base: Path) -> Iterator[Path]:
    """A folder for a new job, deleted if making it fails."""
    work: Path | None = None
    try:
        base.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(dir=base, prefix=_NEW))
        yield work
    except BaseException as error:
        if work is not None:
            shutil.rmtree(work, ignore_errors=True)
        if isinstance(error, OSError):
            raise InputError(f"Cannot keep the job in {base}: {error.strerror or error}.") from error
        raise


def free_name(work: Path, base: Path) -> Path:
    """Rename a folder to the first free name of the day, such as ``mar01-2``; returns its new path."""
    now = datetime.now()
    day = f"{_MONTHS[now.month - 1]}{now.day:02}"
    for number in range(1, 100_000):
        target = base / f"{day}-{number}"
        if not target.exists():
            try:
                atomic.move_folder(work, target)
            except OSError as error:
                if error.errno in (errno.EEXIST, errno.ENOTEMPTY):  # another program was quicker
                    continue
                raise
            return target
    raise InputError(f"{base} is full of jobs: delete some.")


def find(name: str | None = None, place: Path | None = None, *, unfinished: bool = False) -> PlotJob:
    """The job of that name; "" or "last" is the job that was drawn last, of all or of the unfinished.

    Raises InputError: there is none; the message lists those there are.
    """
    if name in (None, LAST):
        for job in reversed(_by_use(place)):
            if not (unfinished and job.standing().finished):
                return job
        raise InputError("There is nothing to resume: no plot was broken off." if unfinished else "No plot is kept.")
    jobs = list_kept_jobs(place)
    match = next((job for job in jobs if job.name == name), None)
    if match is not None:
        return match
    names = ", ".join(job.name for job in jobs[-5:])
    hint = f"the last ones are {names} (see: handout plot jobs)" if names else "none is kept"
    raise InputError(f"There is no job {name!r}; {hint}.")


def list_kept_jobs(place: Path | None = None) -> list[PlotJob]:
    """All jobs that can be read, the oldest first."""
    base, jobs = place or folder(), []
    for path in base.iterdir() if base.is_dir() else []:
        if not path.name.startswith("."):
            with contextlib.suppress(InputError):
                jobs.append(load(path))
    return sorted(jobs, key=lambda job: (job.begun, len(job.name), job.name))


def prune(place: Path | None = None, keep: int = _KEPT) -> None:
    """Delete all but the newest finished jobs; what is not finished stays."""
    for job in [job for job in list_kept_jobs(place) if _is_finished(job)][: -keep or None]:
        shutil.rmtree(job.folder, ignore_errors=True)


def drop_drawings(place: Path | None = None, keep: int = _DRAWABLE) -> None:
    """Delete the drawings of all finished jobs but those that were drawn last."""
    finished = [job for job in _by_use(place) if _is_finished(job)]
    for job in finished:
        pages.tidy(job.folder)
    for job in finished[: -keep or None]:
        job.drop_drawings()


def drawn_before(name: str | None = None, place: Path | None = None) -> PlotJob:
    """As `find`, of the jobs whose drawings are still kept. Raises InputError: there is none."""
    there = [job for job in _by_use(place) if pages.are_kept(job.folder)]
    if name in (None, LAST) and there:
        return there[-1]
    job = find(name, place) if name not in (None, LAST) else None
    if job is None or not pages.are_kept(job.folder):
        which = f"The drawings of {job.name} are" if job is not None else "No drawings are"
        kept = f" Those of {', '.join(other.name for other in there)} are." if there else ""
        raise InputError(f"{which} not kept any more: only those of the last {_DRAWABLE} finished plots are.{kept}")
    return job


def _by_use(place: Path | None) -> list[PlotJob]:
    """All jobs, the last drawn at the end, without those that another program deletes meanwhile."""
    used = []
    for job in list_kept_jobs(place):
        with contextlib.suppress(OSError):
            used.append(((job.folder / JOURNAL).stat().st_mtime, job))
    return [job for _, job in sorted(used, key=lambda each: each[0])]


def _is_finished(job: PlotJob) -> bool:
    try:
        standing = job.standing()
        return standing.finished and not standing.damaged
    except InputError:  # a journal that cannot be read now may be later
        return False


def forget(job: PlotJob) -> None:
    """Delete a job, finished or not. Raises InputError: it is being plotted."""
    job.open().close()
    shutil.rmtree(job.folder, ignore_errors=True)
