"""A page among others, and the command that says so."""

import json

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from handout.errors import InputError
from handout_lab.cli.score_ import command
from handout_lab.score.comparison import own_nearest, rank_writers, read_crowd
from handout_lab.score.features import distance, page_features
from handout_lab.score.written_lines import ink
from tests.lab.score.drawn import page

KINDS = [
    {"slant": np.radians(-10)},
    {"slant": np.radians(5), "thickness": 6},
    {"slant": np.radians(18)},
    {"slant": np.radians(30), "thickness": 3},
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("crowd")
    for i, kind in enumerate(KINDS):
        cv2.imwrite(str(place / f"{i}.png"), page(lines=5, seed=i, **kind))
    return place


@pytest.mark.slow
def test_the_writer_comes_first(folder):
    crowd = read_crowd(folder)
    assert sorted(crowd) == ["0.png", "1.png", "2.png", "3.png"]
    for i, kind in enumerate(KINDS):
        own = page_features(ink(page(lines=6, letters=4, **kind)))
        found = rank_writers(own, crowd)
        assert found.names[0] == f"{i}.png" and found.rank(f"{i}.png") == 1
        hinges = [apart.hinge for apart in found.distances]
        assert hinges == sorted(hinges)
        assert found.nearest.hinge == hinges[0]
        assert found.nearest.runs == min(apart.runs for apart in found.distances)
        assert found.further().hinge == 1.0


def test_distances_of_a_crowd_to_their_nearest(folder):
    styles = list(read_crowd(folder).values())
    own = own_nearest(styles)
    assert len(own) == 4
    assert own[0].hinge == min(distance(styles[0], other).hinge for other in styles[1:])
    assert own_nearest(styles[:1]) == []


def test_a_page_is_not_one_of_its_own_crowd(folder):
    assert sorted(read_crowd(folder, [folder / "1.png"])) == ["0.png", "2.png", "3.png"]


def test_errors_are_said_in_a_sentence(tmp_path):
    with pytest.raises(InputError, match="not a folder"):
        read_crowd(tmp_path / "none")
    with pytest.raises(InputError, match="no other page"):
        read_crowd(tmp_path)
    with pytest.raises(InputError, match="no ink"):
        page_features(np.zeros((50, 50), dtype=bool))
    with pytest.raises(InputError, match="too little ink"):
        page_features(np.pad(np.ones((2, 2), dtype=bool), 20))
    with pytest.raises(InputError, match="empty"):
        rank_writers(page_features(ink(page(lines=2))), {})
    cv2.imwrite(str(tmp_path / "white.png"), np.full((90, 90), 255, np.uint8))
    with pytest.raises(InputError, match=r"white\.png.*no ink"):
        read_crowd(tmp_path)


@pytest.mark.slow
def test_the_command_compares(folder, tmp_path):
    one, two = tmp_path / "one.png", tmp_path / "two.png"
    cv2.imwrite(str(one), page(lines=4, **KINDS[2]))
    cv2.imwrite(str(two), page(lines=4, letters=4, **KINDS[2]))
    done = CliRunner().invoke(command, [str(one), str(two), "--crowd", str(folder), "--json"], catch_exceptions=False)
    said = json.loads(done.stdout)
    assert [entry["file"] for entry in said["pages"]] == [str(one), str(two)]
    assert said["pages"][0]["statistics"]["lines"] == 4
    (row,) = said["distances"]
    assert row["among"] == 5 and row["rank"] <= 2 and row["hinge"] < 0.05
    assert said["crowd"][0]["nearest"][0]["file"] == "2.png"
    plain = CliRunner().invoke(command, [str(one), "--crowd", str(folder)], catch_exceptions=False).stdout
    for words in ("repetition", "gap between words", "slant", "among 4: nearest hinge"):
        assert words in plain
    white = tmp_path / "white.png"
    cv2.imwrite(str(white), np.full((90, 90), 255, np.uint8))
    failed = CliRunner().invoke(command, [str(white)])
    assert isinstance(failed.exception, InputError) and "white.png: No written line" in str(failed.exception)
