"""The verbs as a user calls them: what they do, what they say, and how they refuse."""

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
KEYS = {"pages", "lines", "characters", "strokes", "pen_down_mm", "pen_up_mm", "duration_s", "seed", "hand", "files"}


@pytest.mark.slow
@pytest.mark.parametrize(("hand", "share"), [("house-joined", 0.2), ("house-quick", 0.15), ("house-print", 0.15)])
def test_write_is_reproducible(call, hand, share):
    letter = (ROOT / "examples/letter.txt").read_text(encoding="utf-8")
    Path("letter.txt").write_text(letter[: round(share * len(letter))], encoding="utf-8")
    command = ["write", "--file", "letter.txt", "--hand", hand, "--json", "--dpi", 100]
    facts = json.loads(call(*command, "--seed", 1, "-o", "a.svg", "-o", "a.png", "-o", "a.inkml")[0])
    assert facts.keys() >= KEYS
    assert facts["files"] == ["a.svg", "a.png", "a.inkml"]
    assert facts["characters"] > 600 * share and facts["hand"] == hand and facts["seed"] == 1
    call(*command, "--seed", 1, "-o", "b.svg", "-o", "b.png", "-o", "b.inkml")
    call(*command, "--seed", 2, "-o", "c.svg")
    for suffix in (".svg", ".png", ".inkml"):
        assert Path("a" + suffix).read_bytes() == Path("b" + suffix).read_bytes()
    assert Path("a.svg").read_bytes() != Path("c.svg").read_bytes()


def test_write_every_format(call):
    names = ["l.svg", "l.png", "l.pdf", "l.inkml", "l.json", "l.gcode"]
    call("write", "Zoë wrote this.", "-q", *[part for name in names for part in ("-o", name)])
    assert all(Path(name).stat().st_size > 300 for name in names)
    svg = ET.parse("l.svg").getroot()
    assert svg.get("width") == "210mm"
    assert b"\nG1" in Path("l.gcode").read_bytes()


def test_inkml_holds_the_same_drawing_as_json(call):
    from handout.sources.drawing_json import from_json
    from handout.sources.inkml import from_inkml

    call("write", "abc", "-o", "l.inkml", "-o", "l.json", "-q")
    a, b = from_inkml(Path("l.inkml").read_bytes()), from_json(Path("l.json").read_bytes())
    assert len(a.strokes) == len(b.strokes)
    assert all(
        abs(s.xy - t.xy).max() < 1e-5 and abs(s.t - t.t).max() < 1e-5 for s, t in zip(a.strokes, b.strokes, strict=True)
    )


def test_write_from_standard_input(call, monkeypatch):
    import io
    import sys

    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO("from a pipe ä".encode())))
    facts = json.loads(call("write", "-", "-o", "a.svg", "--json")[0])
    assert facts["characters"] == len("fromapipeä")


