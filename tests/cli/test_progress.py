"""Long work shows how far it has come: on a terminal, with the time that is left, and nowhere else."""

import io
import re
import subprocess
import sys
from types import SimpleNamespace

import pytest

from handout.cli import progress
from handout.cli.console import Console
from handout.progress import narrow_reports


class Terminal(io.StringIO):
    def isatty(self):
        return True


def plain(text):
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)


def seen(monkeypatch):
    """What is written to a terminal from now on."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr("sys.stderr", found := Terminal())
    return found


def test_a_terminal_shows_share_stage_and_time(monkeypatch):
    terminal, clock = seen(monkeypatch), iter(range(0, 10_000, 10))
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: float(next(clock))))
    with progress.show_bar(False) as tell:
        tell(0.25, "learning")
        (bar,) = progress._shown
        bar.refresh()
        tell(0.5, "plotting", 125.0)
        bar.refresh()
    said = plain(terminal.getvalue())
    assert "learning" in said and "25%" in said and re.search(r"25% +\d+ (s|min \d\d s) left", said)
    assert "plotting" in said and "50%" in said and progress._shown == []


def test_what_is_said_meanwhile_stands_on_a_line_of_its_own(monkeypatch):
    terminal = seen(monkeypatch)
    with progress.show_bar(False) as tell:
        tell(0.5, "working")
        Console().say("a sentence")
        assert progress._shown[0].live.is_started
    assert re.search(r"(^|\n|\r)a sentence\n", plain(terminal.getvalue()))


def test_elsewhere_nothing_is_shown_and_nothing_imported(monkeypatch):
    for stream, quiet in ((io.StringIO(), False), (Terminal(), True)):
        monkeypatch.setattr("sys.stderr", stream)
        with progress.show_bar(quiet) as tell:
            tell(0.5, "working")
        assert stream.getvalue() == "" and not progress.wants_bar(quiet)
    verbs = "plot_, hand_, write_, calibrate_, print_"
    code = f"import sys; from handout.cli import main, {verbs}; print('rich' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_the_parts_of_work_are_shares_of_the_whole():
    found = []
    inner = narrow_reports(
        narrow_reports(lambda share, stage: found.append((round(share, 6), stage)), 0.2, 0.6, "a: "), 0.5, 1.0, "b: "
    )
    inner(0.0, "x")
    inner(1.0, "y")
    assert found == [(0.4, "a: b: x"), (0.6, "a: b: y")]


@pytest.mark.slow
def test_pages_and_plots_tell_how_far_they_are(call, told):
    text = "Dear Ada, all is well with us. " * 12
    call("write", text, "--page", "90x60mm", "-o", "a.png", "-o", "a.svg", "--dpi", 50, "--seed", 1)
    pages = [stage for _, stage in told if stage.startswith("drawing .png")]
    assert len(pages) > 1 and pages[0].startswith("drawing .png 1/") and ("drawing .svg", 1) not in told
    assert [share for share, _ in told] == sorted(share for share, _ in told) and told[0][0] == 0
    told.clear()
    call("plot", "--port", "sim:", "all is well", "--seed", 1)
    shares = [share for share, stage in told if stage == "plotting"]
    assert len(shares) > 5 and shares == sorted(shares) and shares[-1] == pytest.approx(1)


@pytest.mark.slow
def test_a_batch_tells_how_far_it_is(call, told, tmp_path):
    (tmp_path / "a.csv").write_text("name,street,city\nAda,1 Lane,Town\nBob,2 Lane,Town\n", encoding="utf-8")
    call("print", "a.csv", "--printer", "epson", "--dry-run", "a.pdf", "--seed", 1, "-q")
    assert (0.5, "make 1/2") in told
