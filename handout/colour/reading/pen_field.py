"""The framed field of a chart or strip, in which a person wrote: it shows the pen's ink in the same scan."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout import atomic
from handout.colour.ink_match import density_of, strokes_in
from handout.colour.reading.patch_means import Shading
from handout.colour.reading.registration import ChartPlacement
from handout.colour.reading.scan_files import ChartScan
from handout.errors import InputError
from handout.libraries import cv2
from handout.values import Array, readonly

_INSET = 0.9  # mm from the frame to what is looked at
_OUTSIDE = 0.7  # mm beyond the frame's line
_FRAME = 0.12  # of the scale by which the frame's line is darker than what is outside of it
_NODES = (3, 25)  # down and across the field, between which the page lies straight
_SHORTEST = 40.0  # mm of line
_FULL = 65535


@dataclass(frozen=True, eq=False)
class Scribble:
    """What a pen left in the field.

    picture : (h, w, 3) float32, 0–1 as scanned, free of shading; upright.
    paper : (3,) the bare paper in the same scan.
    dpi : pixels an inch.
    contrast : strength of the S-shaped curve that the chart's patches show in this scan; 0: none.
    """

    picture: NDArray[np.float32]
    paper: Array
    dpi: float
    contrast: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "paper", readonly(self.paper, 3))

    @property
    def density(self) -> NDArray[np.float32]:
        """(h, w, 3) −ln(pixel / paper)."""
        return density_of(self.picture, self.paper)


def scribble_of(
    scan: ChartScan, placement: ChartPlacement, paper: Array, shading: Shading | None = None
) -> Scribble | None:
    """What was written in the field of a scanned page; None if there is no field, or too little in it.

    scan, placement : the page, and where it lies.
    paper : (3,) scanned RGB of its bare patches, 0–1, free of shading.
    shading : what the light loses over the page.
    """
    left, top, right, bottom = placement.page.scribble_field
    box = (left + _INSET, top + _INSET, right - _INSET, bottom - _INSET)
    if not _has_frame(scan, placement):
        return None
    height, width = (max(2, round((box[k + 2] - box[k]) / placement.pixel)) for k in (1, 0))
    across, down = (np.linspace(box[k], box[k + 2], _NODES[1 - k]) for k in (0, 1))
    nodes = np.stack(np.meshgrid(across, down), axis=-1)  # (down, across, 2) mm, evenly over the box
    at = _interpolate(placement.pixels(nodes.reshape(-1, 2)).reshape(nodes.shape), height, width).astype(np.float32)
    if not ((at >= 0) & (at <= (scan.pixels.shape[1] - 1, scan.pixels.shape[0] - 1))).all():
        return None
    # nearest, not between: what is between two pixels would be neither's colour
    picture = cv2.remap(scan.pixels, at[..., 0], at[..., 1], cv2.INTER_NEAREST).astype(np.float32) / scan.full
    if shading is not None:
        factor = shading.factors_at(nodes.reshape(-1, 2)).reshape((*nodes.shape[:2], 3))
        picture /= _interpolate(factor, height, width).astype(np.float32)
    scribble = Scribble(np.asarray(picture, dtype=np.float32), paper, placement.dpi)
    lines = strokes_in(scribble.density, scribble.dpi)
    return scribble if lines is not None and lines.length >= _SHORTEST else None


def _has_frame(scan: ChartScan, placement: ChartPlacement) -> bool:
    """Whether the field's frame is there: charts of old had none."""
    left, top, right, bottom = placement.page.scribble_field
    along = np.linspace(0.05, 0.95, 60)
    across, down = left + along * (right - left), top + along * (bottom - top)
    lines = [
        [np.column_stack([across, np.full(60, top - away)]) for away in (0.0, _OUTSIDE)],
        [np.column_stack([np.full(60, left - away), down]) for away in (0.0, _OUTSIDE)],
    ]
    for on, beside in lines:
        dark, light = (_read_levels(scan, placement, points) for points in (on, beside))
        if dark is None or light is None or np.median(light) - np.median(dark) < _FRAME:
            return False
    return True


def _read_levels(scan: ChartScan, placement: ChartPlacement, mm: Array) -> Array | None:
    """Darkest of 3 × 3 pixels about points (n, 2) of the page, 0–1; None if one is not in the picture."""
    at = np.rint(placement.pixels(mm)).astype(int)
    height, width = scan.pixels.shape[:2]
    if not ((at >= 1) & (at < (width - 1, height - 1))).all():
        return None
    near = [scan.pixels[at[:, 1] + j, at[:, 0] + i].mean(axis=1) for j in (-1, 0, 1) for i in (-1, 0, 1)]
    return np.asarray(np.min(near, axis=0) / scan.full)


def _interpolate(nodes: Array, height: int, width: int) -> Array:
    """(height, width, k): what lies between nodes (r, c, k), at the middles of pixels."""
    # (size, count) of each node in each pixel
    middles = [(np.arange(size) + 0.5) / size for size in (height, width)]
    down, across = (
        np.clip(1 - np.abs(at[:, None] * (count - 1) - np.arange(count)), 0, 1)
        for at, count in zip(middles, nodes.shape[:2], strict=True)
    )
    return np.asarray(np.einsum("hr,rck,wc->hwk", down, nodes, across, optimize=True))


def file_beside(patches: Path) -> Path:
    """Where `save` puts the field of a chart whose patches are in a table."""
    return patches.with_suffix(".pen.npz")


def save(scribble: Scribble, path: Path) -> None:
    """Write one to a file; the same one gives the same bytes. Raises InputError: it cannot be written."""
    out = io.BytesIO()
    pixels = np.rint(np.clip(scribble.picture, 0, 1) * _FULL).astype(np.uint16)
    np.savez_compressed(out, picture=pixels, paper=scribble.paper, dpi=np.float64(scribble.dpi),
                        contrast=np.float64(scribble.contrast))  # fmt: skip
    atomic.write(path, out.getvalue())


def load(path: Path) -> Scribble:
    """What `save` wrote. Raises InputError: it cannot be read."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            picture: Any = arrays["picture"]
            contrast = float(arrays["contrast"]) if "contrast" in arrays else 0.0
            return Scribble(picture.astype(np.float32) / _FULL, arrays["paper"], float(arrays["dpi"]), contrast)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path} cannot be read as the field of a chart: scan the chart again.") from error
