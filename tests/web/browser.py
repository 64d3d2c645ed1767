"""What the tests of the studio's pages share: pictures of them, and axe-core."""

import os
import shutil
from pathlib import Path

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
SHOTS = os.environ.get("STUDIO_PICTURES")  # a folder that pictures of the pages are kept in


def kept(page, name, wait=9000):
    """A picture of the page, for the manual, once nothing more is waited for, or after so many ms."""
    if SHOTS:
        page.wait_for_timeout(wait)
        page.screenshot(path=str(Path(SHOTS) / f"studio-{name}.png"))


def axe(page):
    """What axe-core finds."""
    import axe_playwright_python

    session = page.context.new_cdp_session(page)
    session.send("Page.setBypassCSP", {"enabled": True})
    script = (Path(axe_playwright_python.__file__).parent / "axe.min.js").read_text(encoding="utf-8")
    session.send("Runtime.evaluate", {"expression": script})
    asked = {  # what it finds nothing wrong with need not be gathered
        "expression": "axe.run({resultTypes: ['violations']}).then(r => r.violations.map(v => v.id))",
        "awaitPromise": True,
        "returnByValue": True,
    }
    found = session.send("Runtime.evaluate", asked)
    session.send("Page.setBypassCSP", {"enabled": False})
    return found["result"]["value"]
