"""Trains the reader of pen paths: ``python -m handout_lab.training.path_reader WORDS.npz -o FILE.npz``.

Needs PyTorch, which the program itself does not.  WORDS.npz is made by ``--make``, from the built-in hands and the
single-line SVG fonts that are given.  The training criterion is the probability of the text, whatever steps it takes
(`handout.reading.ctc`), so that no borders of letters are needed.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.hand import library, svg_font
from handout.prompting import corpus
from handout.values import Array
from handout_lab.reading import pen_paths
from handout_lab.reading.path_features import COUNT, Floats, SampledPath, features
from handout_lab.training.path_words import NOISE, PathNoise, PathWord, path_words, varied

_RATE_ON = 1e-3  # greatest learning rate of a network that is trained on
EACH = 4  # points a step of the network
_LONGEST = 14  # letters of a word: few are longer, and steps are padded to the longest of a batch
_HANDS = ("house-print", "house-quick", "house-joined", "house-joined")  # joined words are the harder ones


@dataclass(frozen=True)
class PathRecipe:
    """How a network is trained.

    width : channels.  dilations : of the layers after the two that halve the steps.
    batch : words.  rate : the greatest learning rate.  decay : of the weights (AdamW).
    dropout : share of channels.  warm : share of the batches in which the rate rises; after it falls as a cosine.
    ahead : batches that are sorted by length together.
    guided : share of the epochs in which every step is told its letter, before the text alone counts.
    unseen : features that are kept from the network.
    """

    width: int = 96
    dilations: tuple[int, ...] = (1, 2, 4, 1, 2, 4, 1)
    batch: int = 24
    rate: float = 3e-3
    decay: float = 1e-2
    dropout: float = 0.1
    warm: float = 0.08
    ahead: int = 12
    guided: float = 0.5
    unseen: tuple[int, ...] = ()


def make(fonts: Sequence[Path], count: int, seed: int, hands: Sequence[str] = _HANDS) -> list[PathWord]:
    """So many words of the built-in hands and these fonts."""
    rng = np.random.default_rng(seed)
    words: list[PathWord] = []
    known = set(pen_paths.LETTERS)
    drawn = [library.load(name) for name in hands]
    made = path_words(drawn, [svg_font.read_svg_font(path) for path in fonts], corpus.shipped_sentences(), rng)
    while len(words) < count:
        word = next(made)
        if len(word.text) <= _LONGEST and set(word.text) <= known:
            words.append(word)
    return words


def save_words(words: Sequence[PathWord], path: Path) -> None:
    """Words in one file: points of all pieces one after the other, and how many there are."""
    pieces = [xy for word in words for xy in word.strokes]
    np.savez_compressed(
        path,
        texts=np.array([word.text for word in words]),
        sources=np.array([word.source for word in words]),
        pieces=np.array([len(word.strokes) for word in words]),
        points=np.array([len(xy) for xy in pieces]),
        of=np.concatenate([of for word in words for of in word.of]).astype(np.uint8),
        xy=np.concatenate(pieces).astype(np.float32),
    )


def load_words(path: Path) -> list[PathWord]:
    """What `save_words` kept."""
    with np.load(path) as kept:
        cuts = np.cumsum(kept["points"])[:-1]
        pieces, of = np.split(kept["xy"].astype(np.float64), cuts), np.split(kept["of"].astype(np.intp), cuts)
        bounds = np.concatenate([[0], np.cumsum(kept["pieces"])])
        return [
            PathWord(str(text), tuple(pieces[a:b]), tuple(of[a:b]), str(source))
            for text, source, a, b in zip(kept["texts"], kept["sources"], bounds[:-1], bounds[1:], strict=True)
        ]


def targets(word: PathWord, path: SampledPath, labels: Sequence[int]) -> NDArray[np.int64]:
    """(steps,) the class that each of the network's steps should see where the way of the pen is known.

    Of a letter the last half of its first unbroken stretch; the rest, and what comes back for dots and bars, is blank.
    """
    of = np.concatenate(word.of)[np.rint(path.source[::EACH]).astype(np.intp)]
    wanted = np.zeros(len(of), dtype=np.int64)
    for letter, label in enumerate(labels):
        own = np.flatnonzero(of == letter)
        if len(own):
            stretch = own[own - own[0] == np.arange(len(own))]
            wanted[stretch[len(stretch) // 2 :]] = label
    return wanted


@dataclass(frozen=True, eq=False)
class Batch:
    """Words padded to the longest: features (n, points, COUNT), points of each, wanted classes (n, steps; −1 beyond
    the end), labels one after the other, and how many each word has."""

    seen: Floats
    points: NDArray[np.intp]
    wanted: NDArray[np.int64]
    labels: NDArray[np.intp]
    counts: NDArray[np.intp]


def batches(
    words: Sequence[PathWord], recipe: PathRecipe, rng: np.random.Generator, noise: PathNoise
) -> Iterator[Batch]:
    """All words once, each varied, in batches of words of about the same length."""
    order = rng.permutation(len(words))
    chunk = recipe.batch * recipe.ahead
    for first in range(0, len(order), chunk):
        ready = []
        for k in order[first : first + chunk].tolist():
            word, labels = varied(words[k], rng, noise), pen_paths.labels_of(words[k].text)
            path = pen_paths.upright_path(word.strokes)
            if len(path.xy) // EACH > 2 * len(labels):
                described = features(path)
                described[:, recipe.unseen] = 0.0
                ready.append((described, targets(word, path, labels), labels))
        ready.sort(key=lambda one: len(one[0]))
        for start in rng.permutation(np.arange(0, len(ready), recipe.batch)).tolist():
            yield _padded(ready[start : start + recipe.batch])


def _padded(some: Sequence[tuple[Floats, NDArray[np.int64], tuple[int, ...]]]) -> Batch:
    points = np.array([len(described) for described, _, _ in some])
    seen = np.zeros((len(some), int(points.max()), COUNT), dtype=np.float32)
    wanted = np.full((len(some), -(-int(points.max()) // EACH)), -1, dtype=np.int64)
    for k, (described, own, _) in enumerate(some):
        seen[k, : len(described)], wanted[k, : len(own)] = described, own
    labels = np.array([label for _, _, own in some for label in own])
    return Batch(seen, points, wanted, labels, np.array([len(own) for _, _, own in some]))


def network(recipe: PathRecipe, start: pen_paths.PathNetwork | None = None) -> Any:
    """The network in PyTorch: convolutions along the path, the first two of which halve the steps.

    One that starts with known weights has the normalisation in its convolutions already.
    """
    import torch
    from torch import nn

    class Layer(nn.Module):  # type: ignore[misc]  # torch is an extra, which mypy does not know
        def __init__(self, before: int, after: int, size: int, stride: int, dilation: int) -> None:
            super().__init__()
            padding = dilation * (size - 1) // 2
            self.conv = nn.Conv1d(before, after, size, stride, padding, dilation, bias=start is not None)
            self.norm = nn.BatchNorm1d(after) if start is None else None
            self.stride = stride

        def forward(self, x: Any, steps: Any) -> Any:
            y = self.conv(x)
            y = torch.relu(y if self.norm is None else self.norm(y))
            steps = -(-steps // self.stride)
            mask = (torch.arange(y.shape[2])[None, :] < steps[:, None])[:, None]
            return (x + y if self.stride == 1 else y) * mask, steps

    class Reader(nn.Module):  # type: ignore[misc]  # the same
        def __init__(self) -> None:
            super().__init__()
            half = recipe.width // 2
            shapes = [(COUNT, half, 5, 2, 1), (half, recipe.width, 5, 2, 1)]
            shapes += [(recipe.width, recipe.width, 3, 1, d) for d in recipe.dilations]
            self.layers = nn.ModuleList(Layer(*shape) for shape in shapes)
            self.drop = nn.Dropout1d(recipe.dropout)
            self.out = nn.Conv1d(recipe.width, len(pen_paths.LETTERS) + 1, 1)

        def forward(self, x: Any, steps: Any) -> Any:
            x = x.transpose(1, 2)
            for layer in self.layers:
                x, steps = layer(x, steps)
            return self.out(self.drop(x)).transpose(1, 2).log_softmax(-1), steps

    reader = Reader()
    if start is not None:
        with torch.no_grad():
            for layer, known in zip(reader.layers, start.layers, strict=True):
                layer.conv.weight.copy_(torch.from_numpy(known.weight).permute(2, 1, 0))
                layer.conv.bias.copy_(torch.from_numpy(known.bias))
            reader.out.weight.copy_(torch.from_numpy(start.weight).T[:, :, None])
            reader.out.bias.copy_(torch.from_numpy(start.bias))
    return reader


def train(
    words: Sequence[PathWord],
    recipe: PathRecipe,
    epochs: int,
    seed: int,
    noise: PathNoise = NOISE,
    start: pen_paths.PathNetwork | None = None,
) -> pen_paths.PathNetwork:
    """A network trained on these words; one that is given is trained on."""
    import torch
    from torch.nn import functional

    torch.set_num_threads(1)
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    reader = network(recipe, start)
    optimiser = torch.optim.AdamW(reader.parameters(), recipe.rate, weight_decay=recipe.decay)
    total = epochs * -(-len(words) // recipe.batch)
    warm = max(1, int(recipe.warm * total))

    def rate(step: int) -> float:
        return (
            (step + 1) / warm if step < warm else 0.5 * (1 + np.cos(np.pi * min(1.0, (step - warm) / (total - warm))))
        )

    schedule = torch.optim.lr_scheduler.LambdaLR(optimiser, rate)
    for epoch in range(epochs):
        losses, began = [], time.process_time()
        for batch in batches(words, recipe, rng, noise):
            given, kept = reader(torch.from_numpy(batch.seen), torch.from_numpy(batch.points))
            if start is None and epoch < recipe.guided * epochs:
                wanted = torch.from_numpy(batch.wanted)
                loss = functional.nll_loss(given.transpose(1, 2), wanted, ignore_index=-1)
            else:
                loss = functional.ctc_loss(
                    given.transpose(0, 1),
                    torch.from_numpy(batch.labels),
                    kept,
                    torch.from_numpy(batch.counts),
                    reduction="sum",
                    zero_infinity=True,
                ) / max(1, int(batch.counts.sum()))
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(reader.parameters(), 2.0)
            optimiser.step()
            schedule.step()
            losses.append(float(loss.detach()))
        _report(f"epoch {epoch + 1}: loss {np.mean(losses):.3f}, {time.process_time() - began:.0f} s CPU")
    return exported(reader, recipe.unseen)


def exported(reader: Any, unseen: tuple[int, ...] = ()) -> pen_paths.PathNetwork:
    """The weights as numpy runs them: normalisations become part of the convolutions; unseen features weigh nothing."""
    reader.eval()
    layers = []
    for layer in reader.layers:
        norm, weight, bias = layer.norm, layer.conv.weight.detach(), layer.conv.bias
        if norm is not None:
            scale = (norm.weight / (norm.running_var + norm.eps).sqrt()).detach()
            weight, bias = weight * scale[:, None, None], norm.bias - norm.running_mean * scale
        shape = layer.stride, layer.conv.dilation[0]
        layers.append(pen_paths.Layer(weight.permute(2, 1, 0).numpy(), bias.detach().numpy(), *shape))
    layers[0].weight[:, list(unseen)] = 0.0
    weight = reader.out.weight.detach()[:, :, 0].T.numpy()
    return pen_paths.PathNetwork(pen_paths.LETTERS, tuple(layers), weight, reader.out.bias.detach().numpy())


def letter_errors(reader: pen_paths.PathNetwork, words: Sequence[PathWord], rng: np.random.Generator) -> float:
    """Wrong, missing and superfluous letters, over those written."""
    wrong = 0
    for word in words:
        wrong += pen_paths.edits(
            word.text, pen_paths.read(_page(varied(word, rng).strokes), 0.0, 1.0, network=reader).text
        )
    return wrong / sum(len(word.text) for word in words)


def _page(strokes: Sequence[Array]) -> list[Array]:
    """Y down, as on a page."""
    return [xy * (1.0, -1.0) for xy in strokes]


def calibrated(
    reader: pen_paths.PathNetwork, words: Sequence[PathWord], rng: np.random.Generator
) -> pen_paths.PathNetwork:
    """The network with the temperature at which kept-out words are likeliest."""
    seen = []
    for word in words:
        described = features(pen_paths.upright_path(varied(word, rng).strokes))
        seen.append((reader.logits([described])[0], pen_paths.labels_of(word.text)))

    def cost(temperature: float) -> float:
        return -sum(max(-60.0, pen_paths.label_probability(x / temperature, own)) for x, own in seen)

    tried = np.arange(0.8, 3.01, 0.1).tolist()
    return reader.at_temperature(min(tried, key=cost))


def _report(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Make words, or train a network on them and print its errors on new ones."""
    parser = argparse.ArgumentParser(
        prog="python -m handout_lab.training.path_reader", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("words", type=Path, help="the words to learn from, or to make")
    parser.add_argument("--make", type=int, metavar="COUNT", help="make so many words, and train nothing")
    parser.add_argument("--fonts", type=Path, nargs="*", default=[], help="single-line SVG fonts to write words in")
    parser.add_argument("--hands", nargs="*", default=_HANDS)
    parser.add_argument("--kept-out", type=Path, help="words of other fonts, for calibration")
    parser.add_argument("-o", "--output", type=Path, help="the .npz to write")
    parser.add_argument("--start", type=Path, help="a network to train on")
    parser.add_argument("--epochs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    if options.make:
        save_words(make(options.fonts, options.make, options.seed, options.hands), options.words)
        return
    start = pen_paths.load(options.start) if options.start else None
    recipe = PathRecipe() if start is None else PathRecipe(rate=_RATE_ON)
    reader = train(load_words(options.words), recipe, options.epochs, options.seed, start=start)
    if options.kept_out:
        kept_out, rng = load_words(options.kept_out), np.random.default_rng(options.seed)
        reader = calibrated(reader, kept_out, rng)
        _report(f"kept out: {letter_errors(reader, kept_out, rng):.1%} of the letters wrong")
    pen_paths.save(reader, options.output)


if __name__ == "__main__":
    main()
