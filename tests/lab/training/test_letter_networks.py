"""The networks are trained on synthetic lines alone, and the same seed trains the same network."""

import numpy as np
import pytest

from handout.alphabet import INDEX
from handout.errors import InputError
from handout.hand import library
from handout.tagging import network
from handout.tagging.synthetic_lines import synthetic_lines
from handout_lab.training import letter_networks
from handout_lab.training.letter_networks import read_sentences, usual_widths

TEXT = "Six bold foxes jumped over the quiet dog, then slept until noon in the long wet grass."


def test_a_letter_never_seen_has_a_usual_width():
    widths = usual_widths({"i": [6.0, 8.0, 10.0]})
    assert widths[INDEX["i"]] == pytest.approx(0.4) and widths[INDEX["q"]] == pytest.approx(0.8)


@pytest.mark.slow
def test_the_command_writes_a_network_that_has_begun_to_learn(tmp_path, monkeypatch):
    monkeypatch.setattr(letter_networks, "_TEST_LINES", 4)
    path = tmp_path / "net.npz"
    arguments = ["-o", str(path), "--lines", "24", "--epochs", "6", "--hidden", "32", "--hands", "house-print"]
    letter_networks.main(arguments)
    first = network.load(path)
    rng = np.random.default_rng(9)
    fresh = list(synthetic_lines([library.load("house-print")], [TEXT], 3, rng))
    assert letter_networks.accuracy(network.load(path), fresh)[1] > 0.1
    letter_networks.main(arguments)
    assert all((a == b).all() for a, b in zip(first.weights, network.load(path).weights, strict=True))


def test_sentences_that_cannot_be_read_are_said(tmp_path):
    with pytest.raises(InputError, match="missing"):
        read_sentences(tmp_path / "missing.txt")
    (tmp_path / "empty.txt").write_text("\n\n")
    with pytest.raises(InputError, match="no sentences"):
        read_sentences(tmp_path / "empty.txt")
