"""Letters made after their author's other letters: forms bent onto what he wrote, and what is told from that."""

from dataclasses import replace

import numpy as np
import pytest

from handout.completion import manner, ways
from handout.completion.completed_hand import complete_hand
from handout.completion.drawn_letters import DrawnLetters, _close_strokes, _lead_line, _weld_strokes


def written(form, xy):
    return ways.AuthorGlyph(xy - [np.median(xy[:, 0]), 0.0], form.tangents(xy), np.ones(len(xy), dtype=bool))


@pytest.mark.parametrize("letter", "aBk4")
def test_a_form_is_bent_onto_a_letter_that_is_wider_and_leans(letter):
    form = ways.way(letter, 0)
    meant = form.xy @ np.array([[1.2, 0.0], [0.15, 1.1]])
    found = ways.fit(form, written(form, meant))
    left = ways.measure_distance(found.bent, form.tangents(found.bent), written(form, meant))
    before = ways.measure_distance(form.xy, form.unit_vectors, written(form, meant))
    assert left < 0.5 * before and found.cost < 0.1
    off = np.hypot(*(found.bent - written(form, meant).xy).T)
    assert off.max() < 0.25, "each place lies where the pen does the same"
    other = ways.fit(ways.way("x", 0), written(form, meant))
    assert other.cost > 1.5 * found.cost, "another letter fits worse"


def known(letter, number, moved):
    return manner.Known(letter, number, 2, 0.05, moved), moved


def learned(letters, change):
    """A process of letters of the first built-in hand, whose places are all moved by `change`."""
    each = [known(x, 0, change(ways.way(x, 0).xy[:: manner._APART])) for x in letters]
    forms = [one for one, _ in each]
    weights = manner._GaussianProcess(forms).learn_weights(np.concatenate([moved for _, moved in each]))
    return manner._GaussianProcess([replace(one, weights=w) for one, w in zip(forms, weights, strict=True)])


def test_a_letter_that_is_lacking_leans_and_rises_as_the_others_do():
    process = learned("abdhlnotu", lambda xy: np.column_stack([0.3 * xy[:, 1], 0.25 * np.maximum(xy[:, 1] - 1, 0)]))
    form = ways.way("k", 0)
    moved = process.move_places(form, "k")
    assert np.polyfit(form.xy[:, 1], moved[:, 0], 1)[0] == pytest.approx(0.3, abs=0.06)
    top = form.xy[:, 1].argmax()
    assert moved[top, 1] == pytest.approx(0.25 * (form.xy[top, 1] - 1), rel=0.3)


def test_what_is_known_of_a_letter_itself_does_not_count():
    def change(xy):
        return np.column_stack([0.1 * xy[:, 1] ** 2, 0.1 * xy[:, 0]])

    form = ways.way("n", 0)
    assert np.allclose(
        learned("abdhlno", change).move_places(form, "n"), learned("abdhlo", change).move_places(form, "n"), atol=1e-9
    )


@pytest.mark.slow
def test_the_same_seed_makes_the_same_letters_and_none_of_the_hand_is_touched(small_hand):
    one, two = (DrawnLetters(small_hand).in_manner("Q", 3, np.random.default_rng(4)) for _ in range(2))
    assert all(np.array_equal(a.parts[0].graph.xy, b.parts[0].graph.xy) for a, b in zip(one, two, strict=True))
    first, second, _ = (form.parts[0].graph.xy for form in one)
    assert len(first) != len(second) or not np.allclose(first, second), "no letter is made twice alike"
    tall = [np.ptp(form.parts[0].graph.xy[:, 1]) * small_hand.pitch for form in one]
    assert all(1.0 < height < 3.5 for height in tall), "x-heights"
    completed, (borrowed,) = complete_hand(small_hand, "Q", fallback=True)
    assert borrowed.source == "made after the author's other letters" and not borrowed.of_author
    assert completed.glyphs[: len(small_hand.glyphs)] == small_hand.glyphs


