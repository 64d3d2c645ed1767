"""A text or a drawing as the program of a plotter, for something else to send."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from handout.errors import InputError
from handout.pipeline.inputs import Source
from handout.pipeline.letters import draw_letter, prepare_letter
from handout.pipeline.options import SheetOptions, WritingOptions
from handout.pipeline.plot_request import ExportOptions
from handout.pipeline.programs import SUFFIXES, Programs
from handout.pipeline.results import Fact, Facts, Result, Tally
from handout.pipeline.svg_texts import described, with_texts
from handout.pipeline.writing import STROKES, draw_pages, prepare, style_notes
from handout.sinks import check_outputs, write_drawings
from handout.values import Manuscript


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
        notes: Facts = {"notes": list(self.notes)} if self.notes else {}
        notes |= {"drawing": self.drawing} if self.drawing else {}
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
    letter = None if source.letter is None else prepare_letter(source.letter, writing, sheet, given=source.given)
    task = prepare(writing, sheet) if letter is None else letter.main
    programs = Programs(
        options.device, paths, fast=task.fast, fit=writing.fit, order=options.order, hooks=options.hooks
    )
    check_outputs(paths, programs.sinks)
    drawn, asked = tuple[str, ...](), dict[str, Fact]()
    if letter is not None:
        pages, drawings = draw_letter(letter, wanted=STROKES)
    elif source.drawing is None:
        pages, drawings = draw_pages(source.text, task, wanted=STROKES)
    else:
        source, told = with_texts(source, task)
        assert source.drawing is not None
        sentence, asked = described(source.text, source.drawing)
        pages, drawings = [source.manuscript or Manuscript((), source.drawing.page, 0.0)], [source.drawing]
        drawn = (sentence, *told)
    files = write_drawings(drawings, paths, extra=programs.sinks)
    even = programs.pressed_evenly() if task.pose.pose is not None else []
    notes = (*even, *style_notes(task, drawings)) if source.drawing is None else drawn
    notes = notes if letter is None else (*letter.notes(apart=False), *notes)
    tally = Tally.of(pages, drawings)
    times = programs.seconds, programs.dips, programs.hooks_s
    return Exported(tally, task.seed, task.hand.name, tuple(files), *times, asked, notes=notes)
