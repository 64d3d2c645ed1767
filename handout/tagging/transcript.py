"""A transcript as the aligner takes it: lines of letters of the alphabet, each knowing where in the text it stands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from handout.alphabet import JUNK, SPACE, resemble, struck_out
from handout.errors import InputError
from handout.hand.places import graphemes


@dataclass(frozen=True)
class TranscriptLine:
    """What is written on one line of a page.

    letters : of the alphabet, single spaces between words.
    spelt : the graphemes of the text that they stand for; of something struck out, all of it.
    at : index of each in the graphemes of the whole transcript.
    """

    letters: tuple[str, ...]
    spelt: tuple[str, ...]
    at: tuple[int, ...]

    @property
    def text(self) -> str:
        return "".join(self.spelt)

    def part(self, start: int, stop: int) -> TranscriptLine:
        """The letters from `start` up to `stop`."""
        return TranscriptLine(self.letters[start:stop], self.spelt[start:stop], self.at[start:stop])


def read_transcript(text: str) -> list[TranscriptLine]:
    """The lines of a transcript that are not empty; ``~~words~~`` were struck out.

    Raises InputError: nothing is written in it.
    """
    lines: list[TranscriptLine] = []
    units = graphemes(text)
    ends = [i for i, unit in enumerate(units) if unit in ("\n", "\r\n", "\r")]
    for start, stop in pairwise([-1, *ends, len(units)]):
        line = _read_line("".join(units[start + 1 : stop]), start + 1)
        if line.letters:
            lines.append(line)
    if not lines:
        raise InputError("The transcript is empty: give what is written on the page, line by line.")
    return lines


def _read_line(line: str, at: int) -> TranscriptLine:
    letters: list[str] = []
    spelt: list[str] = []
    places: list[int] = []
    # the line cut where something struck out begins and ends
    pieces: list[tuple[str, bool]] = []
    done = 0
    for start, stop in struck_out(line):
        pieces += [(line[done:start], False), (line[start:stop], True)]
        done = stop
    for piece, struck in [*pieces, (line[done:], False)]:
        units = graphemes(piece)
        if struck and piece:
            letters.append(JUNK)
            spelt.append(piece)
            places.append(at)
        for i, unit in enumerate([] if struck else units):
            letter = resemble(unit)
            if letter != SPACE or (letters and letters[-1] != SPACE):
                letters.append(letter)
                spelt.append(" " if letter == SPACE else unit)
                places.append(at + i)
        at += len(units)
    end = len(letters) - (bool(letters) and letters[-1] == SPACE)
    return TranscriptLine(tuple(letters), tuple(spelt), tuple(places)).part(0, end)


def in_one_line(lines: Sequence[TranscriptLine]) -> TranscriptLine:
    """All lines joined by spaces; a hyphen at the end of a line stays."""
    letters: list[str] = []
    spelt: list[str] = []
    at: list[int] = []
    for number, line in enumerate(lines):
        if number:
            letters.append(SPACE)
            spelt.append(" ")
            at.append(line.at[0] - 1)
        letters += line.letters
        spelt += line.spelt
        at += line.at
    return TranscriptLine(tuple(letters), tuple(spelt), tuple(at))
