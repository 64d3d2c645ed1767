"""Hands from scans, as a user makes, looks at, corrects and keeps them."""

import json
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from handout.hand import file
from handout.hand.learnt import known_values
from handout.pipeline import kept_hands


@pytest.fixture
def kept(small_hand_file):
    shutil.copy(small_hand_file, "small.hand")
    return "small.hand"


@pytest.mark.slow
def test_read_and_check(call, small_scan, told):
    out, err = call(
        "hand", "read", "mine", "--scan", small_scan.scan, "--text", small_scan.text, "-o", "mine.hand", "--json",
        "--title", "My hand", "--pen", "ballpoint",
    )  # fmt: skip
    facts = json.loads(out)
    assert (facts["name"], facts["title"], facts["files"]) == ("mine", "My hand", ["mine.hand"])
    assert (
        facts["glyphs"] == 44
        and facts["found"][0]["missing"] == facts["found"][0]["other_case"] == []
        and facts["pages"][0]["lines"] == 3
    )
    assert "3 lines found" in err and "Wrote mine.hand: 44 letters" in err
    shares, stages = zip(*told, strict=True)
    assert list(shares) == sorted(shares) and shares[0] == 0 and 0.9 < shares[-1] <= 1 and len(shares) > 6
    assert {"page 1: the ink", "page 1: learning from the page", "writing the hand"} <= set(stages)
    out, err = call("hand", "check", "mine.hand", "-o", "seen.png", "--for", "zeal even", "--json")
    checked = json.loads(out)
    assert {one["letter"] for one in checked["lacks"] if not one["anywhere"]} == {"z"}
    assert "Lent with --fallback, as the author never wrote it: z (" in err and checked["letters"][0]["total"] >= 4
    assert Image.open("seen.png").size == Image.open(small_scan.scan).size


def test_check_says_what_there_is_little_of(call, kept):
    out, err = call("hand", "check", kept)
    assert "* v " in out and "17 of 17 fewer than 8 times" in err
    assert call("hand", "check", kept, "--quiet") == ("", "")


def members(path):
    """What is in a hand, however hard it is packed."""
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.mark.slow
def test_edit_keeps_what_was_found(call, kept, small_hand, monkeypatch):
    number = int(small_hand.numbers_of_letter("j")[0])
    at = small_hand.pages[0].graph.uv[small_hand.glyphs[number].vertices[9]].tolist()
    Path("c.json").write_text(json.dumps({"corrections": [{"do": "confirm", "page": 0, "at": at, "text": "j"}]}))
    before = Path(kept).read_bytes()
    out, _ = call("hand", "edit", kept, "c.json", "-o", "other.hand", "--no-learning", "--json")
    assert json.loads(out)["corrections"] == 1 and Path(kept).read_bytes() == before
    assert known_values(file.load(Path("other.hand"))).keys() == known_values(file.load(Path(kept))).keys()
    monkeypatch.setattr(kept_hands, "learn", lambda path, **options: None)  # which takes long each time
    assert [g.letter for g in file.load(Path("other.hand")).glyphs if g.confirmed] == ["j"]
    Path("d.json").write_text(json.dumps([{"do": "remove", "page": 0, "at": at}]))
    _, err = call("hand", "edit", "other.hand", "d.json", "--no-learning")
    assert "1 correction made, 2 in all; no other letter changed" in err
    assert "j" not in file.load(Path("other.hand")).letters
    whole, parts = Path("other.hand").read_bytes(), members("other.hand")
    Path("d.json").write_text(json.dumps([{"do": "remove", "page": 0, "at": [1, 400]}]))
    _, err = call("hand", "edit", "other.hand", "d.json", code=2)
    assert "Correction 1 (remove, page 0)" in err and Path("other.hand").read_bytes() == whole
    _, err = call("hand", "edit", "other.hand", "--undo")
    assert "1 correction in force; 1 entry can be made again" in err and "j" in file.load(Path("other.hand")).letters
    out, err = call("hand", "edit", "other.hand", "--history", "--json")
    assert [entry["in_force"] for entry in json.loads(out)["journal"]] == [True, False]
    assert "2 (taken back): remove; no other" in err
    call("hand", "edit", "other.hand", "--redo")
    assert members("other.hand") == parts
    _, err = call("hand", "edit", "other.hand", "--redo", code=2)
    assert "nothing to be made again" in err
    call("hand", "edit", kept, "other.hand", "-o", "replayed.hand", "--no-learning")
    assert len(file.journal(Path("replayed.hand")).corrections) == 2
    call("hand", "edit", kept, "--undo", "--redo", code=2)


