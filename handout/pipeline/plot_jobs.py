"""The plots that are kept: how far each has come, and what happens when one is gone on with."""

from __future__ import annotations

from handout.errors import InputError
from handout.pipeline.results import SILENT, Listener, Told
from handout.plotting.dialects import dialect
from handout.plotting.jobs import store
from handout.plotting.jobs.journal import JobProgress
from handout.plotting.jobs.parts import name_layer
from handout.plotting.jobs.places import take_drawn
from handout.plotting.jobs.runner import doubt
from handout.plotting.jobs.store import PlotJob

find_job = store.find  # the plot of a name, or the one that was drawn last, of all or the unfinished ones


def state_of(job: PlotJob) -> Told:
    """A plot that is kept, and how far it has come, as ``--json`` prints it; InputError if its journal cannot be read.

    sheets : of all copies, as far as they are written; all_written : whether all are; layers : that have names; part,
    parts : which is under way or comes next, from 1, of how many; stopped : why it ended the last time; runs : when
    programs took it up; drawn_mm, pen_down_mm : of ink on paper, and in all; doubt : what a damaged journal leaves
    open, in a sentence.
    """
    standing = job.standing()
    return {
        "job": job.name,
        "title": job.title,
        "begun": job.begun,
        "device": job.profile.name,
        "port": job.port,
        "sheets": job.pages * job.options.copies,
        "all_written": job.whole,
        "layers": [layer for layer in job.layers if layer],
        "parts": len(job.parts),
        "part": standing.part + (0 if standing.finished else 1),
        "finished": standing.finished,
        "stopped": standing.stopped,
        "runs": list(standing.runs),
        "drawn_mm": round(job.ink if standing.finished else _measure_drawn(job, standing), 1),
        "pen_down_mm": round(job.ink, 1),
        "doubt": doubt(job),
    }


def list_jobs(listener: Listener = SILENT) -> list[Told]:
    """The states of all jobs that are kept, the oldest first; the listener hears of those that cannot be read."""
    states = []
    for job in store.list_kept_jobs():
        try:
            states.append(state_of(job))
        except InputError as error:
            listener.say(f"handout: {error}")
    return states


def forget_job(name: str) -> str:
    """Delete a job, finished or not; InputError if it is being plotted.  What it was called."""
    job = store.find(name)
    store.forget(job)
    return name_job(job)


def outlook(job: PlotJob, called: str = "") -> str:
    """What will happen when a job is gone on with; it is called so, or by its name and title."""
    return f"{called or f'{name_job(job)}:'} {_outlook(job)} {doubt(job)}".rstrip()


def _outlook(job: PlotJob) -> str:
    standing = job.standing()
    drawn_m = _measure_drawn(job, standing) / 1000
    if standing.part >= len(job.parts):
        return f"goes on with what is written next; {drawn_m:.2f} m are drawn."
    if not standing.begun:
        return f"goes on with {_part(job, standing)}."
    strokes = job.drawing(standing.part).strokes
    words = job.drawing(standing.part).about.get("words") or []
    at = min(standing.place.stroke, len(strokes) - 1)
    number = strokes[at].word
    word = f', in the word "{words[number]}"' if 0 <= number < len(words) and words[number] else ""
    held = dialect(job.profile.dialect).in_hand
    more = f", or what the plotter draws in {held:g} s," if held else ""
    return (
        f"goes on with {_part(job, standing)}, at stroke {at + 1} of {len(strokes)}{word}; "
        f"{drawn_m:.2f} of {'' if job.whole else 'about '}{job.ink / 1000:.2f} m are drawn, of "
        f"which at most {job.options.overlap:g} mm{more} are drawn again."
    )


def name_job(job: PlotJob) -> str:
    """A job as it is called in a sentence."""
    return f"{job.name} ({job.title})" if job.title else job.name


def _part(job: PlotJob, standing: JobProgress) -> str:
    part = job.parts[standing.part]
    sheets = f" of {job.pages * job.options.copies}" if job.whole else ""
    layer = f", {name_layer(part.layer)}" if len(job.layers) > 1 else ""
    return f"sheet {part.copy * job.pages + part.page + 1}{sheets}{layer}"


def _measure_drawn(job: PlotJob, standing: JobProgress) -> float:
    """mm of ink that are certainly on paper."""
    whole = sum(part.ink for part in job.parts[: standing.part])
    if not standing.begun or standing.part >= len(job.parts):
        return whole
    return whole + take_drawn(job.drawing(standing.part), standing.place).pen_down
