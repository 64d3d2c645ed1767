"""Letters from a table: print with `--letter`, with its envelopes, refused rows and broken batches."""

import json
import re
from pathlib import Path

import pikepdf
import pytest

from handout.printing.queue import SimulatedQueue

PEOPLE = (
    "First name,Last name,Street,City,Country,Gift,Pieces,Script,Note\n"
    "Anna,Maß,Weg 1,Ulm,Germany,the jam,1,,So long\n"
    "Ben,Ost,Weg 2,Wien,Austria,,2,house-joined,Farewell\n"
    "Cleo,Zäh,Weg 3,Ulm,Germany,tea,1,,Adieu\n"
)
LETTER = "Dear {{ first_name }},\n{% if gift %}\nthanks for {{ gift }}\n{% endif %}\nYours\n"
QUICK = ("--pen", "plain", "--hand", "house-print", "--variation", "0")
SMALL = ("--page", "A6", *QUICK)


@pytest.fixture(autouse=True)
def files():
    Path("people.csv").write_text(PEOPLE, encoding="utf-8")
    Path("letter.txt").write_text(LETTER, encoding="utf-8")
    Path("small.toml").write_text('kind = "printer"\ntitle = "Small"\ndpi = 72\nsimulated = true\n')


def sheets(path):
    """The sizes of the pages of a PDF, mm."""
    with pikepdf.open(path) as document:
        return [tuple(round(float(v) * 25.4 / 72) for v in page.mediabox[2:]) for page in document.pages]


@pytest.mark.slow
def test_every_row_has_its_letter_and_its_envelope(call):
    command = ("print", "people.csv", "--letter", "letter.txt", "--columns", "copies=Pieces,hand=Script", *SMALL)
    command = (*command, "--with-envelopes", "--seed", 1)
    call(*command, "--rows", 3, "--envelope", "C6", "--printer", "small.toml", "--dry-run", "out.pdf")
    assert sheets("out.pdf") == [(105, 148), (162, 114)] * 2  # Ben has two copies
    out, err = call(*command, "--dry-run", "out.svg", "--json")
    facts = json.loads(out)
    assert facts["rows"] == 3 and facts["pages"] == 6
    assert {"column": "Gift", "as": "letter"} in facts["columns"]["used"] and facts["columns"]["unused"] == ["Note"]
    assert "these columns" not in err and "not used: 'Note'" in err


@pytest.mark.slow
def test_several_queues_share_the_rows_and_envelopes_go_elsewhere(call):
    command = ("print", "people.csv", "--letter", "letter.txt", *SMALL, "--with-envelopes", "--printer", "small.toml")
    out, _ = call(*command, "--queue", "file:a", "--queue", "file:b", "--envelopes-to", "file:c", "--json")
    assert sorted(json.loads(out)["devices"]["c"]) == [2, 3, 4]
    letters = sorted(path.name for folder in ("a", "b") for path in Path(folder).glob("*.pdf"))
    assert letters == [f"row-00{n}-letter-1.pdf" for n in (2, 3, 4)] and len(list(Path("c").glob("*.pdf"))) == 3
    for more, words in (
        (("--queue", "file:a", "--queue", "file:a"), "a is named twice"),
        (("--queue", "file:a", "--envelopes-to", "epson", "--envelopes-to", "file:b"), "have to be of one make"),
    ):
        _, err = call(*command, *more, "--afresh", code=2)
        assert words in err


def test_a_cell_of_ten_megabytes_is_one_sentence(call):
    Path("people.csv").write_text("First name,Gift\nAnna,tea\nBen," + "x" * 10_000_000 + "\n", encoding="utf-8")
    _, err = call("print", "people.csv", "--letter", "letter.txt", *SMALL, "--dry-run", "out.svg", code=2)
    assert "people.csv: row 3: a cell has more than 131072 characters" in err and not list(Path().glob("out*"))


def test_the_text_may_stand_in_a_column(call):
    call("print", "people.csv", "--columns", "text=Note", *SMALL, "--dry-run", "out.svg")
    assert sorted(path.name for path in Path().glob("out-*.svg")) == ["out-002.svg", "out-003.svg", "out-004.svg"]


def test_rows_that_cannot_be_made_are_all_named_and_nothing_is_made(call):
    Path("letter.txt").write_text("Dear {{ first_name }},\nthanks for {{ gift }}\n", encoding="utf-8")
    command = ("print", "people.csv", "--letter", "letter.txt", *SMALL, "--dry-run", "out.svg")
    _, err = call(*command, code=2)
    assert "row 3: letter.txt, line 2: 'gift' is empty" in err and "row 2:" not in err
    assert "Nothing was made" in err and not list(Path().glob("out*"))
    call(*command, "--skip-bad", code=4)
    assert len(list(Path().glob("out*"))) == 2