@pytest.mark.slow
def test_slips_are_struck_out_and_told(call):
    text = "people remember their mornings and write them down with care " * 2
    plain = json.loads(call("write", text, "-o", "a.svg", "--json", "--seed", 2)[0])
    assert "slips" not in plain
    out, err = call("write", text, "-o", "b.svg", "--json", "--seed", 2, "--slips", 30)
    facts = json.loads(out)
    assert len(facts["slips"]) > 3 and facts["slips"][0].keys() == {"page", "line", "written", "meant"}
    assert f"{len(facts['slips'])} slips of the pen struck out" in err
    assert facts["characters"] > plain["characters"]
    assert '"written"' in Path("b.svg").read_text(encoding="utf-8") or "written" in Path("b.svg").read_text("utf-8")
    call("write", text, "--slips", "-o", "c.svg", "--seed", 2, "-q")
    call("write", text, "-o", "d.svg", "--slips", "0", "--seed", 2, "-q")
    assert Path("d.svg").read_bytes() == Path("a.svg").read_bytes()
    some = text[: len(text) // 4]
    told = json.loads(call("plot", "--port", "sim:", some, "--slips", 25, "--seed", 2, "--json", "-q")[0])
    assert told["slips"] and told["executed_s"] > 0


@pytest.mark.slow
def test_several_pages_are_numbered(call):
    facts = json.loads(
        call("write", "word " * 60, "--page", "74x52mm", "-o", "l.svg", "-o", "l.pdf", "--json", "-q")[0]
    )
    assert facts["pages"] > 1
    assert facts["files"][: facts["pages"]] == [f"l-{n}.svg" for n in range(1, facts["pages"] + 1)]
    assert "l.pdf" in facts["files"]


def test_plot_on_the_simulated_plotter(call):
    out, err = call("plot", "--port", "sim:", "Dear Ada", "--json", "--seed", 1)
    facts = json.loads(out)
    assert facts.keys() >= KEYS | {"executed_s", "stretched"}
    assert facts["executed_s"] == pytest.approx(facts["planned_s"], rel=0.05)
    assert "Plotted 1 sheet" in err
    assert (facts["measured"], facts["rests"], facts["rested_s"]) == (True, 0, 0) and facts["unsecured_mm"] <= 20
    assert "Measured: speeds as meant (r 0.99" in err and "the pen never rested on the paper" in err
    facts = json.loads(call("plot", "--port", "sim:", "--device", "hp-7475a", "hi", "--json", "-q", "--seed", 1)[0])
    assert not facts["measured"] and facts["rests"] is None and "HP-GL" in facts["unknown"]


def test_a_disk_that_is_too_slow_is_said_once(call, monkeypatch):
    """On a clock of its own, by which the disk takes a second."""
    from handout.plotting.jobs import journal
    from handout.simulated.plotter import port
    from tests.plotting.clocks import Clock, LateDisk

    clock = Clock()
    late = LateDisk(clock, 1.0)
    monkeypatch.setattr(journal, "disk", lambda: late)
    monkeypatch.setattr(port, "time", clock)
    out, err = call("plot", "--port", "sim:?realtime=1", "handwriting", "--json", "--seed", 1)
    facts = json.loads(out)
    assert facts["unsecured_mm"] > 20 and facts["rests"] == 0 and facts["measured"]
    assert err.count("mm may be drawn twice") == 1 and "The disk is too slow for an overlap of 20 mm" in err


def test_plot_copies_and_dry_run(call):
    twice = json.loads(call("plot", "--port", "sim:", "hi", "--copies", 2, "--json", "-q", "--seed", 1)[0])
    once = json.loads(call("plot", "--port", "sim:", "hi", "--json", "-q", "--seed", 1)[0])
    assert twice["executed_s"] == pytest.approx(2 * once["executed_s"], rel=0.02)
    facts = json.loads(call("plot", "hi", "--dry-run", "p.svg", "--json", "-q", "--seed", 1)[0])
    assert facts["files"] == ["p.svg"] and facts["planned_s"] > 0


def test_plot_reports_how_faithful_the_motion_is(call, tmp_path):
    call("plot", "--port", "sim:", "Ada", "--report", "done.json", "-q", "--seed", 1)
    call("plot", "Ada", "--dry-run", "p.svg", "--report", "planned.json", "-q", "--seed", 1)
    done, planned = (json.loads(Path(name).read_text()) for name in ("done.json", "planned.json"))
    assert done["measured"] and not planned["measured"]
    assert done["correlation"] > 0.99 and done["rms_of_peak"] < 0.03 and done["min_queue"] > 0
    assert done["executed_s"] == pytest.approx(planned["executed_s"], rel=0.05)  # of two machines
    _, err = call("plot", "Ada", "--dry-run", "q.svg", "--report", "nowhere/r.json", code=2)
    assert "nowhere" in err and not Path("q.svg").exists()


@pytest.mark.slow
def test_plot_fit_to_the_bed(call):
    text = "line\n" * 20
    _, err = call("plot", "--port", "sim:", text, "--page", "400x400mm", "--x-height", "5mm", code=2)
    assert "outside the bed" in err and "--fit" in err
    call("plot", "--port", "sim:", text, "--page", "400x400mm", "--x-height", "5mm", "--fit", "-q")


@pytest.mark.slow
def test_print_dry_run(call):
    table = ROOT / "examples/envelope.csv"
    facts = json.loads(call("print", "--printer", "epson", table, "--dry-run", "e.svg", "--json", "--seed", 1)[0])
    assert facts.keys() >= KEYS | {"rows", "failed"}
    assert (facts["rows"], facts["failed"], facts["pages"]) == (12, [], 12)
    call("print", "--printer", "epson", table, "--dry-run", "e.pdf", "--rows", "2-3", "-q")
    assert Path("e.pdf").read_bytes().startswith(b"%PDF")
    call("print", "--printer", "pdf", table, "--dry-run", "e.png", "--rows", "2-3", "-q")
    assert len(list(Path().glob("e-*.png"))) == 2


@pytest.mark.slow
def test_print_reports_rows_that_cannot_be_done(call):
    Path("t.csv").write_text("name,street,city\nAnna,Weg 1,Ulm\nԻվան,Weg 2,Ulm\n", encoding="utf-8")
    out, err = call("print", "t.csv", "--dry-run", "e.pdf", "--json", code=4)
    facts = json.loads(out)
    assert facts["rows"] == 1 and facts["failed"][0]["row"] == 3
    assert "row 3" in err and "house-joined" in err


@pytest.mark.slow
def test_hand_list_and_show(call):
    out, _ = call("hand", "list")
    assert {"house-joined", "house-quick", "house-joined-ballpoint"} <= {line.split()[0] for line in out.splitlines()}
    call("hand", "show", "house-quick", "-o", "sheet.png", "--dpi", 72, "--pen", "plain", "--seed", 1, "-q")
    assert Path("sheet.png").stat().st_size > 20000


def test_devices(call):
    out, err = call("devices", "list")
    assert "plotter-grbl-servo" in out and "printer-epson" in out and "devices" in err
    out, _ = call("devices", "show", "plotter-grbl-z")
    Path("mine.toml").write_text(out, encoding="utf-8")
    assert "valid plotter" in call("devices", "check", "mine.toml")[0]
    Path("mine.toml").write_text(out.replace("draw_speed", "draw_sped"), encoding="utf-8")
    _, err = call("devices", "check", "mine.toml", code=2)
    assert "draw_sped" in err and "draw_speed" in err and "mine.toml" in err
    call("plot", "--port", "sim:", "--device", "mine.toml", "hi", code=2)


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["write", "", "-o", "a.svg"], 2, "nothing to write"),
        (["write", "-o", "a.svg"], 2, "Nothing to write"),
        (["write", "բարեւ", "-o", "a.svg"], 2, "'բ' (line 1, character 1)"),
        (["write", "日本", "-o", "a.svg", "--fallback"], 2, "no form"),
        (["write", "a", "-o", "a.svg", "--page", "1x1mm"], 2, "20 to 5000 mm"),
        (["write", "a", "-o", "a.svg", "--page", "A9"], 2, "A9"),
        (["write", "a", "-o", "a.svg", "--x-height", "9000mm"], 2, "x-height"),
        (["write", "a", "-o", "a.svg", "--x-height", "nan"], 2, "x-height"),
        (["write", "a", "-o", "a.svg", "--x-height", "2.5furlongs"], 2, "x-height"),
        (["write", "a", "-o", "a.svg", "--page", "A6", "--margin", "60mm"], 2, "margins"),
        (["write", "a", "-o", "a.svg", "--margin", "1mm,2mm,3mm"], 2, "margin"),
        (["write", "a", "-o", "nowhere/a.svg"], 2, "does not exist"),
        (["write", "a", "-o", "a.docx"], 2, ".svg"),
        (["write", "a", "-o", "."], 2, ""),
        (["write", "a", "-o", "a.svg", "--hand", "house-joind"], 2, "house-joined"),
        (["write", "a", "-o", "a.svg", "--speed", "quickly"], 2, "speed"),
        (["write", "a", "-o", "a.svg", "--speed", "0"], 2, "speed"),
        (["write", "a", "-o", "a.svg", "--seed", "-1"], 2, "seed"),
        (["write", "a", "-o", "a.svg", "--jitter", "99"], 2, "variation"),
        (["write", "a", "-o", "a.svg", "--slips", "200"], 2, "0 to 100"),
        (["write", "--slips", "a b", "-o", "a.svg"], 2, "--slips 3"),
        (["print", "noaddress.csv", "--dry-run", "a.pdf", "--slips"], 2, "arrive"),
        (["write", "a", "-o", "a.svg", "--ink", "blurple"], 2, "blurple"),
        (["write", "a", "-o", "a.png", "--pen", "quill"], 2, "quill"),
        (["write", "a", "-o", "a.png", "--pen-width", "0mm"], 2, "pen width"),
        (["write", "a", "-o", "a.png", "--paper", "vellum"], 2, "vellum"),
        (["write", "a", "-o", "a.png", "--paper", "ruled:1mm"], 2, "2 to 100 mm"),
        (["write", "a", "-o", "a.png", "--paper", "laid", "--transparent"], 2, "--transparent"),
        (["write", "a", "-o", "a.svg", "--pages", "1", "--page", "A6", "--x-height", "50mm"], 2, "mm"),
        (["write", "--file", "missing.txt", "-o", "a.svg"], 2, "missing.txt"),
        (["write", "a", "--file", "b.txt", "-o", "a.svg"], 2, "both"),
        (["plot", "a"], 2, "--port"),
        (["plot", "a", "--port", "/dev/ttyNOWHERE"], 3, "/dev/ttyNOWHERE"),
        (["plot", "a", "--port", "sim:?fault=jam"], 3, "answer"),
        (["plot", "a", "--port", "sim:?fault=alarm"], 3, "alarm"),
        (["plot", "a", "--port", "sim:", "--device", "grbl-serv"], 2, "plotter-grbl-servo"),
        (["print", "missing.csv", "--dry-run", "a.pdf"], 2, "missing.csv"),
        (["print", "binary.csv", "--dry-run", "a.pdf"], 2, "binary.csv"),
        (["print", "noaddress.csv", "--dry-run", "a.pdf"], 2, "noaddress.csv"),
        (["print", "noaddress.csv", "--printer", "epsom", "--dry-run", "a.pdf"], 2, "epson"),
        (["devices", "check", "missing.toml"], 2, "missing.toml"),
        (["wrte", "a"], 2, "write"),
    ],
)
def test_bad_input_is_one_clear_sentence(call, arguments, code, says):
    Path("binary.csv").write_bytes(bytes(range(256)) * 20)
    Path("noaddress.csv").write_text("colour,size\nred,3\n", encoding="utf-8")
    before = set(Path().iterdir())
    out, err = call(*arguments, code=code)
    assert says.lower() in err.lower(), err
    assert out == ""
    assert len(err.strip()) < 700
    kept = {Path("state")} if "--resume" in err else set()  # a plot that had begun
    assert set(Path().iterdir()) == before | kept, "something was left behind"


