"""The page Style by real events: by mouse, by touch and by keys alone; what it keeps is what the command reads."""

import io
import json
from pathlib import Path

import pytest
from browser import CHROMIUM, axe

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed"),
]


@pytest.fixture
def desk(page):
    """The page with tag.toml, and targets to begin with."""
    page.goto(page.home + "#letters")
    page.evaluate("localStorage.setItem('handout-style', '{\"kept_at\": 1e15}')")  # newer than what the studio kept
    page.goto(page.home + "#style/tag")
    solved(page)
    fine = page.get_by_label("Show numbers, ellipses")
    if not fine.is_visible():
        page.locator(".side").get_by_text("More", exact=True).click()
    fine.check()
    return page


def solved(page):
    page.wait_for_selector(".stage-ink svg[data-state=shown]")


def centre(page, selector, number):
    find = f"document.querySelectorAll('.stage-ink {selector}')[{number}].getBoundingClientRect()"
    return page.evaluate(f"(b => [b.x + b.width / 2, b.y + b.height / 2])({find})")


def place(page):
    return [float(page.get_by_label(f"{way}, mm", exact=True).input_value()) for way in ("Across", "Down")]


def downloaded(page, kind):
    if not page.get_by_label("Format").is_visible():
        page.get_by_text("Files", exact=True).click()
    page.get_by_label("Format").select_option(kind)
    with page.expect_download() as download:
        page.get_by_role("button", name="Download").click()
    return Path(download.value.path()).read_text(encoding="utf-8")


def test_targets_and_ellipses_are_dragged_and_all_is_undone(desk):
    page = desk
    assert axe(page) == []
    page.get_by_label("Show numbers, ellipses").uncheck()
    assert not page.locator("ellipse:visible, rect.handle:visible, .side input[type=number]:visible").count()
    page.get_by_label("Show numbers, ellipses").check()
    x, y = centre(page, "circle.target", 3)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y - 20, steps=2)
    page.mouse.up()
    page.get_by_text("Point 4 of 8").wait_for()
    solved(page)
    moved = place(page)
    assert moved[0] > 64 and moved[1] < 38
    smooth = page.get_by_label("Rounding, typed")
    x, y = centre(page, "rect.handle", 0)
    from_x, from_y = centre(page, "circle.target", 3)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(from_x + 1.6 * (x - from_x), from_y + 1.6 * (y - from_y), steps=2)
    page.mouse.up()
    solved(page)
    rounder = float(smooth.input_value())
    assert 0.31 < rounder < 0.4
    page.get_by_text("The chosen point").click()
    page.get_by_label("Each ellipse by itself").check()
    page.get_by_label("Long axis, mm").wait_for()
    for _ in range(3):
        page.get_by_role("button", name="Undo").click()
    assert place(page) == [64, 38] and float(smooth.input_value()) == 0.3
    page.get_by_role("button", name="Redo").click()
    page.get_by_role("button", name="Redo").click()
    assert place(page) == moved and float(smooth.input_value()) == rounder
    page.reload()
    page.get_by_text("Point 2 of 8").wait_for()
    assert float(smooth.input_value()) == rounder, "a draft outlives its window"


def test_styles_stand_side_by_side_and_one_is_written_with(page):
    page.goto(page.home + "#styles")
    for name in ("calm", "scrawl", "blackletter", "fast-tag"):
        page.locator("li.card", has=page.get_by_label(f"The word in {name}")).locator("canvas[data-shown]").wait_for()
    page.get_by_text("round, upright and slow").wait_for()
    page.get_by_label("The word", exact=True).fill("hello")
    page.locator("canvas[data-shown=hello]").nth(5).wait_for()
    assert axe(page) == []
    page.get_by_role("link", name="Change calm").press("Enter")
    solved(page)
    page.get_by_role("link", name="All styles, side by side").press("Enter")
    page.get_by_role("button", name="Write with scrawl").press("Enter")
    with page.expect_request(lambda asked: '"style":"scrawl"' in (asked.post_data or "")):
        page.get_by_label("Style", exact=True).wait_for()
    page.get_by_label("Style", exact=True).select_option("")


