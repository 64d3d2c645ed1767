"""What a scanned verification strip says of a calibration: ΔE00 with it and without it, in words and in pictures."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout import atomic
from handout.calibrating import pen_reference, store
from handout.calibrating.store import Calibration
from handout.calibrating.strip import FIRST_MARK, VerificationStrip, from_facts, last_strip
from handout.colour import conversions
from handout.colour.chart import MARKS, ChartPage
from handout.colour.ink_match import match
from handout.colour.reading import ChartScan, ScanFinding, open_scans
from handout.colour.reading.patch_means import sample
from handout.colour.reading.pen_field import scribble_of
from handout.colour.reading.picture_checks import SampledPage, check_picture
from handout.colour.reading.registration import ChartPlacement, place
from handout.colour.reading.scan_files import ScanRefused, make_refusal
from handout.colour.report import image, page
from handout.colour.table import ColourTable, reach, swatches, tell_loss
from handout.errors import InputError
from handout.libraries import spatial
from handout.values import Array

# ΔE00 on the mean up to which the colours of a strip, all of which the printer can print, are judged so
_VERDICTS = (
    (1.0, "Colours that this printer can print come out right: the eye sees no difference."),
    (2.0, "Colours that this printer can print come out nearly right: a difference is seen only side by side."),
    (
        4.0,
        "Colours that this printer can print come out roughly right: differences can be seen. Scan the chart again, or "
        "print it in better quality.",
    ),
)
_POOR = (
    "Even colours that this printer can print come out wrong: what was printed is not what was calibrated. Check that "
    "printer, paper, quality and the scanner's settings are those of the chart, and begin again with a new chart."
)
_NO_HELP = "The calibration makes nothing better here: print with --calibration none, or begin again with a new chart."
_SAME_PEN = 2.0  # ΔE00 of a pen's lines; some words written with more pressure differ by 1
_SAME_PAPER = 4.0  # ΔE00 of the bare paper against the chart's
_OTHER_STRIP = 0.8  # correlation of what is seen with what the calibration foresees


@dataclass(frozen=True)
class Difference:
    """ΔE00 between wanted and scanned colours: mean, median, 95th percentile and greatest; count of colours."""

    mean: float
    median: float
    p95: float
    worst: float
    count: int


@dataclass(frozen=True)
class Verification:
    """What a strip showed.

    date : when it was read.
    before, after : of all colours, sent as they are and sent through the table.
    ink_before, ink_after, grey_before, grey_after : of the ink and of the greys alone.
    out : share of a page's ink that the printer cannot reach; lost : ΔE00 there, on the mean; whose : ink it is.
    verdict : all this in words.
    findings : what was not as it should be with the scan.
    """

    date: str
    before: Difference
    after: Difference
    ink_before: Difference
    ink_after: Difference
    grey_before: Difference
    grey_after: Difference
    out: float
    lost: float
    verdict: str
    findings: tuple[str, ...] = ()
    whose: str = ""

    @property
    def helps(self) -> bool:
        """Whether pages look more as wanted with the calibration than without."""
        return self.after.mean < self.before.mean

    def facts(self) -> dict[str, Any]:
        """Everything, as JSON takes it."""
        return asdict(self)

    def lines(self) -> list[str]:
        """A table for people, and the verdict."""
        return table_lines(self.facts())


def table_lines(facts: Mapping[str, Any]) -> list[str]:
    """The lines of a verification that `Verification.facts` gave."""
    head = f"{'ΔE00':<8}{'without':>9}{'p95':>7}{'with':>9}{'p95':>7}{'worst':>7}"
    rows = [
        f"{name:<8}{b['mean']:>9.2f}{b['p95']:>7.2f}{a['mean']:>9.2f}{a['p95']:>7.2f}{a['worst']:>7.2f}"
        for name, b, a in (
            ("ink", facts["ink_before"], facts["ink_after"]),
            ("greys", facts["grey_before"], facts["grey_after"]),
            ("all", facts["before"], facts["after"]),
        )
    ]
    reach = tell_loss(facts["out"], facts["lost"], facts.get("whose", ""))
    return [head, *rows, facts["verdict"], reach]


def verify(calibration: Calibration, scans: Sequence[Path | ChartScan]) -> Verification:
    """Read the scan of the last strip of a calibration and keep what it says.

    Raises ScanRefused: not the strip, or not all of it. InputError: a file that cannot be read, or no strip was
    printed.
    """
    strip = last_strip(calibration)
    opened = [scan for item in scans for scan in ([item] if isinstance(item, ChartScan) else open_scans(item))]
    if len(opened) != 1:
        raise InputError(f"The verification strip is one page, and {len(opened)} were given: give its scan alone.")
    scanned, findings = _read_patches(opened[0], strip, calibration)
    verified = _build_verification(strip, scanned, findings)
    calibration.keep(store.STRIP, {**strip.facts(), "seen": scanned.round(6).tolist()})
    calibration.keep(store.VERIFICATION, verified.facts())
    return verified


def _read_patches(
    scan: ChartScan, strip: VerificationStrip, calibration: Calibration
) -> tuple[Array, list[ScanFinding]]:
    """(n, 3) what the scanner saw of each patch."""

    def page_of(number: int) -> ChartPage | None:
        return strip.page if FIRST_MARK <= number < FIRST_MARK + MARKS else None

    try:
        placement = place(scan, page_of=page_of)
    except ScanRefused as error:
        if error.finding.code != "another-chart":
            raise
        raise make_refusal("another-chart", "This is no scan of a verification strip, but of another page with marks: "
            "scan the strip.", scan.source) from error  # fmt: skip
    sampled = sample(scan.pixels, placement)
    findings = [
        *scan.findings,
        *check_picture(SampledPage(scan, placement, sampled)),
        *_check_colours(strip, sampled.values, calibration, scan.source),
        *_check_pen(strip, scan, placement, sampled.values, calibration),
    ]
    # few colours make few tones; the chart's scan was judged by that already
    findings = [finding for finding in findings if finding.code != "edited"]
    for finding in findings:
        if finding.severity == "refuse":
            raise make_refusal(finding.code, finding.sentence, scan.source)
    return sampled.values, findings


def _check_colours(
    strip: VerificationStrip, scanned: Array, calibration: Calibration, source: str
) -> list[ScanFinding]:
    """A finding if these are not the colours, or is not the paper, that the strip was made for."""
    from handout.colour.models.forward import look_up

    table = calibration.table()
    foreseen = look_up(table.scanned, strip.device)
    ranks = [float(np.corrcoef(scanned[:, k], foreseen[:, k])[0, 1]) for k in range(3)]
    if not min(ranks) > _OTHER_STRIP:
        return [ScanFinding("another-strip", "refuse", "The colours are not those of the strip that was printed last "
            f"for {calibration.name}: scan that, or print a new one with: handout calibrate verify --printer "
            f"{calibration.printer} -o strip.pdf", source)]  # fmt: skip
    bare = (strip.device == 1).all(axis=1)
    off = float(conversions.delta_e(conversions.lab(scanned[bare].mean(axis=0)), conversions.lab(table.paper)))
    if off <= _SAME_PAPER:
        return []
    return [ScanFinding("settings-differ", "warn", f"The bare paper differs from the chart's by ΔE00 {off:.1f}: "
        "another paper, or other settings of the scanner. Print the strip on the chart's paper and scan it like the "
        "chart.", source)]  # fmt: skip


def _check_pen(
    strip: VerificationStrip, scan: ChartScan, placement: ChartPlacement, scanned: Array, calibration: Calibration
) -> list[ScanFinding]:
    """A warning if the pen in the strip's frame does not look as in the chart's: the scans differ in their settings."""
    bare = (strip.device == 1).all(axis=1)
    now, before = scribble_of(scan, placement, scanned[bare].mean(axis=0)), calibration.scribble()
    if now is None or before is None or min(now.dpi, before.dpi) < pen_reference.LEAST_DPI:
        return []
    dpi = min(now.dpi, before.dpi)
    first, other = (pen_reference.at_dpi(pen_scribble.density, pen_scribble.dpi, dpi) for pen_scribble in (before, now))
    difference = match(first, before.paper, other, now.paper, dpi)
    if difference is None or difference.difference <= _SAME_PEN:
        return []
    sentence = (
        f"The pen in the strip's frame looks other than in the chart's (ΔE00 {difference.difference:.1f} on the mean): "
        "the scanner's settings changed between the two scans, or another pen wrote. Scan the strip just like the "
        "chart."
    )
    return [ScanFinding("settings-differ", "warn", sentence, scan.source)]


def _build_verification(strip: VerificationStrip, scanned: Array, findings: Sequence[ScanFinding]) -> Verification:
    lost = conversions.delta_e(conversions.lab(strip.wanted), conversions.lab(scanned))
    bare = (strip.device == 1).all(axis=1) & ~strip.matched & ~strip.grey
    plain, matched = ~strip.matched & ~bare, strip.matched
    before, after = _summarise_loss(lost[plain]), _summarise_loss(lost[matched])
    verdict = next((sentence for bound, sentence in _VERDICTS if after.mean <= bound), _POOR)
    if after.mean >= before.mean:
        verdict = _NO_HELP
    return Verification(
        datetime.now().astimezone().isoformat(timespec="seconds"), before, after,
        _summarise_loss(lost[plain & ~strip.grey]), _summarise_loss(lost[matched & ~strip.grey]),
        _summarise_loss(lost[plain & strip.grey]), _summarise_loss(lost[matched & strip.grey]),
        strip.out, strip.lost, verdict, tuple(map(str, findings)),
        strip.whose,
    )  # fmt: skip


def _summarise_loss(lost: Array) -> Difference:
    mean, median, p95, worst = (
        round(float(value), 3) for value in (lost.mean(), np.median(lost), np.percentile(lost, 95), lost.max())
    )
    return Difference(mean, median, p95, worst, len(lost))


_TILE = 22  # pixels
_SIDE, _SPAN = 420, 60.0  # pixels of the diagram; a* and b* that it reaches to


def sections(calibration: Calibration) -> list[tuple[str, str]]:
    """(heading, HTML) about a calibration whose strip was scanned; nothing before that."""
    verified, rows = calibration.load_kept(store.VERIFICATION), kept_shades(calibration)
    if verified is None or not rows:
        return []
    parts = []
    for name, colours in rows:
        alt = f"{name}: sent as it is, as wanted, through the table"
        parts.append(f"<p>{html.escape(alt)}, from dark to light.</p>{image(tiles(colours), alt)}")
    lines = "\n".join(table_lines(verified))
    return [
        ("Before and after", f"<pre>{html.escape(lines)}</pre>" + "".join(parts)),
        ("The printer's reach", _draw_reach(last_strip(calibration), calibration.table())),
    ]


def write_report(calibration: Calibration, path: Path) -> None:
    """A page about a verified calibration. Raises InputError: it cannot be written."""
    atomic.write(path, page(calibration.name, f"{calibration.describe()}.", sections(calibration)).encode())


def kept_shades(calibration: Calibration) -> list[tuple[str, Array]]:
    """Of inks and of greys (3, n, 3) scanned RGB: sent as they are, as wanted, through the table; the darkest first.

    Nothing before the strip of the calibration was scanned.
    """
    facts = calibration.load_kept(store.STRIP)
    if facts is None or calibration.load_kept(store.VERIFICATION) is None or "seen" not in facts:
        return []
    strip, scanned, each = from_facts(facts), np.array(facts["seen"]), []
    for name, grey in (("Ink", False), ("Greys", True)):
        which = np.flatnonzero(strip.matched & (strip.grey == grey))
        plain = which - int(strip.matched.sum())
        order = np.argsort(strip.wanted[which].sum(axis=1))
        each.append((name, np.stack([scanned[plain], strip.wanted[which], scanned[which]])[:, order]))
    return each


def tiles(rows: Array) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: colours (k, n, 3) in k rows that touch, so that differences are seen."""
    flat = np.rint(np.clip(rows, 0, 1) * 255).astype(np.uint8)
    return flat.repeat(_TILE, axis=0).repeat(_TILE, axis=1)


