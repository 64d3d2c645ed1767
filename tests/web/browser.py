"""What the tests of the studio's pages share: pictures of them, and axe-core."""

import os
import shutil
from pathlib import Path

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
SHOTS = os.environ.get("STUDIO_PICTURES")  # a folder that pictures of the pages are kept in


def axe(page):
    """What axe-core finds."""
    import axe_playwright_python

    session = page.context.new_cdp_session(page)
    session.send("Page.setBypassCSP", {"enabled": True})
    known = session.send("Runtime.evaluate", {"expression": "'axe' in window"})
    if not known["result"]["value"]:  # the studio's pages are one document
        script = (Path(axe_playwright_python.__file__).parent / "axe.min.js").read_text(encoding="utf-8")
        session.send("Runtime.evaluate", {"expression": script})
    asked = {  # what it finds nothing wrong with need not be gathered
        "expression": "axe.run({resultTypes: ['violations']}).then(r => r.violations.map(v => v.id))",
        "awaitPromise": True,
        "returnByValue": True,
    }
    found = session.send("Runtime.evaluate", asked)
    session.send("Page.setBypassCSP", {"enabled": False})
    session.detach()
    return found["result"]["value"]


COUNTER = """() => {
    window.gestures = 0;
    const counted = {click: one => !one.closest('label'), change: one => !['checkbox', 'radio'].includes(one.type)};
    for (const kind in counted) document.addEventListener(kind, event => {
        if (counted[kind](event.target)) window.gestures += 1;
    }, true);
}"""


def count_gestures(page):
    """Count presses, fields that are typed in or chosen, and files, until the page is loaded anew."""
    page.evaluate(COUNTER)
    return lambda: page.evaluate("window.gestures")
