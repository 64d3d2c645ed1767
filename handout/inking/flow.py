"""Cuts strokes into short straight pieces and computes the width and the amount of ink that a pen leaves on each.

All lengths are mm.  Noise is drawn per piece, and the length of a piece does not depend on the resolution, so that a
page has the same gaps and blobs at every resolution.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.inking import curves, footprints
from handout.libraries import ndimage
from handout.values import NIB_THICKNESS, Array, Drawing, Stroke

_Floats = NDArray[np.floating[Any]]

STEP = 0.1  # mm of a piece
LANES = 16  # across a line, each with its own flow
PACE = 20.0  # mm/s: calm writing
PRESSURE = 0.55  # usual, of 0 to 1
_FINER = 2  # points per sample at which lengths are measured
_REPEAT = 8192  # pieces after which the streaks of a line repeat: most of a metre
_SPECK = 0.05  # mm; a shorter stroke is a dot
_DOT = 4.0  # times the ink of a line, at most
_THINNEST = 0.02  # mm
_DOT_REACH, _DOT_INK = 0.16, 3.0  # mm along the line; ink for what the dot adds to the width
_UNLIKE, _MARKED = 0.5, 0.8  # spread of the sizes of dots, log; share of the landings that leave one
_AT_REST = 0.015  # s in the last piece of a stroke that ends slowly
_STAYING, _SLOWING = 0.5, 2.5  # least pressure at the end of a stroke that stops, and over how much of it, mm
_RARE = 3.6  # deviations of the flow from its mean at which a slow line would skip


@dataclass(frozen=True)
class Flow:
    """How a pen's line follows the hand; shares are of the usual width or amount.

    width_pressure, width_speed : how much wider at full pressure than at none, and at rest than at high speed.
    load_pressure : exponent of the pressure in the amount; load_speed : as width_speed, of the amount.
    pool, bleed : added to the amount and to the width where the pen rests.
    patience : s; time constant with which a resting pen gives that ink.
    nib, slope : how much thinner a line along the nib's edge is, and the edge's direction, rad.
    drift, patch : standard deviation of the amount along the line, over millimetres and over tenths of them.
    streak : standard deviation of the amount from lane to lane across the line, over millimetres.
    ragged : standard deviation of each edge, mm.
    goop : blobs for each sharp turn.
    touch : added to the width by a usual dot, where the tip lands and where it stops; three times that to the amount.
    stays : share of the strokes that come to rest before the pen is lifted; the others are flicked off.
    skip : how much of the ink is missing where a fast pen runs dry for a moment.
    level : standard deviation of the amount over words.
    """

    width_pressure: float = 0.0
    width_speed: float = 0.0
    load_pressure: float = 0.0
    load_speed: float = 0.0
    pool: float = 0.0
    bleed: float = 0.0
    patience: float = 0.15
    nib: float = 0.0
    slope: float = -0.7
    drift: float = 0.0
    patch: float = 0.0
    streak: float = 0.0
    ragged: float = 0.0
    goop: float = 0.0
    touch: float = 0.0
    stays: float = 0.0
    skip: float = 0.0
    level: float = 0.0


@dataclass(frozen=True, eq=False)
class Pieces:
    """Straight pieces of line.

    a, b : (m,) complex, mm: both ends, x + i y.
    radius : (m,) mm, half the width.
    load : (m,) ink, 1 for one usual pass.
    lanes : (m, LANES) float32: share of the load from the left edge to the right.
    nib : (m,) complex, mm: half the edge of a flat nib, from its middle; 0 for a round point.
    """

    a: NDArray[np.complex128]
    b: NDArray[np.complex128]
    radius: Array
    load: Array
    lanes: NDArray[np.float32]
    nib: NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class _FlowWay:
    """The middle of all strokes' pieces: places, and how the hand moves there.  All (m,)."""

    a: NDArray[np.complex128]
    b: NDArray[np.complex128]
    speed: Array
    dwell: Array
    pressure: Array
    length: Array  # mm, of the whole stroke
    width: Array  # mm, of the stroke itself; NaN where it has none
    nib: NDArray[np.complex128]  # mm, half the edge of a flat nib
    since: Array  # mm, from where the stroke began
    left: Array  # mm, to where it ends
    edge: Array  # rad: how the nib's edge lies, NaN where that is not known


def lean(speed: Array) -> Array:
    """1 at rest, 0 at `PACE`, −1 at any higher speed in the end."""
    return np.asarray((PACE - speed) / (PACE + speed))


