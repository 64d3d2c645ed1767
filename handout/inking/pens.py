"""Pens whose lines look like ink on paper: ballpoint, fineliner, fountain pen, pencil, brush pen, chisel.

A model says how ink flows along the strokes (`flow`), and how what lies on the paper becomes density: where the
paper's tooth keeps it off, how sharp its edge is, how much darker the second pass is.  A density of 1 shows the
colour of the ink; light passes through less and more of it as through a filter (the law of Beer and Lambert), so
that thin ink is paler and purer in colour and a crossing is darker.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.inking import flow, footprints, papers, plain
from handout.inking.deposit import Ground
from handout.inking.flow import Flow
from handout.inking.mixing import passed_light, purest_ink
from handout.inking.papers import tooth
from handout.inking.pen import BY_FOOTPRINT, Pen, is_brush, rgb
from handout.values import Drawing, Raster

_Pixels = NDArray[np.floating[Any]]
_Finish = Callable[[_Pixels, _Pixels], _Pixels]

_FINE = 600  # pixels an inch, at least, at which ink is laid down before it is averaged
_FINE_ENOUGH = 1200  # pixels an inch at which nothing is gained by finer ones
_BAND = 1 << 22  # of these fine pixels worked on at a time
_GREYING = 0.3  # of the purest colour
_INK = 0x1A5  # a stream of random numbers of its own
_DARKEST = 0.02  # no ink is blacker in any channel


@dataclass(frozen=True)
class _Model:
    """flow : along the strokes; finish : density from the amount of ink and the height of the paper."""

    flow: Flow
    finish: _Finish


def _step(value: _Pixels, soft: float) -> _Pixels:
    """From 0 to 1 around 0, within about twice `soft` on either side."""
    return np.asarray(1 / (1 + np.exp(np.clip(value * np.float32(-1 / soft), -30, 30))))


def _ballpoint(mass: _Pixels, height: _Pixels) -> _Pixels:
    """A paste that the ball presses on: the paper's pits stay bare where there is little of it."""
    held = _step(mass - np.float32(0.3) + height * np.float32(0.13), 0.09)
    return np.asarray(held * (1 + np.float32(0.1) * height) * mass * np.float32(1.7) / (1 + np.float32(0.7) * mass))


def _fineliner(mass: _Pixels, height: _Pixels) -> _Pixels:
    """A thin ink that a tip of fibres lets through: full where it rests, dry on the paper's tooth where it flies."""
    held = _step(mass - np.float32(0.36) + height * np.float32(0.15), 0.06)
    shade = np.float32(0.15) + np.float32(0.75) * np.minimum(mass, np.float32(1.9))
    return np.asarray(held * shade * (1 + height * np.float32(0.05)))


def _fountain(mass: _Pixels, height: _Pixels) -> _Pixels:
    """A wet line: its colour follows the amount of ink, and gathers at the edge as it dries."""
    held = _step(mass - np.float32(0.42) + height * np.float32(0.05), 0.05)
    rim = np.exp(-(((mass - np.float32(0.6)) * np.float32(1 / 0.16)) ** 2))
    shade = np.float32(1.7) * mass / (1 + np.float32(0.7) * mass)
    return np.asarray(held * (shade + np.float32(0.16) * rim) * (1 + height * 0.04))


def _pencil(mass: _Pixels, height: _Pixels) -> _Pixels:
    """Graphite rubs off on what stands out of the paper; only hard pressing reaches into the pits."""
    held = _step(mass - np.float32(0.5) + height * np.float32(0.23), 0.17)
    return np.asarray(held * (1 + np.float32(0.12) * height) * np.float32(1.5) * mass / (1 + np.float32(0.5) * mass))


def _wet(mass: _Pixels, height: _Pixels) -> _Pixels:
    """A broad wet line: full all over, a little darker where more ink lies, dry on the paper's tooth where little."""
    held = _step(mass - np.float32(0.3) + height * np.float32(0.1), 0.06)
    shade = np.float32(0.7) + np.float32(0.35) * np.minimum(mass, np.float32(1.3))
    return np.asarray(held * shade * (1 + height * np.float32(0.04)))


