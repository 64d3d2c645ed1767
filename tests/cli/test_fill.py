"""`handout fill`, as it is called: forms with fields of every kind, filled in, plotted and refused."""

import csv
import json
import runpy
import sys
from pathlib import Path

import numpy as np
import pikepdf
import pytest
from PIL import Image

from handout.scanning.pdf_pages import drawn_page
from handout.sources import read_drawing

sys.path.insert(0, str(Path(__file__).parents[1] / "pdf_forms"))
from forms import blank, field, frame, states

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def form(tmp_path):
    """Two pages: a name on both, a box, a signature, over printing of its own."""
    pdf = blank(2)
    pdf.pages[0].contents_add(b"0 0 1 rg 100 100 200 50 re f")
    field(pdf, "name", (60, 700, 260, 722), MK=frame(0.9), Ff=2)
    pdf.Root.AcroForm.Fields[0].V = pikepdf.String("")
    field(pdf, "name2", (60, 660, 260, 682), MK=frame())
    field(pdf, "ok", (60, 600, 72, 612), "Btn", MK=frame(), AP=states(pdf, "Yes"))
    field(pdf, "sign", (60, 500, 160, 520), "Sig", page=1)
    field(pdf, "town", (60, 700, 260, 722), page=1)
    pdf.save(tmp_path / "form.pdf")
    return tmp_path / "form.pdf"


def answers(*rows, path="a.csv"):
    with Path(path).open("w", newline="") as stream:
        csv.writer(stream).writerows(rows)
    return path


def test_the_form_is_filled_in_over_its_own_page(call, form):
    before = drawn_page(form, 1, 100)
    out, err = call("fill", form, answers(["name", "ok"], ["Ada", "yes"]), "-o", "f.pdf", "--seed", 3, "--json")
    facts = json.loads(out)
    assert facts["files"] == ["f.pdf"] and facts["forms"] == 1 and facts["entries"] == 2 and "sign is left empty" in err
    with pikepdf.open("f.pdf") as pdf, pikepdf.open(form) as old:
        streams = [part.read_bytes() for part in pdf.pages[0].Contents]
        assert all(part.read_bytes() in streams for part in old.pages[0].Contents)
        assert [str(a.FT) for a in pdf.pages[1].Annots] == ["/Sig"] and not len(pdf.pages[0].Annots)
        assert [str(each.T) for each in pdf.Root.AcroForm.Fields] == ["sign"]
    after = drawn_page(Path("f.pdf"), 1, 100)
    changed = np.argwhere(np.abs(after.astype(int) - before).sum(axis=2) > 90) * 0.254
    # ink in the name and in the box, and nowhere else
    assert changed[:, 0].min() > 40 and changed[:, 0].max() < 88
    assert changed[:, 1].min() > 20 and changed[:, 1].max() < 93
    assert (after[-200:] == before[-200:]).all()


def test_the_same_seed_gives_the_same_bytes_and_rows_differ(call, form):
    table = answers(["name", "town"], ["Ada", "Ulm"], ["Ada", "Ulm"])
    for name in ("a.pdf", "b.pdf"):
        call("fill", form, table, "-o", name, "--seed", 3)
    assert Path("a-2.pdf").read_bytes() == Path("b-2.pdf").read_bytes()
    assert (drawn_page(Path("a-2.pdf"), 1, 60) != drawn_page(Path("a-3.pdf"), 1, 60)).any()


def test_the_writing_alone(call, form):
    table = answers(["field", "value"], ["name", "Ada"], ["town", "Ulm"])
    files = ["-o", "w.pdf", "-o", "w.json", "-o", "w.gcode", "-o", "w.png"]
    out, _ = call("fill", form, table, "--writing-only", *files, "--seed", 3, "--json", "--dpi", 60)
    assert json.loads(out)["files"] == ["w.pdf", *(f"w-{n}{s}" for s in (".json", ".gcode", ".png") for n in (1, 2))]
    with pikepdf.open("w.pdf") as pdf:
        assert len(pdf.pages) == 2 and [float(side) for side in pdf.pages[0].MediaBox] == pytest.approx(
            [0, 0, 595, 842]
        )
    left, top, right, bottom = read_drawing("w-2.json").bounds
    assert left / (25.4 / 72) > 60 and right / (25.4 / 72) < 260 and 38 < top < 52 and bottom < 56
    assert np.asarray(Image.open("w-1.png").convert("L"))[300:].min() == 255  # the form's blue bar is not there


def test_a_picture_shows_the_form_under_the_ink(call, form):
    call("fill", form, answers(["name"], ["Ada"]), "-o", "p.png", "--dpi", 60, "--seed", 3)
    assert not Path("p-2.png").exists()  # nothing is written on that page
    picture = np.asarray(Image.open("p-1.png").convert("RGB"))
    assert picture[int((842 - 125) / 72 * 60), int(200 / 72 * 60)].tolist() == [0, 0, 255]


