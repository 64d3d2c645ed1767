"""The letters of a scanned hand on a desk: shown page by page, corrected one after another, each kept at once.

A correction is on the disk before it is answered, in a log beside the .hand file (`hand.pending`); the words around it
are aligned anew (`tagging.page_aligner`) before that, or at once after it (`align_letters`).  `keep_letters` takes the
log into the .hand file, which is done when there is time, and before anything else looks at that.  What the networks
learn from corrections takes a quarter of a minute, and is worked out apart, while letters go on being corrected
(`begin_learning`, `learn_apart`, `take_learnt`).

Every change says which revision of the hand it is about, so that two windows, or two programs, do not write over each
other's.
"""

from __future__ import annotations

import contextlib
import secrets
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from handout import atomic
from handout.branching import branches
from handout.errors import InputError, reported
from handout.hand import file, library
from handout.hand.corrections import AnyCorrection, CorrectionJournal, JournalEntry, Strokes, read_corrections
from handout.hand.pending import PendingLog
from handout.hand.places import graphemes, word_at
from handout.hand.scanned import NOBODY, ScannedGlyph, ScannedHand, ScannedPage
from handout.hand.vetting import REFUSED, SURE, vet
from handout.pipeline.hand_learning import learn
from handout.pipeline.page_tiles import TILE, Tiles
from handout.pipeline.results import SILENT, Facts, Listener
from handout.progress import narrow_reports
from handout.values import Array, Indices

if TYPE_CHECKING:
    from handout.tagging.page_aligner import PageAligner

_THINNED = 2  # every so manieth vertex of a line is shown: they lie about a pixel apart
_PATIENCE = 10.0  # s that a page waits for another program which changes the hand, before it is told
_MOST_DESKS = 3  # each holds the pictures of its pages once they were looked at


class StaleHand(InputError):
    """The hand was changed by somebody else since it was looked at."""


@dataclass(frozen=True, eq=False)
class _DeskState:
    """A hand and what is thought of it.

    probability : (n,) of each glyph to be what it is called, as far as it is known.
    """

    hand: ScannedHand
    probability: Array


@dataclass(eq=False)
class _LetterDesk:
    """A hand that is looked at.

    on_disk : time and size of the file and its log when they were last read or written here; others mean that another
        program has changed them.
    journal : of the file; steps : what was done since, each with the state before it; undone : steps to make again.
    revision : changes with the state.
    behind : pages with words around the last step that are still to be aligned, and the letters that it removed.
    """

    path: Path
    on_disk: tuple[int, int, int, int]
    journal: CorrectionJournal
    state: _DeskState
    steps: list[tuple[JournalEntry, _DeskState]] = field(default_factory=list)
    undone: list[tuple[AnyCorrection, ...]] = field(default_factory=list)
    revision: str = field(default_factory=lambda: secrets.token_hex(8))
    behind: tuple[set[int], frozenset[tuple[int, int]]] | None = None
    aligners: dict[int, PageAligner | None] = field(default_factory=dict)
    tiles: dict[int, Tiles] = field(default_factory=dict)
    shown: dict[tuple[int, int], tuple[tuple[object, ...], Facts]] = field(default_factory=dict)

    @property
    def entries_made(self) -> int:
        return self.journal.made + len(self.steps)

    @property
    def log(self) -> PendingLog:
        return PendingLog(self.path)

    def turn(self, state: _DeskState) -> None:
        """Take a new state, with a new revision."""
        self.state, self.revision = state, secrets.token_hex(8)

    def aligner(self, page: int) -> PageAligner | None:
        """What aligns a page anew; None for a page that cannot be aligned."""
        if page not in self.aligners:
            from handout.hand.author_reader import author_reader
            from handout.tagging.page_aligner import PageAligner

            sheet = self.state.hand.pages[page]
            can = PageAligner.can(sheet) and any(g.page == page and g.at >= 0 for g in self.state.hand.glyphs)
            self.aligners[page] = PageAligner(sheet, author_reader(self.state.hand)) if can else None
        return self.aligners[page]


