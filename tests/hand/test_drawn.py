"""Drawn hands: reading, deriving forms, errors."""

import numpy as np
import pytest

from handout.errors import InputError
from handout.hand import drawn
from handout.hand.library import load, names

HEAD = """
name = "test"
title = "Test"
slant = 0.1
smooth = 0.3
interval = 0.08
word_space = 0.8
pitch = 3.7
endings = [[0.1, 0.2]]
[entries.stem]
lift = 0.2
low = [""]
lifted = ["-.1,.8"]
[marks]
acute = [{ width = 0, pen = "0,1.3 .1,1.5" }]
[letters]
"""
ASCII = [chr(code) for code in range(33, 127)]
TYPOGRAPHIC = list("‘’“”‚„–—…€£§°«»¡¿·æøœßÆØŒ")
ACCENTED = list("éèêëàâäöüñçåïîôûáíóúìòùýÿãõÉÈÊËÀÂÄÖÜÑÇÅÏÎÔÛÁÍÓÚ")


def hand(tmp_path, letters, head=HEAD):
    path = tmp_path / "test.toml"
    path.write_text(head + letters, encoding="utf-8")
    return drawn.read_drawn_hand(path)


def test_derives_ways_in_and_endings(tmp_path):
    made = hand(
        tmp_path, 'i = [{ in = "stem", out = "low", width = 0.5, pen = "0,1 0,.4 .1,0 .3,.4", late = "0,1.5 0,1.4" }]'
    )
    forms = made.glyphs["i"]
    assert {(g.entry, g.exit) for g in forms} == {
        ("low", "low"), ("low", "lifted"), ("lifted", "low"), ("lifted", "lifted"),
    }  # fmt: skip
    lifted = next(g for g in forms if g.entry == "lifted" and g.exit == "low")
    assert lifted.strokes[0][0] == pytest.approx([-0.1, 0.8])
    assert lifted.delayed == (False, True)
    ended = next(g for g in forms if g.entry == "low" and g.exit == "lifted")
    assert ended.strokes[0][-1] == pytest.approx([0.4, 0.2])
    assert ended.places <= {"end", "alone"}
    assert {g.form for g in forms} == {0}


def test_letters_of_other_files_and_of_other_letters(tmp_path):
    head = HEAD.replace("[entries.stem]", 'also = ["greek"]\n[entries.plain]\nlifted = [""]\n[entries.stem]')
    made = hand(tmp_path, '"α" = [{ width = 1, pen = "0,1 0,0" }]\n"ι" = "β"', head)
    assert len(made.glyphs["α"]) == 1 and len(made.glyphs["ω"]) > 1  # its own wins
    assert [g.letter for g in made.glyphs["ι"]] == ["ι"] * len(made.glyphs["β"])
    with pytest.raises(InputError, match=r"also = 'runes' is none of .*greek"):
        hand(tmp_path, "", HEAD.replace("[entries.stem]", 'also = ["runes"]\n[entries.stem]'))
    with pytest.raises(InputError, match="letter 'a': no forms are drawn of 'b'"):
        hand(tmp_path, 'a = "b"')


def test_cut_and_high_exit_endings(tmp_path):
    made = hand(
        tmp_path,
        's = [{ in = "low", out = "low", width = 0.5, pen = "0,1 0,.4 .1,0 .3,.4", cut = 2 }]\n'
        'o = [{ out = "high", width = 0.5, pen = "0,1 0,0 .4,1 .8,.8" }]',
    )
    assert any(len(g.strokes[0]) == 2 for g in made.glyphs["s"] if g.exit == "lifted")
    tip = next(g for g in made.glyphs["o"] if g.exit == "lifted").strokes[0][-1]
    assert 0.4 < tip[0] < 0.8


@pytest.mark.parametrize(
    ("letters", "says"),
    [
        ('a = [{ width = 1, pen = "0,1 x,2" }]', "points"),
        ('a = [{ width = 1, pen = "0,0 1,1", weight = 0 }]', "weight = 0"),
        ('a = [{ width = 1, pen = "" }]', "no points"),
        ('a = [{ width = 1, pen = "0,1", in = "loop" }]', "loop"),
        ('a = [{ width = 1, pn = "0,1" }]', "pn"),
        ('a = [{ width = 1, pen = "0,1 4e9,0" }]', "4e\\+09 is beyond 100 x-heights"),
        ('a = [{ width = 1, pen = "0,1 1e308,0" }]', "beyond 100 x-heights"),
        ('a = [{ width = 1000, pen = "0,1 1,0" }]', "width = 1000 is beyond 100 x-heights"),
        ('a = [{ width = inf, pen = "0,1 1,0" }]', "width = inf is no number that can be used"),
        ('a = [{ width = 1, pen = "0,1 1,0", out = "low", cut = 7 }]', "cut = 7 is outside 1 to 1"),
        ("a = " + "[" * 5000, "nested too deep"),
        ("a = [", "Unclosed|nvalid|Expected"),
    ],
)
def test_errors_name_the_file_and_the_fault(tmp_path, letters, says):
    with pytest.raises(InputError, match=says) as caught:
        hand(tmp_path, letters)
    assert "test.toml" in str(caught.value)


def test_numbers_have_bounds(tmp_path):
    with pytest.raises(InputError, match=r"smooth = 3 is outside 0\.05 to 1"):
        hand(tmp_path, 'a = [{ width = 1, pen = "0,1 0,0" }]', HEAD.replace("smooth = 0.3", "smooth = 3"))


@pytest.mark.parametrize("name", ["house-joined", "house-quick", "house-print"])
def test_built_in_hands_are_complete(name):
    made = load(name)
    assert [c for c in ASCII + TYPOGRAPHIC if c not in made.glyphs] == []
    from handout.writing.text import normalise, spell

    assert len(list(spell(normalise("".join(ACCENTED)), made.repertoire))) == len(ACCENTED)
    for letter, forms in made.glyphs.items():
        for place in ("start", "middle", "end", "alone"):
            assert any(place in g.places for g in forms) or letter in "I", (letter, place)
        for glyph in forms:
            assert all(np.isfinite(s).all() and np.abs(s).max() < 4 for s in glyph.strokes), letter


def test_frequent_letters_have_several_forms():
    for name in names():
        made = load(name)
        for letter in "etaoinshrdlu":
            assert len({g.form for g in made.glyphs[letter]}) >= 3, (name, letter)


@pytest.mark.slow
def test_weight_says_how_often_a_form_is_written(tmp_path):
    from handout.writing.text import Letter
    from tests.writing.lines_of_glyphs import Forms

    line = '{{ width = 1, pen = "0,0 1,{}", weight = {} }}'
    made = hand(tmp_path, f"a = [{line.format(0, 1)}, {line.format(1, 9)}]\nb = [{line.format(0, 1)}]")
    chooser = Forms(made, np.random.default_rng(1))
    forms = []
    for _ in range(300):
        forms += [chooser.word([Letter("a", (), 0)])[0].form]
        chooser.word([Letter("b", (), 0)] * 60)  # long enough to forget which form was just used
    assert 0.82 < np.mean(forms) < 0.96


def test_unknown_hand_lists_the_nearest():
    with pytest.raises(InputError, match="house-joined"):
        load("house-joind")


def test_a_scanned_hand_is_not_taken_for_an_unknown_one():
    with pytest.raises(InputError, match="scanned hand, where a drawn one is wanted: use house-joined"):
        load("somebody.hand")
