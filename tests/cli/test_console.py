"""What is said while a machine draws: in order, complete, and nobody waits for the terminal."""

import errno
import threading
from pathlib import Path

import click
import pytest

from handout import cli
from handout.cli.console import BackgroundOutput


@pytest.fixture
def terminal(monkeypatch):
    """A terminal that shows nothing before it is freed; what it has shown."""
    free, shown = threading.Event(), []

    def echo(text, err, nl=True):
        assert free.wait(30.0), "who speaks waited for the terminal"
        shown.append((text, nl))

    monkeypatch.setattr(click, "echo", echo)
    return free, shown


def test_nobody_waits_for_a_slow_terminal(terminal):
    free, shown = terminal
    with BackgroundOutput(quiet=False) as output:
        output.say("one")
        output.say("two")
        assert shown == []
        free.set()
        output.wait()
        assert [text for text, _ in shown] == ["one", "two"]
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("console")]


def test_what_waits_is_bounded_and_counted(terminal):
    free, shown = terminal
    with BackgroundOutput(quiet=False) as output:
        for number in range(5000):
            output.say(f"{number}")
        free.set()
    lines = [text for text, _ in shown]
    assert len(lines) < 450 and sum(int(text[1:].split()[0]) for text in lines if text.startswith("(")) > 4500


def test_quiet_is_quiet(terminal):
    free, shown = terminal
    free.set()
    with BackgroundOutput(quiet=True) as output:
        output.say("one")
        output.wait()
    assert shown == []


def test_a_terminal_that_is_gone_stops_nothing(monkeypatch):
    def echo(text, err, nl=True):
        raise BrokenPipeError

    monkeypatch.setattr(click, "echo", echo)
    with BackgroundOutput(quiet=False) as output:
        output.say("one")
        output.say("two")


@pytest.mark.parametrize("hidden", [False, True])
def test_a_full_disk_is_a_sentence_wherever_it_is_met(monkeypatch, capsys, hidden):
    def fails(**_):
        full = OSError(errno.ENOSPC, "No space left on device")
        if hidden:
            raise OSError("cannot be closed") from full
        raise full

    monkeypatch.setattr(cli.cli, "main", fails)
    assert cli._run_command([]) == 2
    assert "The disk is full" in capsys.readouterr().err
    monkeypatch.setattr(cli.cli, "main", lambda **_: Path("/no/such/file").read_text())
    with pytest.raises(FileNotFoundError):  # other faults are not hidden
        cli._run_command([])
