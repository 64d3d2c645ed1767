"""A page of plans as JSON, to be looked at and changed.

::

    {"format": "handout-plans", "version": 1,
     "page": {"width": 148.0, "height": 210.0, "name": "A5"},      mm
     "timed": true,                                                whether the times are those of a recording
     "about": {…},
     "movements": [{"start": 0.0, "end": 0.81,                     s, pen down to pen up
                    "targets": [[12.1, 30.4], [13.9, 27.0], …],    mm, y down; one more than strokes
                    "strokes": [{"onset": 0.012, "duration": 0.21, s
                                 "asymmetry": 0.08,                1 − mode / median of its speed
                                 "theta": -0.6}, …],               rad, half of how far it turns
                    "place_db": 38.2, "speed_db": 26.0,            how well it explains the trace; not read
                    "word": 3}, …]}
"""

from __future__ import annotations

import msgspec
import numpy as np

from handout.motion.reconstruction.planned_page import Fit, PlannedPage
from handout.sinks import about


def to_json(page: PlannedPage) -> bytes:
    """A page of plans in the form described at the top of this file."""
    sheet = page.page
    file = {
        "format": "handout-plans",
        "version": 1,
        "page": {"width": float(sheet.width), "height": float(sheet.height), "name": about.plain(sheet.name)},
        "timed": page.timed,
        "about": about.plain(dict(page.about)),
        "movements": [_movement(fit) for fit in page.fits],
    }
    return msgspec.json.format(msgspec.json.encode(file), indent=1) + b"\n"


def _movement(fit: Fit) -> dict[str, object]:
    """A movement's fields in the order of the file; those that are not known are absent."""
    plan, names = fit.plan, ("onset", "duration", "asymmetry", "theta")
    rows = zip(*(getattr(plan, name).tolist() for name in names), strict=True)
    decibels = {"place_db": fit.place if np.isfinite(fit.place) else None, "speed_db": fit.speed}
    return {
        "start": plan.start,
        "end": plan.end,
        "targets": plan.targets.tolist(),
        "strokes": [dict(zip(names, row, strict=True)) for row in rows],
        **{name: round(value, 2) for name, value in decibels.items() if value is not None},
        **({} if fit.word == -1 else {"word": fit.word}),
    }