_MODELS = {
    "ballpoint": _Model(
        Flow(
            width_pressure=0.45, width_speed=0.05, load_pressure=0.9, load_speed=0.12, pool=0.25, drift=0.12,
            patch=0.12, streak=0.26, ragged=0.012, goop=0.4,
        ),
        _ballpoint,
    ),
    "fineliner": _Model(
        Flow(
            # the tip gives way, wears to a facet as it is held and runs dry: measured on a wet pen's scanned page;
            # tone along the line and at its ends: set to approach scanned pages of 11 writers, with dots of rest so
            # small that none reads as a full stop
            width_pressure=0.75, width_speed=0.2, load_pressure=0.7, load_speed=0.34, pool=0.9, bleed=0.2,
            patience=0.045, nib=0.16, drift=0.16, patch=0.16, streak=0.2, ragged=0.009,
            touch=0.1, stays=0.25, skip=0.5, level=0.15,
        ),
        _fineliner,
    ),
    "fountain": _Model(
        Flow(
            width_pressure=0.9, width_speed=0.08, load_pressure=0.4, load_speed=0.35, pool=1.3, bleed=0.2, nib=0.3,
            drift=0.16, patch=0.06, streak=0.06, ragged=0.008,
        ),
        _fountain,
    ),
    "pencil": _Model(
        Flow(
            width_pressure=0.7, load_pressure=0.8, load_speed=0.06, drift=0.06, patch=0.06, streak=0.15, ragged=0.015,
        ),
        _pencil,
    ),
    "brushpen": _Model(
        Flow(load_pressure=0.25, load_speed=0.2, drift=0.1, patch=0.05, streak=0.22, ragged=0.012), _wet
    ),
    "chisel": _Model(Flow(load_pressure=0.2, load_speed=0.2, drift=0.08, patch=0.05, streak=0.08, ragged=0.005), _wet),
}  # fmt: skip


def noise(about: Mapping[str, Any]) -> np.random.Generator:
    """The generator of a page's unevenness, from the seed and the numbers of page and row in `Drawing.about`."""
    named = (about.get(key) for key in ("seed", "page_number", "row"))
    return np.random.default_rng([_INK, *(v if isinstance(v, int) and v >= 0 else 0 for v in named)])


def ink(drawing: Drawing, dpi: float, pen: Pen, rng: np.random.Generator) -> Raster:
    """Ink a drawing on a transparent page; where it has scanned ink, that is what it is written with.

    drawing : strokes without pressure get what is usual for their direction and speed; those with a colour of their own
        have it.
    dpi : 20 to 4800.
    rng : for the unevenness of ink and paper; the same state gives the same gaps at any resolution.

    Returns the whole page, (h, w, 4): over white, straight alpha shows the ink itself.  Pixels without ink are zero.

    Raises InputError: a resolution or width out of its bounds, or a page of more than 4 gigapixels.
    """
    if drawing.ink is not None:
        return drawing.ink(dpi)
    if pen.model == "plain" and not any(stroke.colour for stroke in drawing.strokes):
        return plain.ink(drawing, dpi, width=pen.width, colour=rgb(pen.colour))
    rgba = np.zeros((*plain.shape(drawing, dpi, pen.width), 4), dtype=np.uint8)
    pixels, ends = rgba.reshape(-1, 4), [0]
    for at, light in _pass_colours(drawing, dpi, pen, rng):
        ends += [int(at.min()), int(at.max()) + rgba.shape[1]] if len(at) else []
        pixels[at] = purest_ink(light * passed_light(pixels[at]))  # through another colour that is there already
    return Raster(rgba, dpi, rows=(min(ends[1:], default=0) // rgba.shape[1], max(ends) // rgba.shape[1]))


def image(
    drawing: Drawing, dpi: float, pen: Pen, rng: np.random.Generator, paper: NDArray[np.uint8] | None = None
) -> NDArray[np.uint8]:
    """(h, w, 3) uint8, device RGB: the drawing on paper (h, w, 3), or on white.

    Ink is a filter before the paper: what the paper sends back is multiplied with what the ink lets pass, and paper
    without ink stays as it is.  Parameters and errors are those of `ink`; the paper has the size of the page.
    """
    size = (*plain.shape(drawing, dpi, pen.width), 3)
    if paper is not None and paper.shape != size:
        raise ValueError(f"expected paper of shape {size}, got {paper.shape}")
    if drawing.ink is not None:
        return papers.lay_ink(drawing.ink(dpi), paper)
    page = np.full(size, 255, dtype=np.uint8) if paper is None else paper.copy()
    pixels = page.reshape(-1, 3)
    for at, light in _pass_colours(drawing, dpi, pen, rng):
        pixels[at] = np.rint(pixels[at] * light)
    return page


def _pass_colours(
    drawing: Drawing, dpi: float, pen: Pen, rng: np.random.Generator
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.float32]]]:
    """As `pass_light`, the strokes of one colour after those of the other; those without one have the pen's."""
    for colour in dict.fromkeys(stroke.colour for stroke in drawing.strokes):
        strokes = tuple(stroke for stroke in drawing.strokes if stroke.colour == colour)
        yield from pass_light(replace(drawing, strokes=strokes), dpi, replace(pen, colour=colour or pen.colour), rng)


