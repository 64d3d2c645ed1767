"""Glyphs off their pages: nothing of the line is lost, and ways begin and end where the pen went."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from handout.writing.forms import _clear, _undotted


@pytest.mark.slow
def test_a_form_is_its_glyph_in_line_space(small_hand, small_manner):
    page = small_hand.pages[0]
    for number, glyph in enumerate(small_hand.glyphs):
        form, centre = small_manner.forms[number], small_manner.forms.centre[number]
        assert np.allclose(page.to_picture(glyph.line, form.xy + centre), form.uv, atol=1e-6)
        parts = [form.uv]
        for ways, step in ((form.exits, 1), (form.entries, -1)):
            for way in ways:
                assert np.array_equal(way.uv[::step][0], form.uv[way.anchor])
                assert np.allclose(page.to_picture(glyph.line, way.xy + centre), way.uv, atol=1e-6)
                parts.append(way.uv[::step][: way.owned])
        there = {tuple(place) for place in np.concatenate(parts).tolist()}
        assert there == {tuple(place) for place in page.graph.uv[glyph.vertices].tolist()}
        thick = dict(zip(map(tuple, page.graph.uv.tolist()), page.graph.radius, strict=True))
        assert np.allclose([thick[tuple(place)] for place in form.uv.tolist()], form.radius * page.pitch)


def test_a_way_is_one_stroke_from_letter_to_letter(small_hand, small_manner):
    joined = 0
    for number, glyph in enumerate(small_hand.glyphs):
        for out, into in zip(
            small_manner.forms[number].exits,
            small_manner.forms[glyph.after].entries if glyph.after >= 0 else (),
            strict=True,
        ):
            assert np.array_equal(out.uv, into.uv) and np.array_equal(out.radius, into.radius)
            assert out.height == pytest.approx(into.height, abs=1e-12)
            assert out.owned + into.owned == len(out) or out.owned == into.owned == len(out)
            assert out.share_along[0] == 0 and out.share_along[-1] == 1 and (np.diff(out.share_along) > 0).all()
            joined += 1
    assert joined > 5


def test_edges_stay_within_the_body_and_off_the_ways(small_hand, small_manner):
    page = small_hand.pages[0]
    edges = {frozenset(edge) for edge in page.graph.edges.tolist()}
    at = {tuple(place): vertex for vertex, place in enumerate(page.graph.uv.tolist())}
    for number in range(len(small_hand.glyphs)):
        form = small_manner.forms[number]
        vertices = [at[tuple(place)] for place in form.uv.tolist()]
        steps = [frozenset((vertices[a], vertices[b])) for a, b in form.edges]
        assert set(steps) <= edges and len(set(steps)) == len(steps)
        for way in (*form.entries, *form.exits):
            path = [at[tuple(place)] for place in way.uv.tolist()]
            walked = {frozenset(step) for step in pairwise(path)}
            assert walked <= edges and not walked & set(steps)


def test_what_two_ways_share_is_the_letter_s():
    path = np.arange(10)
    assert _clear(path, [np.array([7, 8, 1, 2])], []).tolist() == [8, 9]
    assert _clear(path, [np.array([20, 0, 1, 2])], [np.array([9, 8, 30])]).tolist() == [2, 3, 4, 5, 6, 7, 8]
    assert _clear(path, [np.array([0])], [np.array([9])]).tolist() == path.tolist()
    assert len(_clear(path, [path], [path])) == 2


def test_a_letter_without_a_dot_is_written_without_the_dot_of_another(small_hand):
    found = 0
    glyphs = tuple(replace(glyph, letter="n") if glyph.letter == "i" else glyph for glyph in small_hand.glyphs)
    dotted, undotted = _undotted(small_hand), _undotted(replace(small_hand, glyphs=glyphs))
    for number in small_hand.numbers_of_letter("i").tolist():
        glyph = small_hand.glyphs[number]
        page = small_hand.pages[glyph.page]
        assert np.array_equal(dotted[number], glyph.vertices)
        lost = np.setdiff1d(glyph.vertices, undotted[number])
        height = page.base(glyph.line, page.graph.uv[lost, 0]) - page.graph.uv[lost, 1]
        assert len(lost) < len(glyph.vertices) and (height > page.x_height / page.pixel).all()
        found += len(lost) > 0
    assert found
