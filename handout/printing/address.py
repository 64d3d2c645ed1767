"""An address as lines, in the order usual for its country (`countries`)."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence

from handout.printing import countries
from handout.printing.countries import Country

# role of a column (see columns.py) → its cells in this row, in the order of the columns, none empty
Fields = Mapping[str, Sequence[str]]

# a column of forms of address may hold the opening of a letter instead: that is not written on an envelope
_GREETINGS = {
    *("dear", "sehr", "liebe", "lieber", "hallo", "cher", "chère", "estimado", "estimada", "querido", "querida"),
    *("caro", "cara", "gentile", "beste", "geachte"),
}
# with any of these the address is put together from its parts, and a cell with a whole address is not needed
PARTS = frozenset({"street", "street2", "box", "city", "place", "postcode"})
_NOTHING = "there is no street, place or address in it"
# "Springfield, IL 62704", "Toronto ON M5V 2T6"; "01067 Dresden"
_PLACES = (
    re.compile(
        r"(?P<city>\D+?)[,\s]\s*(?P<state>[A-Z]{2})[,\s]\s*(?P<postcode>\d{3,5}(?:-\d{4})?|[A-Z]\d[A-Z] ?\d[A-Z]\d)\Z"
    ),
    re.compile(r"(?P<postcode>(?:[A-Z]{1,3}-)?\d{3,6})\s+(?P<city>\D+)\Z"),
)
_STATE_AND_ZIP = re.compile(r"[A-Z]{2} \d{5}(-\d{4})?\Z")


def tidy(cell: str) -> str:
    """A cell without what `find_unseen` finds in it, with single spaces; line breaks are kept."""
    text = re.sub("\r\n|[\r\v\f\u0085\u2028\u2029]", "\n", unicodedata.normalize("NFC", cell))
    text = "".join(c for c in text if c in "\n\t\u200d" or unicodedata.category(c) not in ("Cc", "Cf"))
    return "\n".join(line for line in (" ".join(part.split()) for part in text.split("\n")) if line)


def find_unseen(cell: str) -> list[str]:
    """The invisible characters of a cell; what joins the parts of an emoji is none."""
    kept = "\n\t\r\v\f\u0085\u200d"
    return [f"U+{ord(c):04X}" for c in cell if c not in kept and unicodedata.category(c) in ("Cc", "Cf")]


def _first_of(fields: Fields, role: str) -> str:
    return fields[role][0] if fields.get(role) else ""


def person(fields: Fields) -> str:
    """One person's name on one line: titles, name or parts of it, suffix."""
    parts = [cell for role in ("first", "middle", "last") for cell in fields.get(role, ())]
    name = _first_of(fields, "name") or " ".join(parts)
    # what opens a letter, as "Dear" does, is not written on an envelope
    titles = [title for title in fields.get("title", ()) if not {*title.casefold().split()[:1]} & _GREETINGS]
    if not name:
        return ""
    for title in reversed(titles):
        name = name if f" {name} ".find(f" {title} ") >= 0 else f"{title} {name}"
    missing = [suffix for suffix in fields.get("suffix", ()) if suffix not in name.replace(",", " ").split()]
    return " ".join([name, *missing])


def _people(fields: Fields) -> list[str]:
    """Names and departments."""
    return _drop_repeats([person(fields), *fields.get("name", ())[1:], *fields.get("attention", ())])


def _firm(fields: Fields) -> list[str]:
    return _drop_repeats(fields.get("company", ()))


def _care(fields: Fields) -> list[str]:
    return [care if care.casefold().startswith("c/o") else f"c/o {care}" for care in fields.get("careof", ())]


def _drop_repeats(lines: Sequence[str]) -> list[str]:
    return list(dict.fromkeys(line for line in lines if line))


def _street_lines(fields: Fields, country: Country, number_first: bool) -> list[str]:
    street, number = _first_of(fields, "street"), _first_of(fields, "number")
    if country.number_first is not None:
        number_first = country.number_first
    parts = (number, street) if number_first else (street, number)
    line = " ".join(part for part in parts if part)
    extra = list(fields.get("extra", ()))
    above, below = (extra, []) if country.extra_first else ([], extra)
    streets = (line, *fields.get("street", ())[1:], *fields.get("street2", ()))
    return _drop_repeats([*above, *streets, *below, *fields.get("box", ())])


def _order_lines(fields: Fields, country: Country, number_first: bool) -> list[str]:
    """The lines of an address whose parts are known, in the order of its country (see `Country.order`)."""
    city, state, code = (_first_of(fields, role) for role in ("city", "state", "postcode"))
    order = country.order.split("%n")
    if fields.get("place"):  # in one cell, and written as it stands there
        city, code = _first_of(fields, "place"), ""
        order = [*[line for line in order if line in ("%N", "%O")], "%A", "%C"]
    if len(city) > 2 and any(city.casefold() in re.sub("%.", "", line).casefold() for line in order):
        city = ""  # the order has it, as that of Singapore
    values = {
        "%N": _people(fields),
        "%O": _firm(fields),
        "%A": [*_care(fields), *_street_lines(fields, country, number_first)],
        "%D": list(fields.get("locality", ())),
        "%C": [city],
        "%S": [state if state != city else ""],
        "%Z": [code],
    }
    return _drop_repeats([text for line in _complete_order(order) for text in _line(line, values)])


