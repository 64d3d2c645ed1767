"""What a verb says at the end: data to standard output, talk to standard error, progress on a terminal."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from handout import units
from handout.cli import progress
from handout.pipeline import results as pipeline

_NOTES = "handout.notes"
F = TypeVar("F", bound=Callable[..., Any])

if TYPE_CHECKING:
    from handout.cli.jobs import Setup
    from handout.values import Drawing, Manuscript


@dataclass
class Tally:
    """What has been written so far, added up, so that a long batch need not be kept."""

    pages: int = 0
    lines: int = 0
    characters: int = 0
    strokes: int = 0
    pen_down: float = 0.0
    pen_up: float = 0.0
    duration: float = 0.0
    borrowed: list[dict[str, Any]] = field(default_factory=list)
    slips: list[dict[str, Any]] = field(default_factory=list)

    def add(self, pages: Sequence[Manuscript], drawings: Sequence[Drawing]) -> None:
        """Count some pages, as manuscripts and as strokes."""
        self.pages += len(pages)
        self.lines += sum(len(manuscript.lines) for manuscript in pages)
        self.characters += sum(
            bool(placed.glyph.letter) for manuscript in pages for line in manuscript.lines for placed in line.placed
        )
        self.strokes += sum(len(drawing.strokes) for drawing in drawings)
        self.pen_down += sum(drawing.pen_down for drawing in drawings)
        self.pen_up += sum(drawing.pen_up for drawing in drawings)
        self.duration += sum(drawing.duration for drawing in drawings)
        self.borrowed += pages[0].about.get("borrowed", []) if pages else []
        self.slips += [slip for manuscript in pages for slip in manuscript.about.get("slips", [])]

    def plus(self, rows: Iterable[Mapping[str, Any]]) -> Tally:
        """This and some others, each as a mapping from its fields."""
        for row in rows:
            for one in fields(self):
                setattr(self, one.name, getattr(self, one.name) + row[one.name])
        return self

    def facts(self, job: Setup, files: Sequence[Path]) -> dict[str, Any]:
        """What `--json` prints of it."""
        return {
            "pages": self.pages,
            "lines": self.lines,
            "characters": self.characters,
            "strokes": self.strokes,
            "pen_down_mm": round(self.pen_down, 2),
            "pen_up_mm": round(self.pen_up, 2),
            "duration_s": round(self.duration, 2),
            "seed": job.seed,
            "hand": job.hand.name,
            "files": [str(path) for path in files],
            **({"borrowed": self.borrowed} if self.borrowed else {}),
            **({"slips": self.slips} if self.slips else {}),
        }


def summary(
    pages: Sequence[Manuscript], drawings: Sequence[Drawing], job: Setup, files: Sequence[Path]
) -> dict[str, Any]:
    """What `--json` prints of a piece of writing."""
    tally = Tally()
    tally.add(pages, drawings)
    return tally.facts(job, files)


def names(files: Iterable[object]) -> str:
    """The names of some files."""
    return ", ".join(map(str, files))


def writing_time(tally: pipeline.Tally | dict[str, Any]) -> str:
    """How long the writing would take by hand, for what is said at the end; nothing where strokes are not known."""
    duration, strokes = (
        (tally["duration_s"], tally["strokes"]) if isinstance(tally, dict) else (tally.duration, tally.strokes)
    )
    return f"{units.duration(duration)} of writing; " if strokes else ""


def lent(tally: pipeline.Tally | dict[str, Any]) -> str:
    """What was written for characters that the hand lacks, in a sentence or two; nothing where there are none."""
    from handout.writing.text import LEFT_OUT

    counts = Counter[tuple[str, str]]()
    for letter in tally.get("borrowed", []) if isinstance(tally, dict) else tally.borrowed:
        if not letter["own"]:
            counts[letter["letter"], letter["from"]] += letter["count"]
    lent = [f"{letter} ({source}{_times(n)})" for (letter, source), n in counts.items() if source != LEFT_OUT]
    gone = [letter + _times(n) for (letter, source), n in counts.items() if source == LEFT_OUT]
    said = f" Lent to the hand: {', '.join(lent)}." if lent else ""
    return said + (f" Left out, since the hand has no form for it: {', '.join(gone)}." if gone else "")


def _times(number: int) -> str:
    return f", {number} times" if number > 1 else ""


def slipped(tally: pipeline.Tally | dict[str, Any]) -> str:
    """One sentence about the words that were struck out; nothing where there are none."""
    count = len(tally.get("slips", []) if isinstance(tally, dict) else tally.slips)
    return f" {units.count(count, 'slip')} of the pen struck out." if count else ""


class Telling:
    """A `Listener` that says and notes as below."""

    def say(self, *sentences: str) -> None:
        """On standard error."""
        context = click.get_current_context(silent=True)
        for sentence in sentences:
            talk(bool(context and context.params.get("quiet")))(sentence)

    def note(self, *sentences: str) -> None:
        """On standard error and in the JSON."""
        for sentence in sentences:
            note(sentence)

    def progress(self, share: float, stage: str) -> None:
        """Nothing."""


def note(message: str) -> None:
    """Say on standard error what was decided for the user, unless they want quiet, and keep it for `--json`."""
    context = click.get_current_context(silent=True)
    talk(bool(context and context.params.get("quiet")))(message)
    if context is not None:
        context.meta.setdefault(_NOTES, []).append(message)


def of_paper(job: Setup) -> list[str]:
    """What is said of the lined paper that is written on."""
    return list(job.paper_notes)


def noted(notes: Sequence[str], job: Setup, quiet: bool) -> dict[str, Any]:
    """Say some sentences; what `--json` prints of them, and of the lined paper."""
    for note in notes:
        talk(quiet)(note)
    paper = {"paper": dict(job.paper.facts)} if job.paper is not None and job.paper.facts else {}
    return {**({"notes": list(notes)} if notes else {}), **paper}


def report(result: dict[str, Any], said: str, *, as_json: bool, quiet: bool) -> None:
    """Data to standard output, talk to standard error."""
    context = click.get_current_context(silent=True)
    notes = context.meta.get(_NOTES, []) if context is not None else []
    if notes:
        result = {**result, "notes": notes}
    if as_json:
        click.echo(json.dumps(result, ensure_ascii=False))
    if not quiet:
        click.echo(said, err=True)


def talk(quiet: bool) -> Callable[[str], None]:
    """A function that says something on standard error, unless the user wants quiet."""

    def say(message: str) -> None:
        with progress.hidden():
            click.echo(message, err=True)

    return (lambda message: None) if quiet else say


def output_options(function: F) -> F:
    """--json and --quiet."""
    as_json = click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
    return as_json(click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors.")(function))
