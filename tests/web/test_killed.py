"""A studio that is killed with kill −9 in the middle of its work: what was kept is there, nothing is made twice."""

import json
import signal
import subprocess
import time
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from types import SimpleNamespace

import pytest
from studio_process import start_studio

pytestmark = pytest.mark.slow
PEOPLE = "First name\n" + "".join(f"Name{number}\n" for number in range(8))


@pytest.fixture
def studio(tmp_path):
    """Starts studios in one home, one after the other; `kill` ends the last as the kernel would."""
    httpx = pytest.importorskip("httpx")
    state = SimpleNamespace(process=None)

    def start():
        state.process, link = start_studio(tmp_path, "--key-file", str(tmp_path / "key"))
        key = (tmp_path / "key").read_text().strip()
        state.client = httpx.Client(
            base_url=link.split("/#")[0], headers={"Authorization": f"Bearer {key}"}, timeout=300
        )
        return state.client

    def kill(ended=True):
        workers = subprocess.run(["pgrep", "-P", str(state.process.pid)], capture_output=True, text=True).stdout.split()
        state.process.send_signal(signal.SIGKILL)
        state.process.wait()
        end = time.monotonic() + 60
        while any(Path(f"/proc/{worker}").exists() for worker in workers) and time.monotonic() < end:
            time.sleep(0.05)  # they end by themselves, once they see that it is gone
        assert not any(Path(f"/proc/{worker}").exists() for worker in workers), "no process outlives its server"

    yield SimpleNamespace(start=start, kill=kill, home=tmp_path)
    state.process.terminate()
    state.process.wait()


def until(client, task, right):
    while not right(snapshot := client.get(f"/api/tasks/{task}").json()):
        assert snapshot["state"] in ("waiting", "running"), snapshot
        time.sleep(0.02)


def begun(client, path, body=None):
    return client.post(path, json=body, headers={"Prefer": "respond-async"}).json()["id"]


def test_a_proof_and_a_plot_go_on_where_they_were(studio):
    client = studio.start()
    table = client.post("/api/uploads?name=people.csv&kept=true", content=PEOPLE.encode()).json()["id"]
    client.post("/api/uploads?name=others.csv", content=PEOPLE.encode())
    asked = {"table": table, "text": "Hi {{ first_name }}", "page": "74x105mm", "to": "plotter", "seed": 4,
             "device": "plotter-simulated", "key": "one"}  # fmt: skip
    one = f"/api/batches/{client.post('/api/batches', json=asked).json()['batch']}"
    until(client, begun(client, f"{one}/proof"), lambda snapshot: snapshot["share"] > 0.2)
    studio.kill()
    client = studio.start()
    assert client.get(one).json()["state"] == "new", "half a proof is none"
    assert client.get("/api/uploads").json()["uploads"] == [{"id": table, "name": "people.csv"}]
    assert client.get(f"/api/uploads/{table}").content == PEOPLE.encode()
    tried = client.post("/api/batches/tried", json={"table": table, "text": "Hi {{ first_name }}"}).json()
    assert tried["count"] == 8 and client.delete(f"/api/uploads/{table}").status_code == 200
    assert not list(studio.home.rglob("studio-files/*")), "and it is gone when it is taken away"
    proof = client.post(f"{one}/proof").json()["facts"]["proof"]
    assert (
        proof["rows"] == 8
        and client.post(f"{one}/approval", json={"made": proof["made"]}).json()["state"] == "approved"
    )
    begun(client, f"{one}/make", {"port": "sim:?realtime=1"})
    while client.get(one).json()["states"].get("done", 0) < 1:
        time.sleep(0.1)
    studio.kill()
    client = studio.start()
    left = client.get(one).json()
    assert left["state"] == "broken off" and 1 <= left["states"]["done"] < 8
    done = client.post(f"{one}/make", json={"port": "sim:"}).json()["facts"]
    assert done["state"] == "done" and done["states"] == {"done": 8}
    plots = client.get("/api/plots").json()["plots"]
    assert len(plots) == 8 and all(plot["finished"] for plot in plots), "each page is one plot, and none is drawn twice"


