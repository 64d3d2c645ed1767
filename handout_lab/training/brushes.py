"""Makes the shipped brushes: a dry brush of scanned strokes, and marker, sumi and crayon of simulated ones.

    python -m handout_lab.training.brushes stroke.png … --output brushes

The pictures are of the dry brush's strokes, one each; the other strokes are painted here, in a frame along and across
them, with noise that is smooth along the bristles.  Their shapes and tones are set by eye.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout import atomic
from handout.inking.brush import brushes
from handout.inking.brush.photographs import find_strokes
from handout.inking.brush.ribbon import straighten_stroke
from handout.values import Array

_ROWS = 100  # of pixels across a ribbon that ships
_HALF = 64  # pixels: half width of a simulated stroke
_STROKES = 5  # of a brush
_LONG = (3.0, 6.0)  # widths: the shortest and the longest
_PAPER = 246  # grey
_NOTICE = (
    "Made of scanned strokes of the page 110919_01 of ArtisticStyleRoboticPainting, "
    "Copyright (c) 2020 Ardavan Bidgoli, under the MIT licence; see brushes/README.md."
)


def _noise(shape: tuple[int, int], along: float, across: float, rng: np.random.Generator) -> Array:
    """(h, w): mean 0, deviation 1, smooth over so many pixels along and across a stroke."""
    from scipy.ndimage import gaussian_filter

    values = gaussian_filter(rng.standard_normal(shape), (across, along), mode="wrap")
    return np.asarray((values - values.mean()) / values.std())


def _frame(length: float) -> tuple[Array, Array]:
    """Places of the pixels of a sheet: along a stroke, 0 at its head, and across it from −1 to 1."""
    wide, high = round(length + 6 * _HALF), 6 * _HALF
    y, x = np.mgrid[:high, :wide].astype(np.float64)
    return x - 3 * _HALF, (y - high / 2) / _HALF


def _step(value: Array, soft: float) -> Array:
    return np.asarray(1 / (1 + np.exp(-np.clip(value / soft, -30, 30))))


def marker(length: float, wet: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """A round felt tip: round ends, an edge that bleeds a little, lanes of fibres, speckled where it runs dry."""
    u, v = _frame(length)
    away = np.hypot(np.maximum(np.maximum(_HALF - u, u - length + _HALF), 0) / _HALF, v)
    edge = away + 0.02 * _noise(u.shape, 9, 9, rng) + 0.008 * _noise(u.shape, 2, 2, rng)
    dry = np.clip((u / length - wet) / 0.5, 0, 1)
    fibres = _noise(u.shape, 60, 1.5, rng) + 0.6 * _noise(u.shape, 3, 3, rng)
    cover = _step(1 - edge, 0.012) * _step(2.6 - 2.4 * dry - 0.8 * fibres, 0.25)
    tone = 0.86 + 0.025 * _noise(u.shape, 90, 2.5, rng) + 0.05 * np.exp(-(((1 - away) / 0.08) ** 2))
    return cover, tone + 0.05 * np.exp(-u / _HALF)


def sumi(length: float, wet: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """A pointed brush with black ink: it lands on its tip, swells, and leaves in a tail of flying white."""
    u, v = _frame(length)
    share = np.clip(u / length, 0, 1)
    landing = np.sqrt(np.clip(share / 0.1, 0, 1) * (2 - np.clip(share / 0.1, 0, 1)))
    leaving = np.clip((1 - share) / 0.28, 0, 1) ** 0.6
    swell = 1 - 0.1 * np.cos(2 * np.pi * share + rng.uniform(-1, 1))
    shape = np.where((u >= 0) & (u <= length), landing * leaving * swell, -1)  # noise inks nothing before or after
    edge = np.abs(v + 0.12 * (share - 0.5)) + 0.018 * _noise(u.shape, 16, 4, rng)
    hairs = _noise(u.shape, 120, 1.1, rng) + 0.5 * _noise(u.shape, 14, 1.2, rng) + 0.8 * np.abs(v)
    dry = np.clip((share - wet) / 0.4, 0, 1)
    cover = _step(shape - edge, 0.015) * _step(2.9 - 3.1 * dry - hairs, 0.2)
    tone = 0.9 + 0.03 * _noise(u.shape, 100, 3, rng) - 0.05 * share + 0.03 * _noise(u.shape, 20, 20, rng)
    return cover, tone


def crayon(length: float, wet: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Wax that rubs off on the grain of the paper: pits stay bare, more of them at the edges and where it is light."""
    u, v = _frame(length)
    away = np.hypot(np.maximum(np.maximum(0.7 * _HALF - u, u - length + 0.7 * _HALF), 0) / (0.7 * _HALF), v)
    grain = _noise(u.shape, 1.6, 1.6, rng) + 0.7 * _noise(u.shape, 4, 4, rng)
    lanes = _noise(u.shape, 110, 3.0, rng)
    press = 1.6 + 1.2 * wet + 0.3 * _noise(u.shape, 60, 30, rng) - 1.3 * away**3 - 0.6 * np.clip(u / length - wet, 0, 1)
    cover = _step(1 - away + 0.05 * grain, 0.03) * _step(press - grain + 0.3 * lanes, 0.28)
    return cover, 0.88 + 0.05 * lanes + 0.05 * _noise(u.shape, 3, 3, rng)


# how a simulated brush paints, the colour of its ink, and the usual width of its line, mm
_SIMULATED: dict[str, tuple[Callable[..., tuple[Array, Array]], tuple[int, int, int], float, str]] = {
    "marker": (marker, (24, 26, 34), 0.6, "Round marker"),
    "sumi": (sumi, (14, 14, 16), 0.8, "Sumi brush"),
    "crayon": (crayon, (44, 78, 150), 0.7, "Wax crayon"),
}


def picture(name: str, length: float, wet: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: one stroke of a simulated brush, `length` pixels long, wet over that share of it."""
    paint, colour, _, _ = _SIMULATED[name]
    cover, tone = paint(length, wet, rng)
    dark = (_PAPER - np.asarray(colour, dtype=np.float64)) * np.clip(tone / 0.9, 0, 1.1)[..., None]
    return np.asarray(np.clip(np.rint(_PAPER - cover[..., None] * dark), 0, 255), dtype=np.uint8)


def simulated(name: str) -> brushes.Brush:
    """A brush of simulated strokes."""
    rng = np.random.default_rng([ord(letter) for letter in name])
    lengths, wet = np.linspace(*_LONG, _STROKES) * 2 * _HALF, np.linspace(1.0, 0.45, _STROKES)
    pictures = [picture(name, length, share, rng) for length, share in zip(lengths.tolist(), wet.tolist(), strict=True)]
    strokes = [find_strokes(each, name).strokes[0] for each in pictures]
    _, _, width, title = _SIMULATED[name]
    return brushes.Brush(tuple(straighten_stroke(stroke, _ROWS)[0] for stroke in strokes), width, title)


def main() -> None:
    """Make them all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("strokes", nargs="+", type=Path, help="scanned strokes of a dry brush")
    parser.add_argument("--output", type=Path, default=Path("brushes"))
    asked = parser.parse_args()
    dry, _ = brushes.learn(asked.strokes, width=0.8, title="Dry brush", rows=_ROWS)
    made = {"dry-brush": replace(dry, notice=_NOTICE), **{name: simulated(name) for name in _SIMULATED}}
    for name, brush in made.items():
        atomic.write(asked.output / f"{name}.brush", brushes.to_bytes(brush))


if __name__ == "__main__":
    main()
