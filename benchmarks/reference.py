"""The pen in the chart's frame: ΔE00 of ink wanted against ink printed where the scanner's settings differ.

A pen's ink is a spectrum.  It writes a page, scanned with the usual settings (the hand), and some other words in the
frame of a chart, scanned with others.  The hand's ink goes through the match and the table to the simulated printer;
what comes out is compared with the pen's own ink on that paper, as a scanner with the usual settings sees both and as
the CIE 1931 observer does under D50.  A scanner is no observer, so that the second differs where both scans are alike
too.  Ink out of the printer's reach is left out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.calibrating.calibrated_ink import lay_on
from handout.calibrating.pen_reference import at_dpi
from handout.colour import conversions
from handout.colour.chart import chart
from handout.colour.chart_files import render
from handout.colour.ink_match import density_of, match
from handout.colour.models import fit
from handout.colour.models.forward import Patches
from handout.colour.reading import ChartScan, read_scans
from handout.colour.reading.pen_field import Scribble
from handout.colour.table import SEEN, ColourTable, apply, build, reach
from handout.hand.library import find
from handout.inking import pens
from handout.inking.pen import rgb, usual
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.simulated import print_and_scan, printer, spectra
from handout.simulated.flatbed import SETTINGS, Flatbed
from handout.simulated.printer import Inkjet
from handout.simulated.spectra import SimulatedSheet, WrittenSheet
from handout.values import Array, Raster
from handout.writing.compose import compose
from handout.writing.layout import Layout

Lobes = tuple[tuple[float, float, float], ...]
Ink = tuple[str, Lobes]  # the model of its pen, and its spectrum

DPI, FINE = 300, 600  # pixels an inch of scans, and of ink as it is written
_LEAST = 20  # samples in reach, to be judged at all
PAGE = "the quick brown fox jumps over a lazy dog and thinks it had been a river, with some more words to fill the page"
FRAME = "some words of another day"
# lobes of density: middle, width, nm, height
INKS: dict[str, Ink] = {
    "blue": ("ballpoint", ((600, 90, 0.6), (520, 120, 0.35))),
    "black": ("fineliner", ((550, 400, 1.25),)),
    "blue-black": ("fountain", ((610, 70, 0.7), (500, 200, 0.35))),
    "pencil": ("pencil", ((550, 500, 0.75),)),
    "red": ("ballpoint", ((520, 80, 0.5), (460, 90, 0.4), (600, 200, 0.12))),
}
KEPT_APART: dict[str, Ink] = {
    "green": ("fountain", ((650, 90, 0.55), (430, 80, 0.4), (540, 200, 0.15))),
    "violet": ("fineliner", ((570, 90, 0.6), (430, 80, 0.25), (650, 90, 0.25))),
    "brown": ("ballpoint", ((450, 70, 0.9), (560, 60, 0.5), (640, 80, 0.25))),
}
USUAL: dict[str, Flatbed] = {"same": Flatbed(), **{name: Flatbed(**values) for name, values in SETTINGS.items()}}
OTHERS: dict[str, Flatbed] = {
    "gamma 1.6": Flatbed(gamma=1.6), "black .02, white .95": Flatbed(black=-0.02, white=1.05, gamma=2.4),
    "contrast .35": Flatbed(contrast=0.35), "sRGB, contrast .3": Flatbed(srgb=True, contrast=0.3),
    "same": Flatbed(),
}  # fmt: skip


def main() -> None:
    """Print both tables."""
    table("inks, papers and settings that the method was made with", INKS, USUAL, ("cream", "white"))
    table("others", KEPT_APART, OTHERS, ("recycled", "photo"))


def table(name: str, inks: dict[str, Ink], settings: dict[str, Flatbed], papers: tuple[str, str]) -> None:
    """One row for each ink and setting; `papers` are the hand's and the printer's."""
    print(f"{name}: hand on {papers[0]}, print on {papers[1]}; ΔE00 without / with the frame: usual scanner; D50")
    sums = []
    for setting, flatbed in settings.items():
        readings = calibrated(flatbed, papers[1], inks)
        for ink, (scanned, colours) in readings.items():
            sums.append(judged(ink, inks[ink], scanned, colours, papers))
            print(f"  {setting:<22}{ink:<12}" + "; ".join(f"{a:6.2f} /{b:5.2f}" for a, b in sums[-1]), flush=True)
    print(f"  {'mean':<34}" + "; ".join(f"{a:6.2f} /{b:5.2f}" for a, b in np.nanmean(sums, axis=0)))


def spectrum(lobes: Lobes) -> Array:
    """(31,) density."""
    peaks = [height * np.exp(-0.5 * ((spectra.WAVELENGTHS - at) / wide) ** 2) for at, wide, height in lobes]
    return np.asarray(np.sum(peaks, axis=0))


def amount(model: str, text: str, size: str, seed: int) -> NDArray[np.float32]:
    """(h, w) how much ink a pen leaves, 1 where it is usual."""
    hand = find("house-print")
    layout = Layout(page(size), (1.0, 1.0, 1.0, 1.0), x_height=2.2, fit=True)
    rng = np.random.default_rng([seed])
    drawing = trace(compose(text, hand, layout, rng, pages=1)[0], hand, rng)
    kind = usual(model)
    rgba = pens.ink(drawing, FINE, kind, pens.noise({"seed": seed})).rgba / 255
    colour = np.asarray(rgb(kind.colour))
    k = int(colour.argmin())
    return np.asarray(np.log(np.maximum(1 - rgba[..., 3] * (1 - rgba[..., k]), 1e-3)) / np.log(max(colour[k], 1e-3)))


def calibrated(flatbed: Flatbed, paper: str, inks: dict[str, Ink]) -> dict[str, tuple[Scribble, ColourTable]]:
    """For every ink what was read of a chart on whose frame it was written, and the table."""
    first = chart("A4").pages[0]
    sheet = Inkjet(paper).print_page(render(first, DPI), DPI)
    readings, colours = dict[str, tuple[Scribble, ColourTable]](), None
    for number, (ink, (model, lobes)) in enumerate(inks.items()):
        small = amount(model, FRAME, "118x20mm", 100 + number)
        rows = np.flatnonzero(small.max(axis=1) > 0.3)
        small = small[max(0, rows[0] - 12) :]
        written = print_and_scan.write_on_sheet(sheet, first.scribble_field, small, FINE, spectrum(lobes))
        picture = flatbed.scan(written, DPI, np.random.default_rng(number))
        reading = read_scans([ChartScan(picture, (DPI, DPI), ink)])
        if colours is None:
            colours = build(fit(Patches(reading.device, reading.scanned, reading.deviation)))
        assert first.scribble_field is not None and reading.scribble is not None, f"{ink}: nothing found in the frame"
        readings[ink] = (reading.scribble, colours)
    return readings


def judged(name: str, ink: Ink, scribble: Scribble, colours: ColourTable, papers: tuple[str, str]) -> list[list[float]]:
    """((without, with) as the usual scanner sees it, (without, with) under D50)."""
    model, lobes = ink
    density, flatbed = spectrum(lobes), Flatbed()
    large = amount(model, PAGE, "150x40mm", 1)
    bare = np.zeros((round(40 / 25.4 * FINE), round(150 / 25.4 * FINE)), dtype=np.int32)

    def sheet(paper: str) -> SimulatedSheet:
        white = printer.PAPERS[paper].spectrum
        return SimulatedSheet(np.zeros((1, 4)), bare, lambda asked: np.repeat(white[None], len(asked), 0), FINE,
                     written=(WrittenSheet((0, 0), large.astype(np.float32), density),))  # fmt: skip

    still = Flatbed(rotation=0.0, offset=(0.0, 0.0), shading=0.0)
    picture = still.scan(sheet(papers[0]), DPI, np.random.default_rng(9)) / 255
    white = np.median(picture.reshape(-1, 3), axis=0)
    dpi = min(DPI, scribble.dpi)
    found = match(at_dpi(density_of(picture, white), DPI, dpi), white, at_dpi(scribble.density, scribble.dpi, dpi),
                  scribble.paper, dpi, scribble.contrast)  # fmt: skip
    assert found is not None, f"{name}: no match of the ink"
    # what is judged: parts of the pen's own lines, free of noise, whose spectra are known
    levels = np.random.default_rng(2).choice(large[large > 0.15], 400)
    one, other = (printer.PAPERS[p].spectrum * 10 ** (-density * levels[:, None]) for p in papers)
    seen = flatbed.see(one)
    clear = (seen / white).min(axis=1, keepdims=True)
    rgba = np.hstack([np.clip((seen - clear * white) / np.maximum(1 - clear, 1e-3), 0, 1), 1 - clear])
    outs = [Raster(np.rint(part[None] * 255).astype(np.uint8), DPI) for part in (rgba, found.inks(rgba))]
    wanted = np.clip(lay_on(outs[1].rgba[0] / 255, np.asarray(colours.paper)), 0, 1)
    reached = reach(wanted, colours).lost < SEEN
    printed = []
    for out in outs:
        sent = apply(out, colours).rgba[0] / 255
        printed.append(Inkjet(papers[1]).reflectance(np.rint(255 * (1 - sent[:, 3:] * (1 - sent[:, :3]))) / 255))

    def scanned(part: Array) -> Array:
        return conversions.lab(flatbed.see(part))

    def standard_observer(part: Array) -> Array:
        return spectra.lab(spectra.xyz(part))

    if reached.sum() < _LEAST:
        return [[np.nan, np.nan]] * 2
    return [
        [float(conversions.delta_e(view(part), view(other))[reached].mean()) for part in printed]
        for view in (scanned, standard_observer)
    ]


if __name__ == "__main__":
    main()
