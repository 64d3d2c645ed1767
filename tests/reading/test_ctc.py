"""CTC against counting every way there is."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.reading import ctc

CLASSES = 3


def collapsed(way):
    kept = [label for at, label in enumerate(way) if at == 0 or way[at - 1] != label]
    return tuple(label for label in kept if label != ctc.BLANK)


def posteriors(seed, steps):
    shares = np.random.default_rng(seed).gamma(0.6, size=(steps, CLASSES)) + 1e-3
    return np.log(shares / shares.sum(axis=1, keepdims=True))


def of_all_ways(logs):
    """Probability of each text, counted."""
    texts = {}
    for way in product(range(CLASSES), repeat=len(logs)):
        share = float(np.exp(logs[np.arange(len(logs)), way].sum()))
        texts[collapsed(way)] = texts.get(collapsed(way), 0.0) + share
    return texts


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 5))
def test_forward_counts_every_way(seed, steps):
    logs = posteriors(seed, steps)
    for text, share in of_all_ways(logs).items():
        assert ctc.log_probability(logs, text) == pytest.approx(np.log(share))


def test_texts_all_at_once_are_as_probable_as_one_by_one():
    steps, texts = (4, 0, 9, 1, 6, 0), ((1,), (), (2, 2, 1), (1, 2), (), (2,))
    logs = [posteriors(seed, n) if n else np.zeros((0, CLASSES)) for seed, n in enumerate(steps)]
    one_by_one = [ctc.log_probability(own, text) for own, text in zip(logs, texts, strict=True)]
    np.testing.assert_allclose(ctc.log_probabilities(logs, texts), one_by_one)
    assert one_by_one[1] == 0.0
    assert one_by_one[3] == one_by_one[5] == -np.inf
    each = [ctc.occupancies([own], [text])[0] for own, text in zip(logs, texts, strict=True)]
    for alone, together in zip(each, ctc.occupancies(logs, texts), strict=True):
        np.testing.assert_allclose(alone, together)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 5))
def test_a_wide_beam_finds_every_text_and_the_best_one_first(seed, steps):
    logs = posteriors(seed, steps)
    texts = of_all_ways(logs)
    hypotheses = ctc.beams(logs, width=1000, least=0.0)
    assert {h.labels: h.log_probability for h in hypotheses} == pytest.approx(
        {text: np.log(share) for text, share in texts.items()}
    )
    assert texts[hypotheses[0].labels] == pytest.approx(max(texts.values()))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_a_narrow_beam_is_not_better_than_the_truth(seed):
    logs = posteriors(seed, 8)
    for hypothesis in ctc.beams(logs, width=3):
        assert hypothesis.log_probability <= ctc.log_probability(logs, hypothesis.labels) + 1e-9


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_occupancies_are_shares_of_all_ways_that_read_so(seed):
    logs, text = posteriors(seed, 5), (1, 2, 2)
    counted, total = np.zeros((5, 3)), 0.0
    for way in product(range(CLASSES), repeat=5):
        if collapsed(way) != text:
            continue
        share = float(np.exp(logs[np.arange(5), way].sum()))
        letter = -1
        for step, label in enumerate(way):
            letter += label != ctc.BLANK and (step == 0 or way[step - 1] != label)
            if label != ctc.BLANK:
                counted[step, letter] += share
        total += share
    np.testing.assert_allclose(ctc.occupancies([logs], [text])[0], counted / total, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_edits_are_the_probabilities_of_the_texts_with_another_letter_or_one_more(seed):
    logs, text = posteriors(seed, 6), (1, 2, 2)
    edits = ctc.edits(logs, text)
    assert edits.shape == (7, CLASSES)
    for at, letter in product(range(3), range(CLASSES)):
        other = [x for x in (*text[:at], letter, *text[at + 1 :]) if x != ctc.BLANK]
        assert edits[2 * at + 1, letter] == pytest.approx(ctc.log_probability(logs, other))
    for at, letter in product(range(4), range(1, CLASSES)):
        assert edits[2 * at, letter] == pytest.approx(ctc.log_probability(logs, (*text[:at], letter, *text[at:])))


def test_edits_of_many_texts_are_those_of_each_however_long():
    readings = [posteriors(seed, steps) for seed, steps in ((1, 9), (2, 0), (3, 2), (4, 31), (5, 4))]
    texts = [(1, 2, 2), (1,), (1, 1), (2, 1, 2, 1), ()]
    for together, logs, text in zip(ctc.edits_of(readings, texts), readings, texts, strict=True):
        np.testing.assert_allclose(together, ctc.edits(logs, text), rtol=1e-12)


def test_greedy_drops_repetitions_and_blanks():
    way = [0, 1, 1, 0, 1, 2, 2, 0]
    assert ctc.greedy(np.log(np.eye(CLASSES)[way] + 1e-6)) == (1, 1, 2)


def test_alignment_finds_the_letters_where_they_stand():
    way = [0, 1, 1, 0, 1, 2, 2, 0]
    spans = ctc.alignment(np.log(np.eye(CLASSES)[way] + 1e-6), (1, 1, 2))
    assert spans.tolist() == [[1, 3], [4, 5], [5, 7]]


def test_no_text_and_too_few_steps():
    logs = posteriors(1, 2)
    assert ctc.log_probability(logs, ()) == pytest.approx(logs[:, 0].sum())
    assert ctc.alignment(logs, ()).shape == (0, 2)
    assert ctc.log_probability(logs, (1, 1)) == -np.inf
    assert not ctc.occupancies([logs], [(1, 1)])[0].any()
    with pytest.raises(ValueError, match="too few"):
        ctc.alignment(logs, (1, 1))


def test_labels_are_classes():
    with pytest.raises(ValueError, match="labels are"):
        ctc.log_probability(posteriors(1, 2), (0,))
    with pytest.raises(ValueError, match="labels are"):
        ctc.log_probability(posteriors(1, 2), (CLASSES,))
