"""Printed lines taken out of a scan: writing on ruled or squared paper reads, and is kept, as on plain paper.

A line is followed in blocks along its way, in which the median of the columns shows it where letters cross.  Beside
ink its pixels become the lighter of what lies above and below them; a pixel darker than the line within half a pixel of
it, in any channel, is ink and stays.  Where that was half a pixel off, bits of line stayed in letters: on two writers'
ruled pages 61 and 80 such bits of 8 pixels and more, and 13 and 17 since; of 24 places on three others' where the ink
differs 8 are better, by eye, and 2 worse: a foot that rests on the line lost its edge.

Source: own method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.chains import viterbi
from handout.libraries import cv2, interpolate, ndimage
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
    fine: int = 4  # places a pixel at which a line may run
    bend: float = 2.0  # blocks' worth of line that it costs to go by a pixel from one to the next
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
    """A scan without the lines that were printed on its paper, and how many these were; 0 for plain paper.

    The sheet may lie on its side, with its rules upright.
    """
    height, width = (side * scan.pixel for side in scan.shape)
    rgb = scan.rgb.copy()
    upright, lying = rgb, rgb.transpose(1, 0, 2)
    sheet = find_printed_lines(upright, width, height)
    if sheet is None:
        sheet = find_printed_lines(np.ascontiguousarray(lying), height, width)
        upright, lying = lying, upright
    if sheet is None:
        return scan, 0
    count = 0
    for lines, apart, along in ((sheet.across, sheet.fine, upright), (sheet.down, sheet.columns, lying)):
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
        followed = [_follow_line(along, at, lean, scan.pixel) for at in sorted({*places.tolist(), *hidden.tolist()})]
        count += sum(_take_out(along, line, scan.pixel) for line in followed if line)
    return Scan(rgb, scan.dpi, scan.source, scan.told, scan.origin), count


@dataclass(frozen=True, eq=False)
class _Followed:
    """A printed line in a picture through which it runs from left to right.

    way : (w,) float: its middle, pixels from the top.
    blocks : the columns of those blocks that show it bare.
    """

    way: Array
    blocks: tuple[NDArray[np.int_], ...]


def _follow_line(rgb: NDArray[np.uint8], at: float, slope: float, pixel: float) -> _Followed | None:
    """The line near a straight way, `at` mm from the top in the middle of the picture; None if there is none."""
    width = rgb.shape[1]
    column = np.arange(width)
    straight = (at + slope * (column + 0.5 - width / 2) * pixel) / pixel - 0.5
    reach = round(_ERASURE.reach / pixel)
    offsets = np.arange(-reach, reach + 1)
    # screened lines are rows of dots
    light = ndimage.uniform_filter1d(_rows(rgb, straight, offsets).mean(axis=-1), _ERASURE.screen, axis=1)
    blocks = np.array_split(column, max(2, round(width * pixel / _ERASURE.block)))
    # (blocks, offsets): a line is as dark in most columns, the feet of a row of letters are not
    profile = np.stack([np.percentile(light[:, block], _ERASURE.most, axis=1) for block in blocks])
    # how much darker each place is than what lies on both sides of it, as a line is and the body of a letter is not
    dip = ndimage.grey_closing(profile, size=(1, 2 * round(_ERASURE.thickest / pixel) + 1)) - profile
    finer = np.arange(-reach * _ERASURE.fine, reach * _ERASURE.fine + 1) / _ERASURE.fine
    seen = interpolate.interp1d(offsets, ndimage.gaussian_filter1d(dip, 0.7, axis=1), "cubic")(finer)
    # the path along which most line is seen and that bends little; a letter, however dark, counts as much as line
    gain = np.minimum(seen / max(float(np.median(seen.max(axis=1))), 1e-6), 1.0)
    path = viterbi(list(-gain), [_ERASURE.bend * (finer[:, None] - finer) ** 2] * (len(gain) - 1))
    place, depth = ndimage.gaussian_filter1d(finer[path], 1.0, mode="nearest"), seen[np.arange(len(seen)), path]
    shown = depth > max(_ERASURE.weak * np.percentile(depth, _ERASURE.clear), _ERASURE.faintest)
    if shown.mean() < _ERASURE.seen:
        return None
    bare = tuple(blocks[k] for k in np.flatnonzero(shown))
    way = straight + np.interp(column, [block.mean() for block in bare], place[shown])
    grey = _rows(rgb, way, np.arange(-1, 2)).mean(axis=-1)
    middle = ndimage.uniform_filter1d(grey, _ERASURE.screen, axis=1).min(axis=0)
    darkness = np.percentile(light, 75) - middle
    own = float(np.median(darkness[np.concatenate(bare)]))
    # lines are printed evenly; a row of letters is dark and light by turns
    return _Followed(way, bare) if np.mean(np.abs(darkness - own) <= _ERASURE.even * own) > _ERASURE.evenly else None


def _take_out(rgb: NDArray[np.uint8], line: _Followed, pixel: float) -> bool:
    """Take a line out of its picture; whether there was anything to take."""
    half = max(2, round(_ERASURE.widest / pixel))
    level = np.median(_rows(rgb, line.way, np.arange(-half, half + 1)), axis=1).min(axis=1)  # across the line
    wide = np.flatnonzero(level < level.max() - max(_ERASURE.edge * np.ptp(level), 1.0)) - half
    if not len(wide):
        return False
    band = np.arange(wide[0] - 1, wide[-1] + 2)  # a pixel more, since it was followed to the nearest
    strip = _rows(rgb, line.way, np.arange(band[0] - 2, band[-1] + 3))
    own, above, below = strip[2:-2], strip[:2].mean(axis=0), strip[-2:].mean(axis=0)
    bare = np.maximum(own, np.maximum(above, below))  # the foot of a letter that ends above it does not go on into it
    cleaned = np.where(_ink_on_line(strip, line)[:, :, None], own, bare)
    row = np.rint(line.way).astype(np.intp) + band[:, None]
    within = (row >= 0) & (row < rgb.shape[0])
    column = np.broadcast_to(np.arange(rgb.shape[1]), row.shape)
    rgb[row[within], column[within]] = np.rint(cleaned[within]).astype(np.uint8)
    return True


def _ink_on_line(strip: NDArray[np.float32], line: _Followed) -> NDArray[np.bool_]:
    """(rows, w) bool: what is ink in a strip (rows + 4, w, 3) of a line and two pixels to either side of it."""
    own = strip[2:-2]
    bare = _bare_line(strip, line)
    darker = ndimage.uniform_filter1d(bare - own, _ERASURE.grain, axis=1)
    usual = np.median(darker, axis=(1, 2), keepdims=True)
    spread = 1.48 * np.median(np.abs(darker - usual), axis=(1, 2), keepdims=True)
    paper = np.percentile(strip[[0, 1, -2, -1]], 75, axis=(0, 1))
    dark = np.asarray((paper - strip > _ERASURE.beyond).any(axis=2), dtype=np.uint8)
    # how far each pixel's colour is from any mixture of the paper's and the line's
    away = paper - bare.min(axis=(0, 1))
    axis = away / max(float(np.linalg.norm(away)), 1.0)
    aside = np.linalg.norm((paper - strip) - ((paper - strip) @ axis)[:, :, None] * axis, axis=2)
    outer = np.concatenate([aside[:2][dark[:2] > 0], aside[-2:][dark[-2:] > 0]])
    coloured = len(outer) > 0 and float(np.median(outer)) > _ERASURE.beyond
    stands_out = (darker > np.maximum(_ERASURE.noise * spread, _ERASURE.least)).any(axis=2)
    dark[2:-2] = aside[2:-2] > 0.5 * _ERASURE.beyond if coloured else stands_out
    # between ink above the line's middle and ink below it there is ink
    between = cv2.morphologyEx(dark, cv2.MORPH_CLOSE, np.ones((len(own) + 1, 1), np.uint8)) - dark
    dark = np.maximum(dark, cv2.erode(between, np.ones((1, _ERASURE.grain), np.uint8)))
    count, piece = cv2.connectedComponents(dark, connectivity=8)
    beyond = np.zeros(count, dtype=bool)  # pieces that go on beyond the line
    beyond[piece[[1, -2]]] = True
    return np.asarray((beyond[piece] & (dark > 0))[2:-2])


def _bare_line(strip: NDArray[np.float32], line: _Followed) -> NDArray[np.float32]:
    """(rows, w, 3) what a line looks like without ink on it, at its darkest within half a pixel, in its strip."""
    beside = line.way - np.rint(line.way)
    halves = np.arange(2 * len(strip) - 1) / 2
    across = _between_rows(strip, halves[:, None] + beside)
    seen = np.stack([np.median(across[:, block], axis=1) for block in line.blocks], axis=1)  # (halves, blocks, 3)
    seen = ndimage.percentile_filter(seen, _ERASURE.bare, size=(1, _ERASURE.beside, 1), mode="nearest")
    seen = ndimage.minimum_filter1d(seen, 3, axis=0)
    middles, ends = [block.mean() for block in line.blocks], (seen[:, 0], seen[:, -1])
    along = interpolate.interp1d(middles, seen, axis=1, bounds_error=False, fill_value=ends)(np.arange(strip.shape[1]))
    return _between_rows(along, 2 * (np.arange(2, len(strip) - 2)[:, None] - beside))


def _between_rows(image: Array | NDArray[np.float32], at: Array) -> NDArray[np.float32]:
    """(n, w, 3) an image (m, w, 3) at places (n, w) between its rows."""
    low = np.floor(at).astype(np.intp).clip(0, len(image) - 2)
    part, column = (at - low).clip(0, 1)[:, :, None], np.arange(image.shape[1])
    return np.asarray((1 - part) * image[low, column] + part * image[low + 1, column], dtype=np.float32)


def _rows(rgb: NDArray[np.uint8], way: Array, offsets: NDArray[np.int_]) -> NDArray[np.float32]:
    """(offsets, w, 3): pixels so far below a way across a picture; beyond its edge the nearest."""
    row = (np.rint(way).astype(np.intp) + offsets[:, None]).clip(0, rgb.shape[0] - 1)
    return np.asarray(rgb[row, np.arange(rgb.shape[1])], dtype=np.float32)
