"""What is written (a text, a letter file, a drawing) as one kind of thing, and what makes files: `write`, `export`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Protocol

from handout.inking.pen import is_brush
from handout.pipeline import programs
from handout.pipeline.inputs import Source, sent_source
from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions
from handout.pipeline.plot_request import ExportOptions
from handout.pipeline.results import SILENT, Delivery, Fact, Facts, Listener, Tally
from handout.pipeline.texts import INK, STROKES, Pages, TextDocument, WritingTask, not_followed, prepare, style_notes
from handout.progress import Tell, narrow_reports, silent
from handout.sinks import OF_INK, check_outputs, losses, write_drawings
from handout.values import Drawing, Manuscript

_WRITTEN = 0.35  # of the work on a page, when its strokes are known and it is yet to be drawn; measured, for PNG


class Document(Protocol):
    """A source with its options, checked."""

    @property
    def name(self) -> str:
        """What it is called: the name of its file, or the beginning of its text."""

    @property
    def task(self) -> WritingTask:
        """How it is written; of a letter file by its own hand."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user is told of it: what of the source is not written."""

    @property
    def inks(self) -> tuple[str, ...]:
        """The inks that it names besides its own."""

    @property
    def timed(self) -> bool:
        """Whether the times of its strokes mean anything."""

    def draw(self, wanted: frozenset[str] = INK, row: int | None = None, tell: Tell = silent) -> Pages:
        """Its pages; see `TextDocument.draw`."""

    def check(self, row: int | None = None) -> None:
        """Raise as `draw` would, without drawing."""


@dataclass(frozen=True)
class DrawingDocument:
    """A drawing, which is taken as it is; `manuscript` : the writing in it, if any of its texts were written."""

    name: str
    drawing: Drawing
    task: WritingTask
    manuscript: Manuscript | None = None
    notes: tuple[str, ...] = ()
    inks: tuple[str, ...] = ()

    @property
    def timed(self) -> bool:
        return self.drawing.timed

    def draw(self, wanted: frozenset[str] = INK, row: int | None = None, tell: Tell = silent) -> Pages:
        """The page, without writing where none of its texts were written, for what counts words and lines."""
        return Pages([self.manuscript or Manuscript((), self.drawing.page, 0.0)], [self.drawing])

    def check(self, row: int | None = None) -> None:
        """See `Document`."""


def open_document(
    source: Source,
    writing: WritingOptions = WritingOptions(),
    sheet: SheetOptions = SheetOptions(),
    picture: PictureOptions = PictureOptions(),
) -> Document:
    """A source with its options. Raises InputError: an option is wrong, or a hand is missing."""
    if source.letter is not None:
        from handout.pipeline.letters import prepare_letter

        return prepare_letter(source.letter, writing, sheet, picture, source.given)
    if source.drawing is None:
        return TextDocument(source.text, prepare(writing, sheet, picture))
    asked = [f"--{name}" for name in ("style", "pose") if getattr(writing, name) is not None]
    notes = [f"{' and '.join(asked)}: a drawing is taken as it is; handout restyle moves it anew."] if asked else []
    if kept := [f"--{name}" for name in ("page", "margin") if getattr(sheet, name) is not None]:
        notes.append(f"{' and '.join(kept)}: a drawing keeps its own page.")
    plain = replace(writing, style=None, prime=None, temperature=None, pose=None)
    task = prepare(plain, sheet, picture, lined=False)
    from handout.pipeline.svg_texts import with_texts

    drawing, manuscript, told = with_texts(source.text, source.drawing, task)
    return DrawingDocument(source.text, drawing, task, manuscript, (*notes, *told))


def describe_asked(document: Document) -> tuple[list[str], Facts]:
    """What a drawing asks for, see `describe_drawing`, and of others nothing."""
    if not isinstance(document, DrawingDocument):
        return [], {}
    from handout.pipeline.svg_texts import describe_drawing

    sentence, facts = describe_drawing(document.name, document.drawing)
    return [sentence], {"drawing": facts}


def one_pen(document: Document) -> list[str]:
    """The note that a machine with one pen draws several inks, where the document has them."""
    named = ", ".join(document.inks)
    return [f"{document.name} is in {named}, too: --layers colour stops for another pen."] if named else []


