"""Plots of tables: a letter for every row, several on one bed, gone on with where they broke off."""

import json
import re
from pathlib import Path

import pytest

from handout.plotting.jobs import store
from handout.simulated.plotter import SimulatedPlotter

ROOT = Path(__file__).parents[2]
PEOPLE = "First name,Street,City\nAnna,Weg 1,Ulm\nBen,Weg 2,Ulm\nCleo,Weg 3,Ulm\nDan,Weg 4,Ulm\nEve,Weg 5,Ulm\n"
CARD = ("--letter", "card.txt", "--page", "60x30mm", "--margin", "5mm", "--x-height", "2mm")
QUICK = ("--hand", "house-print", "--variation", "0", "--speed", "fast", "--seed", 1)


@pytest.fixture(autouse=True)
def files():
    Path("people.csv").write_text(PEOPLE, encoding="utf-8")
    Path("card.txt").write_text("Hi {{ first_name }}", encoding="utf-8")


@pytest.mark.slow
def test_cards_lie_side_by_side(call):
    out, _ = call(
        "plot", "people.csv", *CARD, *QUICK, "--grid", "2x2", "--gap", "4mm", "--dry-run", "out.svg", "--json"
    )
    facts = json.loads(out)
    assert [Path(file).name for file in facts["files"]] == ["out-1.svg", "out-2.svg"] and facts["planned_s"] > 5
    assert facts["rows"] == 5 and 'width="124mm"' in Path("out-1.svg").read_text()[:300]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--grid", "2"), "grid: '2' is not a grid such as 2x3"),
        (("--grid", "2x0"), "is not a grid"),
        (("--grid", "9x9"), "grid: 9 x 9 cards of 60 x 30 mm take 540 x 270 mm, and the bed of"),
        (("--grid", "2x2", "--gap", "-1mm"), "gap: -1mm is below 0"),
        (("--rows", "99"), "names no row"),
        (("--resume",), "nothing to resume"),
    ],
)
def test_bad_options_are_one_sentence_before_any_work(call, more, words):
    _, err = call("plot", "people.csv", *CARD, *QUICK, *more, "--port", "sim:", code=2)
    assert re.search(words, err) and not store.list_kept_jobs()


def test_rows_of_a_table_that_would_be_plotted_as_a_text_are_refused(call):
    _, err = call("plot", "people.csv", *QUICK, "--rows", "2-3", "--dry-run", "out.svg", code=2)
    assert "give --letter card.md or --with-envelopes" in err and not list(Path().glob("out*"))


@pytest.mark.slow
def test_a_row_that_cannot_be_written_keeps_all_from_being_plotted(call):
    Path("people.csv").write_text(PEOPLE.replace("Ben", ""), encoding="utf-8")
    _, err = call("plot", "people.csv", *CARD, *QUICK, "--port", "sim:", code=2)
    assert (
        "row 3: card.txt, line 1: 'first_name' is empty" in err
        and "Nothing was made" in err
        and not store.list_kept_jobs()
    )
    out, _ = call(
        "plot", "people.csv", *CARD, *QUICK, "--skip-bad", "--grid", "2x2", "--port", "sim:", "--json", code=4
    )
    assert json.loads(out)["rows"] == 4 and len(store.list_kept_jobs()) == 1


