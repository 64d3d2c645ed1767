"""Proofs: every page small, what to look at first, and an approval that a later run holds to."""

import json
import re
from pathlib import Path

import pikepdf
import pytest

PEOPLE = "First name,Street,City,Gift\nAnna,Weg 1,Ulm,tea\nBen,Weg 2,Ulm,\nCleo,Weg 3,Ulm,jam\n"
QUICK = ("--pen", "plain", "--hand", "house-print", "--variation", "0", "--page", "A6")
LETTER = ("people.csv", "--letter", "letter.txt")


@pytest.fixture(autouse=True)
def files():
    Path("people.csv").write_text(PEOPLE, encoding="utf-8")
    Path("letter.txt").write_text("Dear {{ first_name }},\nthanks for {{ gift|default('all') }}\n", encoding="utf-8")


@pytest.mark.slow
def test_a_proof_shows_every_page_and_approves_what_it_shows(call, monkeypatch):
    out, _ = call(
        "proof", *LETTER, "--with-envelopes", *QUICK, "--margin", "2mm", "--seed", 4, "-o", "proof.html", "-o",
        "proof.pdf", "--json",
    )  # fmt: skip
    facts = json.loads(out)
    assert facts["sheets"] == {"A6": 3, "DL": 3} and facts["rows"] == 3 and facts["failed"] == []
    assert [look["row"] for look in facts["look_at"]] == [2, 3, 4]
    assert all("of the edge of letter 1" in why for look in facts["look_at"] for why in look["why"])
    page = Path("proof.html").read_text(encoding="utf-8")
    assert page.count("<figure") == 6 and "Look at these first" in page and "http" not in page
    with pikepdf.open("proof.pdf") as document:
        assert len(document.pages) == 2
    print_ = ("print", *LETTER, "--with-envelopes", *QUICK, "--margin", "2mm", "--dry-run", "out.svg", "--rows", "3")
    out, _ = call(*print_, "--approved", "proof.json", "--json")
    assert json.loads(out)["seed"] == 4 and Path("out-003-letter-1.svg").exists()
    for change, words in (
        (("--seed", 5), "--seed was 4 and is now 5"),
        (("--margin", "3mm"), "--margin was 2mm and is now 3mm"),
        (("--hand", "house-joined"), "the content of the hand's file has changed since"),
        (("--tick",), "--tick was not given and is now True"),
    ):
        _, err = call(*print_, "--approved", "proof.json", *change, code=2)
        assert "does not hold any more" in err and words in err, err
    with monkeypatch.context() as patch:
        patch.setattr("handout.reading.second_reader.find", lambda: Path("network"))
        _, err = call(*print_, "--approved", "proof.json", code=2)
        assert 'the content of the extra "reader" has changed since' in err
    Path("letter.txt").write_text("Dear {{ first_name }}", encoding="utf-8")
    _, err = call(*print_, "--approved", "proof.json", code=2)
    assert "the content of the letter has changed since" in err


@pytest.mark.slow
def test_several_processes_make_the_same_proof(call):
    Path("letter.txt").write_text("Dear {{ first_name }},\nthanks for {{ gift }}\n", encoding="utf-8")
    told = [json.loads(call("proof", *LETTER, *QUICK, "--seed", 4, "-o", f"{n}.html", "--jobs", n, "--json", code=4)[0])
            for n in (1, 2)]  # fmt: skip
    one, two = ({**each, "files": []} for each in told)
    assert one == two and one["rows"] == 2
    assert Path("1.html").read_bytes() == Path("2.html").read_bytes()


@pytest.mark.slow
def test_rows_that_cannot_be_made_stand_at_the_top(call):
    Path("letter.txt").write_text("Dear {{ first_name }},\nthanks for {{ gift }}\n", encoding="utf-8")
    _, err = call("proof", *LETTER, *QUICK, "-o", "proof.html", code=4)
    assert "row 3: letter.txt, line 2: 'gift' is empty" in err
    page = Path("proof.html").read_text(encoding="utf-8")
    assert re.search("<li class=failed>.*row 3", page) and page.count("<figure") == 2
    assert json.loads(Path("proof.json").read_text())["rows"] == [2, 4]
    _, err = call("print", *LETTER, *QUICK, "--dry-run", "out.svg", "--approved", "proof.json", code=2)
    assert "row 3 is not in it" in err
    for endless in ("Infinity", "1e999", "NaN"):
        proof = json.loads(Path("proof.json").read_text()) | {"seed": 0}
        Path("endless.json").write_text(json.dumps(proof).replace('"seed": 0', f'"seed": {endless}'))
        _, err = call("print", *LETTER, *QUICK, "--dry-run", "out.svg", "--approved", "endless.json", code=2)
        assert "it is no proof of handout" in err


@pytest.mark.slow
def test_a_last_page_with_a_line_alone_wants_looking_at(call):
    Path("letter.txt").write_text("Dear {{ first_name }}\n" * 3, encoding="utf-8")
    more = ("--margin", "8mm", "--page", "80x37mm", "--line-spacing", "8mm")
    out, _ = call("proof", *LETTER, *QUICK[:-2], *more, "--rows", "2", "-o", "proof.html", "--json")
    assert json.loads(out)["look_at"] == [{"row": 2, "why": ["its last page, 2, has 1 line only"]}]


@pytest.mark.slow
def test_a_plotter_has_its_reach_and_its_time(call):
    command = ("proof", *LETTER, *QUICK, "--rows", "2", "-o", "proof.html", "--device", "simulated", "--json")
    out, _ = call(*command, "--prices", "sheet=0.5,hour=36,pen=2,currency=EUR")
    facts = json.loads(out)
    assert facts["machine_s"] > 5 and facts["look_at"] == [] and facts["ink_cm2"] > 0.1
    cost = facts["cost"]
    assert cost["machine"] == pytest.approx(facts["machine_s"] / 100, abs=1e-3) and cost["unknown"] == ["pen_length"]
    assert cost["pens"] is None and cost["total"] == pytest.approx(0.5 + cost["machine"], abs=1e-3)
    assert "without pens: not known is pen_length." in Path("proof.html").read_text(encoding="utf-8")
    out, _ = call(*command, "--page", "900x900mm", "--margin", "700mm,20mm,20mm,700mm")
    assert "is outside the bed" in json.loads(out)["look_at"][0]["why"][0]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "A proof needs a file"),
        (("-o", "proof.png"), "a proof is written as .html or .pdf"),
        (("-o", "proof.html", "--printer", "pdf", "--device", "simulated"), "a proof is of one machine"),
        (("-o", "proof.html", "--rows", "9"), "names no row"),
        (("-o", "proof.html", "--prices", "sheets=1"), "prices: 'sheets=1' is none; write sheet=0.02"),
    ],
)
def test_a_bad_command_is_one_sentence(call, arguments, words):
    _, err = call("proof", *LETTER, *QUICK, *arguments, code=2)
    assert words in err and not list(Path().glob("proof*"))


def test_what_is_no_proof_is_refused(call):
    Path("proof.json").write_text("[]")
    _, err = call("print", *LETTER, *QUICK, "--dry-run", "out.svg", "--approved", "proof.json", code=2)
    assert "it is no proof of handout" in err
