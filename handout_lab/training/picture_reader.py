"""Trains the reader of pictures: ``python -m handout_lab.training.picture_reader WORDS.npz … -o READER.npz``.

Needs torch (the extra "train").  The sets of pictures are made by `word_pictures`; what is written is for numpy alone
(`reading.pictures`).
"""

from __future__ import annotations

import argparse
import sys
import zipfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from handout.alphabet import JUNK, LETTERS
from handout.reading import ctc
from handout.reading.pictures import STEP, PictureReading, Reader, load
from handout.reading.word_space import HEIGHT, MARGIN
from handout_lab.training.word_pictures import varied

if TYPE_CHECKING:
    from torch import Tensor, nn

_LEAST = -30.0  # log probability that a text counts with at least: one word that is no word must not set everything
_TEMPERATURES = np.exp(np.arange(-0.7, 1.4, 0.05))  # that are tried
_NEW = 0.2  # gain of a layer that is added to a network that has learnt: hardly anything is changed by it at first
_BINS = 5  # of probability, in the table of reliability
_USUAL_WIDTH = 96  # columns of a word's picture with its margins: what `Recipe.batch` counts
_BARE, _APART = 40, 3  # ink, of 255, that is none; columns of paper between words that are cut apart
_LOOK = 200  # batches after which the others are read
READ = "".join(letter for letter in LETTERS if letter != JUNK)  # class n + 1 is READ[n], class 0 none


@dataclass(frozen=True)
class Recipe:
    """How the reader is built and trained; the best of a few on fonts that were kept out.

    stem : channels of the three layers that see rows and halve them; added : layers after each that add to it.
    across : channels of the layers that see columns alone.
    dilations : of the latter, columns: a letter and its neighbours are seen, hardly ever a word.
    batch : pictures of usual width, or as much of wider ones.
    rate : highest learning rate; warm : share of the batches in which it rises.
    memory : share of the mean of the weights, which is what is kept, that stays from one batch to the next.
    """

    stem: tuple[int, int, int] = (24, 48, 64)
    added: tuple[int, int, int] = (0, 2, 2)
    across: int = 160
    dilations: tuple[int, ...] = (1, 2, 3, 1, 4, 2, 1, 3)
    batch: int = 48
    rate: float = 1e-3
    warm: float = 0.03
    memory: float = 0.998
    decay: float = 1e-3
    dropout: float = 0.1


