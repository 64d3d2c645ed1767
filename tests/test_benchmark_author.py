"""The benchmark of an author's likeness: every switch of the writing switches, and what is kept out is out."""

import numpy as np
import pytest

from benchmarks.author import OFF, OURS, STEPS, left_out, switches
from benchmarks.keeping_out import Author, hand_without
from benchmarks.parts import manuscripts, write
from handout.hand import file, library
from handout.hand.scanned import NOBODY
from handout.writing.glyph_index import index_glyphs, mismatch
from handout.writing.word_layout import layout_model

TEXT = "the other stone in the rain and her hand on the letter then no one said the same to him there"
WORDS = [len(word) for word in TEXT.split()]
INSIDE = np.delete(np.arange(1, sum(WORDS)), np.cumsum(WORDS)[:-1] - 1)  # letters with another before them in the word


@pytest.fixture(scope="module")
def hand():
    """A hand that comes with the program, of which what is asked is kept."""
    return file.load(library.scanned_file("house-joined-ballpoint"))


@pytest.fixture(scope="module")
def forms(hand):
    return layout_model(hand).forms


@pytest.fixture(scope="module")
def written(hand):
    """The ink of one text, letter by letter, with some parts off."""

    def make(seed=1, **on):
        (sheet,) = manuscripts(hand, TEXT, seed, **on)
        return [placed.ink for line in sheet.lines for placed in line.placed]

    return make


def _numbers(inks):
    return np.array([ink.number for ink in inks])


def _gaps(inks):
    """Between the bounds of the ink of letters in one word."""
    graphs = [ink.graph for ink in inks]
    left = np.array([(graph.xy[:, 0] - graph.radius).min() for graph in graphs])
    right = np.array([(graph.xy[:, 0] + graph.radius).max() for graph in graphs])
    return left[INSIDE] - right[INSIDE - 1]


def _pairs(numbers):
    return numbers[INSIDE - 1], numbers[INSIDE]


@pytest.mark.slow
def test_choosing_at_random_takes_other_glyphs_than_the_best(hand, written):
    kept, best, any_one = index_glyphs(hand), _numbers(written()), _numbers(written(choice="random"))
    assert (best != any_one).mean() > 0.5

    def cost(numbers):
        return np.mean([kept.transitions.cost(*pair[:, None], False) for pair in np.transpose(_pairs(numbers))])

    assert cost(best) < 0.8 * cost(any_one)


@pytest.mark.slow
def test_without_likeness_neighbours_are_less_alike(hand, written):
    depart = index_glyphs(hand).residual

    def unlike(**on):
        pairs = [_pairs(_numbers(written(seed, **on))) for seed in range(9)]
        return np.mean([np.abs(depart[first] - depart[second]).mean() for first, second in pairs])

    assert unlike() < 0.95 * unlike(likeness=False)  # .90 of 24 seeds; by threes .82 to .93


@pytest.mark.slow
def test_without_fit_ligatures_lie_further_from_each_other(hand, written):
    kept = index_glyphs(hand)

    def away(numbers):
        first, second = _pairs(numbers)
        both = kept.transitions.has_exit[first] & kept.transitions.has_entry[second]
        return mismatch(kept.exits[first[both]], kept.entries[second[both]]).mean()

    assert away(_numbers(written())) < 0.8 * away(_numbers(written(fit=False)))


@pytest.mark.slow
@pytest.mark.parametrize("bending", [True, False])
def test_constant_gaps_are_constant_though_letters_are_bent(written, bending):
    plain = {"ligatures": False, "bending": bending, "heights": "source"}
    assert np.ptp(_gaps(written(spacing="constant", **plain))) < 0.02  # mm: lines are laid a little aslant
    assert np.ptp(_gaps(written(**plain))) > 0.5


def test_heights_of_the_source_are_those_of_the_page(hand, written, forms):
    plain = {"ligatures": False, "bending": False, "variation": 0.0}

    def bases(inks):
        over = [forms[ink.number].xy[:, 1].mean() + forms.centre[ink.number, 1] for ink in inks]
        return [ink.graph.xy[:, 1].mean() for ink in inks] + np.multiply(over, hand.pitch * hand.x_height)

    source, own = (np.ptp(bases(written(heights=heights, **plain))) for heights in ("source", "learned"))
    assert source < 2e-3 < 0.05 < own  # mm; heights are rounded to a thousandth


@pytest.mark.slow
def test_bodies_are_alone_without_ligatures_and_as_they_were_without_bends(hand, written, forms):
    unit = hand.pitch * hand.x_height

    def shapes(**on):
        inks = written(heights="source", **on)
        bodies = [forms[ink.number].xy * (unit, -unit) for ink in inks]
        more = sum(len(ink.graph.xy) - len(body) for ink, body in zip(inks, bodies, strict=True))
        moved = [ink.graph.xy[: len(body)] - body for ink, body in zip(inks, bodies, strict=True)]
        return more, np.mean([np.ptp(away, axis=0).max() for away in moved])

    joined, alone = shapes(), shapes(ligatures=False)
    assert joined[0] > 0 and alone[0] == 0
    assert alone[1] == pytest.approx(joined[1]) and alone[1] > 0.1  # mm
    assert shapes(bending=False)[1] < 0.03  # lines are laid a little aslant


@pytest.mark.slow
def test_without_seams_other_ink_is_seen(hand):
    one, other = (write(hand, "the stone", 1, seams=seams)[0] for seams in (True, False))
    assert one.shape == other.shape and (one != other).any()


def test_steps_switch_on_all_that_there_is_and_one_part_is_left_out_at_a_time():
    columns, alone = switches(), left_out()
    assert list(columns)[: len(STEPS)] == list(STEPS) and columns["a random"] == OFF
    on = columns[OURS]
    assert all(on[part] != off for part, off in OFF.items())
    assert {part for one in alone.values() for part in on if one[part] != on[part]} == set(OFF) - {"bending"}
    assert all(sum(one[part] != on[part] for part in on) == 1 for one in alone.values())


@pytest.mark.slow
def test_nothing_of_kept_out_lines_reaches_the_hand():
    whole = file.load(library.scanned_file("house-print-fountain"))
    text = tuple(line for page in whole.pages for line in page.transcript.splitlines())
    author = Author(whole.name, library.scanned_file(whole.name), text, (), 0.0, whole)
    halves = [hand_without(author, fold) for fold in (0, 1)]
    assert sum(len(half.glyphs) for half in halves) == len(whole.glyphs)
    first = np.cumsum([0, *(len(page.baselines) for page in whole.pages)])
    for fold, half in enumerate(halves):
        assert {int(first[one.page] + one.line) for one in half.glyphs} == set(author.given(fold))


def test_a_glyph_whose_neighbour_is_gone_is_joined_to_none(hand):
    number = next(i for i, one in enumerate(hand.glyphs) if one.ligatures)
    gone = hand.glyphs[number].after
    less = hand.take_glyphs([i for i in range(len(hand.glyphs)) if i != gone])
    assert less.glyphs[number].after == NOBODY and not less.glyphs[number].ligatures
