"""Every shipped machine is valid and works; every slip in a file is refused with the name of file and key."""

import re
import sys
from pathlib import Path
from typing import get_args

import msgspec
import numpy as np
import pytest

from handout import page_sizes, profiles, shipped
from handout.errors import ProfileError
from handout.inking.device_pixels import DevicePixels
from handout.plotting import fit_to_bed, observation, open_port, plan, run
from handout.plotting.dialects import dialect
from handout.printing import media, printers
from handout.simulated import print_and_scan
from handout.simulated.flatbed import Flatbed
from handout.simulated.printer import Inkjet
from handout.sinks import picture_pdf
from handout.values import Page

sys.path.insert(0, str(Path(__file__).parent / "plotting"))
from cursive import page

PLOTTERS = sorted(shipped.folder("devices").glob("plotter-*.toml"))
PRINTERS = sorted(shipped.folder("devices").glob("printer-*.toml"))


def test_machines_ship():
    assert {path.stem for path in PLOTTERS} >= {"plotter-simulated", "plotter-grbl-servo", "plotter-grbl-z"}
    assert PRINTERS


@pytest.mark.slow
@pytest.mark.parametrize("path", PLOTTERS, ids=lambda path: path.stem)
def test_plotter_runs_through_the_simulated_device(path):
    profile = profiles.read_profile(path)
    assert isinstance(profile, profiles.Plotter)
    assert profile.name == path.stem and profile.notes
    drawing = fit_to_bed(page(words=5), profile)
    made = plan(drawing, profile)
    port = open_port("sim:", profile)
    said = []
    report = run(made, port, profile, log=said.append)
    found = observation.compare_strokes(drawing, port.executed_drawing())
    assert report.executed_s == pytest.approx(made.duration, rel=0.05)
    assert found.deviation < 0.1
    # HP-GL has no times within a stroke, which its plan admits; of a slow machine it is told what it will do
    timeless = profile.dialect == "hpgl"
    assert found.correlation > 0.98 or timeless or profile.limits.acceleration <= 1000
    assert timeless or observation.compare_strokes(made.predicted_drawing(), port.executed_drawing()).correlation > 0.98
    assert port.lost_bytes == 0 and not port.pen_is_down and port.at_rest
    turned = ["The page is turned to fit the bed: its top edge lies to the left."] if made.placement.turned else []
    homed = ["Homing: the plotter looks for its zero."] if profile.homing and not timeless else []
    assert sorted(said) == sorted(homed + turned)
    assert len(dialect(profile.dialect).file(made, profile)) > 1000


@pytest.mark.slow
@pytest.mark.parametrize("path", PRINTERS, ids=lambda path: path.stem)
def test_printer_runs_through_the_simulated_device(path, tmp_path):
    """A small card, inked all over, is fed, sent, printed within the margins and scanned."""
    profile = profiles.read_profile(path)
    assert isinstance(profile, profiles.Printer)
    assert profile.title and 72 <= profile.dpi <= 2400
    page = Page(60, 45, "card")
    turn = media.turn_for(page, profile)
    sheet = media.turned_page(page, turn)
    shape = [round(side * profile.dpi / 25.4) for side in (page.height, page.width)]
    inked = media.turned_pixels(DevicePixels(np.zeros((*shape, 3), np.uint8), profile.dpi), page, turn)
    job = tmp_path / "job.pdf"
    with picture_pdf.document(job) as document:
        document.add(sheet, inked)
    assert printers.ticket(profile, page, "t").media == f"Custom.{sheet.width:g}x{sheet.height:g}mm"
    ((size, pixels),) = print_and_scan.pages(job, profile.dpi)
    assert (size.width, size.height) == pytest.approx((45, 60) if profile.feed == "short" else (60, 45))
    scan = Flatbed.ideal().scan(
        Inkjet().print_page(pixels, profile.dpi, profile.margins), 150, np.random.default_rng(0)
    )
    dark = scan[..., 1] < 140
    pixel = 25.4 / 150
    rows, columns = (np.flatnonzero(dark.any(axis=axis))[[0, -1]] * pixel + [0, pixel] for axis in (1, 0))
    edges = profile.margins
    assert rows == pytest.approx([edges.top, size.height - edges.bottom], abs=0.2)
    assert columns == pytest.approx([edges.left, size.width - edges.right], abs=0.2)


