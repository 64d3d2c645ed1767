"""The words of a letter, set in its hands, still without a place.

Every hand of a letter writes one text: the runs of the letter that are its own, in order, each a paragraph to it.  So a
hand varies, and takes turns with its glyphs, over the whole letter, and letters are known
by their places in that text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, groupby, pairwise
from typing import Any

import numpy as np

from handout.hand.drawn import Hand
from handout.hand.places import graphemes
from handout.hand.scanned import ScannedHand
from handout.letters.document import (
    Boxed,
    LetterFile,
    Paragraph,
    Signature,
    SpanManner,
    TableBlock,
    TextSpan,
    blocks_in,
)
from handout.writing.choosing import NO_REWRITES, GlyphChooser, Rewrites
from handout.writing.compose import Proofreader, handwriting, keep_setting
from handout.writing.pages import Handwriting, Unit, Word
from handout.writing.slips import slip
from handout.writing.text import FormulaLetters, Piece, TiedSpaces, may_part, normalise, paragraphs_of, spaces_of

_BREAK_AFTER = frozenset("-–—/")  # a line may end behind these though there is no space
_TOUCHING = 0.12  # x-heights between what two hands write of one word


@dataclass(frozen=True, eq=False, kw_only=True)
class LetterWord(Unit[Any]):
    """A word, or a part of one that is written in one manner; lengths in usual x-heights of the letter.

    written : the word as its hand has set it, in x-heights of its own.
    scale : usual x-heights in one of its own.
    manners : of each of its glyphs.
    breakable : whether a line may end before it.
    line : of the source.
    """

    written: Word[Any]
    scale: float = 1.0
    manners: tuple[SpanManner, ...] = ()
    breakable: bool = True
    line: int = 0

    @property
    def manner(self) -> SpanManner:
        """That of its first glyph."""
        return self.manners[0]


@dataclass(frozen=True)
class Run:
    """What a hand writes without another coming between.

    paragraph, line : number of the paragraph in the letter, and of the line in it, as hard breaks make them.
    spaces : before it.
    """

    paragraph: int
    line: int
    hand: str
    spans: tuple[TextSpan, ...]
    spaces: int
    may_slip: bool


@dataclass(frozen=True)
class Runs:
    """All runs of a letter, in its order, and behind them those of its page numbers."""

    runs: tuple[Run, ...]
    paragraphs: tuple[Paragraph, ...]
    name: str

    def of_hand(self, hand: str) -> list[Run]:
        """Those of a hand."""
        return [run for run in self.runs if run.hand == hand]

    @property
    def hands(self) -> tuple[str, ...]:
        """The hands that write something, "" for that of the letter."""
        return tuple(dict.fromkeys(run.hand for run in self.runs))

    def text(self, hand: str) -> str:
        """All that a hand writes, a run a line."""
        return "\n".join("".join(span.text for span in run.spans) for run in self.of_hand(hand))

    def lines(self, hand: str) -> list[int]:
        """The line of the source for each place in that text."""
        return [span.line for span in _spans(self.of_hand(hand))]

    def locate_message(self, hand: str, message: str) -> str:
        """A message about places in the text of a hand, which names the lines of the letter instead."""
        runs = self.of_hand(hand)

        def line(match: re.Match[str]) -> str:
            run, at = runs[int(match.group(1)) - 1], int(match.group(2))
            ends = accumulate(len(graphemes(span.text)) for span in run.spans)
            span = next((s for s, end in zip(run.spans, ends, strict=True) if at <= end), run.spans[-1])
            return f"line {span.line}"

        named = re.sub(r"line (\d+), character (\d+)", line, message)
        return f"{self.name}: " + re.sub(r"(line \d+)(; \1\b)+", r"\1", named)


def runs_of(letter: LetterFile, page_numbers: int = 0) -> Runs:
    """The runs of a letter, and of page numbers from 2 to `page_numbers`."""
    numbers = [Paragraph((TextSpan(str(n), SpanManner(), 1),), 1) for n in range(2, page_numbers + 1)]
    careful = (block for block in blocks_in(letter.blocks) if isinstance(block, Boxed | Signature | TableBlock))
    steady = {id(part) for block in careful for part in blocks_in((block,))}
    paragraphs = (*letter.paragraphs, *numbers)
    plain = len(paragraphs) - len(numbers)
    runs = [
        run
        for number, paragraph in enumerate(paragraphs)
        for run in _runs(number, paragraph, number < plain and not paragraph.level and id(paragraph) not in steady)
    ]
    return Runs(tuple(runs), paragraphs, letter.name)


def _runs(number: int, paragraph: Paragraph, may_slip: bool) -> Iterator[Run]:
    may_slip = may_slip and paragraph.kind == "text"
    for line, spans in enumerate(_lines(paragraph.spans)):
        before = ""
        for hand, group in groupby(spans, key=lambda span: span.manner.hand):
            own = list(group)
            text = "".join(span.text for span in own)
            bare = text.strip()
            if bare:
                yield Run(number, line, hand, _strip_spans(own), spaces_of(before + text.partition(bare)[0]), may_slip)
            before = text.rpartition(bare)[2] if bare else before + text


def _lines(spans: Sequence[TextSpan]) -> Iterator[list[TextSpan]]:
    """The spans, parted at newlines, in the characters that hands write."""
    line: list[TextSpan] = []
    for span in spans:
        first, *others = normalise(span.text).split("\n")
        line.append(replace(span, text=first))
        for text in others:
            yield line
            line = [replace(span, text=text)]
    yield line


def _strip_spans(spans: Sequence[TextSpan]) -> tuple[TextSpan, ...]:
    """Spans without the spaces at both ends of them all."""
    own = [span for span in spans if span.text]
    while own and not own[0].text.strip():
        own = own[1:]
    while own and not own[-1].text.strip():
        own = own[:-1]
    own[0] = replace(own[0], text=own[0].text.lstrip())
    own[-1] = replace(own[-1], text=own[-1].text.rstrip())
    return tuple(own)


@dataclass(frozen=True, eq=False)
class Writer:
    """A hand that writes a letter, or some of it.

    handwriting : that places what it has set.
    ratio : of its x-height to that of the letter's hand.
    words : of each of its runs, set.
    """

    hand: Hand | ScannedHand
    handwriting: Handwriting[Any]
    ratio: float
    words: tuple[tuple[LetterWord, ...], ...]


@dataclass(frozen=True)
class WriterOptions:
    """How a hand writes: see `compose.compose`; x_height, usual : mm, its own and that of the letter's hand."""

    x_height: float
    usual: float
    jitter: float
    fallback: bool = False
    slips: float = 0.0
    rewrites: Rewrites = NO_REWRITES
    ruled: bool = False


