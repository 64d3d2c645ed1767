"""How answers sit in their fields: on rules, in boxes, in cells, turned, and no larger than the field."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from handout.hand.library import find
from handout.motion.trace import trace
from handout.pdf_forms.entries import AROUND, DPI, SETTINGS, FieldFrame, Filler, page_manuscript, rules
from handout.pdf_forms.fields import Field, Widget
from handout.values import Page
from handout.writing.compose import each_part

A4 = Page(210.0, 297.0)
HAND = find("house-quick")


def written(field, value, printed=(), seed=1, jitter=1.0):
    """The strokes of an answer on the page, (n, 2) mm, and its entry."""
    filler = Filler(HAND, 2.5, lambda page, box: printed, jitter)
    entries = filler.entries({field.name: field}, {field.name: value}, np.random.default_rng(seed))
    layouts = [entry.layout for entry in entries if entry.layout]
    sheets = list(each_part([e.text for e in entries], HAND, layouts, [seed])) if layouts else [None] * len(entries)
    pairs = [(entry, sheet and sheet.manuscript) for entry, sheet in zip(entries, sheets, strict=True)]
    page = page_manuscript(A4, pairs, HAND, "cross", jitter, np.random.default_rng(seed))
    return page, entries


def xy(page, word=None):
    points = [s for line in page.lines for p in line.placed for s in p.strokes if word is None or p.word == word]
    return np.concatenate(points)


def text_field(box, **more):
    return Field("a", "text", (Widget(0, box),), **more)


@settings(max_examples=12)
@given(st.floats(10, 160), st.floats(3.5, 14), st.integers(0, 99), st.sampled_from(["Uhu", "fly"]))
@example(10.0, 3.5, 25, "Uhu")  # chance set it high and made it tall
@example(10.0, 5.0, 25, "Uhu")
@example(40.0, 3.5, 2, "Uhu")
def test_one_line_stays_inside_its_box(width, height, seed, text):
    left, top = 20.0, 40.0
    page, _ = written(text_field((left, top, left + width, top + height)), text, seed=seed)
    points = np.concatenate([stroke.xy for stroke in trace(page, HAND, np.random.default_rng(1)).strokes])
    assert left <= points[:, 0].min() and points[:, 0].max() <= left + width
    # a word with tails above and below may go over both edges of a low box: smaller it could not be read
    over = 0.1 if text == "Uhu" else 0.2
    assert top - over < points[:, 1].min() and points[:, 1].max() < top + height + over


@pytest.mark.parametrize("seed", range(4))
def test_letters_in_low_cells_stay_inside_their_field(seed):
    page, _ = written(text_field((20.0, 40.0, 60.0, 44.0), cells=8, longest=8), "Whilfred", seed=seed)
    assert xy(page)[:, 1].min() > 40 - 1e-6 and xy(page)[:, 1].max() < 44 + 1e-6


def test_text_stands_on_the_rule_under_it_and_in_the_middle_of_a_box():
    box = (20.0, 40.0, 120.0, 50.0)
    page, _ = written(text_field(box), "nun mum", [9.2])
    assert np.percentile(xy(page)[:, 1], 95) == pytest.approx(49.2, abs=0.45)
    page, _ = written(text_field(box), "nun mum", [-1.2, 9.2])  # the rule of the line above
    assert np.percentile(xy(page)[:, 1], 95) == pytest.approx(49.2, abs=0.45)
    page, _ = written(text_field(box), "nun mum", [0.0, 10.0])
    assert np.median(xy(page)[:, 1]) == pytest.approx(45.9, abs=0.9)


def test_several_lines_stand_on_the_rules_of_their_field():
    field = text_field((20.0, 40.0, 70.0, 80.0), multiline=True)
    off = []
    for seed in range(8):
        page, _ = written(field, "nun mum mun num nun mum mun num mum", [8.0, 17.0, 26.0, 35.0], seed=seed)
        lines = [np.concatenate([s for p in line.placed for s in p.strokes])[:, 1] for line in page.lines]
        assert len(lines) > 1
        off += [np.percentile(line, 95) - (48 + 9 * number) for number, line in enumerate(lines)]
    assert np.mean(off) == pytest.approx(0, abs=0.25) and max(map(abs, off)) < 1.2  # feet wander by .35 mm


def test_long_answers_are_written_smaller_and_then_not_at_all():
    field = text_field((20.0, 40.0, 60.0, 47.0))
    short, long = written(field, "nun")[0], written(field, "nun mum mun num nun")[0]
    assert long.x_height < 0.9 * short.x_height and xy(long)[:, 0].max() <= 60
    filler = Filler(HAND, 2.5, lambda page, box: ())
    (entry,) = filler.entries({"a": field}, {"a": "nun mum " * 30}, np.random.default_rng(1))
    assert list(each_part([entry.text], HAND, [entry.layout], [1])) == [None]


@settings(max_examples=12)
@given(st.text("0123456789ABMWilm ", min_size=1, max_size=8).filter(str.strip), st.integers(0, 20))
def test_every_letter_is_in_the_middle_of_its_cell(text, seed):
    cells, cell = 8, 5.0
    field = text_field((20.0, 40.0, 20.0 + cells * cell, 47.0), cells=cells, longest=cells)
    page, _ = written(field, text.rstrip(), seed=seed)
    numbers = [n for n, letter in enumerate(text.rstrip()) if letter != " "]
    for word, number in enumerate(numbers):
        x = xy(page, word)[:, 0]
        assert (x.min() + x.max()) / 2 == pytest.approx(20 + (number + 0.5) * cell, abs=0.7)
        assert np.ptp(x) <= SETTINGS.cell_filled * cell + 1e-6
    assert {p.word for line in page.lines for p in line.placed} == set(range(len(numbers)))


def test_buttons_are_crossed_where_they_stand_for_the_answer():
    places = tuple(Widget(0, (20.0 + 10 * n, 40.0, 24.0 + 10 * n, 44.0), state=name) for n, name in enumerate("ab"))
    page, _ = written(Field("a", "radio", places), "b")
    points = xy(page)
    assert (points.min(axis=0) > (29.2, 39.2)).all() and (points.max(axis=0) < (34.8, 44.8)).all()


@given(st.integers(0, 3), st.floats(1, 4))
def test_a_frame_is_the_field_whichever_way_it_is_turned(turn, scale):
    frame = FieldFrame((20.0, 40.0, 60.0, 50.0), turn, scale)
    width, height = frame.size
    corners = frame.to_page(AROUND + np.array([[0, 0], [width, 0], [width, height]]))
    first = [(20, 40), (20, 50), (60, 50), (60, 40)][turn]
    second = [(60, 40), (20, 40), (20, 50), (60, 50)][turn]
    third = [(60, 50), (60, 40), (20, 40), (20, 50)][turn]
    assert corners == pytest.approx(np.array([first, second, third]))


def test_a_narrow_field_is_written_in_all_the_same():
    page, (entry,) = written(text_field((20.0, 40.0, 24.0, 46.0)), "7")
    assert entry.frame.scale > 1 and xy(page)[:, 0].min() >= 20 and xy(page)[:, 0].max() <= 24


def test_lines_printed_at_a_field_are_found_and_others_are_not():
    scale = DPI / 25.4
    page = np.full((round(100 * scale), round(100 * scale), 3), 255, np.uint8)

    def line(y, x0, x1, thick=0.3, dots=False):
        rows = slice(round((y - thick / 2) * scale), round((y + thick / 2) * scale) + 1)
        columns = np.arange(round(x0 * scale), round(x1 * scale))
        page[rows, columns[columns % 6 < 2] if dots else columns] = 90

    box = (20.0, 30.0, 80.0, 40.0)
    line(40, 18, 82)
    line(35, 20, 60)  # not as wide as the field
    line(60, 10, 90)  # not at the field
    assert rules(page, box) == pytest.approx([10], abs=0.2)
    line(30, 18, 82, dots=True)
    assert rules(page, box) == pytest.approx([0, 10], abs=0.2)
    page[round(31 * scale) : round(39 * scale)] = 200  # a shaded field has edges, and no lines
    assert rules(page, box) == pytest.approx([0, 10], abs=0.2)


def test_chance_alone_makes_two_forms_differ():
    field = text_field((20.0, 40.0, 120.0, 50.0))
    (_, (first,)), (_, (again,)), (_, (other,)) = (written(field, "nun", seed=seed) for seed in (1, 1, 2))
    assert first.layout == again.layout != other.layout
    assert replace(first, layout=None) == replace(other, layout=None)
