"""The verb `write`: a text or a letter to files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from handout.inking.pen import is_brush
from handout.pipeline import programs
from handout.pipeline.documents import open_document
from handout.pipeline.inputs import Source, sent_source
from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions
from handout.pipeline.results import SILENT, Facts, Listener, Result, Tally
from handout.pipeline.texts import INK, STROKES, TextDocument, WritingTask, not_followed, prepare, style_notes
from handout.progress import within
from handout.sinks import OF_INK, check_outputs, losses, write_drawings
from handout.values import Drawing

_WRITTEN = 0.35  # of the work on a page, when its strokes are known and it is yet to be drawn; measured, for PNG


@dataclass(frozen=True)
class Written(Result):
    """What `write` made: see `Tally` for the figures.

    files : in the order of the outputs, pages in order.
    paper : what is known of the lined paper that was written on.
    words : where each word is, if that was asked for; see `word_places`.
    """

    tally: Tally
    seed: int
    hand: str
    files: tuple[Path, ...]
    paper: Facts | None = None
    words: tuple[Facts, ...] = ()

    def facts(self) -> Facts:
        return {
            **self.tally.facts(self.seed, self.hand, self.files),
            **({"words": self.words} if self.words else {}),
            **({"notes": list(self.notes)} if self.notes else {}),
            **({"paper": self.paper} if self.paper else {}),
        }


def write(
    source: str | Source,
    outputs: Sequence[str | Path],
    writing: WritingOptions = WritingOptions(),
    sheet: SheetOptions = SheetOptions(),
    picture: PictureOptions = PictureOptions(),
    *,
    device: str | None = None,
    places: bool = False,
    listener: Listener = SILENT,
) -> Written:
    """Write a text or a letter to files.

    Parameters
    ----------
    source : a text, or what `inputs.written_source` read.
    outputs : names of files, whose suffixes say the format: .svg .png .pdf .eps .dxf .inkml .json .gcode …
    device : the plotter that .gcode, .hpgl and .ebb files are for; None: a common one that reads such files.
    places : whether the result tells where each word is.

    Raises
    ------
    InputError, MissingCharacters, DoesNotFit
        An option is wrong, the hand lacks letters, or the text is larger than its pages (of a letter file the message
        has the line); nothing is written then.
    """
    paths = [Path(name) for name in outputs]
    machines = programs.Programs(device, paths)
    check_outputs(paths, extra := machines.sinks)
    document = open_document(Source(source) if isinstance(source, str) else source, writing, sheet, picture)
    task, wanted = document.task, wanted_in(paths)
    pages = document.draw(wanted, tell=within(listener.progress, 0.0, _WRITTEN))
    drawn = pages.drawings
    files = write_drawings(drawn, paths, task.look, extra=extra, tell=within(listener.progress, _WRITTEN, 1.0))
    notes = (*document.notes, *not_followed(task, wanted >= INK), *_unshown(task, drawn, paths))
    notes = (*notes, *style_notes(task, drawn), *losses(paths, drawn))
    even = machines.pressed_evenly() if task.pose.pose is not None else []
    result = written(pages.tally, task, files, (*notes, *even, *task.given_notes))
    return replace(result, words=tuple(pages.words())) if places else result


def write_sent(
    text: str,
    letter: bool,
    outputs: Sequence[str | Path],
    options: tuple[WritingOptions, SheetOptions, PictureOptions],
    *,
    device: str | None = None,
    pictures: Path | None = None,
    listener: Listener = SILENT,
) -> Written:
    """The same for what was sent from elsewhere, see `inputs.sent_source`, with where each word is."""
    source = sent_source(text, letter, pictures)
    return write(source, outputs, *options, device=device, places=True, listener=listener)


def drawings(
    text: str, writing: WritingOptions = WritingOptions(), sheet: SheetOptions = SheetOptions()
) -> Sequence[Drawing]:
    """The pages of a text as timed strokes, for programs that go on with them."""
    return TextDocument(text, prepare(writing, sheet)).draw(STROKES).drawings


def wanted_in(paths: Sequence[Path]) -> frozenset[str]:
    """What files of these names show of a scanned hand: its ink, its strokes, or both."""
    return frozenset[str]().union(*(INK if path.suffix.lower() in OF_INK else STROKES for path in paths))


def written(tally: Tally, task: WritingTask, files: Sequence[Path], notes: tuple[str, ...] = ()) -> Written:
    """The result of a task."""
    paper = dict(task.paper.facts) if task.paper is not None and task.paper.facts else None
    return Written(tally, task.seed, task.hand.name, tuple(files), paper, notes=notes)


def _unshown(task: WritingTask, drawings: Sequence[Drawing], paths: Sequence[Path]) -> list[str]:
    """Notes on files that show no brush, or leave room for pictures and show none."""
    lines = sorted({path.suffix for path in paths if path.suffix.lower() in (".svg", ".pdf")})
    others = sorted({path.suffix for path in paths if path.suffix.lower() != ".png"})
    notes = []
    if task.picture.pen is not None and is_brush(task.picture.pen) and lines:
        shown = "show the brush as a plain line; PNG files and prints are painted"
        notes.append(f"--pen: {' and '.join(lines)} files {shown}.")
    if others and any(drawing.beneath is not None for drawing in drawings):
        left = "leave the pictures and the background out, which PNG files show"
        notes.append(f"{' and '.join(others)} files {left}.")
    return notes
