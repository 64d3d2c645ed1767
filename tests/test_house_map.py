"""The map of the house in docs/architecture.md is that of the code."""

import re
from graphlib import CycleError

import house_map
import pytest


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


def test_files_that_the_documents_name_are_there():
    """`room/file.py` in a document is a file of the package, of the tests or of the checkout."""
    root = house_map.PACKAGE.parent
    named = {
        (document.name, name)
        for document in (root / "docs").glob("*.md")
        for name in re.findall(r"`([\w/.-]+/(?:[\w.-]+\.\w+)?)`", document.read_text(encoding="utf-8"))
        if not name.startswith(("~", "/", "."))
    }
    assert len(named) > 20
    lost = [pair for pair in named if not any((top / pair[1]).exists() for top in (root, house_map.PACKAGE))]
    assert lost == []
