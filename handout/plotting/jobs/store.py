"""Stores jobs: a folder for each in the user's state folder, under a name that is easy to type.

A job's folder holds ``job.json`` (see `job`), a drawing for every page (see `pages`), and the ``journal``.  The
drawings are kept as they are to be drawn, so that what is left of a job can be drawn by another version of the program,
or when the hand has changed.  Those of the last five finished jobs stay, so that a part can be drawn again; the rest
of a finished job is deleted after fifty more.

A long text need not be written before its first page is drawn: a job can be begun with that page and what the others
are made from, which are added as they are made.
"""

from __future__ import annotations

import contextlib
import dataclasses
import errno
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

from handout import atomic, shipped
from handout.errors import InputError
from handout.plotting.jobs import pages
from handout.plotting.jobs.job import JOURNAL, JobOptions, PlotJob, load
from handout.plotting.jobs.pages import NewPage
from handout.profiles import Plotter
from handout.values import Drawing

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

    Parameters
    ----------
    new_pages : its first pages.
    inputs : what the missing pages can be made from at any time; None if none is missing.
    """
    base = place or folder()
    with _new_folder(base) as work:
        begun = datetime.now().isoformat(timespec="seconds")
        job = PlotJob(work, title, begun, port, profile, 0, (), options, (), inputs=inputs)
        records = []
        for number, page in enumerate(new_pages):
            records.append(pages.keep(page, work, number, profile, options.layers, options.order))
            if not job.whole:
                pages.enter(records[-1], work, number)
        job = job.with_pages(records)
        if job.whole and not job.parts:
            raise InputError("There are no strokes: there is nothing to plot.")
        job.write()
        atomic.write(work / JOURNAL, b"")
        prune(base)
        return dataclasses.replace(job, folder=free_name(work, base))


def add(job: PlotJob, number: int, page: NewPage) -> None:
    """Add a page to a job that is not whole; page 0 is the first.

    Raises
    ------
    InputError
        The folder cannot be written.
    DoesNotFit
        The page has strokes outside the bed.
    """
    record = pages.keep(page, job.folder, number, job.profile, job.options.layers, job.options.order)
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

    Raises
    ------
    InputError
        There is none; the message lists those there are.
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
    """As `find`, of the jobs whose drawings are still kept.

    Raises
    ------
    InputError
        There is none.
    """
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
    """Delete a job, finished or not.

    Raises
    ------
    InputError
        It is being plotted.
    """
    job.open().close()
    shutil.rmtree(job.folder, ignore_errors=True)
