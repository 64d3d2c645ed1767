"""What every hand answers, whether it was drawn, scanned or recorded, so that nobody has to ask which it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, Self

if TYPE_CHECKING:
    from handout.hand.scanned import ScannedPage


@dataclass(frozen=True)
class Repertoire:
    """What a hand can write: graphemes, and combining accents that it can put on them.

    lendable : graphemes that it could be lent, of which a complaint tells.
    """

    name: str
    letters: frozenset[str]
    marks: frozenset[str]
    lendable: frozenset[str] = frozenset()


class AnyHand(Protocol):
    """A hand.

    name, title : what it is called; for people.
    pages : the pages whose ink its letters are, scanned or recorded; None where they are plans for a pen.
    x_height : usual height of a small letter, mm; pitch : usual distance of lines, x-heights.
    letters : how often there is each letter, or how many glyphs a drawn one has.
    repertoire : what it can write.
    """

    @property
    def name(self) -> str: ...
    @property
    def title(self) -> str: ...
    @property
    def pages(self) -> tuple[ScannedPage, ...] | None: ...
    @property
    def x_height(self) -> float: ...
    @property
    def pitch(self) -> float: ...
    @property
    def letters(self) -> Mapping[str, int]: ...
    @property
    def repertoire(self) -> Repertoire: ...
    def with_language(self, code: str) -> Self:
        """The hand with the forms that a language has of its own, by its code, sr or bg-BG; a scanned one as it is."""

    def with_haste(self, haste: float) -> Self:
        """The hand written with haste: −1 (careful) to 1 (as fast as it goes), 0 as it is.

        Raises InputError: a haste outside −1 to 1, or a hand that is as hurried as it was written.
        """

    def x_height_on(self, spacing: float, usual: float) -> float:
        """Height of its small letters on lines `spacing` mm apart; `usual` is people's, as a share of that."""
