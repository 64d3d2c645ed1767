"""Letters of a hand corrected one after another, as the page Letters does it, and what two windows do to each other."""

import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from handout import atomic
from handout.errors import InputError
from handout.hand import file
from handout.hand.corrections import apply
from handout.pipeline import kept_hands
from handout.pipeline import letter_desk as desk
from handout.pipeline.page_tiles import TILE
from handout.tagging import relearning
from handout.tagging.segmentation import by_segments

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
        assert one["ink"].startswith("M") and set(one["ink"]) <= set("ML-0123456789. ")
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


def test_a_letter_is_kept_out_written_again_and_turned_back(hand):
    spot = letters(hand)[3]["spot"]
    made(hand, {"do": "keep_out", "at": spot})
    assert letters(hand)[3]["verdict"] == "kept_out" and desk.keep_letters(hand)["made"] == 1
    assert file.load(Path(hand)).glyphs[3].kept_out
    made(hand, {"do": "keep_out", "at": spot, "out": False})
    assert letters(hand)[3]["verdict"] == "confirmed"
    back = desk.rewind_letters(hand, desk.open_letters(hand)["revision"], 1)
    assert letters(hand)[3]["verdict"] == "kept_out"
    desk.rewind_letters(hand, back["revision"], 1)
    assert letters(hand)[3]["verdict"] not in ("kept_out", "confirmed")


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
    # what was aligned after a correction of this window is asked for after one of another's
    now, spot = desk.open_letters(hand)["revision"], letters(hand)[1]["spot"]
    other = msgspec.json.encode([{"do": "confirm", "page": 0, "at": spot}])
    desk.correct_letters(hand, now, other, later=True)
    assert desk.align_letters(hand, now)["told"]["0"]["letters"] == letters(hand)


EDITS = """
import sys
from handout.pipeline.kept_hands import edit_hand
edit_hand(sys.argv[1], sys.argv[2], learning=False)
"""
STUDIO = """
import sys
from pathlib import Path
from handout.pipeline import letter_desk as desk
for kept in (False, True):
    while True:
        try:
            revision = desk.open_letters(sys.argv[1])["revision"]
            desk.correct_letters(sys.argv[1], revision, Path(sys.argv[2 + kept]).read_bytes())
            break
        except desk.StaleHand:
            pass
    if kept:
        desk.keep_letters(sys.argv[1])
"""


def test_four_programs_at_once_lose_no_correction(hand, tmp_path):
    spots, files = [one["spot"] for one in letters(hand)[:6]], []
    before = file.load(Path(hand))
    for number, spot in enumerate(spots):
        files.append(tmp_path / f"{number}.json")
        files[-1].write_bytes(msgspec.json.encode([{"do": "confirm", "page": 0, "at": spot}]))
    wait = "import sys; from handout.pipeline import kept_hands, letter_desk; letter_desk._PATIENCE = 300.0\n"
    wait += "print(flush=True); sys.stdin.readline()\n"
    # two of each kind, so that each meets its like and the other
    works = [(EDITS, files[:1]), (EDITS, files[1:2]), (STUDIO, files[2:4]), (STUDIO, files[4:6])]
    running = [
        subprocess.Popen(
            [sys.executable, "-c", wait + code, hand, *given], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        for code, given in works
    ]
    for one in running:
        one.stdout.readline()
    for one in running:
        one.stdin.write(b"go\n")
        one.stdin.flush()
    for one in running:
        one.communicate()
        assert one.returncode == 0
    desk._DESKS.clear()
    desk.open_letters(hand)
    desk.keep_letters(hand)
    journal, now = file.journal(Path(hand)), file.load(Path(hand))
    assert sorted(one.at for one in journal.corrections) == sorted(map(tuple, spots)) and journal.made == 6
    assert [one["verdict"] for one in letters(hand)].count("confirmed") == 6
    told = apply(before, journal.corrections)
    assert [glyph.confirmed for glyph in now.glyphs] == [glyph.confirmed for glyph in told.glyphs]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["mine.hand", *(path.name for path in files)])


def test_a_hand_that_another_program_changes_is_not_waited_for_without_a_word(hand, monkeypatch):
    state, spot, said = desk.open_letters(hand), letters(hand)[0]["spot"], []
    code = "import sys; from pathlib import Path; from handout import atomic\n"
    code += "with atomic.hold_file(Path(sys.argv[1])): print(flush=True); sys.stdin.readline()"
    monkeypatch.setattr(desk, "_PATIENCE", 0.0)
    with subprocess.Popen(
        [sys.executable, "-c", code, hand], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0
    ) as other:
        other.stdout.readline()
        with pytest.raises(InputError, match=r"mine\.hand is being changed by another program: wait until"):
            desk.correct_letters(
                hand, state["revision"], msgspec.json.encode([{"do": "confirm", "page": 0, "at": spot}])
            )
        assert desk.open_letters(hand) == state

        def say(sentence):
            said.append(sentence)
            other.stdin.write(b"go\n")

        with pytest.raises(InputError, match="nothing to be undone"):
            kept_hands.undo_edits(hand, 1, listener=SimpleNamespace(say=say))
    assert said == ["Another program is changing mine.hand: waiting until it is through."]


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

    whole = file.load(Path(hand)).pages[0].on_paper()
    tile = cv2.imdecode(np.frombuffer(desk.page_tile(hand, 0, 0, 1, 0), np.uint8), 1)[:, :, ::-1]
    part = whole[:TILE, TILE : 2 * TILE]
    assert tile.shape == part.shape and np.abs(tile.astype(int) - part).mean() < 3


