"""Checks of a scan as a picture: where the page lies in it, its size, its file format, its tones.

Add a check: a function of a `SampledPage` that gives findings, called in `check_picture`.  Faults of the print, which
show in the patches, are checked in `print_checks`; the amount of ink in `calibrating.print_diagnosis`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout import units
from handout.colour.chart import MARKS, ChartPage
from handout.colour.reading.patch_means import Sampled
from handout.colour.reading.registration import ChartPlacement
from handout.colour.reading.scan_files import GREY, MOST_NAMED, ChartScan, ScanFinding, Severity

LEAST_PIXELS = 10.0  # a patch's side


@dataclass(frozen=True)
class PictureBounds:
    """What a scan may be as a picture before it is warned of or refused."""

    size_error: float = 0.01  # share by which scanners and printers may be off
    # of the printed size against the true one; outside, the file's dpi is of something else
    plausible_scale: tuple[float, float] = (0.75, 1.35)
    warp: float = 0.5  # mm by which the page is bent: warned of
    worst_warp: float = 6.0  # mm: refused
    position_doubt: float = 3.5  # mm by which parts of the page contradict each other: refused
    grey_difference: float = 1.5 / 255  # between channels of any patch: colour scans of a chart differ by far more
    # dpi under which single marks are hard to read, and the edge of a patch looks like dust on it
    coarse_dpi: float = 78.0
    too_coarse_dpi: float = 62.0  # under which that may happen to any of them
    block_window: int = 2400  # pixels a side, in which blocks are looked for
    blockiness: float = 1.5  # scans that never were a JPEG have 1.0 to 1.15, others 1.4 to 3
    missing_tones: float = 0.04  # scans have 0 to 0.02; a gamma laid on 8 bits leaves 0.08


BOUNDS = PictureBounds()


@dataclass(frozen=True, eq=False)
class SampledPage:
    """A page in a scan: the picture, where the page lies in it, and what was sampled of each patch."""

    scan: ChartScan
    placement: ChartPlacement
    sampled: Sampled

    @property
    def page(self) -> ChartPage:
        """The page of the chart."""
        return self.placement.page

    @property
    def source(self) -> str:
        """What the scan is called in messages."""
        return self.scan.source


def of_place(scanned: SampledPage) -> list[ScanFinding]:
    """Findings about where and how the page lies."""
    placement, source = scanned.placement, scanned.source
    findings = []
    side = placement.page.pitch / placement.pixel
    if side < LEAST_PIXELS:
        wanted = LEAST_PIXELS * placement.dpi / side
        sentence = (
            f"A patch has only {side:.1f} pixels a side ({placement.dpi:.0f} dpi), and needs {LEAST_PIXELS:.0f} "
            f"({wanted:.0f} dpi): scan at 300 dpi."
        )
        findings.append(ScanFinding("low-dpi", "refuse", sentence, source))
    if placement.mirrored:
        sentence = (
            "The scan is mirrored; it was read all the same. Switch mirroring off in the scanner's program, or the "
            "handwriting will be read mirrored too."
        )
        findings.append(ScanFinding("mirrored", "warn", sentence, source))
    findings += _wrong_sizes(placement, source)
    if placement.warp > BOUNDS.worst_warp or placement.doubt > BOUNDS.position_doubt:
        sentence = (
            f"The page is bent or seen aslant by up to {placement.warp:.1f} mm, and parts of it by "
            f"{placement.doubt:.1f} mm against the others, so that patches cannot be found safely: press it flat on "
            "the scanner's glass, do not photograph it."
        )
        findings.append(ScanFinding("warped", "refuse", sentence, source))
    elif placement.warp > BOUNDS.warp:
        sentence = (
            f"The page is bent by up to {placement.warp:.1f} mm; the patches were found all the same. Press it flat "
            "under a closed lid: paper that does not touch the glass is scanned darker."
        )
        findings.append(ScanFinding("warped", "warn", sentence, source))
    return findings


def _wrong_sizes(placement: ChartPlacement, source: str) -> Iterator[ScanFinding]:
    """Warnings about the size of the printed page."""
    if placement.stretch > 1 + BOUNDS.size_error:
        sentence = (
            f"The page is {placement.stretch - 1:.1%} longer in one direction than in the other: print it at its true "
            "size and scan it with the same resolution both ways."
        )
        yield ScanFinding("stretched", "warn", sentence, source)
    if placement.scale is None:
        return
    mean = sum(placement.scale) / 2
    if not BOUNDS.plausible_scale[0] < mean < BOUNDS.plausible_scale[1]:
        sentence = (
            f"The file says a resolution at which the page would be {mean:.0%} of its size, so that it is not that of "
            "the scan: save scans from the scanner's own program."
        )
        yield ScanFinding("no-dpi", "warn", sentence, source)
    elif abs(mean - 1) > BOUNDS.size_error:
        sentence = (
            f"The page is printed at {mean:.1%} of its size: print it at 100 %, without 'fit to page' or 'borderless'; "
            "letters would be printed in the wrong size too."
        )
        yield ScanFinding("scaled", "warn", sentence, source)


def with_resolution(placement: ChartPlacement, source: str, findings: list[ScanFinding]) -> list[ScanFinding]:
    """The findings about a scan, with a low resolution named as the cause of those that it can explain.

    A scan of few pixels hides marks and makes the edges of patches look like dust or stripes: such findings are
    replaced by one about the resolution.  So few that any mark may be lost are named in any case.
    """
    effects = [finding for finding in findings if finding.code in ("marks-hidden", "blemish", "uneven", "banding")]
    if placement.dpi >= BOUNDS.too_coarse_dpi and (placement.dpi >= BOUNDS.coarse_dpi or not effects):
        return findings
    others = [finding for finding in findings if finding not in effects]
    if any(finding.code == "low-dpi" for finding in others):
        return others
    severity: Severity = "refuse" if any(finding.severity == "refuse" for finding in effects) else "warn"
    sentence = (
        f"The scan has only {placement.dpi:.0f} dpi, too few to read all marks safely and to tell dust from the edges "
        "of patches: scan at 300 dpi."
    )
    return [*others, ScanFinding("low-dpi", severity, sentence, source)]


def of_marks(scanned: SampledPage) -> list[ScanFinding]:
    """Findings about patches and marks that are cut off or covered."""
    scan, placement, sampled = scanned.scan, scanned.placement, scanned.sampled
    page, source = scanned.page, scanned.source
    names = np.array(page.names)
    missing = names[~sampled.inside]
    findings = []
    if len(missing):
        sentence = (
            f"The {_cut_edges(page, sampled.inside)} of the chart is cut off, and with it {len(missing)} of "
            f"{units.count(len(names), 'patch', 'patches')} ({units.listed(missing, MOST_NAMED)}): lay the page so "
            "that all of it is scanned."
        )
        findings.append(ScanFinding("cropped", "refuse", sentence, source, tuple(missing.tolist())))
    height, width = scan.pixels.shape[:2]
    hidden = [i for i in range(MARKS) if i not in placement.mark_indices]
    middles = placement.pixels(page.marks[hidden].mean(axis=1)) if hidden else np.zeros((0, 2))
    visible = ((middles > 0) & (middles < (width, height))).all(axis=1)
    if visible.any():
        sentence = (
            f"{int(visible.sum())} of the chart's {MARKS} marks cannot be read "
            "though they should be in the picture: something covers them, or they are badly printed."
        )
        findings.append(ScanFinding("marks-hidden", "warn", sentence, source))
    return findings


def _cut_edges(page: ChartPage, inside: NDArray[np.bool_]) -> str:
    """Which edges of the page are cut off: those along which most patches are missing."""
    column, row = page.cells.T
    at = {
        "upper edge": row == 0,
        "right edge": column == page.columns - 1,
        "lower edge": row == page.rows - 1,
        "left edge": column == 0,
    }
    share = {name: float((~inside[mask]).mean()) for name, mask in at.items()}
    most = [name for name, part in share.items() if part > 0.5] or [max(share, key=lambda name: share[name])]
    return " and ".join(most)


def of_pixels(scanned: SampledPage) -> list[ScanFinding]:
    """Findings about how the picture was taken and stored."""
    scan, sampled = scanned.scan, scanned.sampled
    codes = {finding.code for finding in scan.findings}
    findings = []
    blocks = sampled.blocks[sampled.inside]
    if sampled.distinct <= 4:
        sentence = (
            "The scan holds black and white only: choose colour (24 or 48 bits) in the scanner's program, not text or "
            "line art."
        )
        findings.append(ScanFinding("grey", "refuse", sentence, scan.source))
    elif "grey" not in codes and len(blocks) and float(np.ptp(blocks, axis=-1).max()) < BOUNDS.grey_difference:
        findings.append(ScanFinding("grey", "refuse", GREY, scan.source))
    if scan.full == 255:
        if not scan.jpeg and (strength := blockiness(scan.pixels)) > BOUNDS.blockiness:
            sentence = (
                "The picture was a JPEG before it was saved as it is (blocks of 8 "
                f"pixels stand out by {strength - 1:.0%}): let the scanner save the scan as TIFF or PNG."
            )
            findings.append(ScanFinding("jpeg", "warn", sentence, scan.source))
        if (holes := _holes(scan.pixels)) > BOUNDS.missing_tones and sampled.distinct > 64:
            sentence = (
                f"{holes:.0%} of the tones between dark and light do not occur: the "
                "scan was changed after it was taken (gamma, contrast or colour). Switch all corrections off, and "
                "scan the chart just as the handwriting."
            )
            findings.append(ScanFinding("edited", "warn", sentence, scan.source))
    return findings


def blockiness(pixels: NDArray[np.uint8]) -> float:
    """How much more neighbours differ at the edges of 8 × 8 blocks than elsewhere; about 1 if nothing was a JPEG."""
    # the middle of a large picture tells as much as all of it; it begins where a block does
    top, left = (max(0, size - BOUNDS.block_window) // 16 * 8 for size in pixels.shape[:2])
    grey = pixels[top : top + BOUNDS.block_window, left : left + BOUNDS.block_window, 1].astype(np.int16)
    worst = 1.0
    for axis in (0, 1):
        # large steps are edges of patches, which fall anywhere
        step = np.abs(np.diff(grey, axis=axis))
        small = np.where(step <= 8, step, 0)
        profile = small.mean(axis=1 - axis)
        phases = np.array([profile[k::8].mean() for k in range(8)])
        worst = max(worst, float(phases.max() / max(float(np.median(phases)), 0.02)))
    return worst


def _holes(pixels: NDArray[np.uint8]) -> float:
    """Share of the levels between the 2nd and 98th percentile that hardly occur, compared with those near them."""
    counts = np.bincount(pixels[::3, ::3, 1].ravel(), minlength=256).astype(np.float64)
    total = np.cumsum(counts) / counts.sum()
    low, high = int(np.searchsorted(total, 0.02)), int(np.searchsorted(total, 0.98))
    inner = counts[max(low, 1) : min(high, 254) + 1]
    if len(inner) < 64:
        return 0.0
    around = np.convolve(counts, np.ones(17) / 17, mode="same")[max(low, 1) : min(high, 254) + 1]
    return float((inner < 0.01 * around).mean())


def check_picture(scanned: SampledPage) -> list[ScanFinding]:
    """All findings about a scan as a picture."""
    return [*of_place(scanned), *of_marks(scanned), *of_pixels(scanned)]