def network(recipe: Recipe) -> nn.Sequential:
    """(n, 1, HEIGHT, w) → (n, classes, w / 2): the first layers over rows and columns, the others over columns."""
    from torch import nn

    class Added(nn.Module):  # type: ignore[misc]  # torch is an extra, unknown where it is not installed
        """A layer whose result is added to what it was given."""

        def __init__(self, layer: nn.Module, norm: nn.Module) -> None:
            super().__init__()
            self.layer, self.norm = layer, norm

        def forward(self, x: Tensor) -> Tensor:
            return x + self.norm(self.layer(x)).relu()

    stem, before = list[nn.Module](), 1
    for number, (channels, added) in enumerate(zip(recipe.stem, recipe.added, strict=True)):
        size, stride = (3, (2, 1)) if number else (5, (2, 2))
        halving = nn.Conv2d(before, channels, size, stride=stride, padding=size // 2, bias=False)
        stem += [halving, nn.BatchNorm2d(channels), nn.ReLU()]
        for _ in range(added):
            stem.append(Added(nn.Conv2d(channels, channels, 3, padding=1, bias=False), nn.BatchNorm2d(channels)))
        before = channels
    across = recipe.across
    columns = [nn.Conv1d(before * (HEIGHT // 8), across, 1, bias=False), nn.BatchNorm1d(across), nn.ReLU()]
    beside = [
        Added(nn.Conv1d(across, across, 3, padding=dilation, dilation=dilation, bias=False), nn.BatchNorm1d(across))
        for dilation in recipe.dilations
    ]
    last = nn.Conv1d(across, len(READ) + 1, 1)
    return nn.Sequential(*stem, nn.Flatten(1, 2), *columns, *beside, nn.Dropout(recipe.dropout), last)


def go_on_from(net: nn.Sequential, path: Path, pictures: Tensor) -> None:
    """Give a network the weights of a reader that was written, which may have fewer layers of those that are added.

    Its normalisations went into its weights: they are put back by what is measured on some pictures (n, 1, HEIGHT, w).
    """
    import torch
    from torch import nn

    with np.load(path) as file:
        known = [(file[f"w{k}"], file[f"b{k}"]) for k in range(sum(name.startswith("w") for name in file.files))]
    flat = [part for part in net.modules() if isinstance(part, (nn.Conv1d, nn.Conv2d, nn.BatchNorm1d, nn.BatchNorm2d))]
    norms = dict(zip(flat[::2], flat[1::2], strict=False))
    hooks = []
    for part in flat[::2]:
        bias = None
        if known and known[0][0].shape == tuple(part.weight.shape):
            weight, bias = (torch.from_numpy(array.astype(np.float32)) for array in known.pop(0))
            part.weight.data.copy_(weight)
        if part in norms:
            hooks.append(norms[part].register_forward_pre_hook(_measured(bias)))
        elif bias is not None:
            part.bias.data.copy_(bias)
    with torch.no_grad():
        net.eval()(pictures)
    net.train()
    for hook in hooks:
        hook.remove()


def _measured(bias: Tensor | None) -> Callable[[nn.Module, tuple[Tensor, ...]], None]:
    """Sets a normalisation so that it only adds a bias to what it is given, or, without one, lets little through."""

    def hook(norm: nn.Module, given: tuple[Tensor, ...]) -> None:
        values = given[0].transpose(0, 1).flatten(1).float()
        norm.running_mean.copy_(values.mean(1))
        norm.running_var.copy_(values.var(1))
        norm.weight.data.copy_((norm.running_var + norm.eps).sqrt() if bias is not None else norm.weight * _NEW)
        norm.bias.data.copy_(norm.running_mean + bias if bias is not None else norm.bias)

    return hook


@dataclass(frozen=True, eq=False)
class Words:
    """A set of pictures: all side by side (HEIGHT, w) uint8, the column after each, their texts and sources."""

    pictures: NDArray[np.uint8]
    ends: NDArray[np.intp]
    texts: tuple[str, ...]
    sources: tuple[str, ...]

    @classmethod
    def load(cls, path: Path) -> Words:
        """A set as `word_pictures.save` wrote it."""
        with np.load(path) as file:
            ends = np.cumsum(file["widths"], dtype=np.intp)
            return cls(file["pictures"], ends, tuple(map(str, file["texts"])), tuple(map(str, file["sources"])))

    def __len__(self) -> int:
        return len(self.texts)

    def picture(self, number: int) -> NDArray[np.uint8]:
        """(HEIGHT, w) uint8 of one."""
        end = int(self.ends[number])
        start = int(self.ends[number - 1]) if number else 0
        return self.pictures[:, start:end]


def with_words_apart(lines: Words, reader: Reader, rng: np.random.Generator) -> Words:
    """A set of lines and, of each, the words one, two or three at a time, cut where no ink is.

    reader : which tells where the words of a text that it is given stand.
    """
    pieces = [
        (piece, text, lines.sources[number])
        for number, whole in enumerate(lines.texts)
        for piece, text in [(lines.picture(number), whole), *_pieces(lines.picture(number), whole, reader, rng)]
    ]
    pictures, texts, sources = zip(*pieces, strict=True)
    return Words(np.hstack(pictures), np.cumsum([piece.shape[1] for piece in pictures], dtype=np.intp), texts, sources)


def _pieces(
    picture: NDArray[np.uint8], text: str, reader: Reader, rng: np.random.Generator
) -> list[tuple[NDArray[np.uint8], str]]:
    """The words of a line, as `with_words_apart` cuts them; none of a line that is too narrow for its text."""
    words, reading = text.split(" "), reader.read(picture.astype(np.float64) / 255)
    try:
        borders = ctc.alignment(reading.grouped[0], reading.labels(text)) * STEP - MARGIN
    except ValueError:
        return []
    middles = borders.mean(axis=1).astype(int).tolist()
    ends = list[int | None]()
    for first in np.cumsum([len(word) + 1 for word in words[:-1]]).tolist():
        left, right = max(middles[first - 2], 0), middles[first]
        bare = np.flatnonzero(picture[:, left:right].max(axis=0, initial=0) < _BARE)
        widest = max(np.split(bare, np.flatnonzero(np.diff(bare) > 1) + 1), key=len)
        ends.append(left + int(widest[len(widest) // 2]) if len(widest) >= _APART else None)
    found, begin, cut = list[tuple[NDArray[np.uint8], str]](), 0, 0
    for last, end in enumerate([*ends, picture.shape[1]]):
        if end is not None and (last + 1 == len(words) or last - begin + 1 >= rng.integers(1, 4)):
            found.append((picture[:, cut:end], " ".join(words[begin : last + 1])))
            begin, cut = last + 1, end
    return found


def batches(words: Words, columns: int, rng: np.random.Generator) -> Iterator[NDArray[np.intp]]:
    """Numbers of pictures of about one width, of so many columns together, in random order."""
    widths = np.diff(words.ends, prepend=0)
    order = np.argsort(widths + rng.uniform(0, 12, len(words)))
    filled = np.cumsum(widths[order] + 2 * MARGIN) // columns
    groups = np.split(order, np.flatnonzero(np.diff(filled)) + 1)
    for number in rng.permutation(len(groups)):
        yield groups[number]


def endless(sets: Sequence[Words], columns: int, rng: np.random.Generator) -> Iterator[tuple[Words, NDArray[np.intp]]]:
    """Batches of some sets, again and again."""
    while True:
        for number in rng.permutation(len(sets)):
            yield from ((sets[number], numbers) for numbers in batches(sets[number], columns, rng))


def batch_of(
    words: Words, numbers: Sequence[int], rng: np.random.Generator | None, anew: bool = False
) -> tuple[Tensor, list[list[int]], list[int]]:
    """Pictures (n, 1, HEIGHT, w), their labels, and how many columns each has; with a generator a little changed.

    anew : every time distorted otherwise, as words are when they are made.
    """
    import torch

    pictures = [words.picture(n) for n in numbers]
    if anew and rng is not None:
        pictures = [varied(picture, pictures, rng) for picture in pictures]
    width = max(p.shape[1] for p in pictures) + 2 * MARGIN
    stack = np.zeros((len(pictures), 1, HEIGHT, width), dtype=np.float32)
    for k, picture in enumerate(pictures):
        shown = np.asarray(picture / np.float32(255), dtype=np.float32)
        stack[k, 0, :, MARGIN : MARGIN + picture.shape[1]] = shown if rng is None else _changed(shown, rng)
    labels = [[READ.index(c) + 1 for c in words.texts[n]] for n in numbers]
    given = torch.from_numpy(stack).to(memory_format=torch.channels_last)
    return given, labels, [(p.shape[1] + 2 * MARGIN + 1) // 2 for p in pictures]


def _changed(shown: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
    """A picture as it comes again: shifted by a row, with another contrast, a piece of it gone."""
    shown = np.roll(shown, int(rng.integers(-1, 2)), axis=0) ** np.float32(rng.uniform(0.7, 1.5))
    if rng.random() < 0.2:
        y, x = int(rng.integers(HEIGHT)), int(rng.integers(shown.shape[1]))
        shown[y : y + 3, x : x + 3] *= np.float32(rng.uniform(0.0, 0.5))
    return shown


@dataclass(frozen=True)
class Course:
    """What is learned from, and how long.

    words : sets of pictures as `word_pictures` makes them; pages : as `page_lines` does.
    share : of the batches that are of pages.
    stop : pictures by writers who are in none of them: the weights that read them best are kept.
    batches : how many.
    """

    words: Sequence[Path]
    pages: Sequence[Path]
    share: float
    stop: Path | None
    batches: int


def train(course: Course, recipe: Recipe, rng: np.random.Generator, start: Path | None, keep: Path) -> nn.Sequential:
    """A trained network; the same sets, seed and machine give the same."""
    import torch
    from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    torch.manual_seed(int(rng.integers(2**31)))
    net = network(recipe)
    columns = recipe.batch * _USUAL_WIDTH
    drawn, written = (endless(sets, columns, rng) for sets in _material(course, start, rng))
    if start is not None and start.suffix == ".npz":
        first, some = next(drawn)
        go_on_from(net, start, batch_of(first, some.tolist(), None)[0])
    elif start is not None:
        net.load_state_dict(torch.load(start))
    net = net.to(memory_format=torch.channels_last)
    usual = AveragedModel(net, multi_avg_fn=get_ema_multi_avg_fn(recipe.memory), use_buffers=True)
    optimiser = torch.optim.AdamW(net.parameters(), recipe.rate, weight_decay=recipe.decay)
    _study(net, start)
    stop, best, mean = Words.load(course.stop) if course.stop else None, np.inf, 0.0
    for number in range(course.batches):
        of_pages = bool(course.pages) and rng.random() < course.share
        words, numbers = next(written if of_pages else drawn)
        for group in optimiser.param_groups:
            group["lr"] = recipe.rate * _rate(number / course.batches, recipe.warm)
        loss = _loss(net, *batch_of(words, numbers.tolist(), rng, anew=of_pages))
        optimiser.zero_grad()
        loss.backward()
        nn_clip(net)
        optimiser.step()
        usual.update_parameters(net)
        mean += 0.02 * (float(loss.detach()) - mean) if mean else float(loss.detach())
        if (number + 1) % _LOOK == 0 or number + 1 == course.batches:
            error = character_error(usual.module, stop) if stop else 0.0
            _report(f"{number + 1} batches: loss {mean:.3f}, character error of the others {error:.4f}")
            if error <= best:
                best = error
                torch.save(usual.module.state_dict(), keep)
    net.load_state_dict(torch.load(keep))
    return net


def _material(course: Course, start: Path | None, rng: np.random.Generator) -> tuple[list[Words], list[Words]]:
    """The sets of words, and those of lines with their words apart, as a reader that is gone on from sees them."""
    aligner = load(start) if start is not None and start.suffix == ".npz" else load()
    words = [Words.load(path) for path in course.words]
    lines = [Words.load(path) for path in course.pages]
    return words, [with_words_apart(each, aligner, rng) for each in lines]


def _study(net: nn.Sequential, start: Path | None) -> None:
    """Ready to be trained; what goes on from a reader keeps its normalisations: words and lines differ too much."""
    from torch import nn

    net.train()
    for part in net.modules():
        if start is not None and isinstance(part, (nn.BatchNorm1d, nn.BatchNorm2d)):
            part.eval()


def _loss(net: nn.Sequential, pictures: Tensor, labels: list[list[int]], lengths: list[int]) -> Tensor:
    import torch
    from torch.nn import functional

    with torch.autocast("cpu", dtype=torch.bfloat16):
        logits = net(pictures)
    return functional.ctc_loss(
        logits.float().log_softmax(1).permute(2, 0, 1),
        torch.tensor([c for label in labels for c in label]),
        torch.tensor(lengths),
        torch.tensor([len(label) for label in labels]),
        zero_infinity=True,
    )


def character_error(net: nn.Sequential, words: Words) -> float:
    """Edits for a letter of the texts of a set, capitals counted as small letters and spaces not at all."""
    import torch

    net.eval()
    edits = letters = 0
    with torch.no_grad():
        for numbers in batches(words, Recipe.batch * _USUAL_WIDTH, np.random.default_rng(0)):
            pictures, _, lengths = batch_of(words, numbers.tolist(), None)
            for logits, steps, n in zip(net(pictures).numpy(), lengths, numbers.tolist(), strict=True):
                seen = "".join(READ[label - 1] for label in ctc.greedy(logits[:, :steps].T))
                one, other = (text.lower().replace(" ", "") for text in (seen, words.texts[n]))
                edits, letters = edits + edit_distance(one, other), letters + len(other)
    return edits / letters


def edit_distance(one: str, other: str) -> int:
    """How many letters must be put in, left out or changed to make one text of another."""
    row = np.arange(len(other) + 1)
    codes = np.array(list(map(ord, other)), dtype=np.int64)
    for number, letter in enumerate(one, 1):
        changed = row[:-1] + (codes != ord(letter))
        new = np.concatenate([[number], np.minimum(changed, row[1:] + 1)])
        row = np.minimum.accumulate(new - np.arange(len(new))) + np.arange(len(new))
    return int(row[-1])


def nn_clip(net: nn.Sequential) -> None:
    """Gradients no longer than 5: one batch must not undo many."""
    from torch.nn.utils import clip_grad_norm_

    clip_grad_norm_(net.parameters(), 5.0)


def _rate(share: float, warm: float) -> float:
    """Share of the highest learning rate: it rises, then falls along half a cosine."""
    return share / warm if share < warm else 0.5 * (1 + float(np.cos(np.pi * (share - warm) / (1 - warm)))) + 1e-3


def layers(net: nn.Sequential) -> list[tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """The weights and biases of the layers, with the normalisations folded into them."""
    from torch import nn

    flat: list[nn.Module] = []
    for part in net:
        flat += list(part.children()) or [part]
    folded = []
    for part, after in zip(flat, [*flat[1:], nn.Identity()], strict=True):
        if not isinstance(part, (nn.Conv1d, nn.Conv2d)):
            continue
        weight = part.weight.detach().numpy()
        if isinstance(after, (nn.BatchNorm1d, nn.BatchNorm2d)):
            gain = (after.weight / (after.running_var + after.eps).sqrt()).detach().numpy()
            bias = after.bias.detach().numpy() - after.running_mean.numpy() * gain
            weight = weight * gain.reshape(-1, *[1] * (weight.ndim - 1))
        else:
            bias = part.bias.detach().numpy()
        folded.append((weight, bias))
    return folded


def readings(reader: Reader, words: Words) -> list[PictureReading]:
    """What the reader sees in every picture of a set."""
    return [reader.read(words.picture(k).astype(np.float64) / 255) for k in range(len(words))]


def fitted_temperature(seen: Sequence[PictureReading], texts: Sequence[str]) -> float:
    """The temperature at which the true texts of pictures are likeliest."""

    def cost(temperature: float) -> float:
        logs = [
            replace(reading, temperature=temperature).log_probability(t) for reading, t in zip(seen, texts, strict=True)
        ]
        return -float(np.mean(np.maximum(logs, _LEAST)))

    return float(min(_TEMPERATURES, key=cost))


def reliability(seen: Sequence[PictureReading], texts: Sequence[str]) -> list[tuple[float, float, int]]:
    """(mean probability, share right, count) of the likeliest texts, in bins of probability."""
    best = [reading.verdict("") for reading in seen]
    sure = np.array([verdict.other for verdict in best])
    right = np.array([reading.verdict(t).reads_as == t for reading, t in zip(seen, texts, strict=True)])
    bins = np.minimum((sure * _BINS).astype(int), _BINS - 1)
    here = [bins == k for k in range(_BINS)]
    return [(float(sure[b].mean()), float(right[b].mean()), int(b.sum())) for b in here if b.any()]


def save(net: nn.Sequential, recipe: Recipe, temperature: float, path: Path) -> None:
    """Writes the reader in half precision."""
    arrays = {
        f"{kind}{k}": a.astype(np.float16)
        for k, pair in enumerate(layers(net))
        for kind, a in zip("wb", pair, strict=True)
    }
    facts = {"dilations": np.array(recipe.dilations), "alphabet": np.array(READ), "temperature": np.array(temperature)}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, array in {**arrays, **facts}.items():
            # the same date each time: the same network, the same bytes
            with file.open(zipfile.ZipInfo(f"{name}.npy"), "w") as member:
                np.lib.format.write_array(member, array)


def _report(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Train a reader and write it."""
    parser = argparse.ArgumentParser(
        prog="python -m handout_lab.training.picture_reader", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("words", type=Path, nargs="+", help="sets of pictures of words")
    parser.add_argument("-o", "--output", type=Path, required=True, help="the .npz to write")
    parser.add_argument("--pages", type=Path, nargs="+", default=[], help="sets of lines from pages")
    parser.add_argument("--share", type=float, default=0.5, help="of the batches that are of pages")
    parser.add_argument("--stop", type=Path, help="lines by other writers: what reads them best is kept")
    parser.add_argument("--held", type=Path, help="pictures by writers that were kept out, to calibrate with")
    parser.add_argument("--start", type=Path, help="weights to go on from: a reader, or as kept beside an output")
    parser.add_argument("--batches", type=int, default=10_000)
    parser.add_argument("--rate", type=float, default=Recipe.rate)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    import torch

    recipe = Recipe(rate=options.rate)
    keep = options.output.with_suffix(".pt")
    course = Course(options.words, options.pages, options.share, options.stop, options.batches)
    net = train(course, recipe, np.random.default_rng(options.seed), options.start, keep)
    torch.save(net.state_dict(), keep)
    save(net, recipe, 1.0, options.output)
    if options.held is not None:
        held = Words.load(options.held)
        seen = readings(load(options.output), held)
        temperature = fitted_temperature(seen, held.texts)
        save(net, recipe, temperature, options.output)
        for sure, right, count in reliability([replace(r, temperature=temperature) for r in seen], held.texts):
            _report(f"probability {sure:.2f}: {right:.2f} right of {count}")
    _report(f"{options.output}: {options.output.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
