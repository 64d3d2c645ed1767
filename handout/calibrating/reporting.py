"""What a calibration and its strip come to, as pictures for a report: before and after, and the printer's reach."""

from __future__ import annotations

import html
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout import atomic
from handout.calibrating import strip as strips
from handout.calibrating.calibration import Calibration
from handout.calibrating.strip import Strip
from handout.calibrating.verification import table_lines
from handout.colour import conversions, gamut
from handout.colour.report import image, page
from handout.colour.table import ColourTable
from handout.values import Array

_TILE = 22  # pixels
_SIDE, _SPAN = 420, 60.0  # pixels of the diagram; a* and b* that it reaches to


def sections(calibration: Calibration) -> list[tuple[str, str]]:
    """(heading, HTML) about a calibration whose strip was scanned; nothing before that."""
    facts, verified = calibration.strip(), calibration.verification()
    if facts is None or verified is None or "seen" not in facts:
        return []
    made, seen = strips.from_facts(facts), np.array(facts["seen"])
    lines = "\n".join(table_lines(verified))
    return [
        ("Before and after", f"<pre>{html.escape(lines)}</pre>" + _before_and_after(made, seen)),
        ("The printer's reach", _reach(made, calibration.table())),
    ]


def write(calibration: Calibration, path: Path) -> None:
    """A page about a verified calibration.

    Raises
    ------
    InputError
        It cannot be written.
    """
    atomic.write(path, page(calibration.name, f"{calibration.described()}.", sections(calibration)).encode())


def _before_and_after(made: Strip, seen: Array) -> str:
    parts = []
    for name, grey in (("Ink", False), ("Greys", True)):
        which = np.flatnonzero(made.matched & (made.grey == grey))
        plain = which - int(made.matched.sum())
        order = np.argsort(made.wanted[which].sum(axis=1))
        rows = np.stack([seen[plain], made.wanted[which], seen[which]])[:, order]
        alt = f"{name}: sent as it is, as wanted, through the table"
        parts.append(f"<p>{html.escape(alt)}, from dark to light.</p>{image(tiles(rows), alt)}")
    return "".join(parts)


def tiles(rows: Array) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: colours (k, n, 3) in k rows that touch, so that differences are seen."""
    flat = np.rint(np.clip(rows, 0, 1) * 255).astype(np.uint8)
    return flat.repeat(_TILE, axis=0).repeat(_TILE, axis=1)


def _reach(made: Strip, table: ColourTable) -> str:
    """The outline of what the printer can print over a* and b*, and the strip's colours in it."""
    labs = conversions.lab(np.asarray(table.seen, dtype=np.float64).reshape(-1, 3))
    outline = " ".join(f"{x:.1f},{y:.1f}" for x, y in _placed(_hull(labs[:, 1:])))
    which = made.matched
    dots = "".join(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="rgb({r},{g},{b})" stroke="#555" stroke-width=".5"/>'
        for (x, y), (r, g, b) in zip(
            _placed(conversions.lab(made.wanted[which])[:, 1:]),
            np.rint(np.clip(made.wanted[which], 0, 1) * 255).astype(int).tolist(), strict=True,
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
    found = gamut.reach(np.clip(shade, 0, 1), table)
    return (
        "<p>What the printer can print on this paper, seen from above (a* to the right, b* up), and the verified "
        f"colours. Its darkest black has L* {darkest:.0f}; of the greys from black to the paper it reaches "
        f"{1 - found.out:.0%}.</p>{drawn}<p>Some of the colours of the paper's own grey scale over what is printed for "
        f"them:</p>{image(gamut.swatches(found), 'greys and what is printed for them')}"
    )


def _placed(ab: Array) -> list[tuple[float, float]]:
    scaled = np.column_stack([ab[:, 0], -ab[:, 1]]) / _SPAN * (_SIDE / 2) + _SIDE / 2
    return [(float(x), float(y)) for x, y in scaled]


def _hull(points: Array) -> Array:
    from scipy.spatial import ConvexHull

    return np.asarray(points[ConvexHull(points).vertices])
