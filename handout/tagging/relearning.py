"""A page aligned anew after a person has corrected some of its letters: what is known teaches the rest.

Letters that a person confirmed stay as they are.  The networks learn from them as from truth, whatever fold they are
in; the transcript is laid along the line with their ends fixed; and their ink is given to nobody else.  Every other
letter keeps its place unless the page now speaks for another by more than `RelearningSettings.stay`, so that a
correction does not move what was right.  The neighbours of confirmed letters may exchange ink.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from handout.alphabet import SPACE
from handout.hand.corrections import AnyCorrection, Change, Correction, apply_and_tell
from handout.hand.page_editor import line_alone
from handout.hand.places import graphemes, word_at
from handout.hand.scanned import NOBODY, ScannedGlyph, ScannedHand, ScannedPage
from handout.networks import one_thread
from handout.progress import Tell, narrow_reports, silent
from handout.scanning.text_lines import line_owners
from handout.tagging import network
from handout.tagging.alignment import POOR, AlignedLine, Alignment, aligned_letters, line_fits
from handout.tagging.decoder import Held
from handout.tagging.glyph_extraction import extract_glyphs, letters_within_reach, reaches_edge
from handout.tagging.ink_exchange import exchange_ink
from handout.tagging.letter_assignment import LEAD, assign_letters
from handout.tagging.line_space import X_HEIGHT, LineFrame, LineStrip, lines_at, strips
from handout.tagging.segmentation import by_segments, page_reader
from handout.tagging.transcript import TranscriptLine, in_one_line, read_transcript
from handout.values import Indices


@dataclass(frozen=True)
class RelearningSettings:
    """How letters are held in place; measured on three simulated pages and a real one, whose truth did the correcting.

    With `stay` from 0 to 1 as many other letters went wrong as became right, with 4 up to 4 of 719, with 10 at most 1
    (of two pages).
    """

    stay: float = 10.0  # of the score: what moving a letter that nobody confirmed has to be worth
    reach: float = 0.25  # of a letter's width, by which its ends may lie elsewhere and it has not moved
    least: float = 0.15  # x-heights: the same, of narrow letters
    body: tuple[float, float] = (-0.2, 1.2)  # x-heights over the baseline, between which the ends of letters are seen
    apart: float = 0.45  # x-heights: letters nearer than this share the border between them
    same: float = 0.9  # share of ink in common from which a letter has not changed
    moved: float = 0.5  # the same, below which it is another place
    edge: float = 1 / 3  # of the usual opacity of the middle of strokes: where a line's edge is


_SETTINGS = RelearningSettings()


class Corrected(NamedTuple):
    """What corrections made of a hand.

    hand : with the corrections, and what was learned from them.
    changes : the letters that changed though nobody named them, in the order of the pages' texts.
    notes : sentences to show the user.
    """

    hand: ScannedHand
    changes: tuple[Change, ...]
    notes: tuple[str, ...] = ()


def correct(
    hand: ScannedHand,
    corrections: AnyCorrection | Sequence[AnyCorrection],
    *,
    learning: bool = True,
    tell: Tell = silent,
) -> Corrected:
    """Make corrections to a hand, and align the pages that they are on anew, with what they teach.

    corrections : one, or several that are made in their order and learned from together.
    learning : False: only what they say is done.
    tell : told how far it has come.

    Raises InputError: a correction that cannot be made; the message has its number.

    Source: own method.
    """
    made = [corrections] if isinstance(corrections, Correction) else list(corrections)
    corrected, notes, removed = apply_and_tell(hand, made)
    pages = sorted({correction.page for correction in made}) if learning else []
    for number, page in enumerate(pages):
        part = narrow_reports(tell, number / len(pages), (number + 1) / len(pages))
        corrected = realign_page(corrected, page, rng=np.random.default_rng((0, page)), tell=part)
    return Corrected(corrected, changes(hand, corrected, removed), notes)


def changes(
    before: ScannedHand, after: ScannedHand, named: frozenset[tuple[int, int]] = frozenset()
) -> tuple[Change, ...]:
    """The letters of the pages' texts that are elsewhere than before.

    named : page and number in its text of letters to leave out; those that a person confirmed are, anyway.
    """
    unmoved = _find_unmoved(before, after)
    old, new = _inks(before, unmoved), _inks(after, unmoved)
    found: list[Change] = []
    for (page, at), one in sorted({**old, **new}.items()):
        is_, was = new.get((page, at)), old.get((page, at))
        if is_ is not None and was is not None:
            shared = len(is_.ink & was.ink) / len(is_.ink | was.ink)
            if is_.glyph.confirmed or shared >= _SETTINGS.same:
                continue
            how: Literal["moved", "recut", "found", "lost"] = "moved" if shared < _SETTINGS.moved else "recut"
        elif (is_ is not None and is_.glyph.confirmed) or (is_ is None and (page, at) in named):
            continue
        else:
            how = "lost" if is_ is None else "found"
        one = is_ or one
        hand = after if is_ else before
        units = graphemes(hand.pages[page].transcript)
        spot = hand.pages[page].graph.uv[one.glyph.vertices[len(one.glyph.vertices) // 2]]
        place = (round(float(spot[0]), 1), round(float(spot[1]), 1))
        found.append(Change(one.glyph.letter, word_at(units, at), page, one.glyph.line, place, how))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class _PlacedInk:
    """A glyph, and the places of its vertices in sixteenths of a pixel, as a file keeps them."""

    glyph: ScannedGlyph
    ink: frozenset[tuple[int, int]]


def _find_unmoved(before: ScannedHand, after: ScannedHand) -> set[tuple[int, int]]:
    """Page and number in its text of the glyphs whose vertices lie where they lay."""
    old = {(glyph.page, glyph.at): glyph.vertices for glyph in before.glyphs}
    pages = [(was.graph.uv, is_.graph.uv) for was, is_ in zip(before.pages, after.pages, strict=True)]
    unmoved = set()
    for glyph in after.glyphs:
        key, (was, is_) = (glyph.page, glyph.at), pages[glyph.page]
        if key in old and len(old[key]) == len(glyph.vertices):
            same = np.array_equal(old[key], glyph.vertices) if was is is_ else False
            if same or np.array_equal(was[old[key]], is_[glyph.vertices]):
                unmoved.add(key)
    return unmoved


def _inks(hand: ScannedHand, unmoved: set[tuple[int, int]]) -> dict[tuple[int, int], _PlacedInk]:
    """The glyphs by page and number in the text, without those that have not moved."""
    glyphs = [glyph for glyph in hand.glyphs if glyph.at >= 0 and (glyph.page, glyph.at) not in unmoved]
    uv = [page.graph.uv for page in hand.pages]
    return {
        (g.page, g.at): _PlacedInk(
            g, frozenset((x, y) for x, y in np.rint(uv[g.page][g.vertices] * 16).astype(int).tolist())
        )
        for g in glyphs
    }


def realign_page(hand: ScannedHand, number: int, *, rng: np.random.Generator, tell: Tell = silent) -> ScannedHand:
    """The hand with one of its pages aligned anew; what is confirmed there stays.

    hand : with its corrections made.
    number : of the page.
    rng : the same generator gives the same hand.
    tell : told how far it has come.
    """
    page = hand.pages[number]
    own = [glyph for glyph in hand.glyphs if glyph.page == number]
    if page.moments is not None or not len(page.baselines) or not any(glyph.at >= 0 for glyph in own):
        return hand
    ink = page_ink(page)
    lines = strips(ink, line_frames(page))
    texts = line_texts(page, own)
    held = [held_letters(page, lines[i], texts[i], own, i) for i in range(len(lines))]
    alignment = _align_lines(lines, texts, held, rng, tell)
    owner = lines_at(line_owners(ink, [line.frame for line in lines]), page.graph.uv)
    glyphs = _glyphs(page, own, alignment, _find_stayed(alignment, texts, held), owner)
    return with_page(hand, number, glyphs)


def page_ink(page: ScannedPage) -> NDArray[np.bool_]:
    """(h, w) where a page has ink that may be a letter's, told by the opacity that a hand keeps."""
    x, y = page.texture.corner
    height, width = page.texture.shape
    alpha = page.texture.alpha
    column, row = np.rint(page.graph.uv - (x, y)).astype(np.intp).T
    inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
    middle = alpha[row[inside], column[inside]]
    usual = float(np.median(middle[middle > 0])) if (middle > 0).any() else 255.0
    ink = np.zeros(page.shape, dtype=bool)
    ink[y : y + height, x : x + width] = alpha >= _SETTINGS.edge * usual
    if len(page.dismissed):
        dismissed = np.isin(np.arange(len(page.graph)), page.dismissed)
        ink &= ~line_alone(page.graph, dismissed, page.shape, page.pixel)
    return ink


