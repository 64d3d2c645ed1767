"""Training lines come from the product's own pipeline, with every letter where the label says."""

import numpy as np
import pytest

from handout.errors import InputError
from handout.hand import library
from handout.tagging import network, training
from handout.tagging.alphabet import INDEX, JUNK, LETTERS, SPACE, state
from handout.tagging.features import ABOVE, HEIGHT, INKY, STEP, X_HEIGHT
from handout.tagging.renders import render
from handout.tagging.training import column_states, examples, sentences_of, texts, usual_widths
from handout.tagging.writers import habits, writer

HANDS = [library.load(name) for name in ("house-joined", "house-print", "house-quick")]
TEXT = "Six bold foxes jumped over the quiet dog, then slept until noon in the long wet grass."


@pytest.fixture(scope="module")
def lines():
    made = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        made += render(TEXT, writer(HANDS, rng), habits(rng), rng)
    return made


def test_every_letter_is_labelled_once_and_in_order():
    rng = np.random.default_rng(1)
    made = render(TEXT, HANDS[0], habits(rng), rng)
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


def test_what_is_struck_out_is_junk():
    rng = np.random.default_rng(2)
    made = [line for _ in range(6) for line in render(TEXT, HANDS[1], habits(rng), rng, struck=True)]
    junk = [span for line in made for span in line.spans if span.letter == JUNK]
    assert junk and all(span.right - span.left > X_HEIGHT / 2 for span in junk)


def test_some_writers_borrow_letters_and_some_turn_their_n():
    made = [writer(HANDS, np.random.default_rng(seed)) for seed in range(40)]
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
    source = texts(sentences_of(None), np.random.default_rng(0))
    seen = set("".join(next(source) for _ in range(600)))
    assert set(LETTERS) - {JUNK, SPACE} <= seen


def test_a_letter_never_seen_has_a_usual_width():
    widths = usual_widths({"i": [6.0, 8.0, 10.0]})
    assert widths[INDEX["i"]] == pytest.approx(0.4) and widths[INDEX["q"]] == pytest.approx(0.8)


def test_examples_are_columns_of_the_line(lines):
    every = examples(lines[0], np.random.default_rng(0), 1.0, 1.0)
    some = examples(lines[0], np.random.default_rng(0), 0.5, 0.1)
    assert len(every.states) == -(-lines[0].image.shape[1] // STEP)
    assert 0.2 < len(some.states) / len(every.states) < 0.6


def test_the_command_writes_a_network_that_has_begun_to_learn(tmp_path, monkeypatch):
    monkeypatch.setattr(training, "_FRESH", 4)
    path = tmp_path / "net.npz"
    arguments = ["-o", str(path), "--lines", "24", "--epochs", "6", "--hidden", "32", "--hands", "house-print"]
    training.main(arguments)
    first = network.load(path)
    rng = np.random.default_rng(9)
    fresh = list(training.written(HANDS[1:2], [TEXT], 3, rng))
    assert training.accuracy(network.load(path), fresh)[1] > 0.1
    training.main(arguments)
    assert all((a == b).all() for a, b in zip(first.weights, network.load(path).weights, strict=True))


def test_sentences_that_cannot_be_read_are_said(tmp_path):
    with pytest.raises(InputError, match="missing"):
        sentences_of(tmp_path / "missing.txt")
    (tmp_path / "empty.txt").write_text("\n\n")
    with pytest.raises(InputError, match="no sentences"):
        sentences_of(tmp_path / "empty.txt")
