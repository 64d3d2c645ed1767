"""What is wrong with the print of a chart: lost tones, spoilt patches, a printer that prints badly or interferes.

Add a check of the tones of one page in `check_tones`.  Add a check of the printer, in all colours that were read: a
function of device colours (n, 3), what was read of them (n, 3) and its standard error (n,), called in `check_printer`.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout import units
from handout.colour.reading.patch_means import BLOCKS, Shading
from handout.colour.reading.picture_checks import SampledPage
from handout.colour.reading.scan_files import MOST_NAMED, ScanFinding
from handout.libraries import spatial
from handout.values import Array


@dataclass(frozen=True)
class PageBounds:
    """What a page may show before it is called faulty."""

    clipped: float = 0.05  # share of the pixels of white or black patches that lie at an end of the scale: warned of
    lost: float = 0.5  # the same: refused
    # where grey 128 lies between black and white on printers and scanners without corrections
    tone: tuple[float, float] = (0.18, 0.55)
    shaded: float = 0.04  # by how much the factor of shading differs over the page: warned of
    dark: float = 0.35  # the same: refused
    step: float = 1.0 / 255  # a level of 8 bits
    stripe: float = 1.2 / 255  # least stripe that is a fault: a little more than a level
    odd: float = 0.25  # share of a patch that dust covers
    odd_many: float = 0.1  # share of the page's patches: so many odd ones are the grain of the print, not dust
    far: float = 18.0 / 255  # least distance of a spoilt patch from what its colour should be; a real printer has 13
    again_far: float = 5.0 / 255  # the same for colours that come again
    around_far: float = 7.0 / 255  # the same for the mean of 3 × 3 patches
    edge_far: float = 5.0 / 255  # the same beside spoilt patches
    reach: int = 4  # patches from a spoilt one that count as beside it
    many: float = 0.05  # of the patches: with more of them spoilt it is another print


BOUNDS = PageBounds()


@dataclass(frozen=True, eq=False)
class ReadPage(SampledPage):
    """A page as it was read: its patches (n, 3) after the shading was taken out, and that shading."""

    values: Array
    shading: Shading

    def find_patches(self, *colour: int) -> NDArray[np.bool_]:
        """(n,) bool: patches of a device colour, 0–255, that lie in the picture."""
        same = np.rint(self.page.device * 255).astype(int) == np.array(colour)
        return np.asarray(same.all(axis=1) & self.sampled.inside)


def check_tones(sheet: ReadPage) -> list[ScanFinding]:
    """Clipping, shading and a wrong gamma."""
    white, black = sheet.find_patches(255, 255, 255), sheet.find_patches(0, 0, 0)
    if not (white.any() and black.any()):
        return []
    high = float(sheet.sampled.high[white].mean(axis=0).max())
    low = float(sheet.sampled.low[black].mean(axis=0).max())
    if min(high, low) > BOUNDS.clipped:
        sentence = (
            f"Light and dark tones both reach the ends of the scale ({high:.0%} and {low:.0%} of the pixels of white "
            "and black patches): the scanner stretches contrast or colour by itself. Switch everything automatic "
            "off, and scan the chart with the settings of the handwriting's scan."
        )
        return [ScanFinding("automatic", "refuse", sentence, sheet.source)]
    findings = []
    for code, name, share in (("clipped-whites", "lightest", high), ("clipped-blacks", "darkest", low)):
        if share > BOUNDS.clipped:
            severity: Any = "refuse" if share > BOUNDS.lost else "warn"
            sentence = (
                f"The {name} tones are cut off ({share:.0%} of the pixels of {name} patches are at the end of the "
                "scale): lower the scanner's contrast, switch off automatic exposure, and scan the chart again."
            )
            findings.append(ScanFinding(code, severity, sentence, sheet.source))
    return findings + _check_gamma(sheet, white, black) + _check_shading(sheet)


def _check_gamma(sheet: ReadPage, white: NDArray[np.bool_], black: NDArray[np.bool_]) -> list[ScanFinding]:
    middle = sheet.find_patches(128, 128, 128)
    if not middle.any():
        return []
    light, dark, grey = (float(np.median(sheet.values[mask])) for mask in (white, black, middle))
    if light - dark < 0.2:
        sentence = (
            f"White and black differ by only {light - dark:.0%} of the scale: is the chart "
            "printed in black at all? Check the inks and the scanner's exposure."
        )
        return [ScanFinding("tone", "refuse", sentence, sheet.source)]
    place = (grey - dark) / (light - dark)
    if BOUNDS.tone[0] <= place <= BOUNDS.tone[1]:
        return []
    what = "dark" if place < BOUNDS.tone[0] else "light"
    sentence = (
        f"Middle greys are far too {what} (at {place:.0%} of the way from black to white): the "
        "scanner's gamma or an automatic correction is at work. Switch automatic colour, contrast and gamma off, "
        "and scan the chart with the settings of the handwriting's scan."
    )
    return [ScanFinding("tone", "warn", sentence, sheet.source)]


def _check_shading(sheet: ReadPage) -> list[ScanFinding]:
    middles = (sheet.page.boxes[:, :2] + sheet.page.boxes[:, 2:]) / 2
    factor = sheet.shading.factors_at(middles).mean(axis=1)
    range_ = float(np.ptp(factor)) if len(factor) else 0.0
    if range_ <= BOUNDS.shaded:
        return []
    severity: Any = "refuse" if range_ > BOUNDS.dark else "warn"
    done = "that is too much to take out" if severity == "refuse" else "it was taken out"
    low = middles[int(factor.argmin())] / (sheet.page.paper.width, sheet.page.paper.height)
    side = f"{('upper', 'lower')[int(low[1] > 0.5)]} {('left', 'right')[int(low[0] > 0.5)]}"
    sentence = (
        f"Light falls off by {range_:.0%} over the page, darkest at its {side}; {done}. "
        "Close the lid, keep daylight out, and let the scanner's lamp warm up."
    )
    return [ScanFinding("shading", severity, sentence, sheet.source)]


def spoilt_patches(sheet: ReadPage, ideal: Array, grainy: bool = False) -> tuple[NDArray[np.bool_], list[ScanFinding]]:
    """Find the patches that glare, folds or dust have spoilt: (n,) bool, and the findings about them.

    ideal : (n, 3), what patches of these colours look like on the rest of the page.
    grainy : whether stripes or a JPEG make patches uneven within: unevenness is not taken for dust then.
    """
    inside, odd = sheet.sampled.inside, sheet.sampled.odd
    dusty = inside & (odd > BOUNDS.odd) & (not grainy)
    if dusty.sum() > BOUNDS.odd_many * len(inside):
        return np.zeros_like(inside), [
            ScanFinding(
                "uneven",
                "refuse",
                f"{dusty.sum()} of {len(inside)} patches are uneven within: the page is crumpled, the print smeared or "
                "badly streaked. Print the chart again and lay it flat.",
                sheet.source,
            )
        ]
    off = sheet.values - ideal
    far, bright = _outliers(sheet, off)
    bad = inside & (far | (dusty & (odd > 2 * BOUNDS.odd)))
    if bad.sum() > BOUNDS.many * len(inside):
        what = "there is glare, or something" if bright[bad].mean() > 0.8 else "something"
        names = _names(sheet, bad)
        sentence = (
            f"{bad.sum()} of {len(inside)} patches look unlike their colour ({units.listed(names, MOST_NAMED)}): "
            f"{what} covers part of the chart, or it is another print. Clean the glass, lay the page flat and scan it "
            "again."
        )
        return bad, [ScanFinding("blemish", "refuse", sentence, sheet.source, names)]
    return bad, _blemishes(sheet, bad, dusty, bright)


def _outliers(sheet: ReadPage, off: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(n,) patches off their ideal by more than chance, alone or with their neighbours; (n,) which are too light."""
    inside = sheet.sampled.inside
    usual = 1.4826 * np.median(np.abs(off[inside]), axis=0)
    alone = (np.abs(off) > np.maximum(8 * usual, BOUNDS.far)).any(axis=1)
    near = _with_neighbours(sheet, np.where(inside[:, None], off, np.nan), np.nan)
    near[4] = np.where(np.isnan(near[4]), 0.0, near[4])
    around = np.nanmedian(near, axis=0)
    sigma = 1.4826 * np.median(np.abs(around[inside]), axis=0)
    together = (np.abs(around) > np.maximum(7 * sigma, BOUNDS.around_far)).any(axis=1) & (
        np.abs(off) > BOUNDS.step * 3
    ).any(axis=1)
    bad = (alone | together | _unlike_repeats(sheet)) & inside
    # what lies on one patch reaches into the next: beside bad ones less is enough
    doubtful = (np.abs(off) > np.maximum(4 * usual, BOUNDS.edge_far)).any(axis=1) & inside
    for _ in range(BOUNDS.reach):
        bad = bad | (doubtful & np.any(_with_neighbours(sheet, bad, False), axis=0))
    return bad, off.mean(axis=1) > 0


