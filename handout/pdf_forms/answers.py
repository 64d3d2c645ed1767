"""Which column of a table answers which field of a form, and which answers cannot be written."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from handout.pdf_forms.fields import Field, PdfForm

YES = {
    "yes", "y", "true", "1", "x", "on", "ja", "j", "oui", "o", "sí", "si", "s", "sim", "tak", "✓", "✔", "✗", "☑", "☒",
}  # fmt: skip
NO = {"", "no", "n", "false", "0", "off", "nein", "non", "não", "nie", "-", "☐"}
_SHOWN_OPTIONS = 8  # choices that a sentence lists


@dataclass(frozen=True)
class Answers:
    """What is written into one form.

    row : of the table, as a spreadsheet counts: the header is row 1.
    values : by the full names of fields; no empty ones.
    refused : check boxes that are left empty, as the answer says.
    """

    row: int
    values: Mapping[str, str]
    refused: frozenset[str] = frozenset()


def match_columns(
    form: PdfForm, header: Sequence[str], columns: Sequence[str] = ()
) -> tuple[dict[int, Field], list[str]]:
    """Match each column with the field that it answers; with sentences on columns that answer none.

    header : the names of the columns.
    columns : what columns answer where their headers do not say it, "field=column"; "=column" for none.
    """
    given, problems = _parse_given_columns(header, columns)
    fields: dict[int, Field] = {}
    for number, title in enumerate(header):
        name = given.get(number, title)
        if not name.strip():
            if any(title.strip() for title in header[number:]) and number not in given and title:
                problems.append(f"column {number + 1} has no name")
            continue
        found = _field_of(form, name)
        if isinstance(found, str):
            problems.append(found)
        elif found in fields.values():
            problems.append(f"two columns answer {found.name!r}")
        elif found.kind == "signature" or found.read_only:
            why = "a signature, which is left empty" if found.kind == "signature" else "printed already and locked"
            problems.append(f"{found.name!r} is {why}: leave its column out with --columns '={title}'")
        else:
            fields[number] = found
    return fields, problems


def _parse_given_columns(header: Sequence[str], columns: Sequence[str]) -> tuple[dict[int, str], list[str]]:
    """The names of fields by the columns that `--columns` gives them, and what is wrong with it."""
    titles = [title.strip().casefold() for title in header]
    given: dict[int, str] = {}
    problems = []
    for text in columns:
        name, equals, title = text.rpartition("=")
        if not equals or title.strip().casefold() not in titles:
            what = f"the table has no column {title.strip()!r}" if equals else "write it as FIELD=COLUMN"
            problems.append(f"--columns {text!r}: {what}")
        else:
            given[titles.index(title.strip().casefold())] = name.strip()
    return given, problems


def _plain(name: str) -> str:
    """A name without case, and without what programs and people put between its words and at its end."""
    return re.sub(r"\[0\]|[#\s_\-:*]", "", name).casefold()


def _field_of(form: PdfForm, name: str) -> Field | str:
    """The field of a name, its last part, or its label; or why there is none."""
    wanted = _plain(name)
    exact = form.fields_by_name.get(name)
    if exact is not None:
        return exact
    for way in range(3):
        calls = ((field, (field.name, field.name.rpartition(".")[2], field.label)[way]) for field in form.fields)
        found = [field for field, called in calls if _plain(called) == wanted]
        if len(found) == 1:
            return found[0]
        if found:
            return f"{name!r} may be {' or '.join(repr(field.name) for field in found[:3])}: write the whole name"
    names = [field.name for field in form.fields] + [field.label for field in form.fields if field.label]
    near = difflib.get_close_matches(name, names, 1, 0.5)
    return f"the form has no field {name!r}" + (f" (but {near[0]!r})" if near else "")


def answers_of(fields: Mapping[int, Field], row: int, cells: Sequence[str]) -> tuple[Answers, list[str]]:
    """The answers of one row, and phrases on those that cannot be written into their field whatever its size."""
    values: dict[str, str] = {}
    problems, refused = [], set()
    for number, field in fields.items():
        text = cells[number].strip() if number < len(cells) else ""
        value, problem = _value(field, text)
        if problem:
            problems.append(f"{field.name}: {problem}")
        elif value:
            values[field.name] = value
        elif text:
            refused.add(field.name)
    return Answers(row, values, frozenset(refused)), problems


def lacking(form: PdfForm, answers: Answers, wrong: Sequence[str]) -> Iterator[str]:
    """Phrases on required fields without an answer, that are not among those with a `wrong` one."""
    settled = {*answers.values, *answers.refused, *(phrase.partition(": ")[0] for phrase in wrong)}
    for field in form.fields:
        left = field.read_only or field.value or field.name in settled or field.kind == "signature"
        if field.required and not left:
            yield f"{field.name}: an answer is required"


def _value(field: Field, text: str) -> tuple[str, str]:
    """What is written into a field, "" for nothing; and what is wrong."""
    if field.kind == "check":
        return _read_check_box(field, text)
    if not text:
        return "", ""
    if field.kind in ("radio", "choice"):
        return _read_choice(field, text)
    if "\n" in text and not field.multiline:
        return "", f"{quote_answer(text)} has several lines, and the field one"
    if field.longest is not None and len(text) > field.longest:
        return "", f"{quote_answer(text)} has {len(text)} characters, and the field takes {field.longest}"
    return text, ""


def _read_check_box(field: Field, text: str) -> tuple[str, str]:
    """Read which boxes of a check box's name are marked: "x" for all of them, or what one stands for."""
    said = text.casefold()
    for state, shown in field.options if len(field.options) > 1 else ():
        if said in (state.casefold(), shown.casefold()):
            return state, ""
    if said in YES or any(said in (state.casefold(), shown.casefold()) for state, shown in field.options):
        return "x", ""
    return "", "" if said in NO else f"{quote_answer(text)} is neither yes nor no"


def _read_choice(field: Field, text: str) -> tuple[str, str]:
    """What a radio button stands for, or the text of a choice."""
    for state, shown in field.options:
        if text.casefold() in (state.casefold(), shown.casefold()):
            return (state if field.kind == "radio" else shown), ""
    if field.free or not field.options:
        return text, ""
    options = ", ".join(shown for _, shown in field.options[:_SHOWN_OPTIONS])
    more = ", …" if len(field.options) > _SHOWN_OPTIONS else ""
    return "", f"{quote_answer(text)} is none of {options}{more}"


_LONGEST_QUOTE = 40  # characters of an answer that a sentence repeats


def quote_answer(text: str) -> str:
    """Quote the beginning of an answer in a sentence."""
    line = " ".join(text.split())
    return repr(line if len(line) <= _LONGEST_QUOTE else f"{line[:_LONGEST_QUOTE]}…")
