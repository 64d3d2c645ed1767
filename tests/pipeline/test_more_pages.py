"""More pages of an author added to his hand."""

from types import SimpleNamespace

import pytest

from handout.errors import InputError
from handout.hand import file
from handout.hand.corrections import Confirm, JournalEntry, apply_and_tell
from handout.hand.pending import untaken
from handout.pipeline import hands
from handout.pipeline import letter_desk as desk

pytestmark = pytest.mark.slow


def test_pages_are_added_and_what_was_corrected_stays(small_hand, small_hand_file, tmp_path, monkeypatch):
    path = tmp_path / "mine.hand"
    path.write_bytes(small_hand_file.read_bytes())
    before, state = file.load(path), desk.open_letters(str(path))
    spot = desk.page_letters(str(path), 0)["letters"][2]["spot"]
    confirm = b'[{"do": "confirm", "page": 0, "at": [%f, %f]}]' % tuple(spot)
    desk.correct_letters(str(path), state["revision"], confirm)
    assert "corrections that mine.hand lacks" in untaken(str(path))[0]
    # reading is tested where it is done: here the pages are there already
    read = SimpleNamespace(hand=small_hand, pages=(), moved=2)

    def reading(*given):
        """Meanwhile another program corrects the hand."""
        hand, number = file.load(path), before.glyphs[5]
        at = tuple(hand.pages[0].graph.uv[number.vertices[0]].tolist())
        made = apply_and_tell(hand, [Confirm(page=0, at=at)]).hand
        file.record(path, path, hand, made, JournalEntry((Confirm(page=0, at=at),), ()))
        return read

    monkeypatch.setattr(hands, "_read_pages", reading)
    more = hands.read_more(str(path), ["page.png"], ["an even line"])
    assert untaken(str(path)) == ()
    joined, count = file.load(path), len(before.glyphs)
    assert len(joined.pages) == 2 and len(joined.glyphs) == 2 * count and joined.glyphs[2].confirmed
    assert sum(glyph.confirmed for glyph in joined.glyphs) == 2
    for old, new in zip(before.glyphs, joined.glyphs[count:], strict=True):
        assert (new.letter, new.page, new.line) == (old.letter, 1, old.line)
        assert new.after == (old.after + count if old.after >= 0 else old.after)
    moved, stays, kept = more.notes
    assert moved.endswith("went there: 2 pieces.")
    assert stays == "What was corrected in small stays, and can no longer be undone." and "--ink-only" in kept
    assert desk.open_letters(str(path))["revision"] != state["revision"]
    assert len(desk.page_letters(str(path), 1)["letters"]) == count


def test_only_an_own_hand_gets_pages():
    with pytest.raises(InputError, match="copy it first"):
        hands.read_more("house-joined-ballpoint", ["page.png"], ["text"])