def log(hand):
    return Path(hand + ".log")


def test_what_was_not_in_the_file_yet_is_made_again_after_a_break(hand):
    made(hand, {"do": "confirm", "at": letters(hand)[2]["spot"]})
    made(hand, {"do": "confirm", "at": letters(hand)[5]["spot"]})
    desk.rewind_letters(hand, desk.open_letters(hand)["revision"], 1)
    assert file.journal(Path(hand)).made == 0 and log(hand).exists()
    with log(hand).open("ab") as stream:
        stream.write(b'{"corrections": [{"do": "rem')  # it was being written, and nobody was told that it is kept
    desk._DESKS.clear()
    assert [one["verdict"] == "confirmed" for one in letters(hand)[2:6]] == [True, False, False, False]
    desk.keep_letters(hand)
    assert file.journal(Path(hand)).made == 1 and not log(hand).exists()
    assert file.load(Path(hand)).glyphs[2].confirmed


def test_a_log_that_the_file_has_already_is_not_made_twice(hand):
    made(hand, {"do": "confirm", "at": letters(hand)[2]["spot"]})
    before = log(hand).read_bytes()
    desk.keep_letters(hand)
    log(hand).write_bytes(before)  # as if the break had come before it was deleted
    desk._DESKS.clear()
    assert desk.open_letters(hand)["made"] == 1 and not log(hand).exists()


