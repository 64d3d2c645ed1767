"""Pages that lie wrongly, and texts that are not theirs; the small page has three lines of the simulated author."""

from dataclasses import replace

import numpy as np
import pytest

from handout.errors import InputError
from handout.scanning.scan import Scan
from handout.scanning.text_lines import find_text_lines
from handout.scanning.written_page import find_ink, prepare
from handout.tagging.page_sources import ORIENTATIONS, find_turn

OTHER = "Quantum flux zig-zagged\nby 27 wax boxes, Dr. K\nwhy shrug at Puck?"


@pytest.fixture(scope="module")
def inked(small_page):
    return find_ink(prepare(small_page.read.scan))


def lying(inked, how):
    """The page as if it had been scanned some other way; only what is looked at here is turned."""
    scan = inked.prepared.scan
    scan = Scan(np.ascontiguousarray(how(scan.rgb)), scan.dpi, "page.png")
    ink = np.ascontiguousarray(how(inked.mask.ink))
    prepared, mask = replace(inked.prepared, scan=scan), replace(inked.mask, ink=ink)
    return replace(inked, prepared=prepared, mask=mask, text_lines=find_text_lines(ink, scan.dpi))


def rng():
    return np.random.default_rng(0)


@pytest.mark.slow
def test_a_page_that_lies_right_is_left_alone(inked, small_page):
    assert find_turn(inked, small_page.written, rng()) == 0
    assert find_turn(inked, small_page.written.replace("\n", " "), rng()) == 0, "line breaks may be missing"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scanned", "turn", "said"),
    [(1, 3, "its top to the left"), (2, 2, "upside down")],
)
def test_a_page_that_lies_wrong_is_turned(inked, small_page, scanned, turn, said):
    wrong = lying(inked, lambda picture: np.rot90(picture, scanned))
    assert find_turn(wrong, small_page.written, rng()) == turn
    assert said in ORIENTATIONS[turn]
    upright = wrong.prepared.turn_quarters(turn)
    assert np.array_equal(upright.scan.rgb, inked.prepared.scan.rgb)


@pytest.mark.slow
def test_a_mirrored_page_is_refused(inked, small_page):
    wrong = lying(inked, lambda picture: picture[:, ::-1])
    with pytest.raises(InputError, match=r"page\.png is mirrored.*flip the picture"):
        find_turn(wrong, small_page.written, rng())


@pytest.mark.slow
def test_another_text_is_refused(inked):
    with pytest.raises(InputError, match=r"does not seem to be this page's.*3 lines of writing, the transcript 3"):
        find_turn(inked, OTHER, rng())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("\n".join(["a longer text than three lines"] * 5), r"3 lines of writing.*5 lines, 150.*alone"),
        (
            "an even",
            r"3 lines.*1 line, 7 char.*about 0\.\d times.*all that is.*cover or cut off.*times as broad",
        ),
    ],
)
def test_too_much_and_too_little_text_is_named(inked, text, says):
    with pytest.raises(InputError, match=says):
        find_turn(inked, text, rng())


@pytest.mark.slow
def test_two_pages_side_by_side_are_named(inked, small_page):
    empty = np.zeros((len(inked.mask.ink), 150), dtype=bool)
    ink = np.hstack([inked.mask.ink, empty, inked.mask.ink])
    book = replace(inked, mask=replace(inked.mask, ink=ink), text_lines=find_text_lines(ink, 300.0))
    with pytest.raises(InputError, match=r"shows two pages or columns side by side \(3 and 3 lines"):
        find_turn(book, small_page.written, rng())
