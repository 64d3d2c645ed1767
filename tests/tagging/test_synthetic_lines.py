"""Synthetic lines come from the product's own pipeline, with every letter where the label says."""

import numpy as np
import pytest

from handout.alphabet import JUNK, LETTERS, SPACE, state
from handout.hand import library
from handout.prompting import corpus
from handout.tagging.line_space import ABOVE, HEIGHT, INKY, STEP, X_HEIGHT
from handout.tagging.synthetic_lines import (
    column_states,
    random_habits,
    random_writer,
    sampled_columns,
    texts,
    write_lines,
)

HANDS = [library.load(name) for name in ("house-joined", "house-print", "house-quick")]
TEXT = "Six bold foxes jumped over the quiet dog, then slept until noon in the long wet grass."


@pytest.fixture(scope="module")
def lines():
    made = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        made += write_lines(TEXT, random_writer(HANDS, rng), random_habits(rng), rng)
    return made


def test_every_letter_is_labelled_once_and_in_order():
    rng = np.random.default_rng(1)
    made = write_lines(TEXT, HANDS[0], random_habits(rng), rng)
    assert "".join(span.letter for line in made for span in line.spans) == TEXT.replace(" ", "")


def test_letters_lie_inside_their_line_from_left_to_right(lines):
    for line in lines:
        assert line.image.shape[0] == HEIGHT and line.image.dtype == np.uint8
        assert all(0 <= span.left < span.right <= line.image.shape[1] for span in line.spans)
        middles = [(span.left + span.right) / 2 for span in line.spans]
        assert middles == sorted(middles)


def test_there_is_ink_in_letters_and_hardly_any_between_words(lines):
    inside = outside = paper = 0
    for line in lines:
        body = (line.image[ABOVE - X_HEIGHT : ABOVE] > INKY).any(axis=0)
        in_letter = np.zeros(len(body), bool)
        for span in line.spans:
            in_letter[int(span.left) : int(span.right) + 1] = True
        inside += int((body & in_letter).sum())
        outside += int((body & ~in_letter).sum())
        paper += int((~body & ~in_letter).sum())
    assert outside < 0.06 * inside and paper > 3 * outside


def test_letters_stand_on_the_baseline(lines):
    feet = []
    for line in lines:
        for span in line.spans:
            if span.letter in "aenmuxshoi":
                rows = np.flatnonzero((line.image[:, int(span.left) : int(span.right)] > INKY).any(axis=1))
                feet.append(rows.max() - ABOVE)
    assert abs(np.median(feet)) < 4


@pytest.mark.slow
def test_what_is_struck_out_is_junk():
    rng = np.random.default_rng(2)
    made = [line for _ in range(6) for line in write_lines(TEXT, HANDS[1], random_habits(rng), rng, struck=True)]
    junk = [span for line in made for span in line.spans if span.letter == JUNK]
    assert junk and all(span.right - span.left > X_HEIGHT / 2 for span in junk)


def test_some_writers_borrow_letters_and_some_turn_their_n():
    made = [random_writer(HANDS, np.random.default_rng(seed)) for seed in range(40)]
    own = {hand.name: hand for hand in HANDS}
    borrowed = [any(w.glyphs[c] is not own[w.name].glyphs[c] for c in "abcdefgh") for w in made]
    turned = [len(w.glyphs["n"]) > max(len(hand.glyphs["n"]) for hand in HANDS) for w in made]
    assert 0.2 < np.mean(borrowed) < 0.7 and any(turned) and not all(turned)
    assert all(glyph.letter == letter for w in made for letter, forms in w.glyphs.items() for glyph in forms)


def test_columns_get_the_thirds_of_their_letter():
    states = column_states([("a", 10.0, 22.0), (JUNK, 30.0, 40.0)], 25)
    assert states[5:11].tolist() == [state("a", k) for k in (0, 0, 1, 1, 2, 2)]
    assert (states[15:20] == state(JUNK)).all()
    assert (np.delete(states, [*range(5, 11), *range(15, 20)]) == state(SPACE)).all()


def test_all_letters_occur_in_the_texts():
    source = texts(corpus.shipped_sentences(), np.random.default_rng(0))
    seen = set("".join(next(source) for _ in range(600)))
    assert set(LETTERS) - {JUNK, SPACE} <= seen


def test_examples_are_columns_of_the_line(lines):
    every = sampled_columns(lines[0], np.random.default_rng(0), 1.0, 1.0)
    some = sampled_columns(lines[0], np.random.default_rng(0), 0.5, 0.1)
    assert len(every.states) == -(-lines[0].image.shape[1] // STEP)
    assert 0.2 < len(some.states) / len(every.states) < 0.6
