"""The pages of a text that is plotted: made from what its job keeps of it, now or after anything.

Every page is a function of the text, the hand, the options and the program.  As a program of its own, `python -m
handout.pipeline.job_pages FOLDER`, this adds to a job the pages that it lacks; see `plotting.jobs.pages.PageProducer`.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import os
import signal
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import FrameType
from typing import Any

from handout.errors import HandoutError, InputError
from handout.hand.library import path
from handout.pipeline.declarations import list_declared
from handout.pipeline.options import SheetOptions, WritingOptions
from handout.pipeline.results import Tally
from handout.pipeline.texts import STROKES, TextDocument, WritingTask, draw, prepare, program, title
from handout.pipeline.writing import Document
from handout.plotting import fit_to_bed
from handout.plotting.jobs import pages, store
from handout.plotting.jobs.pages import NewPage, ProducerProcess
from handout.plotting.jobs.store import PlotJob, load
from handout.profiles import Plotter
from handout.values import Drawing, Manuscript
from handout.writing.layout import Ruling

# the fields of WritingOptions that a job keeps under their own names; the seed is always known
_WRITING = tuple(each.name for each, declaration in list_declared(WritingOptions) if declaration.of_strokes)


def inputs(
    text: str, task: WritingTask, writing: WritingOptions, sheet: SheetOptions, page_name: str
) -> dict[str, Any]:
    """All that decides how the pages of a text look, as a job keeps it; `page_name` : the page that is written on."""
    name = str(writing.hand)
    file = path(name)
    hand = str(file.resolve()) if Path(name) == file else name
    options: dict[str, Any] = {option: getattr(writing, option) for option in _WRITING}
    options |= {"page_name": page_name, "margin": sheet.margin, "pages": sheet.pages}
    options |= {"seed": task.seed, "hand": hand}
    # the whole path of a file that was named by its path
    named = {name: getattr(writing, name) for name in ("pose", "style", "prime")}
    options |= {name: str(Path(it).resolve()) if it and Path(it).suffix else it for name, it in named.items()}
    if task.paper is not None:  # as it was measured: the picture of a sheet may be gone
        rules = None if task.layout.ruling is None else task.layout.ruling.rules
        layout = {"margin": task.layout.margin, "x_height": task.layout.x_height, "rules": rules}
        options["lined"] = {**layout, "line_spacing": task.layout.line_spacing}
    return {"program": program(), "text": text, "options": options, "digest": _digest(file, **named)}


def _digest(hand: Path, pose: str | None = None, style: str | None = None, prime: str | None = None) -> str:
    """A digest of the files that a text is written with: its hand, pose, style and primer."""
    files = [hand]
    # what reads poses and styles takes a third of the time in which a plot without them begins
    if pose is not None:
        from handout.pipeline.poses import pose_path

        files.append(pose_path(pose))
    if style is not None:
        from handout.motion.styles.style import path as style_path

        files.append(style_path(style))
    if prime is not None and Path(prime).suffix:  # none of the style's own examples
        files.append(Path(prime))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


def make_pages(document: Document, profile: Plotter, fit: bool, shares: Sequence[float] = ()) -> Iterator[NewPage]:
    """The pages of a document behind those that are kept; of a text each is made when it is asked for.

    fit : shrink what is larger than the machine's bed.
    shares : of the pages that are kept, the shares of the text that they end with.

    Raises InputError, MissingCharacters, DoesNotFit: the text cannot be written; or not with the pages that are kept.
    """
    for number, (manuscript, drawing, share) in enumerate(_draw_each_page(document, shares), 1):
        drawing = fit_to_bed(drawing, profile) if fit else drawing
        tally = Tally.from_pages([manuscript], [drawing])
        if len(shares) + number > 1:
            tally = dataclasses.replace(tally, borrowed=[])  # which is told of once for all pages
        yield NewPage(drawing, share, dataclasses.asdict(tally))


def _draw_each_page(document: Document, shares: Sequence[float]) -> Iterator[tuple[Manuscript, Drawing, float]]:
    """Draw each page behind those that are kept; with it the share of the document that ends there."""
    if not isinstance(document, TextDocument):
        pages = document.draw(STROKES)
        for number, (manuscript, drawing) in enumerate(zip(pages.manuscripts, pages.drawings, strict=True), 1):
            yield manuscript, drawing, number / len(pages.drawings)
        return
    about = {"title": title(document.text)}
    task, sheets = document.set_pages()
    for number, sheet in enumerate(sheets, 1):
        at = max((placed.at for line in sheet.manuscript.lines for placed in line.placed), default=0)
        share = 1.0 if sheet.last else min(at / max(len(document.text), 1), 0.999)  # of the text, as far as this page
        if number <= len(shares):
            if share != shares[number - 1]:
                raise InputError(f"Page {number} of the job does not end where it would end now: plot the text anew.")
            continue
        drawing = draw(sheet.manuscript, task, sheet.rng, {**about, "page_number": number}, STROKES)
        yield sheet.manuscript, drawing, share


@contextlib.contextmanager
def producer(job: PlotJob) -> Iterator[ProducerProcess | None]:
    """A block with a program beside it that makes the pages that a job lacks; None if it lacks none."""
    if job.whole:
        yield None
        return
    process = ProducerProcess([sys.executable, "-m", "handout.pipeline.job_pages", str(job.folder)])
    try:
        yield process
    finally:
        process.close()


def complete(folder: Path) -> Iterator[int]:
    """Add to a job what it lacks; the number of every page when it is there.

    Raises InputError: the hand or the program are others now, or the folder cannot be written.
    Raises DoesNotFit: a page has strokes outside the bed.
    """
    job = load(folder)
    if job.whole:
        return
    assert job.inputs is not None
    shares = [record.share for record in pages.records(folder)]
    if job.share < 1.0:
        task = _reopen_task(job.inputs, job.pages)
        document = TextDocument(job.inputs["text"], task)
        rest = make_pages(document, job.profile, job.inputs["options"]["fit"], shares)
        for number, page in enumerate(rest, len(shares)):
            store.add(job, number, page)
            yield number + 1
    store.complete(job)


def _reopen_task(inputs: Mapping[str, Any], pages: int) -> WritingTask:
    """Prepare the task of a job again, to write the pages that it lacks; refuse another program or hand."""
    options = inputs["options"]
    lacking = f"The pages behind page {pages} were not made yet"
    if inputs["program"] != program():
        raise InputError(
            f"{lacking}, and {inputs['program']} began them, which would write them differently from {program()}: go "
            "on with that, or plot the rest of the text anew."
        )
    try:
        named = {name: options.get(name) for name in ("pose", "style", "prime")}
        same = _digest(path(options["hand"]), **named) == inputs["digest"]
    except (OSError, InputError) as error:
        raise InputError(
            f"{lacking}, and the hand {options['hand']} is gone: put it back, or plot the rest of the text anew."
        ) from error
    if not same:
        raise InputError(
            f"{lacking}, and the hand {options['hand']} has changed: put the old one back, or plot the rest of the "
            "text anew."
        )
    named |= {name: options.get(name) for name in _WRITING} | {"rewritten": options.get("rewritten", ())}
    writing = WritingOptions(hand=options["hand"], seed=options["seed"], **named)
    task = prepare(writing, SheetOptions(options["page_name"], options["margin"], options["pages"]))
    if "lined" not in options:
        return task
    lined = options["lined"]  # the sheet that the first pages were written on
    top, right, bottom, left = lined["margin"]
    rules = lined["rules"]
    ruling = None if rules is None else Ruling(tuple((height, slope) for height, slope in rules))
    size = {"x_height": lined["x_height"], "line_spacing": lined["line_spacing"]}
    layout = dataclasses.replace(task.layout, margin=(top, right, bottom, left), ruling=ruling, **size)
    return dataclasses.replace(task, layout=layout)


def main() -> None:
    """Complete the job in the folder that is named."""
    with contextlib.suppress(AttributeError):
        os.nice(10)  # the program that plots comes first
    for name in ("SIGTERM", "SIGHUP"):
        if (number := getattr(signal, name, None)) is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _stop)
    try:
        for number in complete(Path(sys.argv[1])):
            print(f"added {number}", flush=True)
    except BrokenPipeError:  # nobody plots any more
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left unsaid stays so
    except HandoutError as error:
        print(f"failed {error}", flush=True)
        sys.exit(error.exit_code)


def _stop(number: int, _frame: FrameType | None) -> None:
    """The program that plots needs no more pages: unwind, so that no page is left half-written."""
    sys.exit(128 + number)


if __name__ == "__main__":
    main()
