"""The training of the reader of pictures: the same sets and seed give the same weights, read by numpy as by torch."""

import numpy as np
import pytest

from handout.hand import library
from handout.hand.author_reader import own_words
from handout.reading import pictures
from handout.reading.word_space import HEIGHT
from handout_lab.training.word_pictures import WordPicture, save

torch = pytest.importorskip("torch")
from handout_lab.training import picture_reader as training  # noqa: E402
from handout_lab.training.picture_reader import Recipe, Words  # noqa: E402


def test_numpy_reads_as_torch_does(tmp_path):
    """With layers that are added among those over rows, and normalisations that do something."""
    torch.manual_seed(3)
    net, rng = training.network(Recipe()).eval(), np.random.default_rng(3)
    for name, values in net.state_dict().items():
        if "running_var" in name:
            values.copy_(0.5 + torch.rand_like(values))
        elif "running_mean" in name:
            values.copy_(0.1 * torch.randn_like(values))
    save([WordPicture(rng.integers(0, 255, (HEIGHT, 61), dtype=np.uint8), "a", "b")], tmp_path / "words.npz")
    words = Words.load(tmp_path / "words.npz")
    training.save(net, Recipe(), 1.0, tmp_path / "reader.npz")
    with torch.no_grad():
        expected = net(training.batch_of(words, [0], None)[0])[0].numpy().T
    # without the normalisation of the ink's darkness, which the sets have had
    picture = words.picture(0) / np.float32(255)
    reader = pictures.load(tmp_path / "reader.npz")
    seen = reader.reading(reader._features(picture[None])[0]).logits
    assert seen == pytest.approx(expected, abs=0.03)
    assert np.ptp(expected) > 0.3


def test_words_are_cut_out_of_lines_where_no_ink_is():
    words = [w for w in own_words(library.find("house-print-fountain")) if w.text.isalpha()][:3]
    paper = np.zeros((HEIGHT, 12))
    line = np.hstack([paper, *(part for word in words for part in (word.picture, paper))])
    text = " ".join(word.text for word in words)
    lines = Words((line * 255).astype(np.uint8), np.array([line.shape[1]]), (text,), ("a",))
    apart = training.with_words_apart(lines, pictures.load(), np.random.default_rng(0))
    assert apart.texts[0] == text
    assert " ".join(apart.texts[1:]) == text
    assert len(apart) > 2
    assert sum(apart.picture(k).shape[1] for k in range(1, len(apart))) == line.shape[1]
    assert {apart.sources[k] for k in range(len(apart))} == {"a"}
    for k in range(1, len(apart)):
        assert apart.picture(k)[:, [0, -1]].max() < 40


@pytest.mark.slow
def test_training_is_the_same_twice(tmp_path):
    rng = np.random.default_rng(0)
    shown = [WordPicture(rng.integers(0, 255, (HEIGHT, 60 + k), dtype=np.uint8), "minimum", "a") for k in range(8)]
    save(shown, tmp_path / "words.npz")
    found = []
    for name in ("a.npz", "b.npz"):
        words, out = str(tmp_path / "words.npz"), str(tmp_path / name)
        training.main(
            [words, "--pages", words, "--stop", words, "--start", str(pictures.NETWORK), "--batches", "3", "-o", out]
        )
        found.append((tmp_path / name).read_bytes())
    assert found[0] == found[1]
    trained, before = pictures.load(tmp_path / "a.npz"), pictures.load()
    assert trained.letters == before.letters
    assert not np.array_equal(trained.columns[-1][0], before.columns[-1][0])
