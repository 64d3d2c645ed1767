"""The reader of pen paths: what it may not depend on, and that it reads what the drawn hands write."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.alphabet import fold
from handout.errors import InputError
from handout.hand import library
from handout.motion.trace import trace
from handout.values import Page
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout_lab.reading import pen_paths
from handout_lab.reading.path_features import COUNT, SETTINGS, features, sampled, slant_of


def written(text, name="house-joined"):
    """Strokes of one word, mm, and where it stands."""
    hand, rng = library.load(name), np.random.default_rng(3)
    (sheet,) = compose(text, hand, Layout(Page(150, 60), x_height=3.0, jitter=0.5), rng)
    strokes = [stroke.xy for stroke in trace(sheet, hand, rng, jitter=0.5).strokes]
    middle = np.array([float(np.concatenate(strokes)[:, 0].mean())])
    return strokes, float(sheet.lines[0].height_at(middle)[0]), sheet.x_height


def random_network(seed):
    """A network of the shipped kind, with random weights."""
    rng = np.random.default_rng(seed)

    def weights(*shape):
        return (rng.normal(0, 1, shape) / np.sqrt(np.prod(shape[:-1]))).astype(np.float32)

    shapes = ((COUNT, 8, 5, 2, 1), (8, 12, 5, 2, 1), (12, 12, 3, 1, 2))
    layers = tuple(
        pen_paths.Layer(weights(size, before, after), weights(after), stride, dilation)
        for before, after, size, stride, dilation in shapes
    )
    classes = len(pen_paths.LETTERS) + 1
    return pen_paths.PathNetwork(pen_paths.LETTERS, layers, weights(12, classes), weights(classes))


@given(st.integers(0, 1000), st.floats(0.5, 20), st.floats(-300, 300))
@settings(max_examples=15, deadline=None)
def test_place_and_size_on_the_page_do_not_matter(seed, size, shift):
    rng = np.random.default_rng(seed)
    strokes = [np.cumsum(rng.normal(0.1, 0.3, (20, 2)), axis=0) for _ in range(3)]
    network = random_network(seed)
    here = pen_paths.log_probability(strokes, "an", 0.0, 1.0, network=network)
    there = [xy * size + (shift, 2 * shift) for xy in strokes]
    assert pen_paths.log_probability(there, "an", 2 * shift, size, network=network) == pytest.approx(here, rel=1e-3)


def test_many_candidates_are_judged_as_each_alone():
    rng = np.random.default_rng(1)
    candidates = [[np.cumsum(rng.normal(0.05, 0.2, (n, 2)), axis=0)] for n in (12, 40, 90)]
    network = random_network(2)
    together = pen_paths.path_log_likelihood(candidates, "of", 0.0, 1.0, network=network)
    alone = [pen_paths.log_probability(one, "of", 0.0, 1.0, network=network) for one in candidates]
    assert together.tolist() == alone


def test_points_lie_an_even_way_apart_and_the_air_has_its_own():
    straight, dot = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0]]), np.array([[1.0, 1.5]])
    path = sampled([straight, dot])
    first = path.xy[path.piece == 0]
    gaps = np.hypot(*np.diff(first, axis=0).T)
    assert np.abs(gaps - SETTINGS.step).max() < 0.05
    assert (~path.down).sum() == SETTINGS.in_air
    assert np.isfinite(features(path)).all()
    # the bar of a cross is seen from under it
    assert features(path)[:, -6:].max() > 0


@given(st.floats(-0.8, 0.8))
@settings(max_examples=10, deadline=None)
def test_slant_is_seen(slant):
    y = np.linspace(1, 0, 20)
    assert slant_of([np.column_stack([slant * y, y])]) == pytest.approx(slant, abs=1e-6)


def test_a_network_comes_back_from_its_file(tmp_path):
    network = random_network(4)
    pen_paths.save(network, tmp_path / "a.npz")
    again = pen_paths.load(tmp_path / "a.npz")
    described = [np.random.default_rng(0).normal(size=(30, COUNT)).astype(np.float32)]
    np.testing.assert_allclose(network.logits(described)[0], again.logits(described)[0], atol=0.05)
    (tmp_path / "b.npz").write_bytes(b"no network")
    with pytest.raises(InputError, match=r"b\.npz"):
        pen_paths.load(tmp_path / "b.npz")


def test_no_path_is_an_error():
    with pytest.raises(ValueError, match="no path"):
        pen_paths.read([])


@pytest.mark.parametrize("name", ["house-joined", "house-print"])
def test_words_of_the_drawn_hands_are_read(name):
    wrong = letters = 0
    for text in ("bramble", "hotel", "fudge", "quickly", "waves"):
        strokes, baseline, x_height = written(text, name)
        wrong += pen_paths.edits(text, pen_paths.read(strokes, baseline, x_height).text)
        letters += len(text)
    assert wrong / letters < 0.25


def test_the_written_text_is_likelier_than_others_and_than_the_path_turned_round():
    strokes, baseline, x_height = written("ladder")
    right = pen_paths.log_probability(strokes, "ladder", baseline, x_height)
    assert right > pen_paths.log_probability(strokes, "lander", baseline, x_height)
    assert right <= 0
    backwards = [xy[::-1] for xy in strokes[::-1]]
    assert right > pen_paths.log_probability(backwards, "ladder", baseline, x_height)


def test_the_line_is_guessed_where_it_is_not_known():
    strokes, baseline, x_height = written("harbour")
    known, guessed = pen_paths.read(strokes, baseline, x_height).text, pen_paths.read(strokes).text
    assert pen_paths.edits(known, guessed) <= 2


def test_letters_have_stretches_in_their_order():
    strokes, baseline, x_height = written("minute")
    spans = pen_paths.spans(strokes, "minute", baseline, x_height)
    assert spans.shape == (6, 2)
    assert (np.diff(spans[:, 0]) > 0).all()
    assert (spans[:, 0] <= spans[:, 1]).all()
    assert spans.max() <= sum(map(len, strokes)) - 1


def test_marks_that_readers_do_not_know_do_not_count():
    assert pen_paths.labels_of("é") == pen_paths.labels_of("e")
    assert pen_paths.labels_of("漢") == ()
    assert all(fold(letter) == letter for letter in pen_paths.LETTERS)