_DESKS: dict[Path, _LetterDesk] = {}  # of the files that were looked at last


def _state_of(path: Path) -> tuple[int, int, int, int]:
    with reported(f"read {path}"):
        state, log = path.stat(), PendingLog(path).path
        return state.st_mtime_ns, state.st_size, state.st_ino, log.stat().st_size if log.exists() else 0


def _desk(name: str, aligned: bool = True) -> _LetterDesk:
    """The desk of a hand; corrections that a break left in its log are made again.

    aligned : False: words around the last step need not be aligned yet.
    """
    path = library.scanned_file(name)
    desk, on_disk = _DESKS.get(path), _state_of(path)
    if desk is not None and desk.on_disk == on_disk:
        if aligned:
            _align(desk)
        return desk
    _DESKS.pop(path, None)
    while len(_DESKS) >= _MOST_DESKS:
        _DESKS.pop(next(iter(_DESKS)))
    with _hold_file(path):
        on_disk = _state_of(path)
        hand, journal = file.load(path), file.journal(path)
        desk = _LetterDesk(path, on_disk, journal, _DeskState(hand, vet(hand).probability))
        steps = desk.log.read_steps(journal)
        if not steps:
            _forget_log(desk)
    for step in steps:
        _make(desk, step)
        _align(desk)
    _DESKS[path] = desk
    return desk


def _hold_file(path: Path) -> contextlib.AbstractContextManager[None]:
    """A block in which no other program changes the file of a hand or its log."""
    return atomic.hold_file(path, patience=_PATIENCE)


def _forget_log(desk: _LetterDesk) -> None:
    desk.log.forget()
    desk.on_disk = _state_of(desk.path)


@contextlib.contextmanager
def _hold_desk(name: str, revision: str) -> Iterator[_LetterDesk]:
    """A block that changes the hand on its desk, and no other program does."""
    path = library.scanned_file(name)
    if library.comes_with_program(path):
        raise InputError(f"{path.stem} comes with the program: make a copy of your own first.")
    atomic.check_writable(path)
    with _hold_file(path):
        desk = _desk(name)
        if revision != desk.revision:
            raise StaleHand("The hand was changed in another window meanwhile; it is shown as it is now.")
        yield desk


def open_letters(name: str) -> Facts:
    """What is on the pages of a hand, and what was corrected of it."""
    return _desk_facts(_desk(name))


def _desk_facts(desk: _LetterDesk) -> Facts:
    hand, journal = desk.state.hand, desk.journal
    page_of = np.array([glyph.page for glyph in hand.glyphs], dtype=np.intp)
    letters = np.bincount(page_of, minlength=len(hand.pages)).tolist()
    doubtful = np.bincount(page_of, desk.state.probability < SURE, len(hand.pages)).astype(int).tolist()
    pages: list[Facts] = []
    for number, page in enumerate(hand.pages):
        baselines = []  # two places of each, pixels: where its line begins and ends
        for line, (_, _, _, middle, reach) in enumerate(page.baselines.tolist()):
            x = np.clip([middle - reach, middle + reach], 0, page.shape[1] - 1)
            baselines.append(np.column_stack([x, page.base(line, x)]).round(1).tolist())
        facts: Facts = {
            "source": page.source,
            "width": page.shape[1],
            "height": page.shape[0],
            "x_height": round(page.x_height / page.pixel, 1),
            "slant": round(page.slant, 3),
            "baselines": baselines,
            "letters": letters[number],
            "doubtful": doubtful[number],
            "scan": page.scan is not None,
        }
        pages.append(facts)
    return {
        "revision": desk.revision,
        "title": hand.title,
        "pages": pages,
        "made": desk.entries_made,
        "entries": desk.entries_made + len(desk.undone) + len(journal.entries) - journal.made,
        "waiting": len(desk.steps),
        "confirmed": sum(glyph.confirmed for glyph in hand.glyphs),
        "tile": TILE,
    }


