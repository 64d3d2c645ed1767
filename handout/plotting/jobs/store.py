"""Where jobs are kept: a folder for each, in the user's state folder, under a name that is easy to type.

A job's folder holds ``job.json`` (what it is, written once), a drawing for every page (``page-1.json.gz``, in the form
of `sinks.drawing_json`), and the ``journal``.  The drawings are kept as they are to be drawn, so that what is left of a
job can be drawn by another version of the program, or when the hand has changed; when the job is finished they are
deleted, and after fifty more finished jobs the rest of it is.
"""

from __future__ import annotations

import contextlib
import dataclasses
import errno
import gzip
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

import msgspec
import platformdirs

from handout.errors import InputError
from handout.plotting import bed
from handout.plotting.driver import OVERLAP
from handout.plotting.jobs import journal, parts
from handout.plotting.jobs.journal import Journal, Standing
from handout.plotting.jobs.parts import Layer, Layers, Part
from handout.plotting.order import by_travel
from handout.plotting.planned import Order
from handout.profiles import Plotter
from handout.sinks.drawing_json import from_json, to_json
from handout.values import Drawing

_KEPT = 50  # finished jobs
_FACTS, _JOURNAL, _NEW = "job.json", "journal", ".new-"
_MONTHS = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"]


class Options(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
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
    options: Options
    parts: tuple[Part, ...]
    device: dict[str, Any]


@dataclass(frozen=True)
class Job:
    """A plot that is kept.

    folder : its name is the job's.
    title : the beginning of its text; begun : when, ISO 8601; port : where to.
    profile : the machine, as its file said when the job began.
    pages : of one copy; layers : names of all layers; parts : in order.
    """

    folder: Path
    title: str
    begun: str
    port: str
    profile: Plotter
    pages: int
    layers: tuple[str, ...]
    options: Options
    parts: tuple[Part, ...]

    @property
    def name(self) -> str:
        """What the job is called."""
        return self.folder.name

    @property
    def ink(self) -> float:
        """mm that all of its parts draw."""
        return sum(part.ink for part in self.parts)

    def standing(self) -> Standing:
        """How far it has come."""
        return journal.read(self.folder / _JOURNAL)[0]

    def open(self) -> Journal:
        """Its journal, held against other programs."""
        return Journal(self.folder / _JOURNAL)

    def drawing(self, number: int) -> Drawing:
        """What a part draws, read from the disk."""
        part = self.parts[number]
        path = _page(self.folder, part.page)
        try:
            page = from_json(gzip.decompress(path.read_bytes()))
        except (OSError, EOFError, InputError) as error:
            raise InputError(f"The job {self.name} cannot be gone on with: {path} is missing or damaged.") from error
        return dataclasses.replace(page, strokes=page.strokes[part.first : part.stop])

    def drop_drawings(self) -> None:
        """Delete its drawings: all of them are on paper."""
        for path in self.folder.glob("page-*.json.gz"):
            path.unlink(missing_ok=True)


def folder() -> Path:
    """Where jobs are kept; it need not exist."""
    return Path(platformdirs.user_state_dir("handout", appauthor=False)) / "plots"


def create(
    drawings: Iterable[Drawing],
    profile: Plotter,
    options: Options,
    *,
    title: str = "",
    port: str = "",
    place: Path | None = None,
) -> Job:
    """A new job; all of it is on the disk when this returns, and nothing if it fails.

    Parameters
    ----------
    drawings : the pages; each is let go before the next is asked for.
    place : the folder in which jobs are kept, if it is another.

    Raises
    ------
    InputError
        Nothing to draw, or the folder cannot be written.
    DoesNotFit
        A page has strokes outside the bed.
    """
    base = place or folder()
    with _new_folder(base) as work:
        pages = [_keep(drawing, _page(work, n), profile, options) for n, drawing in enumerate(drawings)]
        if not any(pages):
            raise InputError("There are no strokes: there is nothing to plot.")
        job = Job(
            folder=work,
            title=title,
            begun=datetime.now().isoformat(timespec="seconds"),
            port=port,
            profile=profile,
            pages=len(pages),
            layers=tuple(dict.fromkeys(layer.name for page in pages for layer in page)),
            options=options,
            parts=tuple(parts.parts(pages, options.copies, options.pause_every)),
        )
        _write(work / _FACTS, _facts(job))
        _write(work / _JOURNAL, b"")
        prune(base)
        return _named(job, base)


@contextlib.contextmanager
def _new_folder(base: Path) -> Iterator[Path]:
    """A folder for a job that is being made; it goes if that fails."""
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


def _keep(drawing: Drawing, path: Path, profile: Plotter, options: Options) -> tuple[Layer, ...]:
    """Write a page as it is to be drawn; its layers."""
    if drawing.strokes:
        placed = bed.place(drawing.page, profile)
        for stroke in drawing.strokes:
            bed.check(placed.to_machine(stroke.xy), profile)
    drawing = parts.arranged(drawing, options.layers)
    found = parts.survey(drawing, options.layers)
    if options.order == "travel":
        strokes = [by_travel(drawing.strokes[layer.first : layer.ends[-1]]) for layer in found]
        drawing = dataclasses.replace(drawing, strokes=tuple(stroke for layer in strokes for stroke in layer))
        found = parts.survey(drawing, options.layers)
    _write(path, gzip.compress(to_json(drawing), 1))
    return found


def _facts(job: Job) -> bytes:
    facts = _Facts(
        title=job.title,
        begun=job.begun,
        port=job.port,
        pages=job.pages,
        layers=job.layers,
        options=job.options,
        parts=job.parts,
        device=msgspec.to_builtins(job.profile, enc_hook=float),  # mm, s, mm/s: what its quantities are inside
    )
    return msgspec.json.encode(facts)


def _write(path: Path, data: bytes) -> None:
    """A file that survives a power cut."""
    with path.open("wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())


def _page(folder: Path, number: int) -> Path:
    return folder / f"page-{number + 1}.json.gz"


def _named(job: Job, base: Path) -> Job:
    """Give the job's folder its name, such as ``mar01-2``: the first of that day that is free."""
    now = datetime.now()
    day = f"{_MONTHS[now.month - 1]}{now.day:02}"
    for number in range(1, 100_000):
        target = base / f"{day}-{number}"
        if not target.exists():
            try:
                job.folder.rename(target)
            except OSError as error:
                if error.errno in (errno.EEXIST, errno.ENOTEMPTY):  # another program was quicker
                    continue
                raise
            _sync_folder(base)
            return dataclasses.replace(job, folder=target)
    raise InputError(f"{base} is full of jobs: delete some.")


def _sync_folder(path: Path) -> None:
    # the name is in the folder above; systems that cannot open folders have no need of it
    with contextlib.suppress(OSError):
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def load(path: Path) -> Job:
    """A job from its folder.

    Raises
    ------
    InputError
        Its facts are missing or damaged, or by another version of the program that this one cannot read.
    """
    try:
        facts = msgspec.json.decode((path / _FACTS).read_bytes(), type=_Facts)
        profile = msgspec.convert(facts.device, Plotter, dec_hook=lambda kind, value: kind(value))
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"The job {path.name} cannot be read ({path / _FACTS}: {reason}).") from error
    return Job(
        path, facts.title, facts.begun, facts.port, profile, facts.pages, facts.layers, facts.options, facts.parts
    )


def find(name: str | None = None, place: Path | None = None) -> Job:
    """The job of that name, or the one that was begun last of those that are not finished.

    Raises
    ------
    InputError
        There is none; the message lists those there are.
    """
    jobs = every(place)
    if name is None:
        for job in reversed(jobs):
            if not job.standing().finished:
                return job
        raise InputError("There is nothing to resume: no plot was broken off.")
    found = next((job for job in jobs if job.name == name), None)
    if found is not None:
        return found
    names = ", ".join(job.name for job in jobs[-5:])
    known = f"the last ones are {names} (see: handout plot jobs)" if names else "none is kept"
    raise InputError(f"There is no job {name!r}; {known}.")


def every(place: Path | None = None) -> list[Job]:
    """All jobs that can be read, the oldest first."""
    base, found = place or folder(), []
    for path in base.iterdir() if base.is_dir() else []:
        if not path.name.startswith("."):
            with contextlib.suppress(InputError):
                found.append(load(path))
    return sorted(found, key=lambda job: (job.begun, len(job.name), job.name))


def prune(place: Path | None = None, keep: int = _KEPT) -> None:
    """Delete all but the newest finished jobs; what is not finished stays."""
    for job in [job for job in every(place) if _is_finished(job)][: -keep or None]:
        shutil.rmtree(job.folder, ignore_errors=True)


def _is_finished(job: Job) -> bool:
    try:
        return job.standing().finished
    except InputError:  # a damaged journal may be mended
        return False


def forget(job: Job) -> None:
    """Delete a job, finished or not.

    Raises
    ------
    InputError
        It is being plotted.
    """
    job.open().close()
    shutil.rmtree(job.folder, ignore_errors=True)
