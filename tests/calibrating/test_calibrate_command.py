"""`handout calibrate` and `handout print` as they are called."""

import json
from functools import partial

import numpy as np
import pytest
from PIL import Image

from handout.cli import main
from handout.colour import exports, icc, table
from handout.simulated import print_and_scan
from handout.simulated import print_and_scan as loop
from handout.simulated.flatbed import Flatbed

TABLE = "name,street,city\nAda Lovelace,12 St James's Square,London\n"


@pytest.fixture
def call(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)

    def run(*arguments, code=0):
        with pytest.raises(SystemExit) as leave:
            main([str(a) for a in arguments])
        out, err = capsys.readouterr()
        assert leave.value.code == code, err
        assert "Traceback" not in err
        return out, err

    return run


@pytest.fixture
def coarse(monkeypatch, profile):
    """The simulated printer is the coarse one."""
    from handout.printing import printers

    known = printers.resolve
    monkeypatch.setattr(printers, "resolve", lambda name, queue="": profile if name == "sim" else known(name, queue))


@pytest.mark.slow
def test_read_build_show_export(call, scan, tmp_path, monkeypatch):
    # coarser than usual, and sooner built
    monkeypatch.setattr(table, "build", partial(table.build, size=17))
    monkeypatch.setattr(icc, "SIDE", 9)
    out, err = call("calibrate", "read", scan, "-o", "patches.ti3", "--report", "report.html", "--json")
    assert json.loads(out)["patches"] == 760 and "760 colours read" in err
    assert "<h2>Ramps</h2>" in (tmp_path / "report.html").read_text()
    out, _ = call("calibrate", "build", "patches.ti3", "--printer", "epson", "--method", "tps", "--json")
    assert json.loads(out)["method"] == "tps"
    out, _ = call("calibrate", "show", "--printer", "epson")
    assert "calibration epson/plain" in out and "not verified" in out
    for kind, head in (("cube", b"TITLE"), ("ti3", b"CTI3"), ("png", b"\x89PNG"), ("npz", b"PK")):
        call("calibrate", "export", "--printer", "epson", "--format", kind, "-o", f"out.{kind}", "-q")
        assert (tmp_path / f"out.{kind}").read_bytes().startswith(head)
    for kind, signature in (("icc", b"prtrRGB Lab "), ("icc-link", b"linkRGB RGB ")):
        call("calibrate", "export", "--printer", "epson", "--format", kind, "-o", f"{kind}.icc", "-q")
        assert (tmp_path / f"{kind}.icc").read_bytes()[12:24] == signature


def test_the_help_of_export_explains_every_format(call):
    explained = call("calibrate", "export", "--help")[0].partition("icc       ")
    assert all(name in explained[1] + explained[2] for name in exports.FORMATS)


@pytest.mark.slow
@pytest.mark.parametrize("dpi", [50, 55, 60])
def test_too_few_dpi_are_the_cause_that_is_named(call, sheet, tmp_path, dpi):
    loop.write(Flatbed().scan(sheet, dpi, np.random.default_rng(2)), dpi, tmp_path / "coarse.tif")
    out, err = call("calibrate", "read", "coarse.tif", "-o", "patches.ti3", "--json")
    # nothing else is made of it: no dust, no hidden marks, no banding
    assert [one["code"] for one in json.loads(out)["findings"]] == ["low-dpi"]
    assert f"The scan has only {dpi} dpi" in err and "scan at 300 dpi" in err


def test_a_bad_scan_writes_no_patches(call, tmp_path):
    Image.new("RGB", (827, 1169), "white").save("white.png", dpi=(100, 100))
    _, err = call("calibrate", "read", "white.png", "-o", "patches.ti3", code=2)
    assert "16 square marks" in err and not (tmp_path / "patches.ti3").exists()


@pytest.mark.slow
def test_the_dry_run_is_what_the_printer_gets(call, coarse, profile, tmp_path):
    out, _ = call("calibrate", "chart", "--printer", "sim", "-o", "chart.pdf", "--dry-run", "chart.png", "--json")
    assert json.loads(out)["dpi"] == profile.dpi
    ((_, sent),) = print_and_scan.pages(tmp_path / "chart.pdf", profile.dpi)
    with Image.open(tmp_path / "chart.png") as shown:
        assert np.array_equal(np.asarray(shown), sent[: shown.height, : shown.width])
        assert shown.info["dpi"] == pytest.approx((300, 300), abs=0.1)


def test_the_wizard_needs_somewhere_to_print(call):
    assert "name a folder" in call("calibrate", "wizard", "--printer", "pdf", code=2)[1]
    assert "paper 'blue'" in call("calibrate", "wizard", "--printer", "sim", "--paper", "blue", code=2)[1]


@pytest.mark.slow
def test_print_goes_through_the_calibration(call, coarse, stored, profile, tmp_path):
    (tmp_path / "table.csv").write_text(TABLE)
    given = ("print", "--printer", "sim", "table.csv", "--seed", "1", "--pen", "pencil")
    out, err = call(*given, "--dry-run", "with.pdf", "--stock", "cream", "--json")
    assert "calibration simulated/white" in err and "not calibrated" not in err
    assert "made on white, and cream is in the printer" in err
    assert json.loads(out)["calibration"]["name"] == "simulated/white"
    call(*given, "--dry-run", "without.pdf", "--calibration", "none")
    pages = {n: next(print_and_scan.pages(tmp_path / f"{n}.pdf", profile.dpi))[1] for n in ("with", "without")}
    inked = (pages["without"] != 255).any(axis=2)
    assert inked.sum() > 1000 and (pages["with"][inked] != pages["without"][inked]).any(axis=1).mean() > 0.9
    assert (pages["with"][~inked] == 255).all()
    # the pencil is all but black: as much of the paper is seen as was left white
    table, dark = stored.table(), inked & (pages["without"].max(axis=2) < 230)
    before, after = (pages[n][dark].astype(np.float32) / 255 for n in ("without", "with"))
    told = table(before * table.paper)
    assert np.abs(after - told).mean() < 0.02 < np.abs(before - told).mean()


@pytest.mark.slow
def test_without_a_calibration_it_is_said(call, coarse, tmp_path):
    (tmp_path / "table.csv").write_text(TABLE)
    assert "not calibrated" in call("print", "--printer", "sim", "table.csv", "--seed", "1")[1]
    _, err = call("print", "--printer", "sim", "table.csv", "--calibration", "sim/x", code=2)
    assert "nothing is calibrated yet" in err
