"""Pages whose writer is known: a built-in hand, a font, a font whose letters are shaken."""

from functools import cache

import numpy as np

WORDS = (
    "the morning was grey and the sea lay flat as slate while we walked along the wall with our collars up past boats "
    "that nobody had taken out since the storm and talked about the summer or the old house above the bay she said"
)


@cache
def house(name="house-joined", seed=1, times=1):
    """(h, w) uint8 at 300 dpi: some lines of a built-in hand, plain ink."""
    from handout.hand.library import load
    from handout.inking.plain import flatten, ink
    from handout.motion.trace import trace
    from handout.page_sizes import page
    from handout.writing.compose import compose
    from handout.writing.layout import Layout

    rng = np.random.default_rng(seed)
    hand = load(name)
    sheet, *_ = compose(" ".join([WORDS] * times), hand, Layout(page("A5"), x_height=2.4), rng)
    grey = flatten(ink(trace(sheet, hand, rng), 300)).mean(axis=2).astype(np.uint8)
    return grey[: np.flatnonzero((grey < 128).any(axis=1))[-1] + 100]


@cache
def font(jitter=0.0, seed=0):
    """(h, w) uint8: a Hershey font, each letter moved, turned and scaled a little at random."""
    import cv2

    rng = np.random.default_rng(seed)
    grey = np.full((1500, 1750), 255, np.uint8)
    x, y = 120.0, 180.0
    for word in WORDS.split():
        if x + 46 * len(word) > 1640:
            x, y = 120.0, y + 130.0
        for letter in word:
            size = 1.9 * (1 + jitter * rng.normal())
            at = (round(x), round(y + 20 * jitter * rng.normal()))
            cv2.putText(grey, letter, at, cv2.FONT_HERSHEY_SCRIPT_SIMPLEX, size, 20, 4, cv2.LINE_AA)
            (wide, _), _ = cv2.getTextSize(letter, cv2.FONT_HERSHEY_SCRIPT_SIMPLEX, size, 4)
            x += wide + 8 + 8 * jitter * rng.normal()
        x += 40
    return grey