@pytest.mark.parametrize(
    ("letter", "more", "words"),
    [
        ("Dear {{ name }}", (), "letter.txt, line 1: people.csv has no column 'name'"),
        ("long " * 90, ("--pages", "1", "--rows", "2"), "Row 2 cannot be made: .*page"),
        ("Dear {{ first_name }} 漢", (), "row 4: .*漢"),
        ("Dear {{ first_name }", (), "letter.txt, line 1"),
        ("", (), "letter.txt is empty"),
        ("Dear {{ first_name }}", ("--columns", "text=Note"), "the letter stands in one of them"),
        ("Dear {{ first_name }}", ("--home-country", "Ruritania"), "no country that is known"),
        ("Dear {{ first_name }}", ("--window", "DL"), "takes letters of A4"),
        ("Dear {{ first_name }}", ("--return-address", ","), "return address: 0 lines; give 1 to 6"),
        ("Dear {{ first_name }}", ("--columns", "hand=Last name"), "row 3: .*Ost"),
    ],
)
def test_bad_letters_are_one_sentence_and_nothing_is_made(call, letter, more, words):
    Path("letter.txt").write_text(letter, encoding="utf-8")
    _, err = call("print", "people.csv", "--letter", "letter.txt", *SMALL, *more, "--dry-run", "out.svg", code=2)
    assert re.search(words, err), err
    assert not list(Path().glob("out*")) and "Traceback" not in err


@pytest.mark.slow
def test_pages_depend_on_their_row_alone(call):
    command = ("print", "people.csv", "--letter", "letter.txt", "--with-envelopes", "--page", "A6", "--pen", "plain")
    call(*command, "--seed", 7, "--dry-run", "all.svg")
    call(*command, "--seed", 7, "--rows", "4", "--dry-run", "one.svg")
    for part in ("-letter-1", ""):
        assert Path(f"all-004{part}.svg").read_bytes() == Path(f"one-004{part}.svg").read_bytes()
    assert Path("all-002-letter-1.svg").read_bytes() != Path("all-003-letter-1.svg").read_bytes()


@pytest.mark.slow
def test_the_sender_and_the_home_country(call):
    more = ("--return-address", "A. Fox, Weg 9, Ulm", "--home-country", "DE", "--tick")
    command = ("print", "people.csv", "--letter", "letter.txt", "--with-envelopes", *SMALL, "--seed", 1)
    call(*command, *more, "--dry-run", "front.svg")
    call(*command, *more, "--return-at", "back", "--dry-run", "back.svg")
    assert len(list(Path().glob("front-00?-letter-1.svg"))) == 3 and not list(Path().glob("front*back*"))
    assert len(list(Path().glob("back-00?-back.svg"))) == 3
    # the same address with the sender in its corner is more ink
    assert len(Path("front-002.svg").read_text()) > len(Path("back-002.svg").read_text())


def test_a_country_is_written_in_the_senders_letters(call):
    Path("abroad.csv").write_text("ФИО;Улица;Город;Индекс;Страна\nОксана;вул. Франка 7;Львів;79000;Україна\n", "utf-8")
    out, err = call("print", "abroad.csv", *SMALL, "--home-country", "DE", "--dry-run", "a.svg", "--json")
    said = "row 2: the country УКРАЇНА is written UKRAINE, in the sender's letters"
    assert said in err and json.loads(out)["warnings"] == [said]


def titles():
    """What the jobs are called that the simulated printer has, without the name of their batch."""
    entries = map(json.loads, Path("printed/jobs.jsonl").read_text(encoding="utf-8").splitlines())
    return [entry["title"].split(" ", 2)[2] for entry in entries]


@pytest.mark.slow
def test_letters_and_envelopes_of_a_broken_batch_are_each_printed_once(call, monkeypatch):
    command = ("print", "people.csv", "--letter", "letter.txt", "--with-envelopes", "--printer", "small.toml", *SMALL)
    jammed = SimulatedQueue.__init__
    with monkeypatch.context() as patched:
        patched.setattr(SimulatedQueue, "__init__", lambda self, folder, go_on: jammed(self, folder, 5, go_on))
        _, err = call(*command, code=3)
    # letters first, then the envelopes, for which other paper is asked once
    assert err.count("Put in the envelopes (DL).") == 1 and "Row 3: The simulated printer" in err
    assert "Row 2 was sent and a part of row 4; go on with the same command and --resume" not in err
    assert "go on with the same command and --resume" in err
    Path("letter.txt").write_text(LETTER + "PS\n", encoding="utf-8")
    _, err = call(*command, "--resume", code=2)
    assert "the content of the letter has changed since" in err
    Path("letter.txt").write_text(LETTER, encoding="utf-8")
    out, _ = call(*command, "--resume", "--json")
    assert json.loads(out)["before"] == [2] and json.loads(out)["rows"] == 2
    letters, envelopes = [f"row {n} letter 1" for n in (2, 3, 4)], [f"row {n}" for n in (2, 3, 4)]
    assert titles() == [*letters, *envelopes]
    call(*command, "--resume", "--again", "4")
    assert titles()[6:] == ["row 4 letter 1", "row 4"]


