"""What `handout doctor` finds: on a bare machine, without a home, with broken packages and files; no traceback."""

import json
import os
import shutil
import subprocess
import sys
from collections import namedtuple
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest

from handout.pipeline import doctor
from handout.plotting import ports

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Few packages are required, so that few are loaded."""
    required = ["click>=8.1", "pyserial>=3.5"]
    required += ['nothing-such>=2; extra == "pdf"', 'click>=8; extra == "web"', 'x; extra == "test"']
    monkeypatch.setattr(doctor, "_requirements", lambda: required)


def by_name(findings):
    return {finding.name: finding for finding in findings}


@pytest.mark.parametrize("without", ["numpy regex serial", ""])
def test_a_bare_machine_without_home_gets_words(tmp_path, without):
    """Packages are lacking, there is no home folder, this folder is empty: all is said, and nothing breaks."""
    code = (
        "import sys\n"
        "class Lacking:\n"
        f"    names = {without.split()}\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.partition('.')[0] in self.names: raise ModuleNotFoundError(name, name=name)\n"
        "sys.meta_path.insert(0, Lacking())\n"
        "from handout.pipeline import doctor\n"
        "doctor._requirements = lambda: ['click>=8.1', 'numpy>=1.26', 'regex>=1']\n"
        "from handout.cli import main\n"
        "main(sys.argv[1:])\n"
    )
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("XDG", "HANDOUT"))}
    environment |= {"HOME": str(tmp_path / "file" / "home"), "PYTHONPATH": str(ROOT)}
    (tmp_path / "file").write_text("")  # a home that cannot be made

    def run(*words):
        command = [sys.executable, "-c", code, *words]
        return subprocess.run(command, capture_output=True, text=True, encoding="utf-8", cwd=tmp_path, env=environment)

    done = run("doctor", "--json")
    facts = json.loads(done.stdout)
    states = {finding["name"]: finding for finding in facts["findings"]}
    assert done.stderr == "" and done.returncode == 1
    assert states["jobs"]["state"] == "broken" and "set HOME" in states["jobs"]["remedy"]
    assert states["this folder"]["state"] == "fine"
    if without:
        assert states["numpy"]["state"] == "broken" and "cannot be loaded" in states["numpy"]["words"]
        assert states["ports"]["state"] == "note" and "not looked at" in states["ports"]["words"]
        refused = run("write", "hi", "-o", "a.svg")
        assert refused.returncode == 2 and "`handout doctor` says what to do" in refused.stderr
        assert "Traceback" not in refused.stderr and not (tmp_path / "a.svg").exists()


def test_packages_that_are_old_broken_or_not_the_right_ones(monkeypatch):
    monkeypatch.setattr(metadata, "version", lambda name: {"click": "8.0.9", "pyserial": "3.5"}[name])
    monkeypatch.setitem(sys.modules, "serial", SimpleNamespace(__file__="/elsewhere/serial/__init__.py"))
    found = by_name(doctor.packages())
    assert found["click"].words == "click 8.0.9 is older than 8.1" and found["click"].state == "broken"
    assert found["pyserial"].words == "serial comes from another package than pyserial, /elsewhere/serial/__init__.py"
    assert 'pip install --force-reinstall --no-deps "pyserial>=3.5"' in found["pyserial"].remedy
    monkeypatch.undo()


def test_extras_are_told_with_how_to_get_them():
    found = by_name(doctor.extras())
    assert found.keys() == {"pdf", "web"} and found["web"].state == "fine"
    assert found["pdf"].state == "note" and found["pdf"].remedy.endswith('pip install "handout-driver[pdf]"')
    assert "PDF pages" in found["pdf"].words and "nothing-such is not installed" in found["pdf"].words


def test_every_extra_has_a_purpose():
    import tomllib

    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    assert doctor._EXTRAS.keys() == extras.keys() - doctor._DEVELOPING
    classifiers = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["classifiers"]
    assert f"Programming Language :: Python :: {doctor._NEWEST[0]}.{doctor._NEWEST[1]}" == max(
        (each for each in classifiers if "Python :: 3." in each), key=lambda each: int(each.rpartition(".")[2])
    )


def test_a_file_that_was_changed_is_named(tmp_path, monkeypatch):
    package = tmp_path / "handout"
    shutil.copytree(ROOT / "styles", package)
    File = namedtuple("File", "place hash")
    File.locate = lambda self: self.place
    files = [File(path, SimpleNamespace(value=doctor._hash(path))) for path in sorted(package.glob("*.toml"))]
    monkeypatch.setattr(doctor, "_PACKAGE", package)
    monkeypatch.setattr(metadata, "files", lambda name: files)
    (whole,) = doctor.shipped_files()
    assert whole.state == "fine" and whole.words.startswith(f"{len(files)} files")
    files[0].place.write_text("spoilt")
    files[1].place.unlink()
    (spoilt,) = doctor.shipped_files()
    assert spoilt.state == "broken" and files[0].place.name in spoilt.words and spoilt.words.startswith("2 of")
    monkeypatch.setattr(metadata, "files", lambda name: None)
    assert next(doctor.shipped_files()).state == "fine"  # as in a checkout


def test_folders_that_cannot_be_written_and_full_disks(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    for name in ("CONFIG", "STATE", "DATA"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    monkeypatch.setattr(doctor, "_unwritable", lambda place: "Read-only" if "STATE" in str(place) else "")
    monkeypatch.setattr(shutil, "disk_usage", lambda place: SimpleNamespace(free=3e6))
    found = by_name(doctor.folders())
    assert found["jobs"].state == "broken" and found["jobs"].remedy.startswith("set HOME or XDG_STATE_HOME")
    assert found["settings"].words.endswith("only 3 MB free") and found["settings"].state == "broken"
    assert not (tmp_path / "CONFIG").exists()


def test_a_port_that_others_own(monkeypatch, tmp_path):
    port = tmp_path / "ttyUSB0"
    port.write_text("")
    device = ports.SerialDevice(str(port), "", (0x1A86, 0x7523))
    monkeypatch.setattr(ports, "serial_devices", lambda: [device])
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    owner = SimpleNamespace(gr_name="dialout", gr_gid=20, gr_mem=[])
    grp = SimpleNamespace(getgrgid=lambda number: owner)
    monkeypatch.setitem(sys.modules, "grp", grp)
    port.chmod(0o660)
    found = by_name(doctor.ports())[str(port)]
    assert found.words.endswith("1a86:7523: it belongs to the group dialout") and found.state == "poor"
    assert found.remedy.startswith("sudo usermod -a -G dialout")
    port.chmod(0o600)
    assert "only the administrator" in by_name(doctor.ports())[str(port)].words
    monkeypatch.setitem(sys.modules, "grp", None)  # as on Windows
    assert by_name(doctor.ports())[str(port)].words.endswith("you may not open it")
    assert doctor._BRAILLE.search('ENV{PRODUCT}=="1a86/7523/*", GOTO="braille"')
    assert not doctor._BRAILLE.search("# 1a86/7523")


def test_without_a_network_and_with_a_check_that_breaks(monkeypatch):
    def no(*_, **__):
        raise OSError("Network is unreachable")

    monkeypatch.setattr(doctor.socket.socket, "connect", no)
    monkeypatch.setattr(doctor.socket, "create_server", no)
    found = by_name(doctor.network())
    assert found["route"].state == "note" and "no way out" in found["route"].words and found["studio"].state == "poor"

    def odd_thing():
        yield doctor.CheckFinding("Odd", "first", "fine", "seen")
        raise ValueError("what a\nday")

    first, second = doctor._safely(odd_thing)
    assert first.name == "first" and second.state == "broken" and "ValueError: what a day" in second.words


def test_a_test_page(tmp_path):
    (page,) = doctor._test_page(tmp_path / "page.svg", [])
    assert page.state == "fine" and (tmp_path / "page.svg").stat().st_size > 1000
    (refused,) = doctor._test_page(tmp_path / "none" / "page.svg", [])
    assert refused.state == "broken" and "does not exist" in refused.words