@pytest.mark.slow
def test_a_batch_that_breaks_off_is_gone_on_with_where_it_was(call):
    command = (
        "plot",
        "people.csv",
        *CARD,
        *QUICK,
        "--grid",
        "2x1",
        "--with-envelopes",
        "--envelope",
        "80x60mm",
        "--rows",
        "2-4",
    )
    _, err = call(*command, "--port", "sim:?fault=unplugged&after=100", code=3)
    assert "go on with the same command and --resume" in err
    broken = next(job for job in store.list_kept_jobs() if not job.standing().finished)
    _, err = call(*command, "--port", "sim:", code=2)
    assert "--resume" in err and "--afresh" in err
    out, _ = call(*command, "--port", "sim:", "--resume", "--json")
    assert json.loads(out)["unknown"] == [] and broken.standing().finished
    titles = [job.title.split(" ", 2)[2] for job in store.list_kept_jobs()]
    assert titles == ["row 2 letter 1", "row 4 letter 1", "row 2", "row 3", "row 4"]
    assert all(job.standing().finished for job in store.list_kept_jobs())
    out, _ = call(*command, "--port", "sim:", "--resume", "--json")
    assert json.loads(out)["before"] == [2, 3, 4] and len(store.list_kept_jobs()) == 5


@pytest.mark.slow
def test_several_plotters_share_the_rows_and_one_that_stops_does_not_stop_the_others(call):
    command = ("plot", "people.csv", *CARD, *QUICK, "--with-envelopes", "--envelope", "80x60mm")
    _, err = call(*command, "--port", "sim:", "--port", "sim:?fault=unplugged&after=40", code=3)
    assert re.search(r"sim:\?fault=unplugged&after=40: The connection .* go on with the same command and --resume", err)
    titles = [job.title.split(" ", 2)[2] for job in store.list_kept_jobs() if job.standing().finished]
    assert 6 <= len(titles) == len(set(titles)) < 10, titles
    _, err = call(*command, "--port", "sim:", "--port", "sim:?latency=1ms", "--resume", code=4)
    assert "which is not among the devices now" in err and len(store.list_kept_jobs()) == 10
    out, _ = call(*command, "--port", "sim:", "--resume", "--json")
    assert json.loads(out)["unknown"] == [] and all(job.standing().finished for job in store.list_kept_jobs())
    assert len({job.title.split(" ", 2)[2] for job in store.list_kept_jobs()}) == len(store.list_kept_jobs()) == 10


@pytest.mark.slow
def test_envelopes_are_plotted_elsewhere(call):
    command = ("plot", "people.csv", *CARD, *QUICK, "--with-envelopes", "--envelope", "80x60mm", "--rows", "2-3")
    out, _ = call(*command, "--port", "sim:", "--envelopes-to", "sim:?latency=1ms", "--json")
    assert json.loads(out)["devices"] == {"sim:": [2, 3], "sim:?latency=1ms": [2, 3]}


@pytest.mark.parametrize(
    ("more", "words", "code"),
    [
        (("--port", "sim:", "--envelopes-to", "sim:"), "--envelopes-to is for letters with envelopes", 2),
        (("--port", "/dev/none", "--port", "/dev/none"), "/dev/none is named twice", 2),
        (("--port", "sim:", "--port", "/dev/none"), "No job was begun", 3),
    ],
)
def test_wrong_ports_are_one_sentence(call, more, words, code):
    _, err = call("plot", "people.csv", *CARD, *QUICK, *more, code=code)
    assert words in err and not store.list_kept_jobs()


def test_a_text_has_one_plotter(call):
    _, err = call("plot", "Hello", "--port", "sim:", "--port", "sim:", code=2)
    assert "Several plotters share the rows of a table" in err


@pytest.mark.slow
def test_a_feeder_puts_in_the_sheets(call, monkeypatch):
    usual = (ROOT / "devices/plotter-simulated.toml").read_text(encoding="utf-8")
    Path("fed.toml").write_text(usual + '\n[feeder]\ncommand = ["G4P0.125"]\n', encoding="utf-8")
    heard, write = [], SimulatedPlotter.write

    def noted(self, data):
        heard.append(data)
        write(self, data)

    monkeypatch.setattr(SimulatedPlotter, "write", noted)
    call("plot", "people.csv", *CARD, *QUICK, "--rows", "2-4", "--port", "sim:", "--device", "fed.toml")
    assert b"".join(heard).count(b"G4P0.125\n") == 2 and len(store.list_kept_jobs()) == 3
