"""Reads the scans of a chart: opens them, places their pages, samples the patches, and merges what repeats."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.colour.chart import Chart, ChartPage, whole
from handout.colour.ink_match import chart_contrast
from handout.colour.reading import picture_checks, print_checks
from handout.colour.reading.patch_means import Sampled, Shading, sample, shading_of
from handout.colour.reading.pen_field import Scribble, scribble_of
from handout.colour.reading.registration import ChartPlacement, place
from handout.colour.reading.scan_files import ChartScan, ScanFinding, ScanRefused, open_scans
from handout.summary import one_line
from handout.values import Array, readonly

_DIFFER = 2.5 / 255  # two scans of one page, or whites of two pages: more is another setting of the scanner
_PAPER = 0.08  # the same of the chart's paper and the handwriting's, which may be of different makes
_LEAST_ERROR = 0.02 / 255
_AGAIN = 4  # patches of one colour that tell how much they scatter
_WHITE = (255, 255, 255)


@dataclass(frozen=True, eq=False)
class SheetReading:
    """One scanned page.

    scan : Scan
        Its pixels, for pictures of it.
    placement : Placement
        Where the page lies.
    sampled : Sampled
        What was seen in each patch, and how even it was.
    shading : Shading
        The shading that was taken out.
    values : (n, 3), 0–1, patches in the order of the page without the shading.
    used : (n,) bool, patches that lie in the picture and are not spoilt.
    findings : what is wrong with this scan.
    scribble : what was written in its field with a pen; None if nothing was.
    """

    scan: ChartScan
    placement: ChartPlacement
    sampled: Sampled
    shading: Shading
    values: Array
    used: NDArray[np.bool_]
    findings: tuple[ScanFinding, ...]
    scribble: Scribble | None = None

    __repr__ = one_line

    @property
    def page(self) -> ChartPage:
        """The page that it is a scan of."""
        return self.placement.page


@dataclass(frozen=True, eq=False)
class ChartReading:
    """What the scans of a chart show.

    chart : Chart, or None if none was found.
    device : (n, 3) float 0–1: the different colours that were sent to the printer and could be read.
    scanned : (n, 3) float 0–1: what the scanner saw of them, free of shading, means of repeats and scans.
    deviation : (n,) float 0–1: standard error of these means, from colours that come again.
    findings : all that is wrong.
    sheets : the scans that a page was found in.
    """

    chart: Chart | None
    device: Array
    scanned: Array
    deviation: Array
    findings: tuple[ScanFinding, ...]
    sheets: tuple[SheetReading, ...] = field(repr=False, default=())

    __repr__ = one_line

    def __post_init__(self) -> None:
        object.__setattr__(self, "device", readonly(self.device, None, 3))
        object.__setattr__(self, "scanned", readonly(self.scanned, len(self.device), 3))
        object.__setattr__(self, "deviation", readonly(self.deviation, len(self.device)))

    @property
    def usable(self) -> bool:
        """Whether a calibration may be made of it: no finding refuses."""
        return not any(finding.severity == "refuse" for finding in self.findings)

    @property
    def scribble(self) -> Scribble | None:
        """What was written in the chart's field with a pen, on the first page that has something."""
        written = next((sheet.scribble for sheet in self.sheets if sheet.scribble is not None), None)
        return written and replace(written, contrast=chart_contrast(self.device, self.scanned))


def read_scans(
    scans: Iterable[Path | ChartScan], chart: Chart | None = None, paper: Sequence[float] | None = None
) -> ChartReading:
    """Read scans of a chart: one or several of each of its pages, at any angle, of any resolution from 50 to 1200 dpi.

    scans : files (TIFF, PNG, JPEG), or pictures in memory; all pages of a file count.
    chart : the one that was printed; None: the marks say which.
    paper : (3,) float 0–1, optional: the paper in the scan of the handwriting, as its scanner shows it: tells whether
        the settings are the same.

    Returns a reading, also of bad scans, with what could be read of them; `usable` is False then, and `findings` say
    why.
    Raises InputError: a file cannot be opened, or no scan was given.
    """
    findings: list[ScanFinding] = []
    sheets = []
    for scan in _open_all(scans, findings):
        findings += scan.findings
        try:
            placement = place(scan, chart)
        except ScanRefused as error:
            findings.append(error.finding)
            continue
        chart = chart or whole(placement.page)
        sheets.append(_sheet_reading(scan, placement))
        findings += sheets[-1].findings
    if not sheets or chart is None:
        if not findings:
            findings.append(
                ScanFinding("no-scan", "refuse", "No scan was given: print the chart, scan it, and give the file.")
            )
        return ChartReading(chart, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), tuple(findings))
    findings += _compare_sheets(sheets, chart)
    device, scanned, deviation = _merge_means(sheets)
    if len(device) > 200 and not any(finding.code == "grey" for finding in findings):
        findings += print_checks.check_printer(device, scanned, deviation)
    findings += _paper_findings(device, scanned, paper)
    return ChartReading(chart, device, scanned, deviation, tuple(findings), tuple(sheets))


def _open_all(scans: Iterable[Path | ChartScan], findings: list[ScanFinding]) -> Iterable[ChartScan]:
    for item in scans:
        if isinstance(item, ChartScan):
            yield item
            continue
        try:
            yield from open_scans(item)
        except ScanRefused as error:
            findings.append(error.finding)