@pytest.mark.parametrize("codec", ["utf-16", "utf-16-le", "cp1252", "mac_roman"])
def test_a_file_in_any_encoding(call, codec):
    Path("letter.txt").write_bytes("Zoë sagt Grüße".encode(codec))
    out, err = call("write", "--file", "letter.txt", "-o", "a.svg", "--json")
    guess = {"cp1252": "Windows-1252", "mac_roman": "Mac OS Roman"}.get(codec)
    said = f"letter.txt is not UTF-8 and was read as {guess}: check 'Zoë'."
    assert json.loads(out).get("notes") == ([said] if guess else None) and (said in err) == bool(guess)
    assert json.loads(out)["characters"] == 12


def test_a_file_that_is_not_text(call):
    Path("no.txt").write_bytes(b"name\x00\x01\x02")
    _, err = call("write", "--file", "no.txt", "-o", "a.svg", code=2)
    assert "no.txt is not text" in err and "UTF-8" in err


def test_an_output_that_cannot_be_written_costs_no_other(call):
    Path("there.svg").write_text("old", encoding="utf-8")
    call("write", "a", "-o", "there.svg", "-o", "nowhere/b.png", code=2)
    assert Path("there.svg").read_text(encoding="utf-8") == "old"


def test_quiet_says_nothing(call):
    assert call("write", "a", "-o", "a.svg", "-q") == ("", "")


