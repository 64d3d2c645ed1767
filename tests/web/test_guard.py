"""Who is not let in, by requests such as an attacker would send; no work is begun, so no process is started."""

import asyncio
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

pytest.importorskip("starlette")
pytest.importorskip("httpx")
with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # httpx is deprecated there for a package that few have yet
    from starlette.testclient import TestClient

from handout.web.guard import BODY, UPLOAD, Allowance, Guard
from handout.web.server import WAYS, application
from handout.web.studio import Studio
from handout.web.worker import Call
from handout.web.workers import Lane, LaneFull, Task

HOME = "http://127.0.0.1:7217"


class Visitor(TestClient):
    """A client with the key of a session, and the studio that it visits."""

    def __init__(self) -> None:
        self.studio = Studio()
        super().__init__(application(self.studio, 7217), base_url=HOME, raise_server_exceptions=False)
        self.key = {"Authorization": f"Bearer {self.studio.new_key()}"}


@pytest.fixture
def visitor():
    made = Visitor()
    yield made
    made.studio._folder.cleanup()


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1:80", "localhost:7217.evil.example", ""])
def test_a_name_that_was_made_to_lead_here_is_refused(visitor, host):
    answer = visitor.get("/", headers={"Host": host})
    assert answer.status_code == 403 and "127.0.0.1" in answer.json()["error"]


def test_both_names_of_this_computer_are_answered(visitor):
    assert visitor.get("/", headers={"Host": "localhost:7217"}).status_code == 200
    assert visitor.get("/").status_code == 200


@pytest.mark.parametrize("origin", ["https://evil.example", "null", "http://127.0.0.1:8000", "https://127.0.0.1:7217"])
def test_another_page_is_refused_even_with_a_key(visitor, origin):
    headers = {**visitor.key, "Origin": origin}
    assert visitor.post("/api/keys", headers=headers).status_code == 403
    assert visitor.post("/api/keys", headers={**visitor.key, "Sec-Fetch-Site": "cross-site"}).status_code == 403
    assert visitor.post("/api/keys", headers={**visitor.key, "Origin": HOME}).status_code == 200


def test_without_a_session_nothing_is_told_or_done(visitor, monkeypatch):
    monkeypatch.setattr(Allowance, "take", lambda self: True)  # there are many ways
    for way in WAYS:
        if way.path not in ("/api/session", "/api/openapi.json"):
            path = way.path.replace("{number:int}", "0").replace("{id}", "x").replace("{name}", "x")
            wrong = {"Authorization": "Bearer wrong"}
            assert visitor.request(way.method, path).status_code == 401, path
            assert visitor.request(way.method, path, headers=wrong).status_code == 401, path
            visitor.studio.__dict__.setdefault("seen", []).append(path)
    assert len(visitor.studio.seen) > 15 and not visitor.studio.tasks


def test_without_a_home_folder_there_is_no_draft(visitor, monkeypatch):
    def homeless(*_, **__):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr("platformdirs.user_state_dir", homeless)
    assert visitor.get("/api/drafts/draft", headers=visitor.key).json() == {"draft": None}


def test_the_link_is_good_once(visitor):
    token = visitor.studio.token
    assert visitor.post("/api/session", json={"token": token + "x"}).status_code == 401
    first = visitor.post("/api/session", json={"token": token})
    again = visitor.post("/api/session", json={"token": token})
    assert first.status_code == 200 and again.status_code == 401 and "used already" in again.json()["error"]
    headers = {"Authorization": f"Bearer {first.json()['key']}"}
    assert visitor.post("/api/keys", headers=headers).status_code == 200
    assert visitor.post("/api/session", json={"token": ""}).status_code == 401


def test_a_session_of_an_earlier_run_is_none(visitor):
    other = Visitor()
    assert visitor.post("/api/keys", headers=other.key).status_code == 401
    other.studio._folder.cleanup()


