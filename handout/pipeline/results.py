"""What a call gives back: facts for JSON, a tally of what was written, and who listens while the work goes on.

A `Result` is a frozen dataclass with `facts()`, the JSON object that ``--json`` prints, and `notes`, sentences for the
user; most verbs give a `Delivery`, which gets these facts when it is made.  A `Listener` hears sentences and progress
while the work goes on; an `Attendant` is a listener who also stands at the machine: at a terminal, at a page of the
studio, or nobody.
"""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from operator import itemgetter
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from handout.errors import DeviceError, InputError

if TYPE_CHECKING:
    from handout.values import Drawing, Manuscript

# what JSON can hold
Fact: TypeAlias = "str | int | float | bool | Sequence[Fact] | Mapping[str, Fact] | None"
Facts = dict[str, Fact]
Told = dict[str, Any]  # the same, where the caller knows what each key holds


@dataclass(frozen=True, kw_only=True)
class Result:
    """What every call gives back; notes : sentences on what was decided for the user."""

    notes: tuple[str, ...] = ()

    def facts(self) -> Facts:
        """The JSON object that ``--json`` prints: here all fields, and files by their names."""
        values = {each.name: getattr(self, each.name) for each in fields(self) if each.name != "notes"}
        return {name: _plain(value) for name, value in values.items()}


def _plain(value: Any) -> Fact:
    """The value of a field as JSON takes it."""
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    return str(value) if isinstance(value, PurePath) else value


class Listener(Protocol):
    """Whoever waits for long work, and hears sentences and progress at once."""

    def say(self, *sentences: str) -> None:
        """Hear what the user should know now, and what is no part of the result."""

    def note(self, *sentences: str) -> None:
        """Hear what the user should know now, and what the notes of the result have, too."""

    def progress(self, share: float, stage: str) -> None:
        """Hear which share of the work is done, 0 to 1, and what is being done; a `handout.progress.Tell`."""


class Attendant:
    """A `Listener` who stands at the machine; this class itself is nobody, and hears nothing."""

    @property
    def watches(self) -> bool:
        """Whether somebody looks on; then a plotter may stay on hold for as long as they like."""
        return False

    def say(self, *sentences: str) -> None:
        """See `Listener`."""

    def note(self, *sentences: str) -> None:
        """See there."""

    def progress(self, share: float, stage: str) -> None:
        """See there."""

    def do(self, request: str, needed: bool = True) -> None:
        """Ask for something to be done, such as to put in a sheet; with nobody there it counts as done.

        needed : False: where nobody can be asked, the request is only said.

        Raises InputError: nobody can be asked, and the work cannot go on.
        """
        from handout.plotting.jobs.runner import is_about_zero

        if not needed:
            self.say(f"{request}.")
        elif is_about_zero(request):
            raise InputError(f"{request}: nobody can be asked to; use --at-zero when it is done.")

    def try_again(self, error: DeviceError) -> bool:
        """Hear of a fault, and put it right; False: the job ends."""
        return False

    def paused(self, pressed: Callable[[], bool]) -> None:
        """Wait with the pen lifted until the plotter's button is `pressed`, or the attendant says to go on."""
        while not pressed():
            pass

    def answer(self, question: str, answers: Mapping[str, str]) -> str:
        """Ask a question; `answers` has each answer with what it means.  InputError if nobody can be asked."""
        raise InputError(f"{question} Nobody can be asked.")

    def agrees(self, question: str) -> bool:
        """Ask a question; whether the answer is yes, which it is not by default."""
        return False

    def file_of(self, what: str) -> Path:
        """Ask for the name of a file, such as that of a scan; InputError if nobody can be asked."""
        raise InputError(f"Name the file with {what}: nobody can be asked for it.")

    @contextlib.contextmanager
    def plotting(self) -> Iterator[Callable[[float, float], None] | None]:
        """A block in which a job is drawn; gives what hears the share that is done and the s that are left, or None."""
        yield lambda share, left: self.progress(share, "plotting")


SILENT = Attendant()


