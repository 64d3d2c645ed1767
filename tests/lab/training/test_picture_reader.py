"""The training of the reader of pictures: the same sets and seed give the same weights."""

import numpy as np
import pytest

from handout.reading import pictures
from handout.reading.word_space import HEIGHT
from handout_lab.training.word_pictures import WordPicture, save

torch = pytest.importorskip("torch")
from handout_lab.training.picture_reader import main  # noqa: E402


@pytest.mark.slow
def test_training_is_the_same_twice(tmp_path):
    rng = np.random.default_rng(0)
    shown = [WordPicture(rng.integers(0, 255, (HEIGHT, 60 + k), dtype=np.uint8), "minimum", "a") for k in range(8)]
    save(shown, tmp_path / "words.npz")
    found = []
    for name in ("a.npz", "b.npz"):
        words, out = str(tmp_path / "words.npz"), str(tmp_path / name)
        main([words, "--pages", words, "--stop", words, "--start", str(pictures.NETWORK), "--batches", "3", "-o", out])
        found.append((tmp_path / name).read_bytes())
    assert found[0] == found[1]
    trained, before = pictures.load(tmp_path / "a.npz"), pictures.load()
    assert trained.letters == before.letters
    assert not np.array_equal(trained.columns[-1][0], before.columns[-1][0])
