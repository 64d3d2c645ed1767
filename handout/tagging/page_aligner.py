"""A page while its letters are corrected one by one: after each, the words around it are aligned anew, at once.

What the networks read on a line, the lines themselves, the features of the letters and how each reads alone are worked
out once (`warm`).  A correction then asks for little: the words beside it are laid along what was read, between letters
that stay; ink that this sets free is assigned within these words; neighbours of what was confirmed exchange ink; and
letters of the names that changed are compared with their siblings anew.  The networks learn nothing here:
`relearning.realign_page` does that, in a quarter of a minute, and its page takes the place of this one.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handout.alphabet import SPACE
from handout.hand import vetting
from handout.hand.author_reader import Reader
from handout.hand.ligatures import find_again
from handout.hand.places import graphemes, places, word_numbers
from handout.hand.scanned import NOBODY, ScannedGlyph, ScannedHand, ScannedPage
from handout.networks import Floats
from handout.scanning.text_lines import line_owners
from handout.tagging import network
from handout.tagging.alignment import AlignedLine, Alignment, aligned_letters
from handout.tagging.decoder import ColumnReading, Decoded, Held, decode, read_line
from handout.tagging.glyph_extraction import letters_within_reach
from handout.tagging.ink_exchange import InkExchange
from handout.tagging.letter_assignment import assign_letters
from handout.tagging.line_space import (
    STEP,
    X_HEIGHT,
    Image,
    LineStrip,
    column_count,
    describe,
    lines_at,
    straighten_line,
    strips,
)
from handout.tagging.network import average_logs
from handout.tagging.relearning import held_letters, line_frames, line_texts, page_ink, with_page
from handout.tagging.segmentation import confidence, usual_widths
from handout.tagging.transcript import TranscriptLine
from handout.values import Array, Indices

_BESIDE = 1.5  # x-heights on either side of what was corrected, within which letters are looked at anew
_REACH = 3.5  # x-heights over and under a baseline, within which ink that was painted is looked at for a line
_SIGHT = 40  # pixels of a strip beyond which a column sees nothing: half the window of its features, and its blur
_SAME = 0.6  # pixels, within which a vertex of a page that was painted is one that was there

Drafts = Mapping[int, ScannedGlyph]  # the letters of a page by their indices in its transcript


@dataclass(frozen=True, eq=False)
class Renewed:
    """What became of a hand.

    hand : with the words around a correction aligned anew.
    probability : letter's index in the transcript → how probably it is what it is called, of those that were judged.
    """

    hand: ScannedHand
    probability: Mapping[int, float]


@dataclass(frozen=True, eq=False)
class _Touched:
    """Ink of a letter that was corrected, as it was or is.  uv : (n, 2) pixels."""

    at: int
    line: int
    uv: Array


@dataclass(frozen=True, eq=False)
class _LineWindow:
    """Part of a line: letters `first` up to `stop` of its text, and between which pixels of its strip they lie.

    fixed, free : of its letters those that keep their ink, and those that get it anew.
    """

    first: int
    stop: int
    left: float
    right: float
    fixed: tuple[int, ...] = ()
    free: tuple[int, ...] = ()


class PageAligner:
    """One page of a hand, and what of it is worked out once.

    page : one that `can` be aligned.
    reader : that knows the author (`author_reader`).
    """

    def __init__(self, page: ScannedPage, reader: Reader) -> None:
        self._page, self._author = page, reader
        self._ink = page_ink(page)
        frames = line_frames(page)
        self._line_of = lines_at(line_owners(self._ink, frames), page.graph.uv)
        self._strips = strips(self._ink, frames)
        self._networks = network.load_networks()
        self._widths: dict[str, float] = {}
        self._columns: dict[int, list[Floats]] = {}
        self._readings: dict[int, list[ColumnReading]] = {}
        self._units = graphemes(page.transcript)
        self._places = places(self._units)
        self._words = word_numbers(self._units)
        self._letters = tuple(i for i, unit in enumerate(self._units) if not unit.isspace())
        self._number = {at: k for k, at in enumerate(self._letters)}
        self._exchange: InkExchange | None = None
        self._odd: Mapping[int, float] = {}

    @staticmethod
    def can(page: ScannedPage) -> bool:
        """Whether a page has lines that can be aligned; a recorded page has its letters from the pen."""
        return page.moments is None and len(page.baselines) > 0

    def warm(self, hand: ScannedHand, number: int) -> bool:
        """Work out a part of what will be asked for, of page `number` of its hand; whether there is more."""
        for line in range(len(self._strips)):
            if line not in self._readings:
                self._read_line(line)
                return True
        self._compare_letters(_by_place(_on_page(hand, number)))
        return False

    def align_correction(self, before: ScannedHand, after: ScannedHand, number: int) -> Renewed:
        """A hand after a correction, with what that means for the words around it.

        before, after : the hand as this page knows it, and with the correction made.
        number : of the page.
        """
        page = after.pages[number]
        old, own = _on_page(before, number), _on_page(after, number)
        touched = [*_find_touched(before.pages[number], old, page, own)]
        self._follow(page, {one.at for one in touched})
        known, drafts = _by_place(old), _by_place(own)
        inks = _renumber_vertices(before.pages[number], known, page)
        if not touched or not drafts:
            return Renewed(after, {})
        texts, loose = self._texts(own), [glyph for glyph in own if glyph.at < 0]
        for line in sorted({one.line for one in touched if texts[one.line].letters}):
            here = [one for one in touched if one.line == line]
            found = {**drafts, **self._line(line, texts[line], drafts, loose, here)}
            drafts = {at: glyph for at, glyph in found.items() if glyph is not None}  # some are not there any more
        drafts = self._exchange_ink(known, drafts)
        return Renewed(_with_letters(after, number, drafts), self._probability(inks, drafts))

    def _texts(self, own: Sequence[ScannedGlyph]) -> list[TranscriptLine]:
        """What is written on each line."""
        texts = line_texts(self._page, own)
        if not self._widths:
            some = [i for i, text in enumerate(texts) if text.letters]
            images = [self._strips[i].image for i in some]
            self._widths = usual_widths(images, [texts[i] for i in some], self._networks)
        return texts

    def _follow(self, page: ScannedPage, touched: set[int]) -> None:
        """Take the page as it is now; straighten the changed lines of a painted page anew."""
        was, self._page = self._page, page
        bent = not np.array_equal(was.baselines, page.baselines)
        if bent or was.texture is not page.texture or not np.array_equal(was.dismissed, page.dismissed):
            self._repaint(np.flatnonzero((was.baselines != page.baselines).any(axis=1)).tolist())
        if was.graph is page.graph and not bent:
            return
        if not np.array_equal(was.graph.uv, page.graph.uv):
            # the line of each vertex of a page that was painted: as it was, or that whose small letters are nearest
            found = _match_vertices(was.graph.uv, page.graph.uv)
            lines, new = np.append(self._line_of, NOBODY)[found], np.flatnonzero(found == NOBODY)
            x, y = page.graph.uv[new].T
            middle = 0.5 * page.x_height / page.pixel
            height = np.abs(np.stack([page.base(line, x) - middle - y for line in range(len(page.baselines))]))
            lines[new] = height.argmin(axis=0)
            self._line_of = lines
        if self._exchange is not None:
            odd = self._exchange.odd()
            self._odd = {k: value for k, value in odd.items() if self._letters[k] not in touched}
            self._exchange = None

    def _repaint(self, bent: Sequence[int]) -> None:
        """Straighten the lines again whose ink is another, or whose baseline is (`bent`)."""
        page, ink = self._page, page_ink(self._page)
        rows, frames = np.flatnonzero((ink != self._ink).any(axis=1)), line_frames(page)
        self._ink = ink
        middle = [float(frame.base(frame.middle)) for frame in frames]
        for line, strip in enumerate(self._strips):
            height, reach = frames[line].base(np.linspace(0, page.shape[1], 9)), _REACH * frames[line].x_height
            top, low = max(0, int(height.min() - reach)), int(height.max() + reach) + 1
            if line not in bent and not ((rows >= top) & (rows < low)).any():
                continue
            near = [i for i in range(len(frames)) if abs(middle[i] - middle[line]) < 2 * (low - top)]
            bases = [frames[i].baseline for i in near]
            lifted = [
                replace(frames[i], baseline=(base[0] - top, *base[1:])) for i, base in zip(near, bases, strict=True)
            ]
            owners = line_owners(ink[top:low], lifted)
            frame = replace(frames[line], slant=strip.frame.slant)
            again = straighten_line(owners == near.index(line), top, frame)
            if not np.array_equal(again.image, strip.image):
                self._strips[line] = again
                self._readings.pop(line, None)
                if again.image.shape == strip.image.shape and again.frame.left == strip.frame.left:
                    self._look_again(line, np.flatnonzero((again.image != strip.image).any(axis=0)))
                else:
                    self._columns.pop(line, None)

    def _read_line(self, line: int) -> list[ColumnReading]:
        """What each network reads on a line, and last what they read together."""
        image = self._strips[line].image
        if line not in self._columns:
            self._columns[line] = self._look(image)
        if line not in self._readings:
            each = self._columns[line]
            prior = np.mean([one.log_prior for one in self._networks], axis=0)
            self._readings[line] = [read_line(image, posterior, prior) for posterior in (*each, average_logs(each))]
        return self._readings[line]

    def _look(self, image: Image) -> list[Floats]:
        """What each network makes of the columns of a line's image, or of a part of one."""
        features = describe(image)
        return [each.log_posterior(features) for each in self._networks]

    def _look_again(self, line: int, changed: Indices) -> None:
        """Let the networks read those columns of a line again that see some pixels (k,) of it."""
        if line not in self._columns:
            return
        image = self._strips[line].image
        first, last = int(changed[0]) - _SIGHT, int(changed[-1]) + _SIGHT + 1
        begin, end = max(0, first // STEP - _SIGHT // STEP), min(column_count(image), last // STEP + _SIGHT // STEP)
        seen = self._look(image[:, begin * STEP : end * STEP])
        inner = slice(max(0, first // STEP) - begin, min(column_count(image), last // STEP) - begin)
        for whole, part in zip(self._columns[line], seen, strict=True):
            whole[begin + inner.start : begin + inner.stop] = part[inner]

    def _line(
        self,
        line: int,
        text: TranscriptLine,
        drafts: Drafts,
        loose: Sequence[ScannedGlyph],
        touched: Sequence[_Touched],
    ) -> dict[int, ScannedGlyph | None]:
        """The letters of a line that change when the words around the touched ones are aligned anew."""
        strip = self._strips[line]
        held = held_letters(self._page, strip, text, list(drafts.values()), line)
        window = _window(strip, text, held, touched)
        if window is None:
            return {}
        decodings = self._decode_window(line, text, held, window)
        window = _divide_window(text, held, window, decodings[-1], drafts)
        sure = dict(zip(range(window.first, window.stop), confidence(decodings).tolist(), strict=True))
        found: dict[int, ScannedGlyph | None] = {}
        for i in window.fixed:
            glyph = drafts[text.at[i]]
            if sure[i] > glyph.confidence:
                found[glyph.at] = replace(glyph, confidence=sure[i])
        if window.free:
            free = {text.at[i] for i in window.free}
            letters = aligned_letters(strip.frame, text.part(window.first, window.stop), decodings)
            letters = tuple(replace(letter, present=letter.present and letter.at in free) for letter in letters)
            closed = [glyph for glyph in (*drafts.values(), *loose) if glyph.at not in free]
            given = self._assign_ink(AlignedLine(line, strip.frame, letters, 0.0), closed, window)
            for i in window.free:
                at = text.at[i]
                found[at] = self._glyph(at, line, given[at], sure[i], drafts.get(at))
        return found

    def _decode_window(
        self, line: int, text: TranscriptLine, held: Mapping[int, Held], window: _LineWindow
    ) -> list[Decoded]:
        """The window laid along what each network reads there, and last along what they read together."""
        begin, end = int(np.ceil(window.left / STEP)), int(window.right / STEP)
        away = float(begin * STEP)
        inside = {
            i - window.first: replace(hold, left=hold.left - away, right=hold.right - away)
            for i, hold in held.items()
            if window.first <= i < window.stop
        }
        letters = text.letters[window.first : window.stop]
        found = (decode(_part(reading, begin, end), letters, self._widths, inside) for reading in self._read_line(line))
        return [replace(one, left=one.left + away, right=one.right + away) for one in found]

    def _assign_ink(
        self, aligned: AlignedLine, closed: Sequence[ScannedGlyph], window: _LineWindow
    ) -> dict[int, Indices]:
        """Letter → its vertices, of a window; `closed` keep theirs, and letters that are not `present` get none."""
        graph, open_ = self._page.graph, self._line_of == aligned.number
        open_[self._page.dismissed] = False
        for glyph in closed:
            open_[glyph.vertices] = False
        mine = np.flatnonzero(open_)
        u = (aligned.frame.to_line(graph.uv[mine]))[:, 0]
        mine = mine[(u > window.left - STEP) & (u < window.right + STEP)]
        letter = np.full(len(mine), NOBODY)
        if len(mine):
            part, alone = graph.take(mine), Alignment((aligned,))
            letter = assign_letters(part, alone, np.full(len(mine), aligned.number)).letter
            letter = letters_within_reach(part, alone, letter)
        return {each.at: mine[letter == k] for k, each in enumerate(aligned.letters)}

    def _glyph(
        self, at: int, line: int, vertices: Indices, sure: float, was: ScannedGlyph | None
    ) -> ScannedGlyph | None:
        """A letter with its ink; None without any."""
        if not len(vertices):
            return None
        if was is not None and was.line == line:
            return replace(was, vertices=vertices, confidence=sure, ligatures=())
        of = (self._places[at], 0, line, self._words[at], at)
        return ScannedGlyph(self._units[at], *of, vertices, confidence=sure)

    def _exchange_ink(self, known: Drafts, drafts: Drafts) -> Drafts:
        """The letters after the neighbours of what was confirmed now have exchanged ink."""
        exchange = self._compare_letters(drafts)
        inks = {number: _ink_of(drafts.get(at)) for at, number in self._number.items()}
        changed = {number: ink for number, ink in inks.items() if not np.array_equal(exchange.ink(number), ink[1])}
        held = frozenset(self._number[at] for at, glyph in drafts.items() if glyph.confirmed)
        before = {self._number[at] for at, glyph in known.items() if glyph.confirmed}
        now = {number for number in held if number in changed or number not in before}
        if not changed and not now:
            return drafts
        gave = exchange.take_corrections(changed, held, now)
        ink_of = {self._letters[number]: exchange.ink(number) for number in gave}
        return {**drafts, **{at: replace(drafts[at], vertices=ink, ligatures=()) for at, ink in ink_of.items()}}

    def _compare_letters(self, drafts: Drafts) -> InkExchange:
        """The letters of the page, compared with one another."""
        if self._exchange is None:
            letter, lines = np.full(len(self._page.graph), NOBODY), np.zeros(len(self._letters), dtype=np.intp)
            for at, glyph in drafts.items():
                letter[glyph.vertices] = self._number[at]
                lines[self._number[at]] = glyph.line
            names = [self._units[at] for at in self._letters]
            there = {self._number[at] for at in drafts}
            seen = {number: odd for number, odd in self._odd.items() if number in there}
            self._exchange = InkExchange(self._page, letter, names, lines, self._author, seen=seen)
        return self._exchange

    def _probability(self, inks: Mapping[int, Indices], drafts: Drafts) -> dict[int, float]:
        """How probable letters are, of the names of which one has other ink now than `inks`, its vertices before."""
        strange = self._compare_letters(drafts).strange()
        same = {at for at in inks if at in drafts and np.array_equal(inks[at], drafts[at].vertices)}
        names = {self._units[at] for at in {*inks, *drafts} - same}
        ats = [self._letters[number] for number in strange]
        sure = np.array([drafts[at].confidence for at in ats])
        judged = np.where(sure > 0, vetting.calibrated(np.array(list(strange.values())), sure), 0.0)
        found = zip(ats, judged.tolist(), strict=True)
        return {at: 1.0 if drafts[at].confirmed else p for at, p in found if self._units[at] in names}


def _on_page(hand: ScannedHand, number: int) -> list[ScannedGlyph]:
    return [glyph for glyph in hand.glyphs if glyph.page == number]


def _by_place(glyphs: Sequence[ScannedGlyph]) -> Drafts:
    """Those glyphs that are letters of the page's text, by their places in it."""
    return {glyph.at: glyph for glyph in glyphs if glyph.at >= 0}


def _renumber_vertices(was: ScannedPage, letters: Drafts, page: ScannedPage) -> dict[int, Indices]:
    """The vertices of letters, rising, by their numbers on the page as it is now; without vertices that are gone."""
    if np.array_equal(was.graph.uv, page.graph.uv):
        return {at: glyph.vertices for at, glyph in letters.items()}
    found, number = _match_vertices(was.graph.uv, page.graph.uv), np.full(len(was.graph), NOBODY)
    number[found[found != NOBODY]] = np.flatnonzero(found != NOBODY)
    new = {at: number[glyph.vertices] for at, glyph in letters.items()}
    return {at: np.sort(vertices[vertices != NOBODY]) for at, vertices in new.items()}


def _find_touched(
    was: ScannedPage, old: Sequence[ScannedGlyph], is_: ScannedPage, new: Sequence[ScannedGlyph]
) -> Iterator[_Touched]:
    """Letters of which ink, name or truth is another now, as they were and as they are."""
    same, bent = np.array_equal(was.graph.uv, is_.graph.uv), (was.baselines != is_.baselines).any(axis=1)

    def key(page: ScannedPage, glyph: ScannedGlyph) -> tuple[object, ...]:
        ink = glyph.vertices if same else page.graph.uv[glyph.vertices]
        return glyph.letter, glyph.at, glyph.confirmed, glyph.line, ink.tobytes()

    before, after = ({key(page, glyph): glyph for glyph in some} for page, some in ((was, old), (is_, new)))
    for page, some, others in ((was, before, after), (is_, after, before)):
        for one, glyph in some.items():
            if one not in others or bent[glyph.line]:
                yield _Touched(glyph.at, glyph.line, page.graph.uv[glyph.vertices])


def _ink_of(glyph: ScannedGlyph | None) -> tuple[int, Indices]:
    """The line and the vertices of a letter; none where it is not there."""
    return (0, np.zeros(0, dtype=np.intp)) if glyph is None else (glyph.line, glyph.vertices)


def _are_alike(one: ScannedGlyph | None, other: ScannedGlyph | None) -> bool:
    if one is None or other is None:
        return one is other
    return np.array_equal(one.vertices, other.vertices)


def _window(
    strip: LineStrip, text: TranscriptLine, held: Mapping[int, Held], touched: Sequence[_Touched]
) -> _LineWindow | None:
    """Whole words of a line around what was touched, one more on either side; None where there is no room."""
    near = _letters_near(strip, text, held, touched)
    if not near:
        return None
    spaces = [-1, *(i for i, letter in enumerate(text.letters) if letter == SPACE), len(text.letters)]
    begin = max(k for k, i in enumerate(spaces) if i < min(near))
    end = min(k for k, i in enumerate(spaces) if i > max(near))
    first, stop = spaces[max(begin - 1, 0)] + 1, spaces[min(end + 1, len(spaces) - 1)]
    left = max((hold.right for i, hold in held.items() if i < first), default=0.0)
    right = min((hold.left for i, hold in held.items() if i >= stop), default=float(strip.image.shape[1]))
    return _LineWindow(first, stop, left, right) if right - left > 2 * STEP else None


def _letters_near(
    strip: LineStrip, text: TranscriptLine, held: Mapping[int, Held], touched: Sequence[_Touched]
) -> list[int]:
    """The letters of a line that were touched, or lie beside that."""
    ats, u = {one.at for one in touched}, strip.frame.to_line(np.concatenate([one.uv for one in touched]))[:, 0]
    low, high = float(u.min()) - _BESIDE * X_HEIGHT, float(u.max()) + _BESIDE * X_HEIGHT
    named = [i for i, at in enumerate(text.at) if at in ats and text.letters[i] != SPACE]
    return [*named, *(i for i, hold in held.items() if hold.right > low and hold.left < high)]


def _divide_window(
    text: TranscriptLine, held: Mapping[int, Held], window: _LineWindow, best: Decoded, drafts: Drafts
) -> _LineWindow:
    """Say which letters of a window keep their ink: those that are confirmed or have not moved."""
    fixed: list[int] = []
    free: list[int] = []
    for i in range(window.first, window.stop):
        if text.letters[i] == SPACE or len(graphemes(text.spelt[i])) > 1:
            continue
        hold, k, glyph = held.get(i), i - window.first, drafts.get(text.at[i])
        off = max(abs(best.left[k] - hold.left), abs(best.right[k] - hold.right)) if hold else np.inf
        stays = hold is not None and bool(best.found[k]) and off <= hold.reach
        (fixed if glyph is not None and (glyph.confirmed or stays) else free).append(i)
    return replace(window, fixed=tuple(fixed), free=tuple(free))


def _part(reading: ColumnReading, begin: int, end: int) -> ColumnReading:
    """Some columns of a reading."""
    rows = slice(begin, end + 1)
    return ColumnReading(reading.letters[rows], reading.space[rows], reading.gap[rows], reading.border[rows])


def _match_vertices(uv: Array, again: Array) -> Indices:
    """(n,) the vertex at places uv (m, 2) that each one at `again` (n, 2) is; NOBODY if it is new."""
    from scipy.spatial import cKDTree

    found = np.full(len(again), NOBODY)
    if len(uv):
        old, new = (np.ascontiguousarray(places).view(np.complex128)[:, 0] for places in (uv, again))
        order = np.argsort(old)
        near = order[np.minimum(np.searchsorted(old, new, sorter=order), len(old) - 1)]
        found = np.where(old[near] == new, near, NOBODY)
        if len(moved := np.flatnonzero(found == NOBODY)):
            away, near = cKDTree(uv).query(again[moved])
            found[moved] = np.where(away < _SAME, near, NOBODY)
    return found


def _with_letters(hand: ScannedHand, number: int, drafts: Drafts) -> ScannedHand:
    """The hand with other letters on one page; ligatures that may have changed are found anew."""
    own = [glyph for glyph in hand.glyphs if glyph.page == number]
    old = {glyph.at: glyph for glyph in own if glyph.at >= 0}
    if all(drafts.get(at) is old.get(at) for at in {*drafts, *old}):
        return hand
    glyphs, ats = _place_glyphs(hand, number, drafts)
    inked = {at for at in {*old, *drafts} if not _are_alike(old.get(at), drafts.get(at))}
    place = {at: i for i, at in enumerate(ats)}
    for at in (at for at in drafts if {at, at + 1} & inked):
        _link(glyphs, place[at], place.get(at + 1))
    return with_page(hand, number, find_again(glyphs, hand.pages, {place[at] for at in inked & place.keys()}))


def _place_glyphs(hand: ScannedHand, number: int, drafts: Drafts) -> tuple[list[ScannedGlyph], list[int]]:
    """The glyphs of a page with other letters, numbered from 0, and of each its index in the text, or less than 0."""
    own = [(i, glyph) for i, glyph in enumerate(hand.glyphs) if glyph.page == number]
    keys = [glyph.at if glyph.at >= 0 else -1 - i for i, glyph in own]
    ats = [key for key in keys if key < 0 or key in drafts]
    for at in sorted(drafts.keys() - set(keys)):
        ats.insert(sum(key < at for key in ats), at)
    place = {at: i for i, at in enumerate(ats)}
    # of neighbours that are gone, nobody
    here = {NOBODY: NOBODY} | {i: place.get(key, NOBODY) for (i, _), key in zip(own, keys, strict=True)}
    glyphs = (drafts[at] if at >= 0 else hand.glyphs[-1 - at] for at in ats)
    return [_renumber_neighbours(glyph, here, number) for glyph in glyphs], ats


def _renumber_neighbours(glyph: ScannedGlyph, number: Mapping[int, int], page: int) -> ScannedGlyph:
    """A glyph of a page whose neighbours have other numbers; where the next is gone nothing leads there."""
    glyph = glyph if glyph.page == page else replace(glyph, page=page)
    moved = glyph.with_neighbours({n: number.get(n, NOBODY) for n in (glyph.before, glyph.after)})
    return moved if moved.after != NOBODY or not moved.ligatures else replace(moved, ligatures=())


def _link(glyphs: list[ScannedGlyph], i: int, second: int | None) -> None:
    """Link a letter to the next one of the text, if both are of one word and line."""
    one = glyphs[i]
    other = None if second is None else glyphs[second]
    if second is None or other is None or (one.word, one.line) != (other.word, other.line):
        return
    if one.after not in (NOBODY, second):
        glyphs[one.after] = replace(glyphs[one.after], before=NOBODY)
    if other.before not in (NOBODY, i):
        glyphs[other.before] = replace(glyphs[other.before], after=NOBODY, ligatures=())
    glyphs[i] = replace(one, after=second)
    glyphs[second] = replace(glyphs[second], before=i)
