"""Drawings that move as handwriting does, made of sines: loops, words, pen lifts, ten strokes a second."""

from __future__ import annotations

import numpy as np

from handout.values import Array, Drawing, Page, Stroke

A5 = Page(148, 210, "A5")


def word(rng: np.random.Generator, loops: int, x_height: float = 3.0, rate: float = 200.0) -> tuple[Array, Array]:
    """Time (n,) s and path (n, 2) mm of one joined-up word of `loops` loops, from rest to rest, baseline at y = 0.

    Five loops a second are ten strokes a second, up and down; some loops are as tall as an l, some as deep as a g.
    """
    frequency = 5.0
    t = np.arange(0.0, loops / frequency, 1 / rate)
    t = np.append(t, loops / frequency)
    phase = 2 * np.pi * frequency * t
    heights = rng.choice([1.0, 1.0, 1.0, 0.7, 1.9], loops + 2) * rng.uniform(0.85, 1.15, loops + 2)
    widths = rng.uniform(0.25, 0.5, loops + 2)
    at = np.arange(loops + 2) / frequency
    height, width = np.interp(t, at, heights), np.interp(t, at, widths)
    y = -0.5 * x_height * height * (1 - np.cos(phase))
    x = 0.7 * x_height * frequency * t - x_height * width * np.sin(phase)
    rest = np.clip(np.minimum(t, t[-1] - t) / 0.05, 0, 1)
    slow = np.concatenate([[0.0], np.cumsum(np.diff(t) / np.maximum(0.15, (rest[1:] + rest[:-1]) / 2))])
    even = np.arange(0.0, slow[-1], 1 / rate)
    return even, np.stack([np.interp(even, slow, x - 0.25 * y), np.interp(even, slow, y)], axis=1)


def page(seed: int = 1, words: int = 12, x_height: float = 3.0, size: Page = A5, margin: float = 15.0) -> Drawing:
    """A page of words with a dot or a bar after every third, line after line from the top left."""
    rng = np.random.default_rng(seed)
    clock, x, y = 0.0, margin, margin + 2 * x_height
    strokes: list[Stroke] = []
    for index in range(words):
        t, xy = word(rng, int(rng.integers(3, 9)), x_height)
        if x + np.ptp(xy[:, 0]) > size.width - margin:
            x, y = margin, y + 4 * x_height
        shift = np.array([x - xy[:, 0].min(), y])
        strokes.append(Stroke(clock + t, xy + shift, word=index))
        clock += t[-1] + 0.25
        if index % 3 == 1:
            strokes.append(Stroke([clock, clock + 0.03], [[x + 4, y - 1.7 * x_height]] * 2, word=index))
            clock += 0.28
        elif index % 3 == 2:
            bar = np.linspace(0, 1, 25)[:, None] ** 1
            ease = (1 - np.cos(np.pi * bar)) / 2
            strokes.append(Stroke(clock + 0.12 * bar[:, 0], np.array([x, y - 4]) + ease * [4.0, -0.3], word=index))
            clock += 0.37
        x += np.ptp(xy[:, 0]) + x_height
    return Drawing(tuple(strokes), size, {"title": "loops", "seed": seed, "hand": "none"})