def _with_neighbours(sheet: ReadPage, values: NDArray[Any], beyond: float) -> NDArray[Any]:
    """(9, n, …) values (n, …) of each patch, in the middle, and its eight neighbours; `beyond` where the page ends."""
    grid = np.full((sheet.page.rows + 2, sheet.page.columns + 2, *values.shape[1:]), beyond, dtype=values.dtype)
    column, row = sheet.page.cells.T
    grid[row + 1, column + 1] = values
    return np.stack([grid[row + j, column + i] for j in range(3) for i in range(3)])


def _unlike_repeats(sheet: ReadPage) -> NDArray[np.bool_]:
    """Patches (n,) unlike others of the very same colour."""
    _, group = np.unique(sheet.page.device, axis=0, return_inverse=True)
    group = group.ravel()
    unlike = np.zeros(len(group), dtype=bool)
    for index in np.flatnonzero(np.bincount(group[sheet.sampled.inside]) >= 5):
        mine = np.flatnonzero((group == index) & sheet.sampled.inside)
        off = np.abs(sheet.values[mine] - np.median(sheet.values[mine], axis=0))
        unlike[mine] = (off > np.maximum(8 * 1.4826 * np.median(off, axis=0), BOUNDS.again_far)).any(axis=1)
    return unlike


def _blemishes(
    sheet: ReadPage, bad: NDArray[np.bool_], dusty: NDArray[np.bool_], bright: NDArray[np.bool_]
) -> list[ScanFinding]:
    findings = []
    kinds = (
        ("glare or a spot without ink", bad & bright, "they were left out"),
        ("a fold, a shadow or dirt", bad & ~bright, "they were left out"),
        ("dust or a scratch", dusty & ~bad, "what is unlike the rest of the patch was left out"),
    )
    for what, mask, done in kinds:
        if mask.any():
            names = _names(sheet, mask)
            noun = "patch" if len(names) == 1 else "patches"
            sentence = (
                f"There is {what} on {noun} {units.listed(names, MOST_NAMED)}; {done}. Clean the glass "
                "and the page, lay it flat, and scan it again."
            )
            findings.append(ScanFinding("blemish", "warn", sentence, sheet.source, names))
    return findings


