"""Learns what tells a glyph that is wrong: writers are simulated, their letters known, some of them spoilt on purpose.

`python -m handout_lab.training.glyph_vetting -o handout/hand/outliers.npz` makes the model that ships.  How far a score
is to be believed was measured on people's pages (`hand.vetting`).
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from handout import atomic
from handout.errors import DoesNotFit, InputError
from handout.hand import library, outlier_score
from handout.hand.drawn import Hand
from handout.hand.glyph_features import COUNT, glyph_features
from handout.hand.outlier_score import ALONE, OutlierModel
from handout.hand.places import graphemes
from handout.hand.scanned import ScannedHand
from handout.hand.vetting import calibrated
from handout.inking.pen import usual
from handout.page_sizes import page
from handout.prompting import corpus
from handout.scanning.written_page import WrittenPage
from handout.tagging.page_tagging import TaggedPage, hand_of_pages, tag_labelled_page
from handout.tagging.synthetic_lines import built_in_hands, random_writer, texts
from handout.values import Array, Indices
from handout.writing.layout import Layout
from handout_lab.author import ground_truth_score, page_score
from handout_lab.author.simulate import Desk, simulate
from handout_lab.author.truth import Simulated
from handout_lab.training.spoilt_letters import NOBODY, Spoiler


@dataclass(frozen=True)
class Recipe:
    """What is learned from, and how; set so that more of either gains nothing on writers kept apart."""

    pages: int = 24  # with known letters; every fourth is kept apart
    spoilings: int = 3  # of each page
    pens: tuple[str, ...] = ("ballpoint", "fountain", "fineliner", "pencil", "ballpoint")
    x_height: tuple[float, float] = (1.7, 2.6)  # mm
    sentences: int = 6  # of a page, beside two texts of random words
    stray: float = 0.25  # x-heights from a letter's ink, within which ink of nobody is its
    people: float = 8.0  # how much more people's letters vary than those of three drawn hands; set on two real pages
    ridge: float = 0.02  # share of the mean variance that is added to every direction
    penalty: float = 10.0  # of the squares of the weights, for features of spread 1
    steps: int = 30  # of Newton's method at most


RECIPE = Recipe()
Known = tuple[WrittenPage, str, Indices]  # a page, its transcript, and the grapheme there of each of its vertices


@dataclass(frozen=True, eq=False)
class Sample:
    """The evidence on glyphs, the model's (n, k), and whether each is wrong (n,)."""

    evidence: Array
    wrong: Array


