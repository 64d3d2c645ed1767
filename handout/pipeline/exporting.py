"""A text or a drawing as the program of a plotter, for something else to send."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from handout.errors import InputError
from handout.pipeline.inputs import Source
from handout.pipeline.options import SheetOptions, WritingOptions
from handout.pipeline.plot_request import ExportOptions
from handout.pipeline.programs import SUFFIXES, Programs
from handout.pipeline.results import Facts, Result, Tally
from handout.pipeline.texts import STROKES, style_notes
from handout.pipeline.writing import asked, one_pen, open_document
from handout.sinks import check_outputs, write_drawings


@dataclass(frozen=True)
class Exported(Result):
    """What `export` wrote; seconds : name of the machine → how long all pages would take it, s; dips, hooks_s : as in
    `Programs`; drawing : what one asks for, empty for a text."""

    tally: Tally
    seed: int
    hand: str
    files: tuple[Path, ...]
    seconds: dict[str, float]
    dips: dict[str, int]
    hooks_s: dict[str, float]
    drawing: Facts

    def facts(self) -> Facts:
        devices = {name: round(seconds, 2) for name, seconds in self.seconds.items()}
        notes: Facts = {**self.drawing, **({"notes": list(self.notes)} if self.notes else {})}
        if self.hooks_s:
            notes |= {"dips": self.dips, "hooks_s": {name: round(s, 2) for name, s in self.hooks_s.items()}}
        return {**self.tally.facts(self.seed, self.hand, self.files), "devices": devices, **notes}


def check_suffixes(outputs: Sequence[str | Path]) -> None:
    """Raise InputError for the first file that is no program of a plotter."""
    for path in map(Path, outputs):
        if path.suffix.lower() not in SUFFIXES:
            raise InputError(f"{path}: programs of plotters end in {', '.join(SUFFIXES)}; handout write does the rest.")


def export(
    source: Source,
    outputs: Sequence[str | Path],
    writing: WritingOptions = WritingOptions(),
    sheet: SheetOptions = SheetOptions(usual_page="A5"),
    options: ExportOptions = ExportOptions(),
) -> Exported:
    """Write a text, a letter or a drawing as programs of plotters.

    Raises
    ------
    InputError, MissingCharacters, DoesNotFit
        An option is wrong, the hand lacks letters, or a page is larger than the plotter; nothing is written then.
    """
    check_suffixes(outputs)
    paths = [Path(name) for name in outputs]
    document = open_document(source, writing, sheet)
    task = document.task
    programs = Programs(
        options.device, paths, fast=task.fast, fit=writing.fit, order=options.order, hooks=options.hooks
    )
    check_outputs(paths, programs.sinks)
    pages = document.draw(STROKES)
    files = write_drawings(pages.drawings, paths, extra=programs.sinks)
    even = programs.pressed_evenly() if task.pose.pose is not None else []
    sentences, drawing = asked(document)
    notes = (*sentences, *document.notes, *one_pen(document), *even, *style_notes(task, pages.drawings))
    told = programs.seconds, programs.dips, programs.hooks_s
    return Exported(pages.tally, task.seed, task.hand.name, tuple(files), *told, drawing, notes=notes)
