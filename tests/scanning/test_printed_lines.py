"""Rules, squares and margin lines of sheets, scanned and photographed."""

import numpy as np
import pytest
from sheets import kinds, photographed, scanned, sheet

from handout.scanning.printed_lines import find_printed_lines

KINDS = kinds()


def found_on(picture):
    return find_printed_lines(picture.rgb, *picture.size)


def expected(picture, rules):
    """(height at the middle of the picture, slope) of each rule, mm."""
    middle, found = picture.size[0] / 2, []
    for height in rules:
        (ax, ay), (bx, by) = picture.seen(20, height), picture.seen(picture.size[0] - 20, height)
        slope = (by - ay) / (bx - ax)
        found.append((ay + (middle - ax) * slope, slope))
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("photo", [False, True])
def test_lines_of_sheets_that_are_sold(name, photo):
    how, rules, margin, columns = KINDS[name]
    rng = np.random.default_rng(11 + photo)
    made = sheet(**how, dpi=120)
    picture = photographed(made, rng, turn=-1.7) if photo else scanned(made, rng, skew=0.8)
    seen, want = found_on(picture), expected(picture, rules)
    got = np.array([(rule.at, rule.slope) for rule in seen.rules])
    assert abs(len(got) - len(want)) <= 1
    nearest = np.abs(got[:, :1] - want[:, 0]).argmin(axis=1)
    assert np.abs(got[:, 0] - want[nearest, 0]).max() < 0.12
    assert np.abs(got[:, 1] - want[nearest, 1]).max() < 0.002
    assert seen.pitch == pytest.approx(np.median(np.diff(want[:, 0])), rel=0.02)
    assert (seen.columns is None) == (columns is None) and seen.right is None
    if columns:
        assert seen.columns == pytest.approx(columns, rel=0.05)
    if margin is None:
        assert seen.left is None
    else:
        inner = max(picture.seen(margin, 5)[0], picture.seen(margin, picture.size[1] - 5)[0])
        assert seen.left == pytest.approx(inner, abs=0.5)


@pytest.mark.slow
def test_only_heavy_lines_of_seyes_are_written_on():
    how, *_ = KINDS["seyes"]
    seen = found_on(scanned(sheet(**how, dpi=120), np.random.default_rng(3)))
    assert seen.pitch == pytest.approx(8, rel=0.01) and seen.fine == pytest.approx(2, rel=0.01)


@pytest.mark.slow
def test_plain_paper_and_writing_have_no_rules(small_scan):
    blank = sheet([], dpi=120)
    for seed in range(2):
        rng = np.random.default_rng(seed)
        assert found_on(scanned(blank, rng)) is None and found_on(photographed(blank, rng)) is None
    assert find_printed_lines(small_scan.simulated.image, 90.0, 50.0) is None


@pytest.mark.slow
def test_a_rule_that_is_hidden_is_filled_in():
    made = sheet(np.array([h for h in np.arange(24, 202, 8) if h != 48]), dpi=120)
    seen = found_on(scanned(made, np.random.default_rng(1)))
    assert np.allclose(np.diff([rule.at for rule in seen.rules]), 8, atol=0.15)


@pytest.mark.slow
def test_a_right_margin_is_one():
    made = sheet(np.arange(24, 202, 8), margins=(30.0, 130.0), dpi=120)
    seen = found_on(scanned(made, np.random.default_rng(1)))
    assert seen.left == pytest.approx(30, abs=0.3) and seen.right == pytest.approx(130, abs=0.3)
