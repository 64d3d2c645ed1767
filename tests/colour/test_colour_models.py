from __future__ import annotations

import numpy as np
import pytest
from formula_printers import Dark, chart, dull, dull_model, identical, scanned

from handout.colour import METHODS, conversions
from handout.colour.models import fit, inverse, splines
from handout.colour.models.forward import Patches, lattice
from handout.colour.table import build
from handout.errors import InputError

RNG = np.random.default_rng(2)
INSIDE = 0.03 + 0.94 * RNG.random((200, 3))


@pytest.fixture(scope="module")
def models():
    return {method: dull_model(method) for method in METHODS}


def apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return conversions.delta_e(conversions.lab(one), conversions.lab(other))


@pytest.mark.parametrize("method", METHODS)
def test_printable_colours_come_out_as_wanted(models, method: str) -> None:
    wanted = dull(INSIDE)
    met = apart(dull(np.clip(models[method].invert(wanted), 0, 1)), wanted)
    assert apart(dull(np.clip(wanted, 0, 1)), wanted).mean() > 5
    assert met.mean() < 0.15 and np.percentile(met, 95) < 0.4


def test_inverse_of_forward_is_where_one_began(models) -> None:
    forward = models["forward"].forward
    np.testing.assert_allclose(inverse.invert(forward, forward.inside(INSIDE)), INSIDE, atol=2e-3)
    just_out = np.clip(INSIDE, 0.05, 0.95)
    just_out[:, 0] = 1.003
    np.testing.assert_allclose(inverse.invert(forward, forward(just_out)), just_out, atol=5e-3)


def test_an_identical_printer_is_left_alone() -> None:
    model = fit(scanned(identical))
    np.testing.assert_allclose(model.invert(INSIDE), INSIDE, atol=1e-3)


def test_smoothing_beats_exactness_on_noisy_patches() -> None:
    wanted, met = dull(INSIDE), {}
    patches = scanned(dull, noise=1 / 255, seed=4)
    for method in METHODS:
        met[method] = apart(dull(np.clip(fit(patches, method).invert(wanted), 0, 1)), wanted).mean()
    assert met["forward"] < 0.7 * met["tps-haines2016"]
    assert met["tps"] < 0.85 * met["tps-haines2016"]


def test_repeats_tell_the_noise_without_deviations() -> None:
    sent = np.concatenate([chart(5, 26), np.repeat([[1.0, 1, 1], [0.5, 0.5, 0.5]], 40, axis=0)])
    patches = scanned(dull, noise=1 / 255, device=sent)
    unknown = np.full(len(sent), np.nan)
    assert np.sqrt(splines.noise(sent, patches.scanned, unknown)) == pytest.approx(1 / 255, rel=0.15)
    one = np.where(np.arange(len(sent)) == 3, 4 / 255, np.nan)
    assert np.sqrt(splines.noise(sent, patches.scanned, one)[3]) == pytest.approx(4 / 255)


def test_a_few_patches_with_dust_on_them_are_left_out() -> None:
    clean = scanned(dull, noise=0.25 / 255)
    seen, dusty = clean.scanned.copy(), RNG.choice(len(clean), 6, replace=False)
    seen[dusty] += np.where(seen[dusty] > 0.5, -0.12, 0.12)
    model = fit(Patches(clean.device, seen, clean.deviation))
    assert set(np.argsort(model.misses)[-6:]) == set(dusty)
    met = [apart(dull(np.clip(one.invert(dull(INSIDE)), 0, 1)), dull(INSIDE)).mean() for one in (model, fit(clean))]
    assert met[0] < met[1] + 0.05


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_patches_that_scan_alike_do_no_harm(method: str) -> None:
    # 8-bit means, and every grey twice: exact duplicates, and centres a rounding apart
    sent = np.concatenate([chart(6, 256), chart(6, 256)[216:]])
    seen = np.rint(dull(sent) * 255) / 255
    seen[-1] += 1e-9
    model = fit(Patches(sent, seen, np.full(len(sent), np.nan)), method)
    met = apart(dull(np.clip(model.invert(dull(INSIDE)), 0, 1)), dull(INSIDE))
    assert met.mean() < 0.4


def test_merging_averages_by_how_well_rows_are_known() -> None:
    x = np.array([[0.1, 0.1, 0.1], [0.1005, 0.1, 0.1], [0.5, 0.5, 0.5]])
    ready = splines.merge_close_rows(x, np.array([[0.0] * 3, [1.0] * 3, [2.0] * 3]), np.array([1.0, 3.0, 1.0]))
    assert len(ready.x) == 2
    np.testing.assert_allclose(sorted(ready.y[:, 0]), [0.25, 2.0])
    np.testing.assert_allclose(sorted(ready.variances), [0.75, 1.0])


@pytest.mark.parametrize("method", METHODS)
def test_a_chart_read_in_the_wrong_order_is_refused(method: str) -> None:
    patches = scanned(dull)
    with pytest.raises(InputError, match=r"misses its own patches by ΔE00 .*the worst is patch \d+"):
        fit(Patches(patches.device, RNG.permutation(patches.scanned), patches.deviation), method)


def test_an_unknown_method_is_named() -> None:
    with pytest.raises(InputError, match="no method 'nearest'; there are forward, tps, tps-haines2016"):
        fit(scanned(dull), "nearest")


def test_out_of_gamut_goes_to_what_looks_nearest(models) -> None:
    forward = models["forward"].forward
    wanted = np.array([[0.02, 0.02, 0.05], [0.0, 0.05, 0.6], [0.9, 0.0, 0.1], [0.05, 0.3, 0.05], [1.0, 1.0, 1.0]])
    device, lost = inverse.printable(forward, wanted)
    assert ((device >= 0) & (device <= 1)).all()
    np.testing.assert_allclose(lost, apart(forward.inside(device), wanted))
    fine = lattice(33)
    shown = conversions.lab(dull(fine))
    best = np.array([conversions.delta_e(shown, conversions.lab(one)).min() for one in wanted])
    assert (lost < best + 0.05).all() and (lost > 2).all()
    clipped = apart(dull(np.clip(models["tps-haines2016"].invert(wanted), 0, 1)), wanted)
    assert lost.mean() < clipped.mean()
    assert inverse.printable(forward, dull(INSIDE))[1].max() < 0.1


@pytest.mark.slow
def test_the_worst_of_dark_colours_comes_out_nearly_as_well_as_the_model_knows_them() -> None:
    printer = Dark().scan_patches
    model = fit(scanned(printer, 1 / 255, 3, chart(8, 256)))
    sent = np.random.default_rng(0).random((700, 3))
    wanted = printer(sent)
    known = apart(model.forward.inside(sent), wanted)
    solved = apart(printer(np.clip(model.invert(wanted), 0, 1)), wanted)
    assert solved.mean() < known.mean() + 0.02 and solved.max() < 1.1 * known.max()
    tabled = apart(printer(build(model)(wanted)), wanted)
    assert tabled.mean() < known.mean() + 0.04 and tabled.max() < 1.2 * known.max()
