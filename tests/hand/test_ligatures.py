"""Where a letter ends and the way to the next one begins."""

import zipfile
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from handout.hand import file
from handout.hand.learnt import recall
from handout.hand.ligatures import LigatureFinder
from handout.values import LineGraph

STEP = 0.05  # x-heights between two vertices


def way_between(small_hand, corners, cut, letter="a"):
    """The heights of the way that is found on a stroke through some corners, x-heights, of which `cut` is the first."""
    page = small_hand.pages[0]
    pieces = [
        np.linspace(a, b, max(int(np.hypot(*np.subtract(b, a)) / STEP), 1), endpoint=False)
        for a, b in pairwise(corners)
    ]
    xy = np.concatenate([*pieces, [corners[-1]]])
    uv = page.to_picture(1, xy * page.x_height / page.pitch + (3, 0))
    n = len(uv)
    edges = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    graph = LineGraph(uv * page.pixel, np.full(n, 0.2), np.ones(n), uv, edges)
    owner = (np.arange(n) >= round(cut * n)).astype(int)
    glyph = replace(small_hand.glyphs[0], letter=letter, line=1)
    (way,) = LigatureFinder(replace(page, graph=graph), owner).ligatures_between(0, glyph, 1)
    path = way.path.tolist()
    assert path == list(range(path[0], path[-1] + 1)) and owner[path[0]] == 0 and owner[path[-1]] == 1
    return xy[path, 1]


@pytest.mark.parametrize("cut", [0.25, 0.32, 0.4, 0.5, 0.6, 0.68, 0.75])
def test_a_way_rises_from_where_one_letter_came_down_to_where_the_next_goes_down(small_hand, cut):
    """The stem of an a, the stroke up, the first leg of an n: a third each; and letters that were cut on either."""
    heights = way_between(small_hand, [(0, 0.95), (0.1, 0), (0.5, 0.95), (0.6, 0)], cut)
    assert heights.min() < STEP
    of_stem, of_leg = int(heights.argmin()) * STEP, (len(heights) - 1 - int(heights.argmax())) * STEP
    whole = 2.94  # x-heights
    assert of_stem == pytest.approx(max(0.325 - cut, 0) * whole, abs=0.1)
    assert of_leg == pytest.approx(max(cut - 0.675, 0) * whole, abs=0.1)


@pytest.mark.parametrize("cut", [0.7, 0.74, 0.8])
def test_the_last_leg_of_a_letter_is_its_own(small_hand, cut):
    """The leg of an n, from which the pen goes on level into the bow of a d: no way to another letter has it."""
    heights = way_between(small_hand, [(0, 0.95), (0.1, 0.02), (0.25, 0), (0.45, 0.04)], cut)
    assert heights.max() < 0.15


def test_what_leaves_high_does_not_go_down_with_the_next_letter(small_hand):
    """From the top of an o level to the first leg of an n."""
    heights = way_between(small_hand, [(0, 0.9), (0.5, 0.88), (0.6, 0.9), (0.7, 0)], 0.3)
    assert heights.min() > 0.8


@pytest.mark.parametrize("cut", [0.62, 0.66, 0.7])
def test_the_stroke_up_of_a_w_is_its_own(small_hand, cut):
    """The last two strokes of a w, from the top a dip, and up into an e: without it the w would be a u."""
    corners = [(0, 0.95), (0.2, 0), (0.4, 0.95), (0.55, 0.75), (0.9, 0.95), (1.0, 0.5)]
    heights = way_between(small_hand, corners, cut, "w")
    assert heights.min() > 0.6 and heights[-1] > 0.8


def test_a_file_of_an_earlier_program_has_its_ligatures_found_again(small_hand, tmp_path):
    bare = replace(small_hand, glyphs=tuple(replace(glyph, ligatures=()) for glyph in small_hand.glyphs))
    file.save(bare, tmp_path / "now.hand")
    assert not any(glyph.ligatures for glyph in file.load(tmp_path / "now.hand").glyphs)
    file.keep_learnt(tmp_path / "now.hand", {"worked out 1": np.ones(3)})
    assert recall(file.load(tmp_path / "now.hand"), "worked out", 1) is not None
    with zipfile.ZipFile(tmp_path / "now.hand") as now, zipfile.ZipFile(tmp_path / "old.hand", "w") as old:
        for name in now.namelist():
            if "rising" not in name:
                old.writestr(name, now.read(name))
    found = file.load(tmp_path / "old.hand")
    assert [len(g.ligatures) for g in found.glyphs] == [len(g.ligatures) for g in small_hand.glyphs]
    assert recall(found, "worked out", 1) is None