def deliver(
    tally: Tally,
    task: WritingTask,
    files: Sequence[Path],
    notes: Sequence[str] = (),
    before: Mapping[str, Fact] = MappingProxyType({}),
    behind: Mapping[str, Fact] = MappingProxyType({}),
) -> Delivery:
    """What a task has delivered; before, behind : facts before and behind its notes and its lined paper."""
    told = {**tally.facts(task.seed, task.hand.name, files), **before}
    told |= {"notes": list(notes)} if notes else {}
    told |= {"paper": dict(task.paper.facts)} if task.paper is not None and task.paper.facts else {}
    return Delivery(tally=tally, seed=task.seed, files=tuple(files), told={**told, **behind}, notes=tuple(notes))


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
) -> Delivery:
    """Write a text or a letter to files.

    source : a text, or what `inputs.written_source` read.
    outputs : names of files, whose suffixes say the format: .svg .png .pdf .eps .dxf .inkml .json .gcode …
    device : the plotter that .gcode, .hpgl and .ebb files are for; None: a common one that reads such files.
    places : whether the result tells where each word is.

    Raises InputError, MissingCharacters, DoesNotFit: an option is wrong, the hand lacks letters, or the text is larger
    than its pages (of a letter file the message has the line); nothing is written then.
    """
    paths = [Path(name) for name in outputs]
    machines = programs.Programs(device, paths)
    check_outputs(paths, extra := machines.sinks)
    drawing, wanted = narrow_reports(listener.progress, 0.0, _WRITTEN), wanted_in(paths)
    document = open_document(Source(source) if isinstance(source, str) else source, writing, sheet, picture)
    task = document.task
    pages = document.draw(wanted, tell=drawing)
    drawn = pages.drawings
    files = write_drawings(drawn, paths, task.look, extra=extra, tell=narrow_reports(listener.progress, _WRITTEN, 1.0))
    notes = (*document.notes, *not_followed(task, wanted >= INK), *_unshown(task, drawn, paths))
    notes = (*notes, *style_notes(task, drawn), *losses(paths, drawn))
    even = machines.pressed_evenly() if task.pose.pose is not None else []
    words = tuple(pages.words()) if places else ()
    told: Facts = {"words": words, "x_height": pages.manuscripts[0].about.get("x_height")} if words else {}
    told |= {} if pages.number is None else {"page": pages.number}
    return deliver(pages.tally, task, files, (*notes, *even, *task.given_notes), told)


def export(
    source: Source,
    outputs: Sequence[str | Path],
    writing: WritingOptions = WritingOptions(),
    sheet: SheetOptions = SheetOptions(usual_page="A5"),
    options: ExportOptions = ExportOptions(),
) -> Delivery:
    """Write a text, a letter or a drawing as programs of plotters, for something else to send.

    Raises InputError, MissingCharacters, DoesNotFit: an option is wrong, the hand lacks letters, or a page is larger
    than the plotter; nothing is written then.
    """
    programs.check_suffixes(outputs)
    paths, document = [Path(name) for name in outputs], open_document(source, writing, sheet)
    machines = programs.Programs(
        options.device, paths, fast=document.task.fast, fit=writing.fit, order=options.order, hooks=options.hooks
    )
    check_outputs(paths, machines.sinks)
    pages, task = document.draw(STROKES), document.task
    files = write_drawings(pages.drawings, paths, extra=machines.sinks)
    even = machines.pressed_evenly() if task.pose.pose is not None else []
    sentences, drawing = describe_asked(document)
    notes = (*sentences, *document.notes, *one_pen(document), *even, *style_notes(task, pages.drawings))
    times = {"devices": {name: round(seconds, 2) for name, seconds in machines.seconds.items()}}
    hooks_s = {name: round(seconds, 2) for name, seconds in machines.hooks_s.items()}
    hooks: Facts = {"dips": machines.dips, "hooks_s": hooks_s} if hooks_s else {}
    tally = replace(pages.tally, shrunk=machines.shrunk)
    return deliver(tally, task, files, notes, {**times, **drawing}, hooks)


def write_sent(
    text: str,
    letter: bool,
    outputs: Sequence[str | Path],
    options: tuple[WritingOptions, SheetOptions, PictureOptions],
    *,
    device: str | None = None,
    pictures: Path | None = None,
    listener: Listener = SILENT,
) -> Delivery:
    """Write what was sent from elsewhere, see `inputs.sent_source`, and tell where each word is."""
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
