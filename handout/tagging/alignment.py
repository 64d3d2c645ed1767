"""What aligning a page with its transcript gives: where every letter is, how sure that is, how well each line fits."""

from __future__ import annotations

from dataclasses import dataclass

from handout.tagging.linespace import Frame

DOUBTFUL = 0.5  # confidence under which a letter is worth a look


@dataclass(frozen=True)
class Letter:
    """One letter on a page.

    at : index of its grapheme in the transcript.
    text : the grapheme; of something struck out, all of it.
    left, right : x where it begins and ends on the baseline, pixels of the page; the borders lean by the line's slant.
    confidence : 0–1, no probability: 1 where all networks agree on both ends, with and without having learned from the
        page, 0.5 where they lie a third of a tolerance apart.  Of letters under 0.5 more are wrong, but most are right.
    present : False where the page seems not to have it (it has no width then).
    """

    at: int
    text: str
    left: float
    right: float
    confidence: float
    present: bool = True


@dataclass(frozen=True)
class AlignedLine:
    """A line of the page with its letters, from left to right, without spaces.

    number : of the line on the page, from 0, counting the lines that were found.
    frame : where the line lies.
    fit : how well its text explains the line: 0 as its letters in another order would, 1 as well as anything could;
        right texts have 0.4 to 0.9.
    """

    number: int
    frame: Frame
    letters: tuple[Letter, ...]
    fit: float

    @property
    def text(self) -> str:
        """The letters in a row (spaces left out)."""
        return "".join(letter.text for letter in self.letters)


@dataclass(frozen=True)
class Alignment:
    """A page aligned with its transcript.

    lines : from top to bottom; lines of the page without text are missing.
    poor : numbers of the lines whose text seems not to be what is written there.
    method : the name of the method that was used.
    """

    lines: tuple[AlignedLine, ...]
    poor: tuple[int, ...] = ()
    method: str = "segments"

    @property
    def letters(self) -> tuple[Letter, ...]:
        """All letters of the page."""
        return tuple(letter for line in self.lines for letter in line.letters)

    @property
    def doubtful(self) -> tuple[Letter, ...]:
        """The letters worth a look, the least certain first."""
        low = [letter for letter in self.letters if letter.confidence < DOUBTFUL or not letter.present]
        return tuple(sorted(low, key=lambda letter: letter.confidence))
