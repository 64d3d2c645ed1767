"""The studio's pages in Chromium, by real events: written, looked through, corrected; axe-core finds nothing there."""

import io
import re
from pathlib import Path

import pytest
from browser import CHROMIUM, axe, count_gestures
from PIL import Image

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed"),
]

# what of a page is lower than 44 px, but for links and boxes in a line of text, whose label is pressed
SMALL = """[...document.querySelectorAll('button, .button, select, input:not([type=checkbox]), nav a, summary')]
    .filter(one => one.checkVisibility() && !one.disabled && one.getBoundingClientRect().height < 43.5)
    .map(one => one.outerHTML.slice(0, 80))"""
NOTED = """button => new MutationObserver(() => {
    button.dataset.said = [button.dataset.said, button.textContent].filter(Boolean).join();
}).observe(button, {childList: true})"""


def test_the_first_page_has_doors(page):
    assert page.arrived == page.home, "the token is gone from the address"
    page.goto(page.home + "#home")
    page.reload()
    for door in ("Write something", "Letters from a table", "My own handwriting", "On the desk"):
        page.get_by_role("link", name=door).first.wait_for()
    page.locator(".scene img").wait_for()
    assert axe(page) == []
    loaded = "performance.getEntriesByType('resource').filter(r => r.name.endsWith('.js'))"
    assert page.evaluate(f"{loaded}.reduce((sum, each) => sum + each.decodedBodySize, 0)") < 40_000


def test_a_text_is_written_changed_watched_and_downloaded(page):
    page.goto(page.home + "#write")
    page.wait_for_selector(".sheet svg path.stroke")
    page.get_by_label("Text", exact=True).fill("Dear Ada, here is a card")
    page.locator("details.more").evaluate("part => part.open = true")
    page.get_by_label("Number of the version", exact=True).fill("4")
    page.wait_for_selector(".sheet[data-version='4'] path.stroke")
    first = page.locator(".sheet path.stroke").first.get_attribute("d")
    assert axe(page) == []
    page.get_by_role("button", name="Write it another way").click()
    page.wait_for_selector(".sheet:not([data-version='4']) path.stroke")
    page.get_by_label("Number of the version", exact=True).fill("4")
    page.wait_for_selector(".sheet[data-version='4'] path.stroke")
    assert page.locator(".sheet path.stroke").first.get_attribute("d") == first
    page.get_by_label("Handwriting", exact=True).select_option("house-print")
    page.wait_for_selector(f'.sheet svg:not(:has(path.stroke[d="{first}"])) path.stroke')
    watch = page.get_by_role("button", name="Watch it written")
    watch.evaluate(NOTED)  # a busy computer may look again only after it has ended
    watch.click()
    page.get_by_label("Speed").select_option("20")  # while it is watched
    page.locator('[data-said="Stop,Watch it written"]').wait_for()
    page.get_by_role("button", name="Make …").click()
    assert axe(page) == []
    page.get_by_label("Format").select_option("svg")
    with page.expect_download() as download:
        page.get_by_role("button", name="Download").click()
    assert download.value.suggested_filename == "dear-ada-here.svg"
    assert 'data-t0="' in Path(download.value.path()).read_text(encoding="utf-8")


def test_the_page_that_is_typed_on_is_written_first_and_all_when_typing_rests(page):
    asked = []
    page.on("request", lambda one: asked.append(one.post_data_json) if one.url.endswith("/api/write") else None)
    text = page.get_by_label("Text", exact=True)
    text.fill("the quick brown fox jumps over the lazy dog " * 30)
    text.press("End")
    with page.expect_request(lambda one: one.url.endswith("/api/write") and "at" not in one.post_data_json):
        text.type("and on ")
    page.locator(".pages", has_text=re.compile(r"page ([3-9]) of \1")).wait_for()
    assert "at" in asked[0]
    assert len(asked) < 2 + len("and on "), "what was typed over meanwhile is not written"
    typed = page.locator(".sheet path.stroke").last.get_attribute("d")
    page.get_by_role("button", name="Page before").click()
    page.wait_for_selector(f'.sheet svg:not(:has(path.stroke[d="{typed}"]))')
    count = len(asked)
    page.get_by_role("button", name="Next page").click()
    page.wait_for_selector(f'.sheet path.stroke[d="{typed}"]')
    assert len(asked) == count, "all pages are there"
    text.fill("Dear Ada, here is a card")
    page.locator(".pages").wait_for(state="hidden")


def test_of_two_windows_on_one_text_the_first_is_told_and_what_was_typed_later_stays(page):
    with page.expect_popup() as opened:
        page.evaluate("() => { open(location.href); }")
    other = opened.value
    with other.expect_response("**/api/drafts/draft"):
        other.get_by_label("Text", exact=True).fill("Dear Ada, from the other window")
    page.get_by_label("Text", exact=True).fill("Dear Zoë, from the first")
    page.locator(".bad", has_text="Another window changed this since").wait_for()
    page.reload()
    page.wait_for_selector(".sheet svg path.stroke")
    assert page.get_by_label("Text", exact=True).input_value() == "Dear Ada, from the other window"
    with page.expect_response("**/api/drafts/draft"):
        page.get_by_label("Text", exact=True).fill("Dear Ada, here is a card")
    assert not page.locator(".bad", has_text="Another window").count(), "what was loaded anew is kept again"
    other.close()