def _draw_reach(strip: VerificationStrip, table: ColourTable) -> str:
    """The outline of what the printer can print over a* and b*, and the strip's colours in it."""
    labs = conversions.lab(np.asarray(table.scanned, dtype=np.float64).reshape(-1, 3))
    outline = " ".join(f"{x:.1f},{y:.1f}" for x, y in _on_diagram(labs[spatial.ConvexHull(labs[:, 1:]).vertices, 1:]))
    which = strip.matched
    dots = "".join(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="rgb({r},{g},{b})" stroke="#555" stroke-width=".5"/>'
        for (x, y), (r, g, b) in zip(
            _on_diagram(conversions.lab(strip.wanted[which])[:, 1:]),
            np.rint(np.clip(strip.wanted[which], 0, 1) * 255).astype(int).tolist(), strict=True,
        )
    )  # fmt: skip
    half = _SIDE / 2
    axes = f'<path d="M0 {half}H{_SIDE}M{half} 0V{_SIDE}" stroke="#ccc"/>'
    drawn = (
        f'<svg viewBox="0 0 {_SIDE} {_SIDE}" width="{_SIDE}" height="{_SIDE}" style="border:1px solid #ddd">{axes}'
        f'<polygon points="{outline}" fill="#8882" stroke="#444"/>{dots}</svg>'
    )
    shade = np.linspace(0, 1, 400)[:, None] * np.asarray(table.paper, dtype=np.float64)
    darkest = float(labs[:, 0].min())
    greys = reach(np.clip(shade, 0, 1), table)
    return (
        "<p>What the printer can print on this paper, seen from above (a* to the right, b* up), and the verified "
        f"colours. Its darkest black has L* {darkest:.0f}; of the greys from black to the paper it reaches "
        f"{1 - greys.share_out:.0%}.</p>{drawn}<p>Some of the colours of the paper's own grey scale over what is "
        f"printed for them:</p>{image(swatches(greys), 'greys and what is printed for them')}"
    )


def _on_diagram(ab: Array) -> list[tuple[float, float]]:
    scaled = np.column_stack([ab[:, 0], -ab[:, 1]]) / _SPAN * (_SIDE / 2) + _SIDE / 2
    return [(float(x), float(y)) for x, y in scaled]