def pieces(drawing: Drawing, width: float, flow: Flow, rng: np.random.Generator) -> Pieces:
    """All pieces of a drawing that has strokes, as a pen of a nominal width (mm) leaves them."""
    fitted = curves.fit(drawing.strokes)
    ways = [_way(stroke, curve) for stroke, curve in zip(drawing.strokes, fitted, strict=True)]
    way = _FlowWay(*(np.concatenate(channel) for channel in zip(*ways, strict=True)))
    rest = 1 - np.exp(-way.dwell / flow.patience)
    press = np.clip(way.pressure, 0.0, 1.0)
    dots, staying, ample = _resting(way, flow, [len(channels[0]) for channels in ways], rng.spawn(1)[0])
    press = np.where(staying, np.maximum(press, _STAYING), press)
    slow = lean(way.speed)
    wide = 1 + flow.width_pressure * (press - PRESSURE) + flow.width_speed * slow + flow.bleed * rest + dots
    # a nib with an edge leaves a thinner line along that edge
    slope = np.where(np.isnan(way.edge), flow.slope, way.edge)
    turned = np.abs(np.sin(np.angle(way.b - way.a) - slope))
    wide = np.where(np.isnan(way.width), width * wide * (1 - flow.nib * (1 - turned)), way.width)
    load = (np.maximum(press, 0.02) / PRESSURE) ** flow.load_pressure * (1 + flow.load_speed * slow)
    # a pen about to leave the paper rests on it so lightly that nothing gathers
    load += flow.pool * rest * np.minimum(press / PRESSURE, 1.0)
    load = (load + _DOT_INK * dots) * ample
    # a dot is pressed on, not passed over
    load = load * np.clip(width / way.length, 1.0, _DOT)
    return _add_noise(way, np.maximum(wide, _THINNEST) / 2, load, flow, rng)


def _resting(
    way: _FlowWay, flow: Flow, sizes: list[int], rng: np.random.Generator
) -> tuple[Array, NDArray[np.bool_], Array]:
    """(m,) each: what dots at the ends of strokes add to the width, which pieces end at rest, factors of the amount.

    Ink flows on while the tip rests: it leaves a dot where the tip landed and where it stopped before it was lifted.
    Where the tip moves fast the ink may come too late, and the line skips.
    """
    m = len(way.speed)
    if not (flow.touch or flow.skip or flow.level):
        return np.zeros(m), np.zeros(m, dtype=bool), np.ones(m)
    ends = np.cumsum(sizes) - 1
    size = np.exp(rng.normal(0.0, _UNLIKE, (2, len(sizes)))) * (rng.random((2, len(sizes))) < [[_MARKED], [1.0]])
    stays = (rng.random(len(sizes)) < flow.stays) & (way.dwell[ends] > _AT_REST)
    landed, stayed = np.repeat(size[0], sizes), np.repeat(size[1] * stays, sizes)
    dots = landed * np.exp(-((way.since / _DOT_REACH) ** 2)) + stayed * np.exp(-((way.left / _DOT_REACH) ** 2))
    fast = np.clip((way.speed - 0.8 * PACE) / PACE, 0.0, 1.0)
    dry = 1 / (1 + np.exp(np.clip((_RARE - 1.6 * fast - _smooth_noise(rng, m, 0.22)) / 0.12, -30, 30)))
    ample = np.exp(flow.level * _smooth_noise(rng, m, 18.0)) * (1 - flow.skip * dry)
    return flow.touch * dots, np.repeat(stays, sizes) & (way.left < _SLOWING), ample


def _way(stroke: Stroke, curve: curves.Curve) -> tuple[Any, ...]:
    """The channels of `_FlowWay` for one stroke; a dot becomes a piece hardly longer than nothing."""
    n = len(stroke.t)
    t = np.interp(np.arange(_FINER * (n - 1) + 1) / _FINER, np.arange(n), stroke.t)
    z = curve.places_at(t) @ np.array([1, 1j])
    far = np.r_[0.0, np.cumsum(np.abs(np.diff(z)))]
    # the length must grow even where the pen rests, so that time can be interpolated over it
    far = far + np.arange(len(far)) * 1e-9
    count = max(1, round(far[-1] / STEP))
    s = np.linspace(0.0, far[-1], count + 1)
    dot = far[-1] < _SPECK
    place = z[0] + np.array([-_SPECK, _SPECK]) if dot else np.interp(s, far, z)
    clock = np.array([t[0], max(t[-1], t[0] + 0.1)]) if dot else np.interp(s, far, t)
    span = np.diff(clock)
    speed = np.abs(np.diff(place)) / np.maximum(span, 1e-6)
    middle = (clock[:-1] + clock[1:]) / 2
    dwell = np.maximum(span - np.abs(np.diff(place)) / PACE, 0.0)
    if stroke.pressure is not None:
        press = np.interp(middle, stroke.t, stroke.pressure)
    else:  # a usual one: higher downwards and where it is slow
        down = np.diff(place).imag / np.maximum(np.abs(np.diff(place)), 1e-9)
        press = np.asarray(PRESSURE + 0.1 * lean(speed) + 0.1 * down)
    width = np.full(count, np.nan) if stroke.width is None else np.interp(middle, stroke.t, stroke.width)
    length = np.full(count, np.abs(np.diff(place)).sum())
    nib = np.zeros(count, dtype=np.complex128)
    if stroke.nib > 0 and stroke.rotation is not None:
        nib = 0.5 * stroke.nib * np.exp(1j * np.interp(middle, stroke.t, np.unwrap(stroke.rotation)))
        # how wide a line a flat nib leaves along its way, in the unit of `nib`, half its edge
        way = np.diff(place)
        along = way * nib.conj() / np.maximum(np.abs(way * nib), 1e-12)
        width = np.asarray(2 * np.abs(nib) * (np.abs(along.imag) + NIB_THICKNESS * np.abs(along.real)))
    since = (s[:-1] + s[1:]) / 2
    turned = stroke.rotation is not None or stroke.azimuth is not None
    slope = np.interp(middle, stroke.t, footprints.edge(stroke)) if turned else np.full(count, np.nan)
    return place[:-1], place[1:], speed, dwell, press, length, width, nib, since, s[-1] - since, slope