def test_of_two_browsers_on_one_text_the_later_is_told(page, browser):
    page.goto(page.home + "#write")
    with browser.new_context() as context:
        other = context.new_page()
        key = page.evaluate("localStorage.getItem('handout-key')")
        context.add_init_script(f"localStorage.setItem('handout-key', {key!r})")
        other.goto(page.home + "#write")
        other.wait_for_selector(".sheet svg path.stroke")
        with page.expect_response("**/api/drafts/draft"):
            page.get_by_label("Text", exact=True).fill("Dear Ada, from the first browser")
        other.get_by_label("Text", exact=True).fill("Dear Zoë, from the second")
        other.locator(".bad", has_text="Another window changed this since").wait_for()
        with other.expect_response("**/api/drafts/draft"):
            other.evaluate("localStorage.removeItem('handout-draft'); location.reload()")
        other.wait_for_selector(".sheet svg path.stroke")
        assert other.get_by_label("Text", exact=True).input_value() == "Dear Ada, from the first browser"


def test_words_that_read_as_others_are_framed_where_they_lie(page):
    """The server's answer is given a doubtful word, since which words are is a matter of the reader's weights."""

    def doubted(route):
        answer = route.fetch()
        word = (
            '"doubtful": [{"word": "Ada", "page": 1, "line": 1, "reads_as": "Ado", "box": [30, 10, 50, 20]}], "pages"'
        )
        route.fulfill(response=answer, body=answer.text().replace('"pages"', word, 1))

    page.route("**/api/write", doubted)
    page.get_by_label("Text", exact=True).fill("Dear Ada, again")
    page.locator(".told", has_text="“Ada” on line 1 may read as “Ado”").wait_for()
    frame, sheet = page.locator(".marks rect").bounding_box(), page.locator(".sheet").bounding_box()
    page.unroute("**/api/write")
    assert abs((frame["x"] + frame["width"] / 2 - sheet["x"]) / sheet["width"] - 40 / 105) < 0.02
    assert abs((frame["y"] + frame["height"] / 2 - sheet["y"]) / sheet["height"] - 15 / 148) < 0.02


def test_a_scanned_hand_may_be_wished_easier_to_read(page):
    page.goto(page.home + "#write")
    page.locator("details.more").evaluate("part => part.open = true")
    slider = page.get_by_label("Easier to read than the author writes")
    page.get_by_label("Handwriting", exact=True).select_option("house-print")
    slider.wait_for(state="hidden")
    page.get_by_label("Handwriting", exact=True).select_option("mine")
    with page.expect_request(lambda asked: '"legible":0.5' in (asked.post_data or "")):
        slider.fill("0.5")
    page.locator(".told", has_text="1 line").wait_for()
    page.get_by_label("Handwriting", exact=True).select_option("house-joined")


def test_refusals_stand_where_the_text_is(page):
    page.get_by_label("Text", exact=True).fill("Ժուկ " * 1000)
    page.locator("details.more").evaluate("part => part.open = true")
    page.get_by_label("Lend letters that the hand lacks").uncheck()
    page.locator("form .bad", has_text="Ժ").wait_for()
    watch = page.get_by_role("button", name="Watch it written")
    watch.evaluate(NOTED)
    said = watch.get_attribute("data-said")
    watch.click()
    page.get_by_role("button", name="Watch it written", disabled=False).wait_for()
    assert watch.get_attribute("data-said") == said, "what was written before is not played"
    page.get_by_label("Lend letters that the hand lacks").check()
    page.get_by_label("Text", exact=True).fill("Dear Ada")
    page.locator(".told", has_text="1 line").wait_for()


def test_a_page_that_was_left_while_it_came_changes_nothing(page):
    held = []
    page.route("**/api/drafts/own", lambda asked: held.append(asked))
    with page.expect_request("**/api/drafts/own"):
        page.goto(page.home + "#own")
    page.get_by_role("link", name="All handwritings").click()
    page.get_by_role("heading", name="All handwritings").wait_for()
    with page.expect_response("**/api/drafts/texts"):
        held[0].continue_()
    page.evaluate("new Promise((done) => setTimeout(done))")
    assert page.url.endswith("#hands")
    page.unroute("**/api/drafts/own")


