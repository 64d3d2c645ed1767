"""How soon the studio is seen in a browser: first paint of each page, its script, a key until the picture changes.

In Chromium, without a window: ms from the request until the first content is painted and kB of script that were
fetched, of each page that is opened anew; then, on Write, medians, ms, of a letter that is typed behind a card and
behind three pages, until the page that it belongs to is painted.  Pages are those that are typed on.
Needs playwright, and a Chromium that it finds.
"""

from __future__ import annotations

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

CARD = "Dear Ada,\n\nthank you for the jam: it is nearly finished, and we all hope for more.\n\nYours, Zoë"
PAGES = ("home", "write", "table", "own", "hands", "letters", "jobs", "calibration", "style")
HANDS = ("house-joined", "house-joined-ballpoint")  # drawn, scanned
TIMES = 7  # of which the median is taken, after one that is not counted
WAIT = 600_000  # ms, then something is wrong
# ms from a key until the picture that it leads to is painted: the second frame after it was put there
TYPED = """() => new Promise((done) => {
    const sheet = document.querySelector('.sheet'), text = document.querySelector('#text'), before = performance.now();
    new MutationObserver((_, watch) => {
        if (!sheet.dataset.shown || Number(sheet.dataset.shown) < before) return;
        watch.disconnect();
        requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now() - before)));
    }).observe(sheet, { attributes: true, attributeFilter: ['data-shown'] });
    text.value += 'a';
    text.dispatchEvent(new Event('input', { bubbles: true }));
})"""
LOADED = """() => performance.getEntriesByType('resource').filter((one) => one.name.endsWith('.js'))
    .reduce((sum, one) => sum + one.decodedBodySize, 0) / 1000"""
PAINTED = "() => performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? NaN"


def typed(page: Any, home: str, hand: str, text: str, sheet: str) -> float:
    """The median of a letter that is typed behind a text in a hand."""
    page.goto(f"{home}#write")
    page.reload()
    page.wait_for_selector(".sheet[data-shown]")
    page.locator("details.looks").evaluate("part => { part.open = true; }")
    page.get_by_label("Handwriting", exact=True).select_option(hand)
    page.get_by_label("Size", exact=True).select_option(sheet)
    page.locator("#text").fill(text)
    page.wait_for_timeout(1000)
    page.locator(".work").wait_for(state="hidden", timeout=WAIT)
    return float(statistics.median([page.evaluate(TYPED) for _ in range(TIMES + 1)][1:]))


def main() -> None:
    from playwright.sync_api import sync_playwright

    browser_file = shutil.which("chromium") or shutil.which("chromium-browser")
    three = "\n\n".join([" ".join([CARD.replace("\n", " ")] * 4)] * 5)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        homes = {f"XDG_{kind}_HOME": folder for kind in ("CONFIG", "DATA", "STATE")}
        command = [sys.executable, "-m", "handout", "studio", "--no-browser", "--json"]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, **homes})
        assert server.stdout is not None
        link = json.loads(server.stdout.readline())["link"]
        home = link.split("#")[0]
        try:
            browser = playwright.chromium.launch(executable_path=browser_file, args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.set_default_timeout(WAIT)
            page.goto(link)
            page.wait_for_selector("nav a")
            print(f"{'page':<34} {'paint, ms':>9} {'script, kB':>10}")
            for name in PAGES:
                page.goto(f"{home}#{name}")
                page.reload()
                page.locator("h1, .side").first.wait_for(state="attached")
                page.wait_for_load_state("networkidle")
                print(f"{name:<34} {page.evaluate(PAINTED):9.0f} {page.evaluate(LOADED):10.1f}", flush=True)
            size = sum(path.stat().st_size for path in (Path(__file__).parents[1] / "handout/web/static").glob("*.js"))
            print(f"{'all scripts':<34} {'':9} {size / 1000:10.1f}")
            for hand in HANDS:
                for called, text, sheet in (("a card", CARD, "A6"), ("three pages", three, "A5")):
                    print(f"{f'a key, {called}, {hand}':<34} {typed(page, home, hand, text, sheet):9.0f}", flush=True)
            browser.close()
        finally:
            server.terminate()
            server.wait()


if __name__ == "__main__":
    main()
