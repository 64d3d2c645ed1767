"""A day's letters sent by a program: `examples/send_daily.py` against a studio of its own, twice, and unheard."""

import json
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from studio_process import start_studio

pytestmark = pytest.mark.slow
EXAMPLE = Path(__file__).parents[2] / "examples" / "send_daily.py"
ORDERS = "First name,City\nAda,Ulm\nZoë,Bonn\n,Kiel\nBob,Trier\n"


@pytest.fixture(scope="module")
def example():
    from importlib.util import module_from_spec, spec_from_file_location

    spec = spec_from_file_location("send_daily", EXAMPLE)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def shop(tmp_path_factory):
    """A folder with a table, and a studio with a key there; `studio` starts it."""
    folder = tmp_path_factory.mktemp("shop")
    (folder / "orders.csv").write_text(ORDERS, encoding="utf-8")
    process, link = start_studio(folder, "--key-file", str(folder / "studio.key"))
    address = link.split("/#")[0]
    yield folder, address
    process.terminate()
    process.wait()


@pytest.fixture
def studio(example, shop):
    folder, address = shop
    return example.Studio(address, (folder / "studio.key").read_text().strip())


def test_a_test_sends_nothing_and_a_day_is_sent_once(shop):
    folder, address = shop
    command = [sys.executable, str(EXAMPLE), "orders.csv", "--day", "2026-03-01", "--studio", address]
    with socket.create_server(("127.0.0.1", 0)) as free:
        command += ["--port", str(free.getsockname()[1])]

    def run(*more):
        done = subprocess.run([*command, *more], cwd=folder, capture_output=True, text=True, check=True)
        return done.stdout

    assert '"tested": 3' in run("--test") and not list(folder.rglob("batch.pdf"))
    first = run()
    assert 'Orders of 2026-03-01: done; {"done": 3, "cannot be made": 1}' in first
    assert "row 4 (Kiel): cannot be made; line 1 of the letter: 'first_name' is empty" in first
    made = {path: path.stat().st_mtime_ns for path in folder.rglob("batch.pdf")}
    assert run() == first and made == {path: path.stat().st_mtime_ns for path in folder.rglob("batch.pdf")}
    assert (folder / "webhook.secret").stat().st_mode & 0o077 == 0


def test_a_key_is_of_one_batch_whoever_asks_at_the_same_time(studio, shop):
    upload = studio.ask("POST", "/api/uploads?name=orders.csv", (shop[0] / "orders.csv").read_bytes())["id"]
    body = {"table": upload, "text": "Hi {{ first_name }}", "page": "A6", "key": "both"}
    names = []
    asking = [threading.Thread(target=lambda: names.append(studio.ask("POST", "/api/batches", body))) for _ in range(4)]
    for one in asking:
        one.start()
    for one in asking:
        one.join()
    assert len(names) == 4 and len({each["batch"] for each in names}) == 1
    with pytest.raises(RuntimeError, match=r"The key both is that of the batch .* asked otherwise"):
        studio.ask("POST", "/api/batches", {**body, "text": "Ho"})


@pytest.mark.parametrize(
    "url",
    [
        "http://example.org/",
        "http://127.0.0.1.example.org/",
        "file:///etc/passwd",
        "http://me@localhost/",
        "http://[",
        "x",
    ],
)
def test_webhooks_lead_to_this_computer_alone(studio, url):
    body = {"text": "Hi", "page": "A6", "webhook": {"url": url, "secret": "s" * 16}}
    with pytest.raises(RuntimeError, match=r"^webhook: .*(is not this computer|no address|no http address)"):
        studio.ask("POST", "/api/batches", body)


def test_an_end_that_nobody_hears_is_told_again_and_what_is_not_signed_is_not_believed(example, studio):
    with example.Ear("s" * 20) as ear:
        webhook = {"url": ear.address, "secret": "another secret of this shop"}
        asked = {"text": "Hi", "page": "A6", "to": "pdf", "webhook": webhook, "test": True}
        batch = studio.ask("POST", "/api/batches", asked)
        one = f"/api/batches/{batch['batch']}"
        assert "secret" not in json.dumps(batch), "what signs is told to nobody"
        studio.ask("POST", f"{one}/proof")
        studio.ask("POST", f"{one}/approval")
        studio.ask("POST", f"{one}/make", {})
        ear.handle_request()  # signed by somebody else
        while not (told := studio.ask("GET", one)["webhook"]).get("why"):
            time.sleep(0.05)
        assert "did not hear it: HTTP Error 403" in told["why"] and not ear.news
        ear.secret = webhook["secret"]
        while not ear.news:
            ear.handle_request()
        (news,) = ear.news.values()
        assert (news["batch"], news["state"], news["states"]) == (batch["batch"], "done", {"tested": 1})
        while studio.ask("GET", one)["webhook"]["why"]:
            time.sleep(0.05)
        assert not ear.believes(b"{}", f"t={int(time.time()) - 999},v1=0")
