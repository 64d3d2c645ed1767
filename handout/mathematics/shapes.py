"""What of a formula is drawn as large as it has to be: rules, roots, brackets, sums, integrals, accents.

Places are in x-heights, y up.  Strokes are points on the curve, evenly spaced in time, as those of drawn letters are:
whoever moves the pen passes through them.  All proportions are drawn by eye.
"""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from handout.values import Array


@dataclass(frozen=True, eq=False)
class Wander:
    """By which a formula varies; scale : 1 as people do, 0 not at all."""

    rng: np.random.Generator
    scale: float

    def draw(self, deviation: float, shape: tuple[int, ...] = ()) -> Array:
        """Values about 0 of a standard deviation; () float or of a shape."""
        return np.asarray(self.scale * deviation * self.rng.standard_normal(shape))


_STEP = 0.8  # x-heights from one point of a straight way to the next
_WOBBLE = 0.022  # x-heights, standard deviation of points from where they were drawn
_TILT = 0.012  # tangent, standard deviation, of a rule

_MIRRORED = {")": "(", "]": "[", "}": "{", "⟩": "⟨", "⌉": "⌈", "⌋": "⌊"}
_UPSIDE_DOWN = {"⋂": "⋃", "∐": "∏"}
_LIKE = {**_MIRRORED, **_UPSIDE_DOWN, "∮": "∫"}
_GROWTH = 0.25  # a bracket twice as high is so many times (as a power of two) as wide


@cache
def _stretched() -> dict[str, dict[str, Any]]:
    """The strokes of signs that are stretched over their height, and the width of one that is 3 high."""
    return tomllib.loads(Path(__file__).with_name("stretched.toml").read_text(encoding="utf-8"))


def draw_sign(sign: str, bottom: float, top: float, size: float, wander: Wander) -> list[Array]:
    """The strokes of a bracket or a large sign between two heights, its left end at x = 0.

    size : of what stands beside it, which it is as wide for.
    """
    drawn = _stretched()[_LIKE.get(sign, sign)]
    height = top - bottom
    width = drawn["width"] * size * (height / (3.0 * size)) ** (1.0 if sign in "∑∏∐⋃⋂" else _GROWTH)
    strokes = []
    for points in drawn["strokes"]:
        unit = np.array(points)
        if sign in _MIRRORED:
            unit[:, 0] = 1 - unit[:, 0]
        if sign in _UPSIDE_DOWN:
            unit[:, 1] = 1 - unit[:, 1]
        strokes.append(_varied(unit * (width, height) + (0.0, bottom), size, wander))
    if sign == "∮":
        at = np.linspace(0.3, 2 * np.pi + 0.5, 9)
        ring = np.column_stack([np.cos(at) * 0.34, np.sin(at) * 0.3]) * size
        strokes.append(_varied(ring + np.array([0.5 * width, bottom + 0.5 * height]), size, wander))
    return strokes


def draw_rule(left: float, right: float, y: float, wander: Wander) -> Array:
    """A rule as people draw one: not quite level, not quite straight."""
    x = np.linspace(left, right, max(3, round((right - left) / _STEP) + 1))
    middle = (x - x.mean()) / max(0.5 * float(np.ptp(x)), 1e-6)
    bow = wander.draw(0.03) * (1 - middle**2)
    return np.column_stack([x, y + wander.draw(_TILT) * (x - x.mean()) + bow])


def draw_root(body_right: float, bottom: float, top: float, size: float, wander: Wander) -> Array:
    """The sign of a root in one stroke: a tick, down, up, and along over what stands from x = 0 to `body_right`."""
    height = top - bottom
    foot, begin = -0.32 * size, -0.78 * size
    corners = np.array(
        [
            (begin, bottom + min(0.42 * height, 0.95 * size)),
            (begin + 0.16 * size, bottom + min(0.48 * height, 1.1 * size)),
            (foot, bottom),
            (-0.08 * size, top),
            (body_right + 0.35 * size, top + wander.draw(0.03)),
        ]
    )
    return _varied(_evenly(corners), size, wander)


def draw_accent(kind: str, box: Sequence[float], size: float, wander: Wander) -> list[Array]:
    """The strokes of an accent on a body; box : its left, bottom, right and top."""
    left, bottom, right, top = box
    middle, y = 0.5 * (left + right), top + 0.24 * size
    half = 0.5 * max(right - left, 0.7 * size)
    x = np.array([middle - half, middle + half])
    match kind:
        case "hat":
            corners = [(x[0], y), (middle, y + 0.34 * size), (x[1], y)]
        case "tilde":
            corners = [
                (x[0], y),
                (middle - 0.45 * half, y + 0.2 * size),
                (middle + 0.45 * half, y),
                (x[1], y + 0.2 * size),
            ]
        case "vec":
            y += 0.1 * size
            head = 0.22 * size
            shaft = draw_rule(x[0], x[1] + 0.08 * size, y, wander)
            tip = shaft[-1]
            barbs = [tip + np.array([-1.3 * head, head]), tip, tip + np.array([-1.1 * head, -0.8 * head])]
            return [shaft, _varied(np.array(barbs), size, wander)]
        case "dot" | "ddot":
            sides = (0.0,) if kind == "dot" else (-0.24, 0.24)
            spots = [np.array([middle + side * size, y + 0.08 * size]) for side in sides]
            return [_varied(np.array([spot, spot + np.array([0.03, -0.03])]), 0.3 * size, wander) for spot in spots]
        case "under":
            return [draw_rule(x[0], x[1], bottom - 0.22 * size, wander)]
        case "box":
            pad = 0.35 * size
            a, b, c, d = left - pad, bottom - pad, right + pad, top + pad
            return [_varied(_evenly(np.array([(a, d), (a, b), (c, b), (c, d), (a - 0.05, d)])), size, wander)]
        case "cancel":
            return [_varied(_evenly(np.array([(left - 0.1, bottom - 0.15), (right + 0.15, top + 0.1)])), size, wander)]
        case "overbrace" | "underbrace":
            (brace,) = draw_sign("{", -x[1], -x[0], size, wander)
            flat = np.column_stack([-brace[:, 1], -brace[:, 0]])[::-1]
            if kind == "overbrace":
                return [flat * (1, -1) + (0.0, top + 0.12 * size)]
            return [flat + np.array([0.0, bottom - 0.12 * size])]
        case _:
            return [draw_rule(x[0], x[1], y, wander)]
    return [_varied(np.array(corners), size, wander)]


def _evenly(corners: Array) -> Array:
    """Corners with points between them, so that straight ways stay straight."""
    ways = [corners[:1]]
    for a, b in itertools.pairwise(corners):
        count = max(1, round(float(np.hypot(*(b - a))) / _STEP))
        ways.append(a + (b - a) * np.linspace(0, 1, count + 1)[1:, None])
    return np.vstack(ways)


def _varied(points: Array, size: float, wander: Wander) -> Array:
    return np.asarray(points + wander.draw(_WOBBLE * size, points.shape))
