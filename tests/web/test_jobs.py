"""Plots and batches as a program asks for them: kept, drawn, paused, stopped and gone on with; proofed and made."""

import io
import json
import re
import time
from pathlib import Path
from queue import Queue
from types import SimpleNamespace

import pytest
from PIL import Image

from handout.errors import InputError
from handout.pipeline import plot_desk
from handout.pipeline.inputs import sent_source
from handout.plotting.ports import SerialDevice

pytestmark = pytest.mark.slow

LIVE, AT_ONCE = "sim:?realtime=1", "sim:"
ASYNC = {"Prefer": "respond-async"}
PEOPLE = "First name,Last name,Note\nAda,Byron,jam\nZoë,Quill,tea\n".encode()
ORDERS = b"First name,Street,Town,Postcode,Country\nAda,1 Lane,London,W1A 1AA,UK\n"
LETTER = "Dear {{ first_name }},\nthank you for the {{ note }}."


def png(side):
    """A red picture, of some kilobytes."""
    data = io.BytesIO()
    Image.new("RGB", (side, side), (200, 0, 0)).save(data, "PNG")
    return data.getvalue()


def kept(program, text="Hi"):
    return program.post("/api/plots", json={"text": text, "page": "74x105mm", "seed": 4}).json()["facts"]


def drawn(program, name, port=AT_ONCE):
    return program.post(f"/api/plots/{name}/draw", json={"port": port}).json()


def until(program, task, right, seconds=60):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        snapshot = program.get(f"/api/tasks/{task}").json()
        if right(snapshot):
            return snapshot
        time.sleep(0.1)
    raise AssertionError(snapshot)


def begun(program, name):
    """A plot under way, whose pen is seen."""
    task = program.post(f"/api/plots/{name}/draw", json={"port": LIVE}, headers=ASYNC).json()["id"]
    return task, until(program, task, lambda snapshot: "place" in snapshot.get("live", {}))


def test_a_plot_is_kept_looked_at_and_drawn(program):
    plot = kept(program)
    assert plot["page"] == [74.0, 105.0] and plot["bed"] == [300.0, 220.0] and not plot["runs"]
    # its page lies in the lower left corner of the bed, as it is seen
    assert plot["lies"]["matrix"] == [1, 0, 0, 1, 0, 115] and plot["lies"]["zero"] == [0, 220]
    page = program.get(f"/api/plots/{plot['job']}/pages/0").text
    assert page.count('class="stroke"') > 1
    assert program.get(f"/api/plots/{plot['job']}/pages/7").status_code == 422
    done = drawn(program, plot["job"])["facts"]
    assert done["finished"] and done["ended"] and done["drawn_mm"] == done["pen_down_mm"] > 0
    listed = program.get("/api/plots").json()
    assert listed["drawn"] == {} and listed["plots"][0]["finished"]
    again = drawn(program, plot["job"])
    assert "finished" in again["error"]
    assert program.delete(f"/api/plots/{plot['job']}").status_code == 200
    assert program.get(f"/api/plots/{plot['job']}").status_code == 422


def test_its_sheet_is_laid_otherwise_until_it_is_drawn(program):
    plot = kept(program)
    path = f"/api/plots/{plot['job']}"
    laid = program.put(f"{path}/sheet", json={"quarters": 1, "x": 100, "y": 50}).json()
    assert laid["lies"]["matrix"] == [0, -1, 1, 0, 100, 124] and laid["lies"]["turned"] == "to the left"
    beyond = program.put(f"{path}/sheet", json={"quarters": 0, "x": 290, "y": 50})
    assert beyond.status_code == 422 and "use another place for the sheet" in beyond.json()["error"]
    assert program.get(path).json()["lies"] == laid["lies"]
    assert drawn(program, plot["job"])["facts"]["finished"]
    assert "stays where it lies" in program.put(f"{path}/sheet", json={"quarters": 0, "x": 0, "y": 0}).json()["error"]


