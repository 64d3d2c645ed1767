"""Printed lines taken out of a scan: writing on ruled or squared paper reads, and is kept, as on plain paper.

A line is followed in blocks along its way, in which the median of the columns shows it where letters cross.  Beside
ink its pixels become what lies above and below them; a pixel darker than the line, in any channel, is ink and stays.

Source: own method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.scanning.printed_lines import find_printed_lines
from handout.scanning.scan import Scan
from handout.values import Array


@dataclass(frozen=True)
class ErasureSettings:
    """Set by eye on ten writers' ruled pages (docs/bibliography.md, Copiste d'un jour), looked at on others."""

    block: float = 5.0  # mm along a line whose columns are meaned
    screen: int = 5  # pixels along a line that are meaned
    most: float = 65.0  # percentile of the columns' light in a block
    reach: float = 1.3  # mm from a line's straight way to where it may bend
    thickest: float = 0.5  # mm: lines are no thicker
    together: int = 15  # blocks that tell together where the line runs
    jump: float = 0.2  # mm that a block may leave them by
    widest: float = 0.6  # mm to either side of its middle
    edge: float = 0.08  # share of the darkness of its middle that still is the line's
    clear: float = 75.0  # percentile of the blocks' darkness that bare line has at least
    weak: float = 0.3  # share of that under which a block does not show it
    faintest: float = 3.0  # of 255: darkness under which no block shows it
    even: float = 0.35  # of a line's usual darkness, that a column of it may leave it by
    evenly: float = 0.4  # share of the columns that have to be so: of lines written on 0.6 to 0.8 are, of letters 0.2
    seen: float = 0.3  # share of blocks that have to show it: otherwise it is none
    beside: int = 15  # blocks that tell together what the line looks like without ink on it
    bare: float = 65.0  # percentile of their light that does: letters that stand on it make most of a block dark
    noise: float = 3.0  # deviations of a line's own darkness above which a pixel is ink
    grain: int = 3  # pixels along a line that are meaned, since printed lines are screened and strokes are not
    least: float = 20.0  # of 255 above the line's own darkness, for ink
    beyond: float = 40.0  # of 255 above the paper's, for ink beside the line


_ERASURE = ErasureSettings()


def erase_printed_lines(scan: Scan) -> tuple[Scan, int]:
    """A scan without the lines that were printed on its paper, and how many these were; 0 for plain paper."""
    height, width = (side * scan.pixel for side in scan.shape)
    sheet = find_printed_lines(scan.rgb, width, height)
    if sheet is None:
        return scan, 0
    rgb = scan.rgb.copy()
    count = 0
    for lines, apart, along in ((sheet.across, sheet.fine, rgb), (sheet.down, sheet.columns, rgb.transpose(1, 0, 2))):
        if not lines:
            continue
        places, slopes = np.array([(line.at, line.slope) for line in lines]).T
        if apart:  # lines that writing hides from the search lie as evenly as the others
            even = np.arange(places.min() % apart, along.shape[0] * scan.pixel, apart)
            hidden = even[np.abs(even[:, None] - places).min(axis=1) > 0.3 * apart]
        else:
            hidden = places[:0]
        # a line that is written on may seem to lean, as its letters do; all together do not
        lean = float(np.median(slopes))
        count += sum(_erase_line(along, at, lean, scan.pixel) for at in {*places.tolist(), *hidden.tolist()})
    return Scan(rgb, scan.dpi, scan.source, scan.told, scan.origin), count


def _erase_line(rgb: NDArray[np.uint8], at: float, slope: float, pixel: float) -> bool:
    """Take one line out of a picture, in which it runs from left to right; whether it was there.

    at : mm, where it crosses the middle of the picture.
    """
    import cv2
    from scipy.interpolate import interp1d
    from scipy.ndimage import grey_closing, median_filter, percentile_filter, uniform_filter1d

    width = rgb.shape[1]
    column = np.arange(width)
    straight = (at + slope * (column + 0.5 - width / 2) * pixel) / pixel - 0.5
    reach = round(_ERASURE.reach / pixel)
    offsets = np.arange(-reach, reach + 1)
    # screened lines are rows of dots
    light = uniform_filter1d(_rows(rgb, straight, offsets).mean(axis=-1), _ERASURE.screen, axis=1)
    blocks = np.array_split(column, max(2, round(width * pixel / _ERASURE.block)))
    # (blocks, offsets): a line is as dark in most columns, the feet of a row of letters are not
    profile = np.stack([np.percentile(light[:, block], _ERASURE.most, axis=1) for block in blocks])
    middles = np.array([block.mean() for block in blocks])
    # how far each place is darker than both sides of it, as a line is and the body of a letter is not
    dip = grey_closing(profile, size=(1, 2 * round(_ERASURE.thickest / pixel) + 1)) - profile
    together = uniform_filter1d(dip, _ERASURE.together, axis=0, mode="nearest")
    usual = offsets[together.argmax(axis=1)]
    near = np.where(np.abs(offsets - usual[:, None]) <= max(1.0, _ERASURE.jump / pixel), dip, 0)
    depth = near.max(axis=1)
    shown = depth > max(_ERASURE.weak * np.percentile(depth, _ERASURE.clear), _ERASURE.faintest)
    place = (near @ offsets) / np.maximum(near.sum(axis=1), 1e-6)
    shown &= np.abs(place - median_filter(usual.astype(np.float64), 7)) <= max(1.5, 2 * _ERASURE.jump / pixel)
    if shown.mean() < _ERASURE.seen:
        return False
    way = straight + np.interp(column, middles[shown], place[shown])
    around = uniform_filter1d(_rows(rgb, way, np.arange(-1, 2)).mean(axis=-1), _ERASURE.screen, axis=1).min(axis=0)
    depth = np.percentile(light, 75) - around
    usual = np.median(depth[np.isin(column, np.concatenate([blocks[k] for k in np.flatnonzero(shown)]))])
    # lines are printed evenly; a row of letters is dark and light by turns
    if np.mean(np.abs(depth - usual) <= _ERASURE.even * usual) < _ERASURE.evenly:
        return False
    half = max(2, round(_ERASURE.widest / pixel))
    level = np.median(_rows(rgb, way, np.arange(-half, half + 1)), axis=1).min(axis=1)  # across the line
    wide = np.flatnonzero(level < level.max() - max(_ERASURE.edge * np.ptp(level), 1.0)) - half
    if not len(wide):
        return False
    band = np.arange(wide[0] - 1, wide[-1] + 2)  # a pixel more, since it was followed to the nearest
    strip = _rows(rgb, way, np.arange(band[0] - 2, band[-1] + 3))
    own, above, below = strip[2:-2], strip[:2].mean(axis=0), strip[-2:].mean(axis=0)
    bare = np.flatnonzero(shown)
    rule = np.stack([np.median(own[:, blocks[k]], axis=1) for k in bare], axis=1)  # (band, blocks, 3)
    rule = percentile_filter(rule, _ERASURE.bare, size=(1, _ERASURE.beside, 1), mode="nearest")
    darker = (
        interp1d(middles[bare], rule, axis=1, bounds_error=False, fill_value=(rule[:, 0], rule[:, -1]))(column) - own
    )
    darker = uniform_filter1d(darker, _ERASURE.grain, axis=1)
    spread = 1.48 * np.median(np.abs(darker), axis=(1, 2), keepdims=True)
    dark = np.ones(strip.shape[:2], dtype=np.uint8)
    dark[2:-2] = (darker > np.maximum(_ERASURE.noise * spread, _ERASURE.least)).any(axis=2)
    paper = np.percentile(strip[[0, 1, -2, -1]], 75, axis=(0, 1))
    for beyond in (dark[:2], strip[:2]), (dark[-2:], strip[-2:]):
        beyond[0][:] = (paper - beyond[1] > _ERASURE.beyond).any(axis=2)
    # between ink above the line's middle and ink below it there is ink
    between = cv2.morphologyEx(dark, cv2.MORPH_CLOSE, np.ones((len(band) + 1, 1), np.uint8)) - dark
    dark |= cv2.erode(between, np.ones((1, _ERASURE.grain), np.uint8))
    count, piece = cv2.connectedComponents(dark, connectivity=8)
    written = np.zeros(count, dtype=bool)  # pieces that go on beyond the line
    written[piece[[1, -2]]] = True
    written[0] = False
    part = (np.arange(1, len(band) + 1) / (len(band) + 1))[:, None, None]
    cleaned = np.where(written[piece[2:-2], None], own, np.maximum(own, (1 - part) * above + part * below))
    row = np.rint(way).astype(np.intp) + band[:, None]
    within = (row >= 0) & (row < rgb.shape[0])
    rgb[row[within], np.broadcast_to(column, row.shape)[within]] = np.rint(cleaned[within]).astype(np.uint8)
    return True


def _rows(rgb: NDArray[np.uint8], way: Array, offsets: NDArray[np.int_]) -> NDArray[np.float32]:
    """(offsets, w, 3): pixels so far below a way across a picture; beyond its edge the nearest."""
    row = (np.rint(way).astype(np.intp) + offsets[:, None]).clip(0, rgb.shape[0] - 1)
    return np.asarray(rgb[row, np.arange(rgb.shape[1])], dtype=np.float32)