def test_keys_alone_are_enough(desk):
    page = desk
    page.locator(".stage-ink svg").focus()
    for key in (".", "ArrowRight", "Shift+ArrowDown", "a", "u", "+", "["):
        page.keyboard.press(key)
    page.get_by_text("Point 4 of 9, the pen is lifted after it").wait_for()
    plan = json.loads(downloaded(page, "targets"))
    assert plan["targets"][2] == [50.5, 79] and len(plan["targets"]) == 9 and plan["pen_up"] == [3]
    page.locator(".stage-ink svg").focus()
    page.keyboard.press("Delete")
    page.get_by_text("Point 4 of 8").wait_for()
    toml = downloaded(page, "toml")
    assert 'angles = ["30deg", "80deg"]' in toml and "# a comment" not in toml
    assert 'data-t0="' in downloaded(page, "svg")
    page.keyboard.press("Control+z")
    page.get_by_text("Point 4 of 9").wait_for()


def test_fingers_add_and_drag(desk):
    page = desk
    page.get_by_role("button", name="Add a point").click()
    x, y = centre(page, "circle.target", 1)
    send = "(([type, x, y]) => document.querySelector('.stage-ink svg').dispatchEvent(new PointerEvent(type, " \
        "{ pointerId: 7, pointerType: 'touch', clientX: x, clientY: y, bubbles: true })))"  # fmt: skip
    page.evaluate("SVGElement.prototype.setPointerCapture = () => {}")
    for kind, away in (("pointerdown", 60), ("pointermove", 80), ("pointerup", 80)):
        page.evaluate(send, [kind, x + away, y - 60])
    page.get_by_text("Point 3 of 9").wait_for()
    solved(page)
    page.get_by_role("button", name="Add a point").click()


def test_a_photograph_lies_beneath_and_is_there_when_the_page_is_loaded_anew(desk):
    from PIL import Image

    page, picture = desk, io.BytesIO()
    Image.new("RGB", (60, 40), (255, 0, 0)).save(picture, "PNG")
    page.get_by_text("Trace a photograph").click()
    page.get_by_label("Photograph").set_input_files(
        {"name": "tag.png", "mimeType": "image/png", "buffer": picture.getvalue()}
    )
    page.get_by_label("Opacity").fill("1")
    red = "[...document.querySelector('.stage-ink canvas').getContext('2d').getImageData({}, 1, 1).data]"
    at = "...(c => [c.width / 2, c.height / 2 - 150])(document.querySelector('.stage-ink canvas'))"
    assert page.evaluate(red.format(at))[:3] == [255, 0, 0]
    page.wait_for_timeout(600)  # what is kept goes to the studio after a moment
    page.reload()
    page.get_by_text("Trace a photograph").click()
    page.get_by_role("button", name="Take it away").wait_for()
    page.wait_for_selector("svg[data-state=shown]")
    assert page.get_by_label("Opacity").input_value() == "1" and page.evaluate(red.format(at))[:3] == [255, 0, 0]
    page.get_by_role("button", name="Take it away").click()
    assert page.evaluate(red.format(at))[:3] == [255, 255, 255]
    page.get_by_label("Photograph").set_input_files({"name": "no.png", "mimeType": "image/png", "buffer": b"no"})
    page.locator(".bad", has_text="cannot be shown").wait_for()


def test_a_style_is_kept_in_its_file_and_refused_where_one_is(desk):
    page = desk
    said = []
    page.once("dialog", lambda dialog: (said.append(dialog.message), dialog.accept()))
    page.get_by_label("Tremor, typed").fill("0.05")
    page.get_by_role("button", name="Keep the style").click()
    page.locator("#said", has_text="kept in its file").wait_for()
    assert "Comments" in said[0] and "size = 0.05" in (page.folder / "tag.toml").read_text(encoding="utf-8")
    page.get_by_label("Name", exact=True).fill("calm")
    page.get_by_role("button", name="Keep the style").click()
    page.locator(".bad", has_text="comes with the program").wait_for()
    page.get_by_role("textbox", name="Word").fill("no")
    page.get_by_role("button", name="Draw it below").click()
    page.locator("circle.target").nth(8).wait_for(state="attached")
    assert len(json.loads(downloaded(page, "targets"))["targets"]) > 8
    page.get_by_label("Rounding, typed").fill("0.3")