def test_hands_are_shown_and_a_wrong_one_is_refused(page, small_scan):
    page.set_viewport_size({"width": 1280, "height": 360})  # samples are of hands in view
    page.get_by_role("link", name="My hand", exact=True).click()
    page.get_by_role("link", name="All handwritings").click()
    for name in ("mine", "Everyday joined-up hand"):
        card = page.locator("li.card", has_text=name).first
        card.scroll_into_view_if_needed()
        card.locator("img").wait_for()
    assert axe(page) == []
    page.get_by_role("link", name="Add my own").click()
    page.get_by_text("Photograph", exact=True).click()
    assert axe(page) == []
    page.get_by_label("Photographs or scans").set_input_files(
        {"name": "noise.png", "mimeType": "image/png", "buffer": b"no picture"}
    )
    page.get_by_text("Not one of our sheets?").click()
    page.get_by_label("What is written on it").fill("some text")
    page.get_by_label("What shall it be called?").fill("noise")
    page.get_by_role("button", name="Read my handwriting").click()
    page.locator(".bad", has_text="noise.png").wait_for()
    assert "/tmp" not in page.locator(".bad", has_text="noise.png").inner_text()
    page.reload()
    page.get_by_role("button", name="Take noise.png away").wait_for()
    assert page.get_by_label("What is written on it").input_value() == "some text"
    assert page.get_by_label("What shall it be called?").input_value() == "noise"
    with page.expect_response("**/api/drafts/texts"):
        page.get_by_role("button", name="Take noise.png away").click()
    page.reload()
    page.get_by_text("Photographs or scans").wait_for()
    assert not page.get_by_text("noise.png").count(), "what was taken away stays away"
    page.get_by_label("Photographs or scans").set_input_files(str(small_scan.scan))
    page.get_by_role("button", name="Read my handwriting").click()
    page.locator(".bad", has_text="was not recognised as one of our sheets").wait_for()
    assert page.get_by_label("What is written on it").is_visible()
    with page.expect_response("**/api/drafts/texts"):
        page.get_by_role("button", name="Take").click()
    page.set_viewport_size({"width": 1280, "height": 800})


def test_a_page_becomes_a_hand_that_is_looked_at_asked_about_and_written_with(page, small_scan):
    page.goto(page.home + "#own")
    page.reload()  # it is gone on with where it was left
    page.goto(page.home + "#home")
    gestures = count_gestures(page)
    page.get_by_role("link", name="My own handwriting").click()
    page.get_by_text("Photograph", exact=True).click()
    page.get_by_label("Photographs or scans").set_input_files(str(small_scan.scan))
    page.get_by_text("Not one of our sheets?").click()
    page.get_by_label("What is written on it").fill(Path(small_scan.text).read_text(encoding="utf-8"))
    page.get_by_label("What shall it be called?").fill("ours")
    page.get_by_role("button", name="Read my handwriting").click()
    page.locator(".found-pages img").wait_for()
    assert axe(page) == [] and re.search(r"\d+ letters were found", page.locator(".found-pages").inner_text())
    page.get_by_role("button", name="Next: ten letters").press("Enter")
    page.get_by_role("button", name="Row 1,").press("Enter")
    assert page.locator("button.main").count() == 1 and axe(page) == []
    page.get_by_role("button", name="Keep the answers").press("Enter")
    page.get_by_role("textbox", name="A line").fill("even lines")
    page.get_by_role("button", name="Write it").press("Enter")
    page.locator('.sheet img[alt="even lines"]').wait_for()
    assert axe(page) == []
    page.get_by_role("link", name="Write a letter in it").click()
    page.get_by_label("Text", exact=True).fill("even lines")
    page.locator('.sheet img[alt="even lines"]').wait_for()
    page.get_by_role("button", name="Make …").click()
    page.get_by_label("Format").select_option("pdf")
    with page.expect_download() as download:
        page.get_by_role("button", name="Download").click()
    assert download.value.suggested_filename == "even-lines.pdf" and 12 <= gestures() <= 25
    page.get_by_label("Handwriting", exact=True).select_option("house-joined")
    page.locator(".sheet svg path.stroke").first.wait_for()
    page.goto(page.home + "#letters/ours")
    page.locator("path.ink.kept_out").first.wait_for(state="attached")
    page.goto(page.home + "#own/")
    page.reload()  # what was reached is kept
    page.get_by_role("button", name="Write it").wait_for()


def test_nothing_is_lost_where_a_page_is_loaded_anew_while_a_hand_is_read_and_asked_about(page, small_scan):
    page.goto(page.home + "#own/1")
    page.get_by_label("Which handwriting").select_option("")
    page.get_by_text("Photograph", exact=True).click()
    page.get_by_label("Photographs or scans").set_input_files(str(small_scan.scan))
    page.get_by_text("Not one of our sheets?").click()
    page.get_by_label("What is written on it").fill(Path(small_scan.text).read_text(encoding="utf-8"))
    page.get_by_label("What shall it be called?").fill("anew")
    with page.expect_response("**/api/hands"):
        page.get_by_role("button", name="Read my handwriting").click()
    page.wait_for_timeout(600)  # what is kept goes to the studio after a moment
    page.reload()
    page.locator(".found-pages img").wait_for()  # it was read without the page
    page.get_by_role("button", name="Next: ten letters").press("Enter")
    page.get_by_role("button", name="Row 2,").press("Enter")
    asked = []
    page.on("request", lambda request: asked.append(request.url) if request.url.endswith("/check") else None)
    page.wait_for_timeout(600)
    page.reload()
    page.get_by_role("button", name="Row 2,").wait_for()
    assert page.get_by_role("button", name="Row 2,").get_attribute("aria-pressed") == "true" and not asked
    assert page.get_by_role("button", name="Row 1,").get_attribute("aria-pressed") == "false"