def test_pens_are_slower_left_out_and_in_another_order_until_it_is_drawn(program):
    text = {"text": "Hi [A]{ink=#7c1f2b} [lo]{ink=#1f7c2b}", "letter": True, "layers": "colour"}
    plot = program.post("/api/plots", json={"page": "74x105mm", "seed": 4, **text}).json()["facts"]
    path, (first, red, green) = f"/api/plots/{plot['job']}", plot["pens"]
    turned = program.put(f"{path}/pens", json={"pens": [{"layer": red["layer"], "speed": 0.2, "pen": "fine"}]}).json()
    assert [pen["layer"] for pen in turned["pens"]] == [red["layer"], first["layer"], green["layer"]]
    assert turned["pens"][0]["seconds"] > red["seconds"] and turned["pens"][0]["pen"] == "fine"
    strokes = program.get(f"{path}/pages/0").text.count('class="stroke"')
    turns = [{"layer": green["layer"], "out": True}, {"layer": red["layer"], "speed": 0.2}]
    left = program.put(f"{path}/pens", json={"pens": turns}).json()
    assert left["pen_down_mm"] == pytest.approx(plot["pen_down_mm"] - green["ink_mm"], abs=0.3)
    assert program.get(f"{path}/pages/0").text.count('class="stroke"') < strokes
    everything = [{"layer": pen["layer"], "out": True} for pen in plot["pens"]]
    for pens, says in (([{"layer": "x"}], "no layer 'x'"), (everything, "leave one of the pens in")):
        assert says in program.put(f"{path}/pens", json={"pens": pens}).json()["error"]
    task, _ = begun(program, plot["job"])
    assert program.put(f"{path}/pens", json={"pens": []}).status_code == 409
    program.post(f"/api/tasks/{task}/word", json={"word": "stop"})
    until(program, task, lambda snapshot: snapshot["state"] == "done")
    assert "keep their order" in program.put(f"{path}/pens", json={"pens": []}).json()["error"]
    quicker = program.put(f"{path}/pens", json={"pens": [turns[0], {"layer": red["layer"]}]}).json()
    assert quicker["pens"][0]["speed"] == 1, "which may be said when some is drawn"
    done = drawn(program, plot["job"])["facts"]
    assert done["finished"] and done["drawn_mm"] == left["pen_down_mm"]


def test_a_plot_pauses_goes_on_and_is_stopped_where_the_journal_says(program):
    plot = kept(program, "Hi hi hi")
    task, seen = begun(program, plot["job"])
    assert seen["live"]["place"]["page"] == 0
    assert program.get("/api/plots").json()["drawn"] == {plot["job"]: task}
    # the machine has one master
    assert program.post("/api/pen", json={"port": LIVE, "move": "up"}).status_code == 409
    assert program.post(f"/api/plots/{plot['job']}/draw", json={"port": AT_ONCE}).status_code == 409
    assert program.delete(f"/api/plots/{plot['job']}").status_code == 409
    program.post(f"/api/tasks/{task}/word", json={"word": "pause"})
    asks = until(program, task, lambda snapshot: "question" in snapshot.get("live", {}))
    assert "pen lifted" in asks["live"]["question"]
    program.post(f"/api/tasks/{task}/word", json={"word": "on"})
    until(program, task, lambda snapshot: "place" in snapshot.get("live", {}))
    program.post(f"/api/tasks/{task}/word", json={"word": "stop"})
    stopped = until(program, task, lambda snapshot: snapshot["state"] == "done")["facts"]
    assert not stopped["ended"] and stopped["stopped"] == "it was stopped at the page"
    assert 0 < stopped["drawn_mm"] < stopped["pen_down_mm"] and stopped["place"]["stroke"] >= 0
    assert program.post(f"/api/tasks/{task}/word", json={"word": "on"}).status_code == 409
    assert drawn(program, plot["job"])["facts"]["finished"]


