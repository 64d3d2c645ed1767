"""What would tell made snippets from real ones without a look at the writing: sharpness, darkness, colour, size …

For each measure: how often a made snippet has more of it than a real one (the area under the curve of who is told by
that measure alone); ½ tells nothing.  All measures are tested together: of studies in which none tells, one in twenty
names one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.values import Array
from handout_lab.study.snippets import Picture

_INK = 0.25  # of the snippet's own depth, where ink begins
_SPECK = 0.08  # mm²: ink smaller than that is dust to the eye; a full stop of a ballpoint has twice that
_LEVEL = 0.05  # of all measures together

MEASURES = ("sharpness", "darkness", "evenness of the line", "colour", "specks", "width", "height", "slope")


@dataclass(frozen=True)
class Tell:
    """One measure: (made, real) medians; `share` of pairs in which the made one has more; `error` of that share.

    p : how likely chance is as far from half in any of the measures that are tested with it.
    """

    name: str
    made: float
    real: float
    share: float
    error: float
    p: float

    @property
    def tells(self) -> bool:
        """Whether it could give the made ones away."""
        return self.p < _LEVEL


def tells(made: Sequence[Picture], real: Sequence[Picture]) -> list[Tell]:
    """All measures of two sets of snippets.

    Source: of the error, J. A. Hanley and B. J. McNeil, "The meaning and use of the area under a ROC curve", 1982, for
    an area of ½; of p, S. Holm, "A simple sequentially rejective multiple test procedure", 1979.
    """
    from scipy.special import erfc

    m, r = (np.array([_measured(picture) for picture in pictures]) for pictures in (made, real))
    error = float(np.sqrt((len(m) + len(r) + 1) / (12 * len(m) * len(r))))
    share = (np.sign(m[:, None] - r[None]).mean(axis=(0, 1)) + 1) / 2
    p = holm(erfc(np.abs(share - 0.5) / error / np.sqrt(2)))
    medians = np.median(m, axis=0), np.median(r, axis=0)
    return [
        Tell(name, float(medians[0][k]), float(medians[1][k]), float(share[k]), error, float(p[k]))
        for k, name in enumerate(MEASURES)
    ]


def holm(p: Array) -> Array:
    """(n,) p of tests that are made together, so that any of them is below α by chance with at most α (Holm 1979)."""
    order = np.argsort(p)
    stepped = np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1))
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(stepped, 1)
    return adjusted


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
