"""Nothing that only POSIX has is reached: see fake_windows.py.  What is named for a console that lacks letters."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from handout import atomic
from handout.errors import InputError

ROOT = Path(__file__).resolve().parents[1]

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the other system is made of Linux")


@pytest.mark.slow
def test_verbs_on_a_system_that_is_not_posix(tmp_path):
    verbs = [
        ["write", "łódź", "-o", "con.svg"],
        ["write", "łódź", "-o", "a.svg", "-o", "a.pdf", "--fallback", "--json", "--page", "150x60mm"],
        ["plot", "ha", "--port", "sim:", "-q", "--page", "A6"],
        ["plot", "jobs"],
        ["config", "set", "hand", "house-quick"],
        ["print", ROOT / "examples" / "envelope.csv", "--printer", "simulated", "--queue", "file:out", "--rows", "2"],
        ["hand", "import", ROOT / "handout" / "hand" / "house" / "house-joined-ballpoint.hand", "--name", "mine"],
        ["hand", "remove", "mine"],
    ]
    places = {f"XDG_{kind}_HOME": str(tmp_path / kind) for kind in ("CONFIG", "STATE", "DATA")}
    program = [sys.executable, "-X", "warn_default_encoding", ROOT / "tests" / "fake_windows.py"]
    environment = {**os.environ, **places, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [*program, json.dumps(verbs, default=str)],
        capture_output=True,
        encoding="cp1252",
        cwd=tmp_path,
        env=environment,
    )
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
    lines = done.stdout.splitlines()
    assert json.loads(lines[-1]) == [2, *[0] * (len(verbs) - 1)], done.stderr
    assert "on Windows con is the name of a device" in done.stderr
    facts = next(json.loads(line) for line in lines if line.startswith("{"))
    assert facts["files"] == ["a.svg", "a.pdf"] and facts["characters"] == 4
    assert not (tmp_path / "con.svg").exists() and list((tmp_path / "out").iterdir())


@pytest.mark.parametrize("name", ["con.svg", "AUX", "nul.tar.gz", "COM1.png", "lpt².pdf", "con .svg"])
def test_names_of_devices_are_refused_on_windows(name, tmp_path, monkeypatch):
    assert atomic.target(tmp_path / name) == tmp_path / name
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(InputError, match="the name of a device; choose another"):
        atomic.target(tmp_path / name)
    assert atomic.target(tmp_path / f"x{name}") == tmp_path / f"x{name}"


def test_what_a_console_lacks_is_written_as_json_does(tmp_path):
    code = "from handout.cli import main; import click\n" + (
        'import handout.cli as c; c._run_command = lambda args: click.echo(\'{"a": "Zoë łódź 🦊"}\') or 0; main([])'
    )
    environment = {**os.environ, "PYTHONIOENCODING": "cp1252", "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, env=environment, check=True)
    assert json.loads(done.stdout.decode("cp1252")) == {"a": "Zoë łódź 🦊"}