@pytest.mark.parametrize("name", ["../x", "..%2f..%2fetc", "/etc/passwd", "a/b", "me.hand", "x\n", "a" * 300, "\x00"])
def test_names_are_no_paths(visitor, name):
    for field in ("hand", "pen", "style", "device", "paper"):
        answer = visitor.post("/api/write", headers=visitor.key, json={"text": "a", field: name})
        assert answer.status_code == 422 and answer.json()["error"].startswith(field), field
    assert visitor.post("/api/hands", headers=visitor.key, json={"name": name, "scans": ["x" * 22]}).status_code == 422
    assert not visitor.studio.tasks
    draft = {"name": "x", "values": {}}
    for change in ({"name": name}, {"base": name}, {"values": {"brush.kind": {}}}):
        body = {"plan": {"targets": [[1, 2]]}, "style": {**draft, **change}}
        assert visitor.post("/api/movements", headers=visitor.key, json=body).status_code == 422
        assert visitor.post("/api/styles", headers=visitor.key, json={"style": {**draft, **change}}).status_code == 422
    for field in ("printer", "paper", "hand"):
        body = {"printer": "sim", field: name}
        assert visitor.post("/api/calibration/state", headers=visitor.key, json=body).status_code == 422, field
    assert not visitor.studio.tasks


def test_paths_do_not_lead_out_of_the_page_s_folder(visitor):
    for path in ("/../guard.py", "/%2e%2e/guard.py", "/..%2fguard.py", "/static/../../server.py", "//etc/passwd"):
        assert visitor.get(path).status_code == 404, path
    assert visitor.get("/api/hands/..%2f..%2fx/file", headers=visitor.key).status_code in (404, 422)
    assert visitor.get("/api/tasks/..%2fx/files/0", headers=visitor.key).status_code == 404


def test_an_upload_gets_a_name_of_the_server_s(visitor):
    answer = visitor.post("/api/uploads?name=../../evil/page.PNG", headers=visitor.key, content=b"x" * 100)
    assert answer.json()["name"] == "page.PNG" and answer.json()["bytes"] == 100
    (kept,) = visitor.studio.uploads.values()
    assert kept.path.is_relative_to(visitor.studio._folder.name) and kept.path.name == "page.png"
    assert visitor.delete(f"/api/uploads/{answer.json()['id']}", headers=visitor.key).status_code == 200
    assert not kept.path.exists() and not visitor.studio.uploads
    odd = visitor.post("/api/uploads", params={"name": "..\\a b/.-$(x)\n;'.tif"}, headers=visitor.key, content=b"x")
    (kept,) = visitor.studio.uploads.values()
    assert odd.status_code == 200 and kept.path.name == "x.tif"
    for name in ("page.exe", "", "png", "page.svg"):
        assert visitor.post(f"/api/uploads?name={name}", headers=visitor.key, content=b"x").status_code == 422
    answer = visitor.post("/api/uploads?name=guests.numbers", headers=visitor.key, content=b"x")
    assert answer.json()["error"].endswith("save the table as Excel (.xlsx) or CSV.")


