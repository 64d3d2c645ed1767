"""The map of the house in docs/architecture.md is that of the code."""

import house_map
import pytest
from graphlib import CycleError


def test_the_map_is_up_to_date():
    text = house_map.DOCUMENT.read_text(encoding="utf-8")
    assert text == house_map.drawn(text), "run: python tests/house_map.py"


def test_every_room_and_file_says_what_it_is():
    silent = [path for path in house_map.PACKAGE.rglob("*.py") if path.stat().st_size and not house_map.said(path)]
    assert silent == []


def test_arrows_that_others_imply_are_left_out_and_circles_are_not_drawn():
    assert house_map.reduced({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == {"a": {"b"}, "b": {"c"}, "c": set()}
    with pytest.raises(CycleError):
        house_map.reduced({"a": {"b"}, "b": {"a"}})