def test_files_and_choices_are_there_where_a_page_is_loaded_anew(page):
    picture = io.BytesIO()
    Image.new("RGB", (60, 40), (255, 0, 0)).save(picture, "PNG")
    page.goto(page.home + "#write")
    page.get_by_label("Kind of text").select_option("letter")
    page.get_by_label("Text", exact=True).fill("Dear Ada")
    with page.expect_request(lambda one: one.url.endswith("/api/write") and "pictures" in one.post_data_json):
        page.get_by_label("A picture for the letter").set_input_files(
            {"name": "red.png", "mimeType": "image/png", "buffer": picture.getvalue()}
        )
    page.wait_for_timeout(600)
    with page.expect_request(lambda one: one.url.endswith("/api/write") and "pictures" in one.post_data_json):
        page.reload()
    page.get_by_label("Kind of text").select_option("text")
    page.goto(page.home + "#hands")
    page.get_by_label("Text", exact=True).fill("jam, cake")
    page.goto(page.home + "#own/0")
    page.get_by_label("Sheets", exact=True).select_option("2")
    page.goto(page.home + "#calibration")
    page.get_by_label("What you call the paper").fill("rag")
    page.get_by_label("Printer", exact=True).select_option("simulated")
    page.get_by_role("button", name="Start or continue").press("Enter")
    page.get_by_role("button", name="Let the simulated printer print it").wait_for()
    page.reload()
    page.get_by_role("button", name="Let the simulated printer print it").wait_for()
    assert page.get_by_label("What you call the paper").input_value() == "rag"
    page.goto(page.home + "#own/0")
    assert page.get_by_label("Sheets", exact=True).input_value() == "2"
    page.goto(page.home + "#hands")
    assert page.get_by_label("Text", exact=True).input_value() == "jam, cake"


def test_sheets_are_made_with_one_thing_to_do_at_a_time(page):
    page.goto(page.home + "#own/0")
    main = page.locator("button.main")
    main.wait_for()
    assert main.all_inner_texts() == ["Make the sheets"]
    page.get_by_label("Sheets", exact=True).select_option("1")
    with page.expect_download() as download:
        main.click()
    assert download.value.suggested_filename == "sheets.pdf"
    page.locator("button.main", has_text="Next: photograph it").click()
    assert page.locator("button.main").all_inner_texts() == ["Read my handwriting"]


def test_a_short_text_is_centred_and_written_larger_and_as_it_was_again(page):
    page.goto(page.home + "#write")
    text, told = page.get_by_label("Text", exact=True), page.locator(".told")
    text.fill("Happy birthday,\ndear Ada!")
    page.get_by_role("button", name="A short text").click()
    back = page.get_by_role("button", name="As it was before")
    back.wait_for()
    assert float(page.get_by_label("Letter height, mm").input_value()) > 3
    page.wait_for_function("""() => {
        const sheet = document.querySelector('.sheet').getBoundingClientRect();
        const boxes = [...document.querySelectorAll('.sheet .stroke')].map(one => one.getBoundingClientRect());
        const [top, low] = [Math.min(...boxes.map(b => b.top)), Math.max(...boxes.map(b => b.bottom))];
        return Math.abs(top + low - sheet.top - sheet.bottom) < 0.1 * sheet.height;
    }""")
    assert axe(page) == []
    back.click()
    page.get_by_role("button", name="A short text").wait_for()
    assert page.get_by_label("Letter height, mm").input_value() == ""
    text.fill("a line that goes on and on\n" * 9)
    told.locator("button").wait_for(state="detached")
    text.fill("Dear Ada")


def test_a_phone_shows_the_text_one_button_and_the_page_in_this_order(page):
    """And all that is touched is as large as a finger, on every page."""
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(page.home + "#write")
    page.wait_for_selector(".sheet svg path.stroke")
    tops = [page.locator(which).bounding_box() for which in ("#text", ".make", ".sheet", ".tools", ".looks")]
    assert [box["y"] for box in tops] == sorted(box["y"] for box in tops) and tops[2]["y"] < 500
    for name in ("home", "write", "table", "own", "hands", "jobs", "calibration"):
        page.goto(page.home + f"#{name}")
        page.locator("h1").first.wait_for(state="attached")
        page.get_by_text("Looking for").wait_for(state="detached")
        small = page.evaluate(SMALL)
        assert small == [], (name, small)
        assert page.evaluate("document.documentElement.scrollWidth") <= 390, name
        assert axe(page) == [], name
    page.set_viewport_size({"width": 1280, "height": 800})