def test_the_letters_of_a_text_are_lent_where_they_are_shown_too(call, kept):
    _, err = call("hand", "show", kept, "--text", "zen ë", "-o", "a.png", code=2)
    assert "'z' (line 1, character 1)" in err and "can write only ,adefhijlmnopstuvë" in err and "--fallback" in err
    assert "'ë'" not in err and not Path("a.png").exists()
    out, err = call("hand", "show", kept, "--text", "zen ë", "--fallback", "--seed", 1, "-o", "a.png", "--json")
    facts = json.loads(out)
    assert {one["letter"]: one["own"] for one in facts["borrowed"]} == {"z": False, "ë": True}
    assert len(facts["why"]) == 4 and "Lent to the hand: z (" in err and Path("a.png").exists()


@pytest.mark.slow
def test_check_says_how_letters_are_had_as_write_has_them(call, kept):
    out, err = call("hand", "check", kept, "--for", "fëlt zed 漢", "--json")
    how = {one["letter"]: one["how"] for one in json.loads(out)["supply"]}
    assert how == {"ë": "composed", "z": "lent", "漢": "missing"}
    assert "Put together from what the author wrote: ë (e with " in err and "there is no 漢" in err
    assert "z" in err.split("Lent with --fallback")[1] and "ë" not in err.split("Lent with --fallback")[1]
    common = ("--hand", kept, "--page", "A6", "-o", "a.svg", "--json")
    assert json.loads(call("write", "fëlt", *common)[0])["borrowed"][0]["own"] is True
    assert "'z'" in call("write", "zed", *common, code=2)[1]
    assert json.loads(call("write", "zed", "--fallback", *common)[0])["borrowed"][0]["own"] is False
    assert "'漢'" in call("write", "漢", "--fallback", *common, code=2)[1]
    assert "Every letter of that text is there." in call("hand", "check", kept, "--for", "even")[1]


@pytest.mark.slow
def test_import_list_show_export_remove(call, kept):
    call("hand", "import", kept, "--name", "mine")
    assert "mine" in call("hand", "list")[0]
    listed = json.loads(call("hand", "list", "--json")[0])["scanned"]
    own = [(one["name"], one["title"], one["glyphs"]) for one in listed if not one["name"].startswith("house-")]
    assert own == [("mine", "A small hand", 44)]
    _, err = call("hand", "import", kept, "--name", "mine", code=2)
    assert "--replace" in err
    call("hand", "import", kept, "--name", "mine", "--replace")
    call("hand", "show", "mine", "-o", "letters.png")
    assert np.asarray(Image.open("letters.png")).min() < 120
    call("hand", "export", "mine", "-o", "again.hand")
    assert Path("again.hand").read_bytes() == Path(kept).read_bytes()
    call("hand", "check", "mine", "-q")
    call("hand", "remove", "mine")
    _, err = call("hand", "check", "mine", code=2)
    assert "No scanned hand is called 'mine'" in err


@pytest.mark.slow
def test_the_hands_that_ship(call):
    listed = {one["name"]: one for one in json.loads(call("hand", "list", "--json")[0])["scanned"]}
    assert {"house-joined-ballpoint", "house-print-fountain"} <= listed.keys()
    checked = json.loads(call("hand", "check", "house-joined-ballpoint", "--json")[0])
    assert checked["glyphs"] == listed["house-joined-ballpoint"]["glyphs"] and len(checked["pages"]) == 3
    call("hand", "export", "house-print-fountain", "-o", "print.hand")
    assert file.load(Path("print.hand")).name == "house-print-fountain"
    Path("none.json").write_text("[]")
    _, err = call("hand", "edit", "house-print-fountain", "none.json", code=2)
    assert "comes with the program" in err and "--output" in err
    call("hand", "edit", "house-print-fountain", "none.json", "-o", "mine.hand")
    _, err = call("hand", "remove", "house-print-fountain", code=2)
    assert "Among your own hands" in err


def test_a_damaged_hand_does_not_stop_the_list(call, kept):
    call("hand", "import", kept, "--name", "mine")
    path = next(Path("config").rglob("mine.hand"))
    path.write_bytes(path.read_bytes()[:500])
    assert "cannot be used" in call("hand", "list")[0]
    call("hand", "remove", "mine")


