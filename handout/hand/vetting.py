"""Whether each glyph of a scanned hand is what it is called: sure, doubtful or refused.

Four kinds of evidence make one probability: how sure the reading was of the glyph's place
(`ScannedGlyph.confidence`), how much its shape is like its siblings' (`outlier_score`), how much those of the
glyphs beside it are (what one has too much, its neighbour mostly lacks), and how it reads alone to a reader that knows
the author (`author_reader`).  A letter that is as large as its other case, or far higher than its siblings, or without
its accent, is refused, whatever they say.

Source: own method.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from handout.hand import author_reader, outlier_score
from handout.hand.glyph_features import glyph_features
from handout.hand.learnt import learnt
from handout.hand.measures import contradicted_cases, outsized_letters, reaching_lines, unmarked_letters
from handout.hand.outlier_score import READING, OutlierModel
from handout.hand.scanned import ScannedHand
from handout.values import Array, Indices

Verdict = Literal["sure", "doubtful", "refused"]
SURE, REFUSED = 0.8, 0.55  # least probability of the one, and greatest of the other; set on simulated pages kept apart
VERSION = 7  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it
# the logarithm of the odds that a glyph is right is the first, the second times its score, the third times the
# logarithm of the odds of its confidence, and the fourth times the greater score of those beside it.  Rounded from what
# spoilt letters of eight people say (see `READING`) and, of confidence, pages of simulated writers.  Of letters as they
# were read .02 are refused then, of spoilt ones .54 (.52 where a letter has one or two glyphs); with odds from pages of
# simulated writers alone, and lone letters believed like others, .02, .42 and .31.  On five other people's pages .02,
# .56 and .49; .02, .46 and .32
_ODDS = np.array([1.2, -0.5, 0.1, -0.15])
# greatest probability of a letter of the wrong size, on two lines or without its mark: lent ones cost less
_CONTRADICTED = 0.25
_CERTAIN = 0.02  # of confidences: nearer to 0 or 1 than this none is believed


@dataclass(frozen=True, eq=False)
class Vetting:
    """What is thought of the glyphs of a hand.

    probability : (n,) that each is what it is called; 0 for one without a name, or without any
        confidence, 1 for one that a person has confirmed.
    plainness : (n,) the same whatever a person has said: that a letter is true does not make it plain, and choosing and
        rereading go by this.
    """

    probability: Array
    plainness: Array

    @property
    def refused(self) -> NDArray[np.bool_]:
        """(n,): glyphs that are not to be written while another stands."""
        return np.asarray(self.probability < REFUSED)

    @property
    def sure(self) -> NDArray[np.bool_]:
        """(n,): glyphs of which there is no doubt."""
        return np.asarray(self.probability >= SURE)

    def verdict(self, number: int) -> Verdict:
        """What a glyph is."""
        return "sure" if self.sure[number] else "refused" if self.refused[number] else "doubtful"

    @property
    def worst_first(self) -> Indices:
        """The glyphs that are not sure, the least probable first."""
        order = np.argsort(self.probability, kind="stable")
        return np.asarray(order[~self.sure[order]], dtype=np.intp)


@lru_cache(maxsize=2)
def vet(hand: ScannedHand) -> Vetting:
    """Judge every glyph of a hand, with its stubs and marks; what was added to a hand is right."""
    if hand.author:
        added, known = np.ones(len(hand.glyphs) - hand.own_count), vet(hand.author)
        return Vetting(np.concatenate([known.probability, added]), np.concatenate([known.plainness, added]))
    plainness = learnt(hand, "vetting", VERSION, len(hand.glyphs), lambda: _plainness(hand))
    confirmed = np.array([glyph.confirmed for glyph in hand.glyphs], dtype=bool)
    return Vetting(np.where(confirmed, 1.0, plainness), plainness)


def _plainness(hand: ScannedHand) -> Array:
    model = outlier_score.load_model()
    score = strange_score(model, hand)
    confidence = np.array([glyph.confidence for glyph in hand.glyphs])
    probability = calibrated(score, confidence)
    named = np.array([bool(glyph.letter) for glyph in hand.glyphs], dtype=bool)
    wrong = contradicted_cases(hand) | reaching_lines(hand) | outsized_letters(hand) | unmarked_letters(hand)
    probability = np.where(wrong, np.minimum(probability, _CONTRADICTED), probability)
    return np.where(named & (confidence > 0), probability, 0.0)


def strange_score(model: OutlierModel, hand: ScannedHand) -> Array:
    """(n,): how unlike their siblings a hand's glyphs are, in shape and as they read alone."""
    shapes = model.score(glyph_features(hand), [glyph.letter for glyph in hand.glyphs])
    return np.asarray(shapes + READING * author_reader.strangeness(hand))


def calibrated(score: Array, confidence: Array) -> Array:
    """(n,): the probability that glyphs of some score and confidence (n,), in the order of their text, are right."""
    trust = np.clip(confidence, _CERTAIN, 1 - _CERTAIN)
    least = score.min(initial=0.0)
    around = np.concatenate([[least], score, [least]])
    beside = np.maximum(around[:-2], around[2:])
    terms = np.column_stack([np.ones(len(score)), score, np.log(trust / (1 - trust)), beside])
    return np.asarray(1 / (1 + np.exp(-np.clip(terms @ _ODDS, -50, 50))))
