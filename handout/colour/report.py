"""What was read of a chart as one HTML page: the grid on the scan, ramps, worst patches, findings."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout import atomic, units
from handout.colour.reading.chart_reading import ChartReading, SheetReading
from handout.colour.reading.patch_means import sample_grid
from handout.libraries import cv2
from handout.values import Array

_LONG = 1500  # pixels, long side of the picture of a scan
_WORST = 24
_USED, _LEFT, _MARK = (40, 220, 90), (255, 40, 40), (30, 120, 255)
_STYLE = """
body{font:15px/1.45 system-ui,sans-serif;margin:2rem auto;max-width:68rem;padding:0 1rem;color:#222}
h1{font-size:1.5rem}h2{font-size:1.1rem;margin-top:2rem}img,svg{max-width:100%;height:auto}
.refuse{border-left:.4rem solid #c22;padding:.1rem .8rem;margin:.5rem 0}
.warn{border-left:.4rem solid #d90;padding:.1rem .8rem;margin:.5rem 0}
.fine{border-left:.4rem solid #2a2;padding:.1rem .8rem}.where{color:#777;font-size:.85em}
table{border-collapse:collapse;font-variant-numeric:tabular-nums}td,th{padding:.15rem .7rem;text-align:right}
.swatch{display:inline-block;width:2.4em;height:1.2em;vertical-align:middle;border:1px solid #999}
"""


def report(reading: ChartReading, title: str = "Colour chart", more: Sequence[tuple[str, str]] = ()) -> str:
    """The page.

    title : printer, paper, date.
    more : sequence of (heading, HTML), further sections after the findings: what a calibration made of it.
    """
    sections = [("Findings", _findings(reading)), *more]
    if len(reading.device):
        worst = np.argsort(-reading.deviation, kind="stable")[:_WORST]
        rows = [_row(reading.device[i], reading.scanned[i], float(reading.deviation[i])) for i in worst.tolist()]
        head = "<tr><th>sent</th><th></th><th>scanned</th><th></th><th>standard error, of 255</th></tr>"
        sections.append(("Ramps", _ramps(reading)))
        sections.append(("Patches that scatter most", f"<table>{head}{''.join(rows)}</table>"))
    sections += [(f"Found on {sheet.scan.source}", _sheet(sheet)) for sheet in reading.sheets]
    return page(title, _summary(reading), sections)


def page(title: str, summary: str, sections: Sequence[tuple[str, str]]) -> str:
    """An HTML page of a title, a paragraph of text, and sections of (heading, HTML)."""
    body = "\n".join(f"<section><h2>{html.escape(head)}</h2>\n{text}</section>" for head, text in sections)
    name = html.escape(title)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{name}</title>\n'
        f"<style>{_STYLE}</style></head>\n<body><h1>{name}</h1>\n<p>{html.escape(summary)}</p>\n{body}\n</body></html>\n"
    )


def write_report(path: Path, reading: ChartReading) -> None:
    """Write the page to a file. Raises InputError: it cannot be written."""
    atomic.write(path, report(reading).encode("utf-8"))


def _summary(reading: ChartReading) -> str:
    if not len(reading.device):
        return "Nothing could be read."
    error = float(np.median(reading.deviation)) * 255
    verdict = "A calibration can be made of it." if reading.usable else "No calibration may be made of it."
    return (
        f"{len(reading.device)} colours from {units.count(len(reading.sheets), 'scan')}; standard error of "
        f"one, in the middle, "
        f"{error:.2f} of 255. {verdict}"
    )


def _findings(reading: ChartReading) -> str:
    if not reading.findings:
        return '<p class="fine">Nothing is wrong.</p>'
    order = sorted(reading.findings, key=lambda finding: finding.severity != "refuse")
    return "\n".join(
        f'<p class="{finding.severity}">{html.escape(finding.sentence)} '
        f'<span class="where">{html.escape(finding.where)} · {finding.code}</span></p>'
        for finding in order
    )


def grid_on(sheet: SheetReading, long_side: int = _LONG) -> NDArray[np.uint8]:
    """The scan, reduced, with what was found on it: (h, w, 3) uint8.

    Green the inner part of each patch that is used, red of those left out, blue the marks.
    """
    pixels = sheet.scan.pixels if sheet.scan.full == 255 else (sheet.scan.pixels >> 8).astype(np.uint8)
    scale = min(1.0, long_side / max(pixels.shape[:2]))
    small = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    small = np.ascontiguousarray(small)

    def polygons(corners: Array) -> list[NDArray[np.int32]]:
        # four more binary places than whole pixels
        at = ((np.asarray(corners) + 0.5) * scale - 0.5) * 16
        return list(np.rint(at).astype(np.int32).reshape(-1, 4, 1, 2))

    boxes = sample_grid(sheet.placement, np.array([0.0, 1.0]))[:, [0, 0, 1, 1], [0, 1, 1, 0]]
    used = np.asarray(sheet.used, dtype=bool)
    for mask, colour, width in ((used, _USED, 1), (~used, _LEFT, 2)):
        cv2.polylines(small, polygons(boxes[mask]), True, colour, width, cv2.LINE_AA, 4)
    cv2.polylines(small, polygons(sheet.placement.corners), True, _MARK, 2, cv2.LINE_AA, 4)
    return np.asarray(small)


def _sheet(sheet: SheetReading) -> str:
    place = sheet.placement
    size = f"{place.scale[0]:.2%} × {place.scale[1]:.2%} of its size, " if place.scale else ""
    caption = (
        f"{sheet.page.label}: {place.dpi:.0f} dpi, {size}bent by up to {place.warp:.2f} mm, "
        f"{len(place.mark_indices)} marks, {int(np.sum(sheet.used))} of {len(sheet.used)} patches used"
    )
    return f"<p>{html.escape(caption)}.</p>\n{image(grid_on(sheet), 'the scan with the grid')}"


def image(pixels: NDArray[np.uint8], alt: str) -> str:
    _, data = cv2.imencode(".jpg", pixels[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 88])
    return f'<img alt="{html.escape(alt)}" src="data:image/jpeg;base64,{base64.b64encode(data.tobytes()).decode()}">'


def _ramps(reading: ChartReading) -> str:
    """What was read against what was sent, of greys and of the three inks, as drawings."""
    parts = []
    for name, base in (("greys", None), ("cyan", 0), ("magenta", 1), ("yellow", 2)):
        if base is None:
            mine = np.ptp(reading.device, axis=1) == 0
            sent = reading.device[mine, 0]
        else:
            mine = (np.delete(reading.device, base, axis=1) == 1).all(axis=1)
            sent = reading.device[mine, base]
        order = sent.argsort()
        parts.append(_curves(name, sent[order], reading.scanned[mine][order]))
    return "".join(parts)


def _curves(name: str, sent: Array, scanned: Array) -> str:
    lines = []
    for channel, colour in enumerate(("#d33", "#2a2", "#36d")):
        points = " ".join(
            f"{20 + 200 * x:.1f},{210 - 200 * y:.1f}" for x, y in zip(sent, scanned[:, channel], strict=True)
        )
        lines.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.2"/>')
    return (
        f'<svg width="240" height="235" role="img" aria-label="{name}"><rect x="20" y="10" width="200" height="200" '
        f'fill="#fafafa" stroke="#bbb"/>{"".join(lines)}<text x="120" y="228" text-anchor="middle" font-size="12">'
        f"{name}: sent → scanned</text></svg>"
    )


def _row(device: Array, scanned: Array, deviation: float) -> str:
    cells = ""
    for colour in (device, scanned):
        shown = ",".join(f"{255 * min(max(v, 0), 1):.0f}" for v in colour)
        cells += f"<td>{' '.join(f'{255 * v:.0f}' for v in colour)}</td>"
        cells += f'<td><span class="swatch" style="background:rgb({shown})"></span></td>'
    return f"<tr>{cells}<td>{deviation * 255:.2f}</td></tr>"