def pass_light(
    drawing: Drawing, dpi: float, pen: Pen, rng: np.random.Generator
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.float32]]]:
    """Flat indices (n,) of the pixels that have ink, and the light (n, 3) in 0–1 that it lets pass; in parts."""
    height, width = plain.shape(drawing, dpi, pen.width)
    if not drawing.strokes:
        return
    colour = np.asarray(rgb(pen.colour))
    if pen.model in BY_FOOTPRINT:
        drawing = footprints.mark_drawing(drawing, pen)
    if pen.model == "plain":
        cover = plain.coverage(drawing, dpi, width=pen.width)
        table = (1 - np.linspace(0, 1, 256)[:, None] * (1 - colour)).astype(np.float32)
        for at in plain.inked_parts(cover):
            yield at, table[cover.reshape(-1)[at]]
        return
    if is_brush(pen.model):
        from handout.inking.brush import brushes, canvas

        yield from canvas.pass_brush(drawing, dpi, brushes.find(pen.model), pen, rng)
        return
    model = _MODELS[pen.model]
    absorbed = -np.log(np.maximum(colour, _DARKEST)).astype(np.float32)
    paper_rng, ink_rng = rng.spawn(2)
    surface = tooth(paper_rng)
    fine = 1 if dpi >= _FINE_ENOUGH else max(2, -int(-_FINE // dpi))
    ground = Ground(flow.pieces(drawing, pen.width, model.flow, ink_rng), dpi * fine / 25.4, width * fine, fine)
    left, right = ground.columns.start // fine, ground.columns.stop // fine
    rows = max(1, _BAND // (width * fine * fine))
    for top in range(0, height, rows):
        mass = ground.rows(top * fine, min(rows, height - top) * fine)
        if not len(mass):
            continue
        cells = mass.reshape(-1, fine, right - left, fine)
        most = np.maximum.reduce([cells[:, i, :, j] for i in range(fine) for j in range(fine)])
        row, column = np.divmod(np.flatnonzero(most), right - left)
        some = cells.swapaxes(1, 2)[row, column].reshape(len(row), fine * fine)
        # heights of the paper under the parts of these pixels
        part = (np.arange(fine) + 0.5) / fine
        y = ((row + top)[:, None, None] + part[:, None]) * (25.4 / dpi)
        x = ((column + left)[:, None, None] + part) * (25.4 / dpi)
        under = surface.heights_at(*np.broadcast_arrays(x, y)).reshape(len(row), fine * fine)
        # Thick ink is not only darker but greyer than thin ink, as seen in scans of blue ballpoint: the share that all
        # channels have in common grows with the square of the density.
        density = model.finish(some, under)
        pure = 1 - float(absorbed.min() / max(absorbed.max(), 1e-6))
        grey = min(_GREYING * pure, 0.4 * float(absorbed.min()))
        more = density * (density - 1) * np.float32(grey)
        light = np.stack([np.exp(-density * k - more).mean(axis=1) for k in absorbed], axis=1)
        yield (row + top) * width + column + left, light.astype(np.float32)
