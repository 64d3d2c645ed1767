"""The terminal of a verb: data to standard output, sentences to standard error, progress while the work goes on."""

from __future__ import annotations

import contextlib
import json
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, field
from types import TracebackType

import click

from handout.cli import progress as terminal
from handout.errors import shortened
from handout.pipeline.results import Result

_MOST_WAITING = 200  # lines that wait for a terminal; more are only counted.  Set by eye: some screens full


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
                click.echo(shortened(sentence), err=True)

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


class BackgroundOutput:
    """Prints lines on standard error from a thread of its own: a terminal may be slow, and a plot must not wait.

    quiet : says nothing.
    """

    def __init__(self, quiet: bool) -> None:
        self.quiet = quiet
        self._thread: Executor = ThreadPoolExecutor(1, "console")
        self._lock = threading.Lock()
        self._lines: list[str] = []
        self._lost = 0
        self._printing = False  # whether the thread will look for more lines

    def say(self, line: str) -> None:
        """Print a line, soon."""
        if self.quiet:
            return
        with self._lock:
            self._lost += len(self._lines) >= _MOST_WAITING
            if len(self._lines) < _MOST_WAITING:
                self._lines.append(line)
            if not self._printing:
                self._printing = True
                self._thread.submit(self._print_lines)

    def wait(self) -> None:
        """Until all is printed."""
        self._thread.submit(lambda: None).result()

    def _print_lines(self) -> None:
        while True:
            with self._lock:
                lines, self._lines, lost, self._lost = self._lines, [], self._lost, 0
                self._printing = bool(lines)
            if not lines:
                return
            with contextlib.suppress(OSError, ValueError), terminal.hidden():  # the terminal is gone: no reason to stop
                for line in [*lines, *([f"({lost} more lines)"] if lost else [])]:
                    click.echo(line, err=True)

    def __enter__(self) -> BackgroundOutput:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._thread.shutdown()
