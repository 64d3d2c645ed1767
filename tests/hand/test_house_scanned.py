"""The scanned hands that ship: whole, quick to load, and out of reach of what changes hands."""

import json
import string
import time
import timeit
from dataclasses import replace

import numpy as np
import pytest

from handout.hand import file, library
from handout.hand.learnt import known_values
from handout.hand.report import facts
from handout.pipeline.hand_learning import work_out

NAMES = ("house-joined-ballpoint", "house-print-fountain")


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_hand_is_whole(name):
    path = library.scanned_file(name)
    assert library.comes_with_program(path)
    hand = file.load(path)
    assert hand.name == name and len(hand.pages) == 3
    assert set(string.ascii_letters + string.digits) <= set(hand.letters)
    checked = facts(hand)
    assert checked["glyphs"] > 3000 and not checked["unnamed"]
    assert len(checked["doubtful"]) < 0.1 * checked["glyphs"]
    assert min(hand.letters[letter] for letter in "etaoinshrdlu") >= 40
    for page in hand.pages:
        ink = page.texture.rgba[:, :, 3] > 0
        assert 0.01 < ink.mean() < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_what_is_kept_of_a_shipped_hand_is_what_this_version_works_out(name):
    path = library.scanned_file(name)
    hand = file.load(path)
    work_out(hand, strokes=True)
    kept = json.loads(path.with_suffix(".learnt").read_text())["values"]
    assert kept.keys() == known_values(hand).keys(), "work it out anew: docs/contributing.md says how"


# of the first lines of a hand that ships: name and version of what is kept → its length, norm, and scalar product with
# cos 0, cos 1, cos 2 …
WORKED_OUT = {
    "misread 2": (291, 0.0000000, 0.0000000),
    "author's reader 2": (16744, 26.6928375, 19.3598233),
    "vetting 7": (291, 16.5897336, -1.6373832),
    "blots 1": (291, 0.1460822, -0.1130818),
    "lost dots 1": (0, 0.0000000, 0.0000000),
    "tails 1": (2, 0.0869098, 0.0469576),
    "least distances 3": (2, 0.0293546, 0.0268592),
    "heights 3": (291, 2.8655073, 1.2851559),
    "shape difference 2": (1, 0.0130680, 0.0130680),
    "misreadings 6": (291, 1.7618099, 1.1555712),
    "even prices 1": (291, 8.5655141, -7.4041151),
    "manner 8": (3122, 1080.0557964, -1178.0650413),
    "inks 1": (293, 3560338.0000001, 1923659.8310700),
    "strokes by house-joined, house-quick, house-print 11": (2793, 2359.2098253, 2331.9291871),
}


@pytest.mark.slow
def test_what_is_worked_out_anew_has_another_version():
    """Else a hand would be written by what an earlier program had worked out of it."""
    hand = file.load(library.scanned_file("house-print-fountain"))
    lines = replace(hand, pages=hand.pages[:1], glyphs=hand.glyphs[:291])  # up to the end of a word
    found = {}
    for key, values in work_out(lines, strokes=True).items():
        found[key] = (len(values), float(np.linalg.norm(values)), float(values @ np.cos(np.arange(len(values)))))
    assert found.keys() == WORKED_OUT.keys(), f"put the figures of these versions into WORKED_OUT: {found}"
    for key, (count, norm, product) in WORKED_OUT.items():
        assert found[key] == (count, pytest.approx(norm, rel=1e-5), pytest.approx(product, abs=1e-5 * norm)), (
            f"{key!r} is worked out otherwise than it was: raise its VERSION, put the new figures into WORKED_OUT "
            "(here), and make the .learnt files anew, as docs/contributing.md says"
        )


def test_together_they_are_small():
    assert sum(library.scanned_file(name).stat().st_size for name in NAMES) < 12e6


@pytest.mark.slow
def test_they_load_quickly():
    path = library.scanned_file(NAMES[0])
    assert min(timeit.repeat(lambda: file.load(path), timer=time.process_time, number=1, repeat=3)) < 1.0


def test_ones_own_hand_of_that_name_wins(monkeypatch, tmp_path, small_hand):
    monkeypatch.setattr("handout.shipped.user_folder", lambda name: tmp_path)
    assert library.own_scanned() == {} and set(NAMES) <= set(library.scanned_files())
    file.save(small_hand, tmp_path / f"{NAMES[0]}.hand")
    assert library.scanned_file(NAMES[0]).parent == tmp_path
    assert not library.comes_with_program(library.scanned_file(NAMES[0]))
    assert json.dumps(facts(file.load(library.scanned_file(NAMES[0]))))
