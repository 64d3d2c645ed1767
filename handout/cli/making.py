"""The pages of a text that is plotted: made from what its job keeps of it, now or after anything.

Every page is a function of the text, the hand, the options and the program.  As a program of its own, `python -m
handout.cli.making FOLDER`, this adds to a job what it lacks; see `plotting.jobs.supply`.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handout import __version__
from handout.cli import ending, jobs, results
from handout.errors import HandoutError, InputError

if TYPE_CHECKING:
    from handout.plotting.jobs.job import Job
    from handout.plotting.jobs.page_producer import Program
    from handout.plotting.jobs.pages import Made
    from handout.profiles import Plotter
    from handout.values import Manuscript
    from handout.writing.sheets import Sheet

# the options on which the pages depend; the seed is always known
_OPTIONS = (
    *("haste", "x_height", "line_spacing", "align", "kinematics", "speed", "jitter", "fit", "fallback", "slips"),
    *("page_name", "margin", "pages"),
)


def inputs(text: str, given: Mapping[str, Any], job: jobs.Setup) -> dict[str, Any]:
    """All that the pages of a text are made from, as a job keeps it."""
    from handout.hand.library import path

    name = given["hand"]
    file = path(name)
    hand = str(file.resolve()) if Path(name) == file else name
    options = {option: given[option] for option in _OPTIONS} | {"seed": job.seed, "hand": hand}
    if (ruling := job.layout.ruling) is not None:  # as it was measured: the picture of a sheet may be gone
        layout = {"margin": job.layout.margin, "x_height": job.layout.x_height, "rules": ruling.rules}
        options["lined"] = {**layout, "line_spacing": job.layout.line_spacing}
    return {"program": _program(), "text": text, "options": options, "digest": _digest(file)}


def _program() -> str:
    """What decides about every stroke besides what is asked for."""
    import numpy as np

    return f"handout {__version__} with numpy {np.__version__}"


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def made(text: str, job: jobs.Setup, profile: Plotter, fit: bool, kept: list[float]) -> Iterator[Made]:
    """The pages of a text behind those that are kept, each made when it is asked for.

    Parameters
    ----------
    fit : shrink what is larger than the machine's bed.
    kept : of the pages that are kept, the shares of the text that they end with.

    Raises
    ------
    InputError, MissingCharacters, DoesNotFit
        The text cannot be written; or not with the pages that are kept.
    """
    from handout.plotting import fit_to_bed
    from handout.plotting.jobs.pages import Made

    about = {"title": jobs.title(text)}
    job, sheets = jobs.sheets(text, job)
    for number, sheet in enumerate(sheets, 1):
        share = _share(sheet, text)
        if number <= len(kept):
            if share != kept[number - 1]:
                raise InputError(f"Page {number} of the job does not end where it would end now: plot the text anew.")
            continue
        drawing = jobs.traced(sheet.manuscript, job, sheet.rng, {**about, "page_number": number}, jobs.STROKES)
        tally = results.Tally()
        tally.add([sheet.manuscript], [drawing])
        if number > 1:
            tally.borrowed = []  # which is told of once for all pages
        drawing = dataclasses.replace(drawing, about={**drawing.about, "words": words(sheet.manuscript)})
        yield Made(fit_to_bed(drawing, profile) if fit else drawing, share, dataclasses.asdict(tally))


def _share(sheet: Sheet, text: str) -> float:
    """How much of a text is on a page and those before it."""
    at = max((placed.at for line in sheet.manuscript.lines for placed in line.placed), default=0)
    return 1.0 if sheet.last else min(at / max(len(text), 1), 0.999)


def words(page: Manuscript) -> list[str]:
    """The words of a page, so that one can say where a plot broke off."""
    found: dict[int, str] = {}
    for placed in (placed for line in page.lines for placed in line.placed):
        found[placed.word] = found.get(placed.word, "") + placed.glyph.letter
    return [found.get(number, "") for number in range(max(found, default=-1) + 1)]


@contextlib.contextmanager
def supply(job: Job) -> Iterator[Program | None]:
    """A program that makes the pages that a job lacks, as long as it is plotted."""
    from handout.plotting.jobs.page_producer import Program

    if job.whole:
        yield None
        return
    program = Program([sys.executable, "-m", __name__, str(job.folder)])
    try:
        yield program
    finally:
        program.close()


def complete(folder: Path) -> Iterator[int]:
    """Add to a job what it lacks; the number of every page when it is there.

    Raises
    ------
    InputError
        The hand or the program are others now, or the folder cannot be written.
    DoesNotFit
        A page has strokes outside the bed.
    """
    from handout.plotting.jobs import pages, store
    from handout.plotting.jobs.job import load

    job = load(folder)
    if job.whole:
        return
    assert job.inputs is not None
    kept = [record.share for record in pages.records(folder)]
    if job.share < 1.0:
        setup = _again(job.inputs, job.pages)
        rest = made(job.inputs["text"], setup, job.profile, job.inputs["options"]["fit"], kept)
        for number, page in enumerate(rest, len(kept)):
            store.add(job, number, page)
            yield number + 1
    store.complete(job)


def _again(inputs: Mapping[str, Any], pages: int) -> jobs.Setup:
    """The setup of a job whose pages behind the first few are lacking."""
    from handout.hand.library import path

    options = inputs["options"]
    lacking = f"The pages behind page {pages} were not made yet"
    if inputs["program"] != _program():
        raise InputError(
            f"{lacking}, and {inputs['program']} began them, which would write them differently from {_program()}: go "
            "on with that, or plot the rest of the text anew."
        )
    try:
        same = _digest(path(options["hand"])) == inputs["digest"]
    except (OSError, InputError) as error:
        raise InputError(
            f"{lacking}, and the hand {options['hand']} is gone: put it back, or plot the rest of the text anew."
        ) from error
    if not same:
        raise InputError(
            f"{lacking}, and the hand {options['hand']} has changed: put the old one back, or plot the rest of the "
            "text anew."
        )
    setup = jobs.setup(options, options["page_name"], options["margin"], options["pages"])
    return _on_rules(setup, options["lined"]) if "lined" in options else setup


def _on_rules(setup: jobs.Setup, kept: Mapping[str, Any]) -> jobs.Setup:
    """A setup with the lined paper that the first pages were written on."""
    from handout.writing.baseline_model import Ruling

    top, right, bottom, left = kept["margin"]
    ruling = Ruling(tuple((height, slope) for height, slope in kept["rules"]))
    size = {"x_height": kept["x_height"], "line_spacing": kept["line_spacing"]}
    layout = dataclasses.replace(setup.layout, margin=(top, right, bottom, left), ruling=ruling, **size)
    return dataclasses.replace(setup, layout=layout)


def main() -> None:
    """Complete the job in the folder that is named."""
    with contextlib.suppress(AttributeError):
        os.nice(10)  # the program that plots comes first
    try:
        with ending.orderly():
            for number in complete(Path(sys.argv[1])):
                print(f"added {number}", flush=True)
    except ending.Stopped as stop:  # the program that plots needs no more pages
        sys.exit(stop.code)
    except BrokenPipeError:  # nobody plots any more
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left unsaid stays so
    except HandoutError as error:
        print(f"failed {error}", flush=True)
        sys.exit(error.exit_code)


if __name__ == "__main__":
    main()
