"""What is written for characters that a hand lacks: said once on standard error, and listed in the JSON."""

import json
from pathlib import Path

import pytest

from handout.cli.sentences import tell_lent
from handout.pipeline.results import Tally

SEED = ("--seed", 1, "--hand", "house-quick", "--pen", "plain")
FOX = {"letter": "🦊", "from": "left out", "own": False}
SCHWA = {"letter": "ə", "from": "e in its place", "own": False}


def borrowed(out):
    return json.loads(out)["borrowed"]


def told(err):
    assert err.count("Lent to the hand: ə (e in its place, 2 times).") == 1
    assert err.count("Left out, since the hand has no form for it: 🦊") == 1


@pytest.mark.parametrize(
    "verb",
    [
        ("write", "-o", "a.svg"),
        ("plot", "--dry-run", "a.svg"),
        ("plot", "--port", "sim", "--speed", "fast"),
        ("export", "-o", "a.gcode"),
    ],
)
def test_what_is_borrowed_is_told(call, verb):
    Path("t.txt").write_text("ə and 🦊 or ə", encoding="utf-8")
    name, *rest = verb
    source = ("--file", "t.txt") if name == "write" else ("t.txt",)
    if name == "plot":
        source = ("--file", "t.txt")
    pen = SEED if name == "write" else SEED[:4]
    out, err = call(name, *source, *rest, "--fallback", "--json", *pen)
    assert borrowed(out) == [SCHWA | {"count": 2, "at": [0, 11]}, FOX | {"count": 1, "at": [6]}]
    told(err)
    assert "borrowed" not in json.loads(call(name, "hello", *rest, "--fallback", "--json", *pen)[0])


def test_what_is_borrowed_for_envelopes_is_told_once(call):
    Path("t.csv").write_text("name,street,city\nAnna ə 🦊,Weg 1,Ulm\nBen ə,Weg 2,Ulm\n", encoding="utf-8")
    out, err = call("print", "t.csv", "--dry-run", "e.svg", "--fallback", "--json", *SEED)
    assert [(one["row"], one["letter"], one["count"]) for one in borrowed(out)] == [
        (2, "ə", 1),
        (2, "🦊", 1),
        (3, "ə", 1),
    ]
    told(err)


def test_a_picture_needs_leave_to_be_left_out(call):
    _, err = call("write", "hello 🦊 and 🐸", "-o", "a.svg", code=2)
    assert "has no form for '🦊' (line 1, character 7), '🐸' (line 1, character 13)" in err
    assert "or --fallback to leave them out" in err and not Path("a.svg").exists()
    _, err = call("write", "🦊", "-o", "a.svg", "--fallback", code=2)
    assert "nothing but what is left out" in err


def test_letters_of_one_source_are_told_of_together():
    made = [
        {"letter": letter, "from": "of house-print", "own": False, "count": n} for letter, n in (("G", 1), ("M", 3))
    ]
    one = {"letter": "ə", "from": "e in its place", "own": False, "count": 2}
    sentence = tell_lent(Tally(borrowed=[*made, one]))
    assert (
        sentence == " Lent to the hand: ə (e in its place, 2 times). Lent to the hand, of house-print: G, M (3 times)."
    )


def test_what_is_invisible_is_told_once(call):
    Path("t.csv").write_text("name,street,city\nAnna\u200e,Weg\u00ad 1,Ulm\nBen\u202e,Weg 2,Ulm\n", encoding="utf-8")
    Path("t.md").write_text("Dear\u200b Ann,\n\n\u2066hello\u2069\n", encoding="utf-8")
    out, err = call("write", "a\u200bb", "-o", "a.svg", "--json", *SEED)
    assert borrowed(out) == [{"letter": "U+200B", "from": "left out", "own": False, "count": 1, "at": [1]}]
    assert err.count("U+200B") == 1
    out, err = call("write", "t.md", "-o", "a.svg", "--json", *SEED)
    assert [note.partition(": ")[0] for note in json.loads(out)["notes"]] == ["t.md, line 1", "t.md, line 3"]
    assert err.count("U+200B") == 1 and err.count("U+2066, U+2069") == 1
    out, err = call("print", "t.csv", "--dry-run", "e.svg", "--json", *SEED)
    note = "what is invisible in rows 2-3 is not written: U+200E, U+00AD, U+202E"
    assert json.loads(out)["columns"]["notes"] == [note] and err.count(note) == 1