def test_a_letter_file_is_filled_and_what_is_in_cells_is_no_markdown(call):
    Path("letter.md").write_text(
        '---\npage = "A6"\n---\n\n# Dear {{ first_name }}\n\n{% if gift %}\n- {{ gift }}\n{% endif %}\n',
        encoding="utf-8",
    )
    rows = "First name,Gift\n*Anna*,\nBen,1. _a_ {{ b }} {.right}\n"
    Path("people.csv").write_text(rows, encoding="utf-8")
    command = ("print", "people.csv", "--letter", "letter.md", *QUICK, "--seed", 1)
    out, _ = call(*command, "--dry-run", "out.svg", "--json")
    assert json.loads(out)["characters"] == len("Dear*Anna*DearBen1._a_{{b}}{.right}") and json.loads(out)["pages"] == 2
    assert 'width="105' in Path("out-002.svg").read_text(encoding="utf-8")[:400]
    # an option that is given wins over the head
    call(*command, "--page", "A5", "--dry-run", "large.svg", "--rows", 2)
    assert 'width="148' in Path("large-002.svg").read_text(encoding="utf-8")[:400]


def test_the_head_of_a_letter_says_its_language_and_a_row_its_own(call):
    Path("letter.md").write_text('---\nlanguage = "de"\n---\n{{ row["Day"]|date }}, тбд\n', encoding="utf-8")
    Path("days.csv").write_text("Day,Tongue\n2026-03-01,\n2026-03-02,bg\n", encoding="utf-8")
    command = ("print", "days.csv", "--letter", "letter.md", "--columns", "language=Tongue", *SMALL, "--seed", 1)
    said = {}
    for name, more in {"head": (), "asked": ("--language", "fr")}.items():
        call(*command, *more, "--dry-run", f"{name}.svg")
        said[name] = [Path(f"{name}-00{n}.svg").read_text(encoding="utf-8") for n in (2, 3)]
    assert "1. März 2026, тбд" in said["head"][0] and "1 mars 2026, тбд" in said["asked"][0]
    assert "2 март 2026" in said["head"][1] and "2 март 2026" in said["asked"][1]


@pytest.mark.parametrize(("letter", "head"), [("letter.txt", ""), ("letter.md", '---\nmargin = "20mm"\n---\n')])
def test_letters_are_written_as_in_the_language_of_their_row(call, letter, head):
    Path(letter).write_text(f"{head}бити\n", encoding="utf-8")
    Path("rows.csv").write_text("name,language\nAda,ru\nBen,ru\nCy,sr\n", encoding="utf-8")
    command = ("print", "rows.csv", "--letter", letter, "--hand", "house-print", "--variation", 0, "--seed", 1)
    call(*command, "--columns", "language=language", "--dry-run", "out.svg")
    texts = [path.read_text(encoding="utf-8") for path in sorted(Path().glob("out-*.svg"))]
    russian, other, serbian = ([len(way.split()) for way in re.findall(r' d="([^"]*)"', text)] for text in texts)
    assert russian == other != serbian


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("Dear {{ name }}", "letter.md, line 4: people.csv has no column 'name'"),
        ("a\n\n{% if gift %}b", "letter.md, line 6: .* never closed"),
        ("{{ first_name }}\n\n`code`", "rows 2-4: letter.md, line 6: code between backquotes"),
        ("{.sideways}\n{{ first_name }}", "rows 2-4: letter.md, line [45]"),
    ],
)
def test_a_bad_letter_file_is_one_sentence_with_its_line(call, body, words):
    Path("letter.md").write_text(f'---\npage = "A6"\n---\n{body}\n', encoding="utf-8")
    _, err = call("print", "people.csv", "--letter", "letter.md", *QUICK, "--dry-run", "out.svg", code=2)
    assert re.search(words, err), err
    assert not list(Path().glob("out*")) and "Traceback" not in err