def _complete_order(order: Sequence[str]) -> list[str]:
    """The lines of an order, with those of towns, parts of towns, states and postal codes that it has no place for."""
    text = "%n".join(order)
    for lacking in ("%C", "%D"):
        if lacking not in text:
            text = text.replace("%A", f"%A%n{lacking}")
    lines = text.split("%n")
    if "%S" not in text:
        lines.insert(1 + next(number for number, line in enumerate(lines) if "%C" in line), "%S")
    return lines if "%Z" in text else [*lines, "%Z"]


def _line(line: str, values: Mapping[str, Sequence[str]]) -> list[str]:
    """A line of an order, or several where a part has several; what stands between parts only where both do."""
    written, between = [""], ""
    for token in re.findall("%.|[^%]+", line):
        if not token.startswith("%"):
            between = token
            continue
        parts = [part for part in values.get(token, ()) if part]
        if parts:
            between = between if written[-1] or line.startswith(between) else ""
            written[-1:] = [f"{written[-1]}{between}{parts[0]}", *parts[1:]]
        between = "" if parts else between
    return [text for text in written if text]


def place_parts(text: str, order: Sequence[str] = ()) -> dict[str, str]:
    """City, state and postal code from one cell; empty if they cannot be separated.

    order : their roles in the order of the header, for cells whose parts are separated by / ; | or line breaks.
    """
    parts = [part.strip() for part in re.split(r"\s*[/;|\n]\s*", text)]
    if len(order) > 1 and len(parts) == len(order) and all(parts):
        return dict(zip(order, parts, strict=True))
    for pattern in _PLACES:
        match = pattern.match(text)
        if match:
            return {role: value.strip(" ,") for role, value in match.groupdict().items()}
    return {}


def _block(text: str, names: Sequence[str]) -> tuple[list[str], list[str]]:
    """The lines of an address given as a whole, with the names that it lacks above them; and warnings."""
    lines, warnings = text.split("\n"), []
    if len(lines) == 1 and "," in text:
        lines = [part.strip() for part in text.split(",") if part.strip()]
        if len(lines) > 1 and _STATE_AND_ZIP.match(lines[-1]):
            lines[-2:] = [f"{lines[-2]} {lines[-1]}"]
        warnings.append("the address was one line and has been broken at its commas: check it")
    held = {line.casefold() for line in lines}
    return [line for line in names if line.casefold() not in held] + lines, warnings


def _mend(fields: Fields) -> tuple[Fields, list[str]]:
    """The fields with a place in one cell split where that is possible, and a postal code "62704.0" whole; warnings."""
    parts, mended = place_parts(_first_of(fields, "place")), dict(fields)
    if parts and not set(parts) & set(fields):
        del mended["place"]
        mended |= {role: [value] for role, value in parts.items()}
    code = _first_of(mended, "postcode")
    if not re.fullmatch(r"\d+\.0+", code):
        return mended, []
    mended["postcode"] = [code.split(".")[0]]
    return mended, [f"postal code {code} was read as {mended['postcode'][0]}"]


def lines(fields: Fields, number_first: bool = False) -> tuple[tuple[str, ...], list[str], str]:
    """The lines of an address, what to warn of, and why there is none if there is none.

    Parameters
    ----------
    fields : mapping
        Role of a column → its cells; a cell may hold several lines.
    number_first : bool
        Whether the house number stands before the street where the country does not say.

    Returns
    -------
    tuple
        (lines, warnings, problem); `lines` is empty where `problem` is not.
    """
    fields, warnings = _mend(fields)
    country_name = _first_of(fields, "country")
    country = (
        countries.find(country_name)
        if country_name
        else countries.guess(_first_of(fields, "postcode"), _first_of(fields, "state"))
    ) or countries.UNKNOWN
    if set(fields) & PARTS:
        written = _order_lines(fields, country, number_first)
        if not set(fields) & {"city", "place", "postcode"}:
            warnings.append("it names no city")
        if odd := countries.postcode_warning(_first_of(fields, "postcode"), country):
            warnings.append(odd)
    elif fields.get("address"):
        written, doubts = _block(_first_of(fields, "address"), [*_people(fields), *_firm(fields), *_care(fields)])
        warnings += doubts
    else:
        return (), warnings, _NOTHING if fields else "it is empty"
    if not written:
        return (), [], _NOTHING
    if country_name:
        if written[-1].casefold() == country_name.casefold():
            written.pop()
        written.append(countries.last_line(country_name))
    return tuple(line for text in written for line in text.split("\n")), warnings, ""