@dataclass(frozen=True)
class Tally:
    """Counts of what was written; they add up with +, so that the pages of a long batch need not be kept.

    pen_down, pen_up : mm; duration : s.
    borrowed : letters that the hand lacked, and what was written for them.
    slips : words that were struck out; doubtful : words that read as others; formulas : the TeX of each.
    order : words of scanned ink whose strokes may as well have been written in another order.
    hard_to_read : words that a style makes so, and at which letters.
    shrunk : of pages that were made to fit, their size as a share of that which was asked for.
    other_inks : letters in another ink than most of the author's page.
    """

    pages: int = 0
    lines: int = 0
    characters: int = 0
    strokes: int = 0
    pen_down: float = 0.0
    pen_up: float = 0.0
    duration: float = 0.0
    borrowed: Sequence[Mapping[str, Any]] = ()
    slips: Sequence[Mapping[str, Any]] = ()
    doubtful: Sequence[Mapping[str, Any]] = ()
    formulas: Sequence[str] = ()
    order: Sequence[Mapping[str, Any]] = ()
    hard_to_read: Sequence[Mapping[str, Any]] = ()
    shrunk: Sequence[float] = ()
    other_inks: Sequence[str] = ()

    @classmethod
    def from_pages(cls, pages: Sequence[Manuscript], drawings: Sequence[Drawing]) -> Tally:
        """Count some pages of one text, given as manuscripts and as strokes."""

        def gather(name: str, told: Sequence[Manuscript | Drawing] = pages) -> list[Any]:
            return [each for page in told for each in page.about.get(name, [])]

        letters = (placed.glyph.letter for page in pages for line in page.lines for placed in line.placed)
        return cls(
            pages=len(pages),
            lines=sum(len(page.lines) for page in pages),
            characters=sum(map(bool, letters)),
            strokes=sum(len(drawing.strokes) for drawing in drawings),
            pen_down=sum(drawing.pen_down for drawing in drawings),
            pen_up=sum(drawing.pen_up for drawing in drawings),
            duration=sum(drawing.duration for drawing in drawings),
            borrowed=list(pages[0].about.get("borrowed", [])) if pages else [],
            slips=gather("slips"),
            doubtful=gather("doubtful"),
            formulas=gather("formulas"),
            shrunk=gather("shrunk", drawings or pages),
            other_inks=gather("other_inks", drawings),
            order=gather("order", drawings),
            hard_to_read=gather("hard_to_read", drawings),
        )

    @property
    def lent_letters(self) -> dict[tuple[str, str], int]:
        """How often each letter that is not the author's was written: (letter, what it was made of) → count."""
        from handout.writing.text import LEFT_OUT

        return self._count(itemgetter("letter", "from"), lambda one: not one["own"] and one["from"] != LEFT_OUT)

    @property
    def doubtful_letters(self) -> dict[str, int]:
        """How often each letter was written of which all the author's glyphs are doubtful."""
        return self._count(itemgetter("letter"), lambda one: one["own"] and bool(one.get("doubtful")))

    @property
    def left_out(self) -> dict[str, int]:
        """How often each character was left out, since the hand has no form for it."""
        from handout.writing.text import LEFT_OUT

        return self._count(itemgetter("letter"), lambda one: not one["own"] and one["from"] == LEFT_OUT)

    def _count(self, name: Callable[[Any], Any], wanted: Callable[[Mapping[str, Any]], bool]) -> dict[Any, int]:
        """How often some of the borrowed letters were written, by what `name` says of each."""
        counts = Counter[Any]()
        for letter in filter(wanted, self.borrowed):
            counts[name(letter)] += letter["count"]
        return counts

    def __add__(self, other: Tally) -> Tally:
        sums: dict[str, Any] = {}
        for name, own in vars(self).items():
            more = getattr(other, name)
            sums[name] = own + more if isinstance(own, int | float) else [*own, *more] if more else own
        return Tally(**sums)

    def facts(self, seed: int, hand: str, files: Sequence[object]) -> Facts:
        """What ``--json`` prints of it."""
        return {
            "pages": self.pages,
            "lines": self.lines,
            "characters": self.characters,
            "strokes": self.strokes,
            "pen_down_mm": round(self.pen_down, 2),
            "pen_up_mm": round(self.pen_up, 2),
            "duration_s": round(self.duration, 2),
            "seed": seed,
            "hand": hand,
            "files": [str(path) for path in files],
            **{
                name: told
                for name in (
                    "borrowed",
                    "slips",
                    "doubtful",
                    "formulas",
                    "order",
                    "hard_to_read",
                    "shrunk",
                    "other_inks",
                )
                if (told := getattr(self, name))
            },
        }


@dataclass(frozen=True, kw_only=True)
class Delivery(Result):
    """What was written to files, printed or plotted; told : what ``--json`` prints of it."""

    tally: Tally = field(default_factory=Tally)
    seed: int = 0
    files: tuple[Path, ...] = ()
    told: Told

    def facts(self) -> Facts:
        return self.told
