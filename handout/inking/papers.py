"""Papers to show ink on: plain, laid, ruled and squared sheets as pixels, or any picture of a sheet; and their tooth.

The tooth is the heights of a paper's surface, fixed in mm, so that they look the same at any resolution.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout import units
from handout.errors import InputError
from handout.libraries import cv2
from handout.values import Array, Page, Raster

_TOOTH_STEP = 0.02  # mm between two heights
_TOOTH_SIDE = 1024  # heights along the side of the tile that is repeated
_TOOTH_BANDS = ((0.035, 0.7), (0.09, 0.6), (0.3, 0.35))  # mm, share: pits between fibres, fibres, flocs


@dataclass(frozen=True, eq=False)
class Tooth:
    """A repeated tile of heights: (n, n) float32, mean 0, standard deviation 1."""

    tile: NDArray[np.float32]

    def heights_at(self, x: NDArray[np.floating[Any]], y: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
        """Heights at places in mm, (n,)."""
        n = len(self.tile)
        row = (y * (1 / _TOOTH_STEP)).astype(np.int64) % n
        column = (x * (1 / _TOOTH_STEP)).astype(np.int64) % n
        return np.asarray(self.tile.reshape(-1)[row * n + column])


def tooth(rng: np.random.Generator) -> Tooth:
    """A new surface; paper is smoother along no direction.  From the same state of `rng` comes the same surface."""
    noise = rng.standard_normal((_TOOTH_SIDE, _TOOTH_SIDE), dtype=np.float32)
    return _tooth(noise.tobytes())


@lru_cache(maxsize=4)  # a page that is inked for several files, or checked, has the same surface each time
def _tooth(noise: bytes) -> Tooth:
    waves = np.fft.rfft2(np.frombuffer(noise, dtype=np.float32).reshape(_TOOTH_SIDE, _TOOTH_SIDE))
    total = np.fft.irfft2(waves * _tooth_spectrum(), s=(_TOOTH_SIDE, _TOOTH_SIDE)).astype(np.float32)
    total -= total.mean()
    total /= total.std()
    total.flags.writeable = False
    return Tooth(total)


@lru_cache(maxsize=1)
def _tooth_spectrum() -> Array:
    """Amplitude of each wave along the two sides of a tile."""
    down, across = np.fft.fftfreq(_TOOTH_SIDE, _TOOTH_STEP)[:, None], np.fft.rfftfreq(_TOOTH_SIDE, _TOOTH_STEP)
    square = (2 * np.pi) ** 2 * (down**2 + across**2)
    # a Gaussian of deviation σ has the spectrum exp(−σ² ω² / 2), and leaves a share of 1 / (4 π σ²) of the power
    power = sum(4 * np.pi * (share * size) ** 2 * np.exp(-square * size**2) for size, share in _TOOTH_BANDS)
    return np.asarray(np.sqrt(power))


PAPERS = ("none", "plain", "laid", "ruled", "squared")
_PITCH = {"ruled": 8.0, "squared": 5.0}
_WHITE = {
    "plain": (0.982, 0.978, 0.962),
    "laid": (0.965, 0.950, 0.910),
    "ruled": (0.980, 0.980, 0.970),
    "squared": (0.980, 0.980, 0.970),
}
_LINE = np.array([0.60, 0.72, 0.86])  # light that a printed line sends back, of what the paper does
_THICK = 0.18  # mm
_TOOTH_DEPTH = 0.0035  # of the light, standard deviation
_ROWS = 128  # of the page, worked on at a time
_FINER = 8  # parts of a pixel while lines are measured
_LAID, _CHAIN = 1.05, 25.0  # mm between the wires of the mould, and between those that hold them

_Shade = Callable[[Array, Array], NDArray[np.floating[Any]]]


@dataclass(frozen=True)
class Paper:
    """A sheet: one of `PAPERS`, or the path of a picture that is stretched to fill the page.

    pitch : mm between lines of ruled and squared paper, 2 to 100; None: 8 and 5.
    first : mm below the top edge where one of the lines lies; None: where the writing has its lines, or one pitch.
    head : mm below the top edge above which there are no lines; None: one pitch.

    Raises InputError: a pitch out of its bounds.
    """

    name: str = "none"
    pitch: float | None = None
    first: float | None = None
    head: float | None = None

    def __post_init__(self) -> None:
        if self.pitch is not None and not 2 <= self.pitch <= 100:
            raise InputError(f"paper: lines {self.pitch:g} mm apart are outside 2 to 100 mm.")
        if self.first is not None and not 0 <= self.first <= 2000:
            raise InputError(f"paper: a first line {self.first:g} mm from the top is outside 0 to 2000 mm.")


def parse_paper(text: str) -> Paper:
    """Read a paper: a name, a name with the distance of its lines (and its first rule), or a file.

    Raises InputError: a paper that there is not, or a length that is none.
    """
    name, colon, pitch = text.partition(":")
    if colon and name in ("ruled", "squared"):
        pitch, comma, first = pitch.partition(",")
        if comma and name == "squared":
            raise InputError(f"paper: {text!r}: only ruled paper has a first rule; write squared:{pitch}.")
        top = units.length(first, "first rule of the paper") if comma else None
        return Paper(name, units.length(pitch, "distance of the paper's lines"), top)
    if text in PAPERS:
        return Paper(text)
    from handout.scanning.page_layout import sheet_file

    if sheet_file(text) is None:
        raise InputError(
            f"paper: {text!r} is neither a picture or PDF nor one of {', '.join(PAPERS)}; --page says how large it is."
        )
    return Paper(text)


def place_lines(paper: Paper, about: Mapping[str, Any]) -> Paper:
    """Place the lines of a paper where those of a page lie, if `Drawing.about` says so and the paper does not.

    Ruled paper without a pitch of its own takes that of the writing.
    """
    if paper.first is not None:
        return paper
    spacing, baseline = about.get("line_spacing"), about.get("baseline")
    follows = paper.name == "ruled" and paper.pitch is None and isinstance(spacing, float) and 2 <= spacing <= 100
    pitch = spacing if follows else paper.pitch
    return replace(paper, pitch=pitch, first=baseline if isinstance(baseline, float) else None)


def sheet(paper: Paper, page: Page, dpi: float, rng: np.random.Generator) -> NDArray[np.uint8] | None:
    """(h, w, 3) uint8, device RGB: the paper at the size of the page; None for no paper, which is all white.

    Raises InputError: a name that is neither a paper nor a picture that can be read.
    """
    if paper.name == "none":
        return None
    size = max(1, round(page.height * dpi / 25.4)), max(1, round(page.width * dpi / 25.4))
    if paper.name not in PAPERS:
        return _picture(paper.name, size)
    return _make_sheet(paper, size, 25.4 / dpi, tooth(rng))


def lay_ink(raster: Raster, ground: NDArray[np.uint8] | None = None) -> NDArray[np.uint8]:
    """(h, w, 3) uint8, device RGB: ink on paper (h, w, 3), or on white.

    Paper gives back less light where there is ink, by what ink on white does: its grain is seen through thin ink.
    """
    from handout.inking import plain

    flat = plain.flatten(raster)
    if ground is None:
        return flat
    under = ground.reshape(-1, 3)
    page = ground.copy()
    for at in plain.inked_parts(raster.inked, raster.rows):
        light = flat.reshape(-1, 3)[at].astype(np.float32) / 255
        page.reshape(-1, 3)[at] = np.rint(under[at] * light)
    return page


def _make_sheet(paper: Paper, size: tuple[int, int], unit: float, surface: Tooth) -> NDArray[np.uint8]:
    """A sheet of pixels of `unit` mm, some rows at a time."""
    height, width = size
    lines = _lines(paper, size, unit)
    white = np.array(_WHITE[paper.name], dtype=np.float32) * 255
    x = (np.arange(width) + 0.5) * unit
    sheet = np.empty((height, width, 3), dtype=np.uint8)
    for top in range(0, height, _ROWS):
        y = (np.arange(top, min(top + _ROWS, height)) + 0.5) * unit
        light = 1 + np.float32(_TOOTH_DEPTH) * surface.heights_at(x[None, :], y[:, None])
        if paper.name == "laid":
            # made on a mould of wires, the paper is a little thinner and darker along each of them
            wires = 1 - 0.010 * np.cos(2 * np.pi / _LAID * y) ** 2
            away = np.abs((x + _CHAIN / 3) % _CHAIN - _CHAIN / 2)
            chains = 1 - 0.022 * np.exp(-((away / 0.45) ** 2))
            light = light * (wires[:, None] * chains[None, :]).astype(np.float32)
        rows = light[:, :, None] * white
        # where two lines cross the ink is not darker
        share = np.maximum(lines[0][None, :], lines[1][top : top + _ROWS, None])[:, :, None]
        rows *= (1 - share * (1 - _LINE)).astype(np.float32)
        sheet[top : top + _ROWS] = np.rint(np.clip(rows, 0, 255))
    return sheet


def _lines(paper: Paper, size: tuple[int, int], unit: float) -> tuple[Array, Array]:
    """Share of each column (w,) and of each row (h,) of pixels that printed lines cover."""
    height, width = size
    if paper.name not in _PITCH:
        return np.zeros(width), np.zeros(height)
    pitch = paper.pitch or _PITCH[paper.name]
    head = pitch if paper.head is None else paper.head
    rows = _cover_shares(height, unit, pitch, pitch if paper.first is None else paper.first, head)
    return (_cover_shares(width, unit, pitch, pitch, pitch) if paper.name == "squared" else np.zeros(width)), rows


def _cover_shares(count: int, unit: float, pitch: float, first: float, head: float) -> Array:
    """(count,): share of pixels of `unit` mm on lines `pitch` mm apart, one of them at `first`, from `head` on."""
    at = (np.arange(count * _FINER) + 0.5) * unit / _FINER
    on = np.abs((at - first + pitch / 2) % pitch - pitch / 2) < _THICK / 2
    return np.asarray((on & (at > head - _THICK)).reshape(count, _FINER).mean(axis=1))


def _picture(name: str, size: tuple[int, int]) -> NDArray[np.uint8]:
    """A sheet of which there is a picture or a PDF, at the size of the page."""
    from handout.scanning.page_layout import read_sheet

    try:
        rgb = read_sheet(name).rgb
    except InputError as error:
        names = ", ".join(PAPERS)
        raise InputError(f"paper: {name} is neither a sheet that can be read nor one of {names} ({error})") from error
    kind = cv2.INTER_AREA if size[0] < len(rgb) else cv2.INTER_CUBIC
    return np.array(cv2.resize(rgb, size[::-1], interpolation=kind), dtype=np.uint8)
