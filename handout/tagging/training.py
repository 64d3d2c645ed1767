"""Training the networks on the built-in hands: ``python -m handout.tagging.training -o model.npz``.

Nothing of any real page goes in.  Half of the lines are sentences, half words thrown together with groups of capitals,
digits and marks, so that every letter of the alphabet is seen in every company.
"""

from __future__ import annotations

import argparse
import string
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.hand import library
from handout.prompting import corpus
from handout.tagging import network
from handout.tagging.alphabet import JUNK, LETTERS, SPACE, THIRDS, state
from handout.tagging.features import COUNT, STEP, X_HEIGHT, describe
from handout.tagging.renders import Render, render
from handout.tagging.writers import habits, writer
from handout.values import Hand

_SENTENCES = 2  # a text, and so a writer
_WORDS = 24
_GROUPED = 0.3  # how many of the words are groups of characters
_RARE = "–£€ßæøœ…éèàüöäçñ"
_KEPT, _KEPT_OF_SPACE = 0.75, 0.3  # how many columns are learned from
_FRESH = 60  # lines to measure with
_STRUCK = 0.25  # how many writers strike words out
_WIDTHS = {JUNK: 1.6, SPACE: 1.0}


@dataclass(frozen=True, eq=False)
class Examples:
    """Described columns and what they are.

    features : (n, COUNT) uint8.
    states : (n,) int.
    """

    features: NDArray[np.uint8]
    states: NDArray[np.intp]


def sentences_of(path: Path | None) -> list[str]:
    """Sentences to write: the lines of a file, or those that handout comes with.

    Raises
    ------
    InputError
        The file cannot be read or is empty.
    """
    if path is None:
        return list(corpus.shipped())
    try:
        sentences = [line.strip() for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"Cannot read the sentences in {path}: {error}.") from error
    if not sentences:
        raise InputError(f"{path} holds no sentences: give one a line.")
    return sentences


def texts(sentences: Sequence[str], rng: np.random.Generator) -> Iterator[str]:
    """Texts to write, without end."""
    words = sorted({word for sentence in sentences for word in sentence.split()})
    while True:
        if rng.random() < 0.5:
            yield " ".join(rng.choice(np.array(sentences, dtype=object), _SENTENCES))
            continue
        yield " ".join(
            _group(rng) if rng.random() < _GROUPED else _dressed(words[int(rng.integers(len(words)))], rng)
            for _ in range(_WORDS)
        )


def _group(rng: np.random.Generator) -> str:
    """Two to five characters of one kind, sometimes with a mark among them."""
    kinds = (string.ascii_uppercase, string.digits, string.punctuation, string.ascii_lowercase + _RARE)
    kind = kinds[int(rng.choice(4, p=(0.35, 0.35, 0.15, 0.15)))]
    group = list(rng.choice(list(kind), int(rng.integers(1, 5))))
    if rng.random() < 0.4:
        group.insert(int(rng.integers(len(group) + 1)), str(rng.choice(list(".,:;-'/!?\"()"))))
    return "".join(group)


def _dressed(word: str, rng: np.random.Generator) -> str:
    """A word as it is, with a capital, all in capitals, in quotation marks, or followed by a mark."""
    chance = rng.random()
    if chance < 0.12:
        return word.capitalize()
    if chance < 0.16:
        return word.upper()
    if chance < 0.21:
        mark = str(rng.choice(["'", '"', "“”", "()"]))
        return mark[0] + word + mark[-1]
    return word + (str(rng.choice(list(",.;:!?-"))) if chance < 0.35 else "")


def examples(
    made: Render, rng: np.random.Generator, kept: float = _KEPT, kept_of_space: float = _KEPT_OF_SPACE
) -> Examples:
    """Some of the columns of a rendered line, with their states."""
    features = describe(made.image)
    states = column_states([(s.letter, s.left, s.right) for s in made.spans], len(features))
    share = np.where(states == state(SPACE), kept_of_space, kept)
    chosen = rng.random(len(states)) < share
    return Examples(features[chosen], states[chosen])