@pytest.mark.parametrize("path", PRINTERS, ids=lambda path: path.stem)
def test_envelopes_are_fed_by_their_names_and_warned_of_at_their_margins(path):
    profile = profiles.read_profile(path)
    assert isinstance(profile, profiles.Printer)
    for name, standard in (("dl", "iso_dl_110x220mm"), ("c6", "iso_c6_114x162mm"), ("c5", "iso_c5_162x229mm")):
        fed = media.printer_for(page_sizes.page(name), profile)
        edges = fed.margins
        assert edges == (profile.envelope.margins or profile.margins)
        assert printers.ticket(fed, page_sizes.page(name), "t").media == standard
        sheet = media.turned_page(page_sizes.page(name), media.turn_for(page_sizes.page(name), fed))
        inside = np.array([edges.left, edges.top, sheet.width - edges.right, sheet.height - edges.bottom])
        assert media.margin_warning(tuple(inside), sheet, edges, fed.title) is None
        for edge, out in zip(("left", "leading", "right", "trailing"), np.diag([-1, -1, 1, 1]), strict=True):
            told = media.margin_warning(tuple(inside + out), sheet, edges, fed.title)
            assert told is not None and f"the {edge} edge" in told


def test_many_printers_are_described_with_their_sources():
    families = ("ecotank", "workforce", "surecolor", "stylus-photo", "pixma", "envy", "officejet", "deskjet", "brother")
    names = " ".join(path.stem for path in PRINTERS)
    assert len(PRINTERS) >= 13 and [family for family in families if family not in names] == []
    text = (shipped.folder("devices") / "README.md").read_text(encoding="utf-8")
    assert [path.stem for path in PRINTERS if f"`{path.stem}`" not in text and path.stem != "printer-pdf"] == []
    for path in PRINTERS:
        lines = path.read_text(encoding="utf-8").splitlines()
        heads = [i for i, line in enumerate(lines) if line in ("[margins]", "[envelope.margins]")]
        if path.stem != "printer-simulated":
            assert all(lines[i - 1].startswith("# ") for i in heads), f"{path.stem}: a margin without its source"


def edited(tmp_path, stem, old, new):
    text = (shipped.folder("devices") / f"{stem}.toml").read_text(encoding="utf-8")
    assert len(re.findall(old, text, re.MULTILINE)) == 1, f"{old} is not in {stem} exactly once"
    path = tmp_path / f"{stem}.toml"
    path.write_text(re.sub(old, new, text, flags=re.MULTILINE), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (r'^draw_speed = "', 'drawspeed = "', r"limits\.drawspeed is not a known key; did you mean 'draw_speed'\?"),
        (r"^homing = false", "homming = false", r"homming is not a known key; did you mean 'homing'\?"),
        (r'^width = "300mm"', "width = 300", r"bed\.width: needs a length with its unit"),
        (r'^width = "300mm"', 'width = "300"', r"bed\.width: '300s?' is not a length"),
        (r'^width = "300mm"', 'width = "300s"', r"bed\.width: '300s?' is not a length"),
        (r'^width = "300mm"', 'width = "9999mm"', r"bed\.width = 9999 is outside 10 to 5000"),
        (r'^acceleration = "2000mm/s2"', 'acceleration = "0mm/s2"', r"limits\.acceleration = 0 is outside 1 to 100000"),
        (r'^down_time = "200ms"', 'down_time = "9s"', r"pen\.down_time = 9 is outside 0 to 5"),
        (r"^segment_rate = 100", "segment_rate = 4000", r"segment_rate = 4000 is outside 5 to 1000"),
        (r"^buffer = 128", "buffer = 8", r"port\.buffer = 8 is outside 32 to 65536"),
        (r'^width = "300mm"', 'width = "1e12mm"', r"bed\.width: '1e12mm' is too large"),
        (r"^segment_rate = 100", "segment_rate = inf", r"segment_rate = inf is no number that can be used"),
        (r'^dialect = "grbl"', 'dialect = "latin"', r"dialect: .*latin"),
        (r'^lift = "servo"', 'lift = "rope"', r"pen\.lift: .*rope"),
        (r"^down = 90", "down = 40", r"pen\.up and pen\.down are both 40"),
        (r'^lift = "servo"', 'lift = "z"', r"pen\.up = 40 must be higher than pen\.down = 90"),
        (r"^kind = .*$", 'kind = "teapot"', r"teapot.*plotter.*printer"),
        (r"^kind = .*$", "kind = []", r"kind = \[\].*plotter.*printer"),
        (r"^kind = .*$", 'kind = "plotter"\nname = "x"', r"name cannot be set"),
        (r"^title = .*$", "", r"title is missing"),
        (r'^up_time = "150ms"$', "", r"pen\.up_time is missing"),
        (r"^title = .*$", "title = ", r"cannot be read as a device file"),
    ],
)
def test_a_slip_in_a_plotter_is_refused(tmp_path, old, new, said):
    path = edited(tmp_path, "plotter-grbl-servo", old, new)
    with pytest.raises(ProfileError, match=said) as caught:
        profiles.read_profile(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (r"^dpi = 720", "dpi = 7", r"dpi = 7 is outside 72 to 2400"),
        (r"^dpi = 720", "dpy = 720", r"dpy is not a known key; did you mean 'dpi'\?"),
        (r'^right = "3mm"', "right = 5", r"margins\.right: needs a length with its unit"),
        (r'^right = "3mm"', 'right = "-5mm"', r"margins\.right = -5 is outside 0 to 100"),
        (r"^\[envelope\.margins\]", "[envelope.margin]", r"envelope\.margin is not a known key; did you mean"),
        (r'^bottom = "20mm"', 'bottom = "900mm"', r"envelope\.margins\.bottom = 900 is outside 0 to"),
        (
            r"^dpi = 720",
            'dpi = 720\nsources = ["rear"]\nsource = "front"',
            r"source = 'front' is none of its sources: rear",
        ),
        (r"^dpi = 720", 'dpi = 720\nsources = ["rear"]\nenvelope.source = "x"', r"envelope\.source = 'x' is none of"),
    ],
)
def test_a_slip_in_a_printer_is_refused(tmp_path, old, new, said):
    path = edited(tmp_path, "printer-epson", old, new)
    with pytest.raises(ProfileError, match=said) as caught:
        profiles.read_profile(path)
    assert str(path) in str(caught.value)


