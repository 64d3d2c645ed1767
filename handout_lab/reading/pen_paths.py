"""Reads a word from the path of a pen: letter by letter, with no knowledge of any language.

`read` says what stands there, `log_probability` how probable a text is, `spans` which stretch of the path each letter
has, `path_log_likelihood` the same for many candidate paths at once.  Paths are pen-down pieces in the order of
writing, in mm of the page, y down.  The network is a few convolutions along the path, run in numpy.

Source: Graves, Fernández, Gomez and Schmidhuber 2006 (the criterion and its decoding); temperature after Guo, Pleiss,
Sun and Weinberger 2017.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from handout import alphabet
from handout.alphabet import fold
from handout.errors import InputError
from handout.networks import log_softmax, one_thread
from handout.reading import ctc
from handout.values import Array
from handout_lab.reading.path_features import Floats, SampledPath, features, sampled, slant_of

LETTERS = "".join(letter for letter in alphabet.LETTERS if letter not in (alphabet.SPACE, alphabet.JUNK))
_INDEX = {letter: number for number, letter in enumerate(LETTERS, start=1)}
_FILE = Path(__file__).resolve().parent / "networks" / "pen_paths.npz"
_SCALES = (0.72, 0.85, 1.0, 1.18, 1.4)  # tried about the guess where the x-height is not known
_CORE = (0.2, 0.8)  # of a word's ink, by height: most of it lies between baseline and x-height …
_CORE_SHARE = 0.75  # … in so much of which those quantiles lie


@dataclass(frozen=True, eq=False)
class Layer:
    """One convolution and its rectifier; added to what it is given unless it halves the steps.

    weight : (size, before, after).
    """

    weight: Floats
    bias: Floats
    stride: int
    dilation: int


@dataclass(frozen=True, eq=False)
class PathNetwork:
    """A reader's weights; letters are classes 1 …, the blank is 0."""

    letters: str
    layers: tuple[Layer, ...]
    weight: Floats
    bias: Floats

    @one_thread
    def logits(self, described: Sequence[Floats]) -> list[Array]:
        """For each word's features (n, COUNT), what its steps say of the classes: (m, classes)."""
        found = []
        for x in described:  # each by itself: in products with others its last bits would depend on them
            for layer in self.layers:
                x = _convolved(x, layer)
            found.append((x @ self.weight + self.bias).astype(np.float64))
        return found

    def at_temperature(self, temperature: float) -> PathNetwork:
        """The same, less sure by that factor."""
        weight, bias = self.weight / temperature, self.bias / temperature
        return replace(self, weight=weight.astype(np.float32), bias=bias.astype(np.float32))