def line_frames(page: ScannedPage) -> list[LineFrame]:
    unit = page.x_height / page.pixel
    return [
        LineFrame(baseline=(c0, c1, c2), x_height=unit, slant=page.slant, middle=middle, reach=reach)
        for c0, c1, c2, middle, reach in page.baselines.tolist()
    ]


def line_texts(page: ScannedPage, glyphs: Sequence[ScannedGlyph]) -> list[TranscriptLine]:
    """What is written on each line of a page, from the letters that were found there.

    Letters that were not found, between two lines, go with the line of the transcript that they stand in.
    """
    rows = read_transcript(page.transcript)
    text = in_one_line(rows)
    place = {at: i for i, at in enumerate(text.at) if text.letters[i] != SPACE}
    row_of = {at: row for row, line in enumerate(rows) for at in line.at}
    line_of = {glyph.at: glyph.line for glyph in glyphs if glyph.at in place}
    count = len(page.baselines)
    firsts: list[int | None] = [None] * count
    lasts: list[int | None] = [None] * count
    highest = -1
    for at in sorted(line_of):
        line = max(line_of[at], highest)
        highest = line
        firsts[line] = place[at] if firsts[line] is None else firsts[line]
        lasts[line] = place[at]
    used = [line for line in range(count) if firsts[line] is not None]
    parts = [text.part(0, 0)] * count
    start = 0
    for line, following in zip(used, [*used[1:], None], strict=True):
        stop = len(text.letters)
        if following is not None:
            last, first = lasts[line], firsts[following]
            assert last is not None and first is not None
            own_row = row_of[text.at[last]]
            stop = next((i for i in range(last + 1, first) if row_of.get(text.at[i], own_row) != own_row), first)
        kept = [i for i in range(start, stop) if text.letters[i] != SPACE]
        parts[line] = text.part(kept[0], kept[-1] + 1)
        start = stop
    return parts


