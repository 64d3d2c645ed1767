"""The reader of pictures: what it reads, what it doubts, and that probabilities hang together."""

import threading
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from handout.errors import InputError
from handout.hand import library
from handout.hand.author_reader import own_words, picture_of
from handout.networks import one_thread
from handout.reading import ctc, pictures
from handout.reading.word_space import HEIGHT, normalised


@pytest.fixture(scope="module")
def hand():
    return library.find("house-print-fountain")


@pytest.fixture(scope="module")
def words(hand):
    return [word for word in own_words(hand) if len(word.text) > 2 and word.text.isalpha()][:40]


@pytest.fixture(scope="module")
def readings(words):
    reader = pictures.load()
    return [(word.text, reader.read(word.picture)) for word in words]


def test_plain_writing_is_read(readings):
    right = [reading.verdict(text).reads_as == text for text, reading in readings]
    assert np.mean(right) > 0.8


def test_a_wrong_letter_is_doubted(readings):
    """A reader that guesses from the words of a language would not mind a letter that it expects."""
    better = []
    for text, reading in readings:
        wrong = text[:1] + ("k" if text[1] != "k" else "o") + text[2:]
        better.append(reading.log_probability(text) > reading.log_probability(wrong))
    assert np.mean(better) > 0.95


def test_the_wrong_letter_is_named(readings):
    named = []
    for text, reading in readings:
        if reading.verdict(text).probability < 0.5:
            continue
        wrong = text[:1] + ("k" if text[1] != "k" else "o") + text[2:]
        letters = reading.spans(wrong)
        worst = min(range(len(letters)), key=lambda k: letters[k].probability)
        named.append(worst == 1 and letters[1].reads_as == text[1])
    assert np.mean(named) > 0.9


def test_verdicts_and_letters_agree(readings):
    for text, reading in readings:
        verdict = reading.verdict(text)
        assert 0 <= verdict.probability <= verdict.other <= 1
        assert verdict.doubtful == (verdict.probability < verdict.other)
        spans = reading.spans(text)
        assert "".join(letter.letter for letter in spans) == text
        assert all(a.right <= b.left for a, b in pairwise(spans))


def test_letters_alike_count_as_one(readings):
    text, reading = readings[0]
    assert reading.log_probability(text.replace("s", "S")) == reading.log_probability(text)
    assert reading.verdict("Il1|").probability == reading.verdict("llll").probability


def test_temperature_leaves_the_likeliest_path_as_it_is(words):
    sure, unsure = pictures.load(), replace(pictures.load(), temperature=3.0)
    for word in words[:5]:
        a, b = sure.read(word.picture), unsure.read(word.picture)
        assert ctc.greedy(a.log_posteriors) == ctc.greedy(b.log_posteriors)
        assert b.log_posteriors.max() < a.log_posteriors.max()


def test_ink_is_read_alike_pale_or_dark(words):
    reader = pictures.load()
    for word in words[:5]:
        pale = reader.read(0.5 * np.maximum(word.picture, 0.0))
        assert pale.log_probability(word.text) == pytest.approx(
            reader.read(word.picture).log_probability(word.text), abs=0.7
        )


def test_a_picture_of_the_wrong_height_is_refused():
    with pytest.raises(ValueError, match="expected"):
        pictures.load().read(np.zeros((HEIGHT + 1, 20)))


def blas_threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_a_word_reads_alike_in_any_company(words):
    """To the last bit, on processors of any kind: each is a product of its own."""
    reader, seen = pictures.load(), [word.picture for word in words]
    alone = [reader.features(picture).tobytes() for picture in seen]
    reader.seen.clear()
    assert [features.tobytes() for features in reader.features_of(seen)] == alone
    for company in (2, 3, 7, 31):  # of one width: they go through the network together
        together = reader._features(np.stack([normalised(seen[0])] * company))
        assert {features.tobytes() for features in together} == {alone[0]}
    readings = reader.read_all(seen)
    together = pictures.log_probabilities(readings, [word.text for word in words]).tolist()
    assert together == [reader.read(word.picture).log_probability(word.text) for word in words]


def test_a_picture_that_was_read_is_not_put_through_the_network_again(monkeypatch, words):
    reader, seen, count, features = pictures.load(), [word.picture for word in words], [], pictures.Reader._features
    monkeypatch.setattr(pictures.Reader, "_features", lambda *given: (count.append(len(given[1])), features(*given))[1])
    monkeypatch.setattr(pictures, "_SEEN", 2 * len(seen))
    reader.seen.clear()
    first = reader.features_of([*seen, seen[0]])
    again = reader.with_last_layer(np.vstack(reader.columns[-1])).features_of(seen)
    assert sum(count) == len({normalised(picture).tobytes() for picture in seen})
    assert all(map(np.array_equal, first, again))
    monkeypatch.setattr(pictures, "_SEEN", 1)
    reader.features_of(seen[:2])
    assert len(reader.seen) == 2, "others make room"


def test_networks_multiply_in_one_thread(monkeypatch, words):
    pictures.load().seen.clear()
    seen, features = [], pictures.Reader._features
    monkeypatch.setattr(pictures.Reader, "_features", lambda *given: (seen.append(blas_threads()), features(*given))[1])
    with threadpool_limits(2, user_api="blas"):
        pictures.load().read(words[0].picture)
        assert blas_threads() == {2}
    assert seen == [{1}]


def test_one_thread_may_be_entered_again_and_by_others():
    with threadpool_limits(2, user_api="blas"):
        with one_thread:
            other = threading.Thread(target=one_thread(lambda: None))
            other.start()
            other.join()
            with one_thread:
                assert blas_threads() == {1}
            assert blas_threads() == {1}
        assert blas_threads() == {2}


def test_blank_paper_reads_as_nothing():
    assert pictures.load().read(np.zeros((HEIGHT, 30))).text == ""
    assert not normalised(np.zeros((HEIGHT, 3))).any()


def test_what_is_no_letter_is_refused(readings):
    with pytest.raises(ValueError, match="no letter"):
        readings[0][1].log_probability("漢")


def test_a_file_that_is_no_reader_is_named(tmp_path):
    path = tmp_path / "no.npz"
    path.write_bytes(b"no")
    with pytest.raises(InputError, match="no reader"):
        pictures.load(path)


def test_a_word_brings_its_own_ink_alone(hand, words):
    """Two halves of a word have between them the ink of the whole."""
    word = next(word for word in words if len(word.text) >= 6)
    halves = [picture_of(hand, word.glyphs[:3]), picture_of(hand, word.glyphs[3:])]
    whole = word.picture.sum()
    assert sum(half.sum() for half in halves) == pytest.approx(whole, rel=0.1)
    assert all(half.shape[0] == HEIGHT and half.sum() < 0.9 * whole for half in halves)
