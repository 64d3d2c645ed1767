"""Old sheets: yellowed, stained, folded paper, with what shines through from its back and later marks on it.

The picture that comes out is a paper to write on (`inking.papers.Paper` takes its file), so that a page of the
simulated author on it is scanned and judged as on any other.  Lengths are in mm; the figures were set by eye.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.inking.pen import Pen
from handout.inking.pens import pass_light
from handout.simulated.flatbed import smooth_field
from handout.values import Drawing, Page

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Age:
    """What time did to a sheet.

    paper : light that the sheet sends back, red, green and blue, 0–1.
    uneven : share by which that varies over the sheet, slowly; edge : share that is lost at the edges.
    foxing : brown spots of a square decimetre; stains : tide marks of water.
    folds : (along, place): "across" or "down", and where, a share of the side.
    through : share of its light that ink on the back takes, of what it takes on the back; 0: none shines through.
    spread : mm, deviation by which that is blurred.
    """

    paper: tuple[float, float, float] = (0.90, 0.85, 0.735)
    uneven: float = 0.035
    edge: float = 0.16
    foxing: float = 14.0
    stains: int = 2
    folds: tuple[tuple[str, float], ...] = (("across", 1 / 3), ("across", 2 / 3), ("down", 0.5))
    through: float = 0.3
    spread: float = 0.13


_FOX = np.array([0.72, 0.54, 0.34])  # colour of light that the middle of a brown spot sends back, of the paper's
_TIDE = np.array([0.86, 0.76, 0.60])  # the same, of the rim of a stain
_RADIUS, _ROUGH = 0.45, 0.55  # mm, usual radius of a spot; deviation of its logarithm
_RIM = 0.7  # mm: width of the rim of a stain
_CREASE, _SHADE = 0.22, 4.0  # mm: half width of a fold's line; how far its shading reaches
_FIBRE = 0.012  # of the light: deviation of the paper's own cloudiness
_ORDER = 4  # cosines a side of what varies slowly


def old_sheet(
    page: Page,
    dpi: float,
    rng: np.random.Generator,
    age: Age = Age(),
    *,
    back: Drawing | None = None,
    back_pen: Pen | None = None,
    marks: Sequence[tuple[Drawing, Pen]] = (),
) -> NDArray[np.uint8]:
    """A sheet as it looks today, without the writing that is to be read.

    Parameters
    ----------
    page : its size.
    dpi : of the picture.
    rng : numpy.random.Generator
        The same generator gives the same sheet.
    back : what is written on its back, as one looks at the back.
    back_pen : it was written with this.
    marks : what later hands wrote or stamped on the front, each with its pen.

    Returns
    -------
    (h, w, 3) uint8, device RGB.
    """
    unit = 25.4 / dpi
    height, width = max(1, round(page.height / unit)), max(1, round(page.width / unit))
    slow, spots, tides, inks = rng.spawn(4)
    light = np.broadcast_to(np.array(age.paper, dtype=np.float32), (height, width, 3)).copy()
    light *= (1 + _clouds((height, width), unit, age, slow))[:, :, None]
    for number in range(age.stains):
        light *= _stain((height, width), unit, tides, number)
    light *= _foxing((height, width), unit, age, spots)
    light *= _folds((height, width), unit, age)[:, :, None]
    if back is not None and age.through:
        light *= _shining_through(back, back_pen or Pen(), dpi, (height, width), age, inks)
    for drawing, pen in marks:
        light *= _ink(drawing, pen, dpi, (height, width), inks)
    return np.rint(255 * np.clip(light, 0, 1)).astype(np.uint8)


def _clouds(shape: tuple[int, int], unit: float, age: Age, rng: np.random.Generator) -> Floats:
    """(h, w) how much lighter the sheet is than usual: slow changes, browned edges, and the clouds of its fibres."""
    import cv2

    height, width = shape
    waves = rng.normal(0.0, 1.0, (_ORDER, _ORDER)) / (1 + np.add.outer(np.arange(_ORDER), np.arange(_ORDER)))
    waves[0, 0] = 0.0
    slow = smooth_field(waves, np.linspace(0, 1, width), np.linspace(0, 1, height))
    y, x = (np.arange(side, dtype=np.float32) * np.float32(unit) for side in shape)
    away = np.minimum.outer(np.minimum(y, y[::-1]), np.minimum(x, x[::-1]))
    noise = rng.standard_normal((height // 4 + 1, width // 4 + 1), dtype=np.float32)
    grain = np.asarray(cv2.GaussianBlur(noise, (0, 0), 1.2))
    fibre = np.asarray(cv2.resize(grain / grain.std(), (width, height), interpolation=cv2.INTER_CUBIC))
    return np.asarray(
        age.uneven * slow / np.abs(slow).max() - age.edge * np.exp(-away / 6.0) + _FIBRE * fibre, dtype=np.float32
    )


def _foxing(shape: tuple[int, int], unit: float, age: Age, rng: np.random.Generator) -> Floats:
    """(h, w, 3) light that brown spots leave."""
    import cv2

    area = shape[0] * shape[1] * unit**2 / 1e4
    count = int(rng.poisson(age.foxing * area))
    depth = np.zeros(shape, dtype=np.float32)
    for _ in range(count):
        radius = max(1.0, float(_RADIUS * np.exp(rng.normal(0.0, _ROUGH))) / unit)
        x, y = rng.uniform(0, shape[1]), rng.uniform(0, shape[0])
        turn, flat, dark = rng.uniform(0, 180), rng.uniform(0.6, 1.0), rng.uniform(0.25, 1.0)
        spot = np.zeros(shape, dtype=np.uint8)
        cv2.ellipse(spot, (round(x), round(y)), (round(radius), max(1, round(radius * flat))), turn, 0, 360, 255, -1)
        reach = max(1, round(4 * radius))
        rows, columns = (slice(max(0, round(at) - reach), round(at) + reach + 1) for at in (y, x))
        soft = cv2.GaussianBlur(spot[rows, columns].astype(np.float32) / 255, (0, 0), 0.6 * radius)
        depth[rows, columns] = np.maximum(depth[rows, columns], np.float32(dark) * soft)
    return np.asarray(1 - depth[:, :, None] * (1 - _FOX), dtype=np.float32)


def _stain(shape: tuple[int, int], unit: float, rng: np.random.Generator, number: int) -> Floats:
    """(h, w, 3) light that one tide mark of water leaves: a little less inside, most at its rim."""
    height, width = shape
    corner = np.array([(0.95, 0.1), (0.05, 0.8), (0.6, 1.0)][number % 3]) * (width, height)
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    angle = np.arctan2(y - corner[1], x - corner[0])
    radius = rng.uniform(14.0, 26.0) / unit
    waves = sum(rng.normal(0.0, 0.05) * np.cos(order * angle + rng.uniform(0, 2 * np.pi)) for order in range(2, 8))
    away = (np.hypot(x - corner[0], y - corner[1]) - radius * (1 + waves)) * unit
    rim = np.exp(-((away / _RIM) ** 2)) + 0.35 / (1 + np.exp(np.clip(away / 0.3, -50, 50)))
    return np.asarray(1 - np.minimum(rim, 1)[:, :, None] * 0.55 * (1 - _TIDE), dtype=np.float32)


def _folds(shape: tuple[int, int], unit: float, age: Age) -> Floats:
    """(h, w) light along folds: worn in the line itself, lighter on one side of it and darker on the other."""
    light = np.ones(shape, dtype=np.float32)
    for way, place in age.folds:
        side = shape[0] if way == "across" else shape[1]
        away = (np.arange(side) - place * side) * unit
        tilt = 0.035 * np.sign(away) * np.exp(-np.abs(away) / _SHADE)
        line = (1 + tilt - 0.16 * np.exp(-((away / _CREASE) ** 2))).astype(np.float32)
        light *= line[:, None] if way == "across" else line[None, :]
    return light


def _shining_through(
    back: Drawing, pen: Pen, dpi: float, shape: tuple[int, int], age: Age, rng: np.random.Generator
) -> Floats:
    """(h, w, 3) light that the ink of the back leaves, seen from the front: mirrored, blurred and pale."""
    import cv2

    taken = 1 - _ink(back, pen, dpi, shape, rng)[:, ::-1]
    blurred = cv2.GaussianBlur(np.ascontiguousarray(taken), (0, 0), max(0.3, age.spread * dpi / 25.4))
    return np.asarray(1 - np.float32(age.through) * blurred, dtype=np.float32)


def _ink(drawing: Drawing, pen: Pen, dpi: float, shape: tuple[int, int], rng: np.random.Generator) -> Floats:
    """(h, w, 3) light that the ink of a drawing lets pass."""
    light = np.ones((*shape, 3), dtype=np.float32)
    for at, through in pass_light(drawing, dpi, pen, rng):
        light.reshape(-1, 3)[at] = through
    return light
