"""Batches of the studio: what two windows do to one."""

import pytest

from handout import atomic
from handout.errors import InputError
from handout.pipeline import batch_desk, batch_store, batch_trial
from handout.pipeline.options import BatchPlan, MergeOptions, PictureOptions, TableOptions, WritingOptions


def test_a_batch_is_made_by_one_window_at_a_time(tmp_path, monkeypatch):
    for room in (batch_desk, batch_store):
        monkeypatch.setattr(room, "folder", lambda: tmp_path / "batches")
    table = tmp_path / "people.csv"
    table.write_text("name,street,city\nAda,Weg 1,Ulm\n")
    writing = WritingOptions(hand="house-print", seed=1)
    plan = BatchPlan("one", "printer", writing, PictureOptions(), TableOptions(), MergeOptions(), "DL", "simulated")
    name = batch_desk.keep_batch(table, "", False, plan)["batch"]
    with (tmp_path / "batches" / name / "batch.json").open("rb+") as other:
        atomic.lock(other)
        with pytest.raises(InputError, match=f"The batch {name} is being made by another program"):
            batch_desk.make_batch(name, (), False, listener=None)
    with pytest.raises(InputError, match="was not approved"):
        batch_desk.make_batch(name, (), False, listener=None)


def test_a_sentence_tells_the_page_what_its_fields_hold():
    said = "letter.txt, line 3: 'first_gift' is empty: fill it in, or write {{ first_gift|default(\"…\") }}."
    shown = "line 3 of the letter: 'first_gift' is empty: fill it in, or write «first gift, else …»."
    assert batch_trial.as_shown(said) == shown