def test_printed_values_stay_unless_they_are_answered(call, tmp_path):
    pdf = blank()
    look = {"BBox": [0, 0, 200, 22], "Resources": pikepdf.Dictionary()}
    for name, y in (("a", 700), ("b", 600)):
        place = field(pdf, name, (60, y, 260, y + 22), V=pikepdf.String("old"))
        place.AP = pikepdf.Dictionary(N=pdf.make_stream(b"/Tx BMC q 1 0 0 rg 20 5 40 12 re f Q EMC", **look))
    pdf.save("form.pdf")
    call("fill", "form.pdf", answers(["a"], ["new"]), "-o", "f.pdf", "--seed", 3)
    red = (drawn_page(Path("f.pdf"), 1, 72)[:, :, :3] == (255, 0, 0)).all(axis=2)
    assert not red[842 - 722 : 842 - 700].any() and red[842 - 622 : 842 - 600].any()


@pytest.mark.slow
def test_scanned_ink_lies_over_a_form_that_is_seen_through_it(call, small_hand_file):
    pdf = blank()
    for name, y in (("a", 700), ("b", 600)):
        place = field(pdf, name, (60, y, 260, y + 22))
        look = pdf.make_stream(b"0.6 1 0.6 rg 0 0 200 22 re f", BBox=pikepdf.Array([0, 0, 200, 22]))
        place.AP = pikepdf.Dictionary(N=look)
    field(pdf, "c", (60, 500, 80, 520), "Btn", AP=states(pdf, "Yes"))
    pdf.save("form.pdf")
    table = answers(["a", "c"], ["ten hens", "yes"])
    call("fill", "form.pdf", table, "-o", "f.pdf", "--seed", 3, "--hand", small_hand_file)
    seen = drawn_page(Path("f.pdf"), 1, 144)[:, :, :3].astype(int)
    for y in (700, 600):
        assert (seen[2 * (842 - y) - 6, 130:500] == (153, 255, 153)).all()  # frames of both fields
    written, crossed = (
        seen[2 * (842 - 722) : 2 * (842 - 700), 120:520],
        seen[2 * (842 - 520) : 2 * (842 - 500), 120:160],
    )
    assert (crossed[:, :, 1] < 150).sum() > 20
    assert 100 < (written[:, :, 1] < 150).sum() < 0.3 * written[:, :, 1].size
    assert (written.max(axis=(0, 1)) == (153, 255, 153)).all()  # no white around the ink


def test_a_form_is_plotted_sheet_after_sheet(call, form):
    table = answers(["name", "town"], ["Ada", ""], ["Bob", "Ulm"])
    out, err = call("fill", form, table, "--port", "sim:", "--seed", 3, "--json")
    assert json.loads(out)["pages"] == 3 and "nothing is written on page 2" in err and "Plotted 3 sheets" in err


def test_the_fields_are_listed(call, form):
    out, err = call("fill", form)
    assert out.splitlines()[0] == "name: text; page 1; 71 x 8 mm; required" and "5 fields" in err
    facts = json.loads(call("fill", form, "--json")[0])
    assert facts["fields"][2]["options"] == ["Yes"] and len(facts["pages"]) == 2


def test_all_that_is_wrong_is_listed_by_row_and_field_before_anything_is_made(call, form):
    rows = [["name", "town", "ok"], ["", "Ulm " * 90, "yes"], ["Ada", "日", "perhaps"]]
    _, err = call("fill", form, answers(*rows), "-o", "f.pdf", code=2)
    for words in (
        "row 2: name: an answer is required",
        "row 2: town: 'Ulm Ulm",
        "too long for its 71 x 8 mm",
        "row 3: ok: 'perhaps' is neither yes nor no",
        "row 3: town: The hand house-joined has no form for '日'",
    ):
        assert words in err
    rows[0][2] = "colour"
    assert "no field 'colour'" in call("fill", form, answers(*rows), "-o", "f.pdf", code=2)[1]
    assert "no row with answers" in call("fill", form, answers(["name", "ok"]), "-o", "f.pdf", code=2)[1]
    assert not list(Path().glob("f.*"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["a.csv"], "Where to?"),
        (["a.csv", "-o", "a.pdf", "--port", "sim:"], "Where to?"),
        (["-o", "a.pdf"], "With what?"),
        (["a.csv", "-o", "a.pdf", "--slips"], "without slips"),
        (["a.csv", "-o", "a.pdf", "--paper", "ruled"], "the paper is the form"),
        (["a.csv", "-o", "a.xyz"], "not known"),
        (["a.csv", "-o", "a.pdf", "--rows", "9"], "no row of the table"),
        (["none.csv", "-o", "a.pdf"], "cannot be read"),
    ],
)
def test_what_cannot_be_asked_for(call, form, arguments, words):
    answers(["name"], ["Ada"])
    assert words in call("fill", form, *arguments, code=2)[1]


def test_the_example_is_filled_in(call, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["form.py", "form.pdf"])
    runpy.run_path(str(EXAMPLES / "form.py"), run_name="__main__")
    out, _ = call("fill", "form.pdf", EXAMPLES / "form.csv", "-o", "f.pdf", "--seed", 3, "--json")
    assert json.loads(out)["forms"] == 2 and json.loads(out)["entries"] == 26
