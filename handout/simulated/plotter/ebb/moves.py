"""What a simulated EBB makes of its motion commands, tick by tick: 25 000 ticks a second, a step when 2³¹ overflows.

Every command becomes the steps of both motors at each of its ticks, worked out for all ticks at once in whole numbers.

Source: the accumulator as the board's documentation describes it, and its behaviour by version: up to 2.6 LM changes
its rate after adding it and between two commands a tick passes; from 2.7 half the acceleration is taken off first; from
3.0 rates have a sign.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

TICK = 4e-5  # s
FULL = 2**31
_CHUNK = 4096
_LONGEST = 25_000 * 120  # ticks after which a move that never ends is ended, so that a simulation does

Counts = NDArray[np.int64]


@dataclass
class Accumulators:
    """What is left of a step in each motor's accumulator."""

    left: list[int] = field(default_factory=lambda: [0, 0])

    def clear(self, which: int, falling: tuple[bool, bool] = (False, False)) -> None:
        """Bit 0: motor 1, bit 1: motor 2; one that will count down is filled instead."""
        for motor in (0, 1):
            if which >> motor & 1:
                self.left[motor] = FULL - 1 if falling[motor] else 0


@dataclass(frozen=True, eq=False)
class Move:
    """Steps of both motors since its beginning, at the end of each of its ticks: (ticks, 2); accumulators after it."""

    steps: Counts
    after: tuple[int, int]

    @property
    def ticks(self) -> int:
        return len(self.steps)


def by_time(ticks: int, rates: tuple[int, int], gains: tuple[int, int], left: list[int], signed: bool) -> Move:
    """LT: so many ticks, however many steps that makes."""
    tracks, after = [], []
    for rate, gain, begin in zip(rates, gains, left, strict=True):
        way = 1 if rate >= 0 else -1
        grown = begin + np.cumsum(_rates(rate if signed else abs(rate), gain, 0, ticks, signed))
        tracks.append(grown // FULL * (1 if signed else way))
        after.append(int(grown[-1]) % FULL if ticks else begin)
    return Move(np.stack(tracks, axis=1), (after[0], after[1]))


def by_steps(
    steps: tuple[int, int], rates: tuple[int, int], gains: tuple[int, int], left: list[int], half: bool
) -> Move:
    """SM and LM: each motor goes on until it has made its steps; the move ends with the slower of them.

    half : whether the rate is changed before it is added, beginning half a change lower.
    """
    tracks, after = [], []
    for count, rate, gain, begin in zip(steps, rates, gains, left, strict=True):
        track, end = _until(abs(count), rate, gain, begin, half)
        tracks.append(track if count >= 0 else -track)
        after.append(end)
    longest = max(len(track) for track in tracks)
    return Move(np.stack([_held(track, longest) for track in tracks], axis=1), (after[0], after[1]))


def constant_rate(steps: int, ms: int, exact: bool) -> int:
    """The rate of SM; short moves of boards before 3.0 are worked out to 16 bits only."""
    ticks = 25 * ms
    if exact:
        return min(steps * FULL // ticks, FULL - 1)
    coarse, rest = divmod(steps << 15, ticks)
    return min((coarse << 16) + ((rest << 16) // ticks if ms > 30 else 0), FULL - 1)


def _rates(rate: int, gain: int, first: int, ticks: int, signed: bool, half: bool = True) -> Counts:
    """What is added at each of the ticks from number `first`."""
    count = np.arange(first, first + ticks, dtype=np.int64)
    base = rate - int(gain / 2) + gain if half else rate
    rates = base + gain * count
    return rates if signed else rates % FULL  # below zero it rolls over


def _until(count: int, rate: int, gain: int, begin: int, half: bool) -> tuple[Counts, int]:
    """Steps at each tick until there are `count`, and what the accumulator keeps."""
    parts: list[Counts] = []
    made, first = 0, 0
    left = begin
    while made < count and first < _LONGEST:
        grown = left + np.cumsum(_rates(rate, gain, first, _CHUNK, False, half))
        total = made + grown // FULL
        done = int(np.searchsorted(total, count))
        parts.append(total[: done + 1])
        if done < _CHUNK:
            return np.concatenate(parts), int(grown[done]) % FULL
        made, left, first = int(total[-1]), int(grown[-1]) % FULL, first + _CHUNK
    return (np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)), left


def _held(track: Counts, length: int) -> Counts:
    last = track[-1] if len(track) else 0
    return np.concatenate([track, np.full(length - len(track), last, dtype=np.int64)])
