"""The line that the pen left: from a mask to a LineGraph with radius and density at every vertex.

Source: seed 000, §5.1.2; handwriting specification §5.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.scanning.density import Density
from handout.scanning.fitting import evened, fitted, lengthened, sampled, within
from handout.scanning.mask import Mask
from handout.scanning.page import Scan
from handout.scanning.skeleton import fill_holes, skeleton, without_spurs
from handout.scanning.strands import apart
from handout.values import Array, LineGraph

_COARSE = 0.25  # pixels: what whole pixels add to the distance from the edge
# a disc of radius 1 in 19 points of equal area, for the mean over it
_RINGS = np.array(
    [(0.0, 0.0)]
    + [(0.5 * np.cos(a), 0.5 * np.sin(a)) for a in np.arange(6) * np.pi / 3]
    + [(0.85 * np.cos(a), 0.85 * np.sin(a)) for a in np.arange(12) * np.pi / 6]
)


def find_lines_of_ink(scan: Scan, mask: Mask, density: Density) -> LineGraph:
    """The line graph of a page.

    Returns
    -------
    LineGraph: `xy` and `radius` in mm on the page, `uv` in pixels of the scan (0 is the middle of the first pixel).
    """
    import cv2

    ink = fill_holes(mask.ink, scan.dpi)
    away = cv2.distanceTransform(ink.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    inside = np.asarray(away, dtype=np.float32)
    xy, edges = skeleton(ink)
    half = mask.stroke / 2
    # a spur may be the end of two strokes that have run into one another: it goes when they have been taken apart
    xy, edges = without_spurs(*apart(xy, edges, sampled(inside, xy) - _COARSE, half), inside)
    weight = np.where(ink, np.maximum(density.values, 0.02), 0).astype(np.float32)
    xy, half_width = fitted(evened(xy, edges), edges, weight, ink.astype(np.float32), half)
    # what lies beyond the picture is not known: smoothing must not move a line that runs off its edge out there
    xy, edges = lengthened(within(xy, ink.shape), edges, inside, half_width)
    xy = within(xy, ink.shape)
    radius = np.maximum(sampled(inside, xy) - 0.5, 0.5)
    thick = mean_within(density.values, xy, radius)
    # a pixel's middle lies half a pixel from its corner, and the page begins at the corner
    place = (xy + 0.5) * scan.pixel
    return LineGraph(place, radius * scan.pixel, np.clip(thick, 0, 2), xy, edges)


def mean_within(values: NDArray[np.float32], xy: Array, radius: Array) -> Array:
    """(n,) float: mean of `values` over the circle of each vertex, of places and radii in pixels."""
    return np.asarray(sampled(values, xy[:, None] + _RINGS * radius[:, None, None]).mean(axis=1))