def test_letters_are_corrected_by_keys_alone(page):
    page.goto(page.home + "#letters/mine")
    page.wait_for_selector("path.ink.here")
    page.wait_for_selector(".scan-view image")
    assert axe(page) == []
    side = page.locator(".side")
    page.keyboard.press("Enter")
    side.get_by_text("1 correction is kept.").wait_for()
    page.keyboard.press("Control+z")
    side.get_by_text("correction is kept.").wait_for(state="detached")
    page.keyboard.press("Control+y")
    side.get_by_text("1 correction is kept.").wait_for()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Alt+c")
    page.get_by_text("Draw the cut").wait_for()
    page.keyboard.press("Escape")
    page.get_by_text("Enter confirms").wait_for()
    page.keyboard.press("Alt+s")
    page.locator(".written .stroke").first.wait_for()
    page.keyboard.press("Enter")
    side.get_by_text("strokes told").wait_for()
    page.keyboard.press("Escape")
    page.keyboard.press("Alt+b")
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    side.get_by_text("3 corrections are kept.").wait_for()
    page.keyboard.press("Alt+p")
    for key in ("Space", "ArrowRight", "ArrowRight", "Enter"):
        page.keyboard.press(key)
    side.get_by_text("4 corrections are kept.").wait_for()
    page.keyboard.press("ArrowRight")
    page.get_by_label("Its letter").fill("q")
    page.reload()
    side.get_by_text("4 corrections are kept.").wait_for()
    assert page.get_by_label("Its letter").input_value() == "q", "what is half typed is there, and for its letter"
    page.keyboard.press("ArrowRight")
    assert page.get_by_label("Its letter").input_value() != "q"


def test_a_pen_draws_on_the_page_of_letters_and_fingers_move_it(page):
    page.goto(page.home + "#letters/mine")
    page.wait_for_selector(".scan-view image")
    side, send = page.locator(".side"), page.context.new_cdp_session(page).send
    known = re.search(r"(\d+) corrections? (?:is|are) kept", side.inner_text())
    count = int(known[1]) if known else 0

    def kept(more):
        side.get_by_text(re.compile(rf"^{count + more} corrections? (is|are) kept")).wait_for()

    box = page.locator("path.ink.here").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def seen():
        return page.locator(".scan-view").get_attribute("viewBox")

    def finger(*ways):
        for kind, step in (("touchStart", 0), ("touchMove", 20), ("touchMove", 40), ("touchEnd", 40)):
            points = [{"x": x + by * step, "y": y, "id": i} for i, by in enumerate(ways)]
            send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [] if kind == "touchEnd" else points})

    page.keyboard.press("Alt+p")
    for kind, step in (("mousePressed", 0), ("mouseMoved", 10), ("mouseReleased", 20)):
        pen = {"type": kind, "x": x + step, "y": y, "button": "left", "buttons": 1, "clickCount": 1}
        send("Input.dispatchMouseEvent", {**pen, "pointerType": "pen", "force": 0.5})
    kept(1)
    page.keyboard.press("Alt+i")  # by mouse, where the scan shows the ink that the pen took away
    page.get_by_text("one dab is enough for a stroke").wait_for()
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 20, y, steps=3)
    page.mouse.up()
    kept(2)
    page.keyboard.press("Alt+p")
    before = seen()
    finger(1)  # the hand that holds the pen lies on the glass
    moved = seen()
    finger(-1, 1)
    assert len({before, moved, seen()}) == 3 and float(seen().split()[2]) < float(moved.split()[2])
    kept(2)
    page.keyboard.press("Escape")


def test_a_word_is_written_again_and_the_block_is_moved_by_keys_alone(page):
    page.goto(page.home + "#write")
    page.get_by_label("Text", exact=True).fill("Dear Ada, again")
    page.locator('.sheet svg[aria-label="Dear Ada, again"]').wait_for()  # no more the text before
    page.get_by_role("button", name="Rewrite a word", exact=True).press("Enter")
    for key in ("ArrowRight", "Enter"):
        page.locator(".marks.words:focus").press(key)
    page.locator(".told", has_text="Written again: “Ada,”. All other words are kept.").wait_for()
    page.get_by_label("Text", exact=True).fill("Oh dear Ada, again")  # it is found where it went
    page.locator(".told", has_text="Written again: “Ada,”").wait_for()
    assert axe(page) == []
    page.get_by_role("button", name="Move the text", exact=True).press("Enter")
    page.locator(".marks.block:focus").press("ArrowRight")
    # of two requests the first may have gone already
    with page.expect_request(lambda request: "10.5mm,10.5mm,10.5mm,11.5mm" in (request.post_data or "")) as asked:
        page.locator(".marks.block:focus").press("Shift+ArrowLeft")
    assert asked.value.post_data_json["rewritten"] == [[8, 1]]
    page.get_by_role("button", name="Move the text", exact=True).press("Enter")
    page.get_by_label("Kind of text").select_option("letter")
    page.get_by_label("Text", exact=True).fill("# A card\n\nDear *Ada*")
    page.locator(".told", has_text="2 lines").wait_for()
    page.get_by_role("button", name="Rewrite a word", exact=True).press("Enter")
    for key in ("ArrowLeft", "Enter"):
        page.locator(".marks.words:focus").press(key)
    page.locator(".told", has_text="Written again: “Ada”.").wait_for()
    page.get_by_label("Text", exact=True).fill("# A *new* card\n\nDear *Ada*")
    page.locator(".told", has_text="Written again: “Ada”.").wait_for()
    picture = io.BytesIO()
    Image.new("RGB", (60, 40), (200, 30, 30)).save(picture, "PNG")
    shown = {"name": "a garden.png", "mimeType": "image/png", "buffer": picture.getvalue()}
    page.get_by_label("A picture for the letter").set_input_files(shown)
    page.locator(".sheet img").wait_for()
    assert "![](a-garden.png)" in page.get_by_label("Text", exact=True).input_value()
    assert axe(page) == []
    page.get_by_label("Text", exact=True).fill("# A card\n\n![](/etc/passwd)")
    page.locator("form .bad", has_text="alone").wait_for()
    page.get_by_label("Kind of text").select_option("text")
    with page.expect_response("**/api/drafts/draft"):
        page.get_by_label("Text", exact=True).fill("What is typed last")
    page.evaluate("localStorage.removeItem('handout-draft')")  # a browser that is killed writes seconds late
    page.reload()
    page.locator(".told", has_text="1 line").wait_for()
    assert page.get_by_label("Text", exact=True).input_value() == "What is typed last"


