"""Photographs from a phone: an emulated one in Chromium, and whoever else is in its network."""

import http.client
import json
import socket
from io import BytesIO
from types import SimpleNamespace
from urllib.parse import urlsplit

import numpy as np
import pytest
from browser import axe
from PIL import Image
from studio_process import start_studio

pytestmark = pytest.mark.slow


def photograph(seed=1, size=(900, 600)):
    """A JPEG of coarse noise."""
    coarse = np.random.default_rng(seed).integers(0, 255, (6, 9, 3), dtype=np.uint8)
    Image.fromarray(coarse).resize(size).save(made := BytesIO(), "JPEG")
    return made.getvalue()


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    """A studio that was started for phones: its link, theirs, and what a program may ask of it."""
    httpx = pytest.importorskip("httpx")
    folder = tmp_path_factory.mktemp("phone")
    process, link, told = start_studio(folder, "--phone", "--key-file", str(folder / "key"), more=True)
    headers = {"Authorization": f"Bearer {(folder / 'key').read_text().strip()}"}
    client = httpx.Client(base_url=link.split("/#")[0], headers=headers, timeout=60)
    yield SimpleNamespace(link=link, phone=told["phone"], client=client)
    client.close()
    process.terminate()
    process.wait()


def ask(studio, method, path, body=None, key=True, **headers):
    """The status, headers and JSON or bytes that the phone's server answers; `path` follows the key."""
    parts = urlsplit(studio.phone)
    asked = http.client.HTTPConnection(parts.hostname, parts.port, timeout=30)
    whole = f"{parts.path if key else '/'}{path}"
    asked.putrequest(method, whole, skip_host="Host" in headers)
    for name, value in headers.items():
        asked.putheader(name.replace("_", "-"), value)
    if body is not None and "Content_Length" not in headers:
        asked.putheader("Content-Length", str(len(body)))
    asked.endheaders(body)
    answer = asked.getresponse()
    data = answer.read()
    asked.close()
    return answer.status, dict(answer.getheaders()), json.loads(data) if data[:1] == b"{" else data


def there(studio):
    return [one["name"] for one in studio.client.get("/api/phone").json()["task"]["live"]["photographs"]]


@pytest.fixture
def taken_away(studio):
    """What a test sent is taken away."""
    yield
    for one in studio.client.get("/api/phone").json()["task"]["live"]["photographs"]:
        studio.client.delete(f"/api/uploads/{one['id']}")
    assert there(studio) == []


def test_a_phone_sees_one_page_and_no_other_of_the_studio(studio):
    status, headers, page = ask(studio, "GET", "")
    assert status == 200 and b"phone.js" in page
    assert "default-src 'none'" in headers["content-security-policy"] and headers["cache-control"] == "no-store"
    assert headers["referrer-policy"] == "no-referrer", "its key goes nowhere else"
    for name in ("phone.js", "dom.js", "studio.css", "icon.svg"):
        assert ask(studio, "GET", name)[0] == 200
    closed = ["index.html", "own.js", "api.js", "api/choices", "../index.html", "%2e%2e/index.html", "..%2findex.html"]
    closed += ["photographs/..", "//etc/passwd", "%2e%2e%2f%2e%2e%2fserver.py", "..\\server.py", "phone.js/", "%7f"]
    for path in closed:
        assert ask(studio, "GET", path)[0] in (400, 404), path
    for path in ("", "index.html", "api/choices", "api/session", "api/uploads", "api/openapi.json", "api/phone"):
        for method in ("GET", "POST", "DELETE"):
            status, _, told = ask(studio, method, path, key=False)
            assert (status, told) == (404, {"error": "There is nothing here."}), (method, path)
    for method in ("DELETE", "PUT", "POST"):
        assert ask(studio, method, "", b"")[0] == 405
    assert ask(studio, "GET", "photographs")[0] in (404, 405), "what was sent is not given back"


def test_a_guessed_key_a_foreign_host_and_another_page_are_told_nothing(studio, taken_away):
    key = urlsplit(studio.phone).path.strip("/")
    assert len(key) == 22 and key not in studio.link
    host = urlsplit(studio.phone).netloc
    for headers in ({"Host": "evil.example"}, {"Host": f"{host}.evil.example"}, {"Host": "127.0.0.1"},
                    {"Origin": "https://evil.example"}, {"Origin": "null"}, {"Origin": f"https://{host}"}):  # fmt: skip
        assert ask(studio, "GET", "", **headers)[0] == 404, headers
        assert ask(studio, "POST", "photographs?name=a.jpg", photograph(), **headers)[0] == 404, headers
    guesses = [key[:-1], f"{key}x", key.swapcase(), "%c3%a9", "", "%00", key[::-1]]
    answers = [ask(studio, "GET", f"{guess}/", key=False) for guess in guesses]
    assert {(status, told["error"]) for status, _, told in answers} == {(404, "There is nothing here.")}
    many = [ask(studio, "GET", f"{number}/", key=False)[0] for number in range(90)]
    assert many[-1] == 429 and ask(studio, "GET", "")[0] == 200, "who guesses is slowed, the phone is not locked out"
    assert there(studio) == []
    with socket.socket() as other:  # at no other address of this computer
        assert other.connect_ex(("127.0.0.1", urlsplit(studio.phone).port)) != 0 or host.startswith("127.")