def held_letters(
    page: ScannedPage, strip: LineStrip, text: TranscriptLine, glyphs: Sequence[ScannedGlyph], line: int
) -> dict[int, Held]:
    """Where the letters of a line are now, by their number in its text."""
    at = {place: i for i, place in enumerate(text.at) if text.letters[i] != SPACE}
    there = {at[glyph.at]: glyph for glyph in glyphs if glyph.line == line and glyph.at in at}
    ends = {i: _ends(page, strip, glyph) for i, glyph in there.items()}
    joined = {i: bool(glyph.ligatures) for i, glyph in there.items()}
    lead = X_HEIGHT * LEAD * sum(joined.values()) / max(len(joined), 1)
    for i in sorted(ends):
        if i + 1 in ends and abs(ends[i + 1][0] - ends[i][1]) < _SETTINGS.apart * X_HEIGHT:
            border = (ends[i][1] + ends[i + 1][0]) / 2 + lead * joined[i]
            ends[i], ends[i + 1] = (ends[i][0], border), (border, ends[i + 1][1])
    held = {}
    for i, (left, right) in ends.items():
        reach = max(_SETTINGS.reach * (right - left), _SETTINGS.least * X_HEIGHT)
        if right > left:
            held[i] = Held(left, right, reach, np.inf if there[i].confirmed else _SETTINGS.stay)
    return held


def _ends(page: ScannedPage, strip: LineStrip, glyph: ScannedGlyph) -> tuple[float, float]:
    """Where a letter's ink begins and ends along its line, pixels of the strip."""
    u, up = strip.frame.to_line(page.graph.uv[glyph.vertices]).T
    low, high = _SETTINGS.body
    seen = (up > low * X_HEIGHT) & (up < high * X_HEIGHT)
    u = u[seen] if seen.any() else u
    return float(u.min()), float(u.max())


@one_thread
def _align_lines(
    lines: Sequence[LineStrip],
    texts: Sequence[TranscriptLine],
    held: Sequence[Mapping[int, Held]],
    rng: np.random.Generator,
    tell: Tell,
) -> Alignment:
    some = [i for i, text in enumerate(texts) if text.letters]
    reader = page_reader([line.image for line in lines], network.load_networks()).part(some)
    written = [texts[i] for i in some]
    decodings = by_segments(reader, written, rng, tell, held=[held[i] for i in some])
    fitting = line_fits(reader, written, rng)
    aligned = tuple(
        AlignedLine(i, lines[i].frame, aligned_letters(lines[i].frame, texts[i], of_line), fit)
        for i, of_line, fit in zip(some, decodings, fitting, strict=True)
    )
    return Alignment(aligned, tuple(i for i, fit in zip(some, fitting, strict=True) if fit < POOR))


