"""Plots that break off, are listed, shown and gone on with: `handout plot --resume`, `jobs`, `show`, `forget`."""

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from handout import profiles
from handout.errors import DeviceSilent, InputError
from handout.plotting.bed import place as placed
from handout.plotting.jobs import store
from handout_lab.ink_comparison import compare
from handout_lab.simulated import FaultyPlotter

SIM = profiles.find("simulated", "plotter")
TEXT = "Dear Ada, all is well"


def broken(call, *more):
    """A plot that broke off, by name."""
    _, err = call("plot", "--port", "sim:?fault=alarm&after=250", TEXT, "--seed", 1, *more, code=3)
    found = re.search(r"The job is kept; go on with: handout plot --resume (\S+)", err)
    assert found, err
    return found.group(1)


def test_a_hold_that_nobody_ends_keeps_the_job(call):
    held = "sim:?fault=hold&after=150"
    _, err = call("plot", "--port", held, TEXT, "--seed", 1, "--hold-limit", "30s", code=3)
    assert "has been on hold (Hold) for 30 s" in err and "The job is kept; go on with: handout plot --resume" in err
    assert "hold limit" in call("plot", "--port", "sim:", TEXT, "--hold-limit", "long", code=2)[1]
    call("plot", "--resume", "last", "--port", "sim:")


def test_a_plot_that_breaks_off_is_gone_on_with(call):
    name = broken(call)
    listed = json.loads(call("plot", "jobs", "--json")[0])
    assert [(job["job"], job["finished"], job["title"]) for job in listed] == [(name, False, TEXT)]
    assert 0 < listed[0]["drawn_mm"] < listed[0]["pen_down_mm"]
    assert name in call("plot", "jobs")[0] and "% drawn" in call("plot", "jobs")[0]
    shown, _ = call("plot", "show", name)
    assert re.search(r'at stroke \d+ of \d+, in the word "(Dear|Ada,|all)"; 0\.\d\d of 0\.\d\d m are drawn', shown)
    assert f"handout plot --resume {name}" in shown
    out, err = call("plot", "--resume", "--port", "sim:", "--json")
    told = json.loads(out)
    assert told["job"] == name and told["finished"] and told["executed_s"] > 0
    assert told["drawn_mm"] == told["pen_down_mm"] and "goes on with sheet 1 of 1" in err
    assert json.loads(call("plot", "show", name, "--json")[0])["finished"]
    for last in ([], ["last"]):
        assert json.loads(call("plot", "show", *last, "--json")[0])["job"] == name
        assert f"From the plot {name} ({TEXT})." in call("plot", "--again", *last, "--dry-run", "again.svg")[1]
    _, err = call("plot", "--resume", name, code=2)
    assert f"{name} is finished" in err
    assert "nothing to resume" in call("plot", "--resume", code=2)[1]


def test_a_part_is_plotted_again_and_goes_on_where_it_broke_off(call):
    """The line that jammed: shown, plotted, cut off within, gone on with."""
    whole = json.loads(call("plot", "--port", "sim:", TEXT, "--seed", 1, "--to-word", "all", "--json", "-q")[0])
    out, err = call("plot", "--again", "last", "--from-word", "Ada", "--dry-run", "part.svg", "--show-travel", "--json")
    told = json.loads(out)
    assert told["job"] == whole["job"] and told["planned_s"] < whole["planned_s"]
    assert 'Of sheet 1, from "Ada," to "all": 0.' in err
    assert 'stroke="#d2d2d2"' in Path("part.svg").read_text(encoding="utf-8")  # of "Dear"
    _, err = call("plot", "--again", whole["job"], "--from-word", "Ada", "--port", "sim:?fault=alarm&after=150", code=3)
    part = re.search(r"go on with: handout plot --resume (\S+)", err).group(1)
    done = json.loads(call("plot", "--resume", "--port", "sim:", "--json", "-q")[0])
    assert (done["job"], done["finished"]) == (part, True) and done["pen_down_mm"] < whole["pen_down_mm"]
    assert "--to cannot be changed any more" in call("plot", "--resume", "--to", "40%", code=2)[1]
    assert "--hand cannot be changed any more" in call("plot", "--again", "last", "--hand", "house-print", code=2)[1]
    assert "leave 'hi' out" in call("plot", "--again", "last", "hi", code=2)[1]


