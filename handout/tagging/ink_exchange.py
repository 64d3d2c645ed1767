"""Ink that neighbouring letters exchange where both then look more like the other glyphs of their letters.

A line is cut where its columns say, and a stem, a bar or a loop may come to the wrong side.  Here every letter offers
each neighbour, and each letter of another line that it touches, what lies along the graph within some distance of where
the two meet, or come nearest, each branch near there, and each small piece by itself.  What makes most letters right,
as far as their shape among their siblings (`hand.outlier_score`) and how they read alone (`hand.author_reader`) tell,
changes hands, until nothing gains enough.

Both have to gain: where their sum alone counted, letters got rid of what made them strange at letters of which
anything is believed, capitals above all, and people's pages were read worse with it than without. Reading better
counts only where it becomes reading right, or far better: a looped k lost its foot when it read a little less like an
h without. By eye, on five people's pages where an exchange by shape between letters that touch had come to rest (csafe
w0076 w0154 w0238 w0394, cvl 0012, by which the bounds were chosen) 17 of 21 more put a stem, an arch or a side of a
bowl right, 3 hardly matter and 1 is wrong; on two others (cvl 0052, csafe w0277) 14 of 19 are right, and 5 hardly
matter. Since shapes of letters without siblings are believed less, 18 exchanges more on eight pages (16 right, 2
hardly matter: a lone k has its stem again) and 13 on five others (11 right, 1 wrong). Where a ninth of the letters
lost a stem, a tail or a part to their neighbour on purpose, .79 of 354 on simulated pages are put right and 18 letters
made wrong (.76 and 22 before), .70 of 219 on six people's pages and 4 (.70 and 11). It takes 4 to 6 s of CPU a page.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from handout.branching import number_pieces
from handout.hand import outlier_score
from handout.hand.author_reader import (
    Reader,
    author_reader,
    picture_of_vertices,
    reads_alone,
    surprises,
    usual_surprise,
)
from handout.hand.glyph_features import COUNT, features_of
from handout.hand.letter_classes import CROSSED
from handout.hand.outlier_score import Siblings
from handout.hand.scanned import NOBODY, ScannedHand, ScannedPage
from handout.motion.recovery.crossbars import Crossbar, WordCrossbars
from handout.tagging.alignment import Alignment
from handout.tagging.glyph_extraction import extract_glyphs
from handout.values import Array, Indices


@dataclass(frozen=True)
class ExchangeSettings:
    """Lengths in x-heights; set on simulated pages."""

    reaches: tuple[float, ...] = (0.2, 0.4, 0.7, 1.0, 1.4, 1.8, 2.3)  # along the graph, from where two letters meet
    near: float = 0.8  # along the graph, within which a branch is offered whole
    piece: float = 1.6  # length of a separate piece that is offered
    beside: float = 0.6  # from the taker's ink to such a piece
    cut: float = 0.5  # length at least of what is cut off a line for a taker that it does not touch: more than a dot
    kept: float = 0.3  # share of its line that a letter keeps at least
    margin: float = 0.3  # letters that are right (see `Siblings.right`) that an exchange must gain
    each: float = 0.02  # of them that each of the two must gain
    # surprise, nats, up to which a glyph reads as what it is rather than as all else, or what its siblings have, or the
    # second as a share of what it had
    read: float = 0.7
    better: float = 0.3
    # letters that one of several offers is less worth for each place more at which it leaves two letters cut apart: a
    # stem that leads back to its letter changes hands whole
    torn: float = 0.15
    rounds: int = 3  # most that follow one another
    least: int = 150  # letters of a page below which it is left as it is: siblings say too little
    loss: float = 0.05  # of the same that a letter may lose with the end of a neighbour's crossbar over it


SETTINGS = ExchangeSettings()


@dataclass(frozen=True, eq=False)
class _Offer:
    """Vertices that one letter might give another."""

    giver: int
    taker: int
    vertices: Indices


class InkExchange:
    """The ink of a page while its letters exchange it.

    letter : (n,) int: the letter of each vertex, −1 for none.
    names, lines : of all letters, in the order of writing.
    reader : that knows the author.
    held : letters whose ink is known: they neither give nor take, and their neighbours alone begin.
    seen : how oddly some letters read, as `odd` told of the same ink.

    crossings : letter → vertices that are its as well as a neighbour's, which its crossbar crosses.
    """

    def __init__(
        self,
        sheet: ScannedPage,
        letter: Indices,
        names: Sequence[str],
        lines: Indices,
        reader: Reader,
        held: frozenset[int] = frozenset(),
        *,
        seen: Mapping[int, float] = MappingProxyType({}),
    ) -> None:
        self.letter, self._sheet, self._lines, self._held = letter.copy(), sheet, lines.copy(), held
        self._names, self._reader, self.crossings = names, reader, dict[int, Indices]()
        graph, count = sheet.graph, len(sheet.graph)
        a, b = graph.edges.T
        self._step = np.hypot(*(graph.xy[a] - graph.xy[b]).T) / sheet.x_height
        both, ways = np.concatenate([self._step, self._step]) + 1e-6, (np.r_[a, b], np.r_[b, a])
        self._graph = csr_matrix((both, ways), shape=(count, count))
        self._length = (np.bincount(a, self._step, count) + np.bincount(b, self._step, count)) / 2
        self._simple = np.bincount(graph.edges.ravel(), minlength=count) <= 2
        self._place = graph.xy / sheet.x_height
        order = np.argsort(letter, kind="stable")
        ends = np.searchsorted(letter[order], np.arange(len(names) + 1)).tolist()
        self._sets = {i: order[a:b] for i, (a, b) in enumerate(pairwise(ends)) if a < b}
        self._readable = np.array([reads_alone(name) for name in names], dtype=bool)
        numbers, sets = np.array(list(self._sets), dtype=np.intp), list(self._sets.values())
        self._features, self._odd = np.zeros((len(names), COUNT)), np.zeros(len(names))
        self._features[numbers] = features_of(sheet, self._lines[numbers], sets)
        self._odd[list(seen)] = list(seen.values())
        unread = np.array([k for k, number in enumerate(numbers.tolist()) if number not in seen], dtype=np.intp)
        self._odd[numbers[unread]] = self._surprises(numbers[unread], [sets[k] for k in unread.tolist()])
        self._compare()

    def _compare(self) -> None:
        """Compare every letter with its siblings anew."""
        self._known = np.array(sorted(self._sets), dtype=np.intp)
        self._row = {number: row for row, number in enumerate(self._known.tolist())}
        features, known = self._features[self._known], [self._names[i] for i in self._known]
        self._siblings = Siblings(outlier_score.load_model(), features, known)
        self._seen = self._odd[self._known]
        self._usual = usual_surprise(self._seen, known, self._readable[self._known])
        self._right = self._siblings.right(np.arange(len(features)), features, self._seen - self._usual)

    def odd(self) -> dict[int, float]:
        """Letter → how oddly it reads, of all that are there."""
        return dict(zip(self._known.tolist(), self._seen.tolist(), strict=True))

    def strange(self) -> dict[int, float]:
        """Letter → how unlike its siblings it is, in shape and as it reads alone (`vetting.strange_score`)."""
        model = outlier_score.load_model()
        shapes = (self._siblings.evidence() @ model.weights + model.bias) * self._siblings.trust
        score = shapes + outlier_score.READING * (self._seen - self._usual)
        return dict(zip(self._known.tolist(), score.tolist(), strict=True))

    def ink(self, letter: int) -> Indices:
        """(k,) the vertices of a letter, rising; none of one that is not there."""
        return self._sets.get(letter, np.zeros(0, dtype=np.intp))

    def take_corrections(
        self, changed: Mapping[int, tuple[int, Indices]], held: frozenset[int], begin: set[int]
    ) -> set[int]:
        """Take letters as a person corrected them, and let their neighbours exchange ink; which letters did.

        changed : letter → its line, and its vertices, none where it is not there any more.
        held : letters whose ink is known now.
        begin : those of them whose neighbours begin.
        """
        for number in changed:
            self.letter[self._sets.pop(number, self.letter[:0].astype(np.intp))] = NOBODY
        for number, (line, vertices) in changed.items():
            self._lines[number] = line
            if len(vertices):
                self._sets[number] = np.sort(vertices)
                self.letter[vertices] = number
        there = np.array([number for number in changed if number in self._sets], dtype=np.intp)
        sets = [self._sets[number] for number in there.tolist()]
        self._sets, self._held = dict(sorted(self._sets.items())), held
        self._features[there] = features_of(self._sheet, self._lines[there], sets)
        self._odd[there] = self._surprises(there, sets)
        self._compare()
        if len(self._names) < SETTINGS.least or not begin:
            return set()
        gave = self._settle_offers({one for pair in pairwise(self._sets) if begin & set(pair) for one in pair})
        if gave:
            self._odd[self._known] = self._seen
            self._compare()
        return gave

    def settle(self) -> int:
        """Exchange ink until nothing gains enough; how often any was."""
        beside = {one for pair in pairwise(self._sets) if self._held & set(pair) for one in pair}
        return len(self._settle_offers(beside if self._held else set(self._sets)))

    def give_crossbars(self, bars: Iterable[tuple[int, Crossbar]]) -> None:
        """Give the ends of crossbars, each with its letter, to that, if who has them looks no less like its siblings.

        Where a bar crosses its neighbour's own line the ink is both letters'.  What its letter gains is not asked: the
        bars of its siblings lack their ends.
        """
        found = [end for letter, bar in bars for end in self._find_bar_ends(letter, bar)]
        offers = [offer for offer, _ in found]
        givers = np.array([offer.giver for offer in offers], dtype=np.intp)
        left = [np.setdiff1d(self._sets[offer.giver], offer.vertices, assume_unique=True) for offer in offers]
        rows = np.array([self._row[giver] for giver in givers.tolist()], dtype=np.intp)
        features = features_of(self._sheet, self._lines[givers], left)
        strange = self._credit_readings(givers, left) - self._usual[rows]
        gains = self._siblings.right(rows, features, strange) - self._right[rows]
        for (offer, crossing), gain in zip(found, gains.tolist(), strict=True):
            if gain >= -SETTINGS.loss and (self.letter[offer.vertices] == offer.giver).all():
                self._make(offer)
                self.crossings[offer.taker] = np.union1d(self.crossings.get(offer.taker, crossing), crossing)

    def _find_bar_ends(self, letter: int, bar: Crossbar) -> Iterator[tuple[_Offer, Indices]]:
        """What of a letter's crossbar is of a letter beside it over which it ends loose, and where it crosses that."""
        for beside, loose in zip((letter - 1, letter + 1), bar.loose, strict=True):
            both = {beside, letter}
            if not loose or not both <= self._sets.keys() or both & self._held or self._names[beside] in CROSSED:
                continue
            on_bar = np.intersect1d(self._sets[beside], bar.vertices)
            rest = np.setdiff1d(self._sets[beside], on_bar, assume_unique=True)
            if len(on_bar) and len(rest):
                graph = self._sheet.graph
                crosses = cKDTree(graph.xy[rest]).query(graph.xy[on_bar])[0] <= graph.radius[on_bar]
                if not crosses.all():
                    yield _Offer(beside, letter, on_bar[~crosses]), on_bar[crosses]

    def _settle_offers(self, touched: set[int]) -> set[int]:
        every: set[int] = set()
        for _ in range(SETTINGS.rounds):
            touched = self._round(touched)
            every |= touched
            if not touched:
                break
        return every

    def _round(self, letters: set[int]) -> set[int]:
        """Make the best exchanges of some letters, one for each letter; returns the letters that took part."""
        # the number of the piece of line, of one letter and between forks, that each vertex lies on
        a, b = self._sheet.graph.edges.T
        same = (self.letter[a] == self.letter[b]) & self._simple[a] & self._simple[b]
        self._branch = number_pieces(self._sheet.graph.edges[same], len(self.letter))
        offers = list(self._offers(letters))
        if not offers:
            return set()
        gains = self._gains(offers)
        value = gains - SETTINGS.torn * np.array([self._count_tears(offer) for offer in offers])
        done: set[int] = set()
        for number in np.argsort(-value, kind="stable").tolist():
            offer = offers[number]
            if gains[number] >= SETTINGS.margin and not {offer.giver, offer.taker} & done:
                self._make(offer)
                done |= {offer.giver, offer.taker}
        return done

    def _count_tears(self, offer: _Offer) -> int:
        """At how many places more the pen's line is cut between two letters once an offer is made."""
        first, end = self._graph.indptr[offer.vertices], self._graph.indptr[offer.vertices + 1]
        edges = np.repeat(end - np.cumsum(end - first), end - first) + np.arange((end - first).sum())
        beside = self._graph.indices[edges]
        owners = self.letter[beside]
        kept = (owners == offer.giver) & ~np.isin(beside, offer.vertices)
        return int(kept.sum() - (owners == offer.taker).sum())

    def _make(self, offer: _Offer) -> None:
        self.letter[offer.vertices] = offer.taker
        for number in (offer.giver, offer.taker):
            self._sets[number] = np.flatnonzero(self.letter == number)
        both = [offer.giver, offer.taker]
        features = features_of(self._sheet, self._lines[both], [self._sets[number] for number in both])
        self._features[both] = features
        rows = np.array([self._row[number] for number in both])
        self._seen[rows] = self._credit_readings(np.array(both), [self._sets[number] for number in both])
        self._right[rows] = self._siblings.right(rows, features, self._seen[rows] - self._usual[rows])

    def _surprises(self, numbers: Indices, sets: Sequence[Indices]) -> Array:
        """(k,): how oddly some vertices would read as letters."""
        found = np.zeros(len(numbers))
        read = np.flatnonzero(self._readable[numbers]).tolist()
        seen = [picture_of_vertices(self._sheet, int(self._lines[numbers[k]]), sets[k]) for k in read]
        found[read] = surprises(self._reader, seen, [self._names[numbers[k]] for k in read])
        return found

    def _credit_readings(self, numbers: Indices, sets: Sequence[Indices]) -> Array:
        """The same, where reading less oddly than now counts only if it is read as nothing else any more."""
        rows = [self._row[number] for number in numbers.tolist()]
        now, then = self._seen[rows], self._surprises(numbers, sets)
        least = np.maximum(np.maximum(SETTINGS.read, self._usual[rows]), SETTINGS.better * now)
        return np.where((least < then) & (then < now), now, then)

    def _gains(self, offers: Sequence[_Offer]) -> Array:
        """(k,): how many more letters each offer makes right, as `Siblings.right` expects; 0 if not each.

        Only what would gain if both read perfectly is read.
        """
        letters = np.array([(offer.giver, offer.taker) for offer in offers], dtype=np.intp)
        left = [np.setdiff1d(self._sets[o.giver], o.vertices, assume_unique=True) for o in offers]
        grown = [np.sort(np.concatenate([self._sets[o.taker], o.vertices])) for o in offers]
        rows = np.array([[self._row[number] for number in pair] for pair in letters.tolist()], dtype=np.intp).T
        features = [
            features_of(self._sheet, self._lines[numbers], sets)
            for numbers, sets in zip(letters.T, (left, grown), strict=True)
        ]
        strange = -self._usual[rows]
        gains = self._measure_gain(rows, features, strange)
        read = np.flatnonzero(gains >= SETTINGS.margin)
        for side, sets in enumerate((left, grown)):
            strange[side, read] += self._credit_readings(letters[read, side], [sets[k] for k in read.tolist()])
        return self._measure_gain(rows, features, strange)

    def _measure_gain(self, rows: Indices, features: Sequence[Array], strange: Array) -> Array:
        """(k,): what givers and takers (rows, 2 × k) gain together; 0 if not each of them does."""
        giver, taker = (
            self._siblings.right(*side) - self._right[side[0]] for side in zip(rows, features, strange, strict=True)
        )
        return np.where(np.minimum(giver, taker) >= SETTINGS.each, giver + taker, 0.0)

    def _offers(self, letters: set[int]) -> Iterator[_Offer]:
        # letters that stand side by side on a line, and those of different lines that touch
        beside = [(a, b) for a, b in pairwise(self._sets) if self._lines[a] == self._lines[b]]
        owners = self.letter[self._sheet.graph.edges]
        crossing = owners[(owners[:, 0] != owners[:, 1]) & (owners >= 0).all(axis=1)]
        touching = np.unique(np.sort(crossing, axis=1), axis=0)
        for first, second in [*beside, *((a, b) for a, b in touching.tolist() if self._lines[a] != self._lines[b])]:
            if {first, second} & letters and not {first, second} & self._held:
                yield from self._make_offers(first, second)
                yield from self._make_offers(second, first)

    def _make_offers(self, giver: int, taker: int) -> Iterator[_Offer]:
        own = self._sets[giver]
        rows = self._graph[own]
        inner = rows[:, own]
        most = (1 - SETTINGS.kept) * self._length[own].sum()
        chosen: set[bytes] = set()
        for part in (*self._find_near_contact(own, rows, inner, taker), *self._pieces(own, inner, taker)):
            vertices = own[part]
            if 0 < len(vertices) < len(own) and self._length[vertices].sum() <= most and part.tobytes() not in chosen:
                chosen.add(part.tobytes())
                yield _Offer(giver, taker, vertices)

    def _find_near_contact(self, own: Indices, rows: csr_matrix, inner: csr_matrix, taker: int) -> Iterator[Array]:
        """(k,) bool: what lies near the places where a letter meets its taker."""
        meets = np.flatnonzero(np.add.reduceat(np.r_[self.letter[rows.indices] == taker, False], rows.indptr[:-1]) > 0)
        touching = bool(len(meets))
        if not touching:
            gap = self._measure_distance(own, taker)
            if gap.min() > SETTINGS.beside:
                return
            meets = np.array([gap.argmin()])
        away = dijkstra(inner, indices=meets, min_only=True)
        for reach in SETTINGS.reaches:
            part = away <= reach
            if touching or self._length[own[part]].sum() >= SETTINGS.cut:
                yield np.asarray(part)
        branch = self._branch[own]
        for number in np.unique(branch[away <= SETTINGS.near]).tolist():
            yield np.asarray(branch == number)

    def _pieces(self, own: Indices, inner: csr_matrix, taker: int) -> Iterator[Array]:
        """(k,) bool: separate small pieces of a letter that lie beside its taker."""
        count, piece = connected_components(inner, directed=False)
        if count == 1:
            return
        size, gap = np.bincount(piece, self._length[own]), self._measure_distance(own, taker)
        for number in np.flatnonzero(size < SETTINGS.piece).tolist():
            if gap[piece == number].min() < SETTINGS.beside:
                yield np.asarray(piece == number)

    def _measure_distance(self, own: Indices, taker: int) -> Array:
        """(k,): how far each vertex of a letter lies from its taker's ink, across or up."""
        return np.asarray(cKDTree(self._place[self._sets[taker]]).query(self._place[own], p=np.inf)[0])