def test_a_page_that_was_being_read_is_no_half_a_hand(studio, small_scan):
    client = studio.start()
    scan = client.post("/api/uploads?name=page.png", content=small_scan.scan.read_bytes()).json()["id"]
    asked = {"name": "ours", "scans": [scan], "texts": [small_scan.text.read_text(encoding="utf-8")]}
    client.put("/api/drafts/texts", json={"draft": {"texts": {"page.png": asked["texts"][0]}}})
    until(client, begun(client, "/api/hands", asked), lambda snapshot: snapshot["share"] > 0.1)
    studio.kill()
    client = studio.start()
    assert not [path for path in studio.home.rglob("*ours*") if path.is_file()], "it is read whole or not at all"
    assert client.get("/api/drafts/texts").json()["draft"]["texts"] == {"page.png": asked["texts"][0]}, "what was typed"
    asked["scans"] = [client.post("/api/uploads?name=page.png", content=small_scan.scan.read_bytes()).json()["id"]]
    assert client.post("/api/hands", json=asked).status_code == 200
    assert "ours" in [hand["name"] for hand in client.get("/api/choices").json()["hands"]]


def test_an_end_that_was_not_told_is_told_by_the_next_studio(studio):
    heard, news = HTTPServer(("127.0.0.1", 0), BaseHTTPRequestHandler), []
    webhook = {"url": f"http://127.0.0.1:{heard.server_port}/", "secret": "s" * 16}
    client = studio.start()
    asked = {"text": "Hi", "page": "74x105mm", "seed": 4, "test": True, "webhook": webhook}
    one = f"/api/batches/{client.post('/api/batches', json=asked).json()['batch']}"
    client.post(f"{one}/proof")
    client.post(f"{one}/approval")
    client.post(f"{one}/make", json={})
    studio.kill()  # while nobody answers there

    class Hears(BaseHTTPRequestHandler):
        def do_POST(self):
            news.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()

    heard.RequestHandlerClass = Hears
    heard.socket.close()
    with HTTPServer(heard.server_address, Hears) as heard:
        client = studio.start()
        heard.handle_request()
        assert (news[0]["state"], news[0]["test"], news[0]["states"]) == ("done", True, {"tested": 1})
        while client.get(one).json()["webhook"].get("why") != "":
            time.sleep(0.05)
    studio.kill()
    studio.start().close()
    assert len(news) == 1


def test_corrections_that_were_answered_are_made_once_whenever_the_studio_is_killed(studio, small_hand_file):
    client = studio.start()
    given = client.post("/api/uploads?name=mine.hand", content=small_hand_file.read_bytes()).json()["id"]
    assert client.post("/api/hands/given", json={"name": "mine", "upload": given}).status_code == 200
    for told in range(1, 4):
        state = client.get("/api/hands/mine/letters").json()
        assert state["made"] == told - 1, "no more than were made"
        letters = client.get("/api/hands/mine/letters/0").json()["letters"]
        assert [one["verdict"] == "confirmed" for one in letters[2:6]] == [place < told - 1 for place in range(4)]
        body = {
            "revision": state["revision"],
            "corrections": [{"do": "confirm", "page": 0, "at": letters[1 + told]["spot"]}],
        }
        assert client.post("/api/hands/mine/corrections", json={**body, "later": True}).status_code == 200
        if told == 2:
            time.sleep(3)  # its file is being written about now, or has been
        studio.kill()
        client = studio.start()
    assert client.get("/api/hands/mine/letters").json()["made"] == 3
    found = client.post("/api/hands/mine/check").status_code
    assert found == 200, "its file has what was waiting, and is whole"
    back = client.get("/api/hands/mine/letters").json()
    undone = client.post("/api/hands/mine/history", json={"revision": back["revision"], "back": 3}).json()
    assert (undone["made"], undone["entries"]) == (0, 3)