def test_bodies_are_bounded_however_they_come(visitor):
    def parts():
        for _ in range(UPLOAD // (1 << 22) + 1):
            yield bytes(1 << 22)

    assert visitor.post("/api/write", headers=visitor.key, content=bytes(BODY + 1)).status_code == 413
    answer = visitor.post("/api/uploads?name=a.png", headers=visitor.key, content=parts())
    assert answer.status_code == 413 and not visitor.studio.uploads
    assert not list(visitor.studio.folder().parent.rglob("*.png"))


def test_uploads_together_are_bounded(visitor):
    for _ in range(40):
        assert visitor.post("/api/uploads?name=a.png", headers=visitor.key, content=b"x").status_code == 200
    assert visitor.post("/api/uploads?name=a.png", headers=visitor.key, content=b"x").status_code == 507


def test_odd_bodies_are_refused_in_a_sentence(visitor):
    for body in (
        b"",
        b"{",
        b"[]",
        b"\xff\xfe",
        b'{"text": 1}',
        b'{"text": "a", "more": 1}',
        b'{"text": "a", "dpi": 1e9}',
    ):
        answer = visitor.post("/api/write", headers=visitor.key, content=body)
        assert answer.status_code == 422 and answer.json()["error"].endswith("."), body
    assert visitor.post("/api/write", headers=visitor.key, content=b"[" * 100_000).status_code == 422


def test_what_is_refused_because_too_much_waits_leaves_no_folder(visitor, monkeypatch):
    def full(self, task):
        raise LaneFull

    monkeypatch.setattr(Lane, "add_task", full)
    before = set(Path(visitor.studio._folder.name).iterdir())
    assert visitor.post("/api/write", headers=visitor.key, json={"text": "a"}).status_code == 429
    assert set(Path(visitor.studio._folder.name).iterdir()) == before


def test_ten_thousand_requests_are_refused_and_the_user_is_not_locked_out():
    seconds = [0.0]
    allowance = Allowance(60, 0.5, clock=lambda: seconds[0])
    assert sum(allowance.take() for _ in range(10_000)) == 60
    seconds[0] = 60.0
    assert sum(allowance.take() for _ in range(10_000)) == 30
    served = []

    async def app(scope, receive, send):
        served.append(scope["path"])
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    guard, codes = Guard(app, 7217, lambda key: key == "good"), []

    async def knock(key, path="/api/write"):
        async def send(message):
            codes.append(message.get("status", 0))

        async def receive():
            return {"type": "http.request", "body": b""}

        headers = [(b"host", b"127.0.0.1:7217"), (b"authorization", b"Bearer " + key)]
        await guard({"type": "http", "path": path, "method": "POST", "headers": headers}, receive, send)

    async def attack():
        for _ in range(10_000):
            await knock(b"guess")
        await knock(b"good")
        for _ in range(300):  # a page that is loaded anew two dozen times
            await knock(b"", "/studio.js")

    with ThreadPoolExecutor(1) as other:  # beside the browser's tests this thread has a loop of its own
        other.submit(asyncio.run, attack()).result()
    assert codes.count(429) > 9_800 and served == ["/api/write", *["/studio.js"] * 300]


def test_answers_say_what_a_browser_may_do_with_them(visitor):
    for answer in (visitor.get("/"), visitor.get("/api/keys"), visitor.get("/", headers={"Host": "evil"})):
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy and "unsafe" not in policy and "frame-ancestors 'none'" in policy
        assert answer.headers["x-content-type-options"] == "nosniff" and answer.headers["cache-control"] == "no-store"
        assert "set-cookie" not in answer.headers and "access-control-allow-origin" not in answer.headers


def test_the_page_takes_nothing_from_the_net(visitor):
    from handout.web.server import _STATIC

    for path in _STATIC.iterdir():
        text = path.read_text(encoding="utf-8")
        assert "https://" not in text and "innerHTML" not in text and "eval(" not in text, path.name
        assert "http://" not in text.replace("http://www.w3.org/2000/svg", ""), path.name
        assert visitor.get(f"/{path.name}").status_code == 200


def test_what_is_not_there_and_what_is_not_done_there_are_told_apart(visitor):
    assert visitor.get("/api/nothing", headers=visitor.key).status_code == 404
    wrong = visitor.get("/api/write", headers=visitor.key)
    assert wrong.status_code == 405 and wrong.headers["allow"] == "POST" and "not done" in wrong.json()["error"]
    assert "text" in visitor.post("/api/write", headers=visitor.key).json()["error"], "of no body what is missing"


def test_every_route_is_described(visitor):
    described = visitor.get("/api/openapi.json").json()
    assert described["openapi"].startswith("3.1")
    operations = {(method.upper(), path) for path, ways in described["paths"].items() for method in ways}
    assert operations == {(way.method, way.path.replace(":int", "")) for way in WAYS}
    tasks = {
        path
        for path, ways in described["paths"].items()
        for way in ways.values()
        if "202" in way["responses"] and way["responses"]["200"]["content"]["application/json"]["schema"]
    }
    assert {"/api/write", "/api/batches/{name}/make", "/api/sheets", "/api/tasks/{id}"} <= tasks
    assert not tasks & {"/api/choices", "/api/batches", "/api/tasks/{id}/events"}
    told = described["components"]["schemas"]["Task"]
    task = Task("kind", Call("x"))
    task.change(said=["a"], error="b", facts={"c": 1}, live={"d": 1})
    assert set(task.snapshot()) == set(told["properties"]) and set(told["required"]) == set(
        Task("kind", Call("x")).snapshot()
    )
    schema = described["components"]["schemas"]["WritePage"]
    assert schema["required"] == ["text"] and schema["properties"]["dpi"]["maximum"] == 1200
    assert (
        described["paths"]["/api/write"]["post"]["security"]
        and "security" not in described["paths"]["/api/session"]["post"]
    )
