"""A drawing in another handstyle: targets are found from its lines and moved through anew.

Source: seed 003, §4.1 (stylisations of an input trace).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.motion.guides import Guide
from handout.motion.styles import breaking, brush, ligatures, targets
from handout.motion.styles.movement import around, move, vector
from handout.motion.styles.style import Style
from handout.values import Array, Drawing, Stroke

_LIFT = 1.2  # intervals from the end of one stroke to the start of the next, and as many more for each
_AIR = 0.6  # root of its distance in heights
_FLICKED = 0.3  # of the distance of its ends that a stroke is lengthened by at most
_EDGE = 1.0  # strength of the guide along the strokes of a broken path


@dataclass(frozen=True, eq=False)
class Sequence:
    """Targets of one movement.

    points : (m, 2) float, mm.
    corner : (m,) bool: at which of them the letter has a corner.
    ring : whether the first follows the last.
    word, layer, colour : as in `Stroke`.
    """

    points: Array
    corner: NDArray[np.bool_]
    ring: bool = False
    word: int = -1
    layer: str = ""
    colour: str = ""


def restyle(drawing: Drawing, style: Style, rng: np.random.Generator, height: float | None = None) -> Drawing:
    """The drawing, its strokes in a handstyle, with the times of the new movements.

    Parameters
    ----------
    drawing : Drawing
    style : Style
    rng : numpy.random.Generator
    height : mm of a letter, by which the style's lengths are measured; default: as `targets.letter_height` finds it.

    Raises
    ------
    InputError
        No strokes.
    """
    if not drawing.strokes:
        raise InputError("There is no stroke to restyle.")
    tall = targets.letter_height(drawing) if height is None else height
    sequences = [_sequence(stroke, style, tall) for stroke in drawing.strokes]
    made = drawn(_joined(sequences, style, tall), style, tall, rng)
    return replace(drawing, strokes=made, about={**drawing.about, "style": style.name}, ink=None, inked=None)


def drawn(
    sequences: Iterator[Sequence] | list[Sequence], style: Style, height: float, rng: np.random.Generator
) -> tuple[Stroke, ...]:
    """Timed strokes of target sequences in a style."""
    clock, before, strokes = 0.0, None, []
    for one in sequences:
        if before is not None:
            way = float(np.linalg.norm(one.points[0] - before)) / height
            clock += style.movement.interval * (_LIFT + _AIR * math.sqrt(way))
        guide = _along(one.points) if style.breaking.directions and len(one.points) > 1 else None
        motion = around if one.ring else move
        t, xy = motion(one.points, one.corner, style, height, rng, guide)
        width = brush.widths(t, xy, style, height, tapered=not one.ring)
        nib = style.brush.kind == "nib"
        strokes.append(
            Stroke(
                clock + t,
                xy,
                width=width,
                rotation=np.full(len(t), -style.brush.angle) if nib else None,
                nib=style.brush.width * height if nib else 0.0,
                word=one.word,
                layer=one.layer,
                colour=one.colour,
            )
        )
        clock += float(t[-1])
        before = xy[-1]
    return tuple(strokes)


def _sequence(stroke: Stroke, style: Style, height: float) -> Sequence:
    """A stroke's targets in the form that the style gives it."""
    shape = np.array([[style.form.stretch, -math.tan(style.form.shear)], [0.0, 1.0]])
    motif = targets.find(stroke.xy, height)
    about = {"word": stroke.word, "layer": stroke.layer, "colour": stroke.colour}
    # stretched and sheared about its own place on its line, so that a page stays as it is laid out
    if len(motif.points) == 1:
        return Sequence(motif.points, motif.corner, **about)
    if style.breaking.directions:
        return Sequence(*_broken(motif, shape, style, height), **about)
    points = _flicked(motif, style.flick.entry * height, style.flick.exit * height)
    return Sequence(points @ shape.T, motif.corner, motif.ring, **about)


def _flicked(motif: targets.Motif, entry: float, leaving: float) -> Array:
    """The targets, the first and the last moved outwards along the path's direction there, except on rings."""
    points = motif.points.copy()
    if not motif.ring and len(motif.path) > 6:
        for at, inner, reach in ((0, 5, entry), (-1, -6, leaving)):
            way = motif.path[at] - motif.path[inner]
            reach = min(reach, _FLICKED * float(np.linalg.norm(points[-1] - points[0])))
            points[at] += reach * way / (float(np.linalg.norm(way)) or 1.0)
    return points


def _broken(motif: targets.Motif, shape: Array, style: Style, height: float) -> tuple[Array, NDArray[np.bool_]]:
    rule = style.breaking
    directions = np.array([vector(angle) for angle in rule.directions])
    path, bends = motif.path, motif.bends
    if motif.ring:  # begun at the top, where the scripts have a corner
        top = int(path[:, 1].argmin())
        path = np.concatenate([path[top:-1], path[: top + 1]])
        bends = np.sort((bends - top) % (len(path) - 1))
    corners = breaking.broken(path @ shape.T, bends, directions, rule.least * height)
    if rule.foot > 0 and not motif.ring:
        corners = breaking.footed(corners, rule.foot * height, vector(rule.step))
    return corners, np.ones(len(corners), dtype=bool)


def _along(points: Array) -> Guide:
    """A guide along the straight ways from each target to the next."""
    step = np.diff(points, axis=0)
    size = np.linalg.norm(step, axis=1, keepdims=True)
    direction = np.where(size > 0, step / np.maximum(size, 1e-300), [1.0, 0.0])
    return Guide(np.concatenate([direction, direction[-1:]]), _EDGE)


def _joined(sequences: list[Sequence], style: Style, height: float) -> Iterator[Sequence]:
    """Neighbours near each other as one sequence, where the style joins."""
    current: Sequence | None = None
    for one in sequences:
        if current is not None and _joins(current, one, style.ligature.reach * height):
            current, one = _opened(current), _opened(one)
            points, kept = ligatures.joined(current.points, one.points, style.ligature.turn)
            corner = np.concatenate([current.corner, one.corner])[kept]
            current = replace(current, points=points, corner=corner)
            continue
        if current is not None:
            yield current
        current = one
    if current is not None:
        yield current


def _opened(one: Sequence) -> Sequence:
    """A ring as a sequence that ends with the target it begins with."""
    if not one.ring:
        return one
    points, corner = np.concatenate([one.points, one.points[:1]]), np.concatenate([one.corner, one.corner[:1]])
    return replace(one, points=points, corner=corner, ring=False)


def _joins(a: Sequence, b: Sequence, reach: float) -> bool:
    if (a.word, a.layer, a.colour) != (b.word, b.layer, b.colour) or min(len(a.points), len(b.points)) < 2:
        return False
    return float(np.linalg.norm(b.points[0] - a.points[-1])) <= reach
