"""The simulated EBB between its command parser and its motors: one command under way, a short queue, a pen servo."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from handout.plotting.simulated.ebb.moves import TICK, Accumulators, Counts, Move
from handout.plotting.simulated.paper import Paper
from handout.profiles import Plotter

_PULSE = 0.024  # s between pulses to the servo: eight channels of 3 ms
_SHOWN = 25  # ticks between two places that the paper is told
_NONE = np.zeros((0, 2), dtype=np.int64)


@dataclass(frozen=True)
class Job:
    """A command of the queue.

    make : works out its motion, when it begins, from the accumulators; None for what does not move.
    ticks : how long it lasts if it does not move; servo : (place, rate) to which the pen's servo goes, or None.
    enable : which motors it switches on or off, or None.
    """

    make: object = None
    ticks: int = 0
    servo: tuple[int, int] | None = None
    enable: tuple[int, int | None] | None = None
