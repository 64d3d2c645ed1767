"""What was written of a text last: a text that begins as it did goes on from there, with the same result."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

_MOST_KEPT = 4000  # parts of a text, of about 10 kB each in a drawn hand, of which each is a word


class Resumable(Protocol):
    """What remembers of a text what it wrote so far."""

    def state(self) -> Any:
        """What it remembers; nothing changes it any more."""

    def resume(self, state: Any) -> None:
        """Go on from a state of another that writes the same text."""


class WrittenPart(NamedTuple):
    """A part of a text, a word or a paragraph, as it was written.

    part : its letters and spaces.
    words : its words, each with the glyphs that were chosen; see `compose`.
    read : what a proofreader read of it.
    states : of what wrote it, when it was written.
    """

    part: object
    words: Sequence[Any]
    read: Sequence[Any]
    states: Sequence[Any]


@dataclass(eq=False)
class KeptText:
    """The parts of a text as they were written last, in order."""

    parts: Sequence[WrittenPart] = ()


@lru_cache(maxsize=2)
def last_text(of: Hashable) -> KeptText:
    """The last text of a hand, with its seed and all else that it depends on besides its letters."""
    return KeptText()


@dataclass(eq=False)
class TextWriting:
    """Writes a text part by part; those that begin the last one too are taken from there.

    kept : the last text, in whose place this one comes; writers : what its parts change.
    """

    kept: KeptText
    writers: Sequence[Resumable]
    _before: Sequence[WrittenPart] = field(init=False)
    _now: list[WrittenPart] = field(default_factory=list)
    _count: int = 0

    def __post_init__(self) -> None:
        self._before, self.kept.parts = self.kept.parts, self._now

    def write(self, part: object, make: Callable[[], Sequence[Any]], read: list[Any]) -> Sequence[Any]:
        """The words of the next part; `read` : what was read so far, to which that of the part comes."""
        number, self._count = self._count, self._count + 1
        if number < len(self._before) and self._before[number].part == part:
            written = self._before[number]
            read += written.read
        else:
            if self._before and number:
                for writer, state in zip(self.writers, self._now[-1].states, strict=True):
                    writer.resume(state)
            self._before, known = (), len(read)
            words = make()
            written = WrittenPart(part, words, read[known:], [writer.state() for writer in self.writers])
        if number < _MOST_KEPT:
            self._now.append(written)
        return written.words
