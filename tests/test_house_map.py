"""The map of the house in docs/architecture.md is that of the code."""

import re
from graphlib import CycleError

import house_map
import pytest


def test_the_map_is_up_to_date():
    text = house_map.DOCUMENT.read_text(encoding="utf-8")
    assert text == house_map.drawn(text), "run: python tests/house_map.py"


@pytest.mark.slow
def test_every_room_and_file_says_what_it_is():
    files = [path for package in (house_map.PACKAGE, house_map.LAB) for path in package.rglob("*.py")]
    silent = [path for path in files if path.stat().st_size and not house_map.said(path)]
    assert silent == []


def test_arrows_that_others_imply_are_left_out_and_circles_are_not_drawn():
    assert house_map.reduced({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == {"a": {"b"}, "b": {"c"}, "c": set()}
    with pytest.raises(CycleError):
        house_map.reduced({"a": {"b"}, "b": {"a"}})


def test_files_that_the_documents_name_are_there():
    """`room/file.py` in a document is the end of the path of a file of the checkout; capitals stand for any name."""
    root = house_map.PACKAGE.parent
    folders = ("handout", "handout_lab", "tests", "benchmarks", "devices", "docs", "examples", "calibration", "styles")
    paths = [path.relative_to(root).as_posix() for folder in folders for path in (root / folder).rglob("*.*")]
    named = {
        (document.name, name)
        for document in (root / "docs").glob("*.md")
        if document.name != "formats.md"  # which names the parts of archives
        for name in re.findall(r"`([a-z][\w/.-]*/[\w.-]+\.[a-z]+)`", document.read_text(encoding="utf-8"))
        if not re.search(r"[A-Z]{4}", name)
    }
    assert len(named) > 100
    lost = {(document, name) for document, name in named if not any(f"/{path}".endswith(f"/{name}") for path in paths)}
    assert sorted(lost) == []
