"""Finding lines and words on pages whose lines and words are known."""

import numpy as np
import pytest

from handout_lab.score.written_lines import Lines, WrittenLine, ends_of_strokes, find_lines, find_words, gap_limit, ink
from tests.lab.score.drawn import X, page


def level(i, x=1000.0, slope=0.0, pitch=110.0):
    return 150 + (i + 1) * pitch + slope * (x - 1000)


@pytest.mark.slow
@pytest.mark.parametrize("slope", [-0.06, 0.0, 0.04])
def test_every_line_its_slope_and_the_height_of_letters(slope):
    found = find_lines(ink(page(slope=slope)))
    lines, x = found.lines, found.x_height
    assert len(lines) == 8
    assert x == pytest.approx(X + 4, abs=1.5)  # over the outside of a line of 4 pixels
    for i, line in enumerate(lines):
        assert line.slope == pytest.approx(slope, abs=0.003)
        assert float(line.base(900)) == pytest.approx(level(i, 900, slope), abs=4)


@pytest.mark.slow
@pytest.mark.parametrize("bend", [-18, 0, 18])
def test_the_bend_of_lines(bend):
    lines = find_lines(ink(page(bend=bend, words=8))).lines
    assert len(lines) == 8
    reach = (lines[0].length / 2 / 850) ** 2
    assert np.mean([line.bend for line in lines]) == pytest.approx(bend * reach, abs=2.5)


@pytest.mark.slow
def test_a_short_last_line_stays_below_the_one_above():
    grey = page(slope=-0.02, pitch=90)
    grey[int(level(6, pitch=90)) + 30 :, 500:] = 255
    grey[: int(level(6, pitch=90)) + 30, :] = page(slope=-0.02, pitch=90)[: int(level(6, pitch=90)) + 30, :]
    lines = find_lines(ink(grey)).lines
    assert len(lines) == 8
    assert lines[-1].length < 0.4 * lines[0].length
    assert float(lines[-1].base(300)) == pytest.approx(level(7, 300, -0.02, 90), abs=5)


def test_a_page_without_lines():
    assert find_lines(np.zeros((300, 300), dtype=bool)) == Lines((), 0.0, 0.0)


def test_ends_of_strokes_are_their_feet_and_tops():
    mask = np.zeros((50, 60), dtype=bool)
    mask[10:30, 10:14] = True
    mask[10:40, 30:34] = True
    mask[10:13, 10:34] = True
    low, high = ends_of_strokes(mask)
    assert low == pytest.approx(np.array([[11.5, 29.0], [31.5, 39.0]]))
    assert high == pytest.approx(np.array([[21.5, 10.0]]))


def test_a_baseline_is_what_its_curve_says():
    line = WrittenLine((100.0, 0.1, -0.001), 0.0, 200.0, 40.0)
    assert float(line.base(100)) == 100
    assert float(line.base(200)) == pytest.approx(100 + 10 - 10)
    assert line.bend == pytest.approx(10)


@pytest.mark.slow
@pytest.mark.parametrize("slant", [0.0, 0.35])
def test_words_and_their_gaps(slant):
    rng = np.random.default_rng(3)
    gaps = rng.uniform(35, 75, (8, 8))
    mask = ink(page(gaps=gaps, slant=slant))
    page_lines = find_lines(mask)
    found = find_words(mask, page_lines.lines, page_lines.x_height, slant)
    assert [len(line.words) for line in found] == [9] * 8
    measured = [b[0] - a[1] for line in found for a, b in zip(line.words, line.words[1:], strict=False)]
    assert np.corrcoef(measured, gaps.ravel())[0, 1] > 0.97
    assert np.mean(measured) == pytest.approx(gaps.mean(), abs=4)


def test_the_limit_lies_between_gaps_of_letters_and_of_words():
    rng = np.random.default_rng(0)
    both = np.concatenate([rng.uniform(0.15, 0.4, 200), rng.uniform(1.0, 2.0, 60)])
    assert 0.4 < gap_limit(both) < 1.0
    assert 0.4 < gap_limit(np.zeros(0)) < 1.3
    assert gap_limit(rng.uniform(1.2, 2.5, 60)) < 1.2
