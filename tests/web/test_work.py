"""What the studio does for a program: texts and hands become files, in other processes, which may fail and be ended."""

import io
import struct
import time
import zlib

import pytest

pytestmark = pytest.mark.slow


def test_choices_name_what_requests_may_hold(program):
    hands = {hand["name"]: hand for hand in program.choices["hands"]}
    assert hands["house-joined"]["drawn"] and not hands["house-joined-ballpoint"]["own"]
    assert hands["small"]["own"] and not hands["small"]["removable"]
    assert "ballpoint" in program.choices["pens"] and "A6" in program.choices["pages"]
    assert any(plotter["name"] == "plotter-grbl-servo" for plotter in program.choices["plotters"])


def test_a_text_becomes_the_file_that_the_library_makes(program, tmp_path):
    from handout.pipeline.options import SheetOptions, WritingOptions
    from handout.pipeline.writing import write

    asked = {"text": "Dear Ada", "page": "A6", "seed": 4}
    done = program.post("/api/write", json=asked).json()
    assert done["state"] == "done" and done["facts"]["seed"] == 4 and done["facts"]["files"] == ["page.svg"]
    got = program.get(f"/api/tasks/{done['id']}/files/0")
    write("Dear Ada", [tmp_path / "same.svg"], WritingOptions(seed=4), SheetOptions("A6"))
    assert got.content == (tmp_path / "same.svg").read_bytes()
    assert got.headers["content-type"] == "image/svg+xml" and "attachment" in got.headers["content-disposition"]
    assert program.get(f"/api/tasks/{done['id']}/files/1").status_code == 404


def test_a_word_is_found_and_written_again(program):
    asked = {"text": "Dear Ada", "page": "A6", "seed": 4}
    (dear, ada) = program.post("/api/write", json=asked).json()["facts"]["words"]
    assert (dear["word"], dear["at"], ada["word"], ada["at"]) == ("Dear", 0, "Ada", 5) and dear["box"][2] < ada["box"][
        2
    ]
    again = program.post("/api/write", json={**asked, "rewritten": [[5, 1]]}).json()["facts"]["words"]
    assert again[0] == dear and again[1]["box"] != ada["box"]
    assert program.post("/api/write", json={**asked, "rewritten": [[5, 0]]}).status_code == 422


def test_who_accepts_the_format_gets_the_file_itself(program):
    asked = {"text": "Dear Ada", "page": "A6", "seed": 4, "format": "pdf"}
    assert program.post("/api/write", json=asked, headers={"Accept": "application/pdf"}).content.startswith(b"%PDF")


def test_events_tell_how_far_it_has_come(program):
    asked = {"text": "even hens jumped", "hand": "small", "page": "A6", "format": "png", "dpi": 100, "seed": 1}
    begun = program.post("/api/write", json={**asked, "fallback": True}, headers={"Prefer": "respond-async"})
    assert begun.status_code == 202
    stream = program.get(f"/api/tasks/{begun.json()['id']}/events").text
    assert stream.startswith("data: {") and '"state": "done"' in stream and stream.count("data: ") > 2


def test_the_pipeline_s_own_sentence_is_told(program):
    answer = program.post("/api/write", json={"text": "Ж", "hand": "house-print", "page": "A6"})
    assert answer.status_code == 422 and "Ж" in answer.json()["error"]
    answer = program.post("/api/write", json={"text": "a " * 2000, "page": "A6", "pages": 1})
    assert answer.status_code == 422 and "page" in answer.json()["error"]


def test_cancelled_work_ends_and_the_next_is_done(program):
    asked = {"text": "an even line of ten " * 60, "hand": "small", "page": "A4", "format": "png", "fallback": True}
    begun = program.post("/api/write", json=asked, headers={"Prefer": "respond-async"}).json()
    assert program.delete(f"/api/tasks/{begun['id']}").json()["state"] == "cancelled"
    begin = time.monotonic()
    assert program.post("/api/write", json={**asked, "text": "ten hens", "page": "A6"}).status_code == 200
    assert time.monotonic() - begin < 60  # it did not wait for the other text


def test_a_process_that_dies_takes_only_its_work_along(program):
    from handout.web.worker import Call

    task = program.studio.begin(program.studio.quick, "dying", Call("writing.os._exit"))
    del task
    asked = {"text": "still here", "page": "A6"}
    process = program.studio.quick._processes[0]._process
    process.kill()
    codes = [program.post("/api/write", json=asked).status_code for _ in range(3)]
    assert codes[-1] == 200


def bomb():
    """A PNG of 60,000 × 60,000 pixels in some kilobytes."""

    def part(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = struct.pack(">IIBBBBB", 60_000, 60_000, 1, 0, 0, 0, 0)
    packed = zlib.compress(bytes(7501) * 600, 9)
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", packed) + part(b"IEND", b"")


@pytest.mark.parametrize("name", ["bomb.png", "noise.jpg", "zip.hand", "empty.pdf"])
def test_bombs_and_rubbish_are_refused_in_a_sentence(program, name):
    data = {
        "bomb.png": bomb(),
        "noise.jpg": bytes(range(256)) * 40,
        "zip.hand": b"PK\x03\x04" + bytes(500),
        "empty.pdf": b"",
    }
    upload = program.sent(name, data[name])
    if name.endswith(".hand"):
        answer = program.post("/api/hands/given", json={"name": "rubbish", "upload": upload})
    else:
        answer = program.post("/api/hands", json={"name": "rubbish", "scans": [upload], "texts": ["some text"]})
    assert answer.status_code == 422 and answer.json()["error"].endswith((".", "?")), answer.json()
    assert "rubbish" not in {hand["name"] for hand in program.get("/api/choices").json()["hands"]}


def test_a_hand_is_given_shown_and_deleted(program, small_hand_file):
    upload = program.sent("mine.hand", small_hand_file.read_bytes())
    assert program.post("/api/hands/given", json={"name": "mine", "upload": upload}).json() == {"name": "mine"}
    again = program.post("/api/hands/given", json={"name": "mine", "upload": upload})
    assert again.status_code == 422 and "already" in again.json()["error"]
    sheet = program.get("/api/hands/mine/sheet", headers={"Accept": "image/png"})
    assert sheet.content.startswith(b"\x89PNG")
    lacks = program.post("/api/hands/mine/lacks", json={"text": "even Q"}).json()
    assert [way["letter"] for way in lacks["supply"]] == ["Q"]
    assert program.get("/api/hands/mine/file").content == small_hand_file.read_bytes()
    assert b"scan.webp" not in program.get("/api/hands/mine/file?ink_only=true").content
    assert program.delete("/api/hands/mine").status_code == 200
    assert program.delete("/api/hands/house-joined-ballpoint").status_code == 422


def test_sheets_are_made(program):
    answer = program.post("/api/sheets", json={"pages": 1}, headers={"Accept": "application/pdf"})
    assert io.BytesIO(answer.content).read(4) == b"%PDF"


def test_the_ink_of_a_word_is_found_on_its_line(small_hand):
    from handout.pipeline.options import SheetOptions, WritingOptions
    from handout.pipeline.texts import TextDocument, prepare, word_box

    task = prepare(WritingOptions(small_hand, 1), SheetOptions("90x50mm", "5mm"))
    _, sheets = TextDocument("ten hens", task).set()
    (line,) = next(iter(sheets)).manuscript.lines
    ten, hens = word_box(line, "ten"), word_box(line, "hens")
    assert 4 < ten[0] < ten[2] < hens[0] < hens[2] < 86 and ten[1] < line.baseline <= ten[3] + 1
    assert word_box(line, "fox") is None
