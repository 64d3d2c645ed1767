"""Batches of letters and envelopes that are killed at random: every page is made once, on printers and plotters."""

import pytest

from benchmarks.campaign import campaign
from handout.pipeline.plot_rows import PlotterQueue
from handout.printing.queue import Outcome, SimulatedQueue


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 4, 5, 6])
def test_killed_at_random_every_page_is_made_once(number):
    (tally,) = campaign(6, 4, 11 + number, [number])
    assert tally.kills >= 2 and len(tally.made) == 12


@pytest.mark.slow
@pytest.mark.parametrize(("state", "words"), [("failed", "made twice"), ("completed", "missing")])
@pytest.mark.parametrize("number", [0, 3])
def test_the_judge_sees_a_device_that_is_wrong_about_its_jobs(monkeypatch, number, state, words):
    queue = PlotterQueue if number == 0 else SimulatedQueue
    monkeypatch.setattr(queue, "outcome", lambda self, job, title, earlier=(): Outcome(state))
    with pytest.raises(AssertionError, match=words):
        campaign(6, 5, 1, [number])
