from __future__ import annotations

import numpy as np
import pytest

from handout.colour.models import splines

RNG = np.random.default_rng(5)
CENTRES = RNG.random((150, 3))
KERNELS = sorted(splines.KERNELS)


def wavy(points: np.ndarray) -> np.ndarray:
    return np.column_stack([np.sin(3 * points[:, 0]) + points[:, 1], np.cos(2 * points[:, 2]) * points[:, 0]])


@pytest.mark.parametrize("kernel", KERNELS)
def test_exact_at_its_centres_and_of_its_polynomial(kernel: str) -> None:
    found = splines.exact(CENTRES, wavy(CENTRES), kernel)
    np.testing.assert_allclose(found(CENTRES), wavy(CENTRES), atol=1e-7)
    slope = RNG.normal(size=(3, 2))
    linear = splines.exact(CENTRES, CENTRES @ slope + 0.3, kernel)
    elsewhere = 3 * RNG.random((50, 3)) - 1
    np.testing.assert_allclose(linear(elsewhere), elsewhere @ slope + 0.3, atol=1e-6)


def test_thin_plates_as_scipy_has_them() -> None:
    from scipy.interpolate import RBFInterpolator

    elsewhere = RNG.random((40, 3))
    theirs = RBFInterpolator(CENTRES, wavy(CENTRES), kernel="thin_plate_spline")(elsewhere)
    np.testing.assert_allclose(splines.exact(CENTRES, wavy(CENTRES))(elsewhere), theirs, atol=1e-7)


def test_smoothing_takes_noise_out_and_knows_how_much() -> None:
    rng = np.random.default_rng(5)  # its own: which tests came before differs
    elsewhere, errors = rng.random((300, 3)), []
    for noise in (0.001, 0.03):
        values = wavy(CENTRES) + noise * rng.normal(size=(150, 2))
        variances = np.full(150, noise**2)
        smooth = splines.smooth(CENTRES, values, variances, ("r3", "r5"), 2)
        rough = splines.exact(CENTRES, values, "r3")
        errors.append([np.abs(made(elsewhere) - wavy(elsewhere)).mean() for made in (smooth, rough)])
        residual = (smooth(CENTRES) - values).std()
        assert 0.3 * noise < residual < 1.05 * noise
        told_less = splines.smooth(CENTRES, values, variances / 400, ("r5",), 2)
        # values that scatter more than was said are not followed
        assert (told_less(CENTRES) - values).std() > 0.3 * noise
    assert errors[1][0] < 0.6 * errors[1][1]


def test_without_noise_it_passes_through() -> None:
    found = splines.smooth(CENTRES, wavy(CENTRES), np.full(150, 1e-12), ("r3",), 2)
    np.testing.assert_allclose(found(CENTRES), wavy(CENTRES), atol=1e-4)
