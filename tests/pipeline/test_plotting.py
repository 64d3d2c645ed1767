"""Plotting from a script: no command, nobody at the plotter."""

import json
from pathlib import Path

import pytest

import handout
from handout import profiles
from handout.errors import DeviceAlarm, InputError
from handout.pipeline import plot_jobs
from handout.pipeline.plot_request import HookOptions, PartOptions, PlotOptions
from handout.pipeline.plotting import AtPlotter, preview, preview_again
from handout.pipeline.results import Attendant
from handout.plotting.jobs import store
from handout.plotting.jobs.pages import NewPage
from handout.sources import read_drawing
from handout.values import Drawing, Page, Stroke


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr("os.fsync", lambda handle: None)


class Heard(Attendant):
    def __init__(self):
        self.sentences, self.shares = [], []

    def say(self, *sentences):
        self.sentences += sentences

    note = say

    def progress(self, share, stage):
        self.shares.append((share, stage))


def test_a_text_is_plotted_previewed_and_gone_on_with():
    heard = Heard()
    with pytest.raises(DeviceAlarm, match="go on with: handout plot --resume"):
        handout.plot("ill", "sim:?fault=alarm&after=30", attendant=heard)
    (state,) = plot_jobs.list_jobs()
    assert not state["finished"] and 0 <= state["drawn_mm"] < state["pen_down_mm"]
    assert "goes on with sheet 1 of 1" in plot_jobs.outlook(store.find(state["job"]))
    assert any("1 sheet" in sentence for sentence in heard.sentences)
    result = handout.resume(port="sim:", attendant=heard)
    assert result.job.name == state["job"] and result.facts()["finished"]
    assert heard.shares[-1] == (1.0, "plotting") and result.fidelity.startswith("Measured: ")
    done = plot_jobs.state_of(store.find(state["job"]))
    assert done["drawn_mm"] == pytest.approx(done["pen_down_mm"])
    request = handout.PlotRequest(handout.pipeline.inputs.Source("ill"), handout.WritingOptions(seed=1))
    shown = preview(request, ["ill.svg"])
    assert json.loads(json.dumps(shown.facts()))["planned_s"] > 0 and shown.files[0].is_file()


def test_a_preview_of_a_part_with_dips_shows_both_and_is_read_as_the_part():
    hooks = HookOptions(dip="go 200mm 20mm; down; up", dip_every="40mm", after_page="send M9")
    source, writing = handout.pipeline.inputs.Source("oh it is long"), handout.WritingOptions(seed=1)
    asked = {"plotting": PlotOptions(hooks=hooks), "part": PartOptions(from_word="it", to_word="long")}
    shown = preview(
        handout.PlotRequest(source, writing, **asked), ["part.svg", "part.json", "part.pdf"], show_travel=True
    )
    facts = shown.facts()
    assert facts["dips"] * 40 >= facts["pen_down_mm"] > 60 and 0 < facts["hooks_s"] < facts["planned_s"]
    svg = Path("part.svg").read_text(encoding="utf-8")
    assert svg.count('<circle class="dip"') == 2 * facts["dips"] and '"send' not in svg
    whole = preview(handout.PlotRequest(source, writing, plotting=PlotOptions(hooks=hooks)), ["whole.svg"]).facts()
    for name in ("part.svg", "part.json"):
        read = read_drawing(name)
        assert len(read.strokes) == facts["strokes"] < whole["strokes"] and read.timed
        assert read.pen_down == pytest.approx(facts["pen_down_mm"], rel=0.01) and not {"hooks", "part"} & {*read.about}


def test_a_plot_whose_text_is_not_all_written_is_drawn_again_as_far_as_it_goes():
    heard, profile = Heard(), profiles.find("klipper-servo", "plotter")
    drawing = Drawing((Stroke([0, 1], [[10, 10], [20, 10]]),), Page(60, 40))
    job = store.begin([NewPage(drawing, 0.4)], profile, store.JobOptions(), {"any": 1})
    with job.open() as journal:
        journal.begin(0)
    assert plot_jobs.outlook(job).endswith(" mm, or what the plotter draws in 4 s, are drawn again.")
    assert preview_again(job.name, PartOptions(), ["again.svg"], listener=heard).facts()["job"] == job.name
    assert heard.sentences[1:] == [
        f"Only 1 sheet of {job.name} had been written: the rest of its text is left out here."
    ]


def test_a_hand_in_memory_has_all_its_pages_made_at_once():
    hand = handout.load("house-print")
    writing = handout.WritingOptions(hand=hand, seed=2)
    sheet = handout.SheetOptions("60x40mm", "6mm")
    request = handout.PlotRequest(handout.pipeline.inputs.Source("ill oh\n" * 6), writing, sheet)
    result = handout.plot(request, "sim:")
    assert result.job.pages >= 2 and result.sheets == result.job.pages and result.job.whole


def test_where_nobody_is_only_a_person_can_push_the_pen_to_its_zero():
    person = AtPlotter(Attendant(), "/dev/ttyUSB0")
    person.do("Put in sheet 2")
    with pytest.raises(InputError, match="--at-zero"):
        person.do("Lift the pen and push it above the plotter's zero")
    assert not person.try_again(DeviceAlarm("stopped"))
    AtPlotter(Attendant(), "sim:").do("push it above the plotter's zero")
