from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.profiles import Length, Margins
from handout.simulated import spectra
from handout.simulated.printer import FAULTS, PAPERS, Inkjet, find_blocked_rows, weaken_rows
from handout_lab import offset_press
from handout_lab.offset_press import Measured

CORNERS = np.array([[1, 1, 1], [0, 1, 1], [1, 0, 1], [1, 1, 0], [0, 0, 0]], dtype=float)
# made where they are asked for: the first takes .5 s of CPU, in every process of xdist
PRINTERS = [Inkjet, *(partial(Inkjet, paper) for paper in ("cream", "recycled", "photo")), Measured]
NAMES = ["white", "cream", "recycled", "photo", "measured"]
DPI = 200


def seen(sheet):
    return sheet.reflectance(spectra.observer())


def ramp_page(height=500, width=400):
    """White, with ramps of grey and of the three inks from the left to the right."""
    page = np.full((height, width, 3), 255, dtype=np.uint8)
    level = np.linspace(0, 255, width - 80).astype(np.uint8)
    for i, ink in enumerate([(0, 1, 2), (0,), (1,), (2,)]):
        for channel in ink:
            page[40 + 100 * i : 120 + 100 * i, 40:-40, channel] = level
    return page


@pytest.mark.parametrize("name", PAPERS)
def test_no_ink_is_paper(name):
    assert spectra.lab(Inkjet(name).patches([[1, 1, 1]]))[0] == pytest.approx(PAPERS[name].lab)


def test_white_paper_and_black_are_the_ones_of_the_specification():
    lab = spectra.lab(Inkjet().patches([[1, 1, 1], [0, 0, 0]]))
    assert lab[0] == pytest.approx([95, 0, -2]) and lab[1, 0] == pytest.approx(19, abs=0.5)
    assert Inkjet().gain == 0.17


@pytest.mark.parametrize("printer", PRINTERS, ids=NAMES)
def test_solid_inks_have_their_hues(printer):
    _, cyan, magenta, yellow, black = spectra.lab(printer().patches(CORNERS))
    assert cyan[1] < -20 and cyan[2] < -35
    assert magenta[1] > 50 and abs(magenta[2]) < 20
    assert yellow[2] > 60 and abs(yellow[1]) < 10 and yellow[0] > 75
    assert black[0] < 24 and np.abs(black[1:]).max() < 5


@pytest.mark.parametrize("printer", PRINTERS, ids=NAMES)
def test_more_ink_is_darker_all_along_every_ramp(printer):
    level, printer = np.linspace(0, 1, 65)[:, None], printer()
    for channels in ([0, 1, 2], [0], [1], [2], [0, 1], [1, 2], [0, 2]):
        device = np.ones((65, 3))
        device[:, channels] = level
        assert (np.diff(printer.patches(device)[:, 1]) > 0).all()


@given(st.lists(st.tuples(*[st.floats(0, 1)] * 3), min_size=1, max_size=8).map(np.array))
@settings(max_examples=30, deadline=None)
def test_patches_and_their_scans_lie_in_range(device):
    for printer in (Inkjet(), Measured()):
        assert (printer.patches(device) > 0).all() and (printer.patches(device) <= 1).all()
        scanned = printer.scan_patches(device)
        assert scanned.shape == device.shape and (scanned >= 0).all() and (scanned <= 1).all()


def test_measured_colours_are_the_measured_ones():
    levels, colours = offset_press.table()
    assert len(levels) == 9 and colours.shape == (9, 9, 9, 3)
    device = 1 - np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 3)
    assert Measured().patches(device) == pytest.approx(colours.reshape(-1, 3), abs=1e-9)
    # paper and solids of ISO 12647-2:2004, paper type 1
    lab = spectra.lab(Measured().patches(CORNERS[:4]))
    wanted = [[95, 0, -2], [55, -37, -50], [48, 74, -3], [91, -5, 93]]
    assert np.linalg.norm(lab - wanted, axis=1).max() < 9


def test_a_damaged_table_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(offset_press.shipped, "folder", lambda name: tmp_path)
    offset_press.table.cache_clear()
    try:
        with pytest.raises(InputError, match=r"fogra39-cmy\.csv cannot be read"):
            Measured()
        (tmp_path / "fogra39-cmy.csv").write_text("0,0,0,84,88,75\n0,0,50,80,84,40\n")
        with pytest.raises(InputError, match="no full cube"):
            Measured()
    finally:
        monkeypatch.undo()
        offset_press.table.cache_clear()


@pytest.mark.parametrize("printer", [Inkjet, Measured], ids=["inkjet", "measured"])
def test_a_printed_pixel_is_a_patch(printer):
    printer = printer()
    rng = np.random.default_rng(5)
    page = rng.integers(0, 256, (40, 30, 3), dtype=np.uint8)
    sheet = printer.print_page(page, DPI)
    wanted = printer.patches(page.reshape(-1, 3) / 255).reshape(40, 30, 3)
    assert seen(sheet) == pytest.approx(wanted, abs=1e-6)
    assert sheet.page.width == pytest.approx(30 * 25.4 / DPI) and sheet.page.height == pytest.approx(40 * 25.4 / DPI)


def test_printing_twice_is_the_same_and_the_page_is_left_alone():
    page = ramp_page()
    before = page.copy()
    one, two = (
        seen(Inkjet(faults=FAULTS, grain=0.1).print_page(page, DPI, rng=np.random.default_rng(3))) for _ in "12"
    )
    assert np.array_equal(one, two) and np.array_equal(page, before)


