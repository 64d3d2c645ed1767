"""One letter's line as the strokes that it was written with: the traversal that is cheap and like a form of the letter.

`candidates` takes off dots and accents, cuts the rest where forms say that strokes may begin or turn, finds what
crossbars there are, searches traversals of what is left, and adds to the cost of each how far it is from the forms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeAlias

import numpy as np

from handout.hand.letter_classes import CROSSED, CROSSED_ASLANT
from handout.motion.recovery import letter_forms
from handout.motion.recovery.crossbars import (
    DELAYED,
    SHARED,
    branches_beside,
    crossbar_chains,
    find_crossbar,
    lies_on,
)
from handout.motion.recovery.form_matching import form_distances, nearest_forms
from handout.motion.recovery.ink_gaps import bridge_gaps
from handout.motion.recovery.letter_forms import HANDS, LetterForms, forms_of, resample_strokes, turning_points
from handout.motion.recovery.letter_line import (
    DOT,
    POINTED,
    Candidate,
    LetterLine,
    LetterStrokes,
    find_dots,
    find_lead_in,
    find_points,
    has_dots,
    loop_direction_errors,
)
from handout.motion.recovery.network import (
    WEIGHTS,
    BranchNetwork,
    CostWeights,
    Ends,
    build_network,
    chain_vertices,
    ring_seams,
    subnetwork,
)
from handout.motion.recovery.traversal import Traversal, beam_search, form_guides, guided_search
from handout.values import Array, Indices

_TRAVERSALS = 32  # that are compared
_MARGIN = 10.0  # a traversal that costs so much more than the cheapest is dropped, however like a form it is
_FORMS = 6  # forms that they are compared with
_ALONG = 16  # places of a stroke that tell whether a form delays it

_Chains: TypeAlias = Sequence[tuple[int, ...]]


@dataclass(frozen=True, eq=False)
class _Laid:
    """The forms that lie nearest to a letter, and their places (f, s, 2), laid over it."""

    forms: LetterForms
    xy: Array


def trace_letter(
    line: LetterLine, letter: str, *, hands: tuple[str, ...] = HANDS, weights: CostWeights = WEIGHTS
) -> LetterStrokes:
    """The strokes of a letter, in the order of writing."""
    return candidates(line, letter, hands=hands, weights=weights)[0].letter_strokes


def candidates(
    line: LetterLine,
    letter: str,
    *,
    hands: tuple[str, ...] = HANDS,
    weights: CostWeights = WEIGHTS,
    most: int = 1,
    margin: float = np.inf,
) -> list[Candidate]:
    """Ways in which a letter may have been written, the cheapest first.

    most : how many are given.
    margin : none is given that costs so much more than the cheapest.
    """
    half_width = float(np.median(line.radius))
    least = DOT * line.x_height if has_dots(letter) else 0.0
    edges = bridge_gaps(line.xy, line.radius, line.edges, half_width, line.joints, least)
    net = build_network(line.xy, line.radius, line.density, edges, half_width, line.usual)
    points = find_points(net) if letter in POINTED else ()
    if points:
        return [Candidate(points, 0.0, lambda: ((False,) * len(points),) * 2)]
    apart = find_dots(net, line.x_height, line.baseline, line.joints) if has_dots(letter) else {}
    dots = sorted(apart.values(), key=lambda v: float(line.xy[v, 0].mean()))
    rest = [b for b in range(len(net.branches)) if b not in apart]
    if not rest:
        return [Candidate(tuple(dots), 0.0, lambda: ((True,) * len(dots),) * 2)]
    search = _search(net, rest, line, letter, hands, weights)
    total, drawn = search.costs()
    ranked = [k for k in np.argsort(total, kind="stable")[:most].tolist() if total[k] <= total.min() + margin]
    return [
        Candidate((*search.strokes(k), *dots), float(total[k]), partial(search.flags, k, drawn, len(dots)))
        for k in ranked
    ]


@dataclass(frozen=True, eq=False)
class _TracedLetter:
    """The traversals of one letter's line beside its dots, with what tells which of them was written.

    foreign : crossbars of other letters among their strokes.
    laid : the forms that they are compared with; None where the letter has none.
    """

    line: LetterLine
    letter: str
    net: BranchNetwork
    traversals: Sequence[Traversal]
    foreign: _Chains
    laid: _Laid | None

    @cached_property
    def _path_of(self) -> dict[tuple[int, ...], Indices]:
        """Vertices of each stroke; traversals have many of their strokes in common."""
        return {s: chain_vertices(self.net, s) for s in dict.fromkeys(s for t in self.traversals for s in t.strokes)}

    def costs(self) -> tuple[Array, Indices | None]:
        """What each traversal costs, all told, and the drawn form that each is most like."""
        line = self.line
        total = np.array([traversal.cost for traversal in self.traversals])
        total += letter_forms.WEIGHTS.loop * np.array(
            [
                loop_direction_errors(self.net, traversal.strokes, self.letter, line.baseline, line.x_height)
                for traversal in self.traversals
            ]
        )
        foot = find_lead_in(self.net, line, self.letter)
        if foot is not None:
            total += letter_forms.WEIGHTS.led * np.array(
                [any(foot ^ 1 in stroke for stroke in traversal.strokes) for traversal in self.traversals]
            )
        if self.laid is None:
            return total, None
        places = {stroke: self.net.xy[path] for stroke, path in self._path_of.items()}
        # how much traversals cost for being unlike the forms of a letter, and the drawn form that each is most like
        weights, forms, foreign = letter_forms.WEIGHTS, self.laid.forms, self.foreign
        parts = [
            [places[s] for s in traversal.strokes if s not in foreign] or [places[s] for s in traversal.strokes]
            for traversal in self.traversals
        ]
        apart = form_distances(parts, forms, self.laid.xy, entered=bool(line.entries), left=bool(line.exits))
        unlike = weights.unlike * apart + forms.cost
        lifts = np.array([len(traversal.strokes) - 1 for traversal in self.traversals])
        unlike -= weights.spared * np.minimum(lifts[:, None], forms.strokes - 1)
        unlike, drawn = unlike.min(axis=1), np.where(forms.drawn, unlike, np.inf).argmin(axis=1)
        return total + unlike, drawn

    def strokes(self, number: int) -> list[Indices]:
        """The strokes of a traversal."""
        return [_with_overlap(self._path_of[s], self.line) for s in self.traversals[number].strokes]

    def flags(self, number: int, drawn: Indices | None, dots: int) -> tuple[tuple[bool, ...], tuple[bool, ...]]:
        """Tell of the strokes of a traversal, and of the dots after it, which are delayed and which are crossbars."""
        traversal = self.traversals[number]
        late = [False] * len(traversal.strokes)
        if self.laid is not None and drawn is not None:
            form = int(drawn[number])
            for k, stroke in enumerate(traversal.strokes[1:], 1):  # those that lie along what a form delays
                places = resample_strokes([self.net.xy[self._path_of[stroke]]], _ALONG)[0]
                away = ((places[:, None] - self.laid.xy[form][None]) ** 2).sum(axis=-1)
                late[k] = bool(self.laid.forms.delayed[form][away.argmin(axis=1)].mean() > 0.5)
        bars = tuple(by_form or s in traversal.crossbars for by_form, s in zip(late, traversal.strokes, strict=True))
        # a bar waits only where the pen must first go on to the next letter
        line = self.line
        waits = bool(line.joints if line.joined_hand else line.exits) or (line.joined_hand and self.letter in DELAYED)
        delayed = (s in self.foreign or (waits and bar) for bar, s in zip(bars, traversal.strokes, strict=True))
        return (*delayed, *(True,) * dots), (*bars, *(True,) * dots)


def _search(
    net: BranchNetwork,
    rest: Sequence[int],
    line: LetterLine,
    letter: str,
    hands: tuple[str, ...],
    weights: CostWeights,
) -> _TracedLetter:
    """The cheap traversals of some branches of a letter, those that its forms would take among them."""
    laid, turns = _nearest(net, rest, line, letter, hands)
    # branches are cut where forms turn, rings were closed, and bars end
    seams = ring_seams(net, rest)
    rings = set[int]().union(*seams.values())
    bar_ends = [int(bar[end]) for bar in (*line.own_bars, *line.foreign_bars) for end in (0, -1)]
    net = subnetwork(net, rest, [*(v for v in turns if v not in rings), *seams, *bar_ends])
    ends = Ends(*(_ends_at(net, vertices) for vertices in (line.entries, line.exits, line.bar_entries)))
    foreign = [chain for bar in line.foreign_bars for chain in crossbar_chains(net, bar, line.entries)]
    cheap = _with_crossbars(net, line, letter, ends, foreign, weights, laid)
    least = min(traversal.cost for traversal in cheap)
    cheap = [traversal for traversal in cheap if traversal.cost <= least + _MARGIN]
    if not foreign and not line.own_bars:
        cheap += _search_guided(net, line.x_height, ends, laid, weights, cheap)
    return _TracedLetter(line, letter, net, cheap, foreign, laid)


def _search_guided(
    net: BranchNetwork,
    x_height: float,
    ends: Ends,
    laid: _Laid | None,
    weights: CostWeights,
    known: Sequence[Traversal],
) -> list[Traversal]:
    """Search the traversals, besides those known, that follow forms of other than built-in hands, if there are any."""
    taught = np.zeros(0, dtype=np.intp) if laid is None else np.flatnonzero(~laid.forms.drawn)
    if laid is None or not len(taught):
        return []
    guides, there = form_guides(net, laid.xy[taught], laid.forms.stroke_of[taught]), {t.strokes for t in known}
    guided = guided_search(net, x_height, guides, Ends(ends.entries, ends.exits), weights=weights)
    return [traversal for traversal in guided if traversal.strokes not in there]


def _nearest(
    net: BranchNetwork, rest: Sequence[int], line: LetterLine, letter: str, hands: tuple[str, ...]
) -> tuple[_Laid | None, list[int]]:
    """The forms that lie nearest to a letter, laid over it; and vertices where they begin, cease or turn."""
    every = forms_of(letter, bool(line.entries), bool(line.exits), hands)
    if every is None:
        return None, []
    foreign = {int(v) for bar in line.foreign_bars for v in bar}
    inner = [b for b in rest if not {int(net.branches[b][0]), int(net.branches[b][-1])} & line.joints]
    body = [b for b in inner if not lies_on(net.branches[b], foreign)]
    vertices = np.unique(np.concatenate([net.branches[b] for b in body or rest]))
    forms, laid = nearest_forms(every, net.xy[vertices], _FORMS)
    turns = turning_points(net, body, vertices, laid, forms) if body else []
    barred = {int(v) for bar in line.own_bars for v in bar}
    return _Laid(forms, laid), [v for v in turns if v not in barred]


def _with_crossbars(
    net: BranchNetwork,
    line: LetterLine,
    letter: str,
    ends: Ends,
    foreign: _Chains,
    weights: CostWeights,
    laid: _Laid | None,
) -> list[Traversal]:
    """Traversals with the crossbars found beforehand, which come last; where there are none, other traversals."""
    bar_chains = [chain for bar in line.own_bars for chain in crossbar_chains(net, bar, line.entries)]
    search = Ends(ends.entries, ends.exits)
    barred: list[Traversal] = []
    if not bar_chains and not line.own_bars and letter in CROSSED | CROSSED_ASLANT:
        bar = find_crossbar(net, _bar_starts(net, ends, foreign), line.x_height, aslant=letter in CROSSED_ASLANT)
        if bar:
            barred += _beside_bars(net, line.x_height, [*foreign, bar], search, weights, laid)
    if not barred:
        barred += _beside_bars(net, line.x_height, [*foreign, *bar_chains], search, weights, laid)
    return barred or beam_search(net, line.x_height, ends, weights=weights, most=_TRAVERSALS)


def _beside_bars(
    net: BranchNetwork, x_height: float, bars: _Chains, ends: Ends, weights: CostWeights, laid: _Laid | None
) -> list[Traversal]:
    """Traversals of a letter beside its crossbars, which come last; none if there is nothing else."""
    if not bars:
        return beam_search(net, x_height, ends, weights=weights, most=_TRAVERSALS)
    beside = branches_beside(net, [e for chain in bars for e in chain])
    if not beside:
        return []
    number = {b: i for i, b in enumerate(beside)}
    entries, exits = (
        [2 * number[e >> 1] + (e & 1) for e in half_edges if e >> 1 in number]
        for half_edges in (ends.entries, ends.exits)
    )
    rest = subnetwork(net, beside)
    traversals = beam_search(rest, x_height, Ends(entries, exits), weights=weights, most=_TRAVERSALS)
    traversals += _search_guided(rest, x_height, Ends(entries, exits), laid, weights, traversals)
    return [
        Traversal((*(tuple(2 * beside[e >> 1] + (e & 1) for e in s) for s in t.strokes), *bars), t.cost, tuple(bars))
        for t in traversals
    ]


def _bar_starts(net: BranchNetwork, ends: Ends, foreign: _Chains) -> list[int]:
    """Loose ends where a letter's own crossbar may begin."""
    passed = {e >> 1 for chain in foreign for e in chain}
    loose = (e for e in range(len(net.node)) if net.is_loose(e))
    return [e for e in loose if e >> 1 not in passed and e not in ends.entries]


def _ends_at(net: BranchNetwork, vertices: Sequence[int]) -> list[int]:
    """The ends at some nodes."""
    return [end for end, node in enumerate(net.node.tolist()) if node in vertices]


def _with_overlap(path: Indices, line: LetterLine) -> Indices:
    """A stroke with what it shares at its ends with others, if it is a known crossbar."""
    for bar, (before, after) in zip((*line.own_bars, *line.foreign_bars), line.bar_overlaps, strict=False):
        if len(path) > 1 and np.isin(path, bar).mean() >= SHARED:
            first = before if path[0] == bar[0] else before[:0]
            return np.concatenate([first, path, after if path[-1] == bar[-1] else after[:0]])
    return path
