import numpy as np
import pytest
from scribbles import coverage, lines_of

from handout.scanning.baselines import StrokeExtremes, on_baselines
from handout.scanning.text_lines import find_text_lines

WIDTH = 120.0


def mask_of(count, fall=0.0, slant=0.0, pitch=9.0, dpi=300.0, bend=0.0, height=2.4):
    strokes = []
    for stroke in lines_of(count, WIDTH, pitch, height, fall):
        x, y = stroke.T
        line = np.round((y.max() - fall * (x.mean() - WIDTH / 2) - 12) / pitch)
        base = 12 + line * pitch + fall * (x - WIDTH / 2)
        bow = bend * ((x - WIDTH / 2) / (WIDTH / 2)) ** 2
        strokes.append(np.stack([x + slant * (base - y), y + bow], axis=1))
    return coverage(strokes, WIDTH, 16.0 + pitch * count, dpi) > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2, 5, 8])
@pytest.mark.parametrize("told", [False, True])
def test_every_line_is_found(count, told):
    rules = find_text_lines(mask_of(count), 300.0, count if told else None)
    assert len(rules.lines) == count
    middles = [float(line.baseline(WIDTH / 2)) for line in rules.lines]
    assert middles == pytest.approx([12.2 + 9.0 * k for k in range(count)], abs=0.35)
    assert rules.x_height == pytest.approx(2.4 + 0.45, abs=0.35)
    if count > 1:
        assert rules.pitch == pytest.approx(9.0, abs=0.1)


@pytest.mark.parametrize("pitch", [14.0, 20.0])
def test_spaced_out_lines_have_letters_of_their_own_size(pitch):
    rules = find_text_lines(mask_of(3, pitch=pitch, height=1.3), 300.0)
    assert rules.pitch == pytest.approx(pitch, abs=0.1)
    assert rules.x_height == pytest.approx(1.3 + 0.45, abs=0.25)
    middles = [float(line.baseline(WIDTH / 2)) for line in rules.lines]
    assert middles == pytest.approx([12.2 + pitch * k for k in range(3)], abs=0.3)


@pytest.mark.parametrize("letters", [80, 100])
def test_a_printed_heading_two_lines_above_does_not_double_the_pitch(letters):
    mask, millimetre = mask_of(6), 300.0 / 25.4
    mask[: round(26.4 * millimetre)] = False  # the first two lines, for the heading and for nothing
    for x in np.linspace(8, WIDTH - 8, letters):
        mask[
            round(9.6 * millimetre) : round(12 * millimetre), round(x * millimetre) : round((x + 0.4) * millimetre)
        ] = True
    found = find_text_lines(mask, 300.0)
    assert found.pitch == pytest.approx(9.0, abs=0.1) and len(found.lines) == 5


@pytest.mark.parametrize("fall", [-0.05, 0.03])
def test_slope(fall):
    rules = find_text_lines(mask_of(5, fall=fall), 300.0)
    assert [float(line.slope(WIDTH / 2)) for line in rules.lines] == pytest.approx([fall] * 5, abs=0.004)


def test_every_second_line_may_be_short():
    mask, pitch = mask_of(9), 9.0 * 300 / 25.4
    for short in range(1, 9, 2):
        mask[int((short + 0.6) * pitch) : int((short + 1.6) * pitch), 2 * mask.shape[1] // 5 :] = False
    assert len(find_text_lines(mask, 300.0).lines) == 9


def test_bend():
    rules = find_text_lines(mask_of(5, bend=2.0), 300.0)
    for line in rules.lines:
        hang = float(line.baseline(line.middle) - (line.baseline(line.left) + line.baseline(line.right)) / 2)
        assert hang == pytest.approx(-2.0 * ((line.right - line.left) / WIDTH) ** 2, abs=0.4)


def stems(slant):
    """Six lines of words of stems, joined at the foot, with an ascender here and there."""
    rng, strokes = np.random.default_rng(4), []
    for k in range(6):
        base, x = 14 + 9.0 * k, 8.0
        while x < WIDTH - 10:
            letters = int(rng.integers(4, 10))
            for i in range(letters):
                top = 2.4 * (2 if rng.random() < 0.25 else 1)
                foot, head = np.array([x + 1.5 * i, base]), np.array([x + 1.5 * i + slant * top, base - top])
                strokes += [np.stack([foot, head])]
                if i + 1 < letters:
                    strokes += [np.stack([foot, foot + np.array([1.5, 0.0])])]
            x += 1.5 * letters + 3
    return coverage(strokes, WIDTH, 70.0, 300.0) > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("slant", [-0.2, 0.0, 0.3, 0.6])
def test_slant(slant):
    assert find_text_lines(stems(slant), 300.0).slant == pytest.approx(slant, abs=0.04)


def test_resolution_does_not_matter():
    one, two = find_text_lines(mask_of(4), 300.0), find_text_lines(mask_of(4, dpi=600.0), 600.0)
    for a, b in zip(one.lines, two.lines, strict=True):
        assert a.baseline(60.0) == pytest.approx(b.baseline(60.0), abs=0.1)
    assert one.x_height == pytest.approx(two.x_height, abs=0.1)


def test_uneven_spacing_with_a_known_count():
    one, gap = mask_of(3), np.zeros((150, round(WIDTH * 300 / 25.4)), dtype=bool)
    both = np.concatenate([one[:, : gap.shape[1]], gap, one[:, : gap.shape[1]]])
    assert len(find_text_lines(both, 300.0, 6).lines) == 6


def test_places_know_their_line():
    rules = find_text_lines(mask_of(4), 300.0)
    assert rules.nearest(np.array([[50.0, 11.0], [50.0, 20.5], [50.0, 38.0]])).tolist() == [0, 1, 3]
    assert rules.pitch == pytest.approx(9.0, abs=0.02 * 9.0)


def test_nothing_to_find():
    rules = find_text_lines(np.zeros((300, 300), dtype=bool), 300.0)
    assert rules.lines == ()
    assert rules.nearest(np.zeros((2, 2))).tolist() == [-1, -1]


def test_the_feet_of_a_short_line_do_not_lead_it_into_the_line_above() -> None:
    """Two words that end low over their line: at the far edge the line went 9 mm up, through the one above."""
    pitch, x = 9.5, np.linspace(24.0, 56.0, 30)
    level = np.full(len(x), 46.0)
    left = np.column_stack([x, level - 1.2])
    feet = np.column_stack([x, level - 0.0466 * (x - 40.0)])
    (line,) = on_baselines(StrokeExtremes(left, feet, left, level), [(44.8, 0.0)], 40.0, pitch)
    assert abs(float(line.baseline(40.0)) - 46.0) < 0.3
    assert abs(float(line.slope(40.0))) < 0.02, "its few feet say .047, lines lie within .008 of one another"
