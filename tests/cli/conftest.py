"""What every verb is tested with: a folder and settings of its own, and a way to call it."""

import contextlib
import signal

import pytest

from handout.cli import main, progress


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture
def call(capsys):
    def run(*arguments, code=0):
        before = signal.getsignal(signal.SIGINT)  # ignored by a command that Ctrl-C has ended
        with pytest.raises(SystemExit) as leave:
            main([str(a) for a in arguments])
        signal.signal(signal.SIGINT, before)
        out, err = capsys.readouterr()
        assert leave.value.code == code, err
        assert "Traceback" not in err
        return out, err

    return run


@pytest.fixture
def told(monkeypatch):
    """What would be shown of long work on a terminal: shares and stages, in order."""
    found = []

    @contextlib.contextmanager
    def shown(quiet):
        yield lambda share, stage, left=None: found.append((share, stage))

    monkeypatch.setattr(progress, "show_bar", shown)
    monkeypatch.setattr(progress, "wants_bar", lambda quiet: True)
    return found