def test_pens_and_papers(call):
    from PIL import Image

    given = ("--page", "60x40mm", "--seed", "4", "--dpi", "150", "-o")
    call("write", "ink", "--pen", "ballpoint", "--paper", "ruled", *given, "a.png")
    call("write", "ink", "--pen", "ballpoint", "--paper", "ruled", *given, "b.png")
    call("write", "ink", "--pen", "pencil", "--transparent", *given, "c.png")
    call("write", "ink", "--pen", "plain", *given, "d.png")
    call("write", "ink", "--paper", "ruled", *given, "e.png")
    assert Path("e.png").read_bytes() == Path("a.png").read_bytes()
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()
    assert [Image.open(name).mode for name in ("a.png", "c.png", "d.png")] == ["RGB", "RGBA", "P"]
    corner = Image.open("a.png").getpixel((350, 100))
    assert min(corner) > 235


def test_devices_probe_and_ports(call, monkeypatch):
    from serial.tools import list_ports
    from serial.tools.list_ports_common import ListPortInfo

    found = json.loads(call("devices", "probe", "--port", "sim:", "--device", "grbl-z", "--json")[0])
    assert found["dialect"] == "grbl" and found["firmware"].startswith("1.1h")
    assert found["limits"]["limits.acceleration"] == 1500 and found["limits"]["port.queue"] == 15
    out, err = call("devices", "probe", "--port", "sim:?acceleration=600mm/s2")
    assert "sim: speaks grbl" in out.replace("?acceleration=600mm/s2", "") and "own 600" in err
    call("devices", "probe", "--port", "/dev/tty-none", code=3)
    rows = [ListPortInfo("/dev/ttyACM0")]
    rows[0].vid, rows[0].pid, rows[0].description = 0x04D8, 0xFD92, "EiBotBoard"
    monkeypatch.setattr(list_ports, "comports", lambda: rows)
    assert call("devices", "list", "--ports")[0] == "/dev/ttyACM0  04d8:fd92  EiBotBoard\n"
    assert json.loads(call("devices", "list", "--ports", "--json")[0])["ports"][0]["usb"] == "04d8:fd92"
    monkeypatch.setattr(list_ports, "comports", lambda: [])
    assert "No serial port was found" in call("devices", "list", "--ports")[1]


