"""Asemic tags: glyphs of no alphabet, joined, styled and placed on a page.

Some targets of a glyph are thrown around a middle; the order in which the pen visits them is the best of all orders:
long ways are good, and so are those down and to the right, as a hand likes to go.

Source: seed 003, §4.2 and fig. 11, where a genetic algorithm looks for that order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise, permutations
from typing import Any

import numpy as np

from handout.errors import InputError
from handout.motion.styles.learned_movement import see_manner, see_strokes, through_targets
from handout.motion.styles.manner import BUILT, manner_distance
from handout.motion.styles.restyling import (
    TargetSequence,
    add_flicks,
    break_targets,
    draw_sequences,
    join_targets,
    scale_strokes,
)
from handout.motion.styles.style import Style
from handout.values import Array, Drawing, Indices, Page, Stroke

_FEWEST, _MOST = 4, 6  # targets of a glyph
_HEIGHT = 0.7  # of a glyph's own that its style measures by, since glyphs are denser than letters
_GAP = 0.1  # heights between the marks of neighbouring glyphs
_SHARE = 0.6  # of the page's height that a tag of few letters takes at most
_MARGIN = 0.08  # of the page's shorter side
_SWELL = 0.25  # by how much the first and last letter are larger
MOST_LETTERS = 60
_DOWN, _RIGHT = 0.5, 0.35  # reward of a way down and to the right, in lengths
_LEAST_WAYS, _WAYS = 6, 1.4  # of a tag that is invented; usual ways in the height of its letters
_TRIES = 4  # tags in a learned style, of which one is taken: of four manners 28 of 32 tags show theirs; of 16, 30
_LEAST_TURN = 0.35  # of an even share of the circle between neighbouring targets


def tag(letters: int, style: Style, page: Page, rng: np.random.Generator, built: Style | None = None) -> Drawing:
    """A tag of some glyphs in a style, in the middle of a page.

    letters : int, 1 to 60.
    style : with a ligature's `reach` above 0 the glyphs are joined; otherwise each is a stroke of its own.
    built : a learned style that invents the targets of the whole tag; None, or one without a structure: targets thrown
        at random.

    Raises InputError: a number of letters outside 1 to 60, or a structure for a style of rules.
    """
    if built is not None and built.model is not None and built.model.structure is not None:
        if style.model is None:
            raise InputError(f"structure: {style.name} moves by rules; a learned structure needs a learned style.")
        tried = list[tuple[Stroke, ...]]()
        for _ in range(_TRIES):
            new = built.model.structure.invent(rng, style.learned.temperature, built.primer, _LEAST_WAYS)
            tried.append(through_targets([new.targets[part] for part in new.parts], style, rng, _WAYS))
        return _place_strokes(_choose_tag(tried, style, built), page, {"title": "A tag", "style": style.name})
    if not 1 <= letters <= MOST_LETTERS:
        raise InputError(f"letters: {letters} is outside 1 to {MOST_LETTERS}.")
    about = {"title": f"A tag of {letters}", "style": style.name, "letters": letters}
    if style.model is not None:
        tried = [through_targets(_throw_letters(letters, style, rng), style, rng, _HEIGHT) for _ in range(_TRIES)]
        return _place_strokes(_choose_tag(tried, style, style), page, about)
    parts = [_target_sequence(points, style) for points in _throw_letters(letters, style, rng)]
    return _place_strokes(draw_sequences(parts, style, _HEIGHT, rng), page, about)


def _throw_letters(letters: int, style: Style, rng: np.random.Generator) -> list[Array]:
    """Targets (m, 2) of glyphs side by side, 1 high, those at the ends larger; joined, if the style joins."""
    reached, forms = 0.0, []
    for number in range(letters):
        size = 1 + _SWELL * (letters > 2 and number in (0, letters - 1))
        form = size * glyph(int(rng.integers(_FEWEST, _MOST + 1)), rng)
        form[:, 0] += reached - form[:, 0].min()
        reached = float(form[:, 0].max()) + (_GAP + style.brush.width * _HEIGHT)
        forms.append(form)
    joined = [join_targets(forms, style.ligature.turn)[0]] if style.ligature.reach > 0 else forms
    lean = np.array([[style.form.stretch, 0.0], [-math.tan(style.form.shear), 1.0]])
    return [points @ lean for points in joined]


def _choose_tag(tried: Sequence[tuple[Stroke, ...]], style: Style, built: Style) -> tuple[Stroke, ...]:
    """Of some tags that which looks most like the examples: moved like the style's, built like that of `built`."""
    if style.primer is None or built.primer is None:
        return tried[0]
    wanted = np.where(BUILT, see_manner(built.primer), see_manner(style.primer))
    return min(tried, key=lambda strokes: manner_distance(see_strokes(strokes), wanted))


