"""Ink that runs off the picture: what is read of it is kept inside, named, and can be read back."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.hand import file
from handout.scanning.scan import Scan
from handout.scanning.written_page import read_page
from handout.tagging.glyph_extraction import reaches_edge
from handout.tagging.page_tagging import hand_of_pages, pen_of_pages, tag_page
from handout.tagging.segmentation import by_segments_once
from handout.values import LineGraph


def inside(graph, shape):
    return (graph.uv >= -0.5).all() and (graph.uv <= np.array(shape[::-1]) - 0.5).all()


def crop(small_scan, top, left, bottom, right):
    height, width = small_scan.simulated.image.shape[:2]
    rows, columns = slice(top, height - bottom), slice(left, width - right)
    return Scan(np.ascontiguousarray(small_scan.simulated.image[rows, columns]), 300.0, "crop.png")


def extent(small_scan):
    """Where ink begins and ends in the small scan: top, left, bottom, right, from the upper left."""
    ys, xs = np.nonzero(small_scan.simulated.truth.labels > 0)
    return ys.min(), xs.min(), ys.max() + 1, xs.max() + 1


@pytest.mark.slow
@pytest.mark.parametrize("edge", ["upper", "lower", "left", "right"])
def test_letters_cut_at_each_edge_are_doubted_and_come_back(small_scan, tmp_path, edge):
    top, left, bottom, right = extent(small_scan)
    height, width = small_scan.simulated.image.shape[:2]
    cuts = {"upper": (top + 9, 0, 0, 0), "left": (0, left + 9, 0, 0)}
    cuts |= {"lower": (0, 0, height - bottom + 9, 0), "right": (0, 0, 0, width - right + 9)}
    written = read_page(crop(small_scan, *cuts[edge]))
    made = tag_page(written, small_scan.written, rng=np.random.default_rng(1), method=by_segments_once)
    assert inside(made.page.graph, made.page.shape)
    cut = [glyph for glyph in made.glyphs if glyph.confidence == 0.0]
    assert cut and "the edge of the picture cuts" in made.notes[-1]
    assert all(f"{glyph.letter} (line {glyph.line + 1})" in made.notes[-1] for glyph in cut)
    path = tmp_path / "cut.hand"
    file.save(hand_of_pages("cut", [made]), path)
    assert np.abs(file.check(path).pages[0].graph.uv - made.page.graph.uv).max() <= 1 / 32


def test_a_whole_page_has_no_letter_cut(small_page):
    assert not any("cuts" in note for note in small_page.made.notes)


@pytest.mark.slow
@settings(max_examples=12)
@given(st.data())
def test_any_crop_of_a_page_can_be_kept(small_scan, tmp_path_factory, data):
    top, left, bottom, right = (int(value) for value in extent(small_scan))
    y, x = data.draw(st.integers(top, bottom - 150)), data.draw(st.integers(left, right - 300))
    height, width = data.draw(st.integers(120, bottom - y)), data.draw(st.integers(250, right - x))
    part = small_scan.simulated.image[y : y + height, x : x + width]
    try:
        written = read_page(Scan(np.ascontiguousarray(part), 300.0, "crop.png"))
    except InputError:
        return  # a crop with too little of the writing is refused with a reason
    assert inside(written.graph, written.scan.shape)
    path = tmp_path_factory.mktemp("crops") / "crop.hand"
    file.save(pen_of_pages("crop", [written]), path)
    assert len(file.check(path).pages[0].graph) == len(written.graph)


def test_a_line_along_the_edge_and_one_across_it_reach_it():
    uv = np.array([[0.0, 50.0], [30.0, 50.0], [99.5, 3.0], [40.0, 97.0]])
    graph = LineGraph(uv * 0.1, np.array([0.3, 0.3, 0.05, 0.35]), np.ones(4), uv, np.zeros((0, 2), dtype=int))
    assert reaches_edge(graph, (100, 100), 0.1).tolist() == [True, False, True, True]


def test_what_cannot_be_read_back_is_not_written(small_hand, tmp_path):
    path = tmp_path / "a.hand"
    file.save(small_hand, path)
    before = path.read_bytes()
    page = small_hand.pages[0]
    beyond = replace(page.graph, uv=page.graph.uv + page.shape[1])
    object.__setattr__(page := replace(page), "graph", beyond)  # as a fault of the program would make it
    with pytest.raises(InputError, match=r"a\.hand is not written.*a vertex lies outside its picture"):
        file.save(replace(small_hand, pages=(page,)), path)
    assert path.read_bytes() == before and [one.name for one in tmp_path.iterdir()] == ["a.hand"]
