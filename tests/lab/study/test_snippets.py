"""Real words as they were scanned, and a hand that never saw them."""

import numpy as np
import pytest
from scipy.ndimage import label

from handout_lab.study import evenness
from handout_lab.study.snippets import LooseLetters, Picture, WrittenWords, is_word, runs_on, without_lines


@pytest.fixture(scope="module")
def words(small_hand):
    return WrittenWords(small_hand, 0)


def test_runs_are_words_that_stand_beside_each_other(words):
    runs = list(words.runs())
    assert runs and all(len(run.words) >= 2 for run in runs)
    for run in runs:
        assert run.text in words.page.transcript.splitlines()[run.line]
    assert len({word for run in runs for word in run.words}) == sum(len(run.words) for run in runs)
    assert max(words.picture(run, 0.0, 300.0).width for run in words.runs(40.0)) < 42


@pytest.mark.parametrize(
    ("text", "word"),
    [(text, True) for text in ("a", "I", "Squares,", '"tock".', "(and", "brother-in-law's", "Zsófia", "Mr.", "ка́к?")]
    + [(text, False) for text in ("ÄÄ", "éé", "C:", "D.", "|", "…", "{walnut}.", "<10", "LS31", "£12,", "*not*", "15")],
)
def test_words_of_running_text_are_told_from_lists_and_signs(text, word):
    assert is_word(text) == word and runs_on(text) == (word or text == "15")


def test_loose_letters_are_any_of_the_hand_equally_far_apart(words, small_hand):
    letters = LooseLetters(small_hand)
    run, rng = next(iter(words.runs())), np.random.default_rng
    picture = letters.picture(run.text, 3.0, 0.0, 300.0, rng(1))
    assert picture.rgb.tobytes() == letters.picture(run.text, 3.0, 0.0, 300.0, rng(1)).rgb.tobytes()
    assert picture.rgb.tobytes() != letters.picture(run.text, 3.0, 0.0, 300.0, rng(2)).rgb.tobytes()
    assert letters.picture(run.text, 6.0, 0.0, 300.0, rng(1)).width == pytest.approx(2 * picture.width, rel=0.02)
    above = 255.0 - picture.rgb[: round(picture.base)].mean()
    assert above > 255.0 - picture.rgb[round(picture.base) :].mean() and 0 < picture.base < len(picture.rgb)
    assert letters.picture("ж" + run.text, 3.0, 0.0, 300.0, rng(1)) is None


def test_a_picture_is_the_ink_of_its_words_alone(words):
    page, (run, *_) = words.page, list(words.runs())
    slope = float(np.diff(page.base(run.line, np.array([0.0, 100.0])))[0] / 100)
    picture = words.picture(run, -slope, page.dpi)  # as it lies on the page
    ink = 255.0 - picture.rgb.mean(axis=2)
    word, _, _ = words.owner
    rows, columns, vertex = words.nearest
    own = np.isin(word[vertex], run.words)
    light = (
        (255.0 - page.texture.rgba[rows[own], columns[own], :3].mean(axis=1))
        * page.texture.alpha[rows[own], columns[own]]
        / 255
    )
    assert ink.sum() == pytest.approx(light.sum(), rel=0.02)
    assert 0 < picture.base < len(ink) and picture.rgb.shape[1] == pytest.approx(np.ptp(columns[own]) + 1, abs=5)
    twice = words.picture(run, -slope, 2 * page.dpi)
    assert twice.width == pytest.approx(picture.width, abs=0.3)


def test_a_picture_is_turned_to_the_slope_that_is_asked_for(words):
    def lean(slope):
        rows, columns = np.nonzero(words.picture(next(iter(words.runs())), slope, 300.0).rgb.mean(axis=2) < 200)
        return np.polyfit(columns, -rows, 1)[0]

    assert lean(0.05) - lean(-0.05) == pytest.approx(0.1, abs=0.02)


def test_a_hand_without_a_line_has_nothing_of_it(small_hand):
    less = without_lines(small_hand, {(0, 1)})
    gone = [glyph for glyph in small_hand.glyphs if glyph.line == 1]
    assert len(less.glyphs) == len(small_hand.glyphs) - len(gone)
    assert {glyph.line for glyph in less.glyphs} == {0, 2}
    before, after = small_hand.pages[0], less.pages[0]
    middle = np.concatenate(
        [before.graph.uv[small_hand.body(k)] for k, g in enumerate(small_hand.glyphs) if g.line == 1]
    )
    x, y = np.rint(middle - np.array(before.texture.corner)).astype(int).T
    assert (before.texture.alpha[y, x] > 0).mean() > 0.95 and (after.texture.alpha[y, x] > 0).mean() < 0.01
    for number, glyph in enumerate(less.glyphs):  # what stays lies where it lay
        same = next(g for g in small_hand.glyphs if g.at == glyph.at)
        assert np.array_equal(after.graph.uv[glyph.vertices], before.graph.uv[same.vertices])
        assert np.allclose(less.centre(number), small_hand.centre(small_hand.glyphs.index(same)), atol=0.2)
    assert label(after.texture.alpha > 0)[1] > 0


def test_of_tests_made_together_the_least_counts_as_often_as_there_are():
    assert evenness.holm(np.array([0.04, 0.01, 0.5, 0.03])) == pytest.approx([0.09, 0.04, 0.5, 0.09])
    assert evenness.holm(np.array([0.4, 0.9])) == pytest.approx([0.8, 0.9])


def test_what_is_not_even_is_told():
    rng = np.random.default_rng(1)

    def picture(depth):
        rgb = np.full((60, 300, 3), 255, dtype=np.uint8)
        rgb[20:30, 10:290] = np.clip(255 - depth - rng.integers(0, 20, (10, 280, 1)), 0, 255)
        return Picture(rgb, 30.0, 300.0)

    def told(dark):
        made, real = [picture(dark) for _ in range(12)], [picture(120) for _ in range(12)]
        return {tell.name for tell in evenness.tells(made, real) if tell.tells}

    assert "darkness" in told(160) and "darkness" not in told(120)