def column_states(spans: Sequence[tuple[str, float, float]], columns: int) -> NDArray[np.intp]:
    """(columns,) int: the state of every column, given letters with their left and right ends in pixels."""
    states = np.full(columns, state(SPACE), dtype=np.intp)
    x = np.arange(columns) * STEP
    for letter, left, right in spans:
        a, b = np.searchsorted(x, (left, right))
        if letter in (JUNK, SPACE):
            states[a:b] = state(letter)
            continue
        third = ((x[a:b] - left) * (THIRDS / max(right - left, 1e-6))).astype(np.intp)
        states[a:b] = state(letter, 0) + np.minimum(third, THIRDS - 1)
    return states


def written(hands: Sequence[Hand], sentences: Sequence[str], lines: int, rng: np.random.Generator) -> Iterator[Render]:
    """So many rendered lines, each few by another writer."""
    source, count = texts(sentences, rng), 0
    while count < lines:
        made = render(next(source), writer(hands, rng), habits(rng), rng, struck=rng.random() < _STRUCK)
        count += len(made)
        yield from made


def usual_widths(widths: dict[str, list[float]]) -> NDArray[np.float32]:
    """(letters,) float32: median width of each letter, x-heights; of one never seen, that of a usual letter."""
    found = {letter: float(np.median(seen)) / X_HEIGHT for letter, seen in widths.items()} | _WIDTHS
    return np.array([found.get(letter, 0.8) for letter in LETTERS], dtype=np.float32)


def gather(
    hands: Sequence[Hand], sentences: Sequence[str], lines: int, rng: np.random.Generator
) -> tuple[Examples, NDArray[np.float32]]:
    """Examples from so many lines, and the letters' usual widths."""
    parts: list[Examples] = []
    widths: dict[str, list[float]] = {}
    for made in written(hands, sentences, lines, rng):
        parts.append(examples(made, rng))
        for span in made.spans:
            widths.setdefault(span.letter, []).append(span.right - span.left)
    features = np.concatenate([part.features for part in parts])
    return Examples(features, np.concatenate([part.states for part in parts])), usual_widths(widths)


def train(
    hands: Sequence[Hand],
    sentences: Sequence[str],
    rng: np.random.Generator,
    *,
    lines: int = 2500,
    epochs: int = 5,
    hidden: int = 256,
) -> network.Network:
    """A network trained on lines that these hands wrote."""
    made, widths = gather(hands, sentences, lines, rng)
    _say(f"{len(made.states)} columns of {lines} lines, {COUNT} numbers each")
    start = network.fresh(made.features, made.states, widths, hidden, rng)
    return network.trained(
        start,
        made.features,
        made.states,
        epochs=epochs,
        rate=1.2e-3,
        rng=rng,
        told=lambda epoch, loss: _say(f"epoch {epoch + 1} of {epochs}: loss {loss:.3f}"),
    )


def accuracy(trained: network.Network, made: Sequence[Render]) -> tuple[float, float]:
    """Share of columns whose state, and whose letter, is right."""
    rng = np.random.default_rng(0)
    parts = [examples(one, rng, 1.0, 0.3) for one in made]
    guess = np.concatenate([trained.log_posterior(part.features).argmax(axis=1) for part in parts])
    truth = np.concatenate([part.states for part in parts])
    return float((guess == truth).mean()), float((guess // THIRDS == truth // THIRDS).mean())


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Train one network and write it."""
    parser = argparse.ArgumentParser(
        prog="python -m handout.tagging.training", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="the .npz to write")
    parser.add_argument("--corpus", type=Path, help="sentences, one a line (default: the prompts')")
    parser.add_argument("--lines", type=int, default=2500)
    parser.add_argument("--epochs", type=int, default=5)
    parser.add_argument("--hidden", type=int, default=256)
    parser.add_argument("--hands", nargs="+", default=[name for name in library.names() if name.startswith("house-")])
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args(arguments)
    sentences = sentences_of(chosen.corpus)
    hands = [library.load(name) for name in chosen.hands]
    rng = np.random.default_rng(chosen.seed)
    made = train(hands, sentences, rng, lines=chosen.lines, epochs=chosen.epochs, hidden=chosen.hidden)
    network.save(made, chosen.output)
    fresh = list(written(hands, sentences, _FRESH, np.random.default_rng(chosen.seed + 1000)))
    state_share, letter_share = accuracy(network.load(chosen.output), fresh)
    size = chosen.output.stat().st_size / 1e6
    _say(f"{chosen.output}: {size:.1f} MB; of fresh columns {state_share:.1%} right, letters {letter_share:.1%}")


if __name__ == "__main__":
    main()