def page_letters(name: str, page: int) -> Facts:
    """The letters of a page in the order of writing, with the lines of their ink as SVG paths in pixels of the scan.

    id : by which a letter is known as long as it is one: its index in the page's text, or less than 0.
    gain : how many other letters its correction may tell of: those of its name that are as doubtful, and itself.
    """
    desk = _desk(name)
    _page(desk.state.hand, page)
    return {"letters": [letter for _, _, letter in _letters(desk, page)], "revision": desk.revision}


def _page(hand: ScannedHand, page: int) -> ScannedPage:
    if not 0 <= page < len(hand.pages):
        raise InputError(f"{hand.name} has no page {page}; they are numbered from 0 to {len(hand.pages) - 1}.")
    return hand.pages[page]


def _letters(desk: _LetterDesk, page: int) -> Iterator[tuple[int, bool, Facts]]:
    """The letters of a page: id, whether its facts have changed since they were last told, and these facts."""
    hand, sheet = desk.state.hand, desk.state.hand.pages[page]
    units = graphemes(sheet.transcript)
    here = [number for number, glyph in enumerate(hand.glyphs) if glyph.page == page]
    doubts: dict[str, int] = {}
    for number in here:
        if desk.state.probability[number] < SURE:
            doubts[hand.glyphs[number].letter] = doubts.get(hand.glyphs[number].letter, 0) + 1
    for number, drawn in zip(here, _lines(sheet, [hand.glyphs[number] for number in here]), strict=True):
        glyph, sure = hand.glyphs[number], float(desk.state.probability[number])
        one = glyph.at if glyph.at >= 0 else -1 - int(glyph.vertices[0])
        ink = tuple(part.tobytes() for part in drawn)
        rest = (
            glyph.letter,
            glyph.confirmed,
            round(sure, 3),
            glyph.after != NOBODY,
            bool(glyph.ligatures),
            glyph.kept_out,
        )
        key = (ink, rest, glyph.line, doubts.get(glyph.letter, 0), bool(glyph.ways))
        known = desk.shown.get((page, one))
        if known is not None and known[0] == key:
            yield one, False, known[1]
            continue
        paths = known[1]["ink"] if known is not None and known[0][0] == ink else _ink(*drawn)
        told = {"id": one, **_letter(sheet, glyph, sure, units, doubts), "ink": paths}
        desk.shown[page, one] = key, told
        yield one, True, told


def _lines(sheet: ScannedPage, glyphs: Sequence[ScannedGlyph]) -> list[tuple[Indices, Indices]]:
    """Of each glyph of a page the line of its ink: places (n, 2), half pixels, and edges (m, 2) between them."""
    graph, size = sheet.graph, [len(glyph.vertices) for glyph in glyphs]
    vertices = np.concatenate([np.zeros(0, dtype=np.intp), *(glyph.vertices for glyph in glyphs)])
    begin = np.cumsum([0, *size])
    place, owner = np.full(len(graph), -1), np.full(len(graph), NOBODY)
    place[vertices] = np.arange(len(vertices)) - np.repeat(begin[:-1], size)
    owner[vertices] = np.repeat(np.arange(len(glyphs)), size)
    a, b = graph.edges.T
    inside = np.flatnonzero((owner[a] == owner[b]) & (owner[a] != NOBODY))
    inside = inside[np.argsort(owner[a[inside]], kind="stable")]
    ends = np.searchsorted(owner[a[inside]], np.arange(len(glyphs) + 1))
    places, edges = np.rint(2 * graph.uv[vertices]).astype(np.intp), place[graph.edges[inside]]
    return [(places[i:j], edges[k:n]) for (i, j), (k, n) in zip(pairwise(begin), pairwise(ends), strict=True)]


