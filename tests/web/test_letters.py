"""Letters of a hand corrected one after another, as the page Letters does it, and what two windows do to each other."""

from pathlib import Path

import msgspec
import pytest

from handout.errors import InputError
from handout.hand import file
from handout.pipeline import letter_desk as desk
from handout.tagging import segmentation
from handout.tagging.segmentation import Adaptation

pytestmark = pytest.mark.slow


@pytest.fixture
def hand(small_hand_file, tmp_path):
    path = tmp_path / "mine.hand"
    path.write_bytes(small_hand_file.read_bytes())
    return str(path)


def made(hand, *corrections):
    state = desk.open_letters(hand)
    return desk.correct_letters(
        hand, state["revision"], msgspec.json.encode([{"page": 0, **one} for one in corrections])
    )


def letters(hand):
    return desk.page_letters(hand, 0)["letters"]


def test_a_page_shows_each_letter_where_its_ink_is(hand):
    found, glyphs = letters(hand), file.load(Path(hand)).glyphs
    assert [one["letter"] for one in found] == [glyph.letter for glyph in glyphs]
    for one in found:
        left, top, right, low = one["box"]
        assert left <= one["spot"][0] <= right and top <= one["spot"][1] <= low
        assert one["ink"].startswith("M") and set(one["ink"]) <= set("ML-0123456789 ")
    assert "an even line," in " ".join(dict.fromkeys(one["word"] for one in found))


def test_corrections_are_kept_at_once_and_turned_back(hand):
    first = letters(hand)[3]
    state = made(hand, {"do": "confirm", "at": first["spot"]})
    assert (state["made"], state["entries"]) == (1, 1) and letters(hand)[3]["verdict"] == "confirmed"
    desk._DESKS.clear()  # as after a server was killed
    assert letters(hand)[3]["verdict"] == "confirmed"
    back = desk.rewind_letters(hand, desk.open_letters(hand)["revision"], 1)
    assert (back["made"], back["entries"]) == (0, 1) and letters(hand)[3]["verdict"] != "confirmed"
    again = desk.rewind_letters(hand, back["revision"], -1)
    assert again["made"] == 1 and letters(hand)[3]["verdict"] == "confirmed"
    with pytest.raises(InputError, match="made again"):
        desk.rewind_letters(hand, again["revision"], -1)


def test_a_letter_is_cut_and_joined_again(hand):
    before = letters(hand)
    wide = max(before, key=lambda one: one["box"][2] - one["box"][0])
    left, top, right, low = wide["box"]
    made(hand, {"do": "split", "a": [(left + right) / 2, top - 5], "b": [(left + right) / 2, low + 5]})
    parts = letters(hand)
    assert len(parts) == len(before) + 1 and sum(one["verdict"] == "unnamed" for one in parts) == 1
    at = next(i for i, one in enumerate(parts) if one["verdict"] == "unnamed")
    named = parts[at - 1] if parts[at - 1]["word"] == wide["word"] else parts[at + 1]
    made(hand, {"do": "merge", "at": named["spot"], "other": parts[at]["spot"]})
    assert [one["letter"] for one in letters(hand)] == [one["letter"] for one in before]


def test_the_letters_that_nobody_named_stay_as_sure_as_they_were(hand):
    before = letters(hand)
    made(hand, {"do": "confirm", "at": before[0]["spot"]})
    assert [one["probability"] for one in letters(hand)[1:]] == [one["probability"] for one in before[1:]]


def test_two_windows_do_not_write_over_each_other(hand):
    state = desk.open_letters(hand)
    made(hand, {"do": "confirm", "at": letters(hand)[0]["spot"]})
    with pytest.raises(desk.StaleHand, match="another window"):
        desk.correct_letters(hand, state["revision"], b'[{"do": "remove", "page": 0, "at": [1, 1]}]')
    with pytest.raises(desk.StaleHand):
        desk.rewind_letters(hand, state["revision"], 1)


def test_what_cannot_be_corrected_changes_nothing(hand):
    state, before = desk.open_letters(hand), letters(hand)
    for wrong in (b"[", b'[{"do": "fly"}]', b'[{"do": "confirm", "page": 9, "at": [1, 1]}]'):
        with pytest.raises(InputError):
            desk.correct_letters(hand, state["revision"], wrong)
    assert desk.open_letters(hand) == state and letters(hand) == before
    with pytest.raises(InputError, match="comes with the program"):
        desk.correct_letters("house-joined-ballpoint", "x", b"[]")
    for level, column in ((9, 0), (0, 99)):
        with pytest.raises(InputError):
            desk.page_tile(hand, 0, level, column, 0)


def test_tiles_are_the_page(hand):
    import cv2
    import numpy as np

    whole = file.load(Path(hand)).pages[0].on_paper()
    tile = cv2.imdecode(np.frombuffer(desk.page_tile(hand, 0, 0, 1, 0), np.uint8), 1)[:, :, ::-1]
    part = whole[: desk.TILE, desk.TILE : 2 * desk.TILE]
    assert tile.shape == part.shape and np.abs(tile.astype(int) - part).mean() < 3


def test_the_others_learn_when_they_are_asked_to(hand, monkeypatch):
    monkeypatch.setattr(segmentation, "_ADAPTATION", Adaptation(copies=1, rehearsed=2, epochs=1))  # takes seconds
    state = made(hand, {"do": "confirm", "at": letters(hand)[0]["spot"]})
    learnt = desk.learn_letters(hand, state["revision"])
    assert learnt["made"] in (1, 2) and letters(hand)[0]["verdict"] == "confirmed"