def exchange_ink(
    sheet: ScannedPage, alignment: Alignment, letters: Indices, held: frozenset[int] = frozenset()
) -> tuple[Indices, Mapping[int, Indices]]:
    """Let letters exchange ink; (n,) the letter of each vertex, as indices in `Alignment.letters`, and `crossings`.

    A page with few letters is left as it is.

    held : letters whose ink is known: they neither give nor take, and their neighbours alone begin.
    """
    if len(alignment.letters) < SETTINGS.least:
        return letters, {}
    glyphs, _ = extract_glyphs(sheet, alignment, letters)
    hand = ScannedHand("", "", (sheet,), glyphs)
    reader = author_reader(hand)
    names = [letter.text for letter in alignment.letters]
    lines = np.array([line.number for line in alignment.lines for _ in line.letters], dtype=np.intp)
    exchange = InkExchange(sheet, letters, names, lines, reader, held)
    exchange.give_crossbars(_find_crossbars(hand, {each.at: k for k, each in enumerate(alignment.letters)}))
    exchange.settle()
    return exchange.letter, exchange.crossings


def _find_crossbars(hand: ScannedHand, number: Mapping[int, int]) -> Iterator[tuple[int, Crossbar]]:
    """The crossbars of the words of a page, each with its letter; `number` : place in the transcript → letter."""
    ways = {n: [way.path for way in glyph.ligatures] for n, glyph in enumerate(hand.glyphs)}
    crossbars = WordCrossbars(hand, ways)
    for n, glyph in enumerate(hand.glyphs):
        if glyph.before == NOBODY:
            for bar in crossbars[n]:
                yield number[hand.glyphs[bar.glyph].at], bar