def _target_sequence(points: Array, style: Style) -> TargetSequence:
    """The targets of one movement; of a broken script, the corners of straight ways between them."""
    if not style.breaking.directions:
        tips = points[0] - points[1], points[-1] - points[-2]
        return TargetSequence(add_flicks(points, tips, style, _HEIGHT), np.zeros(len(points), dtype=bool), word=0)
    share = np.linspace(0.0, 1.0, 12, endpoint=False)[:, None]
    ways = [a + share * (b - a) for a, b in pairwise(points)]
    path = np.concatenate([*ways, points[-1:]])
    corners = np.arange(len(ways)) * 12
    return TargetSequence(*break_targets(path, corners[1:], style, _HEIGHT), word=0)


def _place_strokes(strokes: tuple[Stroke, ...], page: Page, about: dict[str, Any]) -> Drawing:
    """The strokes as large as the page allows, in its middle."""
    xy = np.concatenate([stroke.xy for stroke in strokes])
    widest = max(float(stroke.width.max()) if stroke.width is not None else 0.0 for stroke in strokes)
    low, high = xy.min(axis=0) - widest / 2, xy.max(axis=0) + widest / 2
    room = np.array([page.width, page.height]) - 2 * _MARGIN * min(page.width, page.height)
    scale = float(min(*(room / (high - low)), _SHARE * page.height / max(float(high[1] - low[1]), 1e-9)))
    away = 0.5 * np.array([page.width, page.height]) - 0.5 * scale * (low + high)
    return Drawing(scale_strokes(strokes, scale, away), page, about)


def glyph(count: int, rng: np.random.Generator) -> Array:
    """Targets (count, 2) of one glyph, in the order of writing, about 1 high, y down, the middle at 0.

    Raises ValueError: fewer than 2 or more than 9 targets.
    """
    if not 2 <= count <= 9:
        raise ValueError(f"{count} targets are outside 2 to 9")
    places = scatter_targets(count, rng)
    return places[best_order(places)]


def scatter_targets(count: int, rng: np.random.Generator) -> Array:
    """Targets (count, 2) in polar coordinates around 0: angles apart from each other, radii as they come."""
    share = 2 * np.pi / count
    angle = share * (np.arange(count) + (1 - _LEAST_TURN) * rng.uniform(-0.5, 0.5, count)) + rng.uniform(0, 2 * np.pi)
    radius = 0.5 * np.sqrt(rng.uniform(0.25, 1.0, count))
    places: Array = radius[:, None] * np.column_stack([0.75 * np.cos(angle), np.sin(angle)])
    return places


def fitness(orders: Indices, places: Array) -> Array:
    """(k,) of orders (k, m): lengths of the ways between successive targets, and rewards of their directions."""
    way = np.diff(places[orders], axis=1)
    length = np.linalg.norm(way, axis=2)
    return np.asarray((length + _DOWN * np.maximum(way[..., 1], 0) + _RIGHT * np.maximum(way[..., 0], 0)).sum(axis=1))


def best_order(places: Array) -> Indices:
    """(m,) the order of greatest fitness: all are tried, 720 of six targets."""
    orders = np.array(list(permutations(range(len(places)))))
    return np.asarray(orders[fitness(orders, places).argmax()])
