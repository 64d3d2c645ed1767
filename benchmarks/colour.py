"""Colour: how near a print comes to the colours that were wanted, by method and noise; cross-validation; speed.

Colours go to a simulated inkjet (spectral) and to a measured offset press through the method's table, and are scanned
again; ΔE00 is between the colour wanted and the colour scanned.  With HANDOUT_DATA, the methods are compared on a
chart that was really printed and scanned (`colour/canon_pro1000`): patches kept out, ten folds.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks import argyll
from handout.colour import METHODS, conversions
from handout.colour.chart import chart as calibration_chart
from handout.colour.chart_files import render
from handout.colour.models import fit, splines
from handout.colour.models.forward import Patches
from handout.colour.reading import read_scans
from handout.colour.reading.scan_files import ChartScan
from handout.colour.table import ColourTable, apply, build
from handout.inking.plain import flatten
from handout.simulated.flatbed import Flatbed
from handout.simulated.printer import Inkjet
from handout.values import Array, Raster
from handout_lab.author.worn_flatbed import WornFlatbed
from handout_lab.offset_press import Measured

Printer = Callable[[Array], Array]
NOISES = ("0", "0.25", "1", "8-bit")  # of patch means, in 1/255; rounded to 8 bits
FOLDS, OWN = 10, 0.5 / 255  # error of a patch of the real chart, of which repeats tell about this much
SHARE = 0.06  # of a page of handwriting that is inked


def main() -> None:
    """Print all comparisons."""
    for name, printer in (("inkjet", Inkjet().scan_patches), ("press", Measured().scan_patches)):
        accuracy(name, printer)
    whole_way()
    if argyll.found():
        by_profile(Inkjet().scan_patches)
    else:
        print("ArgyllCMS (colprof, xicclu) is not on PATH: no comparison with its profiles")
    if os.environ.get("HANDOUT_DATA"):
        cross_validation(Path(os.environ["HANDOUT_DATA"]) / "colour" / "canon_pro1000")
    else:
        print("HANDOUT_DATA is not set: no cross-validation on a real chart")
    speed(Inkjet().scan_patches)


def chart() -> Array:
    """(768, 3) device RGB: the cube 8 × 8 × 8 and 256 greys."""
    levels = np.rint(np.linspace(0, 255, 8)) / 255
    cube = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.concatenate([cube, np.repeat((np.arange(256) / 255)[:, None], 3, axis=1)])


def scanned(printer: Printer, noise: str, rng: np.random.Generator) -> Patches:
    """The chart as it was scanned; the error of rounded means is not told."""
    sent = chart()
    seen = printer(sent)
    if noise == "8-bit":
        return Patches(sent, np.rint(seen * 255) / 255, np.full(len(sent), np.nan))
    sigma = float(noise) / 255
    return Patches(sent, np.clip(seen + sigma * rng.normal(size=seen.shape), -0.05, 1.05), np.full(len(sent), sigma))


def off(one: Array, other: Array) -> str:
    """Mean / 95th percentile / greatest ΔE00 between scanned colours."""
    away = conversions.delta_e(conversions.lab(one), conversions.lab(other))
    return f"{away.mean():6.2f} /{np.percentile(away, 95):6.2f} /{away.max():6.2f}"


def wanted(printer: Printer) -> tuple[Array, Array]:
    """(1000, 3) printable colours and (300, 3) greys as they are scanned, none of them of the chart."""
    rng = np.random.default_rng(0)
    colours = printer(rng.random((1000, 3)))
    return colours, printer(np.repeat(rng.random((300, 1)), 3, axis=1))


def whole_way() -> None:
    """The chart printed by the simulated inkjet, scanned by the simulated flatbed and read; colours as above."""
    inkjet = Inkjet()
    sheet = inkjet.print_page(render(calibration_chart("A4").pages[0], 300), 300, None, np.random.default_rng(3))
    rng = np.random.default_rng(0)
    colours = inkjet.scan_patches(rng.random((1000, 3)))
    greys = inkjet.scan_patches(np.repeat(rng.random((300, 1)), 3, axis=1))
    print("chart printed, scanned and read: ΔE00 mean / p95 / max of colours; greys; seconds to read, to fit and build")
    for name, flatbed, dpi in (
        ("300 dpi, 8 bit", Flatbed(), 300),
        ("300 dpi, 16 bit", Flatbed(bits=16), 300),
        ("150 dpi, JPEG 80", WornFlatbed(jpeg=80), 150),
        ("200 dpi, uneven, flare", WornFlatbed(shading=0.05, flare=0.02), 200),
    ):
        picture = flatbed.scan(sheet, dpi, np.random.default_rng(5))
        begin = time.process_time()
        reading = read_scans([ChartScan(picture, (dpi, dpi), name)])
        middle = time.process_time()
        table = build(fit(Patches(reading.device, reading.scanned, reading.deviation)))
        end = time.process_time()
        print(
            f"  {name:<24} {off(inkjet.scan_patches(table(colours)), colours)}; "
            f"{off(inkjet.scan_patches(table(greys)), greys)}; {middle - begin:.1f}, {end - middle:.1f}",
            flush=True,
        )


def accuracy(name: str, printer: Printer) -> None:
    """1000 printable colours kept out of the chart, and 300 greys, through the table of each method."""
    colours, greys = wanted(printer)
    print(f"{name}: ΔE00 mean / p95 / max of colours; greys; seconds to fit, to build (of the processor)")
    print(f"  {'uncorrected':<15}       {off(printer(colours), colours)}; {off(printer(greys), greys)}")
    for noise in NOISES:
        patches = scanned(printer, noise, np.random.default_rng(1))
        for method in METHODS:
            begin = time.process_time()
            model = fit(patches, method)
            middle = time.process_time()
            table = build(model)
            end = time.process_time()
            print(
                f"  {method:<15}{noise:>5} {off(printer(table(colours).astype(np.float64)), colours)}; "
                f"{off(printer(table(greys).astype(np.float64)), greys)}; {middle - begin:.1f}, {end - middle:.1f}",
                flush=True,
            )


def by_profile(printer: Printer) -> None:
    """The colours and greys of `accuracy` through a profile of ArgyllCMS."""
    colours, greys = wanted(printer)
    print("inkjet, ArgyllCMS colprof -qm: ΔE00 mean / p95 / max of colours; greys")
    for noise in NOISES:
        with argyll.profiled(scanned(printer, noise, np.random.default_rng(1))) as profile:
            for inverse in argyll.INVERSES:
                made, grey = (printer(argyll.sent(profile, these, inverse)) for these in (colours, greys))
                print(f"  {inverse:<15}{noise:>5} {off(made, colours)}; {off(grey, greys)}", flush=True)


def cross_validation(folder: Path) -> None:
    """A real chart: device → scanned as the forward model has it, and scanned → L*a*b*, against exact splines."""
    device = rows(folder / "patches_522.txt", 3) / 255
    scan, lab = np.split(rows(folder / "epsonV850_scanRGB_vs_Lab_522.txt", 6), 2, axis=1)
    scan = scan / 255
    print("real chart, patches kept out: ΔE00 mean / p95")
    for name, x, y, looks in (
        ("device → scanned", device, scan, conversions.lab),
        ("scanned → L*a*b*", scan, lab, lambda given: given),
    ):
        noise = OWN**2 * (1.0 if looks is conversions.lab else 100.0**2)
        for method in ("smoothed", "exact thin plates"):
            found = kept_out(x, y, noise, exact=method != "smoothed")
            away = conversions.delta_e(looks(found), looks(y))
            print(f"  {name}, {method:<18} {away.mean():.3f} / {np.percentile(away, 95):.3f}")
    inverted(device, scan)
    if argyll.found():
        profiled(device, scan)


def inverted(device: Array, scan: Array) -> None:
    """What to send for scanned colours of patches kept out, by each method, against what was sent."""
    fold, shown = folds(device), printer_of(device, scan)
    for method in METHODS:
        found = np.empty_like(device)
        for number in range(FOLDS):
            known = fold != number
            model = fit(Patches(device[known], scan[known], np.full(int(known.sum()), np.nan)), method)
            found[~known] = np.clip(model.invert(scan[~known]), 0, 1)
        print(f"  scanned → device, {method:<20} {apart(found, device)}; ΔE00 {off(shown(found), scan)}", flush=True)


def apart(one: Array, other: Array) -> str:
    """Mean / 95th percentile of distances of device RGB."""
    away = 255 * np.linalg.norm(one - other, axis=1)
    return f"{away.mean():5.2f} / {np.percentile(away, 95):5.2f}, 1/255 of RGB"


def printer_of(device: Array, scan: Array) -> Printer:
    """A real chart as a printer: an exact spline through all its patches, repeats averaged."""
    ready = splines.merge_close_rows(device, scan, np.ones(len(device)))
    return splines.exact(ready.x, ready.y)


def profiled(device: Array, scan: Array) -> None:
    """Both ways through profiles of ArgyllCMS, of the same patches kept out but for white, which colprof asks for."""
    fold, white, shown = folds(device), (device == 1).all(axis=1), printer_of(device, scan)
    seen, sent = scan.copy(), {inverse: device.copy() for inverse in argyll.INVERSES}
    for number in range(FOLDS):
        known = (fold != number) | white
        with argyll.profiled(Patches(device[known], scan[known], np.full(int(known.sum()), np.nan))) as profile:
            seen[~known] = argyll.seen(profile, device[~known])
            for inverse, found in sent.items():
                found[~known] = argyll.sent(profile, scan[~known], inverse)
    print(f"  device → scanned, colprof -qm         {off(seen[~white], scan[~white])}")
    for inverse, found in sent.items():
        cut, name = np.clip(found, 0, 1)[~white], f"colprof {inverse}"
        print(
            f"  scanned → device, {name:<20} {apart(cut, device[~white])}; ΔE00 {off(shown(cut), scan[~white])}",
            flush=True,
        )


def folds(x: Array) -> NDArray[np.intp]:
    """(n,) the fold of each row; repeats share theirs."""
    group = np.unique(x, axis=0, return_inverse=True)[1].ravel()
    return np.asarray(np.random.default_rng(1).permutation(group.max() + 1)[group] % FOLDS)


def kept_out(x: Array, y: Array, variance: float, exact: bool) -> Array:
    """(n, 3) each row of `y` foretold from the rows of other folds."""
    fold = folds(x)
    out = np.empty_like(y)
    for number in range(FOLDS):
        known = fold != number
        ready = splines.merge_close_rows(x[known], y[known], np.full(int(known.sum()), variance))
        if exact:
            made = splines.exact(ready.x, ready.y)
        else:
            made = splines.smooth(ready.x, ready.y, ready.variances, ("r3", "r5"), 2)
        out[~known] = made(x[~known])
    return out


def rows(path: Path, columns: int) -> Array:
    """(n, columns) the numbers at the end of each row of data of a CGATS file."""
    data = path.read_text().partition("BEGIN_DATA\n")[2].partition("END_DATA")[0]
    return np.array([[float(cell) for cell in line.split()[-columns:]] for line in data.strip().splitlines()])


def speed(printer: Printer) -> None:
    """Milliseconds a megapixel (of the processor, best of 9) of a page of handwriting, in this run."""
    table = build(fit(scanned(printer, "0.25", np.random.default_rng(1))))
    raster = handwriting(table)
    page = flatten(raster)
    print("milliseconds of the processor for a megapixel of handwriting")
    took = {
        "apply, 6 % inked": best(lambda: apply(raster, table)),
        "LittleCMS, the same workload": best(little_cms(page)),
    }
    least = took["LittleCMS, the same workload"]
    for name, ms in took.items():
        print(f"  {name:<30}{ms:7.1f} ms/megapixel, {least / ms:.1f} times as fast as LittleCMS")


def handwriting(table: ColourTable) -> Raster:
    """A megapixel of lines of ink with soft edges."""
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(0)
    rough = gaussian_filter(rng.random((1000, 1000)), 3)
    cover = np.clip((rough - np.quantile(rough, 1 - SHARE)) * 400, 0, 1)
    ink = np.array([0.15, 0.18, 0.45]) + 0.1 * rng.random((1000, 1000, 3))
    return Raster(np.rint(np.dstack([ink, cover]) * 255).astype(np.uint8), 300)


def little_cms(page: NDArray[np.uint8]) -> Callable[[], object]:
    """8-bit RGB to L*a*b* in LittleCMS, which it turns into one table with tetrahedra, as a device link is."""
    from PIL import Image, ImageCms

    image = Image.fromarray(page)
    profiles = ImageCms.createProfile("sRGB"), ImageCms.createProfile("LAB")
    transform = ImageCms.buildTransform(*profiles, "RGB", "LAB")
    return lambda: ImageCms.applyTransform(image, transform)


def best(work: Callable[[], object]) -> float:
    """Milliseconds of the processor, the least of nine."""
    times = []
    for _ in range(9):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return 1e3 * min(times)
