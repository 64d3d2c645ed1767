"""What is worked out of a hand is kept beside it, so that the next text need not wait for it."""

import re
from unittest.mock import patch

import pytest

from handout import atomic
from handout.errors import InputError
from handout.hand import file, learnt, library
from handout.hand.learnt import is_kept, recall
from handout.hand.measures import ink_colours
from handout.motion.recovery.kept_strokes import part_by_glyph
from handout.motion.recovery.letter_forms import HANDS
from handout.motion.recovery.stroke_order import VERSION as STROKES
from handout.motion.recovery.stroke_order import StrokeOrderModel
from handout.pipeline.hand_learning import learn, learn_beside
from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions
from handout.pipeline.texts import prepare
from handout.pipeline.writing import write
from handout.writing.legibility import VERSION

TEXT = "ten tall ants"


@pytest.fixture
def own(small_hand, tmp_path):
    """A hand whose file keeps nothing, as an earlier version of the program left it."""
    file.save(small_hand, path := tmp_path / "own.hand")
    return path


@pytest.mark.slow
def test_the_first_text_keeps_what_the_next_ones_take(own):
    before = own.read_bytes()
    written = [own.with_name(f"{n}.png") for n in (1, 2)]
    write(TEXT, [written[0]], WritingOptions(str(own), seed=1))
    assert own.with_suffix(".learnt").is_file() and own.read_bytes() == before
    library._load_scanned.cache_clear()
    with patch.object(learnt, "readonly", wraps=learnt.readonly) as taken:
        write(TEXT, [written[1]], WritingOptions(str(own), seed=1))
    assert taken.call_count
    again = library.find(str(own))
    assert is_kept(again) and recall(again, "misreadings", VERSION) is not None
    assert written[0].read_bytes() == written[1].read_bytes()


@pytest.mark.slow
def test_how_letters_were_written_is_worked_out_with_the_first_drawing(own):
    learn(own)
    drawn = [own.with_name(f"{n}.inkml") for n in (1, 2)]
    write(TEXT, [own.with_name("ink.png")], WritingOptions(str(own), seed=1))
    assert not own.with_suffix(".learnt").exists()
    write(TEXT, [drawn[0]], WritingOptions(str(own), seed=1))
    kept = file.load(own)
    assert part_by_glyph(recall(kept, f"strokes by {', '.join(HANDS)}", STROKES), len(kept.glyphs))
    library._load_scanned.cache_clear()
    with patch.object(StrokeOrderModel, "_choose", side_effect=AssertionError):
        write(TEXT, [drawn[1]], WritingOptions(str(own), seed=1))
    assert drawn[0].read_bytes() == drawn[1].read_bytes()


def test_a_folder_that_cannot_be_written_is_left_alone_without_a_word(own, monkeypatch):
    def refuse(path, data):
        raise InputError(f"Cannot write {path}.")

    hand = file.load(own)
    learnt.learnt(hand, "thirds", 1, 1, lambda: [1 / 3])
    monkeypatch.setattr("handout.pipeline.hand_learning.work_out", lambda hand, strokes: learnt.known_values(hand))
    with monkeypatch.context() as patched:
        patched.setattr(atomic, "write", refuse)
        learn_beside(hand)
    assert is_kept(hand) and not own.with_suffix(".learnt").exists()


def test_what_lies_beside_counts_for_this_hand_alone(own, small_hand, monkeypatch):
    def thirds():
        return recall(file.load(own), "thirds", 1)

    hand = file.load(own)
    learnt.learnt(hand, "thirds", 1, 1, lambda: [1 / 3])
    file.keep_beside(hand, learnt.known_values(hand))
    assert thirds() == [1 / 3]
    own.with_suffix(".learnt").write_bytes(b'{"of": "\xff')
    assert thirds() is None
    file.keep_beside(hand, learnt.known_values(hand))
    assert thirds() == [1 / 3]
    fewer = small_hand.glyphs[: next(n for n, g in enumerate(small_hand.glyphs) if n > 3 and g.before < 0)]
    from dataclasses import replace

    file.save(replace(small_hand, glyphs=fewer), own)
    assert thirds() is None


def test_a_file_of_somebody_else_beside_a_hand_stays_and_is_told(own):
    beside, hand = own.with_suffix(".learnt"), file.load(own)
    beside.write_text("what I learnt this week")
    learnt.learnt(hand, "thirds", 1, 1, lambda: [1 / 3])
    with pytest.raises(InputError, match="was not made by handout and stays"):
        file.keep_beside(hand, learnt.known_values(hand))
    assert beside.read_text() == "what I learnt this week"
    (note,) = prepare(WritingOptions(str(own)), SheetOptions(), PictureOptions()).given_notes
    assert note.startswith(str(beside))


@pytest.mark.parametrize("wild", ["1e300", "-1e300", "9007199254740994"])
def test_figures_that_nobody_worked_out_are_worked_out_anew(own, wild):
    """Whole numbers are made of some, which would overflow."""
    hand = file.load(own)
    meant = ink_colours(hand)
    file.keep_beside(hand, learnt.known_values(hand))
    beside = own.with_suffix(".learnt")
    kept = re.sub(r'("inks \d+":\[\d+,)\d+', rf"\g<1>{wild}", beside.read_text())
    assert wild in kept
    beside.write_text(kept)
    again = file.load(own)
    assert ink_colours(again).colours == meant.colours and not is_kept(again)


def test_hands_of_no_file_and_those_that_ship_keep_nothing_beside(small_hand):
    assert file.beside(small_hand) is None
    assert file.beside(file.load(library.scanned_file("house-print-fountain"))) is None