def _ink(places: Indices, edges: Indices) -> str:
    """The lines of a glyph's ink; single vertices are left out."""
    at, lines = (places / 2).tolist(), []
    for path in branches(edges, len(at)):
        if len(path) > 1:
            shown = [*path[:-1:_THINNED].tolist(), int(path[-1])]
            lines.append("M" + "L".join(f"{at[v][0]:g} {at[v][1]:g}" for v in shown))
    return "".join(lines)


def _letter(
    sheet: ScannedPage, glyph: ScannedGlyph, probability: float, units: Sequence[str], doubts: dict[str, int]
) -> Facts:
    uv = sheet.graph.uv[glyph.vertices]
    confirmed = "kept_out" if glyph.kept_out else "confirmed"
    verdict = "sure" if probability >= SURE else "refused" if probability < REFUSED else "doubtful"
    verdict = "unnamed" if not glyph.letter else confirmed if glyph.confirmed else verdict
    doubtful = verdict not in ("sure", confirmed)
    return {
        "letter": glyph.letter,
        "verdict": verdict,
        "probability": round(probability, 3),
        "gain": round((1 - probability) * (1 + 0.1 * (doubts.get(glyph.letter, 1) - 1)), 3) if doubtful else 0.0,
        "line": glyph.line,
        "word": word_at(units, glyph.at),
        "spot": [round(float(at), 1) for at in uv[len(uv) // 2]],
        "box": [round(float(at), 1) for at in (*uv.min(axis=0), *uv.max(axis=0))],
        "linked": glyph.after != NOBODY,
        "joined": bool(glyph.ligatures),
        "ordered": bool(glyph.ways),
    }


def page_tile(name: str, page: int, level: int, column: int, row: int) -> bytes:
    """A square of a page's picture as JPEG; at `level` 1 it shows twice as much each way as at 0, and so on."""
    desk = _desk(name, aligned=False)
    sheet = _page(desk.state.hand, page)
    if page not in desk.tiles or not desk.tiles[page].shows(sheet):
        desk.tiles[page] = Tiles(sheet)
    return desk.tiles[page].tile(level, column, row)


def warm_letters(name: str, page: int) -> bool:
    """Work out a part of what corrections of a page will ask for; whether there is more of that."""
    desk = _desk(name)
    sheet = _page(desk.state.hand, page)
    begun, scan = page in desk.aligners, sheet.scan
    if scan is not None and not begun:
        _ = scan.pixels  # unpacked before it is painted on
    aligner = desk.aligner(page)
    return aligner is not None and (not begun or aligner.warm(desk.state.hand, page))


def correct_letters(name: str, revision: str, corrections: bytes, later: bool = False) -> Facts:
    """Make corrections (JSON, as `handout hand edit` takes them) and keep them, with what they mean for words nearby.

    later : answer before those are aligned anew; `align_letters` then tells the rest.  The revision stays.

    Raises StaleHand: the hand is not of that revision. InputError: the hand comes with the program; a correction that
    cannot be made, or kept: nothing is, then.
    """
    with _hold_desk(name, revision) as desk:
        new = read_corrections(corrections, "the corrections")
        notes = _make_and_keep(desk, new, new, later=later)
        desk.undone.clear()
    return {
        **_desk_facts(desk),
        **_tell_pages(desk, {one.page for one in new}),
        **({} if later else _tell_rewritten(desk)),
        "notes": list(notes),
        "behind": desk.behind is not None,
    }


def align_letters(name: str, revision: str) -> Facts:
    """What the last correction means for the words around it; all letters where another window made that, or asked.

    rewritten : by page the strokes of other letters that are written otherwise since, as `letter_strokes` has them.
    """
    desk = _desk(name, aligned=False)
    pages = set(range(len(desk.state.hand.pages)))
    if desk.behind is not None and desk.revision == revision:
        pages = desk.behind[0]
    else:
        desk.shown.clear()  # somebody else was told
    _align(desk)
    return {**_desk_facts(desk), **_tell_pages(desk, pages), **_tell_rewritten(desk)}


def _make_and_keep(
    desk: _LetterDesk,
    new: tuple[AnyCorrection, ...],
    step: Sequence[AnyCorrection] = (),
    back: int = 0,
    later: bool = False,
) -> tuple[str, ...]:
    """Make corrections, and keep the step in the log; nothing is made where it cannot be kept."""
    before, steps, journal = desk.state, list(desk.steps), desk.journal
    notes = _make(desk, new)
    try:
        desk.log.add(desk.journal.made, step, back)
        desk.on_disk = _state_of(desk.path)
    except InputError:
        desk.state, desk.steps, desk.journal, desk.behind = before, steps, journal, None
        raise
    if not later:
        _align(desk)
    return notes


def _make(desk: _LetterDesk, new: tuple[AnyCorrection, ...]) -> tuple[str, ...]:
    """Make corrections on the desk, as they are; sentences to show the user."""
    from handout.hand.corrections import apply_and_tell
    from handout.tagging.relearning import changes

    before = desk.state
    made = apply_and_tell(before.hand, new)
    desk.steps.append((JournalEntry(new, changes(before.hand, made.hand, made.removed)), before))
    # what was undone is over
    desk.journal = CorrectionJournal(desk.journal.entries[: desk.journal.made], desk.journal.made)
    desk.turn(_DeskState(made.hand, _carry_probabilities(before, made.hand, {})))
    desk.behind = {one.page for one in new}, made.removed
    return made.notes


def _align(desk: _LetterDesk) -> None:
    """Align the words around the last step anew, if they are not."""
    from handout.tagging.relearning import changes

    if desk.behind is None:
        return
    (pages, removed), desk.behind = desk.behind, None
    entry, before = desk.steps[-1]
    hand, judged = desk.state.hand, dict[tuple[int, int], float]()
    for page in sorted(pages):
        aligner = desk.aligner(page)
        if aligner is not None:
            renewed = aligner.align_correction(before.hand, hand, page)
            hand = renewed.hand
            judged |= {(page, at): sure for at, sure in renewed.probability.items()}
    desk.steps[-1] = JournalEntry(entry.corrections, changes(before.hand, hand, removed)), before
    desk.state = _DeskState(hand, _carry_probabilities(before, hand, judged))


def _tell_pages(desk: _LetterDesk, pages: set[int]) -> Facts:
    """What a window must redraw of some pages: the letters that changed, and all ids in order."""
    told: dict[str, Facts] = {}
    for page in sorted(pages):
        letters = list(_letters(desk, page))
        told[str(page)] = {
            "order": [one for one, _, _ in letters],
            "letters": [letter for _, new, letter in letters if new],
        }
    return {"told": told}


def rewind_letters(name: str, revision: str, back: int) -> Facts:
    """Undo so many entries of the journal, or, negative, make them again; else as `correct_letters`."""
    pages: set[int] = set()
    with _hold_desk(name, revision) as desk:
        left = len(desk.journal.entries) - desk.journal.made
        if back > desk.entries_made or -back > len(desk.undone) + left:
            raise InputError(f"There is nothing to be {'undone' if back > 0 else 'made again'}.")
        for _ in range(abs(back)):
            pages |= _undo(desk) if back > 0 else _redo(desk)
    return {**_desk_facts(desk), **_tell_pages(desk, pages or set(range(len(desk.state.hand.pages))))}


def _undo(desk: _LetterDesk) -> set[int]:
    if not desk.steps:
        return _rewind_file(desk, desk.journal.made - 1)
    desk.log.add(desk.journal.made, back=1)
    desk.on_disk = _state_of(desk.path)
    entry, before = desk.steps.pop()
    desk.undone.append(entry.corrections)
    desk.turn(before)
    return {one.page for one in entry.corrections}


def _redo(desk: _LetterDesk) -> set[int]:
    if desk.journal.made < len(desk.journal.entries) and not desk.steps:
        return _rewind_file(desk, desk.journal.made + 1)
    again = desk.undone[-1]
    _make_and_keep(desk, again, back=-1)
    desk.undone.pop()
    return {one.page for one in again}


def _rewind_file(desk: _LetterDesk, made: int) -> set[int]:
    """Take the file back, or forward, to so many entries of its journal."""
    desk.log.forget()
    desk.journal = file.rewind(desk.path, desk.path, made)
    hand = file.load(desk.path)
    desk.turn(_DeskState(hand, _carry_probabilities(desk.state, hand, {})))
    desk.on_disk = _state_of(desk.path)
    return set()


def keep_letters(name: str) -> Facts:
    """Take what was corrected into the .hand file.

    Raises InputError: it cannot be written; the log keeps the corrections.
    """
    with _hold_file(library.scanned_file(name)):
        desk = _desk(name)
        if desk.steps:
            try:
                _write_hand(desk, desk.path)
            except InputError as error:
                raise InputError(f"{error} The corrections are safe in {desk.log.path.name} beside it.") from error
        _forget_log(desk)
    return {"made": desk.entries_made}


def _write_hand(desk: _LetterDesk, source: Path) -> None:
    """Write the .hand file, whole or not at all: what `source` holds, then the steps of the desk."""
    if desk.steps:
        entries, states = zip(*desk.steps, strict=True)
        hands = [state.hand for state in (*states, desk.state)]
        made = list(zip(hands[1:], entries, strict=True))
        desk.journal = file.record_all(source, desk.path, hands[0], made)
    else:
        atomic.write(desk.path, source.read_bytes())
    desk.steps.clear()
    desk.on_disk = _state_of(desk.path)


def begin_learning(name: str, revision: str, copy: str) -> Facts:
    """Put a copy of a hand into a file, for `learn_apart`; how many of its corrections that holds."""
    with _hold_desk(name, revision) as desk:
        keep_letters(name)
        atomic.write(Path(copy), desk.path.read_bytes())
        return {"made": desk.entries_made}


def learn_apart(copy: str, listener: Listener = SILENT) -> Facts:
    """Align the corrected pages of a copy anew, and judge all letters anew; how many changed."""
    from handout.tagging.relearning import changes, realign_page

    path = Path(copy)
    before = hand = file.load(path)
    pages = sorted({glyph.page for glyph in hand.glyphs if glyph.confirmed})
    for number, page in enumerate(pages):
        tell = narrow_reports(listener.progress, 0.8 * number / len(pages), 0.8 * (number + 1) / len(pages))
        hand = realign_page(hand, page, rng=np.random.default_rng((0, page)), tell=tell)
    found = changes(before, hand)
    listener.progress(0.8, "judging the letters")
    if found:
        file.record(path, path, before, hand, JournalEntry((), found))
    learn(path)
    return {"changed": len(found)}


def take_learnt(name: str, copy: str, made: int) -> Facts:
    """Put what was learned in the place of a hand; what was corrected since is made again on it.

    made : as `begin_learning` said.

    Raises StaleHand: some of those corrections were undone meanwhile. InputError: the file cannot be written: the hand
    stays as it is.
    """
    with _hold_file(library.scanned_file(name)):
        keep_letters(name)
        desk = _desk(name)
        learnt = file.journal(Path(copy))
        kept = desk.journal.entries[: desk.journal.made]
        if kept[:made] != learnt.entries[:made]:
            raise StaleHand("Corrections were undone while the page was learned from: what was learned is left out.")
        hand = file.load(Path(copy))
        renewed = replace(desk, journal=learnt, steps=[], undone=[])
        renewed.turn(_DeskState(hand, vet(hand).probability))
        notes: list[str] = []
        for entry in kept[made:]:
            try:
                _make(renewed, entry.corrections)
                _align(renewed)
            except InputError as error:
                notes.append(f"Once more after learning: {error}")
        try:
            # once, and with all of them: a break leaves the hand as it was, or as it is now
            _write_hand(renewed, Path(copy))
        except InputError as error:
            raise InputError(f"{error} What was learned is left out; the corrections are in the hand.") from error
        renewed.turn(
            _DeskState(file.load(desk.path), renewed.state.probability)
        )  # pictures are read from it: the copy goes
        _DESKS[desk.path] = renewed
        return {**_desk_facts(renewed), **_tell_pages(renewed, set(range(len(hand.pages)))), "notes": notes}


def letter_strokes(name: str, page: int, spot: tuple[float, float]) -> Facts:
    """How the word at a place is written, as far as its ink tells: the pen's strokes in order, pixels of the scan.

    Of each stroke the id of its letter, and its places; `own` says whether a person gave the letter's order.
    """
    from handout.motion.recovery.letter_forms import HANDS
    from handout.motion.recovery.stroke_order import stroke_order_model

    desk = _desk(name)
    hand, sheet = desk.state.hand, _page(desk.state.hand, page)
    here = [number for number, glyph in enumerate(hand.glyphs) if glyph.page == page and glyph.letter]
    if not here:
        return {"strokes": []}
    away = [np.square(sheet.graph.uv[hand.glyphs[n].vertices] - np.array(spot)).sum(axis=1).min() for n in here]
    model, number = stroke_order_model(hand, HANDS), here[int(np.argmin(away))]
    while hand.glyphs[number].before != NOBODY:
        number = hand.glyphs[number].before
    strokes: list[Facts] = []
    while number != NOBODY:
        strokes += _strokes(hand, number, model.ways_of(number))
        number = hand.glyphs[number].after
    return {"strokes": strokes}


def _strokes(hand: ScannedHand, number: int, ways: Sequence[tuple[Indices, bool]]) -> list[Facts]:
    glyph = hand.glyphs[number]
    one, uv = glyph.at if glyph.at >= 0 else -1 - int(glyph.vertices[0]), hand.pages[glyph.page].graph.uv
    return [
        {
            "id": one,
            "xy": [[round(x, 1), round(y, 1)] for x, y in uv[way].tolist()],
            "own": bool(glyph.ways),
            "late": late,
        }
        for way, late in ways
    ]


def _tell_rewritten(desk: _LetterDesk) -> Facts:
    """By page the strokes of letters whose order changed when the last step gave that of a letter of the same name."""
    from handout.motion.recovery.letter_forms import HANDS
    from handout.motion.recovery.stroke_order import stroke_order_model

    found, hand = dict[str, list[Facts]](), desk.state.hand
    for entry, before in desk.steps[-1:]:
        told = all(isinstance(one, Strokes) for one in entry.corrections)
        told = told and len(before.hand.glyphs) == len(hand.glyphs)
        models = [stroke_order_model(one, HANDS) for one in (before.hand, hand)] if told else []
        for number in models[1].list_rewritten(models[0]) if models else ():
            page = str(hand.glyphs[number].page)
            found.setdefault(page, []).extend(_strokes(hand, number, models[1].ways_of(number)))
    return {"rewritten": found}


def _carry_probabilities(before: _DeskState, hand: ScannedHand, judged: dict[tuple[int, int], float]) -> Array:
    """How sure each glyph of a changed hand is: as judged now, or as before where the glyph did not change."""
    known = {
        _key(before.hand, glyph): p for glyph, p in zip(before.hand.glyphs, before.probability.tolist(), strict=True)
    }
    values = [
        1.0
        if glyph.confirmed
        else judged.get((glyph.page, glyph.at), known.get(_key(hand, glyph), 0.5 * glyph.confidence))
        if glyph.letter
        else 0.0
        for glyph in hand.glyphs
    ]
    return np.array(values)


def _key(hand: ScannedHand, glyph: ScannedGlyph) -> tuple[int, str, int, int]:
    """A key for a glyph that does not depend on its number or on those of its vertices."""
    first = hand.pages[glyph.page].graph.uv[glyph.vertices[0]]
    return glyph.page, glyph.letter, len(glyph.vertices), hash((float(first[0]), float(first[1])))
