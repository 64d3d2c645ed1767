"""Photographs of strokes, made of formulas."""

import numpy as np


def stroke(paint, start, end, width, *, dry=0.0, colour=(30, 30, 40), seed=0):
    """Paint a straight stroke on a picture (h, w, 3), with streaks of paper that lengthen towards its end."""
    rng = np.random.default_rng(seed)
    start, end = np.asarray(start, float), np.asarray(end, float)
    length = float(np.hypot(*(end - start)))
    along = (end - start) / length
    y, x = np.mgrid[: paint.shape[0], : paint.shape[1]]
    u = ((x - start[0]) * along[0] + (y - start[1]) * along[1]) / length
    v = ((y - start[1]) * along[0] - (x - start[0]) * along[1]) / (width / 2)
    lanes = 24
    lane = np.clip(((v + 1) / 2 * lanes).astype(int), 0, lanes - 1)
    stops = np.where(rng.random(lanes) < dry, rng.uniform(0.2, 1.0, lanes), 1.0)
    inked = (np.abs(v) <= 1) & (u >= 0) & (u <= stops[lane])
    shade = rng.integers(-10, 10, lanes)[lane]
    paint[inked] = np.clip(np.asarray(colour) + shade[inked][:, None], 0, 255)
    return paint


def paper(height=400, width=700, *, light=245, uneven=0.0):
    """A sheet whose light falls off to one side."""
    shade = 1 - uneven * np.linspace(0, 1, width)[None, :, None] * np.linspace(0.5, 1, height)[:, None, None]
    return np.broadcast_to(light * shade, (height, width, 3)).astype(np.uint8).copy()
