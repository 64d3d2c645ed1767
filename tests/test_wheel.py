"""The wheel carries everything: built, installed in a clean environment, and used from another folder."""

import json
import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
_VERBS = """
import json, sys
from handout.cli import main
for line in json.loads(sys.argv[1]):
    try:
        main(line)
    except SystemExit as leave:
        assert leave.code == 0, (line, leave.code)
"""


def run(*command, **options):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def own_version():
    """The versions of handout that are installed where the tests run, as text."""
    code = "from importlib.metadata import distributions as d; print([x.version for x in d(name='handout-driver')])"
    return run(sys.executable, "-I", "-c", code)


@pytest.fixture(scope="module")
def handout(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT)
    (wheel,) = folder.glob("handout_driver-*.whl")
    home = folder / "venv"
    venv.create(home, with_pip=False)
    place = Path(sysconfig.get_path("purelib", vars={"base": str(home), "platbase": str(home)}))
    # without --ignore-installed pip would first remove the handout of the environment that runs the tests
    # compiled is what is used, when it is used
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-compile", "--ignore-installed"]
    before = own_version()
    run(*pip, "--prefix", home, wheel)
    assert own_version() == before
    # the dependencies are this environment's; handout itself must come from the wheel
    (place / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    python = home / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    clean = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}

    def call(*arguments):
        return run(python, "-m", "handout", *arguments, cwd=elsewhere, env=clean)

    def calls(*lines):
        """What each of some verbs prints, all in one process: they load the same."""
        said = run(python, "-c", _VERBS, json.dumps(lines), cwd=elsewhere, env=clean)
        return [json.loads(one) for one in said.splitlines()]

    origin = run(python, "-c", "import handout; print(handout.__file__)", cwd=elsewhere, env=clean).strip()
    assert origin.startswith(str(home)), origin
    return call, calls, elsewhere


@pytest.mark.slow
def test_writes_from_another_folder(handout):
    call, _, folder = handout
    facts = json.loads(call("write", "Dear Ada", "--seed", "1", "-o", "letter.svg", "-o", "letter.png", "--json", "-q"))
    assert facts["files"] == ["letter.svg", "letter.png"]
    assert all((folder / name).stat().st_size > 1000 for name in facts["files"])


@pytest.mark.slow
def test_ships_the_verbs_of_the_laboratory(handout):
    call, _, _ = handout
    assert "study " in call("--help") and "\n  score " in call("--help")
    assert call("study", "--help").startswith("Usage: handout study ")
    assert call("score", "--help").startswith("Usage: handout score ")


@pytest.mark.slow
def test_ships_hands_and_machines(handout):
    _, calls, _ = handout
    hands, devices, tag, plot = calls(
        ["hand", "list", "--json"],
        ["devices", "list", "--json"],
        ["asemic", "--style", "calm", "-o", "tag.svg", "--json", "-q"],
        ["plot", "--port", "sim:", "hi", "--json", "-q"],
    )
    assert {"house-joined", "house-print", "house-quick"} <= {h["name"] for h in hands["hands"]}
    names = {d["name"] for d in devices["devices"]}
    assert names >= {"plotter-grbl-servo", "plotter-grbl-z", "plotter-simulated", "printer-epson", "printer-pdf"}
    assert tag["style"] == "calm" and plot["executed_s"] > 0