def test_a_text_goes_to_the_plotter_and_its_pen_is_seen(page):
    page.goto(page.home + "#write")
    page.get_by_label("Text", exact=True).fill("Hi hi hi hi hi hi hi hi hi")  # it is not done when it is paused
    page.get_by_role("button", name="Make …").click()
    page.get_by_role("button", name="Prepare the plot").click()
    page.locator(".bed .stroke.pale").first.wait_for()
    assert axe(page) == []
    for way in ("to the left", "towards you"):
        page.get_by_role("button", name="Turn the sheet").press("Enter")
        page.get_by_text(f"The sheet lies with its top edge {way}.").wait_for()
    page.locator('.bed .movable[transform^="matrix(-1"]').press("ArrowRight")
    page.locator(".bed .movable").press("Shift+ArrowRight")
    sheet = page.locator(".bed .leaf").bounding_box()
    page.mouse.move(sheet["x"] + 5, sheet["y"] + 5)
    page.mouse.down()
    page.mouse.move(sheet["x"] + 45, sheet["y"] + 5)
    with page.expect_response("**/sheet"):
        page.mouse.up()
    page.locator('.bed .movable:not([transform^="translate"])').wait_for()
    page.get_by_text("The sheet lies with its top edge towards you.").wait_for()
    moved = page.locator(".bed .leaf").bounding_box()
    assert abs(moved["x"] - sheet["x"] - 40) < 3 and abs(moved["y"] - sheet["y"]) < 3
    assert axe(page) == []
    assert page.get_by_label("Connected at").input_value() == "", "no machine is chosen unasked, nor the simulated one"
    page.get_by_role("button", name="Draw", exact=True).press("Enter")
    page.locator(".bad", has_text="Choose first where the plotter is connected").wait_for()
    page.get_by_label("Connected at").select_option("sim:?realtime=1")
    page.get_by_role("button", name="Draw", exact=True).press("Enter")
    page.locator(".bed .nib:not([hidden])").wait_for()
    page.get_by_role("button", name="Pause").press("Enter")
    page.get_by_text("The plot pauses, its pen lifted.").wait_for()
    page.reload()  # the plot goes on without the page, and another page may attend to it
    page.get_by_role("button", name="Stop").press("Enter")
    page.get_by_text("It ended: it was stopped at the page.").wait_for()
    page.get_by_text("More", exact=True).click()
    page.get_by_label("Back to the start corner").check()
    page.reload()
    page.get_by_text("It goes on with sheet 1 of 1, at stroke").wait_for()
    assert page.get_by_label("Back to the start corner").is_checked()
    assert page.get_by_label("The pen stands above").is_visible()
    page.get_by_text("More", exact=True).click()
    page.get_by_label("Back to the start corner").uncheck()
    page.get_by_label("Connected at").select_option("sim:")
    page.get_by_role("button", name="Continue").press("Enter")
    page.get_by_text("nothing is on paper").wait_for()


