"""What a call gives back: facts that turn into JSON, a tally of what was written, and a listener to work that goes on.

A result is a frozen dataclass, a `Result`, with `facts()`, the JSON object that ``--json`` prints, and `notes`,
sentences for the user; most verbs give a `Delivery`, which is told those facts when it is made.  `Listener` is how the
same sentences, and the progress, reach whoever waits for the work; `Attendant` is a listener who also stands at the
machine: at a terminal, at a page of the studio, or nobody.
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
from handout.writing.text import LEFT_OUT

if TYPE_CHECKING:
    from handout.values import Drawing, Manuscript

# what JSON can hold
Fact: TypeAlias = "str | int | float | bool | Sequence[Fact] | Mapping[str, Fact] | None"
Facts = dict[str, Fact]
Told = dict[str, Any]  # the same, for who knows what is in it


@dataclass(frozen=True, kw_only=True)
class Result:
    """What every call gives back.

    notes : sentences on what was decided for the user.
    """

    notes: tuple[str, ...] = ()

    def facts(self) -> Facts:
        """The JSON object that ``--json`` prints: as it stands here the fields, files by their names."""
        values = {each.name: getattr(self, each.name) for each in fields(self) if each.name != "notes"}
        return {name: _plain(value) for name, value in values.items()}


def _plain(value: Any) -> Fact:
    """What stands for a field in JSON."""
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    return str(value) if isinstance(value, PurePath) else value


class Listener(Protocol):
    """Whoever waits for long work: hears sentences at once, and how far it has come."""

    def say(self, *sentences: str) -> None:
        """Hear what the user should know now; it is no part of the result."""

    def note(self, *sentences: str) -> None:
        """Hear what the user should know now, and what belongs to the notes of the result."""

    def progress(self, share: float, stage: str) -> None:
        """Hear which share of the work is done, 0 to 1, and what is being done; a `handout.progress.Tell`."""


class Attendant:
    """Who waits for the work, a `Listener`, and stands at the machine; as it is here, nobody, who hears nothing."""

    @property
    def watches(self) -> bool:
        """Whether somebody looks on, who may hold a plotter for as long as they like."""
        return False

    def say(self, *sentences: str) -> None:
        """See `Listener`."""

    def note(self, *sentences: str) -> None:
        """See there."""

    def progress(self, share: float, stage: str) -> None:
        """See there."""

    def do(self, request: str, needed: bool = True) -> None:
        """Do what is asked for, such as to put in a sheet; nobody is taken to have done it before.

        needed : False: where nobody can be asked, the request is only told.

        Raises
        ------
        InputError
            Nobody can be asked, and the work cannot go on.
        """
        from handout.plotting.jobs.runner import is_about_zero

        if not needed:
            self.say(f"{request}.")
        elif is_about_zero(request):
            raise InputError(f"{request}: nobody can be asked to; use --at-zero when it is done.")

    def try_again(self, error: DeviceError) -> bool:
        """Hear of a fault and mend it; False: the job ends."""
        return False

    def paused(self, pressed: Callable[[], bool]) -> None:
        """Wait, the pen lifted, until the plotter's button is `pressed`, or the attendant wants to go on."""
        while not pressed():
            pass

    def answer(self, question: str, answers: Mapping[str, str]) -> str:
        """One of the answers, which are told with what they mean; InputError if nobody can be asked."""
        raise InputError(f"{question} Nobody can be asked.")

    def agrees(self, question: str) -> bool:
        """Whether the answer is yes; no is the usual one."""
        return False

    def file_of(self, what: str) -> Path:
        """The file with something, such as a scan, that was asked for; InputError if nobody can be asked."""
        raise InputError(f"Name the file with {what}: nobody can be asked for it.")

    @contextlib.contextmanager
    def plotting(self) -> Iterator[Callable[[float, float], None] | None]:
        """A block in which a job is drawn: what is told the share that is done and the s that are left, if anything."""
        yield lambda share, left: self.progress(share, "plotting")


SILENT = Attendant()


@dataclass(frozen=True)
class Tally:
    """What has been written, added up, so that a long batch need not be kept; tallies add up with +.

    pen_down, pen_up : mm; duration : s.
    borrowed : the letters that the hand lacked, and what was written for them.
    slips : the words that were struck out.
    doubtful : the words that read as others.
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

    @classmethod
    def from_pages(cls, pages: Sequence[Manuscript], drawings: Sequence[Drawing]) -> Tally:
        """Of some pages of one text, as manuscripts and as strokes."""
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
            slips=[slip for page in pages for slip in page.about.get("slips", [])],
            doubtful=[doubt for page in pages for doubt in page.about.get("doubtful", [])],
        )

    @property
    def lent_letters(self) -> dict[tuple[str, str], int]:
        """How often each letter that is not the author's was written, by letter and what it was made of."""
        return self._count(itemgetter("letter", "from"), lambda one: not one["own"] and one["from"] != LEFT_OUT)

    @property
    def doubtful_letters(self) -> dict[str, int]:
        """How often each letter was written with the author's own glyphs, of which all are doubtful."""
        return self._count(itemgetter("letter"), lambda one: one["own"] and bool(one.get("doubtful")))

    @property
    def left_out(self) -> dict[str, int]:
        """How often each character was left out, since the hand has no form for it."""
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
            **{name: told for name in ("borrowed", "slips", "doubtful") if (told := getattr(self, name))},
        }


@dataclass(frozen=True, kw_only=True)
class Delivery(Result):
    """What was written or drawn, on files or as it would be plotted; told : what ``--json`` prints of it."""

    tally: Tally = field(default_factory=Tally)
    seed: int = 0
    files: tuple[Path, ...] = ()
    told: Told

    def facts(self) -> Facts:
        return self.told
