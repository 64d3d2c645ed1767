import numpy as np
import pytest
from scribbles import BLUE, coverage, lines_of, page, scan_of

from handout.errors import InputError
from handout.scanning.density import Scale, density_table, find_density, find_scale, look_up, pooled_scale
from handout.scanning.inks import find_inks, paper_mode
from handout.scanning.line_erasure import erase_printed_lines
from handout.scanning.paper import crop, find_paper, flatten
from handout.scanning.scan import Scan
from handout.scanning.written_page import prepare

DPI = 300.0
INK = coverage(lines_of(3, 80.0), 80.0, 40.0, DPI)


def uneven(shape, stain=True):
    y, x = np.mgrid[: shape[0], : shape[1]] / max(shape)
    light = 0.95 - 0.25 * x - 0.1 * y
    if stain:
        light -= 0.12 * np.exp(-((x - 0.6) ** 2 + (y - 0.3) ** 2) / 0.02)
    return np.repeat(light[:, :, None], 3, axis=2)


def test_even_paper_is_left_alone():
    scan = page(2)
    assert flatten(scan, find_paper(scan)) is scan


def test_light_and_stains_are_evened_out():
    scan = scan_of(INK, paper=uneven(INK.shape))
    level = flatten(scan, find_paper(scan))
    plain = INK < 0.01
    assert np.ptp(np.percentile(scan.rgb[plain], [2, 98])) > 50
    assert np.ptp(np.percentile(level.rgb[plain], [2, 98])) < 14


def test_ink_keeps_its_share_of_the_light():
    scan = scan_of(INK, paper=uneven(INK.shape), noise=0)
    paper = find_paper(scan)
    level = flatten(scan, paper)
    core = INK > 0.98
    share = level.rgb[core] / 255 / paper.colour
    assert np.abs(np.median(share, axis=0) - BLUE).max() < 0.03


def test_borders_are_cut_off():
    rgb = page(3).rgb.copy()
    rgb[:, :60] = 20
    rgb[-40:] = (90, 60, 40)
    cut = crop(Scan(rgb, DPI))
    assert 60 <= cut.origin[0] <= 75
    assert rgb.shape[0] - 55 <= cut.shape[0] <= rgb.shape[0] - 40
    assert crop(page(3)).shape == page(3).shape


def test_a_shadow_is_not_cut_off_but_a_border_in_it_is():
    rgb = page(5).rgb.astype(float)
    fall = np.linspace(1.6, -1, rgb.shape[1])[None, :, None]
    dark = Scan((rgb * (1 - 0.5 * np.clip(fall, 0, 1))).astype(np.uint8), DPI)
    assert crop(dark).shape == dark.shape
    lid = Scan(np.pad(dark.rgb, ((0, 0), (60, 0), (0, 0)), constant_values=25), DPI)
    assert crop(lid).shape == pytest.approx(dark.shape, abs=20)
    assert crop(lid).origin[0] == pytest.approx(60, abs=20)


def test_paper_and_ink_colour():
    scan = page(3)
    assert np.abs(paper_mode(scan) - 0.97).max() < 0.01
    inks = find_inks(scan)
    assert len(inks.inks) == 1
    assert np.abs(inks.inks[0].colour - 0.97 * np.array(BLUE)).max() < 0.03
    assert inks.inks[0].zero == pytest.approx(0.30)


def test_two_inks_have_an_axis_each():
    blue, red = page(3).rgb, page(3, colour=(0.75, 0.2, 0.2)).rgb
    both = np.where(np.arange(blue.shape[0])[:, None, None] < 230, blue, red)
    inks = find_inks(Scan(both, DPI)).inks
    assert len(inks) == 2
    hues = sorted(int(np.argmax(ink.colour)) for ink in inks)
    assert hues == [0, 2]


@pytest.mark.parametrize("level", [0.97, 0.3])
def test_nothing_but_paper(level):
    blank = scan_of(np.zeros((400, 500), dtype=np.float32), paper=level)
    with pytest.raises(InputError, match="nothing but paper"):
        find_inks(blank)


def squared(shape, colour, pitch=5.0, width=0.25):
    """Paper with squares: (h, w, 3)."""
    paper = np.full((*shape, 3), 0.95)
    step = pitch * DPI / 25.4
    for axis in (0, 1):
        at = np.arange(shape[axis])
        on = np.abs((at + step / 2) % step - step / 2) < width / 2 * DPI / 25.4
        paper[on if axis == 0 else (slice(None), on)] = colour
    return paper


