"""Parts of a job: what is drawn between two things that a person has to do."""

import dataclasses

import pytest
from cursive import page
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import InputError
from handout.plotting.jobs.parts import PlotPart, arrange_layers, list_requests, parts, survey
from handout.profiles import PenTurn
from handout.values import Drawing, Page, Stroke

COLOURS = ["#c01020", "", "#1020c0"]


def coloured(words=9, seed=1):
    """Every word in a colour of its own; the layers are called by the parity of the word."""
    drawing = page(seed, words=words)
    strokes = (dataclasses.replace(s, colour=COLOURS[s.word % 3], layer="ab"[s.word % 2]) for s in drawing.strokes)
    return dataclasses.replace(drawing, strokes=tuple(strokes))


@pytest.mark.parametrize(("layers", "names"), [("none", [""]), ("name", ["a", "b"]), ("colour", COLOURS)])
def test_layers_are_drawn_one_after_the_other(layers, names):
    drawing = arrange_layers(coloured(), layers)
    found = survey(drawing, layers)
    assert [layer.name for layer in found] == names
    assert len(set(drawing.strokes)) == len(coloured().strokes)
    made = parts([found])
    assert [(part.first, part.stop) for part in made] == list(
        zip([0, *[p.stop for p in made[:-1]]], [p.stop for p in made], strict=True)
    )
    assert made[-1].stop == len(drawing.strokes)
    for part in made:
        strokes = drawing.strokes[part.first : part.stop]
        assert part.ink == pytest.approx(sum(s.length for s in strokes))
        assert [s.t[0] for s in strokes] == sorted(s.t[0] for s in strokes)
        assert {{"none": "", "name": s.layer, "colour": s.colour}[layers] for s in strokes} == {part.layer}


def test_layers_take_their_turns_and_those_left_out_are_no_parts():
    turns = [PenTurn(COLOURS[2], pen="one"), PenTurn(COLOURS[1], out=True), PenTurn(COLOURS[0], pen="one")]
    before, arranged = (survey(arrange_layers(coloured(), "colour", turn), "colour") for turn in ((), turns))
    for found in (before, arranged):  # whether they took their turns when the page was kept, or do so since
        made = parts([found, found], 2, None, turns)
        assert [part.layer for part in made] == [COLOURS[2], COLOURS[0]] * 4
        firsts = {layer.name: layer.first for layer in found}
        assert all(part.first == firsts[part.layer] for part in made)
        assert list_requests(None, made[0], 2, COLOURS, turns) == ["Put in one"]
        assert list_requests(made[0], made[1], 2, COLOURS, turns) == [], "they share a pen"
    assert [layer.name for layer in arranged] == [COLOURS[2], COLOURS[0], COLOURS[1]]


@given(st.floats(10.0, 500.0), st.integers(1, 3), st.integers(1, 3))
def test_a_pen_is_looked_at_in_time_and_never_within_a_word(every, copies, pages):
    drawings = [arrange_layers(coloured(6, seed), "name") for seed in range(pages)]
    surveys = [survey(drawing, "name") for drawing in drawings]
    longest = max(ink for layers in surveys for layer in layers for ink in layer.ink)
    used: dict[str, float] = {}
    drawn = []
    for part in parts(surveys, copies, every):
        if part.checked:
            assert part.checked == pytest.approx(used[part.layer]) and part.checked <= max(every, longest) + 1e-6
            used[part.layer] = 0.0
        used[part.layer] = used.get(part.layer, 0.0) + part.ink
        assert used[part.layer] <= max(every, longest) + 1e-6
        strokes = drawings[part.page].strokes
        if part.stop < len(strokes) and strokes[part.stop].layer == part.layer:
            assert strokes[part.stop].word != strokes[part.stop - 1].word
        drawn += [(part.copy, part.page, at) for at in range(part.first, part.stop)]
    assert drawn == [(c, p, at) for c in range(copies) for p in range(pages) for at in range(len(drawings[p].strokes))]


def test_without_a_limit_nothing_is_looked_at():
    assert not any(part.checked for part in parts([survey(coloured(), "none")] * 3, 2))
    with pytest.raises(InputError, match="less than 10 mm"):
        parts([survey(coloured(), "none")], 1, 5.0)


def test_strokes_of_no_word_are_looked_after_one_by_one():
    lines = tuple(Stroke([i, i + 0.5], [[0, i], [30, i]]) for i in range(10))
    made = parts([survey(Drawing(lines, Page(40, 40)), "none")], 1, 70.0)
    assert [(part.first, part.stop, part.checked) for part in made] == [
        (0, 2, 0), (2, 4, 60), (4, 6, 60), (6, 8, 60), (8, 10, 60),
    ]  # fmt: skip


def test_what_a_person_is_asked():
    one, two = PlotPart(0, 0, "red", 0, 5, 100), PlotPart(0, 0, "", 5, 9, 100)
    assert list_requests(None, one, 2, ["red", ""]) == ["Put in the pen for layer 'red'"]
    assert list_requests(one, two, 2, ["red", ""]) == ["Put in the pen for what is in no layer"]
    after = PlotPart(1, 1, "red", 0, 5, 100, 20_300)
    assert list_requests(two, after, 2, ["red", ""]) == [
        "Put in sheet 4",
        "Put in the pen for layer 'red'",
        "The pen has drawn 20.3 m: check it",
    ]
    assert list_requests(None, PlotPart(0, 0, "", 0, 5, 100), 2, [""]) == []


def test_an_empty_page_has_no_parts():
    assert parts([(), survey(coloured(), "none"), ()], 2) == parts([(), survey(coloured(), "none")], 2)