@pytest.mark.slow
def test_a_form_that_is_drawn_otherwise_since_is_bent_anew(small_hand, monkeypatch):
    meant = manner.WritingManner(small_hand)
    forms = ways._forms_of
    otherwise = {"n": forms("m"), "e": forms("e")[:1]}
    monkeypatch.setattr(ways, "_forms_of", lambda letter: otherwise.get(letter) or forms(letter))
    ways.way.cache_clear()
    again = manner.WritingManner(small_hand)
    best = again.likeliest("Q")
    ways.way.cache_clear()
    assert again.letters == meant.letters and best is not None and np.isfinite(best[1]).all()


def test_a_hand_with_hardly_any_letters_is_lent_a_drawn_form_and_that_is_said(small_hand):
    few = replace(
        small_hand, glyphs=tuple(replace(g, letter=g.letter if g.letter in "en" else "") for g in small_hand.glyphs)
    )
    _, (borrowed,) = complete_hand(few, "Q", fallback=True)
    assert borrowed.source.startswith("the form of house-") and borrowed.source.endswith("too few letters are known")


def test_a_stem_that_is_written_up_and_down_again_is_one_line():
    up = np.column_stack([np.zeros(60), np.linspace(0, 1.77, 60)])
    down = up[::-1] + np.array([0.02, 0.0])
    xy, edges = _weld_strokes([np.concatenate([up, down])], 0.05)
    assert len(xy) < 75 and edges.max() < len(xy)
    loop = up[::-1] + np.array([0.3, 0.0])
    xy, _ = _weld_strokes([np.concatenate([up, loop])], 0.05)
    assert len(xy) == 120, "a loop stays open"
    dot, none = _weld_strokes([np.zeros((1, 2))], 0.05)
    assert len(dot) == 1 and not len(none)


def test_a_joined_letter_ends_where_its_way_to_the_next_begins():
    form = next(
        form
        for form in (ways.way("l", n) for n in range(ways.count("l")))
        if form.leaving >= 0 and len(form.first) == 2
    )
    (whole,), (cut,) = form.strokes(form.xy), form.split_strokes(form.strokes(form.xy))
    assert len(cut) < len(whole) and np.array_equal(whole[: len(cut)], cut)
    assert cut[-1, 1] < cut[:, 1].min() + 0.2


def test_a_slit_too_narrow_to_be_a_loop_is_closed_and_a_loop_is_not():
    up = np.column_stack([np.zeros(60), np.linspace(0, 1.77, 60)])
    for apart, meant in ((0.06, 0.01), (0.3, 0.3)):
        (way,) = _close_strokes([np.concatenate([up, up[::-1] + np.array([apart, 0.0])])], 0.05)
        assert np.abs(way[-20:-5, 0] - meant).max() < 0.02
        assert np.array_equal(way[:40], up[:40]), "what comes first stays"


def test_a_ligature_goes_on_as_the_stroke_that_it_leaves():
    stroke = np.column_stack([np.zeros(10), np.linspace(1, 0, 10)])
    line = np.column_stack([np.linspace(0, 1, 30), np.linspace(0, -0.4, 30)])
    led = _lead_line(stroke, line, 0.4)
    assert np.array_equal(led[0], line[0]) and np.array_equal(led[-1], line[-1]) and len(led) == len(line)
    first = led[1] - led[0]
    assert first[1] / np.hypot(*first) < -0.8, "downwards, as the stroke"
    assert np.array_equal(_lead_line(-stroke, line, 0.4), line), "it does not turn back to do so"


def test_a_t_rises_further_over_small_letters_than_it_is_drawn():
    for number in range(ways.count("t")):
        drawn = max(stroke[:, 1].max() for stroke in ways._forms_of("t")[number][1].strokes)
        assert ways.way("t", number).xy[:, 1].max() - 1 == pytest.approx(1.8 * (drawn - 1), abs=0.05)
