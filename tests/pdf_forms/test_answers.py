"""Which columns answer which fields, and what is said of answers that cannot be written."""

from pathlib import Path

import pytest

from handout.pdf_forms.answers import answers_of, lacking, match_columns
from handout.pdf_forms.fields import Field, PdfForm, Widget

PLACE = (Widget(0, (0.0, 0.0, 50.0, 8.0)),)
FORM = PdfForm(
    Path("a.pdf"),
    (),
    (),
    (
        Field("form[0].person[0].Sur_name[0]", "text", PLACE, label="Family name", required=True),
        Field("child.name", "text", PLACE),
        Field("adult.name", "text", PLACE),
        Field("code", "text", PLACE, cells=5, longest=5),
        Field("swims", "check", PLACE, options=(("Yes", "Yes"),), required=True),
        Field("pick", "radio", PLACE, options=(("1", "one"), ("2", "two"))),
        Field("boat", "choice", PLACE, options=(("8", "eight"), ("4", "four"))),
        Field("sign", "signature", PLACE, required=True),
        Field("number", "text", PLACE, read_only=True, required=True),
        Field("notes", "text", PLACE, multiline=True),
    ),
)
SURNAME = FORM.fields[0]


@pytest.mark.parametrize("header", ["Surname", "SUR NAME:", "family name *", "form[0].person[0].Sur_name[0]"])
def test_a_column_answers_the_field_that_it_is_called_like(header):
    assert match_columns(FORM, [header]) == ({0: SURNAME}, [])


@pytest.mark.parametrize(
    ("header", "columns", "words"),
    [
        (["Surnme"], (), "no field 'Surnme' (but"),
        (["name"], (), "may be 'child.name' or 'adult.name'"),
        (["surname", "family name"], (), "two columns answer"),
        (["sign"], (), "a signature"),
        (["number"], (), "printed already and locked"),
        (["surname"], ("code=zip",), "no column 'zip'"),
        (["surname"], ("code",), "write it as FIELD=COLUMN"),
    ],
)
def test_columns_that_answer_nothing_are_told(header, columns, words):
    _, problems = match_columns(FORM, header, columns)
    assert len(problems) == 1 and words in problems[0]


def test_columns_are_given_and_left_out_by_hand():
    fields, problems = match_columns(
        FORM, ["who", "zip", "Remarks of the office"], ("surname=WHO", "code=zip", "=Remarks of the office")
    )
    assert not problems and {n: f.name for n, f in fields.items()} == {0: SURNAME.name, 1: "code"}


def answer(name, text):
    answers, problems = answers_of({0: FORM.fields_by_name[name]}, 2, [text])
    return answers.values.get(name), problems


def test_answers_become_what_is_written():
    assert (
        answer("swims", "ja") == ("x", []) and answer("swims", "No") == (None, []) and answer("swims", "") == (None, [])
    )
    assert (
        answer("pick", "TWO") == ("2", [])
        and answer("boat", "8") == ("eight", [])
        and answer("code", "80331") == ("80331", [])
    )
    assert answer("notes", "a\nb") == ("a\nb", [])


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("swims", "perhaps", "neither yes nor no"),
        ("pick", "three", "none of one, two"),
        ("boat", "raft", "none of eight, four"),
        ("code", "123456", "has 6 characters, and the field takes 5"),
        ("child.name", "a\nb", "several lines"),
    ],
)
def test_answers_that_cannot_be_written_are_told_by_field(name, text, words):
    value, problems = answer(name, text)
    assert value is None and len(problems) == 1 and problems[0].startswith(f"{name}: ") and words in problems[0]


def test_required_answers_are_missed_once():
    fields = {0: SURNAME, 1: FORM.fields_by_name["swims"]}
    answers, wrong = answers_of(fields, 2, ["", "no"])  # "no" is an answer
    assert list(lacking(FORM, answers, wrong)) == [f"{SURNAME.name}: an answer is required"]
    answers, wrong = answers_of(fields, 2, ["Ada", "perhaps"])  # told already
    assert list(lacking(FORM, answers, wrong)) == []