def test_a_plot_with_three_pens_one_slower_one_left_out_pauses_and_goes_on(page):
    page.goto(page.home + "#write")
    page.get_by_label("Kind of text").select_option("letter")
    page.get_by_label("Text", exact=True).fill("Hi [A]{ink=#7c1f2b} [lo]{ink=#1f7c2b}")
    page.get_by_role("button", name="Make …").press("Enter")
    page.get_by_label("A pen for each ink").check()
    page.get_by_role("button", name="Prepare the plot").press("Enter")
    rows = page.locator(".pens tbody tr")
    rows.nth(2).wait_for()
    page.get_by_text("the sheet, 105 × 148 mm").wait_for()
    assert axe(page) == []

    def said(about, act):
        """The table after something is said of a pen, which the page of the plot shows at once."""
        page.locator(".bed .leaf").evaluate("leaf => leaf.classList.add('before')")
        act(page.get_by_label(about))
        page.locator(".bed .leaf:not(.before)").wait_for()
        return rows.all_inner_texts()

    strokes = page.locator(".bed .stroke").count()
    usual = rows.nth(1).inner_text().split("\t")[-2]
    late = []  # the answer with all strokes comes after the one without the green ones
    page.route("**/pages/0", lambda route: late.append((route, route.fetch())), times=1)
    with page.expect_request("**/pages/0"):
        page.get_by_label("Speed in percent: red").fill("20")
        page.get_by_label("Speed in percent: red").press("Enter")
    assert "left out" in said("Draw it: green", lambda box: box.uncheck())[2]
    assert int(rows.nth(1).inner_text().split("\t")[-2].split()[0]) > int(usual.split()[0])
    assert page.locator(".bed .stroke").count() < strokes
    with page.expect_response("**/pages/0"):
        late[0][0].fulfill(response=late[0][1])
    page.evaluate("new Promise((done) => setTimeout(done))")
    assert page.locator(".bed .stroke").count() < strokes
    said("Pen: red", lambda field: (field.fill("the red one"), field.press("Enter")))
    moved = said("Order: red", lambda handle: handle.press("ArrowUp"))
    assert "red" in moved[0] and page.evaluate("document.activeElement.textContent") == "↕"
    handle, first = page.get_by_label("Order: red").bounding_box(), rows.nth(1).bounding_box()
    page.mouse.move(handle["x"] + 5, handle["y"] + 5)
    page.mouse.down()
    page.mouse.move(first["x"] + 5, first["y"] + 10, steps=3)
    with page.expect_response("**/pens"), page.expect_response("**/pages/0"):
        page.mouse.up()
    assert "red" in rows.nth(1).inner_text()
    assert axe(page) == []
    page.get_by_label("Pen: red").fill("the red marker")
    page.reload()  # while it is typed
    rows.nth(2).wait_for()
    assert page.get_by_label("Pen: red").input_value() == "the red marker", "it is kept"
    page.get_by_label("Connected at").select_option("sim:?realtime=1")
    page.get_by_role("button", name="Draw", exact=True).press("Enter")
    page.locator(".bed .nib:not([hidden])").wait_for()
    page.get_by_role("button", name="Pause").press("Enter")
    page.get_by_text("The plot pauses, its pen lifted.").wait_for()
    page.get_by_role("button", name="Continue").press("Enter")
    page.get_by_text("nothing is on paper").wait_for()
    assert [row.split("\t")[-1] for row in rows.all_inner_texts()] == ["drawn", "drawn", "left out"]
    page.goto(page.home + "#write")
    page.get_by_label("Kind of text").select_option("text")


def given(page, name, text):
    page.locator(".flow .steps").wait_for()
    if (back := page.get_by_role("button", name="Table", exact=True)).count():
        back.press("Enter")
        page.get_by_text("Another table").wait_for()
    page.get_by_label("table", exact=False).first.set_input_files(
        {"name": name, "mimeType": "text/csv", "buffer": text.encode()}
    )


def test_letters_are_made_from_a_table_by_pressing_what_comes_next(page):
    page.goto(page.home + "#home")
    gestures = count_gestures(page)

    def press(name):
        page.get_by_role("button", name=name).press("Enter")

    page.get_by_role("link", name="Letters from a table").first.click()
    press("Try it with a sample")
    page.get_by_text("10 rows").wait_for()
    assert axe(page) == []
    press("Next: the letter")
    page.locator(".sheet svg path.stroke").first.wait_for()
    assert axe(page) == []
    press("Next: the paper")
    page.get_by_label("Made by").wait_for()
    assert axe(page) == []
    press("Next: a proof of every letter")
    press("Leave out: row 3")
    gestures_so_far = gestures()
    page.reload()
    after = count_gestures(page)
    page.locator(".proofs img").nth(9).wait_for()
    assert page.get_by_role("button", name="Leave out: row 3").get_attribute("aria-pressed") == "true"
    assert page.locator(".proofs img").count() == 10 and axe(page) == []
    press("Approve the other 9")
    press("Make the PDF")
    with page.expect_download() as download:
        press("Save the PDF")
    import pikepdf

    assert len(pikepdf.open(download.value.path()).pages) == 9 and 8 <= gestures_so_far + after() <= 30
    page.locator(".rows tr", has_text="left out").wait_for()
    assert page.locator(".rows tr", has_text="done").count() == 9


