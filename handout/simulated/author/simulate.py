"""A page written and scanned, with the truth about it: the pipeline of the author's room."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.inking.papers import Paper, sheet, under
from handout.inking.pen import Pen, rgb, usual
from handout.inking.pens import passed
from handout.motion.trace import trace, written
from handout.page_sizes import page
from handout.simulated.author import owning
from handout.simulated.author.truth import Simulated, Truth
from handout.simulated.scanner import bed as beds
from handout.simulated.scanner.dust import specks
from handout.simulated.scanner.optics import FULL, look, tone
from handout.simulated.scanner.scanner import Scanner
from handout.values import Drawing, Hand, Manuscript, Page
from handout.writing.compose import compose
from handout.writing.layout import Layout

LEAST_DPI, MOST_DPI = 72.0, 1200.0
_MOST = 250e6  # pixels: the truth takes 30 bytes of each
_SEEN = 0.01  # of the light that ink must take to be seen

_PLAIN = Paper("plain")


def simulate(
    text: str,
    hand: Hand,
    *,
    rng: np.random.Generator,
    pen: Pen | None = None,
    paper: Paper = _PLAIN,
    dpi: float = 300.0,
    layout: Layout | None = None,
    scanner: Scanner | None = None,
    bits: int = 8,
) -> Simulated:
    """Write one page and scan it.

    Parameters
    ----------
    rng : numpy.random.Generator
        The same state gives the same writing, ink and place of the sheet at any resolution, pen, paper and scanner.
    pen : Pen, optional
        Default: the usual ballpoint.
    paper : Paper
        Ruled paper has its lines under those of the writing.
    dpi : float
        72 to 1200.
    layout : Layout, optional
        Default: A4 with the usual margins.
    scanner : Scanner, optional
        Default: the usual one.
    bits : {8, 16}
        Of the picture.

    Raises
    ------
    InputError, MissingCharacters, DoesNotFit
        As `compose`; a resolution out of its bounds; more text than a page holds.
    """
    layout = layout or Layout(page("A4"))
    (only,) = _pages(text, hand, layout, rng, 1, (pen, paper, dpi, scanner, bits))
    return only


def simulate_pages(
    text: str,
    hand: Hand,
    *,
    rng: np.random.Generator,
    pen: Pen | None = None,
    paper: Paper = _PLAIN,
    dpi: float = 300.0,
    layout: Layout | None = None,
    scanner: Scanner | None = None,
    bits: int = 8,
) -> Iterator[Simulated]:
    """As `simulate`, for as many pages as the text takes, one after the other; indices run on over the pages."""
    yield from _pages(text, hand, layout or Layout(page("A4")), rng, None, (pen, paper, dpi, scanner, bits))


def _pages(
    text: str, hand: Hand, layout: Layout, rng: np.random.Generator, pages: int | None, options: tuple[Any, ...]
) -> Iterator[Simulated]:
    pen, paper, dpi, scanner, bits = options
    _check(layout.page, dpi, scanner or Scanner(), bits)
    author, desk = rng.spawn(2)
    for manuscript in compose(text, hand, layout, author, pages=pages):
        moving, scanning = desk.spawn(2)
        drawing = trace(manuscript, hand, moving)
        yield scan(manuscript, drawing, hand, rng=scanning, pen=pen, paper=paper, dpi=dpi, scanner=scanner, bits=bits)


def scan(
    manuscript: Manuscript,
    drawing: Drawing,
    hand: Hand,
    *,
    rng: np.random.Generator,
    pen: Pen | None = None,
    paper: Paper = _PLAIN,
    dpi: float = 300.0,
    scanner: Scanner | None = None,
    bits: int = 8,
) -> Simulated:
    """Put a page that is already traced on paper, and scan it; `drawing` is what `trace` made of `manuscript`."""
    scanner = scanner or Scanner()
    pen = pen or usual("ballpoint")
    _check(manuscript.page, dpi, scanner, bits)
    placing, inking, making, glass, sensor = rng.spawn(5)
    bed = beds.lay(manuscript.page, dpi, scanner, placing)
    light, density = _inked(bed.lay(drawing), bed, pen, inking)
    ground = beds.seen(bed, _sheet(paper, manuscript, dpi, making), scanner)
    image, clean, alpha = _scanned(ground, light, specks(bed, scanner, glass), dpi, scanner, sensor, bits)
    del light, ground
    truth = _truth(manuscript, drawing, hand, bed, (density, alpha, clean), _usual(pen, paper, scanner), pen.width)
    return Simulated(image, dpi, truth, manuscript, drawing)


def _check(sheet_: Page, dpi: float, scanner: Scanner, bits: int) -> None:
    if not LEAST_DPI <= dpi <= MOST_DPI:
        raise InputError(f"dpi: {dpi:g} is outside {LEAST_DPI:g} to {MOST_DPI:g}.")
    if bits not in (8, 16):
        raise InputError(f"bits: {bits} is not possible; a scan has 8 or 16.")
    sides = (sheet_.width + 2 * scanner.border) * (sheet_.height + 2 * scanner.border)
    pixels = sides * (dpi / 25.4) ** 2
    if pixels > _MOST:
        raise InputError(
            f"A page of {sheet_.width:g} x {sheet_.height:g} mm at {dpi:g} dpi has {pixels / 1e6:.0f} megapixels, more "
            f"than {_MOST / 1e6:.0f}: use a lower resolution or a smaller page."
        )


def _inked(
    drawing: Drawing, bed: beds.Bed, pen: Pen, rng: np.random.Generator
) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """(h, w, 3) light that the ink lets pass, of `FULL`, and (h, w) its density."""
    colour = np.asarray(rgb(pen.colour))
    darkest = int(colour.argmin())
    # black ink is shown no darker than this by the pens either
    depth = np.float32(-np.log(min(max(float(colour[darkest]), 0.02), 0.98)))
    light = np.full((*bed.shape, 3), FULL, dtype=np.uint16)
    density = np.zeros(bed.shape, dtype=np.float32)
    for at, through in passed(drawing, bed.dpi, pen, rng):
        light.reshape(-1, 3)[at] = np.rint(through * FULL)
        density.reshape(-1)[at] = -np.log(np.maximum(through[:, darkest], 1e-4)) / depth
    return light, density


def _sheet(paper: Paper, manuscript: Manuscript, dpi: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    made = sheet(under(paper, manuscript.about), manuscript.page, dpi, rng)
    if made is not None:
        return made
    size = [max(1, round(side * dpi / 25.4)) for side in (manuscript.page.height, manuscript.page.width)]
    return np.full((*size, 3), 255, dtype=np.uint8)


def _scanned(
    ground: NDArray[np.uint8],
    light: NDArray[np.uint16],
    dust: NDArray[np.float32] | None,
    dpi: float,
    scanner: Scanner,
    rng: np.random.Generator,
    bits: int,
) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.float32]]:
    """The picture (h, w, 3), the same of the clean sheet, and the matte (h, w)."""
    kind, full = (np.uint8, 255) if bits == 8 else (np.uint16, 65535)
    image, clean = np.empty(ground.shape, dtype=kind), np.empty(ground.shape, dtype=kind)
    alpha = np.empty(ground.shape[:2], dtype=np.float32)
    for rows in look(ground, light, dust, dpi, scanner, rng):
        here = slice(rows.start, rows.start + len(rows.sheet))
        image[here], clean[here] = np.rint(rows.picture * full), np.rint(rows.sheet * full)
        alpha[here] = _matte(rows.inked, rows.sheet)
    return image, clean, alpha


def _matte(inked: NDArray[np.float32], bare: NDArray[np.float32]) -> NDArray[np.float32]:
    """(h, w): the least alpha with which a colour in 0–1 over `bare` gives `inked`, which is nowhere lighter."""
    hidden = 1 - inked / np.maximum(bare, np.float32(1e-6))
    return np.asarray(np.clip(hidden.max(axis=2), 0, 1))


def _usual(pen: Pen, paper: Paper, scanner: Scanner) -> float:
    """Alpha of one usual pass on the paper's usual white."""
    made = sheet(Paper("none") if paper.name == "none" else paper, Page(4, 4), 72, np.random.default_rng(0))
    white = np.ones(3) if made is None else np.median(made.reshape(-1, 3), axis=0) / 255
    bare, inked = (np.asarray(light, dtype=np.float32)[None, None] for light in (white, white * rgb(pen.colour)))
    return float(_matte(tone(inked, scanner), tone(bare, scanner))[0, 0])


def _truth(
    manuscript: Manuscript,
    drawing: Drawing,
    hand: Hand,
    bed: beds.Bed,
    pixels: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[Any]],
    full: float,
    line: float,
) -> Truth:
    density, alpha, clean = pixels
    unit = 25.4 / bed.dpi
    paths = owning.paths(drawing, written(manuscript, hand), bed, line / unit)
    owned = owning.labels(paths, alpha > _SEEN, unit)
    return Truth(
        labels=owned,
        density=density,
        alpha=alpha,
        paper=clean,
        usual=full,
        letters=owning.letters(manuscript, owned),
        paths=paths,
        splits=owning.splits(paths),
        baselines=owning.baselines(manuscript, bed),
        pixel=unit,
        rule=owning.rule(manuscript) / unit,
        x_height=manuscript.x_height / unit,
        line=line / unit,
        to_pixels=bed.to_pixels,
    )
