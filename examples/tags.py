"""One tag of five letters that mean nothing, in every handstyle: docs/pictures/tags.png.

python examples/tags.py tags.png
"""

import sys
from dataclasses import replace

import numpy as np

import handout
from handout.motion.styles.asemic import tag
from handout.motion.styles.style import find
from handout.values import Drawing, Page

STYLES = ("fast-tag", "calm", "blackletter", "chancery", "scrawl", "fast-tag")
WIDTH, HEIGHT = 80.0, 36.0  # mm, of each


def sheet():
    """The tags, two in a row."""
    strokes, clock = [], 0.0
    for number, name in enumerate(STYLES):
        made = tag(5, find(name), Page(WIDTH, HEIGHT), np.random.default_rng([3, number]))
        corner = np.array([WIDTH * (number % 2), HEIGHT * (number // 2)])
        strokes += [replace(s, t=s.t + clock, xy=s.xy + corner) for s in made.strokes]
        clock += made.duration + 0.5
    return Drawing(tuple(strokes), Page(2 * WIDTH, HEIGHT * 3))


if __name__ == "__main__":
    handout.write_drawings([sheet()], sys.argv[1:] or ["tags.svg"], handout.Look(dpi=130))
