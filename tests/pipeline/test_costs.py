"""What a batch costs: at the prices that are known, and nothing invented for the others."""

import pytest

from handout.errors import InputError
from handout.pipeline.proofing import Spent, costs, prices
from handout.profiles import find

SPENT = Spent(sheets=3, envelopes=2, covered=2000.0, line=5000.0, machine=1800.0)


def test_a_printer_costs_paper_and_ink():
    at = prices(None, "sheet=0.02, envelope=0.1,ink=0.5,ink_load=12,currency=EUR")
    made = costs(Spent(3, 2, 2000.0), at, plotted=False)
    assert made.items == pytest.approx({"paper": 0.06, "envelopes": 0.2, "ink": 2000e-6 * 12 * 0.5})
    assert made.lacking == () and made.sentence() == "Cost: 0.27 EUR (paper 0.06, envelopes 0.20, ink 0.01)."


def test_a_plotter_costs_pens_and_time():
    made = costs(SPENT, prices(find("simulated", "plotter"), "pen=3,pen_length=500,hour=4"), plotted=True)
    assert made.items["pens"] == pytest.approx(0.03) and made.items["machine"] == pytest.approx(2.0)
    assert made.items["paper"] is None and made.lacking == ("sheet", "envelope") and made.total == pytest.approx(2.03)


def test_what_is_not_known_is_said():
    made = costs(SPENT, prices(None, ""), plotted=False)
    assert made.total == 0 and made.sentence() == (
        "What it costs is not known: give prices with --prices sheet=…,envelope=…,ink=…,ink_load=…,hour=…"
    )


@pytest.mark.parametrize("given", ["paper=1", "sheet", "sheet=-1", "sheet=x", "pen_length=0", "hour=nan"])
def test_a_wrong_price_is_one_sentence(given):
    with pytest.raises(InputError, match=r"prices: .* is none; write sheet=0.02"):
        prices(None, given)
