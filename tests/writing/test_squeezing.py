"""Bunching the words of a line without making two of them one."""

from types import SimpleNamespace
from typing import Any

from handout.writing.pages import LEAST_GAP, extent, squeeze_gaps


def _units(gaps: list[float]) -> list[Any]:
    word = SimpleNamespace(left=0.0, right=5.0, advance=5.0)
    return [SimpleNamespace(word=word, gap=gap) for gap in gaps]


def test_what_is_narrow_already_is_notsqueezed() -> None:
    units = _units([0.0, LEAST_GAP, 2.0, 1.0])
    room = extent(units, [0.0, LEAST_GAP, 2.0, 1.0]) - 0.5
    found = squeeze_gaps(units, room, 0.22)
    assert found is not None and abs(extent(units, found) - room) < 1e-9
    assert found[1] == LEAST_GAP and min(found[1:]) >= LEAST_GAP


def test_a_line_of_narrow_gaps_gives_nothing() -> None:
    units = _units([0.0, LEAST_GAP, LEAST_GAP])
    assert squeeze_gaps(units, extent(units, [0.0, LEAST_GAP, LEAST_GAP]) - 0.01, 0.22) is None


def test_the_gaps_near_the_edge_give_first() -> None:
    units = _units([0.0, 2.0, 2.0, 2.0])
    found = squeeze_gaps(units, extent(units, [0.0, 2.0, 2.0, 2.0]) - 0.4, 0.22)
    assert found is not None and found[:3] == [0.0, 2.0, 2.0] and abs(found[3] - 1.6) < 1e-9
    more = squeeze_gaps(units, extent(units, [0.0, 2.0, 2.0, 2.0]) - 0.7, 0.22)
    assert more is not None and more[1] == 2.0 and abs(more[2] - 1.8) < 1e-9 and abs(more[3] - 1.5) < 1e-9