def _names(sheet: ReadPage, mask: NDArray[np.bool_]) -> tuple[str, ...]:
    return tuple(itertools.compress(sheet.page.names, mask.tolist()))


def check_stripes(sheet: ReadPage, ideal: Array) -> list[ScanFinding]:
    """Banding: rows or columns of the page that are lighter or darker across all of it."""
    inked = sheet.sampled.inside & (ideal.mean(axis=1) < 0.8)
    if inked.sum() < 50:
        return []
    flat = sheet.values[inked, None, None] * sheet.sampled.blocks[inked]
    flat = flat / np.maximum(sheet.sampled.values[inked, None, None], 1e-3)
    off = (flat - ideal[inked, None, None]).mean(axis=-1)
    within = off - off.mean(axis=(1, 2), keepdims=True)
    for axis, name in ((1, "across"), (0, "down")):
        line = sheet.page.cells[inked, axis]
        # within patches fine bands, between rows of them coarse ones
        parts = within.mean(axis=2 if axis == 1 else 1)
        fine = np.zeros((int(line.max()) + 1, parts.shape[1]))
        for index in range(len(fine)):
            if (on_line := line == index).sum() >= 6:
                fine[index] = np.median(parts[on_line], axis=0)
        expected = float(within.std()) / np.sqrt(BLOCKS * max(1, np.bincount(line).max()))
        worst = float(np.abs(fine).max())
        if worst > max(BOUNDS.stripe, 8 * expected):
            at = int(np.abs(fine).max(axis=1).argmax())
            place = f"row {at + 1}" if axis == 1 else f"column {at + 1}"
            sentence = (
                f"The print is banded: stripes {name} the page, by up to {worst * 255:.1f} "
                f"of 255, most at {place}. A nozzle may be clogged: clean the print head, print a nozzle check, "
                "and print the chart again in the best quality."
            )
            return [ScanFinding("banding", "warn", sentence, sheet.source)]
    return []


