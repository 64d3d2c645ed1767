"""The terminal of a verb: data to standard output, sentences to standard error, progress while the work goes on."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, field

import click

from handout.cli import progress as terminal
from handout.pipeline.results import Result


@dataclass
class Console:
    """Hears what the pipeline says (a `pipeline.results.Listener`) and prints the result.

    as_json : print one JSON object on standard output.
    quiet : say nothing but errors.
    """

    as_json: bool = False
    quiet: bool = False
    _notes: list[str] = field(default_factory=list)
    _line: terminal.Line = terminal.unseen

    def say(self, *sentences: str) -> None:
        """Say something on standard error, unless the user wants quiet."""
        if self.quiet:
            return
        for sentence in sentences:
            with terminal.hidden():
                click.echo(sentence, err=True)

    def note(self, *sentences: str) -> None:
        """The same, and keep it for the "notes" of the JSON."""
        self.say(*sentences)
        self._notes += sentences

    def progress(self, share: float, stage: str) -> None:
        """Show how far the work has come, where a block of `working` is open."""
        self._line(share, stage)

    @contextlib.contextmanager
    def working(self) -> Iterator[terminal.Line]:
        """A block of work whose progress a terminal shows."""
        with terminal.shown(self.quiet) as line:
            before, self._line = self._line, line
            try:
                yield line
            finally:
                self._line = before

    def report(self, result: Result, sentence: str) -> None:
        """Print a result: its notes, the JSON object where that is asked for, and a sentence."""
        self.note(*(note for note in result.notes if note not in self._notes))
        if self.as_json:
            facts = {**result.facts(), **({"notes": self._notes} if self._notes else {})}
            click.echo(json.dumps(facts, ensure_ascii=False))
        if not self.quiet:
            click.echo(sentence, err=True)
