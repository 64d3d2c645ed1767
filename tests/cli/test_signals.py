"""A command that is told to end does so in good order: no half file, the pen lifted, the job kept."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import handout
from handout.simulated.plotter import SimulatedPlotter

_HALF = """
import signal, sys
from handout import atomic, sinks
from handout.cli import main
def half(path, data):
    with atomic.open_file(path) as stream:
        stream.write(data[: len(data) // 2])
        stream.flush()
        print("half", flush=True)
        signal.pause()
atomic.write_all = lambda files: half(*next(iter(files)))
# as at a terminal, whoever runs the tests: nohup and a shell's & have children ignore them
signal.signal(signal.SIGHUP, signal.SIG_DFL)
signal.signal(signal.SIGINT, signal.default_int_handler)
main(sys.argv[1:])
"""


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)])
def test_no_half_file_is_left(tmp_path, number, code):
    environment = {**os.environ, "PYTHONPATH": str(Path(handout.__file__).parents[1]), "OMP_NUM_THREADS": "1"}
    arguments = [sys.executable, "-c", _HALF, "write", "to the end", "-o", "a.svg", "--seed", "1"]
    with subprocess.Popen(
        arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment, cwd=tmp_path
    ) as process:
        assert process.stdout.readline() == b"half\n"
        assert list(tmp_path.glob(".a.svg.*"))
        process.send_signal(number)
        _, said = process.communicate()
    assert process.returncode == code and b"Traceback" not in said
    assert not list(tmp_path.glob("*a.svg*"))


@pytest.mark.slow
def test_a_second_one_is_not_a_traceback(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(Path(handout.__file__).parents[1]), "OMP_NUM_THREADS": "1"}
    arguments = [sys.executable, "-c", _HALF, "write", "to the end", "-o", "a.svg", "--seed", "1"]
    with subprocess.Popen(
        arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment, cwd=tmp_path
    ) as process:
        assert process.stdout.readline() == b"half\n"
        while process.poll() is None:
            process.send_signal(signal.SIGINT)
        said = process.stderr.read()
    assert process.returncode == 130 and said.split() == [b"Interrupted."]
    assert not list(tmp_path.glob("a.svg"))


def test_one_that_comes_while_the_program_is_loaded_is_not_a_traceback(tmp_path):
    loaded = "import signal as s\ns.signal(s.SIGINT, s.default_int_handler)\ns.raise_signal(s.SIGINT)"
    (tmp_path / "click.py").write_text(loaded, encoding="utf-8")
    homes = f"{tmp_path}{os.pathsep}{Path(handout.__file__).parents[1]}"
    command = [sys.executable, "-m", "handout", "--version"]
    done = subprocess.run(command, env={**os.environ, "PYTHONPATH": homes}, capture_output=True, check=False)
    assert done.returncode == 130 and done.stderr.split() == [b"Interrupted."]


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_plot_lifts_its_pen_and_keeps_its_job(call, monkeypatch, number, code):
    sent, later, whole = bytearray(), bytearray(), SimulatedPlotter.write
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored behind a shell's &

    def write(port, data):
        if len(sent) > 4000 and not later:
            later.append(ord("\n"))
            os.kill(os.getpid(), number)
        (later if later else sent).extend(data)
        whole(port, data)

    monkeypatch.setattr(SimulatedPlotter, "write", write)
    try:
        _, err = call("plot", "--port", "sim:", "all is well", "--seed", 1, code=code)
    finally:
        signal.signal(signal.SIGINT, before)
    name = re.search(r"The job is kept; go on with: handout plot --resume (\S+)", err).group(1)
    assert ("Stopped by SIGTERM." if number == signal.SIGTERM else "Interrupted.") in err
    told = json.loads(call("plot", "show", name, "--json")[0])
    assert told["stopped"] and 0 < told["drawn_mm"] < told["pen_down_mm"]
    assert later.startswith(b"\n!") and b"M3S40\n" in later  # held, and then lifted


def test_a_signal_that_is_ignored_stays_so(monkeypatch):
    from handout import signals

    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with signals.orderly():
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
            assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    finally:
        signal.signal(signal.SIGHUP, before)