def _find_stayed(
    alignment: Alignment, texts: Sequence[TranscriptLine], held: Sequence[Mapping[int, Held]]
) -> frozenset[int]:
    """The letters, by their number in the transcript, both ends of which lie where they were."""
    stayed = set()
    for line in alignment.lines:
        known = {texts[line.number].at[i]: hold for i, hold in held[line.number].items()}
        for letter in line.letters:
            if letter.present and (hold := known.get(letter.at)) is not None:
                left, right = ((x - line.frame.left) * line.frame.scale for x in (letter.left, letter.right))
                if abs(left - hold.left) <= hold.reach and abs(right - hold.right) <= hold.reach:
                    stayed.add(letter.at)
    return frozenset(stayed)


def _glyphs(
    page: ScannedPage, before: Sequence[ScannedGlyph], alignment: Alignment, stayed: frozenset[int], owner: Indices
) -> list[ScannedGlyph]:
    """The letters of the page: those that are confirmed or stayed with their ink, the others from the alignment."""
    fixed = {glyph.at: glyph for glyph in before if glyph.at >= 0 and (glyph.confirmed or glyph.at in stayed)}
    extra = [glyph for glyph in before if glyph.at < 0 and glyph.confirmed]
    free = np.array(owner)
    for glyph in (*fixed.values(), *extra):
        free[glyph.vertices] = NOBODY
    free[page.dismissed] = NOBODY
    # the others are assigned as if the letters `fixed` were not on the page
    letters = assign_letters(page.graph, _mark_present(alignment, dict.fromkeys(fixed, False)), free).letter
    letters = letters_within_reach(page.graph, alignment, letters)
    for number, letter in enumerate(alignment.letters):
        if letter.at in fixed:
            letters[fixed[letter.at].vertices] = number
    whole = _mark_present(alignment, dict.fromkeys(fixed, True))
    known = {glyph.at for glyph in fixed.values() if glyph.confirmed}
    held = frozenset(number for number, letter in enumerate(whole.letters) if letter.at in known)
    glyphs, _ = extract_glyphs(page, whole, *exchange_ink(page, whole, letters, held))
    cropped = reaches_edge(page.graph, page.shape, page.pixel)
    made = [_settle_glyph(glyph, fixed.get(glyph.at), bool(cropped[glyph.vertices].any())) for glyph in glyphs]
    return made + [replace(glyph, before=NOBODY, after=NOBODY, ligatures=()) for glyph in extra]


def _settle_glyph(glyph: ScannedGlyph, fixed: ScannedGlyph | None, cropped: bool) -> ScannedGlyph:
    if fixed is not None and fixed.confirmed:
        return replace(
            glyph, vertices=fixed.vertices, confirmed=True, confidence=1.0, place=fixed.place, kept_out=fixed.kept_out
        )
    if fixed is not None and not cropped:
        # it stands where it stood: what was learned can speak for it
        return replace(glyph, confidence=max(glyph.confidence, fixed.confidence))
    return replace(glyph, confidence=0.0) if cropped else glyph


def _mark_present(alignment: Alignment, present: Mapping[int, bool]) -> Alignment:
    lines = tuple(
        replace(line, letters=tuple(replace(x, present=present.get(x.at, x.present)) for x in line.letters))
        for line in alignment.lines
    )
    return replace(alignment, lines=lines)


def with_page(hand: ScannedHand, number: int, glyphs: Sequence[ScannedGlyph]) -> ScannedHand:
    """The hand with other glyphs on one page; `glyphs` are numbered from 0."""
    pages: list[list[int]] = [[] for _ in hand.pages]
    for i, glyph in enumerate(hand.glyphs):
        pages[glyph.page].append(i)
    place, own, count = {NOBODY: NOBODY}, {NOBODY: NOBODY}, 0
    for page, numbers in enumerate(pages):
        here = range(len(glyphs)) if page == number else numbers
        (own if page == number else place).update(zip(here, range(count, count + len(here)), strict=True))
        count += len(here)
    together: list[ScannedGlyph] = []
    for page, numbers in enumerate(pages):
        if page == number:
            moved = (glyph if glyph.page == page else replace(glyph, page=page) for glyph in glyphs)
            together += [glyph.with_neighbours(own) for glyph in moved]
        else:
            together += [hand.glyphs[i].with_neighbours(place) for i in numbers]
    return replace(hand, glyphs=tuple(together))