@pytest.mark.parametrize(
    ("rules", "pen"), [((0.85, 0.45, 0.55), BLUE), ((0.55, 0.65, 0.90), BLUE), ((0.6, 0.6, 0.6), (0.1, 0.1, 0.1))]
)
def test_squares_are_not_ink_and_letters_stay_whole(rules, pen):
    paper = squared(INK.shape, rules)
    scan = scan_of(INK, paper=paper, colour=pen)
    bare, count = erase_printed_lines(scan)
    assert count in (22, 23)  # 7 across, 16 down; what lies on the edge of the picture is none
    values = find_density(bare, find_inks(bare)).values
    square = (paper[:, :, 0] < 0.94) & (INK < 0.01)
    square[[0, 1, 2, -3, -2, -1]] = square[:, [0, 1, 2, -3, -2, -1]] = False
    assert (values[square] > 0).mean() < 0.03
    assert (values[INK > 0.9] > 0).mean() > 0.99


@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
def test_rules_are_taken_out_however_the_sheet_lies(quarters):
    paper = np.full((*INK.shape, 3), 0.95)
    rules = [k + y for k in range(59, INK.shape[0] - 10, 89) for y in range(3)]  # 7.5 mm apart
    paper[rules] = 0.6
    lying = scan_of(INK, paper=paper, colour=(0.1, 0.1, 0.1)).turn_quarters(quarters)
    prepared = prepare(lying)
    upright = prepared.turn_quarters(-quarters)
    assert prepared.erased == upright.erased == 5
    bare = (np.arange(INK.shape[0])[:, None] == rules).any(axis=1)[:, None] & (INK < 0.01)
    assert (upright.scan.rgb[bare] > 225).mean() > 0.97


def test_nothing_stays_of_rules_that_wave_between_rows_of_pixels():
    rng = np.random.default_rng(5)
    y, x = np.mgrid[:700, :1100].astype(np.float64)
    ways = np.arange(100, 660, 118)[:, None] + 0.0033 * x[0] + 0.7 * np.sin(x[0] / 120)
    screened = 105 * (0.8 + 0.4 * rng.random(1100))
    grey = 253 - sum(np.clip(1.6 - np.abs(y - way), 0, 1) * screened for way in ways)
    stroke = (((x - y.round() // 118 * 47) % 61 < 5) & ((y - 60) % 118 < 52)) & (y < 640)
    grey = np.where(stroke, np.minimum(grey, 110), grey) + rng.normal(0, 2, grey.shape)
    bare, count = erase_printed_lines(Scan(grey.clip(0, 255).astype(np.uint8)[:, :, None].repeat(3, axis=2), 300.0))
    dark = bare.rgb[:, :, 0] < 200
    assert count == len(ways)
    assert (dark == stroke).mean() > 0.9999  # without half pixels 100 and more bits stay beside the strokes


def test_underlines_are_no_ruling():
    ink = INK.copy()
    ink[200:205, 100:800] = 1
    scan = scan_of(ink)
    assert erase_printed_lines(scan) == (scan, 0)


def test_scale_ends():
    scale = find_scale(page(3), find_inks(page(3)))
    assert scale.density(np.array([0.0, 1.0])) == pytest.approx([0, 1])
    levels = np.linspace(0, 4, 200)
    assert (np.diff(scale.density(levels)) >= 0).all()
    assert scale.density(levels).max() <= 2


def test_scale_makes_levels_uniform():
    rng = np.random.default_rng(0)
    levels = rng.beta(3, 2, 200_000)
    counts, _ = np.histogram(levels, bins=800, range=(0, 4))
    even = Scale(counts.astype(float)).density(levels)
    assert np.percentile(even, [25, 50, 75]) / even.max() == pytest.approx([0.25, 0.5, 0.75], abs=0.04)


def test_pens_of_other_strength_become_comparable():
    dark = page(3, colour=(0.1, 0.1, 0.2))
    pale = page(3, colour=(0.5, 0.5, 0.65))
    means = []
    for scan in (dark, pale):
        values = find_density(scan, find_inks(scan)).values
        means.append(values[values > 0].mean())
    assert means[0] == pytest.approx(means[1], rel=0.08)


def test_pooled_scale_lies_between():
    a, b = (find_scale(scan, find_inks(scan)) for scan in (page(3), page(3, colour=(0.5, 0.5, 0.65))))
    level = np.array([0.4])
    both = pooled_scale([a, b]).density(level)
    assert min(a.density(level), b.density(level)) <= both <= max(a.density(level), b.density(level))


def test_table_agrees_with_the_formula():
    scan = page(3)
    inks = find_inks(scan)
    scale = find_scale(scan, inks)
    exact = scale.density(np.clip(inks.levels(scan.rgb / 255.0).max(axis=-1), 0, None))
    found = look_up(density_table(inks, scale, scan.rgb), scan.rgb)
    inky = exact > 0
    assert np.abs(found - exact)[inky].mean() < 0.01
    assert np.percentile(np.abs(found - exact)[inky], 99) < 0.06
    assert (found[inks.levels(scan.rgb / 255.0).max(axis=-1) < -0.1] == 0).all()
