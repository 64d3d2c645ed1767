"""Four drawings of unlike manners, a little different for each seed."""

import numpy as np

from handout.values import Drawing, Page, Stroke

KINDS = ("loops", "zigzag", "arches", "dashes")
_TURNS = 12


def draw_example(kind, seed=1, rows=2):
    """Rows of one manner, 12 mm high, written at 60 mm/s."""
    rng, strokes, clock = np.random.default_rng(seed), [], 0.0
    for row in range(rows):
        for xy in _lines(kind, rng):
            length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))])
            strokes.append(Stroke(clock + length / 60, xy + np.array([10.0, 18.0 + 22.0 * row])))
            clock = float(strokes[-1].t[-1]) + 0.2
    return Drawing(tuple(strokes), Page(160.0, 22.0 + 22.0 * rows))


def _lines(kind, rng):
    turns = np.arange(_TURNS + 1)
    t = np.linspace(0, _TURNS, 60 * _TURNS)
    size = 1 + 0.12 * np.interp(t, turns, rng.standard_normal(_TURNS + 1))
    phase = np.cumsum(1 + 0.12 * np.interp(t, turns, rng.standard_normal(_TURNS + 1))) * (t[1] - t[0])
    if kind == "loops":
        x, y = 9 * phase + 4.6 * size * np.sin(2 * np.pi * phase + 0.5), -6 * size * np.cos(2 * np.pi * phase)
        return [np.column_stack([x, y])]
    if kind == "arches":
        return [np.column_stack([9 * phase, 6 - 12 * size * np.sqrt(1 - (2 * (phase % 1) - 1) ** 2)])]
    if kind == "zigzag":
        corners = np.arange(2 * _TURNS + 1)
        x = np.cumsum(4.5 * (1 + 0.15 * rng.standard_normal(len(corners))))
        y = 6 * np.where(corners % 2, -1, 1) * (1 + 0.12 * rng.standard_normal(len(corners)))
        at = np.linspace(0, corners[-1], 30 * corners[-1])
        return [np.column_stack([np.interp(at, corners, x), np.interp(at, corners, y)])]
    lines, s = [], np.linspace(0, 1, 30)[:, None]
    for k in range(_TURNS):
        high, x = 6 * (1 + 0.15 * rng.standard_normal()), 9.5 * k + 0.4 * rng.standard_normal()
        lines.append(np.array([x + 3, -high]) * (1 - s) + np.array([x - 2, high]) * s)
        if k % 2:
            lines.append(np.array([x - 1.5, 1 + 0.5 * rng.standard_normal()]) * (1 - s) + np.array([x + 5, -0.5]) * s)
    return lines