def test_what_is_nested_too_deeply_is_refused_in_a_sentence(call):
    Path("deep.toml").write_text("a=" + "[" * 3000, encoding="utf-8")
    Path("deep.md").write_text("**" * 500 + "a" + "**" * 500, encoding="utf-8")
    Path("head.md").write_text("+++\na=" + "[" * 3000 + "\n+++\nHello", encoding="utf-8")
    Path("deep.json").write_text("[" * 100_000, encoding="utf-8")
    Path("table.csv").write_text("Name,Street,City\nAnn,Way 1,Ulm\n", encoding="utf-8")
    for command in (
        ("write", "deep.md"), ("write", "head.md"), ("write", "hi", "--hand", "deep.toml"),
        ("write", "hi", "--style", "deep.toml"), ("--config", "deep.toml", "write", "hi"),
        ("strokes", "show", "deep.json"),
        ("print", "table.csv", "--dry-run", "--printer", "deep.toml"), ("restyle", "deep.json"),
    ):  # fmt: skip
        _, err = call(*command, "out.svg" if command[0] == "print" else "-oout.svg", code=2)
        assert len(err.splitlines()) == 1 or "Usage" in err
        assert not Path("out.svg").exists()


def test_what_no_reader_expects_to_be_nested_is_a_sentence_too(call, monkeypatch):
    def deeper(level):
        return deeper(level + 1)

    # the calls that nest take a plain argument: CPython 3.13.0 does not count calls of functions with *args
    monkeypatch.setattr("handout.pipeline.writing.write", lambda *_, **__: deeper(0))
    assert "nested too deeply" in call("write", "hi", "-o", "out.svg", code=2)[1]


def test_messages_quote_no_more_than_a_screen_shows(call):
    long = "x" * 50_000
    Path("long.md").write_text(f"[a]{{.{long}}}", encoding="utf-8")
    Path("link.md").write_text(f"[a](http://{long})", encoding="utf-8")
    for command in (("long.md",), ("hi", "--page", long), ("hi", "--seed", long), ("hi", "--ink", f"{long} " * 9)):
        _, err = call("write", *command, "-o", "out.svg", code=2)
        assert len(err) < 3500 and "characters more" in err
    assert len(call("write", "link.md", "-o", "out.svg")[1]) < 1000