def write_runs(
    runs: Runs,
    name: str,
    hand: Hand | ScannedHand,
    options: WriterOptions,
    seed: Sequence[int],
    proofread: Proofreader | None = None,
) -> Writer:
    """The runs of a hand, set; errors are those of `compose.compose`."""
    rng = np.random.default_rng(seed)
    slip_stream = rng.spawn(1)[0] if options.slips else None
    streams = (rng, rng.spawn(1)[0])
    writer = handwriting(hand, streams, options.jitter, options.rewrites, ruled=options.ruled)
    own, ratio = runs.of_hand(name), options.x_height / options.usual
    if not own:
        return Writer(hand, writer, ratio, ())
    spans = _spans(own)
    paragraphs = paragraphs_of(runs.text(name), writer.repertoire, fallback=options.fallback, marked=True)
    parted = [list(_part_pieces(pieces, spans)) for pieces in paragraphs]
    if slip_stream is not None:
        parted = [
            next(slip([pieces], options.slips, slip_stream)) if run.may_slip else pieces
            for run, pieces in zip(own, parted, strict=True)
        ]
    choosers = [GlyphChooser(writer.stock, stream, min(options.jitter, 1.0)) for stream in streams]
    key = ("letter", tuple(seed), options.jitter, options.rewrites, bool(options.slips), options.ruled)
    set_pieces = keep_setting(key, hand, writer, choosers, proofread, options.rewrites)
    words = [tuple(_words(set_pieces(pieces), run, ratio, spans)) for run, pieces in zip(own, parted, strict=True)]
    return Writer(hand, writer, ratio, tuple(words))


def _spans(runs: Sequence[Run]) -> list[TextSpan]:
    """The span of each grapheme of the text of some runs, newlines included."""
    of_graphemes = list[TextSpan]()
    for run in runs:
        text, spans = "".join(span.text for span in run.spans), [s for s in run.spans for _ in s.text]
        at = 0
        for unit in graphemes(text):
            of_graphemes.append(spans[min(at, len(spans) - 1)])
            at += len(unit)
        of_graphemes.append(of_graphemes[-1])
    return of_graphemes


def _part_pieces(pieces: Sequence[Piece], spans: Sequence[TextSpan]) -> Iterator[Piece]:
    """Pieces, cut where the ink or the size changes: another pen, or another movement, is begun there."""
    for piece in pieces:
        if isinstance(piece, int):
            yield piece
            continue
        manners = [spans[letter.at].manner for letter in piece]
        kinds = [(manner.ink, manner.size) for manner in manners]
        cuts = [i for i in range(1, len(piece)) if kinds[i] != kinds[i - 1]]
        if isinstance(piece, FormulaLetters):
            yield from piece.split() if cuts else (piece,)
            continue
        yield from (piece[a:b] for a, b in pairwise([0, *cuts, len(piece)]))


def _words(units: Iterator[Unit[Any]], run: Run, ratio: float, spans: Sequence[TextSpan]) -> Iterator[LetterWord]:
    """The set words of a run, in usual x-heights of the letter."""
    last: tuple[str, ...] = ()
    for number, unit in enumerate(units):
        word = unit.word
        own = tuple(spans[at].manner for at in word.at)
        scale = ratio * own[0].size
        gap = unit.gap
        if number == 0:
            # the first gap is that of the run before, or an indent that there is none of
            gap = 0.0
        scaled: Word[Any] = Word(
            (), word.extents * scale, (), word.spelt, word.advance * scale, word.left * scale, word.right * scale
        )
        parted = number > 0 and (unit.gap > 0 or last[-1] in _BREAK_AFTER)
        breakable = parted and not unit.tied and may_part(last, word.spelt)
        yield LetterWord(
            scaled,
            gap * scale,
            unit.intended,
            written=word,
            scale=scale,
            manners=own,
            breakable=breakable,
            line=spans[word.at[0]].line,
        )
        last = word.spelt


def lines_of(runs: Runs, writers: Mapping[str, Writer]) -> dict[int, list[list[LetterWord]]]:
    """The words of each paragraph (`Runs.paragraphs`), line by line as hard breaks make them."""
    left = {name: iter(writer.words) for name, writer in writers.items()}
    lines: dict[int, list[list[LetterWord]]] = {}
    for run in runs.runs:
        words = list(next(left[run.hand]))
        of_paragraph = lines.setdefault(run.paragraph, [])
        while len(of_paragraph) <= run.line:
            of_paragraph.append([])
        line = of_paragraph[run.line]
        if line and words:
            gap = writers[run.hand].handwriting.space * words[0].scale if run.spaces else _TOUCHING
            words[0] = replace(words[0], gap=gap, breakable=run.spaces > 0 and not isinstance(run.spaces, TiedSpaces))
        line += words
    return lines
