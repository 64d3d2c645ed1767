"""The person at a plotter, asked at the terminal: for sheets and pens, for what to do after a fault, for heights."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator, Mapping

import click

from handout.cli import progress
from handout.cli.console import BackgroundOutput
from handout.errors import DeviceError, InputError
from handout.pipeline.plotting import Progress, is_about_zero, is_simulated


class Operator:
    """The operator of a plot (a `pipeline.plot_request.Operator`).

    address : of the plotter; at a simulated one nobody is asked.
    yes : nothing is asked about sheets and pens.  quiet : say nothing but errors.
    """

    def __init__(self, address: str, yes: bool, quiet: bool = False) -> None:
        self.simulated, self.yes, self.quiet = is_simulated(address), yes, quiet
        self._output: BackgroundOutput | None = None

    @property
    def watches(self) -> bool:
        """Whether somebody is at the terminal, who can be asked."""
        return not self.yes and sys.stdin.isatty() and sys.stderr.isatty()

    @contextlib.contextmanager
    def plotting(self) -> Iterator[Progress | None]:
        """While a job is drawn a terminal shows how far it has come; what is said is said on a thread of its own."""
        with progress.shown(self.quiet) as line, BackgroundOutput(self.quiet) as self._output:
            yield (lambda share, left: line(share, "plotting", left)) if progress.wanted(self.quiet) else None

    def say(self, sentence: str) -> None:
        """Say a sentence; never waits."""
        assert self._output is not None
        self._output.say(sentence)

    def do(self, request: str) -> None:
        """Ask, and wait for Enter."""
        if self.simulated or (self.yes and not is_about_zero(request)):
            return
        if not sys.stdin.isatty():
            way = "--at-zero when it is done" if is_about_zero(request) else "--yes to go on unasked"
            raise InputError(f"{request}: nobody can be asked to; use {way}.")
        self._wait()
        _enter(f"{request} and press Enter")

    def try_again(self, error: DeviceError) -> bool:
        """Say what is wrong, and wait for Enter."""
        if self.simulated or not sys.stdin.isatty():
            return False
        self._wait()
        _enter("Put it right and press Enter to go on; Ctrl-C stops, and the job is kept", f"handout: {error}")
        return True

    def paused(self, pressed: Callable[[], bool]) -> None:
        """Until the button of the plotter is pressed once more, or Enter."""
        enter = ", or Enter," if sys.stdin.isatty() else ""
        with progress.hidden():
            click.echo(
                f"Paused, the pen is lifted: press the plotter's button again{enter} to go on; Ctrl-C stops, and the "
                "job is kept.",
                err=True,
            )
            while not (pressed() or _entered()):
                pass
            click.echo("It goes on.", err=True)

    def _wait(self) -> None:
        """Until all is said that comes before a question."""
        if self._output is not None:
            self._output.wait()


class HeightsOperator:
    """The person who looks at the pen while its heights are found; a `pen_heights.Person`."""

    def __init__(self, address: str, yes: bool) -> None:
        self._asks = not yes and not is_simulated(address)
        self._answers: dict[str, str] = {}

    def do(self, request: str) -> None:
        """Ask, and wait for Enter."""
        if not self._asks:
            return
        if not sys.stdin.isatty():
            raise InputError(f"{request}: nobody can be asked to; use --yes when it is done.")
        _enter(f"{request} and press Enter")

    def answer(self, question: str, answers: Mapping[str, str]) -> str:
        """One of the answers."""
        if dict(answers) != self._answers:
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

    def hear(self, text: str) -> None:
        """Tell something."""
        click.echo(text, err=True)


def _enter(request: str, *before: str) -> None:
    """Say something, ask, and wait for Enter."""
    with progress.hidden():
        for line in before:
            click.echo(line, err=True)
        click.prompt(request, default="", show_default=False, prompt_suffix=" ", err=True)


def _entered() -> bool:
    """Whether somebody at the terminal has pressed Enter."""
    if sys.platform == "win32":
        import msvcrt

        return "\r" in [msvcrt.getwch() for _ in iter(msvcrt.kbhit, False)]  # all that was typed
    import select

    with contextlib.suppress(OSError, ValueError):  # what cannot be looked at is not waited for
        if sys.stdin.isatty() and select.select([sys.stdin], [], [], 0)[0]:
            return bool(sys.stdin.readline())
    return False