def test_the_pen_is_moved_by_hand_at_ports_that_are_there(program):
    assert program.post("/api/pen", json={"port": AT_ONCE, "move": "down"}).json()["facts"]["done"] == "the pen is down"
    far = {"port": AT_ONCE, "move": "jog", "x": 900}
    assert "bed" in program.post("/api/pen", json=far).json()["error"]
    for port in ("/etc/passwd", "socket://example.org:80", "sim:?busy=64", "../sim:", "loop://"):
        answer = program.post("/api/pen", json={"port": port, "move": "up"})
        assert answer.status_code == 422 and "no port" in answer.json()["error"], port
    assert drawn(program, kept(program)["job"], "/dev/null")["error"].startswith("There is no port")
    names = {port["name"] for port in program.get("/api/machines").json()["ports"]}
    assert {LIVE, AT_ONCE} <= names


def batch(program, table=PEOPLE, name="people.csv", **asked):
    body = {"table": program.sent(name, table), "text": LETTER, "page": "74x105mm", "seed": 4, **asked}
    return program.post("/api/batches", json=body).json()


def test_a_batch_is_proofed_approved_and_made_once(program):
    made = batch(program, to="printer", printer="printer-simulated", return_address="/etc/passwd")
    one = f"/api/batches/{made['batch']}"
    assert [row["called"] for row in made["rows"]] == ["Ada, Byron, jam", "Zoë, Quill, tea"] and made["state"] == "new"
    assert "approved" in program.post(f"{one}/make", json={}).json()["error"]
    assert "no proof" in program.post(f"{one}/approval").json()["error"]
    proof = program.post(f"{one}/proof").json()["facts"]["proof"]
    assert [page["row"] for page in proof["pages_shown"]] == [2, 3] and "/tmp" not in json.dumps(proof)
    assert program.get(f"{one}/files/{proof['pages_shown'][0]['picture']}").content.startswith(b"\x89PNG")
    assert program.get(f"{one}/files/proof.pdf").content.startswith(b"%PDF")
    assert program.post(f"{one}/approval").json()["state"] == "approved"
    done = program.post(f"{one}/make", json={}).json()["facts"]
    assert done["state"] == "done" and [row["state"] for row in done["rows"]] == ["done", "done"]
    assert done["made"]["jobs"] == ["job-001", "job-002"]
    again = program.post(f"{one}/make", json={})
    assert again.status_code == 422 and "was made" in again.json()["error"]
    for path in ("batch.json", "..%2fbatch.json", "table.csv", "proof.json", "batch.pdf"):
        assert program.get(f"{one}/files/{path}").status_code in (404, 422), path
    assert program.delete(one).status_code == 200 and program.get(one).status_code == 422


def test_a_table_is_looked_at_before_it_is_kept_and_rows_are_left_out(program):
    sent = program.sent("people.csv", PEOPLE)
    asked = {"table": sent, "text": "{{ first_name }}: {{ note }}", "page": "74x105mm", "seed": 4}
    tried = program.post("/api/batches/tried", json=asked).json()
    assert [one["name"] for one in tried["columns"]] == ["first_name", "last_name", "note"] and not tried["trouble"]
    assert [one["filled"] for one in tried["rows"]] == ["Ada: jam", "Zoë: tea"] and tried["no_envelopes"]
    assert program.post("/api/batches/tried", json={**asked, "row": 3}).json()["tried"]["filled"] == "Zoë: tea"
    wrong = program.post("/api/batches/tried", json={**asked, "text": "{{ firs_name }}"}).json()
    assert "did you mean first_name?" in wrong["trouble"] and "/" not in wrong["trouble"]
    one = f"/api/batches/{program.post('/api/batches', json=asked).json()['batch']}"
    program.post(f"{one}/proof")
    assert "nothing to make" in program.post(f"{one}/approval", json={"left_out": [2, 3]}).json()["error"]
    assert "has no row 9" in program.post(f"{one}/approval", json={"left_out": [2, 9]}).json()["error"]
    assert program.post(f"{one}/approval", json={"left_out": [2]}).json()["left_out"] == [2]
    done = program.post(f"{one}/make", json={}).json()["facts"]
    assert [row["state"] for row in done["rows"]] == ["left out", "done"] and done["complete"]


