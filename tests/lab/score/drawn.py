"""Synthetic written pages, drawn stroke by stroke, with all that is to be measured known."""

import numpy as np

X = 30  # pixels, height of a small letter


def page(
    *,
    lines=8,
    words=9,
    letters=5,
    gap=50.0,
    gaps=None,
    slant=0.0,
    slope=0.0,
    bend=0.0,
    pitch=110.0,
    indent=None,
    thickness=4,
    wave=0.0,
    seed=0,
):
    """(h, w) uint8: rows of words made of arches, every third letter with an ascender.

    gap : pixels between words; gaps : (lines, words − 1), instead.
    slope : dy/dx of the lines; bend : pixels that their middle hangs down; indent : (lines,) pixels.
    """
    import cv2

    rng = np.random.default_rng(seed)
    width, high = 2000, round(2 * pitch + lines * pitch)
    grey = np.full((high + 200, width), 255, np.uint8)
    for i in range(lines):
        x = 150.0 + (0 if indent is None else indent[i])
        for w in range(words):
            lift = wave * rng.normal()
            for k in range(letters):
                # joined arches: nothing but word gaps parts the ink
                tall = 2.0 * X if (k + w) % 3 == 0 else X
                stem = np.array([[0, tall], [0, 0], [0.1, 0.75 * X], [11, X], [20, 0.7 * X], [22, 0], [28, 0.2 * X]])
                u = (x + stem[:, 0] - 1000) / 850
                y = 150 + (i + 1) * pitch + slope * (x + stem[:, 0] - 1000) + bend * (1 - u**2) + lift
                dots = np.stack([x + stem[:, 0] + np.tan(slant) * stem[:, 1], y - stem[:, 1]], axis=1)
                cv2.polylines(grey, [np.int32(np.round(dots * 16))], False, 0, thickness, cv2.LINE_AA, 4)
                x += 28
            x += (gap if gaps is None else gaps[i][min(w, words - 2)]) + thickness
    return grey
