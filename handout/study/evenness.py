"""What would tell made snippets from real ones without a look at the writing: sharpness, darkness, colour, size …

For each measure: how often a made snippet has more of it than a real one (the area under the curve of who is told by
that measure alone); ½ tells nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.study.snippets import Picture
from handout.values import Array

_INK = 0.25  # of the snippet's own depth, where ink begins
_SPECK = 0.08  # mm²: ink smaller than that is dust to the eye; a full stop of a ballpoint has twice that
_Z = 1.96  # standard errors of an area under the curve, beyond which it is not chance

MEASURES = ("sharpness", "darkness", "evenness of the line", "colour", "specks", "width", "height", "slope")


@dataclass(frozen=True)
class Tell:
    """One measure: (made, real) medians; `share` of pairs in which the made one has more; `error` of that share."""

    name: str
    made: float
    real: float
    share: float
    error: float

    @property
    def tells(self) -> bool:
        """Whether it could give the made ones away."""
        return abs(self.share - 0.5) > _Z * self.error


def tells(made: Sequence[Picture], real: Sequence[Picture]) -> list[Tell]:
    """All measures of two sets of snippets.

    Source: of the error, J. A. Hanley and B. J. McNeil, "The meaning and use of the area under a ROC curve", 1982, for
    an area of ½.
    """
    m, r = (np.array([_measured(picture) for picture in pictures]) for pictures in (made, real))
    error = float(np.sqrt((len(m) + len(r) + 1) / (12 * len(m) * len(r))))
    found = []
    for k, name in enumerate(MEASURES):
        more = np.sign(m[:, None, k] - r[None, :, k])
        share = float((more + 1).mean() / 2)
        found.append(Tell(name, float(np.median(m[:, k])), float(np.median(r[:, k])), share, error))
    return found


def _measured(picture: Picture) -> Array:
    """(8,) the measures of a snippet, in the order of `MEASURES`."""
    from scipy.ndimage import find_objects, label

    rgb = np.pad(picture.rgb.astype(np.float64), ((2, 2), (2, 2), (0, 0)), constant_values=255.0)
    depth = 255 - rgb.mean(axis=2)
    deepest = float(np.percentile(depth[depth > 0.5 * depth.max()], 50))
    ink = depth > _INK * deepest
    dy, dx = np.gradient(depth)
    steep = float(np.percentile(np.hypot(dx, dy)[ink], 90)) / deepest
    core = depth[depth > 0.5 * deepest]
    colour = rgb[depth > 0.5 * deepest].mean(axis=0)
    pieces, _ = label(ink, np.ones((3, 3)))
    area = (25.4 / picture.dpi) ** 2
    sizes = np.bincount(pieces.ravel())[1:] * area if find_objects(pieces) else np.zeros(0)
    rows, columns = np.nonzero(ink)
    slope = float(np.polyfit(columns, -rows, 1)[0])
    return np.array(
        [steep, deepest, -float(core.std()) / deepest, float(colour[2] - colour[0]), float((sizes < _SPECK).sum()),
         picture.width, picture.rgb.shape[0] * 25.4 / picture.dpi, slope]
    )  # fmt: skip