def test_on_a_full_disk_a_correction_is_refused_and_nothing_is_changed(hand, monkeypatch):
    made(hand, {"do": "confirm", "at": letters(hand)[2]["spot"]})
    state, before, kept = desk.open_letters(hand), letters(hand), log(hand).read_bytes()

    def full(_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", full)
        with pytest.raises(InputError, match="No space left on device; it was not made"):
            made(hand, {"do": "confirm", "at": letters(hand)[5]["spot"]})
    assert log(hand).read_bytes() == kept and letters(hand) == before
    assert desk.open_letters(hand)["made"] == state["made"]
    with monkeypatch.context() as patch:
        patch.setattr(atomic, "write", lambda *_: (_ for _ in ()).throw(InputError("No space left.")))
        with pytest.raises(InputError, match=r"safe in mine\.hand\.log"):
            desk.keep_letters(hand)
    desk.keep_letters(hand)
    assert file.journal(Path(hand)).made == 1


def test_strokes_that_were_told_stay_so(hand):
    one = next(one for one in letters(hand) if one["joined"] and len(one["ink"]) > 150)

    def strokes():
        found = desk.letter_strokes(hand, 0, tuple(one["spot"]))["strokes"]
        return [each for each in found if each["id"] == one["id"]]

    # what leads to the next letter is passed on the way, too
    told = [each["xy"][::-1] + each["xy"][1:] for each in strokes()]
    made(hand, {"do": "strokes", "at": one["spot"], "ways": told})
    desk.keep_letters(hand)
    desk._DESKS.clear()
    assert [each["xy"] for each in strokes()] == told and all(each["own"] for each in strokes())


def test_it_is_told_which_letters_follow_what_was_said_of_one(hand):
    def ways():
        spots = [(one["id"], one["spot"]) for one in letters(hand) if one["letter"] == "s"]
        found = {at: desk.letter_strokes(hand, 0, tuple(spot))["strokes"] for at, spot in spots}
        return {at: [each["xy"] for each in word if each["id"] == at] for at, word in found.items()}

    before = ways()
    one = next(one for one in letters(hand) if one["letter"] == "s")
    said = made(hand, {"do": "strokes", "at": one["spot"], "ways": [xy[::-1] for xy in before[one["id"]]]})
    changed = {each["id"] for each in said["rewritten"].get("0", [])}
    after = ways()
    assert changed and changed == {at for at in before if before[at] != after[at]} - {one["id"]}
    desk.rewind_letters(hand, said["revision"], 1)
    assert ways() == before


def test_the_words_around_a_correction_follow_it(hand):
    state, (x, y) = desk.open_letters(hand), letters(hand)[6]["spot"]
    one = {"page": 0, "do": "paint", "to": "paper", "stroke": [[x, y], [x + 9, y]], "width": 6}
    said = desk.correct_letters(hand, state["revision"], msgspec.json.encode([one]), later=True)
    assert said["behind"] and log(hand).exists()
    rest = desk.align_letters(hand, said["revision"])
    assert rest["revision"] == said["revision"]
    told = {one["id"]: one for part in (said, rest) for one in part["told"]["0"]["letters"]}
    after = letters(hand)
    desk.rewind_letters(hand, said["revision"], 1)
    made(hand, {name: value for name, value in one.items() if name != "page"})
    assert letters(hand) == after and all(told[one["id"]] == one for one in after if one["id"] in told)
    desk._DESKS.clear()  # as after a server was killed
    assert [one["ink"] for one in letters(hand)] == [one["ink"] for one in after]


def test_a_baseline_is_dragged(hand):
    first = desk.open_letters(hand)["pages"][0]["baselines"][0]
    lower = [[x, y + 3.0] for x, y in first]
    state = made(hand, {"do": "baseline", "line": 0, "a": lower[0], "b": lower[1]})
    for place, wanted in zip(state["pages"][0]["baselines"][0], lower, strict=True):
        assert place == pytest.approx(wanted, abs=0.11)
    assert [one["letter"] for one in letters(hand)] == [glyph.letter for glyph in file.load(Path(hand)).glyphs]


def test_the_others_learn_while_more_is_corrected(hand, tmp_path, monkeypatch):
    monkeypatch.setattr(relearning, "by_segments", partial(by_segments, adapting=False))
    state = made(hand, {"do": "confirm", "at": letters(hand)[0]["spot"]})
    copy = str(tmp_path / "copy.hand")
    begun = desk.begin_learning(hand, state["revision"], copy)
    made(hand, {"do": "confirm", "at": letters(hand)[7]["spot"]})
    desk.learn_apart(copy)
    taken = desk.take_learnt(hand, copy, begun["made"])
    assert taken["told"]["0"]["order"] == [one["id"] for one in letters(hand)]
    assert taken["made"] >= 2 and taken["revision"] != state["revision"]
    assert [letters(hand)[i]["verdict"] for i in (0, 7)] == ["confirmed"] * 2
    moved = Path(copy).rename(tmp_path / "moved.hand")
    assert desk.page_tile(hand, 0, 0, 0, 0), "pictures are those of the hand's own file"
    desk.rewind_letters(hand, taken["revision"], taken["made"])
    with pytest.raises(desk.StaleHand, match="undone"):
        desk.take_learnt(hand, str(moved), begun["made"])


class Killed(BaseException):
    """Nothing runs after it, as after SIGKILL."""


@pytest.mark.parametrize("alive", [1, 2, 3])
def test_a_kill_while_what_was_learned_is_taken_loses_no_correction(hand, tmp_path, monkeypatch, alive):
    monkeypatch.setattr(desk._LetterDesk, "aligner", lambda *_: None)
    monkeypatch.setattr(desk, "vet", lambda hand: SimpleNamespace(probability=np.full(len(hand.glyphs), 0.9)))
    spots, copy = [letters(hand)[i]["spot"] for i in (0, 7)], str(tmp_path / "copy.hand")
    state = made(hand, {"do": "confirm", "at": spots[0]})
    begun = desk.begin_learning(hand, state["revision"], copy)
    made(hand, {"do": "confirm", "at": spots[1]})
    desk.keep_letters(hand)
    touched = []

    def counted(real):
        def touching(*arguments):
            touched.append(real.__name__)
            if len(touched) == alive:
                raise Killed
            return real(*arguments)

        return touching

    for owner, name in ((atomic, "write"), (desk.PendingLog, "add"), (desk.PendingLog, "forget"), (os, "fsync")):
        monkeypatch.setattr(owner, name, counted(getattr(owner, name)))
    with pytest.raises(Killed):
        desk.take_learnt(hand, copy, begun["made"])
    desk._DESKS.clear()
    assert [letters(hand)[i]["verdict"] for i in (0, 7)] == ["confirmed"] * 2, touched


def test_what_was_undone_in_the_file_is_neither_made_again_nor_taken_for_what_was_made_anew(hand):
    first, second = (one["spot"] for one in letters(hand)[3:5])
    made(hand, {"do": "confirm", "at": first})
    desk.keep_letters(hand)
    desk.rewind_letters(hand, desk.open_letters(hand)["revision"], 1)
    state = made(hand, {"do": "confirm", "at": first})
    desk._DESKS.clear()  # as after a server was killed
    assert letters(hand)[3]["verdict"] == "confirmed"
    desk.rewind_letters(hand, desk.open_letters(hand)["revision"], 1)
    desk.keep_letters(hand)
    state = made(hand, {"do": "confirm", "at": second})
    assert state["made"] == state["entries"] == 1
    with pytest.raises(InputError, match="made again"):
        desk.rewind_letters(hand, state["revision"], -1)