def test_a_job_is_forgotten_when_one_asks_for_it(call):
    name = broken(call)
    assert "Forgot" in call("plot", "forget", name)[1]
    assert call("plot", "jobs") == ("", "No plot is kept.\n")
    assert "no job" in call("plot", "forget", name, code=2)[1]


def test_resume_takes_the_newest_though_its_plotter_did_not_answer(call, monkeypatch):
    older = broken(call)

    def nobody(*_):
        raise DeviceSilent("Nobody there.")

    with monkeypatch.context() as patch:
        patch.setattr("handout.plotting.jobs.runner.connect", nobody)
        _, err = call("plot", "--port", "sim:", "the newer one", "--seed", 2, code=3)
    newer = re.search(r"Nobody there. The job is kept; go on with: handout plot --resume (\S+)", err).group(1)
    assert newer != older
    out, err = call("plot", "--resume", "--json")
    told = json.loads(out)
    assert (told["job"], told["title"], told["finished"]) == (newer, "the newer one", True)
    assert f"{newer} (the newer one): goes on with sheet 1 of 1." in err
    assert json.loads(call("plot", "--resume", "--port", "sim:", "--json", "-q")[0])["job"] == older


def test_what_was_refused_before_it_began_is_not_kept(call, monkeypatch):
    def refused(*_):
        raise InputError("No such thing.")

    monkeypatch.setattr("handout.plotting.jobs.runner.connect", refused)
    assert call("plot", "--port", "sim:", TEXT, code=2)[1].endswith("No such thing.\n")
    assert "none is kept" in call("plot", "show", "a", code=2)[1]
    assert call("plot", "jobs", "--json")[0] == "[]\n"


def test_a_port_that_cannot_be_opened_begins_no_job(call):
    _, err = call("plot", "--port", "/dev/no-such-port", TEXT, code=3)
    assert err.endswith("No job was begun.\n")
    assert call("plot", "jobs", "--json")[0] == "[]\n"


def test_what_cannot_be_asked_for_together(call):
    name = broken(call)
    assert "leave 'hello' out" in call("plot", "--resume", name, "hello", code=2)[1]
    assert "--hand cannot be changed" in call("plot", "--resume", name, "--hand", "house-print", code=2)[1]
    assert "--resume" in call("plot", "--at-zero", "--port", "sim:", "hi", code=2)[1]
    assert "needs the name of one job" in call("plot", "forget", code=2)[1]
    assert "takes no names" in call("plot", "jobs", "a", code=2)[1]
    assert "--port" in call("plot", "show business", code=2)[1]
    assert "overlap" in call("plot", "--port", "sim:", "hi", "--overlap", "0mm", code=2)[1]
    assert "less than 10 mm" in call("plot", "--port", "sim:", "hi", "--pause-every", "5mm", code=2)[1]


def test_the_words_that_manage_jobs_can_be_written(call):
    assert "Plotted 1 sheet" in call("plot", "--port", "sim:", "show", "jobs")[1]


def test_a_text_that_names_a_file_is_the_file(call):
    Path("letter.txt").write_text("two words\n", encoding="utf-8")
    out, err = call("plot", "--port", "sim:", "letter.txt", "--json")
    assert json.loads(out)["characters"] == 8 and "Reading the file letter.txt" in err
    Path("cards").mkdir()
    for name, said in (
        ("no.txt", "no.txt;"),
        ("leter.tx", "leter.tx (there is letter.txt);"),
        ("cards/ada", "cards/ada;"),
    ):
        assert f"There is no file {said}" in call("plot", "--port", "sim:", name, code=2)[1]
    call("plot", "--port", "sim:", "and/or.")


