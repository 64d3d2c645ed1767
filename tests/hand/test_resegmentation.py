"""Ink that is painted where the scan was kept: a dab changes the whole of what it means, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from handout.hand import file
from handout.hand.corrections import Confirm, Paint, apply_and_tell
from handout.hand.page_editor import own_ink
from handout.hand.scanned import KeptScan
from handout.scanning.scribbles import PageWindow, with_ink, without_ink

PAPER, INK, FAINT, BROWN = (245, 243, 238), (40, 50, 120), (190, 193, 212), (196, 170, 140)


def drawn(*strokes):
    """(h, w, 3) a sheet with strokes of a colour, from place to place, so many pixels wide, blurred."""
    import cv2

    rgb = np.full((120, 240, 3), PAPER, np.uint8)
    for colour, a, b, wide in strokes:
        cv2.line(rgb, a, b, colour, wide)
    noise = np.random.default_rng(0).normal(0, 2, rgb.shape)
    return np.clip(cv2.GaussianBlur(rgb, (0, 0), 0.8) + noise, 0, 255).astype(np.uint8)


def window(rgb, dark):
    """What is known of it where everything darker than `dark` was taken for ink."""
    ink = rgb[:, :, 0] < dark
    return PageWindow(rgb, ink, np.array(INK, float), 2.5, 30.0, np.zeros(ink.shape, bool))


def replace_at(paint, spot, places):
    """A dab on the ink that is nearest to a place."""
    nearest = places[np.linalg.norm(places - spot, axis=1).argmin()]
    return structs.replace(paint, stroke=(tuple(nearest - 1), tuple(nearest + 1)))


def dab(x, y, wide=6, high=3):
    marked = np.zeros((120, 240), bool)
    marked[y : y + high, x : x + wide] = True
    return marked


LINES = ((INK, (20, 20), (220, 24), 5), (INK, (60, 10), (56, 110), 5))


def test_a_dab_brings_back_a_faint_stroke_alone():
    sheet = drawn(*LINES, (FAINT, (80, 60), (200, 64), 5), (FAINT, (80, 100), (200, 98), 5))
    known = window(sheet, 150)
    found = with_ink(known, dab(130, 60))
    new = found.ink & ~known.ink
    y, x = np.nonzero(new)
    assert found.seen and x.min() < 84 and x.max() > 196 and y.min() > 56 and y.max() < 70
    assert 4 < new[:, 130].sum() < 8
    nothing = with_ink(known, dab(130, 80))
    assert not nothing.seen and (nothing.ink == known.ink | dab(130, 80)).all()


@pytest.mark.parametrize(
    "thing", [(BROWN, (150, 20), (150, 60), 16), ((150, 158, 170), (30, 70), (230, 72), 3)], ids=["stain", "rule"]
)
def test_a_dab_takes_a_stain_or_a_rule_and_leaves_the_strokes_in_it(thing):
    known, bare = window(drawn(thing, *LINES), 215), window(drawn(*LINES), 150).ink
    (_, a, b, _) = thing
    left = without_ink(known, dab(*(150, 46) if a[0] == b[0] else (150, 70)))
    assert (left & bare).sum() > 0.97 * (known.ink & bare).sum()
    import cv2

    away = ~cv2.dilate(bare.astype(np.uint8), np.ones((7, 7), np.uint8)).astype(bool)
    assert (known.ink & away).sum() > 300 and (left & away).sum() < 0.06 * (known.ink & away).sum()


def test_a_dab_in_the_pens_own_ink_takes_no_more_than_it_covers():
    known = window(drawn(*LINES), 150)
    left = without_ink(known, dab(130, 14, 6, 16))
    assert (known.ink & ~left & ~dab(126, 10, 14, 24)).sum() < 10
    kept = replace(known, held=known.ink)
    assert (without_ink(kept, dab(130, 14, 6, 16)) == known.ink & ~dab(130, 14, 6, 16)).all()


def test_a_letter_comes_back_from_the_scan_of_a_file(small_hand, tmp_path):
    file.save(small_hand, tmp_path / "kept.hand")
    page = file.load(tmp_path / "kept.hand").pages[0]
    assert page.scan is not None and isinstance(page.scan, KeptScan) and page.scan.shape == page.shape
    hand = replace(small_hand, pages=(page,))
    number = max(range(len(hand.glyphs)), key=lambda k: len(hand.glyphs[k].vertices))
    places = page.graph.uv[hand.glyphs[number].vertices]
    (x, y), (right, low) = places.min(axis=0) - 3, places.max(axis=0) + 3
    wiped = apply_and_tell(hand, [Paint(page=0, to="paper", polygon=((x, y), (right, y), (right, low), (x, low)))]).hand
    middle = places[len(places) // 2]
    dabbed = Paint(page=0, to="ink", stroke=(tuple(middle - 1), tuple(middle + 1)), width=4.0)
    here = slice(int(y), int(low)), slice(int(x), int(right))
    inks = [own_ink(one.pages[0], *here) for one in (hand, wiped, apply_and_tell(wiped, [dabbed]).hand)]
    assert inks[1].sum() < 0.1 * inks[0].sum()
    assert (inks[2] & inks[0]).sum() > 0.8 * (inks[2] | inks[0]).sum()
    half = Paint(page=0, to="paper", polygon=((x, y), (middle[0], y), (middle[0], low), (x, low)))
    most = apply_and_tell(hand, [half, replace_at(dabbed, places[places[:, 0] < middle[0]].mean(axis=0), places)]).hand
    halved = apply_and_tell(hand, [half]).hand
    owned = [sum(len(glyph.vertices) for glyph in one.glyphs) for one in (halved, most, hand)]
    assert owned[0] < owned[1] and abs(owned[2] - owned[1]) < 0.3 * (owned[2] - owned[0]), "it is its letters' again"
    bare = replace(wiped, pages=(replace(wiped.pages[0], scan=None),))
    painted, notes, _ = apply_and_tell(bare, [dabbed])
    assert own_ink(painted.pages[0], *here).sum() < 0.3 * inks[0].sum() and "keeps no scan" in notes[0]
    (tmp_path / "bare.hand").write_bytes(file.without_scans(tmp_path / "kept.hand"))
    assert file.check(tmp_path / "bare.hand").pages[0].scan is None
    confirmed = apply_and_tell(hand, [Confirm(page=0, at=tuple(middle))]).hand
    assert apply_and_tell(confirmed, [Paint(page=0, to="paper", stroke=dabbed.stroke, width=3.0)]).hand.glyphs