def _convolved(x: Floats, layer: Layer) -> Floats:
    """(n, before) → (⌈n / stride⌉, after)."""
    size, stride, reach = len(layer.weight), layer.stride, layer.dilation
    side = reach * (size - 1) // 2
    padded = np.pad(x, ((side, side), (0, 0)))
    span = (-(-len(x) // stride) - 1) * stride + 1
    stacked = np.concatenate([padded[k * reach : k * reach + span : stride] for k in range(size)], axis=1)
    y: Floats = np.maximum(stacked @ layer.weight.reshape(-1, layer.weight.shape[2]) + layer.bias, 0)
    return y + x if stride == 1 else y


@dataclass(frozen=True)
class Reading:
    """What a path reads as.

    text : the likeliest; log_probability : of it; others : further texts with theirs.
    """

    text: str
    log_probability: float
    others: tuple[tuple[str, float], ...] = ()


def labels_of(text: str) -> tuple[int, ...]:
    """Classes of the letters of a text; what the reader does not know is left out."""
    return tuple(_INDEX[letter] for grapheme in text if (letter := fold(grapheme)) in _INDEX)


def upright_path(strokes: Sequence[Array]) -> SampledPath:
    """Pieces in x-heights, y up from the baseline, as even points; their slant is taken out."""
    slant = slant_of(strokes)
    return sampled([xy - slant * xy[:, 1:] * (1.0, 0.0) for xy in strokes])


@lru_cache(maxsize=1)
def shipped() -> PathNetwork:
    """The network that comes with the program."""
    return load(_FILE)


def load(path: Path) -> PathNetwork:
    """A network from its file.

    Raises
    ------
    InputError
        Not a network for these letters.
    """
    try:
        with np.load(path, allow_pickle=False) as kept:
            letters = str(kept["letters"])
            shapes = kept["shapes"].tolist()
            layers = tuple(
                Layer(kept[f"w{k}"].astype(np.float32), kept[f"b{k}"].astype(np.float32), stride, dilation)
                for k, (stride, dilation) in enumerate(shapes)
            )
            weight, bias = kept["weight"].astype(np.float32), kept["bias"].astype(np.float32)
    except (OSError, ValueError, KeyError) as error:
        raise InputError(f"{path} is no reader of pen paths: {error}.") from error
    if letters != LETTERS:
        raise InputError(f"{path} was trained for other letters: train it anew.")
    return PathNetwork(letters, layers, weight, bias)


def save(network: PathNetwork, path: Path) -> None:
    """A network in one file, in half precision."""
    arrays = {f"w{k}": layer.weight for k, layer in enumerate(network.layers)}
    arrays |= {f"b{k}": layer.bias for k, layer in enumerate(network.layers)}
    arrays |= {"weight": network.weight, "bias": network.bias}
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        path,
        letters=np.array(network.letters),
        shapes=np.array([(layer.stride, layer.dilation) for layer in network.layers]),
        **{name: array.astype(np.float16) for name, array in arrays.items()},  # type: ignore[arg-type]  # numpy's stub
    )


def label_probability(logits: Array, labels: Sequence[int]) -> float:
    """Logarithm of the probability of labels, given what the steps say."""
    return ctc.log_probability(log_softmax(logits), labels)


def _in_x_heights(strokes: Sequence[Array], baseline: float, x_height: float) -> list[Array]:
    return [(xy - (0.0, baseline)) * (1.0, -1.0) / x_height for xy in strokes if len(xy)]


def _guesses(strokes: Sequence[Array]) -> list[tuple[float, float]]:
    """Baselines and x-heights that the word may have, judged by where most of its ink lies."""
    pieces = [xy for xy in strokes if len(xy) > 1] or list(strokes)
    heights, weights = [], []
    for xy in pieces:
        heights.append((xy[1:, 1] + xy[:-1, 1]) / 2 if len(xy) > 1 else xy[:, 1])
        weights.append(np.hypot(*np.diff(xy, axis=0).T) if len(xy) > 1 else np.ones(1))
    y, weight = np.concatenate(heights), np.concatenate(weights)
    order = np.argsort(y)
    share = np.cumsum(weight[order]) / max(float(weight.sum()), 1e-9)
    top, bottom = (float(np.interp(q, share, y[order])) for q in _CORE)
    guess = max((bottom - top) / _CORE_SHARE, 0.1 * max(float(np.ptp(y)), 1e-3), 1e-3)
    middle = (top + bottom) / 2
    return [(middle + 0.5 * guess * scale, guess * scale) for scale in _SCALES]


def _posteriors(
    strokes: Sequence[Array], baseline: float | None, x_height: float | None, network: PathNetwork
) -> Array:
    """(m, classes) log probabilities; where the line is not known, of the guess at which the network is surest."""
    known = x_height is not None and baseline is not None
    frames = [(baseline, x_height)] if baseline is not None and x_height is not None else _guesses(strokes)
    described = [features(upright_path(_in_x_heights(strokes, low, high))) for low, high in frames]
    seen = [log_softmax(one) for one in network.logits(described)]
    return seen[0] if known else max(seen, key=lambda one: float(one.max(axis=1).sum()))


def read(
    strokes: Sequence[Array],
    baseline: float | None = None,
    x_height: float | None = None,
    *,
    width: int = 8,
    network: PathNetwork | None = None,
) -> Reading:
    """What a word's path reads as.

    Parameters
    ----------
    strokes : pen-down pieces (n, 2), mm, y down, in the order of writing.
    baseline, x_height : mm on the page; guessed where one is None.
    width : texts that the search keeps.

    Raises
    ------
    ValueError
        No piece holds a point.
    """
    if not any(len(xy) for xy in strokes):
        raise ValueError("there is no path to read")
    seen = _posteriors(strokes, baseline, x_height, network or shipped())
    found = [
        ("".join(LETTERS[label - 1] for label in one.labels), one.log_probability) for one in ctc.beams(seen, width)
    ]
    return Reading(found[0][0], found[0][1], tuple(found[1:]))


def log_probability(
    strokes: Sequence[Array],
    text: str,
    baseline: float | None = None,
    x_height: float | None = None,
    *,
    network: PathNetwork | None = None,
) -> float:
    """Natural logarithm of the probability that a word's path reads as `text`; parameters as in `read`."""
    return ctc.log_probability(_posteriors(strokes, baseline, x_height, network or shipped()), labels_of(text))


def path_log_likelihood(
    candidates: Sequence[Sequence[Array]],
    text: str,
    baseline: float,
    x_height: float,
    *,
    network: PathNetwork | None = None,
) -> Array:
    """(n,): `log_probability` of the text for n candidate paths of a word, all looked at at once."""
    reader = network or shipped()
    described = [features(upright_path(_in_x_heights(strokes, baseline, x_height))) for strokes in candidates]
    labels = labels_of(text)
    return np.array([label_probability(seen, labels) for seen in reader.logits(described)])


def spans(
    strokes: Sequence[Array], text: str, baseline: float, x_height: float, *, network: PathNetwork | None = None
) -> Array:
    """(letters, 2): between which samples, numbered through all pieces, each letter of the text was written.

    Raises
    ------
    ValueError
        The path is too short for the text.
    """
    reader = network or shipped()
    path = upright_path(_in_x_heights(strokes, baseline, x_height))
    seen = log_softmax(reader.logits([features(path)])[0])
    steps = ctc.alignment(seen, labels_of(text))
    each = int(np.prod([layer.stride for layer in reader.layers]))
    at = np.clip(np.column_stack([steps[:, 0], steps[:, 1] - 1]) * each, 0, len(path.source) - 1)
    return np.asarray(path.source[at])


def edits(wanted: str, got: str) -> int:
    """Letters that are wrong, missing or superfluous in `got`."""
    row = list(range(len(got) + 1))
    for number, letter in enumerate(wanted, start=1):
        before, row = row, [number]
        for k, other in enumerate(got, start=1):
            row.append(min(before[k] + 1, row[k - 1] + 1, before[k - 1] + (letter != other)))
    return row[-1]