def test_a_row_is_put_right_before_its_batch_is_approved_and_contacts_are_a_table(program):
    cards = "".join(
        f"BEGIN:VCARD\nVERSION:4.0\nN:{name};;;;\nADR:;;1 Lane;Bonn;;;\nEND:VCARD\n" for name in ("Ada", "")
    )
    sent = program.sent("people.vcf", cards.encode())
    asked = {"table": sent, "text": "{{ last_name }}, {{ street }}", "page": "74x105mm", "to": "pdf", "seed": 4}
    one = f"/api/batches/{program.post('/api/batches', json=asked).json()['batch']}"
    assert program.post(f"{one}/proof").json()["facts"]["states"] == {"": 1, "cannot be made": 1}
    assert program.post(f"{one}/rows/3", json={}).json()["cells"] == {
        "Last name": "",
        "Street": "1 Lane",
        "City": "Bonn",
    }
    changed = program.post(f"{one}/rows/3", json={"cells": {"Last name": 'Zoë "Z", Quill'}}).json()["cells"]
    assert changed["Last name"] == 'Zoë "Z", Quill' and changed["City"] == "Bonn"
    late = program.post(f"{one}/rows/3", json={"cells": {"City": "Ulm"}, "was": {"Last name": "", "City": "Bonn"}})
    assert "changed in another window" in late.json()["error"]
    assert "no proof yet" in program.post(f"{one}/approval").json()["error"], "what is approved is what was looked at"
    proof = program.post(f"{one}/proof").json()["facts"]
    assert proof["states"] == {"": 2} and proof["rows"][1]["called"] == 'Zoë "Z", Quill, 1 Lane, Bonn'
    for row, cells in ((9, {}), (3, {"Nobody": "x"})):
        assert "no row" in program.post(f"{one}/rows/{row}", json={"cells": cells}).json()["error"]
    program.post(f"{one}/approval")
    assert "is approved" in program.post(f"{one}/rows/3", json={"cells": {"City": "Ulm"}}).json()["error"]
    assert program.post(f"{one}/make", json={}).json()["facts"]["states"] == {"done": 2}


def test_who_answers_at_a_port_is_told(program):
    assert program.post("/api/machines/asked", json={"port": AT_ONCE}).json()["facts"]["dialect"] == "grbl"
    assert "no port" in program.post("/api/machines/asked", json={"port": "tcp://example.org"}).json()["error"]


def test_a_batch_is_shared_by_two_plotters_stops_and_goes_on(program):
    made = batch(program, to="plotter", device="plotter-simulated")
    one = f"/api/batches/{made['batch']}"
    program.post(f"{one}/proof")
    program.post(f"{one}/approval")
    assert program.post(f"{one}/make", json={"port": [LIVE, "/dev/null"]}).status_code == 422
    task = program.post(f"{one}/make", json={"port": [LIVE, AT_ONCE]}, headers=ASYNC).json()["id"]
    until(program, task, lambda snapshot: "done" in [row["state"] for row in program.get(one).json()["rows"]])
    assert program.post(f"{one}/proof").status_code == 409
    for port in (LIVE, AT_ONCE):
        assert program.post("/api/pen", json={"port": port, "move": "up"}).status_code == 409
    program.post(f"/api/tasks/{task}/word", json={"word": "stop"})
    stopped = until(program, task, lambda snapshot: snapshot["state"] == "done")["facts"]
    assert not stopped["complete"] and (stopped["state"], stopped["ended"]) == ("broken off", "it was interrupted")
    assert sorted(row["state"] for row in stopped["rows"]) != ["done", "done"]  # that which is drawn at true speed
    done = program.post(f"{one}/make", json={"port": AT_ONCE}).json()["facts"]
    assert done["complete"] and [row["state"] for row in done["rows"]] == ["done", "done"]


