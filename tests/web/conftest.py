"""One studio and one browser for all tests of its pages, and one studio for all that programs ask of it."""

import shutil
import warnings
from types import SimpleNamespace

import pytest
from browser import CHROMIUM
from studio_process import start_studio

TAG = """title = "Tag"
[movement]
smooth = 0.3  # a comment
[covariance]
axes = [1.8, 0.9]
angles = ["25deg", "75deg"]
[brush]
kind = "speed"
thin = 0.2
pace = 0.8
[jitter]
size = 0.02
"""


@pytest.fixture(scope="session")
def server(tmp_path_factory, small_hand_file):
    folder = tmp_path_factory.mktemp("studio")
    shutil.copy(small_hand_file, folder / "mine.hand")
    (folder / "tag.toml").write_text(TAG, encoding="utf-8")
    files = [str(folder / name) for name in ("mine.hand", "tag.toml")]
    process, link = start_studio(folder, *files)
    yield SimpleNamespace(link=link, folder=folder)
    process.terminate()
    process.wait()


@pytest.fixture(scope="session")
def playwright():
    """One for all: a second one in the same process is refused."""
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        yield playwright


@pytest.fixture(scope="session")
def browser(playwright):
    if CHROMIUM is None:
        pytest.skip("Chromium is not installed")
    browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def page(server, browser):
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(180_000)  # every wait is for an event: reached only where something is wrong
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


@pytest.fixture(scope="package")
def program(tmp_path_factory, small_hand_file):
    """A program with a key, where the user has no hands of his own, but one that was named on the command line."""
    pytest.importorskip("starlette")
    pytest.importorskip("httpx")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # httpx is deprecated there for a package that few have yet
        from starlette.testclient import TestClient

    from handout.web.server import application
    from handout.web.studio import Studio

    class Program(TestClient):
        def sent(self, name, data):
            return self.post(f"/api/uploads?name={name}", content=data).json()["id"]

    with pytest.MonkeyPatch.context() as patch:
        for kind in ("CONFIG", "STATE"):
            patch.setenv(f"XDG_{kind}_HOME", str(tmp_path_factory.mktemp(kind.lower())))
        studio = Studio({small_hand_file.stem: small_hand_file})
        with Program(application(studio, 7217), base_url="http://127.0.0.1:7217") as client:
            client.headers["Authorization"] = f"Bearer {studio.new_key()}"
            client.studio = studio
            client.choices = client.get("/api/choices").json()
            yield client
