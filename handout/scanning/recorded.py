"""The line of a pen whose way is known: vertices in the order of writing, instead of a skeleton of its ink.

Where strokes cross or are drawn over, their lines stay apart: there is no junction to be guessed at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from handout.errors import InputError
from handout.scanning.linegraph import mean_within
from handout.scanning.reading import WrittenPage
from handout.values import POSE, Array, LineGraph, Moments, Stroke


def followed(written: WrittenPage, strokes: Sequence[Stroke], *, timed: bool) -> WrittenPage:
    """A page with the line that its pen was recorded on in place of the one its ink shows.

    Parameters
    ----------
    strokes : in the order of writing, mm on the page before its borders were cut off; samples about a pixel apart, all
        with `width`.
    timed : whether their times mean anything.

    Raises
    ------
    InputError
        There are none.
    """
    if not strokes:
        raise InputError(f"{written.scan.source}: the recording has no movement of a pen on paper.")
    scan = written.scan
    counts = [len(stroke.t) for stroke in strokes]
    uv = np.concatenate([stroke.xy for stroke in strokes]) / scan.pixel - 0.5 - np.array(scan.origin)
    radius = _together([stroke.width for stroke in strokes]) / 2
    density = np.clip(mean_within(written.density.values, uv, radius / scan.pixel), 0, 2)
    first = np.cumsum([0, *counts[:-1]])
    edges = np.concatenate(
        [np.column_stack([np.arange(n - 1), np.arange(1, n)]) + a for a, n in zip(first, counts, strict=True)]
    )
    graph = LineGraph((uv + 0.5) * scan.pixel, radius, density, uv, edges)
    held = {name: [getattr(stroke, name) for stroke in strokes] for name in POSE}
    known = {name: _together(parts) for name, parts in held.items() if all(one is not None for one in parts)}
    times = np.concatenate([stroke.t for stroke in strokes]) if timed else None
    return replace(written, graph=graph, moments=Moments(times, **known))


def _together(parts: Sequence[Array | None]) -> Array:
    return np.concatenate([part for part in parts if part is not None])
