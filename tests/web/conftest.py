"""One studio and one browser for all tests of its pages."""

import json
import os
import shutil
import subprocess
import sys
from types import SimpleNamespace

import pytest
from browser import CHROMIUM

TAG = 'title = "Tag"\n[movement]\nsmooth = 0.25  # a comment\n'


@pytest.fixture(scope="session")
def server(tmp_path_factory, small_hand_file):
    folder = tmp_path_factory.mktemp("studio")
    shutil.copy(small_hand_file, folder / "mine.hand")
    (folder / "tag.toml").write_text(TAG, encoding="utf-8")
    files = [str(folder / name) for name in ("mine.hand", "tag.toml")]
    command = [sys.executable, "-m", "handout", "studio", *files, "--no-browser", "--json"]
    homes = {f"XDG_{kind}_HOME": str(folder) for kind in ("CONFIG", "DATA", "STATE")}
    environment = {**os.environ, **homes}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    yield SimpleNamespace(link=json.loads(process.stdout.readline())["link"], folder=folder)
    process.terminate()
    process.wait()


@pytest.fixture(scope="session")
def page(server):
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(60_000)
        faults = []
        page.on("pageerror", lambda error: faults.append(str(error)))
        # a refusal that comes at once, and not as an event, is an error to Chromium: the tests below ask for some
        refused = "status of 422"
        page.on("console", lambda m: faults.append(m.text) if m.type == "error" and refused not in m.text else None)
        page.goto(server.link)
        page.wait_for_selector("nav a")
        page.arrived, page.home, page.folder = page.url, server.link.split("#")[0], server.folder
        yield page
        assert faults == []
        browser.close()
