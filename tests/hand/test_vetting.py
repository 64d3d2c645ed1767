"""Glyphs that are not what they are called, told from their siblings."""

from dataclasses import replace

import numpy as np
import pytest

from handout.errors import InputError
from handout.hand import author_reader, outlier_score
from handout.hand.glyph_features import COUNT, glyph_features
from handout.hand.vetting import vet
from handout_lab.training.glyph_vetting import save


@pytest.fixture(scope="module")
def score(small_hand):
    def of(hand):
        return outlier_score.load_model().score(glyph_features(hand), [glyph.letter for glyph in hand.glyphs])

    return of


def changed(hand, number, **values):
    glyphs = list(hand.glyphs)
    glyphs[number] = replace(glyphs[number], **values)
    return replace(hand, glyphs=tuple(glyphs))


def test_half_a_glyph_is_less_probable_than_the_whole(small_hand, score):
    number = int(small_hand.numbers_of_letter("n")[1])
    glyph = small_hand.glyphs[number]
    y = small_hand.outline(number)[:, 1]
    half = changed(small_hand, number, vertices=glyph.vertices[y < np.median(y)], ligatures=())
    half = changed(half, glyph.before, ligatures=()) if glyph.before >= 0 else half
    assert score(half)[number] > score(small_hand)[number] + 1
    assert vet(half).probability[number] < vet(small_hand).probability[number]


def test_a_glyph_under_another_name_is_the_first_to_look_at(small_hand):
    number = int(small_hand.numbers_of_letter("e")[0])
    before = vet(small_hand).probability
    after = vet(changed(small_hand, number, letter="h"))
    assert after.probability[number] < before[number]
    assert number in after.worst_first[:5]


def test_a_glyph_that_reads_as_another_letter_is_strange_and_marks_are_not_read(small_hand):
    number = int(small_hand.numbers_of_letter("e")[0])
    before, after = (author_reader.strangeness(hand) for hand in (small_hand, changed(small_hand, number, letter="h")))
    assert after[number] > 2 > before[number]
    marks = [i for i, glyph in enumerate(small_hand.glyphs) if not glyph.letter.isalnum()]
    assert marks and not before[marks].any()


def test_most_glyphs_of_a_good_hand_are_sure_and_none_without_name_or_confidence_is(small_hand):
    vetting = vet(small_hand)
    assert np.median(vetting.probability) > 0.8
    assert vet(changed(small_hand, 0, letter="")).verdict(0) == "refused"
    assert vet(changed(small_hand, 0, confidence=0.0)).verdict(0) == "refused"


def test_the_shape_of_a_letter_without_siblings_says_less(small_hand):
    letters = [glyph.letter for glyph in small_hand.glyphs]
    trust = outlier_score.Siblings(outlier_score.load_model(), glyph_features(small_hand), letters).trust
    for letter in set(letters):
        assert trust[letters.index(letter)] == pytest.approx(1 - outlier_score.LONE / letters.count(letter))


def test_a_lone_letter_that_lost_its_stem_is_told_by_how_it_reads(small_hand):
    (number,) = small_hand.numbers_of_letter("p").tolist()
    height = small_hand.outline(number)[:, 1] * small_hand.pitch
    bowl = small_hand.glyphs[number].vertices[height > 0]
    stemless = changed(small_hand, number, vertices=bowl, ligatures=())
    before, after = (1 - vet(hand).probability[number] for hand in (small_hand, stemless))
    assert after > 4 * before and after > 0.15


def test_a_hand_of_one_glyph_can_be_judged(small_hand):
    lone = replace(small_hand.glyphs[0], before=-1, after=-1, ligatures=())
    vetting = vet(replace(small_hand, glyphs=(lone,)))
    assert vetting.probability.shape == (1,) and 0 <= vetting.probability[0] <= 1
    assert not len(vet(replace(small_hand, glyphs=())).probability)


def test_covariances_are_shrunken_less_the_more_is_known():
    rng = np.random.default_rng(1)
    spread = np.linspace(0.3, 3.0, 6)
    few, many = (outlier_score.shrunken(rng.normal(0, spread, (count, 6))) for count in (8, 4000))
    away = [np.abs(np.diag(part) - spread**2).max() for part in (few, many)]
    assert away[1] < 0.6 < away[0] and np.linalg.eigvalsh(few).min() > 0


def test_what_is_no_model_is_refused(tmp_path):
    path = tmp_path / "a.npz"
    path.write_bytes(b"PK\x03\x04")
    with pytest.raises(InputError, match="cannot be read as a model of outliers"):
        outlier_score.load(path)
    save(outlier_score.load_model(), path)
    again = outlier_score.load(path)
    assert again.weights.shape == (8 + COUNT,) and set(again.centres) == set(outlier_score.load_model().centres)
