"""Connectionist temporal classification: texts from the posteriors of columns or points that carry no borders.

A network says of every step which label it sees, or none (the blank).  A text is read where its labels come in order,
each over any number of steps; equal neighbours need a blank between them.

Source: Graves, Fernández, Gomez and Schmidhuber 2006 (forward and backward variables, best path); the prefix beam
search after Hannun, Maas, Jurafsky and Ng 2014.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.values import Array, Indices

BLANK = 0  # the label that stands for none
_NEVER = -np.inf
_TOGETHER = 32  # texts whose edits are worked out at once: their runs stay in the processor's cache


@dataclass(frozen=True)
class Hypothesis:
    """A text that the steps may be read as.

    labels : of its letters, none of them `BLANK`.
    log_probability : of all ways together in which the steps give it, as far as the search kept them.
    """

    labels: tuple[int, ...]
    log_probability: float


def log_probability(log_posteriors: Array, labels: Sequence[int]) -> float:
    """The natural logarithm of the probability that the steps (n, classes) read as `labels`.

    Minus infinity where the steps are too few for them.

    Raises ValueError: a label is the blank, or not a class.
    """
    return float(log_probabilities([log_posteriors], [labels])[0])


def log_probabilities(log_posteriors: Sequence[Array], labels: Sequence[Sequence[int]]) -> Array:
    """(n,) `log_probability` of some texts, all at once."""
    states = [_states(own, logs.shape[1]) for logs, own in zip(log_posteriors, labels, strict=True)]
    seen = [logs[:, own] for logs, own in zip(log_posteriors, states, strict=True)]
    scores = _forward_of(seen, states)
    empty = [_NEVER if own else 0.0 for own in labels]
    ends = [
        np.logaddexp.reduce(score[-1, -2:]) if len(score) else none for score, none in zip(scores, empty, strict=True)
    ]
    return np.array(ends, dtype=np.float64)


def occupancies(log_posteriors: Sequence[Array], labels: Sequence[Sequence[int]]) -> list[Array]:
    """Of each text (n, letters): the probability that a step belongs to each letter, given that all read as `labels`.

    All zero where the steps (n, classes) of a text cannot be read so.
    """
    states = [_states(own, logs.shape[1]) for logs, own in zip(log_posteriors, labels, strict=True)]
    seen = [logs[:, own] for logs, own in zip(log_posteriors, states, strict=True)]
    ahead = _forward_of(seen, states)
    # backward is forward of the reversed steps; a state may be skipped to where it may be skipped from in reverse
    behind = _forward_of([one[::-1, ::-1] for one in seen], [own[::-1] for own in states])
    found = []
    for one, first, last in zip(seen, ahead, behind, strict=True):
        with np.errstate(invalid="ignore"):
            both = (first + last[::-1, ::-1] - one)[:, 1::2]
        total = np.logaddexp.reduce(first[-1, -2:]) if len(one) and both.shape[1] else _NEVER
        possible = np.isfinite(total)
        found.append(np.exp(np.where(np.isnan(both), _NEVER, both) - total) if possible else np.zeros(both.shape))
    return found


def _forward_of(seen: Sequence[Array], states: Sequence[Indices]) -> list[Array]:
    """`_forward` of texts of any lengths, all at once."""
    steps, most = max(map(len, seen), default=0), max(map(len, states), default=0)
    if not steps:
        return list(seen)
    padded, skips = np.full((steps, len(seen), most), _NEVER), np.zeros((len(seen), most), dtype=bool)
    for k, (one, own) in enumerate(zip(seen, states, strict=True)):
        padded[: len(one), k, : len(own)], skips[k, : len(own)] = one, _skips(own)
    score = _forward(padded, skips)
    return [score[: len(one), k, : one.shape[1]] for k, one in enumerate(seen)]


def edits(log_posteriors: Array, labels: Sequence[int]) -> Array:
    """(2 · letters + 1, classes): log probability of every text that is an edit away.

    Row 2k + 1 has letter k replaced by each class, or left out for the blank; row 2k has each class put in before it.
    """
    return edits_of([log_posteriors], [labels])[0]


def edits_of(log_posteriors: Sequence[Array], labels: Sequence[Sequence[int]]) -> list[Array]:
    """`edits` of some texts, those of about as many steps at once.  Source: own method, from the same variables."""
    found, order = dict[int, Array](), sorted(range(len(labels)), key=lambda k: len(log_posteriors[k]))
    for begin in range(0, len(order), _TOGETHER):
        some = order[begin : begin + _TOGETHER]
        found |= zip(some, _edits([log_posteriors[k] for k in some], [labels[k] for k in some]), strict=True)
    return [found[k] for k in range(len(labels))]


def _edits(log_posteriors: Sequence[Array], labels: Sequence[Sequence[int]]) -> list[Array]:
    classes, most = log_posteriors[0].shape[1], len(log_posteriors[-1])
    states = [_states(own, classes) for own in labels]
    seen = [logs[:, own] for logs, own in zip(log_posteriors, states, strict=True)]
    ahead, behind = _forward_of(seen, states), _forward_of([one[::-1, ::-1] for one in seen], [s[::-1] for s in states])
    wide = max(map(len, states))
    # of each step and state: how what is new is come to and gone on from, from and to unlike letters, and like ones
    ways = np.full((4, most, len(labels), wide), _NEVER)
    beside, likeliest = np.full((2, len(labels), wide), -1), np.zeros((most, len(labels)))
    probable = np.zeros((most, len(labels), classes))
    for k, (logs, own) in enumerate(zip(log_posteriors, states, strict=True)):
        steps, at, is_letter = len(logs), np.arange(len(own)), np.arange(len(own)) % 2
        # states of the blank and of the letter before what is new, and after it
        near = (ahead[k][:-1], -1), (behind[k][::-1, ::-1][1:], 1)
        for side, (there, on) in enumerate(near if steps else ()):
            blank, letter = at + on * is_letter, at + on * (1 + is_letter)
            none, letter = (letter < 0) | (letter >= len(own)), np.clip(letter, 0, len(own) - 1)
            beside[side, k, at] = np.where(none, -1, own[letter])
            both = ways[2 * side : 2 * side + 2, :steps, k, : len(own)]
            both[:, -side] = np.where(none, 0.0, _NEVER)
            # by way of the blank, or of both; a neighbour that equals what is new is parted from it by a blank
            both[1, 1 - side : steps - side] = there[:, blank]
            both[0, 1 - side : steps - side] = np.logaddexp(there[:, blank], np.where(none, _NEVER, there[:, letter]))
        likeliest[:steps, k] = logs.max(axis=1)
        probable[:steps, k] = np.exp(logs - likeliest[:steps, k, None])
    totals = _runs(ways, beside, probable, likeliest)
    for total, text, first, last in zip(totals, labels, ahead, behind, strict=True):
        total[::2, BLANK] = _NEVER
        for number in range(len(text) if len(first) else 0):
            total[2 * number + 1, BLANK] = _probability_without(number, text, first, last[::-1, ::-1])
    return [total[: len(own)] for total, own in zip(totals, states, strict=True)]


def _runs(ways: Array, beside: Indices, probable: Array, likeliest: Array) -> Array:
    """(n, states, classes): log probability of all ways with one run of any class in the place of each state.

    Probabilities, not their logarithms, are added step by step, which takes a fifth of the time; each state's are
    shares of the most that any of them can have been by then.
    """
    before = np.cumsum(likeliest, axis=0) - likeliest
    most = np.maximum.accumulate(ways[0] - before[:, :, None], axis=0)
    bound = np.where(np.isneginf(most), 0.0, most)
    held = np.exp(np.concatenate([most[:1], most[:-1]]) - bound)
    enter, enter_like = np.exp(ways[:2] - before[:, :, None] - bound)
    leave = ways[2:] + (before + likeliest)[:, :, None] + bound
    scale = leave[0].max(axis=0, initial=_NEVER)
    scale = np.where(np.isneginf(scale), 0.0, scale)
    leave, leave_like = np.exp(leave - scale)
    rows = np.indices(scale.shape)
    (entered, came), (left, goes) = (((rows[0][of >= 0], rows[1][of >= 0]), of[of >= 0]) for of in beside)
    run = np.zeros((*scale.shape, probable.shape[2]))
    total, run_like, total_like = np.zeros_like(run), np.zeros(len(came)), np.zeros(len(goes))
    for step, row in enumerate(probable):
        run *= held[step][..., None]
        run_like = (run_like * held[step][entered] + enter_like[step][entered]) * row[entered[0], came]
        run += enter[step][..., None]
        run *= row[:, None]
        run[(*entered, came)] = run_like
        total += run * leave[step][..., None]
        total_like += run[(*left, goes)] * leave_like[step][left]
    total[(*left, goes)] = total_like
    with np.errstate(divide="ignore"):  # of texts that are too long for the steps
        return np.asarray(np.log(total) + scale[..., None])


def _probability_without(number: int, labels: Sequence[int], ahead: Array, behind: Array) -> float:
    """Log probability of the text without a letter: ways that leave the letter before it for what follows it."""
    last, after = number + 1 == len(labels), 2 * number + 2
    onward = behind[:, after]
    if not last and (number == 0 or labels[number - 1] != labels[number + 1]):
        onward = np.logaddexp(onward, behind[:, after + 1])
    if number == 0:
        return float(onward[0])
    before = ahead[:, after - 3]
    ways = np.logaddexp.reduce(before[:-1] + onward[1:]) if len(before) > 1 else _NEVER
    return float(np.logaddexp(ways, before[-1]) if last else ways)


def alignment(log_posteriors: Array, labels: Sequence[int]) -> Indices:
    """(letters, 2) int: first step and the one after the last of each letter, on the best way through the steps.

    Raises ValueError: the steps are too few for the labels.
    """
    states = _states(labels, log_posteriors.shape[1])
    if not labels:
        return np.zeros((0, 2), dtype=np.intp)
    seen, skips = log_posteriors[:, states], _skips(states)
    count = len(states)
    score = np.full(count, _NEVER)
    came_from = np.zeros((len(seen), count), dtype=np.intp)
    for step, row in enumerate(seen):
        if step == 0:
            score[:2] = row[:2]
            continue
        moves = np.full((3, count), _NEVER)
        moves[0], moves[1, 1:] = score, score[:-1]
        moves[2, 2:] = np.where(skips[2:], score[:-2], _NEVER)
        best = moves.argmax(axis=0)
        came_from[step] = best
        score = moves[best, np.arange(count)] + row
    state = count - 1 - int(score[-2] >= score[-1]) if len(seen) else 0
    if len(seen) == 0 or not np.isfinite(score[state]):
        raise ValueError(f"{len(seen)} steps are too few for {len(labels)} letters")
    way = np.empty(len(seen), dtype=np.intp)
    for step in range(len(seen) - 1, -1, -1):
        way[step] = state
        state -= int(came_from[step, state])
    letters = np.arange(len(labels)) * 2 + 1
    return np.column_stack([np.searchsorted(way, letters, "left"), np.searchsorted(way, letters, "right")])


def greedy(log_posteriors: Array) -> tuple[int, ...]:
    """The labels of the best path: the likeliest class of every step, repetitions and blanks left out."""
    best = log_posteriors.argmax(axis=1)
    changed = np.append(True, best[1:] != best[:-1]) if len(best) else np.zeros(0, bool)
    return tuple(int(label) for label in best[changed & (best != BLANK)])


def beams(log_posteriors: Array, width: int = 8, least: float = 1e-3) -> list[Hypothesis]:
    """The likeliest texts, best first: a beam search over prefixes.

    width : prefixes that are kept at each step.
    least : classes less likely than that at a step are not looked at there.
    """
    # of each prefix: log probability of ending in a blank, and in its last label
    kept: dict[tuple[int, ...], tuple[float, float]] = {(): (0.0, _NEVER)}
    for row in np.asarray(log_posteriors, dtype=np.float64):
        kept = _widen_prefixes(kept, row, np.nonzero(np.exp(row) > least)[0].tolist())
        kept = dict(sorted(kept.items(), key=lambda item: -np.logaddexp(*item[1]))[:width])
    found = [Hypothesis(prefix, float(np.logaddexp(*ends))) for prefix, ends in kept.items()]
    return [hypothesis for hypothesis in found if hypothesis.log_probability > _NEVER]


def _widen_prefixes(
    kept: dict[tuple[int, ...], tuple[float, float]], row: Array, classes: Sequence[int]
) -> dict[tuple[int, ...], tuple[float, float]]:
    """The prefixes after one step more: each stays as it is, or gains one of the classes."""
    grown: dict[tuple[int, ...], tuple[float, float]] = {}

    def add(prefix: tuple[int, ...], blank: float, label: float) -> None:
        had = grown.get(prefix, (_NEVER, _NEVER))
        grown[prefix] = (float(np.logaddexp(had[0], blank)), float(np.logaddexp(had[1], label)))

    for prefix, (blank, label) in kept.items():
        either = float(np.logaddexp(blank, label))
        add(prefix, either + row[BLANK], label + row[prefix[-1]] if prefix else _NEVER)
        for number in classes:
            if number != BLANK:
                before = blank if prefix and prefix[-1] == number else either
                add((*prefix, number), _NEVER, before + row[number])
    return grown


def _states(labels: Sequence[int], classes: int) -> Indices:
    """Blanks around and between the labels."""
    if any(not BLANK < label < classes for label in labels):
        raise ValueError(f"labels are 1 … {classes - 1}, got {list(labels)}")
    states = np.full(2 * len(labels) + 1, BLANK, dtype=np.intp)
    states[1::2] = labels
    return states


def _skips(states: Indices) -> Array:
    """(states,) bool: whether a state can be come to from the one before last: a letter, unlike the letter before."""
    skips = np.zeros(len(states), dtype=bool)
    skips[3::2] = states[3::2] != states[1:-2:2]
    return skips


def _forward(seen: Array, skips: Array) -> Array:
    """(n, …, states): log probability of the steps so far, over all ways that end in each state (skips: …, states)."""
    score = np.full((*seen.shape[:-1], seen.shape[-1] + 2), _NEVER)  # two states more, before the first: closed
    score[0, ..., 2:4] = seen[0, ..., :2]
    closed = np.where(skips, 0.0, _NEVER)
    for before, now, row in zip(score[:-1], score[1:], seen[1:], strict=True):
        reached = np.logaddexp(before[..., 2:], before[..., 1:-1])
        now[..., 2:] = np.logaddexp(reached, before[..., :-2] + closed) + row
    return score[..., 2:]