def test_what_the_simulated_plotter_drew_of_a_batch_for_a_real_one_is_not_made(program, monkeypatch):
    made = batch(program, to="plotter", device="plotter-grbl-servo")
    one = f"/api/batches/{made['batch']}"
    program.post(f"{one}/proof")
    program.post(f"{one}/approval")
    for _ in range(2):
        tried = program.post(f"{one}/make", json={"port": AT_ONCE}).json()["facts"]
        assert tried["state"] == "approved" and tried["rehearsed"]
        assert [row["state"] for row in tried["rows"]] == ["simulated", "simulated"]
    said = program.post(f"{one}/make", json={"port": [AT_ONCE, "/dev/ttyUSB7"]}).json()["error"]
    assert "comes on paper" in said or "no port" in said


def test_rows_that_a_plotter_cannot_draw_are_told_and_stay_told(program):
    made = batch(program, to="plotter", device="plotter-axidraw-minikit", page="A5")
    one = f"/api/batches/{made['batch']}"
    proof = program.post(f"{one}/proof").json()["facts"]["proof"]
    assert "use a larger bed" in proof["look_at"][0]["why"][0], "a page has no --fit"
    program.post(f"{one}/approval")
    program.post(f"{one}/make", json={"port": AT_ONCE})
    assert ["outside the bed" in row["state"] for row in program.get(one).json()["rows"]] == [True, True]


def test_rows_that_cannot_be_made_are_left_out_of_a_batch_that_is_approved(program):
    """And a proof that was made anew meanwhile is not approved unseen."""
    table = program.sent("people.csv", b"First name,Gift\nAda,jam\nBob,\n")
    text = "{{ first_name }}, {{ gift }}"
    name = program.post("/api/batches", json={"table": table, "text": text, "page": "A6"}).json()["batch"]
    url = f"/api/batches/{name}"
    program.post(f"{url}/proof")
    proof = program.get(url).json()["proof"]
    assert proof["rows"] == 1 and [each["row"] for each in proof["failed"]] == [3]
    assert "made anew elsewhere" in program.post(f"{url}/approval", json={"made": "before"}).json()["error"]
    assert program.post(f"{url}/approval", json={"made": proof["made"]}).json()["state"] == "approved"
    assert program.post(f"{url}/make").json()["facts"]["state"] == "done"


def test_what_is_asked_of_some_plotters_that_share_a_batch_goes_to_the_page():
    """Each question waits for its own answer, and what stops one stops all of them by their first thread."""
    from handout.pipeline.plot_desk import AtPage

    said, shown = Queue(), []
    wire = SimpleNamespace(say=print, note=print, progress=print, live=shown.append)
    wire.word = lambda seconds=0.0: said.get(timeout=9)
    with pytest.raises(KeyboardInterrupt), AtPage(wire, shared=True) as attendant:
        said.put("pause")  # each plotter has a button for that
        said.put("on")
        attendant.do("Put in a sheet at /dev/ttyUSB0")
        assert shown == [{"question": "Put in a sheet at /dev/ttyUSB0."}, {}]
        attendant.progress(0.5, "send")
        said.put("stop")
        attendant.do("Put in a sheet at /dev/ttyUSB0")


def test_a_batch_for_several_queues_names_them_once(monkeypatch):
    from handout.pipeline import batch_desk
    from handout.pipeline.options import BatchPlan, MergeOptions, PictureOptions, TableOptions, WritingOptions
    from handout.printing import printers

    monkeypatch.setattr(printers, "queues", lambda: ["Left", "Right"])
    options = WritingOptions(), PictureOptions(), TableOptions(), MergeOptions()
    for printer, queues, meant in (
        ("Left", (), ()),
        ("Left", ("Right", "Left"), ("Left", "Right")),
        ("simulated", ("Right",), ("Right",)),
    ):
        plan = BatchPlan("", "printer", *options, "A6", printer, queues)
        assert batch_desk._queues(plan) == meant