def simulated_page(number: int) -> Simulated:
    """One page of a writer; the same number gives the same page."""
    rng, hands = np.random.default_rng([78, number]), built_in_hands()
    plain = library.load(("house-joined", "house-quick", "house-print")[number % 3])
    hand: Hand = plain if (number // 3) % 2 == 0 else random_writer(hands, rng)
    desk = Desk(
        usual(RECIPE.pens[number % len(RECIPE.pens)]),
        layout=Layout(page("A5"), x_height=float(rng.uniform(*RECIPE.x_height))),
    )
    sentences = corpus.shipped_sentences()
    others = texts(sentences, rng)
    words = " ".join([*rng.choice(np.array(sentences, dtype=object), RECIPE.sentences), next(others), next(others)])
    while True:
        try:
            return simulate(words, hand, desk, rng=rng)
        except DoesNotFit:
            words = words.rsplit(" ", 12)[0]


def known(simulated: Simulated, written: WrittenPage) -> Known:
    """A simulated page as it was read, and whose each vertex is: ink of nobody that lies near a letter's is its."""
    transcript = page_score.transcript(simulated)
    units = (at for at, unit in enumerate(graphemes(transcript)) if not unit.isspace())
    number = dict(zip((letter.at for letter in simulated.truth.letters), units, strict=True))
    uv = written.graph.uv
    owner = np.array([number.get(at, NOBODY) for at in ground_truth_score.owners(simulated.truth, uv).tolist()])
    free = np.flatnonzero(owner == NOBODY)
    away, nearest = cKDTree(uv[owner != NOBODY]).query(uv[free])
    near = away * written.scan.pixel < RECIPE.stray * written.text_lines.x_height
    owner[free[near]] = owner[owner != NOBODY][nearest[near]]
    return written, transcript, owner


def hand_of(tagged: TaggedPage) -> ScannedHand:
    """The hand of one page."""
    return hand_of_pages("simulated", [tagged])


def names(hand: ScannedHand) -> list[str]:
    """The letters of all glyphs."""
    return [glyph.letter for glyph in hand.glyphs]


def judged(model: OutlierModel, hand: ScannedHand, spoiler: Spoiler) -> Sample:
    """The evidence on a hand's glyphs, and which are wrong."""
    letters = np.full(len(hand.pages[0].graph), NOBODY)
    for glyph in hand.glyphs:
        letters[glyph.vertices] = glyph.at
    wrong = spoiler.wrong(letters, np.array([glyph.at for glyph in hand.glyphs]))
    return Sample(model.evidence(glyph_features(hand), names(hand)), wrong)


def gaussians(hands: Sequence[ScannedHand]) -> OutlierModel:
    """What glyphs without faults say of letters and writers; weights are still 0."""
    each = [glyph_features(hand) for hand in hands]
    every = np.concatenate(each)
    middle, spread = every.mean(axis=0), every.std(axis=0) + 1e-6
    groups: dict[str, list[tuple[int, Array]]] = {}
    rows = []
    for hand, places in zip(hands, each, strict=True):
        scaled, letters = (places - middle) / spread, np.array(names(hand))
        for letter in np.unique(letters).tolist():
            own = scaled[letters == letter]
            groups.setdefault(letter, []).append((len(own), own.mean(axis=0)))
            if len(own) > 1:
                rows.append((own - own.mean(axis=0)) * np.sqrt(len(own) / (len(own) - 1)))
    centres, apart = dict[str, Array](), []
    for letter, group in groups.items():
        weights, means = np.array([count / (count + 2) for count, _ in group]), np.array([mean for _, mean in group])
        centres[letter] = weights @ means / weights.sum()
        if len(group) > 1:
            free = np.sqrt(len(group) / (len(group) - 1))
            apart += [(mean - centres[letter]) * free * np.sqrt(count / (count + 1)) for count, mean in group]
    within, between = (_ridged(np.asarray(part)) for part in (np.concatenate(rows), apart))
    middles = np.array(list(centres.values()))
    anywhere = np.cov(middles.T)
    return OutlierModel(
        middle,
        spread,
        within,
        between,
        centres,
        middles.mean(axis=0),
        anywhere,
        weights=np.zeros(8 + COUNT),
        bias=0.0,
        alone=np.zeros(len(ALONE)),
        alone_bias=0.0,
    )


def _ridged(rows: Array) -> Array:
    square = rows.T @ rows / len(rows)
    return np.asarray(square + RECIPE.ridge * np.trace(square) / len(square) * np.eye(len(square)))


def logistic(inputs: Array, truth: Array, penalty: float) -> Array:
    """(k,): weights of inputs (n, k), the first of which is 1, for the odds of `truth` (n,); Newton's method."""
    weights, ridge = np.zeros(inputs.shape[1]), penalty * np.eye(inputs.shape[1])
    ridge[0, 0] = 0.0
    for _ in range(RECIPE.steps):
        chance = 1 / (1 + np.exp(-np.clip(inputs @ weights, -30, 30)))
        slope = inputs.T @ (chance - truth) + ridge @ weights
        bend = (inputs * (chance * (1 - chance))[:, None]).T @ inputs + ridge + 1e-9 * np.eye(len(weights))
        step = np.linalg.solve(bend, slope)
        weights = weights - step
        if np.abs(step).max() < 1e-6:
            break
    return weights


def weighed(model: OutlierModel, samples: Sequence[Sample]) -> OutlierModel:
    """The model with weights learned from spoilt glyphs."""
    evidence = np.concatenate([sample.evidence for sample in samples])
    wrong = np.concatenate([sample.wrong for sample in samples]).astype(np.float64)
    weights, bias = _slopes(evidence, wrong)
    # letters are shaped by these: what would reward a feature for being off is left out
    alone, kept = np.zeros(len(ALONE)), np.arange(len(ALONE))
    while True:
        alone[:] = 0.0
        alone[kept], alone_bias = _slopes(evidence[:, ALONE][:, kept], wrong)
        if (alone >= 0).all():
            break
        kept = np.flatnonzero(alone > 0)
    return replace(model, weights=weights, bias=bias, alone=alone, alone_bias=alone_bias)


def _slopes(evidence: Array, wrong: Array) -> tuple[Array, float]:
    middle, spread = evidence.mean(axis=0), evidence.std(axis=0) + 1e-9
    weights = logistic(np.column_stack([np.ones(len(evidence)), (evidence - middle) / spread]), wrong, RECIPE.penalty)
    slopes = weights[1:] / spread
    return slopes, float(weights[0] - slopes @ middle)


def ranked(score: Array, wrong: Array) -> float:
    """Chance that a wrong glyph has a higher score than a right one."""
    order = np.argsort(np.argsort(score)) + 1.0
    bad = int(wrong.sum())
    return float((order[wrong].sum() - bad * (bad + 1) / 2) / max(bad * (len(score) - bad), 1))


def learned(pages: Sequence[Known]) -> OutlierModel:
    """The model that pages with known letters give; tells how good it is."""
    train, kept = ([page for number, page in enumerate(pages) if (number % 4 == 2) == apart] for apart in (False, True))
    model = gaussians([hand_of(tag_labelled_page(*page)) for page in train])
    model = weighed(model, [sample for page in train for sample in spoilt(model, page)])
    model = replace(model, between=RECIPE.people * model.between)
    for title, group in (("learned from", train), ("kept apart", kept)):
        samples = [sample for page in group for sample in spoilt(model, page)]
        evidence, wrong = (np.concatenate(part) for part in zip(*((s.evidence, s.wrong) for s in samples), strict=True))
        score = evidence @ model.weights + model.bias
        odd = calibrated(score, np.full(len(score), 0.7)) < 0.5
        _say(
            f"{title}: {len(score)} letters, {wrong.mean():.1%} wrong; ranked {ranked(score, wrong):.3f}; below 0.5: "
            f"{odd[wrong].mean():.1%} of the wrong, {odd[~wrong].mean():.1%} of the right"
        )
    return model


def spoilt(model: OutlierModel, page: Known) -> Iterator[Sample]:
    """A page spoilt several times."""
    written, transcript, owner = page
    spoiler = _spoiler(page)
    for seed in range(RECIPE.spoilings):
        letters = spoiler.spoilt(owner, np.random.default_rng([seed, len(owner)]))
        yield judged(model, hand_of(tag_labelled_page(written, transcript, letters)), spoiler)


def _spoiler(page: Known) -> Spoiler:
    hand = hand_of(tag_labelled_page(*page))
    essential = np.full(len(page[2]), NOBODY)
    for number in range(len(hand.glyphs)):
        body = hand.body(number)
        essential[body] = page[2][body]
    return Spoiler(page[0].graph, essential, page[0].text_lines.x_height)


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def save(model: outlier_score.OutlierModel, path: Path) -> None:
    """Write a model as .npz of single precision."""
    letters = sorted(model.centres)
    arrays = {name: getattr(model, name) for name in outlier_score.ARRAYS}
    arrays |= {"bias": np.array(model.bias), "alone_bias": np.array(model.alone_bias)}
    arrays |= {"centres": np.array([model.centres[letter] for letter in letters])}
    buffer = io.BytesIO()
    singles = {name: np.asarray(array, dtype=np.float32) for name, array in arrays.items()}
    np.savez_compressed(buffer, allow_pickle=False, **(singles | {"letters": np.array("".join(letters))}))
    atomic.write(path, buffer.getvalue())


def main(arguments: Sequence[str] | None = None) -> None:
    """Learn the model and write it."""
    parser = argparse.ArgumentParser(
        prog="python -m handout_lab.training.glyph_vetting", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="the .npz file")
    chosen = parser.parse_args(arguments)
    pages = list[Known]()
    try:
        for number in range(RECIPE.pages):
            simulated = simulated_page(number)
            written = page_score.read(simulated)
            pages.append(known(simulated, written))
            _say(f"page {number + 1} of {RECIPE.pages}")
        save(learned(pages), chosen.output)
    except (InputError, OSError) as error:
        parser.exit(2, f"{error}\n")


if __name__ == "__main__":
    main()
