"""Writes a page on a simulated desk, scans it, and notes the truth about it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.hand.drawn import Hand
from handout.inking.papers import Paper, place_lines, sheet
from handout.inking.pen import Pen, rgb, usual
from handout.inking.pens import pass_light
from handout.motion.trace import letters_of_samples, trace
from handout.page_sizes import page
from handout.simulated.flatbed import GlassPlacement
from handout.values import Drawing, Manuscript, Page
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout_lab.author import ink_ownership
from handout_lab.author import written as scanned
from handout_lab.author.truth import Simulated, Truth
from handout_lab.author.worn_flatbed import WornFlatbed, dust

LEAST_DPI, MOST_DPI = 72.0, 1200.0  # below what readers take (100) to what flatbeds have; set by eye
_MOST = 250e6  # pixels: the truth takes 30 bytes of each
_SEEN = 0.01  # of the light that ink must take to be seen

_PLAIN = Paper("plain")


@dataclass(frozen=True)
class Desk:
    """What the author writes with and on, and how the page is scanned.

    pen : None: the usual ballpoint.
    paper : ruled paper has its lines under those of the writing.
    layout : None: A4 with the usual margins.
    dpi : 72 to 1200; flatbed : None: the one for handwriting; bits : of the picture, 8 or 16.

    Raises
    ------
    InputError
        A resolution or a number of bits out of its bounds.
    """

    pen: Pen | None = None
    paper: Paper = _PLAIN
    layout: Layout | None = None
    dpi: float = 300.0
    flatbed: WornFlatbed = field(default_factory=WornFlatbed.of_handwriting)
    bits: int = 8

    def __post_init__(self) -> None:
        if not LEAST_DPI <= self.dpi <= MOST_DPI:
            raise InputError(f"dpi: {self.dpi:g} is outside {LEAST_DPI:g} to {MOST_DPI:g}.")
        if self.bits not in (8, 16):
            raise InputError(f"bits: {self.bits} is not possible; a scan has 8 or 16.")

    def check(self, sheet_: Page) -> None:
        """Raise InputError for a sheet with more pixels than memory is meant for."""
        sides = (sheet_.width + 2 * self.flatbed.border) * (sheet_.height + 2 * self.flatbed.border)
        pixels = sides * (self.dpi / 25.4) ** 2
        if pixels > _MOST:
            raise InputError(
                f"A page of {sheet_.width:g} x {sheet_.height:g} mm at {self.dpi:g} dpi has {pixels / 1e6:.0f} "
                f"megapixels, more than {_MOST / 1e6:.0f}: use a lower resolution or a smaller page."
            )


def simulate(text: str, hand: Hand, desk: Desk | None = None, *, rng: np.random.Generator) -> Simulated:
    """Write one page and scan it.

    The same state of `rng` gives the same writing, ink and place of the sheet at any resolution, pen, paper and
    scanner.

    Raises
    ------
    InputError, MissingCharacters, DoesNotFit
        As `compose`; more text than a page holds.
    """
    (only,) = simulate_pages(text, hand, desk, rng=rng, pages=1)
    return only


def simulate_pages(
    text: str, hand: Hand, desk: Desk | None = None, *, rng: np.random.Generator, pages: int | None = None
) -> Iterator[Simulated]:
    """As `simulate`, for as many pages as the text takes, one after the other; indices run on over the pages."""
    desk = desk or Desk()
    layout = desk.layout or Layout(page("A4"))
    desk.check(layout.page)
    writing, scanning = rng.spawn(2)
    for manuscript in compose(text, hand, layout, writing, pages=pages):
        moving, rest = scanning.spawn(2)
        yield scan(manuscript, trace(manuscript, hand, moving), hand, desk, rng=rest)


def scan(
    manuscript: Manuscript, drawing: Drawing, hand: Hand, desk: Desk | None = None, *, rng: np.random.Generator
) -> Simulated:
    """Put a page that is already traced on paper, and scan it; `drawing` is what `trace` made of `manuscript`."""
    desk = desk or Desk()
    desk.check(manuscript.page)
    flatbed, pen = desk.flatbed, desk.pen or usual("ballpoint")
    placing, inking, making, glass, sensor = rng.spawn(5)
    place = flatbed.lay(manuscript.page, desk.dpi, placing)
    light, density = _inked(place.lay(drawing), place, pen, inking)
    ground = scanned.ground(place, _sheet(desk.paper, manuscript, desk.dpi, making), flatbed)
    rows = scanned.layers(place, ground, light, dust(place, flatbed, glass), flatbed, sensor)
    image, clean, alpha = _pictures(rows, ground.shape, desk.bits)
    del light, ground
    usual_alpha = _usual_alpha(pen, desk.paper, flatbed)
    truth = _truth(manuscript, drawing, hand, place, (density, alpha, clean), usual_alpha, pen.width)
    return Simulated(image, desk.dpi, truth, manuscript, drawing)


def _inked(
    drawing: Drawing, place: GlassPlacement, pen: Pen, rng: np.random.Generator
) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """(h, w, 3) light that the ink lets pass, of `FULL`, and (h, w) its density."""
    colour = np.asarray(rgb(pen.colour))
    darkest = int(colour.argmin())
    # black ink is shown no darker than this by the pens either
    depth = np.float32(-np.log(min(max(float(colour[darkest]), 0.02), 0.98)))
    light = np.full((*place.shape, 3), scanned.FULL, dtype=np.uint16)
    density = np.zeros(place.shape, dtype=np.float32)
    for at, through in pass_light(drawing, place.dpi, pen, rng):
        light.reshape(-1, 3)[at] = np.rint(through * scanned.FULL)
        density.reshape(-1)[at] = -np.log(np.maximum(through[:, darkest], 1e-4)) / depth
    return light, density


def _sheet(paper: Paper, manuscript: Manuscript, dpi: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    picture = sheet(place_lines(paper, manuscript.about), manuscript.page, dpi, rng)
    if picture is not None:
        return picture
    size = [max(1, round(side * dpi / 25.4)) for side in (manuscript.page.height, manuscript.page.width)]
    return np.full((*size, 3), 255, dtype=np.uint8)


def _pictures(
    layers: Iterator[scanned.Rows], shape: tuple[int, ...], bits: int
) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.float32]]:
    """The picture (h, w, 3), the same of the clean sheet, and the matte (h, w)."""
    kind, full = (np.uint8, 255) if bits == 8 else (np.uint16, 65535)
    image, clean = np.empty(shape, dtype=kind), np.empty(shape, dtype=kind)
    alpha = np.empty(shape[:2], dtype=np.float32)
    for rows in layers:
        here = slice(rows.start, rows.start + len(rows.sheet))
        image[here], clean[here] = np.rint(rows.picture * full), np.rint(rows.sheet * full)
        alpha[here] = _matte(rows.inked, rows.sheet)
    return image, clean, alpha


def _matte(inked: NDArray[np.float32], bare: NDArray[np.float32]) -> NDArray[np.float32]:
    """(h, w): the least alpha with which a colour in 0–1 over `bare` gives `inked`, which is nowhere lighter."""
    hidden = 1 - inked / np.maximum(bare, np.float32(1e-6))
    return np.asarray(np.clip(hidden.max(axis=2), 0, 1))


def _usual_alpha(pen: Pen, paper: Paper, flatbed: WornFlatbed) -> float:
    """Alpha of one usual pass on the paper's usual white."""
    picture = sheet(Paper("none") if paper.name == "none" else paper, Page(4, 4), 72, np.random.default_rng(0))
    white = np.ones(3) if picture is None else np.median(picture.reshape(-1, 3), axis=0) / 255
    bare, inked = (np.asarray(light, dtype=np.float32)[None, None] for light in (white, white * rgb(pen.colour)))
    return float(_matte(flatbed.show_light(inked), flatbed.show_light(bare))[0, 0])


def _truth(
    manuscript: Manuscript,
    drawing: Drawing,
    hand: Hand,
    place: GlassPlacement,
    pixels: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[Any]],
    full: float,
    line: float,
) -> Truth:
    density, alpha, clean = pixels
    unit = 25.4 / place.dpi
    paths = ink_ownership.paths(drawing, letters_of_samples(manuscript, hand), place, line / unit)
    owned = ink_ownership.labels(paths, alpha > _SEEN, unit)
    return Truth(
        labels=owned,
        density=density,
        alpha=alpha,
        paper=clean,
        usual=full,
        letters=ink_ownership.letters(manuscript, owned),
        paths=paths,
        splits=ink_ownership.splits(paths),
        baselines=ink_ownership.baselines(manuscript, place),
        pixel=unit,
        rule=ink_ownership.rule(manuscript) / unit,
        x_height=manuscript.x_height / unit,
        line=line / unit,
        to_pixels=place.to_pixels,
    )