def test_a_text_alone_is_a_batch_of_one_as_it_stands(program):
    made = program.post("/api/batches", json={"text": "Just {{ this }} {% x %}", "page": "74x105mm", "seed": 1}).json()
    done = program.post(f"/api/batches/{made['batch']}/proof").json()["facts"]
    assert done["proof"]["characters"] == len("Just{{this}}{%x%}") and not done["proof"]["failed"]


@pytest.mark.parametrize(
    ("name", "table"), [("a.csv", b"\x89PNG\r\n"), ("a.xlsx", b"PK\x03\x04" + bytes(99)), ("a.csv", b"")]
)
def test_tables_that_are_none_are_refused_in_a_sentence(program, name, table):
    assert batch(program, table, name)["error"].endswith((".", "?"))


def test_letters_from_elsewhere_lead_to_no_file(program, tmp_path, monkeypatch):
    (tmp_path / "red.png").write_bytes(png(40))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="no picture 'red"):
        sent_source("Hi\n\n![](red.png)", True)
    for letter in (
        '---\nhand = "/home/x/a.hand"\n---\nHi',
        '---\npaper = "../page.png"\n---\nHi',
        '---\nbackground = "/etc/passwd"\n---\nHi',
        "![](/etc/passwd)",
        "[Hi]{hand=../a.hand}",
        "::: signature ../../x.png\nHi\n:::",
    ):
        answer = program.post("/api/write", json={"text": letter, "letter": True, "page": "74x105mm"})
        assert answer.status_code == 422 and "alone" in answer.json()["error"], (letter, answer.json())
    eps = program.sent("eps.png", b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n")
    bomb = program.sent("large.png", png(9_000))
    for picture, said in ((eps, "PNG, JPEG"), (bomb, "megapixels"), (program.sent("a b.png", b"x"), "letters, digits")):
        body = {"text": "![](large.png)", "letter": True, "page": "74x105mm", "pictures": [picture]}
        for path in ("/api/write", "/api/plots", "/api/batches"):
            answer = program.post(path, json=body)
            assert answer.status_code == 422 and said in answer.json()["error"], (path, answer.text)
    rows = batch(program, b"name,hand\nAda,../a.hand\n", columns=["hand=hand"], text="Hi {{ name }}")
    done = program.post(f"/api/batches/{rows['batch']}/proof").json()["facts"]
    assert "alone" in done["rows"][0]["why"][0]
    letter = {"text": '---\npage = "74x105mm"\n---\n# Hi\n\nthere', "letter": True, "page": "A4"}
    assert program.post("/api/write", json=letter, headers={"Accept": "image/svg+xml"}).text.count('height="105mm"')


def test_pictures_of_a_letter_are_sent_with_it(program):
    letter = {"text": "Hi\n\n![](red.png){width=30mm}", "letter": True, "page": "74x105mm", "seed": 1}
    asked = {**letter, "pictures": [program.sent("red.png", png(40))], "format": "png", "dpi": 50}
    page = Image.open(io.BytesIO(program.post("/api/write", json=asked, headers={"Accept": "image/png"}).content))
    assert sum(count for count, colour in page.convert("RGB").getcolors(1 << 20) if colour == (200, 0, 0)) > 3000
    assert "red.png" in program.post("/api/write", json=letter).json()["error"]
    made = program.post("/api/batches", json=asked | {"to": "pdf"}).json()
    proof = program.post(f"/api/batches/{made['batch']}/proof").json()["facts"]
    assert not proof["proof"]["failed"] and proof["rows"][0]["state"] == ""


def test_a_full_disk_stops_a_plot_in_a_sentence_and_nothing_is_lost(program):
    import resource

    assert program.put("/api/drafts/draft", json={"draft": {"text": "Dear"}}).status_code == 200
    assert (
        program.get("/api/drafts/other").status_code
        == program.put("/api/drafts/x", json={"draft": 1}).status_code
        == 404
    )
    plot = kept(program, "Hi hi hi")
    assert drawn(program, kept(program)["job"])["facts"]["finished"]  # so that there is a process
    process = program.studio._machines["sim"]._processes[0]._process.pid
    free = resource.prlimit(process, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
    full = drawn(program, plot["job"])
    resource.prlimit(process, resource.RLIMIT_FSIZE, free)
    assert "Cannot write the journal" in full["error"] and "The disk is full" in full["error"]
    assert "kept, and can be gone on with" in full["error"], "one of which nothing was drawn, too"
    assert drawn(program, plot["job"])["facts"]["finished"]
    free = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, free[1]))
    try:
        answer = program.post("/api/uploads?name=people.csv", content=bytes(1 << 20))
        unkept = program.put("/api/drafts/draft", json={"draft": {"text": "x" * 20_000}})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, free)
    assert answer.status_code == 507 and "cannot be kept" in answer.json()["error"]
    assert unkept.status_code == 507 and unkept.json()["error"].endswith("not on the disk: File too large.")
    assert program.get("/api/drafts/draft").json() == {"draft": {"text": "Dear"}}, "what was kept before is there"