def test_a_missing_file_is_one_sentence(tmp_path):
    with pytest.raises(ProfileError, match="cannot be read as a device file: No such file"):
        profiles.read_profile(tmp_path / "plotter-none.toml")


def test_machines_are_found_by_name_and_by_path(tmp_path):
    path = shipped.folder("devices") / "plotter-simulated.toml"
    for name in ("simulated", "plotter-simulated", str(path)):
        assert profiles.find(name, "plotter").title == profiles.read_profile(path).title
    assert profiles.locate("plotter-grbl-z").stem == "plotter-grbl-z"
    with pytest.raises(ProfileError, match=r"^hp-envy is a printer, not a plotter"):
        profiles.find("hp-envy", "plotter")
    with pytest.raises(ProfileError, match=r"No plotter is called 'grbl-serwo'; the nearest: plotter-grbl-servo"):
        profiles.find("grbl-serwo", "plotter")
    with pytest.raises(ProfileError, match="is a plotter, not a printer"):
        profiles.find(str(path), "printer")


def test_your_own_file_wins(tmp_path, monkeypatch):
    monkeypatch.setattr(shipped, "user_folder", lambda name: tmp_path)
    edited(tmp_path, "plotter-simulated", r"^title = .*$", 'title = "Mine"')
    assert profiles.find("simulated", "plotter").title == "Mine"


def keys(kind, inside=""):
    for field in msgspec.structs.fields(kind):
        tables = [
            t for t in (field.type, *get_args(field.type)) if isinstance(t, type) and issubclass(t, msgspec.Struct)
        ]
        if field.name in ("name", "laid"):  # they are not set in a file
            continue
        if tables:
            yield from keys(tables[0], f"{inside}{field.name}.")
        else:
            yield inside + field.name


@pytest.mark.parametrize("kind", [profiles.Plotter, profiles.Printer])
def test_every_key_is_explained(kind):
    text = (shipped.folder("devices") / "README.md").read_text(encoding="utf-8")
    assert [key for key in keys(kind) if f"`{key}`" not in text] == []


def test_every_bound_belongs_to_a_key():
    known = set(keys(profiles.Plotter)) | set(keys(profiles.Printer))
    assert set(profiles._BOUNDS) <= known
