"""Words for the training of the reader of pen paths."""

from itertools import islice

import numpy as np

from handout.hand import library
from handout_lab.reading import pen_paths
from handout_lab.training.path_reader import load_words, save_words, targets
from handout_lab.training.path_words import path_words, varied


def some(count=12):
    hands = [library.load(name) for name in ("house-joined", "house-print")]
    return list(islice(path_words(hands, [], ["The quick brown fox jumps over it"], np.random.default_rng(2)), count))


def test_words_have_their_letters_and_come_back_from_a_file(tmp_path):
    words = some()
    for word in words:
        assert [len(of) for of in word.of] == [len(xy) for xy in word.strokes]
        assert set(np.concatenate(word.of)) == set(range(len(word.text)))
    save_words(words, tmp_path / "words.npz")
    again = load_words(tmp_path / "words.npz")
    assert [word.text for word in again] == [word.text for word in words]
    np.testing.assert_allclose(again[3].strokes[0], words[3].strokes[0], atol=1e-4)


def test_every_letter_has_a_step_of_its_own():
    rng = np.random.default_rng(0)
    for word in some():
        bent = varied(word, rng)
        labels = pen_paths.labels_of(word.text)
        wanted = targets(bent, pen_paths.upright_path(bent.strokes), labels)
        assert set(labels) <= set(wanted.tolist())