def ideal_of(device: Array, values: Array, usable: NDArray[np.bool_]) -> Array:
    """(n, 3): what a smooth printer makes of device colours (n, 3): quartic polynomials, fitted so that outliers do not
    matter to those patches of which values (n, 3) are usable (n,).
    """
    powers = [e for e in itertools.product(range(5), repeat=3) if sum(e) <= 4]
    x = 2 * device - 1
    design = np.column_stack([np.prod(x ** np.array(e), axis=1) for e in powers])
    weight = usable.astype(np.float64)
    fitted = np.zeros_like(values)
    for _ in range(6):
        root = np.sqrt(weight)[:, None]
        fitted = design @ np.linalg.lstsq(design * root, values * root, rcond=None)[0]
        off = np.abs(values - fitted).max(axis=1)
        scale = max(1.4826 * float(np.median(off[usable])), 1e-4)
        weight = np.where(usable, np.clip(1 - (off / (6 * scale)) ** 2, 0, 1) ** 2, 0.0)
    return np.asarray(fitted)


@dataclass(frozen=True)
class PrinterBounds:
    """What a printer may show, in all colours that were read."""

    rank: float = 0.97  # a real inkjet (Canon PRO-1000 on an Epson V850) has 0.9996 and 0.002
    flat_steps: float = 0.12
    ink: float = 0.12  # least that a full ink darkens its own channel
    ramp: float = 3.0 / 255  # least error of a ramp that falls, and longest run of greys that look alike
    run: int = 40
    chance: float = 6.0  # standard errors of a grey that are no fault
    alike: float = 0.5 / 255  # scans that are the same, of colours that are not
    unlike: float = 20.0 / 255


PRINTER_BOUNDS = PrinterBounds()


def _check_rank(device: Array, scanned: Array, _: Array) -> list[ScanFinding]:
    """Whether more of a channel always gives more of it."""
    levels = np.rint(np.linspace(0, 255, 8)) / 255
    cube = np.full((8, 8, 8, 3), np.nan)
    place = np.abs(device[:, :, None] - levels).argmin(axis=2)
    exact = (np.abs(levels[place] - device) < 1e-6).all(axis=1)
    cube[tuple(place[exact].T)] = scanned[exact]
    ranks, flats = [], []
    for channel in range(3):
        lines = np.moveaxis(cube[..., channel], channel, -1).reshape(-1, 8)
        lines = lines[np.isfinite(lines).all(axis=1)]
        if len(lines) < 8:
            return []
        order = lines.argsort(axis=1).argsort(axis=1)
        ranks.append(float((1 - 6 * ((order - np.arange(8)) ** 2).sum(axis=1) / (8 * 63)).mean()))
        flats.append(float((np.diff(lines, axis=1) < BOUNDS.step).mean()))
    worst = int(np.argmin(ranks))
    if min(ranks) >= PRINTER_BOUNDS.rank and max(flats) <= PRINTER_BOUNDS.flat_steps:
        return []
    sentence = (
        f"What was printed does not follow what was sent (rank correlation "
        f"{min(ranks):.2f} in {('red', 'green', 'blue')[worst]}, {max(flats):.0%} of the steps without effect): "
        "the printer's driver manages colours, or this is not the print of the chart. Switch colour management and "
        "all enhancements off in the print dialogue, and print the chart again."
    )
    return [ScanFinding("managed", "refuse", sentence)]


