"""Networks learn, are stored small, and what is not a network is refused."""

from dataclasses import replace

import numpy as np
import pytest

from handout.alphabet import LETTERS, THIRDS
from handout.errors import InputError
from handout.tagging import network
from handout.tagging.line_space import COUNT
from handout_lab.training import letter_networks
from handout_lab.training.letter_networks import round_weights, save, start_network

STATES = len(LETTERS) * THIRDS
WIDTHS = np.full(len(LETTERS), 0.8, np.float32)


def toy(rng, n=900, kinds=6):
    """Noise with a bright stretch that tells which of a few states it is."""
    states = rng.integers(0, kinds, n)
    features = rng.integers(0, 60, (n, COUNT)).astype(np.uint8)
    for row, kind in enumerate(states):
        features[row, kind * 100 : kind * 100 + 30] += 120
    return network.LabelledColumns(features, states)


@pytest.fixture(scope="module")
def learned():
    rng = np.random.default_rng(3)
    columns = toy(rng)
    start = start_network(columns, WIDTHS, 24, rng)
    return start, network.train_network(start, columns, epochs=14, rate=3e-3, rng=rng)


def test_it_learns_and_leaves_the_first_network_alone(learned):
    start, after = learned
    columns = toy(np.random.default_rng(4))
    assert (after.log_posterior(columns.features).argmax(axis=1) == columns.states).mean() > 0.95
    assert (start.log_posterior(columns.features).argmax(axis=1) == columns.states).mean() < 0.5


def test_probabilities_sum_to_one_and_average(learned):
    features = toy(np.random.default_rng(5), 20).features
    each = [np.exp(one.log_posterior(features)) for one in learned]
    assert each[0].sum(axis=1) == pytest.approx(np.ones(20), abs=1e-5)
    assert np.exp(network.average_logs([one.log_posterior(features) for one in learned])) == pytest.approx(
        (each[0] + each[1]) / 2, abs=1e-6
    )


def test_gradients_are_those_of_the_loss(monkeypatch):
    monkeypatch.setattr(network, "_RECIPE", network.TaggerRecipe(input_dropout=-1.0, dropout=-1.0))
    rng = np.random.default_rng(6)
    sizes = ((7, 5), (5, 5), (5, 4))
    parameters = [rng.normal(0, 0.5, s) for s in sizes] + [rng.normal(0, 0.1, s[1]) for s in sizes]
    x, wanted = rng.normal(0, 1, (9, 7)), rng.integers(0, 4, 9)

    def loss(values):
        a = np.maximum(x @ values[0] + values[3], 0)
        # keeping everything with probability 2 halves what is kept
        b = np.maximum(a @ values[1] + values[4], 0) / 2
        z = b @ values[2] + values[5]
        log = z - np.log(np.exp(z).sum(axis=1, keepdims=True))
        smooth = 0.05 / 4
        target = np.full(log.shape, smooth)
        target[np.arange(9), wanted] += 0.95
        return -(target * log).sum() / 9

    gradients, _ = network._gradients(parameters, x, wanted, None, rng)
    for which, place in ((0, (2, 3)), (1, (1, 1)), (2, (4, 0)), (3, (2,)), (5, (1,))):
        step = 1e-6
        moved = [p.copy() for p in parameters]
        moved[which][place] += step
        back = [p.copy() for p in parameters]
        back[which][place] -= step
        assert gradients[which][place] == pytest.approx((loss(moved) - loss(back)) / (2 * step), rel=1e-3, abs=1e-6)


def test_it_is_read_as_it_was_written(learned, tmp_path):
    path = tmp_path / "net.npz"
    save(learned[1], path)
    back = network.load(path)
    features = toy(np.random.default_rng(7), 50).features
    in_steps = replace(learned[1], weights=tuple(map(np.multiply, *round_weights(learned[1]))))
    assert back.log_posterior(features) == pytest.approx(in_steps.log_posterior(features), abs=0.1)
    assert back.widths == pytest.approx(WIDTHS, abs=1e-3)


def test_a_network_in_steps_packs_to_half_and_reads_nearly_alike(tmp_path):
    shipped = network.load_networks()[0]
    save(shipped, tmp_path / "again.npz")
    again = network.load(tmp_path / "again.npz")
    assert all(np.array_equal(a, b) for a, b in zip(again.weights, shipped.weights, strict=True))
    rng = np.random.default_rng(8)
    # not in steps, as networks come from training
    trained = replace(
        shipped, weights=tuple(w + rng.normal(0, 0.01 * w.std(), w.shape).astype(np.float32) for w in shipped.weights)
    )
    save(trained, tmp_path / "rounded.npz")
    np.savez_compressed(tmp_path / "halves.npz", *(w.astype(np.float16) for w in trained.weights))
    assert (tmp_path / "rounded.npz").stat().st_size < 0.5 * (tmp_path / "halves.npz").stat().st_size
    features = rng.integers(0, 120, (200, COUNT)).astype(np.uint8)
    before, after = (each.log_posterior(features) for each in (trained, network.load(tmp_path / "rounded.npz")))
    assert (np.exp(before) * (before - after)).sum(axis=1).mean() < 0.02  # nats


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04 broken", b"not a zip at all"])
def test_what_is_no_network_is_refused(tmp_path, data):
    path = tmp_path / "net.npz"
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"net\.npz"):
        network.load(path)


def test_a_network_for_other_letters_is_refused(learned, tmp_path, monkeypatch):
    path = tmp_path / "net.npz"
    monkeypatch.setattr(letter_networks, "LETTERS", "abc")
    save(learned[1], path)
    monkeypatch.undo()
    with pytest.raises(InputError, match="train it anew"):
        network.load(path)


def test_nothing_pickled_is_read(tmp_path):
    path = tmp_path / "net.npz"
    np.savez(path, letters=np.array([object()], dtype=object))
    with pytest.raises(InputError, match=r"net\.npz"):
        network.load(path)


def test_the_shipped_networks_are_small_and_fit():
    found = network.load_networks()
    assert found
    assert all(sum(w.size for w in one.weights) * 2 < 3e6 for one in found)
