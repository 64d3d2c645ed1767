"""What a person corrects of a hand that was read from paper.

A correction names its letter by a place on the page, in pixels of the scan as it came from its file, so that it still
holds after the page has been read again.  `apply` makes what it says and no more, and leaves the hand that it is given
as it is; `tagging.relearning.correct` learns from it, too.  The journal keeps what was corrected and what that changed.

Source: seed 000, §5.1.3 (labels, splits, links); the others are own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, Union

import msgspec

from handout.errors import InputError
from handout.hand.hand_editor import CorrectionError, HandEditor
from handout.hand.places import Place
from handout.hand.scanned import ScannedHand

Spot = tuple[float, float]  # x, y, pixels of the scan


class Correction(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", omit_defaults=True):
    """One correction. page : number of the page, from 0."""

    page: int

    @property
    def kind(self) -> str:
        """What it does, as the files of corrections call it."""
        return str(self.__struct_config__.tag)


class Label(Correction, frozen=True, tag="label"):
    """The letter at `at` is `text`; writing that belonged to no letter becomes one."""

    at: Spot
    text: str
    place: Place | None = None


class Merge(Correction, frozen=True, tag="merge"):
    """What is at `other` belongs to the letter at `at`."""

    at: Spot
    other: Spot
    text: str | None = None


class Split(Correction, frozen=True, tag="split"):
    """The letter that the line from `a` to `b` crosses is two; `texts` name them from left to right.

    Without them the larger part keeps the name, and the other has none until it is labelled.
    """

    a: Spot
    b: Spot
    texts: tuple[str, str] | None = None


class Remove(Correction, frozen=True, tag="remove"):
    """The letter at `at` is none."""

    at: Spot


class Unlink(Correction, frozen=True, tag="unlink"):
    """The letter at `at` is not joined to the one after it."""

    at: Spot


class Link(Correction, frozen=True, tag="link"):
    """The letter at `other` comes after the one at `at` in a word, and is joined to it where their ink is."""

    at: Spot
    other: Spot


class Placing(Correction, frozen=True, tag="place"):
    """The letter at `at` has this place in its word."""

    at: Spot
    place: Place


class Confirm(Correction, frozen=True, tag="confirm"):
    """The letter at `at` is right, in name and in extent; `text` : its name, which is then compared."""

    at: Spot
    text: str | None = None


class KeepOut(Correction, frozen=True, tag="keep_out"):
    """The letter at `at` is right, as `Confirm` says, and not to be written; with `out` false it is written again."""

    at: Spot
    text: str | None = None
    out: bool = True


class Strokes(Correction, frozen=True, tag="strokes"):
    """The letter at `at` was written so: places along each of its strokes, in order."""

    at: Spot
    ways: tuple[tuple[Spot, ...], ...]


class Outline(Correction, frozen=True, tag="outline"):
    """The writing inside the polygon `within` is the letter `text`, whosever it was."""

    within: tuple[Spot, ...]
    text: str


class Paint(Correction, frozen=True, tag="paint"):
    """Ink is paper, or paper is ink: under a brush `width` pixels wide along `stroke`, or inside `polygon`.

    Ink has a line, so it is painted with the brush alone.
    """

    to: Literal["ink", "paper"]
    stroke: tuple[Spot, ...] | None = None
    width: float | None = None
    polygon: tuple[Spot, ...] | None = None


class Rule(Correction, frozen=True, tag="rule"):
    """What runs from `a` to `b`, `width` pixels wide, is a printed rule of the paper, or was taken for one and is ink.

    With a rule that is paper go those like it on the page; strokes that cross it stay.
    """

    a: Spot
    b: Spot
    width: float
    to: Literal["ink", "paper"] = "paper"


class Baseline(Correction, frozen=True, tag="baseline"):
    """The baseline of line `line`, from 0, runs through `a` and `b`, bent as it is."""

    line: int
    a: Spot
    b: Spot


class Cut(Correction, frozen=True, tag="cut"):
    """The strokes that the line from `a` to `b` crosses do not hang together there."""

    a: Spot
    b: Spot


class Join(Correction, frozen=True, tag="join"):
    """The stroke at `at` and the one at `other` are one, though no ink leads from one to the other."""

    at: Spot
    other: Spot


AnyCorrection = Union[  # noqa: UP007  (msgspec reads it)
    Label,
    Merge,
    Split,
    Remove,
    Unlink,
    Link,
    Placing,
    Confirm,
    KeepOut,
    Strokes,
    Outline,
    Paint,
    Rule,
    Baseline,
    Cut,
    Join,
]
_Several = list[AnyCorrection]


class Change(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A letter that became another because of what was corrected elsewhere.

    letter, word : its name, and the word of the transcript it stands in.
    page, line : numbers from 0.
    at : a place on it, pixels of the scan; where it was, if it is there no longer.
    how : "moved" where most of its ink is other ink now, "recut" where some is, "found" or "lost".
    """

    letter: str
    word: str
    page: int
    line: int
    at: Spot
    how: Literal["moved", "recut", "found", "lost"]


class JournalEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What was corrected together, and what else that changed."""

    corrections: tuple[AnyCorrection, ...]
    changes: tuple[Change, ...] = ()


class CorrectionJournal(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All that was corrected of a hand, in order; the first `made` entries are in force, the others were undone."""

    entries: tuple[JournalEntry, ...] = ()
    made: int = 0
    format: int = 2

    @property
    def corrections(self) -> tuple[AnyCorrection, ...]:
        """The corrections that are in force."""
        return tuple(correction for entry in self.entries[: self.made] for correction in entry.corrections)


class Corrections(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Corrections in the order in which they were made; format : of this table."""

    corrections: tuple[AnyCorrection, ...] = ()
    format: int = 1


class Applied(NamedTuple):
    """A hand with corrections made; sentences to show the user; page and number in its text of letters removed."""

    hand: ScannedHand
    notes: tuple[str, ...] = ()
    removed: frozenset[tuple[int, int]] = frozenset()


def read_corrections(data: bytes, source: str) -> tuple[AnyCorrection, ...]:
    """The corrections in a JSON text: an object with a list ``corrections``, or that list alone.

    Raises InputError: not JSON, or an operation that there is not.
    """
    try:
        if data.lstrip().startswith(b"["):
            return tuple(msgspec.json.decode(data, type=_Several))
        document = msgspec.json.decode(data, type=Corrections)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise InputError(f"{source}: cannot be read as corrections: {error}.") from error
    if document.format != 1:
        raise InputError(f"{source}: corrections of format {document.format}; this program knows format 1.")
    return document.corrections


def apply(hand: ScannedHand, corrections: Sequence[AnyCorrection], *, strict: bool = True) -> ScannedHand:
    """The hand with corrections made, in their order; `hand` itself stays as it is.

    strict : False: a letter may be called what the transcript has not, as earlier programs allowed.

    Raises InputError: a correction that finds nothing within 1 mm of its place, or cannot be made; the message has its
    number.
    """
    return apply_and_tell(hand, corrections, strict=strict).hand


def apply_and_tell(hand: ScannedHand, corrections: Sequence[AnyCorrection], *, strict: bool = True) -> Applied:
    """As `apply`, with what else is to be told."""
    if not corrections:
        return Applied(hand)
    work = HandEditor(hand, strict)
    for number, correction in enumerate(corrections, 1):
        try:
            _apply(work, correction)
        except CorrectionError as error:
            raise InputError(f"Correction {number} ({correction.kind}, page {correction.page}): {error}.") from error
    return Applied(work.finish(), tuple(dict.fromkeys(work.notes)), frozenset(work.removed))


def _apply(work: HandEditor, correction: AnyCorrection) -> None:
    work.turn_to(correction.page)
    match correction:
        case Label(at=at, text=text, place=place):
            work.label(at, text, place)
        case Merge(at=at, other=other, text=text):
            work.merge(at, other, text)
        case Split(a=a, b=b, texts=texts):
            work.split_letter(a, b, texts)
        case Remove(at=at):
            work.remove(at)
        case Unlink(at=at):
            work.unlink(at)
        case Link(at=at, other=other):
            work.link(at, other)
        case Confirm(at=at, text=text):
            work.confirm(at, text)
        case KeepOut(at=at, text=text, out=out):
            work.confirm(at, text, kept_out=out)
        case Strokes(at=at, ways=ways):
            work.strokes(at, ways)
        case Outline(within=within, text=text):
            work.letter(within, text)
        case Placing(at=at, place=place):
            work.place(at, place)
        case _:
            _apply_to_page(work, correction)


def _apply_to_page(work: HandEditor, correction: Correction) -> None:
    """Make a correction of ink or lines, whosever they are."""
    match correction:
        case Paint(stroke=stroke, polygon=polygon, width=width, to=to):
            if (stroke is None) == (polygon is None) or (stroke is None) != (width is None):
                raise CorrectionError("paint has a stroke with its width, or a polygon")
            if to == "paper":
                work.paint_paper(stroke or polygon or (), width)
            elif stroke is None or width is None:
                raise CorrectionError("ink is painted with a stroke and its width: a letter needs the pen's line")
            else:
                work.paint_ink(stroke, width)
        case Rule(a=a, b=b, width=width, to="paper"):
            work.rule(a, b, width)
        case Rule(a=a, b=b, width=width):
            work.paint_ink((a, b), width)
        case Baseline(line=line, a=a, b=b):
            work.baseline(line, a, b)
        case Cut(a=a, b=b):
            work.cut_strokes(a, b)
        case Join(at=at, other=other):
            work.join(at, other)
