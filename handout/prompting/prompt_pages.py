"""Pages of sentences to copy, line by line: a pangram, then what adds most, then what holds the last characters.

Source: seed 000, §4.1.
"""

from __future__ import annotations

import string
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field

from handout.errors import DoesNotFit, InputError
from handout.prompting import corpus
from handout.prompting.sentence_choice import Closing, Frequencies, SentenceChooser, pangrams

_TRIES = 200  # sentences that are tried for the rest of a page
_LEAST = 12  # characters of a page that are left empty rather than searched for a sentence that short


@dataclass(frozen=True)
class Prompt:
    """What is to be copied: the lines of each page, and the sentences of all of them in order."""

    pages: tuple[tuple[str, ...], ...]
    sentences: tuple[str, ...]

    @property
    def words(self) -> int:
        """Of all pages."""
        return sum(len(line.split()) for page in self.pages for line in page)


@dataclass
class _FilledPage:
    """A page being filled: its lines, and how many more there may be."""

    room: int
    width: int
    lines: list[str] = field(default_factory=list)

    def add(self, text: str) -> None:
        """Append a text."""
        self.lines = self._wrap_with(text)

    def fits(self, text: str) -> bool:
        """Whether a text could still be appended."""
        return len(self._wrap_with(text)) <= self.room

    def _wrap_with(self, text: str) -> list[str]:
        # only the last line can change
        return self.lines[:-1] + wrap(" ".join([*self.lines[-1:], text]), self.width)

    @property
    def characters_left(self) -> int:
        """Characters that may still fit."""
        last = len(self.lines[-1]) + 1 if self.lines else 0
        return (self.room - max(len(self.lines), 1) + 1) * self.width - last


def prompt(
    sentences: Sequence[str],
    target: Frequencies,
    characters: str = corpus.PRINTABLE,
    *,
    pages: int = 4,
    lines: int = 23,
    width: int = 51,
    language: str = "en",
) -> Prompt:
    """Choose sentences for some pages of a number of lines.

    sentences : sequence of str: to choose from; those with characters that are neither printable ASCII nor in
        `characters` lose their accents or are passed over.
    target : of the text that will be wanted.
    characters : each occurs at least once.
    pages, lines, width : at most so many pages of so many lines of so many characters.
    language : of the sentences that hold the last characters.

    Raises InputError: no sentence can be used. DoesNotFit: there is no room for all characters.

    Source: seed 000, §4.1.
    """
    if min(pages, lines) < 1 or width < 10:
        raise InputError(f"{pages} pages of {lines} lines of {width} characters leave no room: give at least 1, 1, 10.")
    required = dict.fromkeys(char for char in characters if not char.isspace())
    allowed = frozenset(corpus.PRINTABLE) | frozenset(required) | {" "}
    pool = corpus.usable(sentences, allowed)
    if not pool:
        raise InputError("No sentence of the corpus can be used: it needs sentences of two words or more.")
    first: set[int] = set()
    if required.keys() >= set(string.ascii_lowercase) and not (first := set(pangrams(pool))):
        shipped = corpus.usable(corpus.shipped_sentences(), allowed)
        added = [shipped[i] for i in pangrams(shipped)]
        pool, first = pool + added, set(range(len(pool), len(pool) + len(added)))
    closing = Closing(corpus.usable(corpus.shipped_sentences(language), allowed))
    chooser, blank = SentenceChooser(pool, target), [_FilledPage(lines, width) for _ in range(pages)]
    return _fill_pages(chooser, first, set(required), closing, blank)


def _fill_pages(
    chooser: SentenceChooser, first: set[int], missing: set[str], closing: Closing, pages: list[_FilledPage]
) -> Prompt:
    """Fill page after page; `first` are the sentences that may stand first (none: any)."""
    chosen: list[str] = []
    for page in pages:
        tail = _tail(closing, missing, chosen, page) if page is pages[-1] else []
        while (index := _choose_next(chooser, page, first if not chosen else set(), " ".join(tail))) is not None:
            chosen.append(chooser.take(index))
            page.add(chosen[-1])
            missing.difference_update(chosen[-1])
            if tail:  # without some of its words it never takes more lines, but newly chosen sentences may
                fresh = closing.sentences(missing, chosen)
                tail = [sentence for sentence in tail if not missing.isdisjoint(sentence)]
                if len(" ".join(fresh)) < len(" ".join(tail)) and page.fits(" ".join(fresh)):
                    tail = fresh
        for sentence in tail:
            page.add(sentence)
        chosen.extend(tail)
    return Prompt(tuple(tuple(page.lines) for page in pages if page.lines), tuple(chosen))


def _tail(closing: Closing, missing: set[str], chosen: list[str], page: _FilledPage) -> list[str]:
    """What must close the last page: sentences, or bare characters if these take too much room."""
    for tail in (closing.sentences(missing, chosen), closing.bare(missing)):
        if page.fits(" ".join(tail)):
            return tail
    raise DoesNotFit(
        f"The {len(missing)} characters asked for do not fit on a page of {page.room} lines of {page.width}: "
        "ask for fewer of them."
    )


def _choose_next(chooser: SentenceChooser, page: _FilledPage, first: set[int], tail: str) -> int | None:
    """The best sentence that fits the page together with the tail that must close it."""
    if page.characters_left - len(tail) < _LEAST:
        return None
    tries = 0
    for index in chooser.best().tolist():
        if (first and index not in first) or len(chooser.sentences[index]) + len(tail) > page.characters_left:
            continue
        if page.fits(" ".join(filter(None, (chooser.sentences[index], tail)))):
            return int(index)
        tries += 1
        if tries >= _TRIES:
            break
    return None


def wrap(text: str, width: int) -> list[str]:
    """Lines of at most `width` characters, broken at spaces (longer words anywhere)."""
    return textwrap.wrap(text, width, break_on_hyphens=False)