def test_a_hand_whose_ink_is_damaged_is_not_imported(call, kept):
    data = bytearray(Path(kept).read_bytes())
    at = data.index(b"pages/0/ink.png") + 500
    data[at : at + 200] = bytes(200)
    Path("bad.hand").write_bytes(data)
    for arguments in (("import", "bad.hand"), ("export", "bad.hand", "-o", "copy.hand")):
        _, err = call("hand", *arguments, code=2)
        assert "bad.hand cannot be used" in err
    assert not Path("copy.hand").exists() and not list(Path("config").rglob("bad.hand"))


def test_wrong_inputs_are_named(call, kept, small_scan, tmp_path):
    scan, text = small_scan.scan, small_scan.text
    Path("empty.txt").write_text("\n")
    Path("latin.txt").write_bytes(b"caf\x00\x01")
    Path("no.png").write_text("no picture")
    out = ("-o", "x.hand")
    for arguments, says in (
        (("read", "m", "--scan", scan, *out), "what is written on it?"),
        (("read", "m", "--scan", scan, "--text", text, "--text", text, *out), "2 texts for 1 page"),
        (("read", "m", "--scan", "no.png", "--text", text, *out), "no.png"),
        (("read", "m", "--scan", "none.png", "--text", text, *out), "none.png"),
        (("read", "m", "--scan", scan, "--text", "none.txt", *out), "none.txt"),
        (("read", "m", "--scan", scan, "--text", "empty.txt", *out), "is empty"),
        (("read", "m", "--scan", scan, "--text", "latin.txt", *out), "UTF-8"),
        (("read", "m", "--scan", scan, "--text", text, "--pen", "quill", *out), "quill"),
        (("read", "m", "--scan", scan, "--text", text, "-o", "x.zip"), "x.hand"),
        (("read", "m", "--scan", scan, "--text", text, "-o", "none/x.hand"), "none"),
        (("check", "none.hand"), "no such file"),
        (("check", "empty.txt.hand"), "no such file"),
        (("check", kept, "-o", "x.svg"), "x.png"),
        (("show", kept, "-o", "x.svg"), "x.png"),
        (("edit", kept, "none.json"), "none.json"),
        (("edit", kept, "empty.txt"), "corrections"),
        (("import", "empty.txt"), "not a .hand file"),
        (("import", kept, "--name", "../x"), "cannot be called"),
        (("import", kept, "--name", "house-joined"), "drawn hand"),
        (("export", "nobody", "-o", "x.hand"), "No scanned hand"),
        (("remove", "nobody"), "none called 'nobody'"),
    ):
        _, err = call("hand", *arguments, code=2)
        assert says in err and len(err.strip().splitlines()) <= 4, (arguments, err)
    assert not Path("x.hand").exists()


@pytest.mark.slow
def test_the_text_of_another_page_is_refused(call, small_scan):
    Path("other.txt").write_text("Quantum flux zig-zagged\nby 27 wax boxes, Dr. K\nwhy shrug at Puck?\n")
    _, err = call("hand", "read", "m", "--scan", small_scan.scan, "--text", "other.txt", "-o", "x.hand", code=2)
    assert "page.png" in err and not Path("x.hand").exists()


def test_texts_go_to_scans_that_are_no_sheets(small_scan, monkeypatch):
    from handout.errors import InputError
    from handout.scanning.written_page import prepare
    from handout.tagging import page_sources

    prepared = prepare(small_scan.scan)
    flat = page_sources.FilledSheet(prepared.scan, "printed", np.zeros((2, 2)))
    monkeypatch.setattr(page_sources, "filled_sheet", lambda picture: flat if "sheet" in picture.source else None)
    monkeypatch.setattr(page_sources, "prepare", lambda scan: prepared)
    for shade, name in enumerate(("sheet", "second-sheet", "page", "other")):
        Image.new("L", (400, 300), 200 + shade).save(f"{name}.png", dpi=(300, 300))

    def texts(*names, given):
        pages = [f"{name}.png" for name in names]
        return [one.transcript for one in page_sources.gather_sources(pages, [(f"{n}.txt", n) for n in given], None)]

    assert texts("sheet", given=()) == ["printed"]
    assert texts("page", "sheet", "other", given=("page", "other")) == ["page", "printed", "other"]
    assert texts("sheet", "page", given=("sheet", "page")) == ["sheet", "page"]
    with pytest.raises(InputError, match=r"other\.png: what is written on it"):
        texts("page", "other", given=("page",))
    with pytest.raises(InputError, match="leave it out"):
        texts("sheet", "second-sheet", given=("other",))