def test_what_the_manual_asks_for_is_answered(program):
    """The examples of docs/studio.md, with the names that they lead to."""
    manual = (Path(__file__).parents[2] / "docs" / "studio.md").read_text(encoding="utf-8")
    found = re.findall(r"curl -sN? ([^|]*?)\"?http://127.0.0.1:7217(/api/[^\s\"]+)", manual)
    assert len(found) == 10
    names, answers = {"mar01-1": "", "r8Kd…": "", "Gbiu…": ""}, []
    for options, path in found:
        for name, meant in names.items():
            path, options = path.replace(name, meant), options.replace(name, meant)
        body = re.search(r"-d '(.*?)'", options, re.DOTALL)
        headers = dict(re.findall(r'-H "(Accept|Prefer): (.*?)"', options))
        sent = ORDERS if "--data-binary" in options else body[1] if body else b""
        posted = sent or "-X POST" in options
        answer = program.post(path, content=sent, headers=headers) if posted else program.get(path)
        assert answer.status_code in (200, 202), (path, answer.text)
        answers.append(answer)
        facts = answer.json() if answer.headers["content-type"] == "application/json" else {}
        for name, told in (("mar01-1", facts.get("facts", facts)), ("Gbiu…", facts), ("r8Kd…", facts)):
            own = {"mar01-1": told.get("job") or told.get("batch"), "Gbiu…": told.get("id"), "r8Kd…": told.get("id")}
            names[name] = own[name] or names[name]
    assert '"state": "done"' in answers[3].text  # a stream of events
    assert answers[-1].content.startswith(b"%PDF")


def test_a_killed_server_leaves_a_lifted_pen_and_a_plot_to_go_on_with(program):
    plot = kept(program, "Hi hi hi")
    task, _ = begun(program, plot["job"])
    # what the process of a plot sees of a killed server is the end of its input
    program.portal.call(program.studio._machines["sim"]._processes[0]._process.stdin.close)
    broken = until(program, task, lambda snapshot: snapshot["state"] != "running")
    assert broken["state"] in ("done", "failed")  # what it says last may not come over any more
    left = program.get(f"/api/plots/{plot['job']}").json()
    assert left["stopped"] == "the studio was closed" and 0 < left["drawn_mm"] < left["pen_down_mm"]


def test_no_machine_is_chosen_unasked(monkeypatch):
    """A page begins with the first port: the simulated plotter's, whatever is plugged in."""
    plugged = [SerialDevice("/dev/ttyS0", "", None), SerialDevice("/dev/ttyUSB0", "USB Serial", (0x1A86, 0x7523))]
    monkeypatch.setattr(plot_desk, "serial_devices", lambda: plugged)
    names = [port["name"] for port in plot_desk.machines()["ports"]]
    assert names == [*plot_desk.SIMULATED, "/dev/ttyUSB0", "/dev/ttyS0"]
