"""Flat nibs in pixels: thick across the edge, thin along it."""

import numpy as np
import pytest

from handout.inking import plain
from handout.values import NIB_THICKNESS, Drawing, Page, Stroke

DPI = 254.0  # ten pixels a mm


def inked(way):
    """mm²: what a nib of 3 mm at 45° covers along 20 mm of a way."""
    t = np.linspace(0, 1, 80)
    xy = np.array([15.0, 15.0]) + np.outer(20 * t - 10, way)
    stroke = Stroke(t, xy, width=np.full(80, 3.0), rotation=np.full(80, -np.pi / 4), nib=3.0)
    return plain.coverage(Drawing((stroke,), Page(30, 30)), DPI).sum() / 255 / 100


def test_covers_what_its_edge_sweeps():
    across, along = np.sqrt([0.5, 0.5]), np.sqrt([0.5, 0.5]) * [1, -1]
    thick = NIB_THICKNESS * 3
    assert inked(across) == pytest.approx(20 * 3, rel=0.03)
    assert inked(along) == pytest.approx((20 + 3 - thick) * thick, rel=0.1)
    assert inked(np.array([0.0, 1.0])) == pytest.approx(20 * 3 * np.sqrt(0.5), rel=0.06)


def test_a_nib_needs_its_rotation():
    with pytest.raises(ValueError, match="rotation"):
        Stroke([0.0], [[1.0, 1.0]], nib=2.0)