def _check_ramps(device: Array, scanned: Array, deviation: Array) -> list[ScanFinding]:
    findings = []
    for channel, ink in enumerate(("cyan", "magenta", "yellow")):
        others = [k for k in range(3) if k != channel]
        alone = (device[:, others] == 1).all(axis=1)
        ramp = scanned[alone][device[alone, channel].argsort(), channel]
        if len(ramp) > 2 and ramp[-1] - ramp[0] < PRINTER_BOUNDS.ink:
            sentence = (
                f"The ramp of {ink} is flat ({ramp[-1] - ramp[0]:.0%} of the scale "
                "from paper to full ink): a nozzle is clogged or the cartridge is empty. Print a nozzle check, "
                "clean the head, and print the chart again."
            )
            findings.append(ScanFinding("clogged", "refuse", sentence))
    neutral = np.ptp(device, axis=1) == 0
    order = device[neutral, 0].argsort()
    grey, level = scanned[neutral].mean(axis=1)[order], np.rint(device[neutral, 0][order] * 255)
    if len(grey) < 32:
        return findings
    # the greatest of many errors, and both of the greys have one
    chance = PRINTER_BOUNDS.chance * deviation[neutral][order]
    fall = np.maximum(np.maximum.accumulate(grey) - grey - chance, 0.0)
    if float(fall.max()) > PRINTER_BOUNDS.ramp:
        sentence = (
            f"The greys do not get lighter steadily (by up to {fall.max() * 255:.1f} of 255 "
            f"wrong, at grey {level[int(fall.argmax())]:.0f}): the print is banded, or the paper takes the ink "
            "unevenly. Print the chart again in the best quality."
        )
        findings.append(ScanFinding("ramp", "warn", sentence))
    run, at = _longest_run(grey, level)
    if run >= PRINTER_BOUNDS.run:
        sentence = (
            f"Greys {at:.0f} to {at + run:.0f} look alike: the printer's or the scanner's "
            "driver cuts tones off. Switch its corrections off, and choose the paper that is in the printer."
        )
        findings.append(ScanFinding("ramp", "warn", sentence))
    return findings


def _longest_run(grey: Array, level: Array) -> tuple[float, float]:
    """The widest range of device greys that differ by less than a step and a half, and where it begins."""
    smooth = np.convolve(np.pad(grey, 3, mode="edge"), np.ones(7) / 7, mode="valid")
    best, at, start = 0.0, 0.0, 0
    for end in range(len(smooth)):
        while smooth[end] - smooth[start] > 1.5 * BOUNDS.step:
            start += 1
        if level[end] - level[start] > best:
            best, at = float(level[end] - level[start]), float(level[start])
    return best, at


def _check_twins(device: Array, scanned: Array, _: Array) -> list[ScanFinding]:
    """Different colours that look the same: no table can tell them apart again."""
    pairs = spatial.cKDTree(scanned).query_pairs(PRINTER_BOUNDS.alike, output_type="ndarray")
    pairs = pairs[np.abs(device[pairs[:, 0]] - device[pairs[:, 1]]).max(axis=1) > PRINTER_BOUNDS.unlike]
    if not len(pairs):
        return []
    share = len(np.unique(pairs)) / len(device)
    severity: Any = "refuse" if share > BOUNDS.many else "warn"
    shown = "; ".join(
        " and ".join(",".join(f"{v * 255:.0f}" for v in device[i]) for i in pair) for pair in pairs[:3].tolist()
    )
    sentence = (
        f"{len(pairs)} pairs of different colours look the same on paper (RGB {shown}"
        f"{' …' if len(pairs) > 3 else ''}): the driver cuts colours off, or the scan is too coarse. Switch colour "
        "management off and choose the right paper."
    )
    return [ScanFinding("identical", severity, sentence)]


def check_printer(device: Array, scanned: Array, deviation: Array) -> list[ScanFinding]:
    """All findings about the printer, from all colours: device (n, 3), read (n, 3) and its standard error (n,)."""
    checks = _check_rank, _check_ramps, _check_twins
    return [finding for check in checks for finding in check(device, scanned, deviation)]
