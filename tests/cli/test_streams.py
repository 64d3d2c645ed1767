"""Commands begun without standard input, output or error, and commands whose reader goes: real processes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import handout

pytestmark = pytest.mark.slow


def run(words, closed=(), **streams):
    """The command as a process, with some of its file descriptors closed."""
    environment = {**os.environ, "PYTHONPATH": str(Path(handout.__file__).parents[1]), "OMP_NUM_THREADS": "1"}
    words = [sys.executable, "-m", "handout", *words]
    closing = [f"{number}<&-" if number == 0 else f"{number}>&-" for number in closed]
    shell = ["/bin/sh", "-c", f'exec "$@" {" ".join(closing)}', "sh", *words]
    usual = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.run(shell, env=environment, check=False, **{**usual, **streams})


WRITE = ["write", "hello", "-o", "a.svg", "--seed", "1"]
SHOW = ["hand", "show", "FONT", "-o", "a.svg", "--seed", "1"]
PLOT = ["plot", "hi", "--port", "sim", "--seed", "1"]
WHOLE = {}  # the files of each of these with all streams open


@pytest.fixture(scope="module")
def font(tmp_path_factory):
    """A hand of one stroke for every letter of a specimen sheet: those of a hand that ships take seconds."""
    letters = [*range(33, 0x180), *map(ord, "–€“”’‘…„—ȘșȚțẞ")]
    glyphs = "".join(f'<glyph unicode="&#{letter};" horiz-adv-x="300" d="M100 0 V500"/>' for letter in letters)
    face = '<font-face units-per-em="1000" ascent="1000" descent="-300"/>'
    path = tmp_path_factory.mktemp("font") / "font.svg"
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg"><defs><font horiz-adv-x="300">{face}{glyphs}</font></defs></svg>'
    )
    return str(path)


@pytest.mark.parametrize("closed", [(0,), (1,), (2,), (0, 2), (0, 1, 2)])
@pytest.mark.parametrize("words", [WRITE, PLOT, SHOW], ids=lambda words: words[0])
def test_a_closed_stream_loses_nothing(tmp_path, font, words, closed):
    words = [font if word == "FONT" else word for word in words]

    def take():
        files = {path.name: path.read_bytes() for path in tmp_path.glob("*.svg")}
        for name in files:
            (tmp_path / name).unlink()
        return files

    if words[0] not in WHOLE:
        whole = run(words)
        assert whole.returncode == 0, whole.stderr
        WHOLE[words[0]] = take()
    without = run(words, closed)
    assert without.returncode == 0 and b"Traceback" not in without.stderr
    assert take() == WHOLE[words[0]]
    assert (not without.stderr) == (2 in closed)


def test_the_json_is_there_without_standard_error():
    done = run([*WRITE, "--json"], (2,))
    assert done.returncode == 0 and json.loads(done.stdout)["files"] == ["a.svg"]


def test_what_cannot_be_printed_is_said():
    done = run(["devices", "list"], (1,))
    assert done.returncode == 2 and done.stderr.splitlines()[-1] == b"handout: Standard output is closed."


def test_nothing_is_read_from_a_closed_input():
    done = run(["write", "-", "-o", "a.svg"], (0,))
    assert done.returncode == 2 and b"the text is empty" in done.stderr and not Path("a.svg").exists()


@pytest.mark.parametrize(
    "words", ["devices list", "plot jobs", "completion bash", "man write", "--help", "config show"]
)
def test_a_reader_that_goes_is_no_fault(words):
    reading, writing = os.pipe()
    os.close(reading)
    done = run(words.split(), stdout=writing)
    os.close(writing)
    assert done.returncode == 0 and b"Traceback" not in done.stderr and b"handout:" not in done.stderr


def test_work_goes_on_when_nobody_reads_what_is_said():
    reading, writing = os.pipe()
    os.close(reading)
    done = run(WRITE, stderr=writing)
    os.close(writing)
    assert done.returncode == 0 and Path("a.svg").exists()
