"""The terminal of a verb: data to standard output, sentences, questions and progress to standard error."""

from __future__ import annotations

import contextlib
import json
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType

import click

from handout.cli import progress as terminal
from handout.errors import DeviceError, InputError, shorten_message
from handout.pipeline.results import Attendant, Result

_MOST_WAITING = 200  # lines that wait for a terminal; more are only counted.  Set by eye: some screens full


@dataclass
class Console(Attendant):
    """The person at the terminal, who hears what the pipeline says, is asked, and is shown the result.

    as_json : print one JSON object on standard output.
    quiet : say nothing but errors.
    yes : nothing is asked about sheets and pens.
    """

    as_json: bool = False
    quiet: bool = False
    yes: bool = False
    _notes: list[str] = field(default_factory=list)
    _line: terminal.ProgressLine = terminal.show_nothing
    _output: BackgroundOutput | None = None
    _answers: Mapping[str, str] = field(default_factory=dict)

    def say(self, *sentences: str) -> None:
        """Say something on standard error, unless the user wants quiet."""
        if self.quiet:
            return
        for sentence in map(shorten_message, sentences):
            if self._output is not None:
                self._output.say(sentence)
                continue
            with terminal.hide_bar():
                click.echo(sentence, err=True)

    def note(self, *sentences: str) -> None:
        """The same, and keep it for the "notes" of the JSON."""
        self.say(*sentences)
        self._notes += sentences

    def progress(self, share: float, stage: str) -> None:
        """Show how far the work has come, where a block of `working` is open."""
        self._line(share, stage)

    @contextlib.contextmanager
    def working(self) -> Iterator[terminal.ProgressLine]:
        """A block of work whose progress a terminal shows."""
        with terminal.show_bar(self.quiet) as line:
            before, self._line = self._line, line
            try:
                yield line
            finally:
                self._line = before

    @property
    def watches(self) -> bool:
        """Whether somebody is at the terminal, who can be asked."""
        return not self.yes and sys.stdin.isatty() and sys.stderr.isatty()

    @contextlib.contextmanager
    def plotting(self) -> Iterator[Callable[[float, float], None] | None]:
        """While a job is drawn a terminal shows how far it has come; what is said is said on a thread of its own."""
        with terminal.show_bar(self.quiet) as line, BackgroundOutput(self.quiet) as self._output:
            try:
                yield (lambda share, left: line(share, "plotting", left)) if terminal.wants_bar(self.quiet) else None
            finally:
                self._output = None

    def do(self, request: str, needed: bool = True) -> None:
        """Ask, and wait for Enter."""
        zero = needed and "plotter's zero" in request  # as `runner.is_about_zero` knows
        if needed and self.yes and not zero:
            return
        if not needed and (self.yes or not sys.stdin.isatty()):
            self.say(f"{request}.")
            return
        if not sys.stdin.isatty():
            way = "--at-zero when it is done" if zero else "--yes when it is done, to go on unasked"
            raise InputError(f"{request}: nobody can be asked to; use {way}.")
        self._enter(f"{request} and press Enter")

    def try_again(self, error: DeviceError) -> bool:
        """Say what is wrong, and wait for Enter."""
        if sys.stdin.isatty():
            self._enter("Put it right and press Enter to go on; Ctrl-C stops, and the job is kept", f"handout: {error}")
        return sys.stdin.isatty()

    def paused(self, pressed: Callable[[], bool]) -> None:
        """Until the button of the plotter is pressed once more, or Enter."""
        enter = ", or Enter," if sys.stdin.isatty() else ""
        with terminal.hide_bar():
            click.echo(
                f"Paused, the pen is lifted: press the plotter's button again{enter} to go on; Ctrl-C stops, and the "
                "job is kept.",
                err=True,
            )
            while not (pressed() or _has_entered()):
                pass
            click.echo("It goes on.", err=True)

    def answer(self, question: str, answers: Mapping[str, str]) -> str:
        """One of the answers, which are shown where they are others than before."""
        if answers != self._answers:
            self._answers = dict(answers)
            click.echo("".join(f"  {key}  {means}\n" for key, means in answers.items()), err=True, nl=False)
        try:
            return str(click.prompt(question, type=click.Choice(list(answers)), prompt_suffix=": ", err=True))
        except click.Abort as stop:
            if isinstance(stop.__context__, EOFError):
                raise InputError(
                    f"pen heights asks, and the input has ended: it needs {', '.join(answers)} typed at a terminal, or "
                    "--up and --down to try two heights without questions."
                ) from None
            raise

    def agrees(self, question: str) -> bool:
        """Whether the person says yes."""
        with terminal.hide_bar():
            return click.confirm(question, default=False, err=True)

    def file_of(self, what: str) -> Path:
        """The file whose name is typed, or dropped on the terminal, which may put it in quotes."""
        with terminal.hide_bar():
            return Path(click.prompt(f"File with {what}", err=True).strip().strip("'\""))

    def _enter(self, request: str, *before: str) -> None:
        """When all is said that comes before, say something, ask, and wait for Enter."""
        if self._output is not None:
            self._output.wait()
        with terminal.hide_bar():
            for line in before:
                click.echo(line, err=True)
            click.prompt(request, default="", show_default=False, prompt_suffix=" ", err=True)

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
            # that the terminal is gone is no reason to stop
            with contextlib.suppress(OSError, ValueError), terminal.hide_bar():
                for line in [*lines, *([f"({lost} more lines)"] if lost else [])]:
                    click.echo(line, err=True)

    def __enter__(self) -> BackgroundOutput:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._thread.shutdown()


def _has_entered() -> bool:
    """Whether somebody at the terminal has pressed Enter."""
    if sys.platform == "win32":
        import msvcrt

        return "\r" in [msvcrt.getwch() for _ in iter(msvcrt.kbhit, False)]  # all that was typed
    import select

    with contextlib.suppress(OSError, ValueError):  # what cannot be looked at is not waited for
        if sys.stdin.isatty() and select.select([sys.stdin], [], [], 0)[0]:
            return bool(sys.stdin.readline())
    return False