@pytest.mark.slow
def test_wrong_scans_are_named_in_a_sentence_and_nothing_is_written(call, small_scan):
    good = Image.open(small_scan.scan).convert("RGB")
    good.save("page.png", dpi=(300, 300))
    Image.new("1", (20_000, 20_000)).save("large.png")
    Image.new("RGB", (1200, 900), (245, 244, 240)).save("blank.png", dpi=(300, 300))
    good.resize((good.width // 3, good.height // 3)).save("coarse.png", dpi=(100, 100))
    Path("zero.png").touch()
    Path("cut.png").write_bytes(Path("page.png").read_bytes()[:5000])
    for name, options, says in (
        ("none.png", (), "No such file"),
        ("zero.png", (), "it is empty (0 bytes)"),
        ("cut.png", (), "damaged or cut off"),
        ("large.png", (), "400 megapixels; the limit is 200"),
        ("page.png", ("--dpi", "30"), "outside 100–2400"),
        ("page.png", ("--dpi", "1200"), "--dpi is wrong; give the true one"),
        ("page.png:2", (), "there is no such page; page.png holds 1 page"),
        ("blank.png", (), "nothing but paper"),
        ("coarse.png", (), "pixels wide, and need 2: scan at a higher resolution"),
    ):
        out, err = call(
            "hand", "read", "m", "--scan", name, "--text", small_scan.text, *options, "-o", "x.hand", "-q", code=2
        )
        assert out == "" and says in err and name.split(":")[0] in err.replace("--dpi 30", "page.png"), (name, err)
        assert len(err.strip().splitlines()) == 1 and not Path("x.hand").exists()


def test_a_text_in_utf_16_is_read(small_scan):
    from handout.pipeline.hands import _transcript
    from handout.pipeline.results import SILENT

    Path("wide.txt").write_bytes(small_scan.written.encode("utf-16"))
    assert _transcript("wide.txt", Path("wide.txt").read_bytes(), SILENT) == ("wide.txt", small_scan.written)


@pytest.mark.slow
def test_a_pen_needs_no_text(call, small_scan):
    out, err = call("hand", "pen", small_scan.scan, "-o", "pen.hand", "--json")
    facts = json.loads(out)
    assert facts["files"] == ["pen.hand"] and facts["pieces"] > 100 and 0.2 < facts["width"] < 0.6
    pen = file.load(Path("pen.hand"))
    assert pen.glyphs == () and len(pen.pages[0].graph) > 1000 and "mm wide" in err
    _, err = call("hand", "pen", small_scan.scan, "-o", "pen.png", code=2)
    assert "pen.hand" in err


@pytest.mark.slow
def test_letters_that_the_hand_lacks(call, kept):
    _, err = call("write", "eZ", "--hand", kept, "-o", "a.png", code=2)
    assert "'Z' (line 1, character 2)" in err and "--fallback" in err and not Path("a.png").exists()
    out, err = call("write", "eZë", "--hand", kept, "--fallback", "--seed", "1", "-o", "a.png", "--json")
    told = {one["letter"]: one for one in json.loads(out)["borrowed"]}
    assert told["Z"]["at"] == [1] and not told["Z"]["own"] and told["ë"]["own"]
    assert "Lent to the hand: Z (made after the author's other letters)" in err and "ë" not in err
    assert np.asarray(Image.open("a.png")).min() < 150
    out, err = call("write", "ee", "--hand", kept, "--seed", "1", "-o", "b.png", "--json")
    assert "borrowed" not in json.loads(out) and "Lent" not in err


def test_a_pen_is_no_hand_to_write_with(call, small_hand):
    file.save(replace(small_hand, glyphs=()), Path("pen.hand"))
    _, err = call("write", "ee", "--hand", "pen.hand", "-o", "a.png", code=2)
    assert "--pen" in err and not Path("a.png").exists()


def test_a_scanned_hand_is_plotted_and_written_as_strokes(call, kept):
    out, _ = call(
        "write", "even hens", "--hand", kept, "--seed", "1", "--page", "A6", "-o", "s.svg", "-o", "s.png", "--json"
    )
    told = json.loads(out)
    assert told["strokes"] >= 2 and told["duration_s"] > 2
    assert Path("s.svg").read_text(encoding="utf-8").count('class="stroke"') == told["strokes"]
    out, _ = call("plot", "even hens", "--hand", kept, "--seed", "1", "--page", "A6", "--dry-run", "p.svg", "--json")
    assert json.loads(out)["strokes"] == told["strokes"]
