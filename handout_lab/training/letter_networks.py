"""Trains the networks that read letters: ``python -m handout_lab.training.letter_networks -o FILE.npz``.

All training lines are written by synthetic writers (`tagging.synthetic_lines`); no real page is used.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout import atomic
from handout.alphabet import JUNK, LETTERS, SPACE, THIRDS
from handout.errors import InputError
from handout.hand import library
from handout.hand.archive import split_bytes
from handout.hand.drawn import Hand
from handout.networks import Floats
from handout.prompting import corpus
from handout.tagging import network
from handout.tagging.line_space import COUNT, X_HEIGHT
from handout.tagging.network import LabelledColumns, join_columns
from handout.tagging.synthetic_lines import SyntheticLine, built_in_hands, sampled_columns, synthetic_lines

_TEST_LINES = 60  # new lines, on which the accuracy printed at the end is measured
# to a standard deviation of a layer's weights: 0.6 % of a page's columns are read otherwise than with all digits, where
# two of the networks differ in 18 %
_STEPS = 16
_RATE = 1.2e-3  # learning rate of Adam, the best of a few on five real pages
# x-heights, set by eye: what is struck out and a space have no width that could be measured
_WIDTHS_BY_DEFINITION = {JUNK: 1.6, SPACE: 1.0}
_SAMPLE = 40_000  # columns that suffice for the mean and spread of each feature
_PSEUDOCOUNT = 20.0  # added to the columns of each state, so that a state never seen has a finite prior
_SPREAD_FLOOR = 10.0  # added to the spread of each feature, so that rare ones do not shout
_USUAL_WIDTH = 0.8  # x-heights: of a letter that no training line holds


def read_sentences(path: Path | None) -> list[str]:
    """The sentences to write: the lines of a file, or the corpus of the prompt sheets.

    Raises
    ------
    InputError
        The file cannot be read or is empty.
    """
    if path is None:
        return list(corpus.shipped_sentences())
    try:
        sentences = [line.strip() for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"Cannot read the sentences in {path}: {error}.") from error
    if not sentences:
        raise InputError(f"{path} holds no sentences: give one a line.")
    return sentences


def usual_widths(widths: dict[str, list[float]]) -> NDArray[np.float32]:
    """(letters,) float32: median width of each letter, x-heights, from widths in pixels of line space."""
    medians = {
        letter: float(np.median(samples)) / X_HEIGHT for letter, samples in widths.items()
    } | _WIDTHS_BY_DEFINITION
    return np.array([medians.get(letter, _USUAL_WIDTH) for letter in LETTERS], dtype=np.float32)


def training_set(
    hands: Sequence[Hand], sentences: Sequence[str], lines: int, rng: np.random.Generator
) -> tuple[LabelledColumns, NDArray[np.float32]]:
    """Labelled columns of so many synthetic lines, and the letters' usual widths (letters,) in x-heights."""
    parts: list[LabelledColumns] = []
    widths: dict[str, list[float]] = {}
    for line in synthetic_lines(hands, sentences, lines, rng):
        parts.append(sampled_columns(line, rng))
        for span in line.spans:
            widths.setdefault(span.letter, []).append(span.right - span.left)
    return join_columns(parts), usual_widths(widths)


