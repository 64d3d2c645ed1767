"""In which order words are written.

Order is part of how a page looks written, and so is the direction of a stroke: nothing is reordered unless it is asked
for, whole words at most, and no stroke is ever turned round.
"""

from __future__ import annotations

import numpy as np

from handout.values import Array, Stroke

_ROUNDS = 30


def by_travel(strokes: tuple[Stroke, ...]) -> tuple[Stroke, ...]:
    """The strokes with whole words moved about so that the pen travels less; as they are if that gains nothing.

    Strokes of one word stay in their order.  A stroke of no known word is a word of its own.
    """
    words = _words(strokes)
    if len(words) < 2:
        return strokes
    start = np.array([strokes[word[0]].xy[0] for word in words])
    end = np.array([strokes[word[-1]].xy[-1] for word in words])
    gap = np.hypot(*(start[None] - end[:, None]).transpose(2, 0, 1))  # from the end of row to the start of column
    order = list(range(len(words)))
    for candidate in (order, _nearest_next(gap)):
        better = _moved_about(candidate, gap)
        if _length(better, gap) < _length(order, gap) - 1e-9:
            order = better
    ordered = tuple(strokes[index] for word in order for index in words[word])
    return ordered if _travel(ordered) < _travel(strokes) - 1e-9 else strokes


def _travel(strokes: tuple[Stroke, ...]) -> float:
    start = np.array([stroke.xy[0] for stroke in strokes[1:]])
    end = np.array([stroke.xy[-1] for stroke in strokes[:-1]])
    return float(np.hypot(*(start - end).T).sum())


def _words(strokes: tuple[Stroke, ...]) -> list[list[int]]:
    """Indices of the strokes of each word, words in the order in which they were begun."""
    words: dict[tuple[str, int], list[int]] = {}
    for index, stroke in enumerate(strokes):
        words.setdefault(("word", stroke.word) if stroke.word >= 0 else ("alone", index), []).append(index)
    return list(words.values())


def _length(order: list[int], gap: Array) -> float:
    return float(gap[order[:-1], order[1:]].sum())


def _nearest_next(gap: Array) -> list[int]:
    """From the first word always on to the nearest that is left."""
    left = np.ones(len(gap), dtype=bool)
    order = [0]
    left[0] = False
    for _ in range(len(gap) - 1):
        order.append(int(np.argmin(np.where(left, gap[order[-1]], np.inf))))
        left[order[-1]] = False
    return order


def _moved_about(order: list[int], gap: Array) -> list[int]:
    """Move runs of one to three words to wherever that shortens the way, until nothing does."""
    order = list(order)
    for _ in range(_ROUNDS):
        gained = False
        for size in (1, 2, 3):
            for at in range(1, len(order) - size + 1):
                gained |= _move_run(order, at, size, gap)
        if not gained:
            break
    return order


def _move_run(order: list[int], at: int, size: int, gap: Array) -> bool:
    """Move the run of words at `at` to its best place (never before the first word); whether that gained anything."""
    run = order[at : at + size]
    rest = np.array(order[:at] + order[at + size :])
    tail = [gap[run[-1], rest[at]]] if at < len(rest) else [0.0]
    bridge = gap[rest[at - 1], rest[at]] if at < len(rest) else 0.0
    saved = gap[rest[at - 1], run[0]] + tail[0] - bridge
    into, out = gap[rest, run[0]], np.append(gap[run[-1], rest[1:]], 0.0)
    extra = into + out - np.append(gap[rest[:-1], rest[1:]], 0.0)
    best = int(np.argmin(extra))
    if extra[best] >= saved - 1e-9 or best == at - 1:
        return False
    order[:] = [*rest[: best + 1].tolist(), *run, *rest[best + 1 :].tolist()]
    return True
