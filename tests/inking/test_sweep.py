"""Ink along a new way: the writer's own, whole, as wide as his, and without a speck."""

from itertools import pairwise

import numpy as np
import pytest

from handout.errors import InputError
from handout.inking import sweep
from handout.inking.sweep import InkedWay, Sweep


@pytest.fixture(scope="module")
def inked(small_hand):
    """A way that goes up, turns round and goes on in a wave; its ink alone, and its places."""
    t = np.linspace(0, 1, 200)[:, None]
    up = np.array([40.0, 120.0]) + t * [25.0, -80.0]
    wave = up[-1] + np.column_stack([90 * t, 40 * np.sin(5 * t)])
    page = np.zeros((160, 220, 4), dtype=np.float32)
    Sweep(small_hand).ink(page, InkedWay(np.concatenate([up, wave[1:]])))
    return page, np.concatenate([up, wave])


def test_the_ink_is_whole_and_as_wide_as_the_writers_line(small_hand, inked):
    import cv2

    page, way = inked
    x, y = np.rint(way).astype(int).T
    assert (page[y, x, 3] > 0.25).mean() > 0.97
    count, _ = cv2.connectedComponents((page[:, :, 3] > 0.1).astype(np.uint8))
    assert count == 2, "nothing but one stroke"
    usual = sweep.stock(small_hand).usual
    length = np.hypot(*np.diff(way, axis=0).T).sum()
    assert 1.1 * usual < page[:, :, 3].sum() / length < 3 * usual
    away = np.hypot(way[0, 0] - np.arange(220), way[0, 1] - np.arange(160)[:, None])
    beyond = (np.arange(160)[:, None] > way[0, 1] + 2.5 * usual + 2) & (away < 30)
    assert not page[beyond].any(), "it ends where the way begins"


def test_the_ink_is_the_writers(small_hand, inked):
    page, _ = inked
    assert (page[:, :, :3] <= page[:, :, 3:]).all() and page.max() <= 1
    rgba = small_hand.pages[0].texture.rgba
    own = np.median(rgba[rgba[:, :, 3] > 200][:, :3], axis=0) / 255
    dark = page[:, :, 3] > 0.7
    assert np.abs(np.median(page[dark][:, :3] / page[dark][:, 3:], axis=0) - own).max() < 0.12


def test_long_stretches_are_taken_and_not_the_same_again(small_hand):
    one, way = Sweep(small_hand), np.column_stack([np.linspace(0, 20, 100), np.linspace(100, 0, 100)])
    first, second = (one._numbers(way, (True, True)) for _ in range(2))
    assert (np.diff(first) == 1).mean() > 0.8
    assert not np.array_equal(first, second)
    loose, left = sweep.stock(small_hand).loose[first[0], 0], first[0] - sweep.stock(small_hand).first[first[0]]
    assert loose and left < 3 * sweep.tip(sweep.stock(small_hand).usual), "a stroke begins as strokes begin"


def test_a_dot_is_inked(small_hand):
    page = np.zeros((30, 30, 4), dtype=np.float32)
    Sweep(small_hand).ink(page, InkedWay(np.array([[15.0, 15.0]])))
    assert page[15, 15, 3] > 0.3 and not page[:5].any() and not page[-5:].any()


def test_a_way_is_parted_where_it_turns_back_and_before_it_crosses_itself():
    there = np.column_stack([np.linspace(0, 40, 41), np.zeros(41)])
    assert sweep._cusps(np.concatenate([there, there[-2::-1] + np.array([0, 0.3])]), 1.5) == [40]
    assert sweep._cusps(there, 1.5) == []
    turn = np.linspace(0, 2 * np.pi, 126)
    circle = 20 * np.column_stack([np.cos(turn), np.sin(turn)])
    parts = list(sweep._even_parts(circle, 0, len(circle)))
    assert parts[0][0] == 0 and parts[-1][1] == len(circle) and len(parts) >= 4
    assert all(b - 1 == c for (_, b), (c, _) in pairwise(parts)), "they meet"


def test_a_line_of_the_stock_read_backwards_is_what_its_places_say(small_hand):
    some = sweep.stock(small_hand)
    ahead = some.free[:-1] & some.free[1:] & (some.last[:-1] == some.last[1:])
    step = (some.xy[1:] - some.xy[:-1])[ahead]
    assert ((step * some.along[:-1][ahead]).sum(axis=1) > 0).mean() > 0.99
    assert np.allclose(np.hypot(*some.along[some.free].T), 1, atol=1e-6)


def test_a_page_without_clear_lines_is_no_pen(small_hand, monkeypatch):
    monkeypatch.setattr(sweep, "_FEWEST", 10**9)
    with pytest.raises(InputError, match="too few clear pieces of line"):
        sweep.stock.__wrapped__(small_hand)
