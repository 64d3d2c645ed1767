"""A study from a hand to its figures: sheets made, filled in, read and scored."""

import json

import cv2
import numpy as np
import pytest

from handout.prompting.sheet_layout import PAPERS
from handout.scanning.pdf_pages import drawn_page
from handout_lab.pipeline import study, study_material
from handout_lab.study import design, sheets
from handout_lab.study.snippets import WrittenWords


def test_a_hand_that_is_its_own_and_only_page_is_too_little(call, small_hand_file):
    _, err = call("study", "make", "--hand", small_hand_file, "-o", "study", code=2)
    assert "the hand would have to lose all" in err and "more pages" in err
    _, err = call("study", "make", "--hand", small_hand_file, "--real", "no", "-o", "study", code=2)
    assert "Cannot read no" in err


def test_what_cannot_be_made_is_refused_before_the_work(call, tmp_path):
    wrong = ("study", "make", "--hand", "no-such-hand", "-o", "study")  # which is looked for later
    assert "use even numbers" in call(*wrong, "--singles", "5", code=2)[1]
    assert "0 to 125" in call(*wrong, "--singles", "300", code=2)[1]
    assert "give one" in call(*wrong, "--random", "2", "--random-people", code=2)[1]
    assert "4 or more" in call(*wrong, "--people", "2", "--random-people", code=2)[1]
    (tmp_path / "few.txt").write_text("A\n\nB")
    assert "2 addresses, parted by empty lines" in call(*wrong, "--envelopes", "few.txt", code=2)[1]


def test_no_chance_is_told_as_none(call, tmp_path):
    key = design.Key(1, ("me",), tuple(design.Snippet(0, 0, k, f"w {k}", 0) for k in range(20)), tuple(
        design.Person(tuple(design.Item(k, "real") for k in range(20)), ()) for _ in range(2)
    ))  # fmt: skip
    name = design.seal(key, tmp_path / "study.key")
    sealed = (tmp_path / "study.key").read_bytes()
    rows = [
        f"study-{name};{who};{kind}"
        for who in (1, 2)
        for kind in ("P;consent;yes", *(f"A;{k};real" for k in range(1, 21)))
    ]
    (tmp_path / "answers.csv").write_text("\n".join(["study;person;questionnaire;item;answer", *rows]))
    assert "guessing p < 0.0001" in call("study", "score", "answers.csv")[0]
    assert (tmp_path / "study.key").read_bytes() == sealed


def test_what_a_person_decided_is_not_overwritten(call, tmp_path):
    table = tmp_path / "answers.csv"
    table.write_text("study,person,questionnaire,item,answer,state\nstudy-s,1,A,1,real,doubtful\n")
    assert "answers that a person wrote" in call("study", "read", "scans", "-o", "answers.csv", code=2)[1]
    table.write_text(table.read_text().replace("real", ""))
    assert "scans" in call("study", "read", "scans", "-o", "answers.csv", code=2)[1]


def test_a_scan_is_known_for_a_page_of_the_hand(small_hand_file, small_scan):
    own = study_material.material(str(small_hand_file), small_scan.scan.parent, None, study.SILENT)
    assert own.used == (0,) and len(own.pages) == 1


@pytest.fixture
def other_page(monkeypatch, small_hand):
    """The only page of the hand counts as two others, so that the hand may keep it."""
    words = WrittenWords(small_hand, 0)
    monkeypatch.setattr(study, "material", lambda *_: study_material.Material(small_hand, (words,) * 3, (1, 2)))
    monkeypatch.setattr(study_material, "_REFERENCES", (1, 1))


@pytest.mark.slow
def test_a_study_is_made_filled_in_read_and_scored(call, other_page, tmp_path):
    made = ["study", "make", "--hand", "small", "--people", "2", "--singles", "2", "--pairs", "0", "--seed", "1"]
    out, err = call(*made, "-o", "study", "--json")
    facts = json.loads(out)
    assert facts["pages"] == 4 and "No page" in " ".join(facts["notes"]) and "its key is" in err
    assert (tmp_path / "study/snippets/001-a.png").is_file() and len(facts["tells"]) == 8
    call(*made, "-o", "study", code=2)

    key = design.opened(tmp_path / "study/study.key", facts["study"])
    (tmp_path / "scans").mkdir()
    page = 0
    for number, person in enumerate(key.people, 1):
        for record in sheets.records(PAPERS[0], facts["study"], number, person, about=False):
            page += 1
            picture = drawn_page(tmp_path / "study/sheets.pdf", page, 120.0)
            for row in sheets.rows(PAPERS[0], record):
                box = row.boxes[row.answers.index(person.singles[row.number - 1].truth) if record.kind == "A" else 0]
                left, top, right, bottom = np.rint(box * 120 / 25.4).astype(int).tolist()
                cv2.line(picture, (left, top), (right, bottom), (30, 30, 30), 2)
            cv2.imwrite(str(tmp_path / f"scans/{page}.png"), picture)
    cv2.imwrite(str(tmp_path / "scans/blank.png"), np.full((600, 400, 3), 250, dtype=np.uint8))

    out, err = call("study", "read", "scans", "-o", "answers.csv", "--json", code=4)
    read = json.loads(out)
    assert (read["people"], read["sheets"], read["doubtful"], read["missing"]) == (2, 4, [], {})
    assert len(read["unread"]) == 1 and "blank.png" in err
    (tmp_path / "another.key").mkdir()
    sealed = (tmp_path / "study/study.key").read_bytes()
    out, err = call("study", "score", "answers.csv", "-o", "figure.svg")
    assert (tmp_path / "study/study.key").read_bytes() == sealed
    assert "4 / 4 100.0% 39.8%–100.0%" in " ".join(out.split()) and "Scored 4 answers" in err
    assert (tmp_path / "figure.svg").read_bytes().startswith(b"<svg")
    changed = (tmp_path / "study/study.key").read_bytes()
    (tmp_path / "study/study.key").write_bytes(changed[:-1] + b"x")
    assert "give it with --key" in call("study", "score", "answers.csv", code=2)[1]
    assert "changed after the sheets" in call("study", "score", "answers.csv", "--key", "study/study.key", code=2)[1]