def start_network(
    columns: LabelledColumns, widths: Floats, hidden: int, rng: np.random.Generator
) -> network.RectifierNetwork:
    """A network with random weights, scaled for training on these columns; `widths` as the network has them."""
    count = len(LETTERS) * THIRDS
    sizes = (COUNT, hidden, hidden, count)
    weights = tuple(
        (rng.standard_normal((a, b), dtype=np.float32) * np.float32(np.sqrt((2 if b != count else 1) / a)))
        for a, b in pairwise(sizes)
    )
    sample = columns.features[:: max(1, len(columns) // _SAMPLE)].astype(np.float32)
    frequency = np.bincount(columns.states, minlength=count) + _PSEUDOCOUNT
    return network.RectifierNetwork(
        mean=sample.mean(axis=0),
        spread=sample.std(axis=0) + np.float32(_SPREAD_FLOOR),
        weights=weights,
        biases=tuple(np.zeros(size, np.float32) for size in sizes[1:]),
        log_prior=np.log(frequency / frequency.sum()).astype(np.float32),
        widths=np.asarray(widths, np.float32),
    )


def train(
    hands: Sequence[Hand],
    sentences: Sequence[str],
    rng: np.random.Generator,
    *,
    lines: int = 2500,
    epochs: int = 5,
    hidden: int = 256,
) -> network.RectifierNetwork:
    """A network trained on lines that synthetic writers of these hands wrote."""
    columns, widths = training_set(hands, sentences, lines, rng)
    _report(f"{len(columns)} columns of {lines} lines, {COUNT} numbers each")
    return network.train_network(
        start_network(columns, widths, hidden, rng),
        columns,
        epochs=epochs,
        rate=_RATE,
        rng=rng,
        on_epoch=lambda epoch, loss: _report(f"epoch {epoch + 1} of {epochs}: loss {loss:.3f}"),
    )


def round_weights(trained: network.RectifierNetwork) -> tuple[list[Floats], list[np.float32]]:
    """The weights of each layer in whole steps, of which a file keeps little more than a byte each, and the steps."""
    steps = [np.float32(2.0 ** np.round(np.log2(w.std() / _STEPS))) for w in trained.weights]
    return [np.rint(w / step) for w, step in zip(trained.weights, steps, strict=True)], steps


def save(trained: network.RectifierNetwork, path: Path) -> None:
    """Write a network as .npz: its weights in whole steps, the rest of half precision."""
    arrays = {name: getattr(trained, name) for name in ("mean", "spread", "log_prior", "widths")}
    arrays |= {f"bias{i}": b for i, b in enumerate(trained.biases)}
    halves = {name: array.astype(np.float16) for name, array in arrays.items()}
    whole, steps = round_weights(trained)
    weights = {f"weight{i}": split_bytes(w) for i, w in enumerate(whole)}
    buffer = io.BytesIO()
    kept = halves | weights | {"steps": np.array(steps), "letters": np.array(LETTERS)}
    np.savez_compressed(buffer, allow_pickle=False, **kept)
    atomic.write(path, buffer.getvalue())


def accuracy(trained: network.RectifierNetwork, lines: Sequence[SyntheticLine]) -> tuple[float, float]:
    """Share of columns whose state, and whose letter, is right."""
    rng = np.random.default_rng(0)
    columns = join_columns([sampled_columns(line, rng, share=1.0) for line in lines])
    guess = trained.log_posterior(columns.features).argmax(axis=1)
    return float((guess == columns.states).mean()), float((guess // THIRDS == columns.states // THIRDS).mean())


def _report(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Train one network, write it, and print its accuracy on new lines."""
    parser = argparse.ArgumentParser(
        prog="python -m handout_lab.training.letter_networks", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="the .npz to write")
    parser.add_argument("--corpus", type=Path, help="sentences, one a line (default: the prompts')")
    parser.add_argument("--lines", type=int, default=2500)
    parser.add_argument("--epochs", type=int, default=5)
    parser.add_argument("--hidden", type=int, default=256)
    parser.add_argument("--hands", nargs="+", default=[hand.name for hand in built_in_hands()])
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    sentences = read_sentences(options.corpus)
    hands = [library.load(name) for name in options.hands]
    rng = np.random.default_rng(options.seed)
    trained = train(hands, sentences, rng, lines=options.lines, epochs=options.epochs, hidden=options.hidden)
    save(trained, options.output)
    test_lines = list(synthetic_lines(hands, sentences, _TEST_LINES, np.random.default_rng(options.seed + 1000)))
    states, letters = accuracy(network.load(options.output), test_lines)
    size = options.output.stat().st_size / 1e6
    _report(f"{options.output}: {size:.1f} MB; of new columns {states:.1%} right, letters {letters:.1%}")


if __name__ == "__main__":
    main()
