"""Every state of the studio's pages, on a desk and on a phone, light and dark: axe-core finds nothing.

With STUDIO_PICTURES=FOLDER each state is kept there as STATE-SIZE-THEME.png; docs/pictures/make.sh does so.
"""

import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
from browser import CHROMIUM, SHOTS, axe
from studio_process import start_studio

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed"),
]

SIZES = {"desk": {"width": 1280, "height": 800}, "phone": {"width": 390, "height": 844}}


@pytest.fixture(scope="module")
def studio(tmp_path_factory, small_hand_file, browser):
    folder = tmp_path_factory.mktemp("looks")
    shutil.copy(small_hand_file, folder / "mine.hand")
    process, link = start_studio(folder, str(folder / "mine.hand"))
    page = browser.new_page()
    page.goto(link)  # a link lets one browser in, which the walks below share
    page.wait_for_selector("nav a")
    yield SimpleNamespace(browser=browser, home=link.split("#")[0], known=page.context.storage_state())
    page.context.close()
    process.terminate()
    process.wait()


def press(page, name, **more):
    page.get_by_role("button", name=name, **more).first.click()


def states(page, home):
    """Each state by its name, once it is there; what was begun in one stays for those after it."""

    def at(name):
        page.goto(f"{home}#{name}")
        page.locator("h1").first.wait_for(state="attached")
        page.get_by_text("Looking for").wait_for(state="detached")

    at("home")
    page.locator(".scene img").wait_for()
    for name in ("draft", "batch", "own", "texts", "style"):  # nothing is left of the size before
        with page.expect_response(f"**/api/drafts/{name}"):
            keep = f"keep('{name}', {{}}, document.createElement('p'))"
            page.evaluate(f"import('./drafts.js').then(drafts => drafts.{keep})")
    yield "start"
    at("jobs")
    yield "jobs-empty"
    at("write")
    page.wait_for_selector(".sheet svg path.stroke")
    page.locator(".told", has_text="line").wait_for()
    yield "write"
    page.locator("details.looks").evaluate("part => part.open = true")
    page.locator("details.more").evaluate("part => part.open = true")
    page.locator("details.more").scroll_into_view_if_needed()
    yield "write-more"
    page.locator("details.more").evaluate("part => part.open = false")
    page.get_by_label("Kind of text").select_option("letter")
    text = page.get_by_label("Text", exact=True)
    text.fill(text.input_value().replace("Ada", "[Ada]{ink=#7c1f2b}"))
    page.locator(".sheet path[stroke='#7c1f2b'], .sheet [stroke='#7c1f2b'] path").first.wait_for()
    press(page, "Make …")
    page.get_by_text("Looking for").wait_for(state="detached")
    page.get_by_label("A pen for each ink").check()
    yield "write-make"
    press(page, "Prepare the plot")
    page.locator(".bed .stroke.pale").first.wait_for()
    page.get_by_text("2 pens").wait_for()
    yield "jobs-laid"
    page.get_by_label("Connected at").select_option("sim:?realtime=1")
    press(page, "Draw", exact=True)
    page.locator(".bed .nib:not([hidden])").wait_for()
    page.wait_for_timeout(9000 if SHOTS else 0)
    press(page, "Pause")
    page.get_by_text("The plot pauses, its pen lifted.").wait_for()
    yield "jobs"
    press(page, "Stop")
    page.get_by_text("It ended: it was stopped at the page.").wait_for()
    page.get_by_text("More", exact=True).click()
    press(page, "Delete it")
    page.get_by_text("Nothing waits for the plotter").wait_for()
    at("table")
    yield "table-empty"
    press(page, "Try it with a sample")
    page.get_by_text("10 rows").wait_for()
    yield "table"
    press(page, "Next: the letter")
    page.locator(".sheet svg path.stroke").first.wait_for()
    yield "table-letter"
    press(page, "Next: the paper")
    page.get_by_label("Made by").wait_for()
    page.locator(".sheet svg path.stroke").first.wait_for()
    yield "table-paper"
    press(page, "Next: a proof of every letter")
    page.get_by_role("button", name="Approve").wait_for()
    page.locator(".proofs img").nth(9).wait_for()
    yield "table-proof"
    press(page, "Change it: row 3")
    page.get_by_label("Gift", exact=True).wait_for()
    yield "table-change"
    press(page, "Leave it")
    press(page, re.compile("^Approve"))
    press(page, "Make the PDF")
    page.get_by_role("button", name="Save the PDF").wait_for()
    yield "table-made"
    page.get_by_text("More", exact=True).click()
    press(page, "Delete")
    page.get_by_text("Deleted “sample.csv”").wait_for()
    at("own")
    yield "own-print"
    press(page, "Next: photograph it")
    yield "own-photograph"
    page.get_by_label("Which handwriting").select_option("mine")
    page.locator(".found-pages img").wait_for()
    yield "own-look"
    press(page, "Next: ten letters")
    page.get_by_role("button", name="Row 1,").wait_for()
    yield "own-ask"
    press(page, "Skip this")
    press(page, "Write it")
    page.locator(".flow .sheet img").wait_for()
    yield "own-write"
    page.get_by_label("Which handwriting").select_option("")
    at("hands")
    page.locator("li.card img").first.wait_for()
    yield "hands"
    at("letters")
    yield "letters-empty"
    at("letters/mine")
    page.wait_for_selector("path.ink.here")
    page.wait_for_selector(".scan-view image")
    yield "letters"
    at("calibration")
    yield "calibration-empty"
    at("calibration/sim/white")
    page.get_by_text(" of 6: ").wait_for()
    if (afresh := page.get_by_role("button", name="Start afresh")).count():  # begun in the other size
        afresh.click()
        page.get_by_text("1 of 6: ").wait_for()
    press(page, "Let the simulated printer")
    page.get_by_role("button", name="Let the simulated scanner").wait_for()
    yield "calibration-step"
    at("styles")
    page.locator("canvas[data-shown]").nth(5).wait_for()
    yield "styles"
    at("style/calm")
    page.locator("svg[data-state=shown]").wait_for()
    yield "style"


@pytest.mark.parametrize("walked", SIZES if SHOTS else ["phone"])
def test_axe_finds_nothing_in_any_state(studio, walked):
    """The walk is the phone's, and each state is looked at in both sizes; the desk's walk is test_studio_pages.py."""
    # what a finger has no use for, keys above all, is seen in both sizes, but on pictures
    touch = bool(SHOTS) and walked == "phone"
    # buttons that move would be for a while between the colours of two themes
    context = studio.browser.new_context(has_touch=touch, reduced_motion="reduce", storage_state=studio.known)
    page = context.new_page()
    page.set_default_timeout(60_000)
    page.set_viewport_size(SIZES[walked])
    wrong = {}
    for name in states(page, studio.home):
        for size in [walked] if SHOTS else SIZES:  # the walk's own comes last
            page.set_viewport_size(SIZES[size])
            for theme in ("dark", "light"):
                page.emulate_media(color_scheme=theme)
                if SHOTS:
                    page.wait_for_timeout(3000)  # what is written and drawn while one looks is there
                    page.screenshot(path=str(Path(SHOTS) / f"{name}-{size}-{theme}.png"), full_page=touch)
                if found := axe(page):
                    wrong[name, size, theme] = found
    context.close()
    assert wrong == {}
