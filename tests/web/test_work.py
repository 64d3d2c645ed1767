"""What the studio does for a program: texts and hands become files, in other processes, which may fail and be ended."""

import io
import os
import re
import struct
import tempfile
import time
import zipfile
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


def test_a_line_in_a_scanned_hand_is_written_anew_when_its_file_is_another(program):
    def sample():
        return program.get("/api/hands/small/sample").json()["id"]

    first = sample()
    assert sample() == first
    path = program.studio.hands["small"]
    os.utime(path, ns=(path.stat().st_atime_ns, path.stat().st_mtime_ns + 1))
    assert sample() != first


def test_events_tell_how_far_it_has_come(program):
    asked = {"text": "even hens jumped", "hand": "small", "page": "A6", "format": "png", "dpi": 100, "seed": 1}
    begun = program.post("/api/write", json={**asked, "fallback": True}, headers={"Prefer": "respond-async"})
    assert begun.status_code == 202
    stream = program.get(f"/api/tasks/{begun.json()['id']}/events").text
    assert stream.startswith("data: {") and '"state": "done"' in stream and stream.count("data: ") > 2


def test_the_pipeline_s_own_sentence_is_told(program):
    answer = program.post("/api/write", json={"text": "Ժ", "hand": "house-print", "page": "A6"})
    assert answer.status_code == 422 and "Ժ" in answer.json()["error"]
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
    _, sheets = TextDocument("ten hens", task).set_pages()
    (line,) = next(iter(sheets)).manuscript.lines
    ten, hens = word_box(line, "ten"), word_box(line, "hens")
    assert 4 < ten[0] < ten[2] < hens[0] < hens[2] < 86 and ten[1] < line.baseline <= ten[3] + 1
    assert word_box(line, "fox") is None


def _bomb(name):
    """A small file that unpacks to far more than is taken."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as package:
        package.writestr(name, b"")
        package.writestr("xl/worksheets/sheet1.xml", bytes(201_000_000))
    return stream.getvalue()


def test_no_refusal_of_a_broken_upload_tells_a_path_of_the_server(program, small_hand_file, monkeypatch, tmp_path):
    """What is copied into the user's own folders before it is read, too."""
    monkeypatch.setattr(tempfile, "tempdir", str(program.studio.folder().parent))  # own folders of tests lie elsewhere
    hand = small_hand_file.read_bytes()
    kinds = {
        "empty": b"",
        "noise": bytes(range(256)) * 8,
        "cut": hand[: len(hand) // 2],
        "bomb": _bomb("xl/workbook.xml"),
    }
    seen = []
    for kind, data in kinds.items():
        for suffix in (".png", ".tif", ".pdf", ".hand", ".csv", ".xlsx"):
            upload = program.sent(f"my-{kind}{suffix}", data)
            if suffix == ".hand":
                answer = program.post("/api/hands/given", json={"name": f"given-{kind}", "upload": upload})
            elif suffix in (".csv", ".xlsx"):
                answer = program.post("/api/batches", json={"text": "Dear {{ name }}", "table": upload})
            else:
                asked = {"name": "new", "scans": [upload], "texts": ["a b"]}
                answer = program.post("/api/hands", json=asked)
                asked = {"printer": "simulated", "uploads": [upload]}
                seen.append(program.post("/api/calibration/scans", json=asked).text)
            assert answer.status_code == 422 and f"my-{kind}{suffix}" in answer.json()["error"], answer.text
            seen.append(answer.text)
            program.delete(f"/api/uploads/{upload}")
    for path in ("hands/nope/letters", "styles/nope", "plots/nope", "batches/nope", "hands/nope/file"):
        answer = program.get(f"/api/{path}")
        assert answer.status_code in (404, 422)
        seen.append(answer.text)
    leaks = [said for said in seen if re.search(r"/(tmp|var|home|root|usr)/|\.py\b|Traceback", said)]
    assert leaks == [] and len(seen) > 30


@pytest.mark.parametrize(
    ("path", "body", "says"),
    [
        ("write", b'{"text": "a", "dpi": 1e999}', "dpi: this number is larger than any that can be computed with"),
        ("write", b'{"text": "a", "rewritten": [[1, 1e999]]}', "rewritten[0][1]: this number is larger"),
        ("write", b'{"text": "a", "dpi": NaN}', "behind the field dpi: JSON is malformed"),
        ("write", b'{"text": "a", "margin": "\xff"}', "behind the field margin: it is no UTF-8"),
        ("write", b'{"text": "a", "mar', "behind the field text: Input data was truncated"),
        ("styles", b'{"style": {"name": "a", "values": {"b.c": 1, "d.e": 1e999}}}', "style.values.d.e: this number"),
        ("movements", b'{"style": {"name": "a"}, "plan": {"targets": [[1e999, 0]]}}', "targets[0]"),
        (
            "hands/given",
            b'{"name": "a", "upload": "aaaaaaaaaaaaaaaaaaaaaa"}',
            "aaaaaaaaaaaaaaaaaaaaaa that was to be used",
        ),
    ],
)
def test_a_refused_number_or_text_is_named(program, path, body, says):
    answer = program.post(f"/api/{path}", content=body)
    assert answer.status_code == 422 and says in answer.json()["error"], answer.text