def test_what_is_no_photograph_is_refused_in_a_sentence_and_not_kept(studio):
    status, _, told = ask(studio, "POST", "photographs?name=IMG_1.HEIC", b"\0\0\0\x18ftypheic" + bytes(40))
    assert status == 422 and "HEIC" in told["error"] and "Most Compatible" in told["error"]
    for name, data in (("a.hand", b"PK"), ("a.csv", b"a"), ("..%2f..%2fa.sh", b"#!"), ("", b"")):
        status, _, told = ask(studio, "POST", f"photographs?name={name}", data)
        assert status == 422 and "taken are those that end in" in told["error"], name
    for data in (b"", b"rubbish", photograph()[:4000]):
        status, _, told = ask(studio, "POST", "photographs?name=..%2f..%2fa.jpg", data)
        assert status == 422 and told["error"].startswith("Cannot read a.jpg"), told
    with pytest.raises(OSError):  # it is cut off while it comes
        assert ask(studio, "POST", "photographs?name=a.jpg", bytes(80 << 20))[0] == 413
        raise ConnectionError("it was refused before it was cut off")
    parts = urlsplit(studio.phone)
    with socket.create_connection((parts.hostname, parts.port)) as broken:
        head = (
            f"POST {parts.path}photographs?name=b.jpg HTTP/1.1\r\nHost: {parts.netloc}\r\nContent-Length: 90000\r\n\r\n"
        )
        broken.sendall(head.encode() + photograph()[:3000])
    assert there(studio) == [], "what breaks off on its way is not there"


def test_photographs_of_one_name_are_told_apart_and_none_is_there_twice(studio, taken_away):
    for seed, name, again in ((1, "image.jpg", False), (2, "image-2.jpg", False), (1, "image.jpg", True)):
        status, _, told = ask(studio, "POST", "photographs?name=image.jpg", photograph(seed))
        assert (status, told) == (200, {"name": name, "again": again})
    assert there(studio) == ["image.jpg", "image-2.jpg"]
    for number in range(18):
        assert ask(studio, "POST", f"photographs?name={number}.jpg", photograph(number + 5, (60, 40)))[0] == 200
    status, _, told = ask(studio, "POST", "photographs?name=one-more.jpg", photograph(3))
    assert status == 409 and "20 photographs" in told["error"]


def test_a_phone_takes_photographs_which_are_on_the_computer_s_page_at_once(
    studio, small_scan, tmp_path, playwright, browser
):
    desk = browser.new_page(viewport={"width": 1280, "height": 800})
    desk.goto(studio.link)
    code = desk.get_by_role("img", name="A code for the camera of a phone")
    code.wait_for()
    assert studio.phone in code.get_attribute("aria-label") and axe(desk) == []
    read = code.screenshot(path=str(tmp_path / "code.png"))
    import cv2

    assert cv2.QRCodeDetector().detectAndDecode(cv2.imdecode(np.frombuffer(read, np.uint8), 1))[0] == studio.phone
    one = browser.new_context(**playwright.devices["iPhone 13"]).new_page()
    faults = []
    one.on("pageerror", lambda error: faults.append(str(error)))
    one.goto(studio.phone)
    scan = str(small_scan.scan)
    (tmp_path / "noise.jpg").write_bytes(photograph(4))
    (tmp_path / "photo.heic").write_bytes(b"\0\0\0\x18ftypheic" + bytes(40))
    one.get_by_label("Take a photograph").set_input_files(str(tmp_path / "noise.jpg"))
    one.get_by_label("Choose photographs").set_input_files([scan, str(tmp_path / "photo.heic")])
    one.get_by_text("It is on the computer.").nth(1).wait_for()
    one.get_by_text("Most Compatible").wait_for()
    assert axe(one) == [] and faults == []
    for label in ("Take a photograph", "Choose photographs"):
        assert one.get_by_label(label).bounding_box()["height"] >= 44
    desk.get_by_role("img", name="The photograph noise.jpg").wait_for()
    desk.get_by_text("One phone has opened the page. 2 photographs came.").wait_for()
    desk.reload()  # what came is there still
    desk.get_by_role("button", name="Take noise.jpg away").click()
    desk.get_by_role("img", name="The photograph noise.jpg").wait_for(state="detached")
    desk.get_by_text("Not one of our sheets?").click()
    desk.get_by_label("What is written on it").fill(small_scan.text.read_text(encoding="utf-8"))
    desk.get_by_label("What shall it be called?").fill("phoned")
    desk.get_by_role("button", name="Read my handwriting").click()
    desk.locator(".found-pages img").wait_for(timeout=180_000)
    desk.get_by_role("button", name="Photograph", exact=True).click()
    desk.get_by_role("button", name="Switch it off").click()
    desk.get_by_role("button", name="Photograph with your phone").wait_for()
    one.get_by_role("button", name="Send photo.heic again").click()
    one.get_by_text("it was switched off there").wait_for()
    one.close()
    desk.close()
    assert there(studio) == [], "what was read is not kept beside its hand"
    with pytest.raises(OSError):
        ask(studio, "GET", "")
    before, studio.phone = studio.phone, studio.client.post("/api/phone").json()["task"]["live"]["link"]
    assert urlsplit(before).path != urlsplit(studio.phone).path and ask(studio, "GET", "")[0] == 200
    studio.phone, now = before, studio.phone
    assert urlsplit(now).port != urlsplit(before).port or ask(studio, "GET", "")[0] == 404, "the old key opens nothing"
