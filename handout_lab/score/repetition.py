"""How often a page repeats itself: the surest sign that a machine wrote it.

Among the ink components of one page, the share that has a near-identical twin.  On 100 real pages the median is
.000 and the worst .018; a font with jitter scores .89, a plain font 1.0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.values import Array

TWIN = 0.98  # correlation above which two components are the same drawing
_LEAST_AREA = 30  # pixels
_HEIGHTS = (0.6, 3.0)  # of the median: neither dots nor merged words
_SIDE, _FRAME, _BLUR = 32, 36, 0.8
_SAME_HEIGHT = 0.2  # greatest difference of log heights of two components that are compared


def components(grey: NDArray[np.uint8]) -> list[NDArray[np.bool_]]:
    """Masks of the ink components of a page, letters and joined letters but neither dots nor merged words.

    Parameters
    ----------
    grey : (h, w) uint8, dark ink on light paper, at about 300 dpi.
    """
    import cv2

    _, ink = cv2.threshold(grey, 0, 255, cv2.THRESH_BINARY_INV | cv2.THRESH_OTSU)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(ink, connectivity=8)
    boxes = [i for i in range(1, count) if stats[i, cv2.CC_STAT_AREA] >= _LEAST_AREA]
    if not boxes:
        return []
    middle = float(np.median([stats[i, cv2.CC_STAT_HEIGHT] for i in boxes]))
    letters = [i for i in boxes if _HEIGHTS[0] * middle <= stats[i, cv2.CC_STAT_HEIGHT] <= _HEIGHTS[1] * middle]
    masks = []
    for i in letters:
        x, y, w, h = (int(v) for v in stats[i, :4])
        masks.append(labels[y : y + h, x : x + w] == i)
    return masks


def repetition(grey: NDArray[np.uint8]) -> float:
    """Share of the ink components whose best match on the page correlates above `TWIN`.

    Parameters
    ----------
    grey : (h, w) uint8, dark ink on light paper, at about 300 dpi.

    Returns
    -------
    float in 0–1; 0 for a page with fewer than two components.
    """
    masks = components(grey)
    if len(masks) < 2:
        return 0.0
    patches = np.array([_normalised(mask) for mask in masks])
    heights = np.log([mask.shape[0] for mask in masks])
    match = patches @ patches.T
    match[np.abs(heights[:, None] - heights) >= _SAME_HEIGHT] = -1.0
    np.fill_diagonal(match, -1.0)
    return float((match.max(axis=1) > TWIN).mean())


def _normalised(mask: NDArray[np.bool_]) -> Array:
    """The component, longer side 32 pixels, centred and blurred, as a vector of mean 0 and length 1."""
    import cv2

    height, width = mask.shape
    scale = _SIDE / max(height, width)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    small = cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    frame = np.zeros((_FRAME, _FRAME), np.float32)
    top, left = (_FRAME - size[1]) // 2, (_FRAME - size[0]) // 2
    frame[top : top + size[1], left : left + size[0]] = small
    vector = cv2.GaussianBlur(frame, (0, 0), _BLUR).ravel().astype(np.float64)
    vector -= vector.mean()
    norm = float(np.linalg.norm(vector))
    return np.asarray(vector / norm if norm else vector)
