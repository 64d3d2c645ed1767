"""Statistics of a page: what was drawn into it comes out."""

import numpy as np
import pytest

from handout.errors import InputError
from handout_lab.score.statistics import page_statistics
from handout_lab.score.written_lines import find_lines, ink
from tests.lab.score.drawn import X, page


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [-12, 0, 9, 25])
def test_slant(degrees):
    grey = page(slant=np.radians(degrees))
    assert np.degrees(find_lines(ink(grey)).slant) == pytest.approx(degrees, abs=2.5)


def test_a_page_drawn_by_rule_has_nothing_that_wavers():
    found = page_statistics(page())
    assert (found.lines, found.words) == (8, 72)
    assert found.x_height == pytest.approx((X + 4) / 300 * 25.4, abs=0.13)
    assert found.pitch == pytest.approx(110 / 300 * 25.4, rel=0.01)
    assert found.word_gap * found.x_height == pytest.approx(50 / 300 * 25.4, abs=0.4)
    assert found.line_width == pytest.approx(4 / 300 * 25.4, rel=0.35)
    for name in ("slant_spread", "baseline_spread", "left_edge", "pitch_cv", "slope_spread", "line_bend"):
        assert getattr(found, name) < 0.04, name
    assert found.word_gap_cv < 0.08


def test_what_wavers_is_seen():
    rng = np.random.default_rng(1)
    rough = page_statistics(page(wave=4.0, gaps=rng.uniform(30, 80, (8, 8)), indent=rng.normal(0, 25, 8)))
    assert 0.06 < rough.baseline_spread < 0.2
    assert 0.15 < rough.word_gap_cv < 0.4
    assert 0.2 < rough.left_edge < 2.0


def test_slope_and_margin():
    found = page_statistics(page(slope=-0.03, indent=np.arange(8) * 11.0))
    assert found.line_slope == pytest.approx(-0.03, abs=0.003)
    assert np.tan(found.margin_drift) == pytest.approx(0.1, abs=0.03)


@pytest.mark.slow
def test_thicker_lines_and_uneven_ones():
    thin, thick = page_statistics(page()), page_statistics(page(thickness=7))
    assert thick.line_width > 1.3 * thin.line_width
    pale = page()
    pale[:, 1000:][pale[:, 1000:] < 128] = 90
    assert page_statistics(pale).tone_spread > thin.tone_spread + 0.1


@pytest.mark.parametrize("grey", [np.full((300, 300), 255, np.uint8), np.zeros((0, 0), np.uint8)])
def test_a_page_without_writing(grey):
    with pytest.raises(InputError, match="No written line"):
        page_statistics(grey)
