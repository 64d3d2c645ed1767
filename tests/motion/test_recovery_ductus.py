"""The table of the ways of writing letters, and letters that are written in ways of their own."""

import string

import numpy as np
import pytest
from inked import line, strokes

from handout.motion.recovery import letter_forms
from handout.motion.recovery.letter_forms import forms_of
from handout.motion.recovery.letter_tracing import trace_letter
from handout.motion.recovery.network import build_network, chain_vertices
from handout.motion.recovery.traversal import beam_search, form_guides, guided_search

LETTERS = string.ascii_letters + string.digits + "&!?"


def test_every_letter_and_digit_has_a_usual_way():
    for letter in LETTERS:
        known = letter_forms.ductus(letter)
        assert known and known[0].cost == 0, letter
        assert all(np.isfinite(xy).all() and len(xy) > 1 for way in known for xy in way.strokes), letter


def test_the_table_has_letters_alone_and_no_way_twice():
    table = letter_forms._ductus_table()
    assert list(table) == ["usual", "other", "rare"]
    for part in table.values():
        assert set(part) <= set(LETTERS)
    for letter in LETTERS:
        texts = [text for part in table.values() for text in part.get(letter, ())]
        assert len(texts) == len(set(texts)), letter


def test_points_are_two_digits_and_fill_their_grid():
    for part in letter_forms._ductus_table().values():
        for letter, texts in part.items():
            points = [point for text in texts for point in text.replace("|", " ").split()]
            assert all(len(point) in (2, 3) and point[:2].isdigit() and point[2:] in ("", "'") for point in points)
            assert {point[1] for point in points} >= {"0", "9"}, letter


def test_the_pen_goes_through_the_points_and_turns_at_corners():
    (way,) = (way for way in letter_forms.ductus("V") if way.cost == 0)
    (only,) = way.strokes
    assert only[[0, -1]] == pytest.approx(np.array([(0, 9), (9, 9)]))
    low = int(only[:, 1].argmin())
    assert only[low] == pytest.approx((4, 0))
    # straight to the corner and straight on: nothing is rounded there
    assert (only[: low + 1, 0] <= 4 + 1e-9).all() and (only[low:, 0] >= 4 - 1e-9).all()


def test_accented_letters_are_written_as_their_bases_and_entered_ones_as_joined_hands_do():
    found = forms_of("É", False, False)
    assert found is not None and not found.drawn.all()
    entered = forms_of("n", True, True)
    assert entered is not None and entered.drawn.all()
    assert forms_of("n", False, False, ()) is None


def _capital_h():
    left = [[(0, 2), (0, 1)], [(0, 1), (0, 0)]]
    right = [[(1.2, 2), (1.2, 1)], [(1.2, 1), (1.2, 0)]]
    return line([*left, *right, [(-0.6, 1), (0, 1)], [(0, 1), (1.2, 1)], [(1.2, 1), (1.8, 1)]])


def test_the_stems_of_a_capital_h_are_pulled_down_and_its_bar_to_the_right():
    h = _capital_h()
    left, *others = [xy[[0, -1]] for xy in strokes(h, trace_letter(h, "H"))]
    assert left == pytest.approx(np.array([(0, 2), (0, 0)]))
    # either comes last: people differ
    right, bar = sorted(others, key=lambda ends: float(np.ptp(ends[:, 0])))
    assert right == pytest.approx(np.array([(1.2, 2), (1.2, 0)]))
    assert bar == pytest.approx(np.array([(-0.6, 1), (1.8, 1)]))


def test_a_t_that_is_led_in_from_the_line_goes_round_its_loop_and_its_bar_comes_last():
    low, crossed, top = (0, 0.7), (0.2, 1.0), (0.42, 2.1)
    body = [[(-0.8, 0), (-0.4, 0.35), low], [low, crossed], [low, (-0.02, 0.3), (0.1, 0.05), (0.4, 0.1)]]
    loop = [[crossed, (0.65, 1.6), (0.7, 1.9), top], [top, (0.22, 1.8), (0.1, 1.5), crossed]]
    t = line([*body, *loop, [(-0.45, 1.0), crossed], [crossed, (0.6, 1.05)]])
    main, bar = strokes(t, trace_letter(t, "t"))
    assert main[[0, -1]] == pytest.approx(np.array([(-0.8, 0), (0.4, 0.1)]))
    right, left = (int(np.hypot(*(main - place).T).argmin()) for place in ((0.65, 1.6), (0.1, 1.5)))
    assert right < left  # up on the right, over, and down
    assert bar[[0, -1]] == pytest.approx(np.array([(-0.45, 1.0), (0.6, 1.05)]))


def test_a_guide_leads_over_a_letter_as_its_form_goes():
    h = _capital_h()
    net = build_network(h.xy, h.radius, h.density, h.edges)
    for text in ("29 20 | 79 70 | 05 95", "29 20 | 05 95 | 70 79", "95 05 | 70 79 | 20 29"):
        form = [xy * (2.4 / 9, 2 / 9) - (0.6, 0) for xy in letter_forms._read_ductus(text)]
        laid = np.concatenate([np.linspace(xy[0], xy[-1], 8) for xy in form])[None]
        (walk,) = guided_search(net, 1.0, form_guides(net, laid, np.repeat(np.arange(3), 8)[None]))
        ends = np.array([net.xy[chain_vertices(net, stroke)][[0, -1]] for stroke in walk.strokes])
        assert ends == pytest.approx(np.array([xy[[0, -1]] for xy in form]), abs=0.2)


def test_a_guided_walk_costs_what_it_does_without_a_guide():
    h = _capital_h()
    net = build_network(h.xy, h.radius, h.density, h.edges)
    cost = {walk.strokes: walk.cost for walk in beam_search(net, 1.0, most=64, width=256)}
    known = forms_of("H", False, False)
    assert known is not None
    laid = known.xy * h.xy.std(axis=0) + h.xy.mean(axis=0)
    found = guided_search(net, 1.0, form_guides(net, laid, known.stroke_of))
    both = [walk for walk in found if walk.strokes in cost]
    assert both
    for walk in both:
        assert walk.cost == pytest.approx(cost[walk.strokes])