def test_a_table_s_odd_rows_and_a_letter_s_wrong_gaps_are_told_before_anything_is_made(page):
    page.goto(page.home + "#table")
    given(page, "people.csv", "First name,Gift\nAda,jam\nAda,jam\nZoë,\n")
    page.get_by_text("3 rows").wait_for()
    page.get_by_text("rows 2 and 3 are the same", exact=False).wait_for()
    assert "--" not in page.locator(".flow-body").inner_text(), "what is typed at a terminal is no help here"
    page.get_by_role("button", name="Next: the letter").press("Enter")
    page.get_by_label("Letter", exact=True).fill("Dear {{ first_nam }}")
    page.locator(".bad", has_text="did you mean first_name?").wait_for()
    page.get_by_label("Letter", exact=True).fill("Dear «fisrt name», « merci »")
    page.locator(".bad", has_text="«fisrt name» is no column").wait_for()
    assert "Its columns are «first name», «gift»." in page.locator(".asks").inner_text()
    page.get_by_label("Letter", exact=True).fill("Dear ")
    page.get_by_role("button", name="first name").press("Enter")
    page.keyboard.type(", thank you for the ")
    page.get_by_role("button", name="gift").press("Enter")
    page.locator('.sheet svg[aria-label="Dear Ada, thank you for the jam"]').wait_for()
    letter = page.get_by_label("Letter", exact=True)
    assert letter.input_value() == "Dear «first name», thank you for the «gift»", "gaps are called as the columns are"
    letter.press("Backspace")
    assert letter.input_value() == "Dear «first name», thank you for the ", "one goes as one"
    letter.press("Control+z")
    page.wait_for_timeout(600)
    kept = page.evaluate("JSON.parse(localStorage.getItem('handout-batch')).letter")
    assert kept == "Dear {{ first_name }}, thank you for the {{ gift }}"
    page.get_by_role("button", name="Row before").press("Enter")
    page.get_by_text("Zoë").wait_for()
    page.locator(".asks .bad", has_text="line 1 of the letter: 'gift' is empty").wait_for()
    page.get_by_role("button", name="Next: the paper").press("Enter")
    page.get_by_text("No envelopes").wait_for()
    with page.expect_response("**/api/drafts/batch"):
        page.get_by_label("Paper").select_option("A5")
    page.reload()
    page.get_by_label("Paper").wait_for()
    assert page.get_by_label("Paper").input_value() == "A5", "nothing is lost by loading the page anew"
    page.get_by_role("button", name="Next: a proof").press("Enter")
    page.get_by_text("1 row cannot be made").wait_for()
    page.get_by_role("button", name="Put it right: row 4").press("Enter")
    assert axe(page) == []
    page.get_by_label("Gift", exact=True).fill("figs")
    page.reload()
    page.get_by_role("button", name="Keep", exact=True).wait_for()
    assert page.get_by_label("Gift", exact=True).input_value() == "figs", "what is typed of a row is there"
    page.get_by_role("button", name="Keep", exact=True).press("Enter")
    page.get_by_role("button", name="Approve all 3").wait_for()
    assert page.locator(".proofs img").count() == 3 and axe(page) == []
    page.get_by_role("button", name="Change the letter").press("Enter")
    assert "gift" in page.get_by_label("Letter", exact=True).input_value()


def test_many_rows_of_one_fault_are_told_once_and_every_row_can_be_looked_at(page):
    page.goto(page.home + "#table")
    page.reload()
    rows = [f"{'' if number % 3 else f'Ada {number}'},jam{',of figs' if number == 6 else ''}" for number in range(602)]
    given(page, "many.csv", "\n".join(["First name,Gift", *rows]))
    page.get_by_text("602 rows").wait_for()
    page.get_by_role("button", name="Next: the letter").press("Enter")
    page.get_by_label("Letter", exact=True).fill("Dear {{ first_name }}, {{ gift }}")
    page.locator('.sheet svg[aria-label="Dear Ada 0, jam"]').wait_for()  # not one that is empty
    page.get_by_label("Row", exact=True).fill("602")
    page.get_by_label("Row", exact=True).press("Tab")
    page.locator('.sheet svg[aria-label="Dear Ada 600, jam"]').wait_for()
    page.get_by_label("Row", exact=True).fill("8")
    page.get_by_label("Row", exact=True).press("Tab")
    page.locator('.sheet svg[aria-label="Dear Ada 6, jam"]').wait_for()
    page.locator(".asks .bad", has_text="it has 3 cells where the header has 2").wait_for()
    page.get_by_role("button", name="Table", exact=True).press("Enter")
    page.get_by_role("cell", name="333 rows", exact=True).wait_for()
    assert page.get_by_role("region", name="Rows to look at").locator("tbody tr").count() == 2
    assert axe(page) == []


def test_a_page_of_a_proof_that_does_not_come_is_said_and_not_approved(page):
    page.goto(page.home + "#table")
    page.reload()
    given(page, "people.csv", "First name\nAda\nZoë\n")
    page.get_by_text("2 rows").wait_for()
    page.get_by_role("button", name="Next: the letter").press("Enter")
    page.get_by_label("Letter", exact=True).fill("Dear {{ first_name }}")
    page.get_by_role("button", name="Next: the paper").press("Enter")
    page.get_by_label("Made by").select_option("plotter")
    page.route("**/proof-1.png", lambda route: route.fulfill(status=422, body="{}"))
    page.get_by_role("button", name="Next: a proof").press("Enter")
    page.get_by_text("This page cannot be shown").wait_for()
    approve = page.get_by_role("button", name="Approve all 2")
    assert approve.is_disabled() and axe(page) == []
    page.unroute("**/proof-1.png")
    page.get_by_role("button", name="Try again").press("Enter")
    page.locator(".proofs .unseen").wait_for(state="detached")
    approve.press("Enter")
    assert page.get_by_role("button", name="Plot", exact=True).is_disabled(), "until it is said where"
    page.get_by_label("Connected at").select_option("sim:")
    page.get_by_text("Share it with more plotters").click()
    page.get_by_label("simulated, at true speed").check()
    page.reload()
    page.get_by_role("button", name="Try it in simulation").wait_for()
    assert page.get_by_label("Connected at").input_value() == "sim:"
    page.get_by_text("Share it with more plotters").click()
    page.get_by_label("simulated, at true speed").uncheck()
    page.get_by_role("button", name="Try it in simulation").press("Enter")
    page.get_by_text("nothing is on paper yet").wait_for()
    page.locator(".rows td", has_text="simulated").first.wait_for()
    assert page.get_by_role("button", name="Try it in simulation").is_visible(), "it is still to be made"
