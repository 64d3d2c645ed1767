"""What corrections teach: letters of simulated pages that become right, and wrong, though nobody corrected them.

The pages are by hands that borrow forms of another, and vary twice as much as people do.  A letter is right where its
glyph and its true ink have three fifths of their line in common.  The worst doubtful wrong ones are outlined, as a
person would with a pencil: by the hull of their true ink.  "As told" is with `learning=False`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from benchmarks.reading import TEXT
from handout.errors import InputError
from handout.hand.corrections import Outline
from handout.hand.drawn import Hand
from handout.hand.library import load
from handout.hand.scanned import ScannedHand
from handout.inking.pen import usual
from handout.page_sizes import page
from handout.tagging.page_tagging import hand_of_pages, tag_page
from handout.tagging.relearning import correct
from handout.values import Indices
from handout.writing.layout import Layout
from handout_lab.author import ground_truth_score, page_score
from handout_lab.author.simulate import Desk, simulate

COUNTS = (5, 10, 20)
_COMMON = 0.6  # of the line, from which a letter is right
_VARIATION = 2.2
_WIDER = 1.5  # pixels: how far outside its line an outline runs


def hands() -> dict[str, Hand]:
    """Hands that are hard to read: joined, with letters of another hand, or with letters that look like others."""
    joined, quick = load("house-joined"), load("house-quick")
    mixed = {**joined.glyphs, **{letter: quick.glyphs[letter] for letter in "aefgkrsthn"}}
    alike = {
        letter: tuple(replace(form, letter=letter) for form in joined.glyphs[like])
        for letter, like in (("n", "u"), ("m", "w"), ("r", "v"), ("e", "c"), ("a", "o"))
    }
    return {"mixed": replace(joined, glyphs=mixed), "alike": replace(joined, glyphs={**joined.glyphs, **alike})}


def tagged(hand: Hand, seed: int) -> tuple[ScannedHand, Indices]:
    """A page of a hand as it is read, and the letter of its text that each vertex truly belongs to, −1 for none."""
    layout = Layout(page("A5"), x_height=1.9, fit=True, jitter=_VARIATION)
    simulated = simulate(TEXT, hand, Desk(usual("ballpoint"), layout=layout), rng=np.random.default_rng(seed))
    text = page_score.transcript(simulated)
    made = tag_page(page_score.read(simulated), text, rng=np.random.default_rng(1))
    number = dict(zip((letter.at for letter in simulated.truth.letters), _written(text), strict=True))
    owners = ground_truth_score.owners(simulated.truth, made.page.graph.uv)
    return hand_of_pages("page", [made]), np.array([number.get(at, -1) for at in owners.tolist()])


def _written(text: str) -> list[int]:
    return [i for i, unit in enumerate(text) if not unit.isspace()]


def given(hand: ScannedHand, count: int) -> Indices:
    """(count,) the letter that has each vertex of a hand's page, by its number in the text; −1: none."""
    owner = np.full(count, -1)
    for glyph in hand.glyphs:
        owner[glyph.vertices] = glyph.at
    return owner


def right(hand: ScannedHand, truth: Indices) -> set[int]:
    """The letters that are right, by their number in the text."""
    own, every = given(hand, len(truth)), set(truth.tolist()) - {-1}
    return {at for at in every if (both := (truth == at) & (own == at)).any()
            and both.sum() >= _COMMON * ((truth == at) | (own == at)).sum()}  # fmt: skip


def outlined(hand: ScannedHand, truth: Indices, letters: Sequence[int]) -> list[Outline]:
    """Outlines of letters, by the hulls of their true ink; those that the hand refuses are left out."""
    import cv2

    outlines: list[Outline] = []
    for at in letters:
        places = hand.pages[0].graph.uv[truth == at]
        around = np.concatenate([places + np.array(step) * _WIDER for step in ((1, 1), (1, -1), (-1, 1), (-1, -1))])
        hull = cv2.convexHull(around.astype(np.float32))[:, 0].tolist()
        one = Outline(page=0, within=tuple((x, y) for x, y in hull), text=hand.pages[0].transcript[at])
        try:
            correct(hand, [*outlines, one], learning=False)
        except InputError:
            continue
        outlines.append(one)
    return outlines


def main() -> None:
    """Print the table: for each page and number of corrections, what else became right or wrong."""
    print(
        f"{'':<10}{'letters':>8}{'right':>7}{'outlined':>10}   as told: mended broken   learned: mended broken  right"
    )
    for seed, (name, hand) in enumerate(hands().items()):
        found, truth = tagged(hand, seed)
        before = right(found, truth)
        sure = {glyph.at: glyph.confidence for glyph in found.glyphs}
        wrong = sorted((at for at in set(truth.tolist()) - before - {-1} if at in sure), key=lambda at: sure[at])
        for count in COUNTS:
            made = outlined(found, truth, wrong[:count])
            row = f"{name:<10}{len(set(truth.tolist()) - {-1}):>8}{len(before):>7}{len(made):>10}"
            for learning in (False, True):
                after = right(correct(found, made, learning=learning).hand, truth)
                rest = after - set(wrong[:count])
                row += f"{len(rest - before):>19}{len(before - after):>7}"
            print(f"{row}{len(after):>7}", flush=True)


if __name__ == "__main__":
    main()
