"""A tag of asemic glyphs: found, joined, styled and placed on a page.

Source: seed 003, §4.2 and fig. 11.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from handout.errors import InputError
from handout.motion.styles import glyphs, ligatures
from handout.motion.styles.restyling import Sequence, broken, drawn, flicked, scaled
from handout.motion.styles.style import Style
from handout.values import Array, Drawing, Page, Stroke

_FEWEST, _MOST = 4, 6  # targets of a glyph
_HEIGHT = 0.7  # of a glyph's own that its style measures by, since glyphs are denser than letters
_GAP = 0.1  # heights between the marks of neighbouring glyphs
_SHARE = 0.6  # of the page's height that a tag of few letters takes at most
_MARGIN = 0.08  # of the page's shorter side
_SWELL = 0.25  # by how much the first and last letter are larger
MOST_LETTERS = 60


def tag(letters: int, style: Style, page: Page, rng: np.random.Generator) -> Drawing:
    """A tag of some glyphs in a style, in the middle of a page.

    Parameters
    ----------
    letters : int, 1 to 60.
    style : Style
        With a ligature's `reach` above 0 the glyphs are joined; otherwise each is a stroke of its own.
    page : Page
    rng : numpy.random.Generator

    Raises
    ------
    InputError
        A number of letters outside 1 to 60.
    """
    if not 1 <= letters <= MOST_LETTERS:
        raise InputError(f"letters: {letters} is outside 1 to {MOST_LETTERS}.")
    forms = _row(letters, _GAP + style.brush.width * _HEIGHT, rng)
    joined = [ligatures.joined(forms, style.ligature.turn)[0]] if style.ligature.reach > 0 else forms
    lean = np.array([[style.form.stretch, 0.0], [-math.tan(style.form.shear), 1.0]])
    parts = [_styled(points @ lean, style) for points in joined]
    about = {"title": f"A tag of {letters}", "style": style.name, "letters": letters}
    return _placed(drawn(parts, style, _HEIGHT, rng), page, about)


def _row(letters: int, gap: float, rng: np.random.Generator) -> list[Array]:
    """Glyphs side by side, 1 high; those at the ends larger."""
    x, found = 0.0, []
    for number in range(letters):
        size = 1 + _SWELL * (letters > 2 and number in (0, letters - 1))
        points = size * glyphs.glyph(int(rng.integers(_FEWEST, _MOST + 1)), rng)
        points[:, 0] += x - points[:, 0].min()
        x = float(points[:, 0].max()) + gap
        found.append(points)
    return found


def _styled(points: Array, style: Style) -> Sequence:
    """The targets of one movement; of a broken script, the corners of straight ways between them."""
    if not style.breaking.directions:
        tips = points[0] - points[1], points[-1] - points[-2]
        return Sequence(flicked(points, tips, style, _HEIGHT), np.zeros(len(points), dtype=bool), word=0)
    share = np.linspace(0.0, 1.0, 12, endpoint=False)[:, None]
    ways = [a + share * (b - a) for a, b in pairwise(points)]
    path = np.concatenate([*ways, points[-1:]])
    corners = np.arange(len(ways)) * 12
    return Sequence(*broken(path, corners[1:], style, _HEIGHT), word=0)


def _placed(strokes: tuple[Stroke, ...], page: Page, about: dict[str, Any]) -> Drawing:
    """The strokes as large as the page allows, in its middle."""
    xy = np.concatenate([stroke.xy for stroke in strokes])
    widest = max(float(stroke.width.max()) if stroke.width is not None else 0.0 for stroke in strokes)
    low, high = xy.min(axis=0) - widest / 2, xy.max(axis=0) + widest / 2
    room = np.array([page.width, page.height]) - 2 * _MARGIN * min(page.width, page.height)
    scale = float(min(*(room / (high - low)), _SHARE * page.height / max(float(high[1] - low[1]), 1e-9)))
    away = 0.5 * np.array([page.width, page.height]) - 0.5 * scale * (low + high)
    return Drawing(scaled(strokes, scale, away), page, about)