def test_nobody_can_be_asked_for_the_next_sheet(call, monkeypatch):
    """A real port asks; without a terminal that is an error, and the job is kept."""
    from handout.pipeline import plotting

    monkeypatch.setattr(plotting, "is_simulated", lambda address: False)
    _, err = call("plot", "--port", "sim:", "hi 🦊", "--fallback", "--copies", 2, "--seed", 1, code=2)
    assert "Put in sheet 2: nobody can be asked to; use --yes" in err
    name = re.search(r"--resume (\S+)", err).group(1)
    told = json.loads(call("plot", "show", name, "--json")[0])
    assert told["part"] == 2 and told["drawn_mm"] == pytest.approx(told["pen_down_mm"] / 2, abs=0.2)
    _, err = call("plot", "--resume", name, "--yes", code=2)
    assert "--at-zero" in err
    err = call("plot", "--resume", name, "--yes", "--at-zero")[1]
    assert "Plotted the rest" in err and "Left out, since the hand has no form for it: 🦊." in err


def command(*arguments):
    environment = {**os.environ, "PYTHONPATH": str(Path(store.__file__).parents[3]), "OMP_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, "-m", "handout", "plot", *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment,
    )


def until_it_draws(process, place):
    """Wait until the job of a process has drawn something; its name."""
    for _ in range(20000):
        for job in store.list_kept_jobs(place):
            if job.standing().place.stroke >= 2:
                return job.name
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.01)
    raise AssertionError("it never drew")


@pytest.mark.slow
def test_killed_in_the_middle(call, tmp_path):
    place = tmp_path / "state" / "handout" / "plots"
    process = command("--port", "sim:?realtime=1", TEXT, "--seed", "1", "-q")
    name = until_it_draws(process, place)
    _, err = call("plot", "--resume", name, "--port", "sim:", code=2)
    assert "being plotted by another program" in err
    process.send_signal(signal.SIGKILL)
    process.communicate()
    job = store.find(name, place)
    standing = job.standing()
    assert standing.begun and not standing.stopped and not standing.finished
    told = json.loads(call("plot", "--resume", "--port", "sim:", "--json", "-q")[0])
    assert told["job"] == name and told["finished"] and len(told["runs"]) == 2


class Desk:
    """A simulated plotter behind a socket, at ten times its speed; it stays on the desk whoever connects."""

    def __init__(self, speed=10.0):
        self.plotter, self.speed, self.going = FaultyPlotter(SIM), speed, True
        self.server = socket.create_server(("127.0.0.1", 0))
        self.server.settimeout(0.05)
        self.address = f"socket://127.0.0.1:{self.server.getsockname()[1]}"
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def serve(self):
        link, before = None, time.monotonic()
        while self.going:
            if link is None:
                with contextlib.suppress(TimeoutError):
                    link, _ = self.server.accept()
                    link.settimeout(0.002)
            now = time.monotonic()
            until, before = self.plotter.now + (now - before) * self.speed, now
            said = b""
            while self.plotter.now < until:
                said += self.plotter.read(until - self.plotter.now)
            if link is not None:
                try:
                    link.sendall(said)
                    with contextlib.suppress(TimeoutError):
                        data = link.recv(4096)
                        if not data:
                            raise ConnectionError
                        self.plotter.write(data)
                except ConnectionError:
                    link = None

    def close(self):
        self.going = False
        self.thread.join()
        self.server.close()


@pytest.mark.slow
def test_killed_and_the_plotter_went_on_with_what_it_had(call, tmp_path):
    desk, place = Desk(), tmp_path / "state" / "handout" / "plots"
    try:
        process = command(
            "--port", desk.address, "--device", "simulated", TEXT, "--seed", "1", "-q", "--overlap", "8mm"
        )
        name = until_it_draws(process, place)
        drawing = store.find(name, place).drawing(0)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        _, err = call("plot", "--resume", name)
        assert "kept its place" in err and "Plotted the rest" in err
    finally:
        desk.close()
    desk.plotter.placement = placed(drawing.page, SIM)
    told = compare(drawing, desk.plotter.executed_drawing().strokes)
    assert told.missing == 0 and told.dots == 0 and told.stray == 0 and told.deviation < 0.1
    # the overlap that was asked for: where lines cross, the place that the plotter says is that of two
    assert told.doubled <= 8.0