def _sheet_reading(scan: ChartScan, placement: ChartPlacement) -> SheetReading:
    page = placement.page
    sampled = sample(scan.pixels, placement)
    middles = (page.boxes[:, :2] + page.boxes[:, 2:]) / 2
    shading = shading_of(sampled.values, page.device, middles, sampled.inside)
    values = sampled.values / shading.factors_at(middles)
    sheet = print_checks.ReadPage(scan, placement, sampled, values, shading)
    findings = [*picture_checks.check_picture(sheet), *print_checks.check_tones(sheet)]
    bad = ~sampled.inside
    # a grey scan, or one of a few patches, has no colours to compare others with
    if sampled.inside.sum() > 200 and not any(finding.code == "grey" for finding in (*scan.findings, *findings)):
        ideal = print_checks.ideal_of(page.device, values, sampled.inside)
        stripes = print_checks.check_stripes(sheet, ideal)
        grainy = bool(stripes) or any(finding.code == "jpeg" for finding in (*scan.findings, *findings))
        spoilt, blemishes = print_checks.spoilt_patches(sheet, ideal, grainy)
        findings += [*stripes, *blemishes]
        bad = bad | spoilt
    findings = picture_checks.with_resolution(placement, scan.source, findings)
    white = sheet.find_patches(255, 255, 255)
    scribble = scribble_of(scan, placement, values[white].mean(axis=0), shading) if white.any() else None
    return SheetReading(scan, placement, sampled, shading, values, ~bad, tuple(findings), scribble)


def _compare_sheets(sheets: Sequence[SheetReading], chart: Chart) -> list[ScanFinding]:
    """Findings about all scans together: pages that are missing, scans made with different settings."""
    findings = []
    pages = {sheet.page.number for sheet in sheets}
    if missing := sorted(set(range(1, len(chart.pages) + 1)) - pages):
        sentence = (
            f"Page {missing[0]} of the chart's {len(chart.pages)} pages is missing: scan it too, and give both scans."
        )
        findings.append(ScanFinding("page-missing", "refuse", sentence))
    for first, second in itertools.pairwise(sheets):
        if first.page is second.page:
            both = first.used & second.used
            off = np.median(np.abs(first.values - second.values)[both], axis=0) if both.any() else np.zeros(3)
        else:
            first_whites, second_whites = (s.values[s.used & (s.page.device == 1).all(axis=1)] for s in (first, second))
            comparable = len(first_whites) > 0 and len(second_whites) > 0
            off = (
                np.abs(np.median(first_whites, axis=0) - np.median(second_whites, axis=0))
                if comparable
                else np.zeros(3)
            )
        if (worst := float(np.max(off))) > _DIFFER:
            sentence = (
                f"{first.scan.source} and {second.scan.source} differ by {worst * 255:.1f} of 255 throughout: the "
                "scanner's settings changed between them, or are automatic. Switch automatic exposure and "
                "colour off, and scan all pages again."
            )
            findings.append(ScanFinding("settings-differ", "refuse", sentence, second.scan.source))
    return findings


def _merge_means(sheets: Sequence[SheetReading]) -> tuple[Array, Array, Array]:
    """Device colours (n, 3), their scanned means over all sheets (n, 3), and the standard error of these (n,)."""
    pages: dict[int, list[SheetReading]] = {}
    for sheet in sheets:
        pages.setdefault(sheet.page.number, []).append(sheet)
    device, values = [], []
    for same in pages.values():
        used = np.array([sheet.used for sheet in same])
        count = used.sum(axis=0)
        total = np.array([sheet.values * sheet.used[:, None] for sheet in same]).sum(axis=0)
        device.append(same[0].page.device[count > 0])
        values.append(total[count > 0] / count[count > 0, None])
    return _means_by_colour(np.vstack(device), np.vstack(values))


def _means_by_colour(device: Array, values: Array) -> tuple[Array, Array, Array]:
    colours, group = np.unique(device, axis=0, return_inverse=True)
    group = group.ravel()
    count = np.bincount(group, minlength=len(colours))
    sums = np.column_stack([np.bincount(group, values[:, k], len(colours)) for k in range(3)])
    mean = np.asarray(sums / np.maximum(count, 1)[:, None], dtype=np.float64)
    square = np.square(values - mean[group]).mean(axis=1)
    often = count >= _AGAIN
    # a colour that is repeated has its own scatter; any other has that of repeated colours as light as it is
    scatter = np.sqrt(np.bincount(group, square, len(colours))[often] / (count[often] - 1))
    if not len(scatter):
        return colours, mean, np.full(len(colours), _LEAST_ERROR)
    light = mean.mean(axis=1)
    order = light[often].argsort()
    usual = np.interp(light, light[often][order], scatter[order])
    usual = np.maximum(usual, np.median(scatter))
    usual[often] = scatter
    return colours, mean, np.asarray(np.maximum(usual / np.sqrt(count), _LEAST_ERROR))


def _paper_findings(device: Array, scanned: Array, paper: Sequence[float] | None) -> list[ScanFinding]:
    white = (np.rint(device * 255) == _WHITE).all(axis=1)
    if paper is None or not white.any():
        return []
    off = scanned[white].mean(axis=0) - np.asarray(paper, dtype=np.float64)
    worst = int(np.abs(off).argmax())
    if abs(off[worst]) <= _PAPER:
        return []
    sentence = (
        f"The chart's paper is {abs(off[worst]):.0%} "
        f"{'lighter' if off[worst] > 0 else 'darker'} in {('red', 'green', 'blue')[worst]} than that of the "
        "handwriting: unless the papers are that different, the scans were made with different "
        "settings. Scan both alike."
    )
    return [ScanFinding("settings-differ", "warn", sentence)]