# the measured press has no black ink that could be empty
@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "fault"),
    [(kind, one) for kind in (Inkjet, Measured) for one in FAULTS if (kind, one) != (Measured, "no-black")],
)
def test_every_fault_shows(kind, fault):
    page = ramp_page()
    difference = np.abs(seen(kind(faults=[fault]).print_page(page, DPI)) - seen(kind().print_page(page, DPI)))
    assert difference.max() > 0.05 and difference[:20, :20].max() < 0.06


def test_fit_to_page_shrinks_about_the_middle():
    page = np.full((1000, 800, 3), 255, dtype=np.uint8)
    page[100:900, 80:720] = 0
    dark = seen(Inkjet(faults=["fit-to-page"]).print_page(page, DPI))[..., 1] < 0.4
    assert np.ptp(np.flatnonzero(dark.any(axis=1))) == pytest.approx(0.97 * 800, abs=2)
    assert np.ptp(np.flatnonzero(dark.any(axis=0))) == pytest.approx(0.97 * 640, abs=2)
    assert np.flatnonzero(dark.any(axis=1)).mean() == pytest.approx(499.5, abs=1)


def test_mirrored_is_mirrored():
    page = ramp_page()
    assert np.array_equal(
        seen(Inkjet(faults=["mirrored"]).print_page(page, DPI)), seen(Inkjet().print_page(page[:, ::-1], DPI))
    )


def test_a_clogged_nozzle_leaves_lines_without_cyan_only():
    page = np.zeros((400, 4, 3), dtype=np.uint8)
    page[:, :2] = (0, 255, 255)
    page[:, 2:] = (255, 0, 255)
    printed = seen(Inkjet(faults=["clogged"]).print_page(page, DPI))
    white, cyan, magenta = Inkjet().patches(CORNERS[:3])
    blocked = find_blocked_rows(400, DPI)
    assert printed[blocked, 0] == pytest.approx(np.broadcast_to(white, (blocked.sum(), 3)), abs=1e-6)
    assert printed[~blocked, 0] == pytest.approx(np.broadcast_to(cyan, ((~blocked).sum(), 3)), abs=1e-6)
    assert printed[:, 3] == pytest.approx(np.broadcast_to(magenta, (400, 3)), abs=1e-6)
    starts = np.flatnonzero(np.diff(blocked.astype(int)) == 1)
    assert np.diff(starts[::2]) * 25.4 / DPI == pytest.approx(25.4 / 3, abs=0.2)


def test_banding_repeats_with_the_head_and_never_adds_ink():
    ink = weaken_rows(1000, DPI)
    assert ink.max() <= 1 and ink.min() > 0.6
    assert ink[:66] == pytest.approx(ink[200:266], abs=0.02)


def test_a_managed_print_has_lighter_greys_and_duller_reds():
    device = np.array([[0.2, 0.2, 0.2], [0.5, 0.5, 0.5], [0.9, 0.1, 0.1]])
    plain, managed = (spectra.lab(p.patches(device)) for p in (Inkjet(), Inkjet(faults=["managed"])))
    assert (managed[:2, 0] > plain[:2, 0] + 3).all()
    assert np.hypot(*managed[2, 1:]) < np.hypot(*plain[2, 1:])


def test_wrong_media_is_darker_in_the_middle_only():
    levels = np.array([[1.0] * 3, [0.5] * 3])
    for kind in (Inkjet, Measured):
        plain, heavy = (p.patches(levels)[:, 1] for p in (kind(), kind(faults=["wrong-media"])))
        assert heavy[0] == pytest.approx(plain[0]) and heavy[1] < 0.85 * plain[1]


def test_margins_stay_white():
    page = np.zeros((200, 300, 3), dtype=np.uint8)
    margins = Margins(top=Length(3), right=Length(5), bottom=Length(10), left=Length(2))
    dark = seen(Inkjet().print_page(page, DPI, margins))[..., 1] < 0.4
    rows, columns = np.flatnonzero(dark.any(axis=1)), np.flatnonzero(dark.any(axis=0))
    mm = DPI / 25.4
    assert rows[[0, -1]] == pytest.approx([3 * mm, 199 - 10 * mm], abs=1)
    assert columns[[0, -1]] == pytest.approx([2 * mm, 299 - 5 * mm], abs=1)


def test_grain_is_in_the_ink_and_not_in_the_paper():
    page = np.full((200, 200, 3), 255, dtype=np.uint8)
    page[:, 100:] = 128
    printed = seen(Inkjet(grain=0.1).print_page(page, DPI, rng=np.random.default_rng(1)))[..., 1]
    even = Inkjet().patches([[1, 1, 1], [128 / 255] * 3])[:, 1]
    assert printed[:, :100].std() < 1e-6
    assert printed[:, 100:].mean() == pytest.approx(even[1], abs=0.005)
    assert printed[:, 100:].std() == pytest.approx(0.1 * DPI / 300 * (even[0] - even[1]), rel=0.1)


@pytest.mark.parametrize(
    ("given_", "said"),
    [
        ({"paper": "blue"}, "no paper 'blue'"),
        ({"gain": 0.4}, r"gain of 0\.4 is outside 0 to 0\.25"),
        ({"n": 0.5}, r"factor of 0\.5 is outside 1 to 10"),
        ({"grain": 0.9}, r"grain of 0\.9 is outside 0 to 0\.5"),
        ({"faults": ["cloged"]}, r"no fault 'cloged'; did you mean 'clogged'\?"),
    ],
)
def test_what_cannot_be_is_refused(given_, said):
    with pytest.raises(InputError, match=said):
        Inkjet(**given_)


@pytest.mark.parametrize("page", [np.zeros((4, 4), np.uint8), np.zeros((4, 4, 3)), np.zeros((0, 4, 3), np.uint8)])
def test_other_pictures_are_refused(page):
    with pytest.raises(InputError, match="takes"):
        Inkjet().print_page(page, DPI)
