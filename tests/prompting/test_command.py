"""`handout hand prompt` as a user calls it."""

import json
from pathlib import Path

import pytest

from handout.cli import main
from handout.prompting import corpus


@pytest.fixture
def call(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def run(*arguments, code=0):
        with pytest.raises(SystemExit) as leave:
            main(["hand", "prompt", *map(str, arguments)])
        out, err = capsys.readouterr()
        assert leave.value.code == code, err
        assert "Traceback" not in err
        return out, err

    return run


@pytest.mark.slow
def test_sheets_and_a_report(call):
    out, err = call("-o", "a.pdf", "--pages", 1, "--ruling", "20mm")
    assert Path("a.pdf").read_bytes().startswith(b"%PDF")
    assert out == "" and err.startswith("Wrote a.pdf: 1 page, ") and err.count("\n") == 1
    assert "letters and" in err and "fewer than 8 times (--verbose lists them)." in err
    call("-o", "b.pdf", "--pages", 1, "--ruling", "20mm", "-q")
    assert Path("a.pdf").read_bytes() == Path("b.pdf").read_bytes()


@pytest.mark.slow
def test_the_table_is_there_for_the_asking(call):
    out, err = call("-o", "a.pdf", "--pages", 1, "--ruling", "20mm", "--verbose")
    assert out.startswith("Letters\n") and "The 200 commonest pairs" in out and "pairs fewer than 8 times:" in out
    assert err.count("\n") == 1 and "--verbose" not in err


@pytest.mark.slow
def test_the_time_is_what_people_take_to_copy(call):
    """Four pages of some 3,800 letters, at 114 to 121 letters a minute (Graham and others, 1998)."""
    out, err = call("-o", "a.pdf", "--json")
    facts = json.loads(out)
    letters = sum(not char.isspace() for page in facts["text"] for char in page)
    assert letters / 121 <= facts["minutes"] <= letters / 114 and 20 < facts["minutes"] < 40
    assert f"about {5 * round(facts['minutes'] / 5)} minutes of writing" in err


@pytest.mark.slow
def test_what_is_asked_for_is_in_the_text(call):
    Path("mine.txt").write_text("Çà et là, l’été: “déjà vu”.", encoding="utf-8")
    facts = json.loads(
        call("-o", "a.pdf", "--pages", 2, "--also", "€ß", "--target", "mine.txt", "--json", "-q", "--plain",
             "--page", "letter", "--ruling", "9mm", "--letter-width", "3mm")[0]
    )  # fmt: skip
    text = "\n".join(facts["text"])
    assert set(corpus.PRINTABLE + "€ßÇàéè".replace("è", "")) <= set(text)
    assert not set(text) & set("’“”è")
    assert (facts["page"], facts["ruling_mm"], facts["ruled"], facts["pages"]) == ("letter", 9.0, False, 2)
    assert facts["words"] == len(text.split()) and facts["lines"] == len(text.splitlines())
    # the target's letters come first in the report, by their share of the target
    assert facts["coverage"]["letters"][0]["share"] > 0.1
    assert {row["unit"] for row in facts["coverage"]["pairs"]} == {"Çà", "et", "là", "ét", "té", "dé", "éj", "jà", "vu"}


def test_a_corpus_of_ones_own(call):
    Path("own.txt").write_text("The moon rose. Then the moon set again.\n\nWe slept on and on.", encoding="utf-8")
    facts = json.loads(call("-o", "a.pdf", "--corpus", "own.txt", "--characters", "moon", "--json", "-q")[0])
    assert sorted(" ".join(facts["text"]).split()) == sorted(Path("own.txt").read_text(encoding="utf-8").split())


@pytest.mark.slow
def test_sheets_in_a_language_hold_its_letters(call):
    facts = json.loads(call("-o", "a.pdf", "--language", "uk", "--pages", 1, "--json", "-q")[0])
    assert set("абвгґдеєжзиіїйклмнопрстуфхцчшщьюя0123456789") <= set("".join(facts["text"]))
    assert Path("a.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-o", "a.png"], "written as .pdf"),
        (["-o", "no/a.pdf"], "folder no does not exist"),
        (["-o", "a.pdf", "--page", "A3"], "A4 or letter"),
        (["-o", "a.pdf", "--ruling", "3mm"], "outside 6 to 20 mm"),
        (["-o", "a.pdf", "--also", "Ժ"], "no form for 'Ժ'"),
        (["-o", "a.pdf", "--language", "fi"], "no sentences in 'fi' come with the program"),
        (["-o", "a.pdf", "--corpus", "none.txt"], "Cannot read none.txt"),
    ],
)
def test_refusals(call, arguments, said):
    _, err = call(*arguments, code=2)
    assert said in " ".join(err.split())
    assert list(Path().iterdir()) == []
