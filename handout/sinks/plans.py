"""Pages of plans: as JSON, to be looked at and changed, and as a picture of how well they fit a drawing.

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

from handout.motion.reconstruction.planned_page import PlannedPage, PlannedStroke, sample_times
from handout.motion.reconstruction.recording_fit import SHORTEST, prepare_recording
from handout.sinks import about
from handout.values import Array, Drawing

_MARGIN = 8.0  # mm
_ROW, _GAP = 26.0, 9.0  # mm: height of a row of speeds, and between rows
_SECONDS = 3.0  # a row
_COLOURS = ("#d1495b", "#edae49", "#66a182", "#8d5a97", "#2e86ab")


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


def _movement(fit: PlannedStroke) -> dict[str, object]:
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


def fit_report(drawing: Drawing, page: PlannedPage) -> bytes:
    """How well plans explain a drawing, as an SVG picture.

    Upper part: the drawing in grey, the paths of the plans in blue over it, virtual targets as numbered circles joined
    by thin lines.  Lower part, row by row: the speed of the drawing in grey, that of the plan in blue, and every
    stroke's own pulse.

    drawing : the trace; page : its plans, made by `planned_page.fit`, a plan a stroke.
    """
    bounds = drawing.bounds
    assert bounds is not None
    left, top, right, bottom = bounds
    wide, high = max(right - left, 20.0), bottom - top
    scale = min(170.0 / wide, 120.0 / max(high, 5.0), 8.0)
    rows = max(1, int(np.ceil(_clock(page)[-1] / _SECONDS)))
    upper = high * scale + 2 * _MARGIN
    height = upper + 14 + rows * (_ROW + _GAP)
    figures = about.escape_xml(_figures(page))
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="190mm" height="{height:.1f}mm" viewBox="0 0 190 {height:.1f}" '
        'font-family="sans-serif" fill="none">',
        f"<title>{figures}</title>",
        f'<rect width="190" height="{height:.1f}" fill="#fff"/>',
        f'<svg width="190" height="{upper:.1f}">',  # which hides targets far outside
        *_shapes(drawing, page, np.array([left, top]), scale),
        "</svg>",
        f'<text x="{_MARGIN}" y="{upper + 5:.1f}" font-size="3.2" fill="#333">{figures}</text>',
        *_speeds(drawing, page, upper + 12, rows),
        "</svg>\n",
    ]
    return "\n".join(parts).encode("utf-8")


def _figures(page: PlannedPage) -> str:
    """One line of figures."""
    moved = [fit for fit in page.fits if fit.plan.strokes]
    if not moved:
        return f"{len(page.fits)} dots, nothing that moves"
    strokes = sum(fit.plan.strokes for fit in moved)
    text = f"{len(page.fits)} movements, {strokes} strokes; path {np.median([fit.place for fit in moved]):.1f} dB"
    speeds = [fit.speed for fit in moved if fit.speed is not None]
    return text + (f", speed {np.median(speeds):.1f} dB" if speeds else "") + " (medians)"


def _line(xy: Array, colour: str, width: float, more: str = "") -> str:
    points = " ".join(f"{x:.2f},{y:.2f}" for x, y in xy.tolist())
    return f'<polyline points="{points}" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round"{more}/>'


def _shapes(drawing: Drawing, page: PlannedPage, corner: Array, scale: float) -> list[str]:
    out = []
    for stroke in drawing.strokes:
        xy = (stroke.xy - corner) * scale + _MARGIN
        out.append(_line(np.repeat(xy, 2, axis=0), "#bbb", 1.1, ' stroke-linecap="round"'))
    for fit in page.fits:
        if fit.plan.strokes == 0:
            continue
        targets = (fit.plan.targets - corner) * scale + _MARGIN
        out.append(_line(targets, "#e08f62", 0.15, ' stroke-dasharray="0.8 0.8"'))
        out.append(_line((fit.plan.position_at(sample_times(fit.plan)) - corner) * scale + _MARGIN, "#1d4e89", 0.35))
        for number, (x, y) in enumerate(targets.tolist()):
            out.append(f'<circle cx="{x:.2f}" cy="{y:.2f}" r="0.7" stroke="#e06c32" stroke-width="0.25"/>')
            out.append(f'<text x="{x + 0.9:.2f}" y="{y - 0.6:.2f}" font-size="2" fill="#b0521f">{number}</text>')
    return out


def _clock(page: PlannedPage) -> Array:
    """(n + 1,) s: when each movement begins on a clock on which they follow each other, and where it ends."""
    lasts = [fit.plan.end - fit.plan.start + 0.1 for fit in page.fits]
    return np.concatenate([[0.0], np.cumsum(lasts)])


def _speeds(drawing: Drawing, page: PlannedPage, top: float, rows: int) -> list[str]:
    begins = _clock(page)
    plans = [fit.plan for fit in page.fits if fit.plan.strokes]
    most = max([1.0, *(float(np.hypot(*plan.velocity(sample_times(plan)).T).max()) for plan in plans)])
    across, up = (190 - 2 * _MARGIN) / _SECONDS, _ROW / (1.1 * most)
    out = []
    for row in range(rows):
        base = top + row * (_ROW + _GAP) + _ROW
        out.append(_line(np.array([[_MARGIN, base], [190 - _MARGIN, base]]), "#999", 0.2))
        out += [
            f'<text x="{_MARGIN + s * across:.1f}" y="{base + 3:.1f}" font-size="2.4" fill="#666">'
            f"{row * _SECONDS + s:g} s</text>"
            for s in range(int(_SECONDS))
        ]
    out.append(f'<text x="{_MARGIN}" y="{top - 1:.1f}" font-size="2.4" fill="#666">up to {most:.0f} mm/s</text>')

    def curve(t: Array, speed: Array, colour: str, width: float) -> None:
        for row in range(int(t[0] // _SECONDS), int(t[-1] // _SECONDS) + 1):
            inside = (t >= row * _SECONDS - 0.01) & (t <= (row + 1) * _SECONDS + 0.01)
            if inside.sum() > 1:
                x = _MARGIN + (t[inside] - row * _SECONDS) * across
                base = top + row * (_ROW + _GAP) + _ROW
                out.append(_line(np.column_stack([x, base - speed[inside] * up]), colour, width))

    for fit, stroke, begin in zip(page.fits, drawing.strokes, begins.tolist(), strict=False):
        if fit.plan.strokes == 0:
            continue
        t = sample_times(fit.plan)
        if page.timed and stroke.t[-1] - stroke.t[0] >= SHORTEST:
            recording = prepare_recording(stroke.t, stroke.xy)
            curve(recording.t - recording.t[0] + begin, np.abs(recording.velocity), "#aaa", 0.7)
        for number, alone in enumerate(fit.plan.speeds(t)):
            shown = alone > 0.01 * most
            if shown.sum() > 2:
                curve((t - fit.plan.start + begin)[shown], alone[shown], _COLOURS[number % len(_COLOURS)], 0.2)
        curve(t - fit.plan.start + begin, np.hypot(*fit.plan.velocity(t).T), "#1d4e89", 0.35)
    return out
