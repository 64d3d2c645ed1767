"""Shells complete verbs, options, names and files; manual pages are well made."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.shell_completion import get_completion_class

from handout.cli import cli, completion_, configuration
from handout.cli.options import group_options

ROOT = Path(__file__).resolve().parents[2]


def completed(line, monkeypatch):
    """What is offered behind a line: the values, of files and folders only their kind."""
    monkeypatch.setenv(completion_.VARIABLE, "bash_complete")
    *words, last = line.split(" ")
    shell = get_completion_class("bash")(cli, {}, "handout", completion_.VARIABLE)
    return [item.value if item.type == "plain" else item.type for item in shell.get_completions(words, last)]


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("wri", ["write"]),
        ("write --ha", ["--hand", "--haste"]),
        ("write --hand house-q", ["house-quick"]),
        ("write --hand examples/", ["file"]),
        ("write --file exam", ["file"]),
        ("--config hand", ["file"]),
        ("write --pen dry", ["dry-brush"]),
        ("write --align r", ["right", "ragged"]),
        ("write --page A", ["A3", "A4", "A5", "A6"]),
        ("plot --device axidraw-v3-a", ["axidraw-v3-a3"]),
        ("plot --port si", ["sim:"]),
        ("print --printer pd", ["pdf"]),
        ("restyle a.svg --style bl", ["blackletter"]),
        ("hand show house-joined-", ["house-joined-ballpoint"]),
        ("devices show printer-pd", ["printer-pdf"]),
        ("config set plot.por", ["plot.port"]),
        ("completion z", ["zsh"]),
        ("wrte x", []),
    ],
)
def test_what_is_offered(line, offered, monkeypatch):
    assert completed(line, monkeypatch) == offered


@pytest.fixture
def handout(tmp_path, monkeypatch):
    """The command `handout` for shells."""
    program = tmp_path / "bin" / "handout"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m handout "$@"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(program.parent), prepend=os.pathsep)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    return tmp_path


_LINE = "handout write --hand house-q"
_ZSH = """
zmodload zsh/zpty
zpty z env TERM=dumb zsh -f -i
zpty -w z 'fpath=({folder} $fpath); autoload -Uz compinit; compinit -u -D; bindkey "^I" complete-word; echo RE''ADY'
zpty -r z line '*READY*'
zpty -w -n z '{line}'$'\\t\\x01echo "GOT" \\n'
zpty -r z line '*GOT handout*'
print -r -- "$line"
"""


@pytest.mark.slow
@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_complete(shell, call, handout):
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not here")
    script = handout / "_handout"
    script.write_text(call("completion", shell)[0])
    run = {
        "bash": f'source {script}; COMP_WORDS=({_LINE}); COMP_CWORD=3; _handout_completion handout; echo "$COMPREPLY"',
        "zsh": _ZSH.format(folder=handout, line=_LINE),
        "fish": f'source {script}; complete -C "{_LINE}"',
    }
    done = subprocess.run(
        [shell, "-c", run[shell]], capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL
    )
    assert "house-quick" in done.stdout, done


def test_many_options_stand_under_headings(call, monkeypatch):
    """Each once, in the help, the manual page, and few of a long list under one heading."""
    monkeypatch.setenv("COLUMNS", "80")
    for path, verb in configuration.all_verbs(cli).items():
        parts = group_options(verb, click.Context(verb))
        names = [option.name for options in parts.values() for option in options]
        assert sorted(names) == sorted(
            option.name for option in verb.get_params(click.Context(verb)) if option.opts[0].startswith("-")
        )
        assert max(map(len, parts.values())) <= 17, path
    out, page = call("plot", "--help")[0], call("man", "plot")[0]
    heads = re.findall(r"^([A-Z][\w, ]+):$", out, re.M)
    assert heads[0] == "Text and files" and heads[-1] == "General" and len(heads) == 11
    assert re.findall(r"\.SS (.*)", page) == heads
    assert max(map(len, out.partition("Text and files:")[2].splitlines())) <= 80
    assert {
        line.index(word) for line in out.splitlines() for word in ("Colour of the ink", "One JSON") if word in line
    } == {34}


def test_manual_pages(call, tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    folder = tmp_path / "share" / "man"
    assert "Wrote" in call("man", "-o", folder)[1]
    names = {path.name for path in (folder / "man1").iterdir()}
    assert names >= {f"handout-{path.replace('.', '-')}.1" for path in configuration.all_verbs(cli)} | {"handout.1"}
    page = (folder / "man1" / "handout-write.1").read_text(encoding="utf-8")
    assert page.startswith('.TH HANDOUT-WRITE 1 "2023-11-14"') and page == call("man", "write")[0]
    assert re.search(r"\.TP\n\.B \\-\\-hand TEXT\n", page) and "\nhandout write \\-\\-file letter.txt" in page
    assert "There is no command 'handout wrte'" in call("man", "wrte", code=2)[1]
    if shutil.which("mandoc"):
        pages = sorted((folder / "man1").iterdir())
        done = subprocess.run(["mandoc", "-T", "lint", "-W", "warning", *pages], capture_output=True, text=True)
        assert done.stdout == ""