def _add_noise(way: _FlowWay, radius: Array, load: Array, flow: Flow, rng: np.random.Generator) -> Pieces:
    """Pieces with the noise of the pen; it is drawn in the same order for all pens, whether they use it or not."""
    m = len(radius)
    drift, patch = _smooth_noise(rng, m, 1.2), _smooth_noise(rng, m, 0.2)
    left, right = flow.ragged * _smooth_noise(rng, m, 0.07), flow.ragged * _smooth_noise(rng, m, 0.07)
    lanes = flow.streak * (0.8 * _smooth_noise(rng, m, 0.9, LANES, 0.7) + 0.6 * _smooth_noise(rng, m, 0.25, LANES, 1.2))
    blobs = rng.random((3, m))
    load = load * np.exp(flow.drift * drift + flow.patch * patch)
    step = way.b - way.a
    normal = step / np.maximum(np.abs(step), 1e-12) * 1j
    shift = normal * (left - right) / 2
    radius = np.maximum(radius + (left + right) / 2, _THINNEST / 2)
    nib = way.nib * np.where(way.nib == 0, 0, radius / np.fmax(way.width / 2, _THINNEST / 2))
    whole = Pieces(way.a + shift, way.b + shift, radius, load, np.exp(lanes).astype(np.float32), nib)
    # how far the line has turned within the half millimetre before each piece, rad
    turn = np.zeros(len(step))
    turn[1:] = np.abs(np.angle(step[1:] * step[:-1].conj() + 1e-15))
    back = 5
    total = np.cumsum(turn)
    turning = total - np.r_[np.zeros(min(back, m)), total[:-back]][:m]
    return _add_blobs(whole, turning, flow, blobs)


def _smooth_noise(rng: np.random.Generator, m: int, size: float, lanes: int = 1, across: float = 0.0) -> Array:
    """(m,) or (m, lanes): noise of mean 0 and deviation 1, smooth over `size` mm along and `across` lanes."""
    sigma = size / STEP
    # a short line still needs as much noise as smoothing takes in
    long = _REPEAT if lanes > 1 else max(m, int(8 * sigma) + 1)
    white = rng.standard_normal((long, lanes), dtype=np.float32)
    noise = ndimage.gaussian_filter(white, (sigma, across), mode=("wrap", "nearest"))
    # what smoothing leaves of the deviation, for any number of pieces
    keep = np.sqrt(2 * np.sqrt(np.pi) * sigma) * (np.sqrt(2 * np.sqrt(np.pi) * across) if across else 1.0)
    noise *= np.float32(keep)
    return np.asarray(noise[:m, 0] if lanes == 1 else noise.take(np.arange(m) % _REPEAT, axis=0))


def _add_blobs(whole: Pieces, turning: Array, flow: Flow, chance: Array) -> Pieces:
    """The pieces, and the lumps of ink that gather at a ball's rim and come off once it has turned round."""
    # a turn stays near for five pieces, which share its chance
    hit = np.flatnonzero(chance[0] < flow.goop / 5 * np.clip(turning - 1.0, 0, 1))
    if not len(hit):
        return whole
    step = whole.b[hit] - whole.a[hit]
    unit = step / np.maximum(np.abs(step), 1e-12)
    radius = whole.radius[hit] * (0.3 + 0.35 * chance[1, hit])
    side = unit * 1j * whole.radius[hit] * np.where(chance[2, hit] < 0.5, -1, 1) * 0.55
    a = (whole.a[hit] + whole.b[hit]) / 2 + side - unit * 0.04
    return Pieces(
        np.r_[whole.a, a],
        np.r_[whole.b, a + unit * (0.08 + 0.12 * chance[2, hit])],
        np.r_[whole.radius, radius],
        np.r_[whole.load, 2.0 + 2.0 * chance[1, hit]],
        np.r_[whole.lanes, np.ones((len(hit), LANES), dtype=np.float32)],
        np.r_[whole.nib, np.zeros(len(hit))],
    )
