"""Drawings to write out: joined loops at the speeds of handwriting, and a strategy for any drawing at all."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from handout.values import Array, Drawing, Page, Stroke

CARD = Page(90, 40, "card")


def word(t: Array, x: float, y: float) -> Array:
    """(n, 2) mm: where a pen that writes loops, three a second, is at the times `t`."""
    phase = 2 * np.pi * 3 * t
    tall = 1.4 + 0.6 * np.sin(phase / 5)
    down = -tall * (1 - np.cos(phase))
    return np.stack([x + 6.6 * t + 0.9 * np.sin(phase + 0.6) - 0.3 * down, y + down], axis=1)


def loops(words: int = 3, rate: float = 200.0, pressure: bool = False) -> Drawing:
    """Words of four loops, each followed by a dot (one sample) and a bar."""
    strokes: list[Stroke] = []
    clock = 0.0
    for n in range(words):
        x, y = 8 + 25 * (n % 3), 14 + 12 * (n // 3)
        t = np.arange(0.0, 4 / 3, 1 / rate)
        press = 0.5 + 0.3 * np.sin(2 * np.pi * 3 * t) if pressure else None
        strokes.append(Stroke(clock + t, word(t, x, y), pressure=press, word=n))
        strokes.append(Stroke(np.array([clock + 1.5]), np.array([[x + 4.0, y - 5.5]]), word=n))
        bar = np.linspace(0.0, 0.1, 6)
        strokes.append(Stroke(clock + 1.7 + bar, np.stack([x + 6 + 25 * bar, y - 4 + bar], axis=1), word=n))
        clock += 2.1
    about = {"seed": 7, "hand": "house-joined", "text": "Dear Ada,\n…", "version": "0.1.0"}
    return Drawing(tuple(strokes), CARD, about)


_coordinate = st.floats(-500, 500, allow_nan=False).map(lambda v: v + 0.0)
_channels = ("pressure", "tilt", "azimuth", "rotation", "width")
_json = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@st.composite
def strokes(draw: st.DrawFn) -> Stroke:
    n = draw(st.integers(1, 6))
    steps = draw(st.lists(st.floats(1e-4, 2.0), min_size=n, max_size=n))
    xy = draw(st.lists(st.tuples(_coordinate, _coordinate), min_size=n, max_size=n))
    has = draw(st.sets(st.sampled_from(_channels)))
    channels = {c: np.array(draw(st.lists(st.floats(0, 1.5), min_size=n, max_size=n))) for c in _channels if c in has}
    layer, colour = draw(st.sampled_from(["", "red & <thin>", "tinte"])), draw(st.sampled_from(["", "#c01020"]))
    word, nib = draw(st.integers(-1, 40)), draw(st.sampled_from([0.0, 0.7, 2.0])) if "rotation" in has else 0.0
    return Stroke(np.cumsum(steps), np.array(xy), word=word, layer=layer, colour=colour, nib=nib, **channels)


drawings = st.builds(
    Drawing,
    st.lists(strokes(), max_size=4).map(tuple),
    st.builds(Page, st.floats(1, 2000), st.floats(1, 2000), st.text(max_size=5)),
    st.dictionaries(st.text(), _json, max_size=4),
)


def same(a: Drawing, b: Drawing, tolerance: float = 0.0) -> bool:
    """Whether two drawings have the same strokes, page and about, numbers within `tolerance`."""
    return (
        a.page == b.page
        and dict(a.about) == dict(b.about)
        and len(a.strokes) == len(b.strokes)
        and all(_alike(s, t, tolerance) for s, t in zip(a.strokes, b.strokes, strict=True))
    )


def _alike(a: Stroke, b: Stroke, tolerance: float) -> bool:
    for name in ("t", "xy", *_channels):
        one, other = getattr(a, name), getattr(b, name)
        if (one is None) != (other is None):
            return False
        if one is not None and (one.shape != other.shape or np.abs(one - other).max() > tolerance):
            return False
    return (a.word, a.layer, a.colour) == (b.word, b.layer, b.colour) and abs(a.nib - b.nib) <= tolerance
