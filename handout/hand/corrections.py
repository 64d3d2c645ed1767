"""What a person corrects of a hand that was read from paper.

A correction names its letter by a place on the page, in pixels of the scan as it came from its file, so that it still
holds after the page has been read again.  What was found and what was corrected are kept apart: `apply` gives the hand
with the corrections made, and leaves the one that was found as it is.

Source: seed 000, §5.1.3 (labels, splits, links); merging and placing are own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Union

import msgspec

from handout.errors import InputError
from handout.hand.hand_editor import CorrectionError, HandEditor
from handout.hand.places import Place
from handout.hand.scanned import ScannedHand

Spot = tuple[float, float]  # x, y, pixels of the scan


class Correction(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", omit_defaults=True):
    """One correction. page : number of the page, from 0."""

    page: int


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


AnyCorrection = Union[Label, Merge, Split, Remove, Unlink, Link, Placing]  # noqa: UP007  (msgspec reads it)
_Several = list[AnyCorrection]


class Corrections(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Corrections in the order in which they were made; format : of this table."""

    corrections: tuple[AnyCorrection, ...] = ()
    format: int = 1


def read_corrections(data: bytes, source: str) -> tuple[AnyCorrection, ...]:
    """The corrections in a JSON text: an object with a list ``corrections``, or that list alone.

    Raises
    ------
    InputError
        Not JSON, or an operation that there is not.
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


def apply(hand: ScannedHand, corrections: Sequence[AnyCorrection]) -> ScannedHand:
    """The hand with corrections made, in their order; `hand` itself stays as it is.

    Raises
    ------
    InputError
        A correction that finds nothing within 1 mm of its place, or cannot be made; the message has its number.
    """
    if not corrections:
        return hand
    work = HandEditor(hand)
    for number, correction in enumerate(corrections, 1):
        try:
            _apply(work, correction)
        except CorrectionError as error:
            kind = correction.__struct_config__.tag
            raise InputError(f"Correction {number} ({kind}, page {correction.page}): {error}.") from error
    return work.done()


def _apply(work: HandEditor, correction: AnyCorrection) -> None:
    work.turn_to(correction.page)
    match correction:
        case Label(at=at, text=text, place=place):
            work.label(at, text, place)
        case Merge(at=at, other=other, text=text):
            work.merge(at, other, text)
        case Split(a=a, b=b, texts=texts):
            work.split(a, b, texts)
        case Remove(at=at):
            work.remove(at)
        case Unlink(at=at):
            work.unlink(at)
        case Link(at=at, other=other):
            work.link(at, other)
        case Placing(at=at, place=place):
            work.place(at, place)
