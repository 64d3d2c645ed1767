"""A single-line font as the recording of somebody who writes it: every letter several times, and what each is."""

from __future__ import annotations

import numpy as np

from handout.motion.trace import trace, written
from handout.page_sizes import page
from handout.tagging.recording import Recording
from handout.values import Hand
from handout.writing.compose import compose
from handout.writing.layout import Layout

_TEXT = """\
the quick brown fox jumps over the lazy dog sphinx of black quartz judge my vow
pack my box with five dozen liquor jugs how vexingly quick daft zebras jump
amazingly few discotheques provide jukeboxes we promptly judged antique ivory buckles"""
_EACH = 3  # times that every other character is written
_SEED = 0


def specimen(name: str, font: Hand) -> list[Recording]:
    """Pages in a font, as recordings whose letters are known.

    Parameters
    ----------
    name : of its file, for messages.
    font : as `hand.svg_font.read` gives it.
    """
    words = ["".join(letter for letter in word if letter in font.glyphs) for word in _TEXT.split()]
    others = [letter for letter in font.glyphs if letter not in set("".join(words))]
    text = " ".join([word for word in words if word] + _EACH * others)
    rng, pages = np.random.default_rng(_SEED), list[Recording]()
    layout = Layout(page("A4"), x_height=font.x_height)
    for sheet in compose(text, font, layout, rng):
        drawing = trace(sheet, font, rng, jitter=0.0)
        known = written(sheet, font)
        pages.append(Recording(name, drawing, text, known, len(sheet.lines), layout.x_height))
    return pages
