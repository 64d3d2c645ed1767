"""The page Calibration by real events: a chart is printed, wrong scans of it are given, and shown with their faults."""

import io
from pathlib import Path

import pytest
from browser import CHROMIUM, SHOTS, axe

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed"),
]
DPI = 80


@pytest.fixture(scope="module")
def chart():
    """A page of the chart as a perfect scanner would see it, were the printer perfect."""
    from PIL import Image

    from handout.colour.chart import chart as layout
    from handout.colour.chart_files import render

    whole = Image.fromarray(render(layout("A4").pages[0], 300, ()))
    return whole.resize([round(side * DPI / 300) for side in whole.size], Image.Resampling.BOX)


def given(page, picture, name="scan.png"):
    data = io.BytesIO()
    picture.save(data, "PNG", dpi=(DPI, DPI))
    page.get_by_label("The scan", exact=True).set_input_files(
        {"name": name, "mimeType": "image/png", "buffer": data.getvalue()}
    )


def test_a_chart_is_printed_and_its_scans_are_judged(page, chart):
    page.goto(page.home + "#calibration/sim/white")
    page.get_by_role("button", name="Let the simulated printer").click()
    page.get_by_text("2 of 6: Scan").wait_for()
    page.get_by_label("The step").get_by_text("More", exact=True).click()
    with page.expect_download() as download:
        page.get_by_role("button", name="The PDF once more").click()
    assert download.value.suggested_filename == "chart.pdf"
    given(page, chart.crop((0, 0, 600, 700)), "cropped.png")
    page.locator(".findings .bad", has_text="cut off").wait_for()
    assert page.locator(".laid polygon.refuse").count() > 20 and page.locator(".laid polygon.unread").count() > 2
    assert (
        "cropped.png" in page.locator(".findings").inner_text() and "/tmp" not in page.locator(".findings").inner_text()
    )
    page.evaluate("document.querySelector('.calibration').scrollTop = 170")
    if SHOTS:
        page.screenshot(path=str(Path(SHOTS) / "calibration-desk-light.png"))
    assert axe(page) == []
    given(page, chart.point(lambda value: 255), "wrong.png")
    page.locator(".findings .bad", has_text="marks").wait_for()
    page.get_by_text("Nothing of the chart was found on this scan.").wait_for()
    page.get_by_text("2 of 6: Scan").wait_for()
    page.reload()
    page.get_by_text("Going on with what was begun").wait_for()
    page.get_by_label("The scan", exact=True).focus()
    page.keyboard.press("Tab")
    assert "simulated scanner" in page.evaluate("document.activeElement.textContent"), (
        "keys reach every control in turn"
    )
    page.get_by_role("button", name="Start afresh").click()
    page.get_by_text("1 of 6: Print").wait_for()
