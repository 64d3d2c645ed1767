"""Is it the author's? What must pass passes, and what must fail fails."""

import json

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.scanning.text_lines import line_owners
from handout_lab.cli.score_ import command
from handout_lab.score.comparison import closeness, compare, half_to_half
from handout_lab.score.features import full_lines, measure_lines, page_features, pool_lines
from handout_lab.score.repetition import repetition
from handout_lab.score.two_sample import TwoSample, together, two_sample, wilson
from handout_lab.score.written_lines import find_lines, ink
from tests.lab.score.drawn import page
from tests.lab.score.pages_of_hands import font, house

# they rest on scans that take seconds to make
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def lines():
    return full_lines(measure_lines(house(times=2)))


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def test_lines_are_measured_apart_and_add_up_to_the_page():
    grey = page(lines=6, slant=0.2)
    parts = measure_lines(grey)
    assert len(parts) == 6
    whole, own = page_features(ink(grey)), pool_lines(parts)
    assert np.allclose(whole.hinge, own.hinge) and np.allclose(whole.quill, own.quill)


def test_all_ink_has_an_owner_and_an_ascender_its_own_line():
    mask = ink(page(lines=5, pitch=70))
    found = find_lines(mask)
    own = line_owners(mask, found.lines)
    assert ((own >= 0) == mask).all()
    count, labels = cv2.connectedComponents(mask.astype(np.uint8))
    assert all(len(np.unique(own[labels == i])) == 1 for i in range(1, count))


def test_a_last_word_is_no_full_line():
    grey = page(lines=6)
    grey[int(150 + 5.5 * 110) :, 400:] = 255
    assert len(measure_lines(grey)) == 6 and len(full_lines(measure_lines(grey))) == 5


def test_the_upper_and_the_lower_half_of_a_page_are_of_one_author(lines, rng):
    upper, lower = lines[: len(lines) // 2], lines[len(lines) // 2 :]
    near = closeness(upper, lower, rng, author=lines)
    assert near.ratio.hinge < 1.5 and near.ratio.runs < 1.5 and near.ratio.quill < 1.5
    test = two_sample(upper, lower, rng, permutations=49)
    # left out, a line of few leaves those of the other half in the majority: guessing comes out below one half
    assert test.low < 0.5 and test.p > 0.05 and test.verdict != "told apart"


def test_a_font_shaken_or_not_fails_everything(lines, rng):
    for jitter in (0.0, 0.05):
        assert repetition(font(jitter)) > 0.8
        made = full_lines(measure_lines(font(jitter)))
        assert closeness(lines, made, rng).ratio.hinge > 4
        test = two_sample(lines, made, rng, permutations=49)
        assert test.accuracy > 0.95 and test.verdict == "told apart" and test.p == pytest.approx(0.02)
    assert repetition(house(times=2)) <= 0.02


def test_another_hand_fails(lines, rng):
    made = full_lines(measure_lines(house("house-print")))
    assert closeness(lines, made, rng).ratio.hinge > 3
    assert two_sample(lines, made, rng, permutations=49).verdict == "told apart"


def test_guessing_is_half_right_on_average():
    """Lines of noise: the accuracy must be neither above nor below one half when there is nothing to learn."""
    from handout_lab.score import two_sample as module

    rng = np.random.default_rng(3)
    found = []
    for _ in range(60):
        values = rng.normal(size=(16, 40))
        found.append(module._accuracy(values @ values.T, np.repeat([1.0, -1.0], 8), rng))
    assert np.mean(found) == pytest.approx(0.5, abs=0.05)
    values[:8, 0] += 8
    assert module._accuracy(values @ values.T, np.repeat([1.0, -1.0], 8), rng) == 1.0


def test_a_line_that_is_left_out_teaches_nothing():
    """Changing what is known of the lines left out cannot change the classifier: only their own verdicts."""
    from handout_lab.score import two_sample as module

    rng = np.random.default_rng(1)
    values, label = rng.normal(size=(12, 5)), np.repeat([1.0, -1.0], 6)
    out = np.zeros(12, dtype=bool)
    out[[0, 6]] = True
    told = module._told_right(values @ values.T, label, out[None])[0]
    changed = values.copy()
    changed[6] += 100 * rng.normal(size=5)
    assert module._told_right(changed @ changed.T, label, out[None])[0, 0] == told[0]
    centred = values - values[~out].mean(axis=0)
    y = label[~out] / 5
    inner = centred[~out] @ centred[~out].T
    plain = np.linalg.solve(centred[~out].T @ centred[~out] + np.trace(inner) / 10 * np.eye(5), centred[~out].T @ y)
    score = centred @ plain
    limit = (score[1:6].mean() + score[7:].mean()) / 2
    assert told[out].tolist() == [float(score[0] > limit), float(score[6] < limit)]


@settings(max_examples=40, deadline=None)
@given(st.floats(0, 1), st.floats(1, 500))
def test_the_interval_holds_the_share(share, n):
    low, high = wilson(share, n)
    assert -1e-12 <= low <= share + 1e-9 and share - 1e-9 <= high <= 1 + 1e-12


def test_the_interval_is_wilsons_and_narrows():
    assert wilson(0.5, 100) == pytest.approx((0.4038, 0.5962), abs=1e-4)
    assert wilson(0.0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    one = TwoSample(0.5, *wilson(0.5, 50), 25, 25, 50.0, 0.5)
    more = together([one] * 4)
    assert more.n == 200 and more.real == 100 and more.verdict == "not told apart"
    assert one.verdict == "too few lines to say"


def test_too_few_lines_are_said_to_be_too_few(lines, rng):
    with pytest.raises(InputError, match=r"3 real and .* made lines, too few"):
        two_sample(lines[:3], lines[3:], rng)
    with pytest.raises(InputError, match="3 lines, and comparing halves needs at least 4"):
        half_to_half(lines[:3], rng)
    with pytest.raises(InputError, match="no line"):
        closeness(lines, [], rng)
    found = compare(lines[:2], lines, rng)
    assert found.closeness is None and found.test is None and len(found.notes) == 2


def test_the_same_generator_gives_the_same(lines):
    one, two = (two_sample(lines[::2], lines[1::2], np.random.default_rng(5), permutations=19) for _ in range(2))
    assert one == two
    halves = [half_to_half(lines, np.random.default_rng(5), draws=3) for _ in range(2)]
    assert halves[0] == halves[1] and len(set(halves[0])) > 1


def test_the_command_says_all_of_it(tmp_path):
    crowd = tmp_path / "crowd"
    crowd.mkdir()
    grey = house(times=2)
    middle = int(find_lines(ink(grey)).lines[6].curve[0]) - 55  # pixels: between two lines
    files = {"real": grey[:middle], "made": grey[middle:], "font": font(0.05)}
    for name, grey in files.items():
        cv2.imwrite(str(tmp_path / f"{name}.png"), grey)
    for i, slant in enumerate((0.0, 0.5)):
        cv2.imwrite(str(crowd / f"{i}.png"), page(lines=3, slant=slant))
    paths = [str(tmp_path / f"{name}.png") for name in files]
    said = CliRunner().invoke(command, [*paths, "--crowd", str(crowd), "--json"], catch_exceptions=False).stdout
    found = json.loads(said)
    own, other = found["distances"]
    for row in (own, other):
        assert set(row) >= {"hinge", "runs", "quill", "closeness", "two_sample", "rank", "author_rank", "among"}
        assert set(row["closeness"]) >= {"own", "across", "ratio", "lines", "made"}
        assert set(row["two_sample"]) >= {"accuracy", "low", "high", "n", "p", "verdict"}
    assert own["closeness"]["ratio"]["hinge"] < 2 < other["closeness"]["ratio"]["hinge"]
    assert own["two_sample"]["accuracy"] < 0.85 < 0.95 < other["two_sample"]["accuracy"]
    assert own["rank"] == own["author_rank"] == 1 and own["among"] == 3
    assert own["notes"] == []
    plain = CliRunner().invoke(command, paths[::2], catch_exceptions=False).stdout
    assert "times as far as the author's own halves" in plain and "told apart" in plain
