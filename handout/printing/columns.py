"""What the columns of an address table hold, by their headers: every column gets a meaning or is known to have none."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from handout.printing.lexicon import IDLE, KINDS, NAMES, ROLES, key

# of a column that says which of several addresses its neighbours hold ("Address 1 - Label")
LABEL = "label"
_LABELS = frozenset({"label", "type"})
_AMBIGUOUS = frozenset({"number", "no", "nr", "nummer", "numero", "num", "n"})
# an address as a whole, also beside columns for its parts; other words for "address" are the street there
_WHOLE = frozenset(map(key, ("full address", "address block", "formatted", "formatted address", "Adressblock")))
_WHOLE |= frozenset(map(key, ("adresse complète", "dirección completa", "indirizzo completo", "volledig adres")))
# any one of these makes a table something that can be addressed
PLACES = frozenset({"street", "box", "place", "postcode", "city", "address"})
ADDRESS = PLACES | {"number", "street2", "extra", "locality", "state", "county", "country"}
PEOPLE = frozenset({"name", "first", "middle", "last", "company", "attention", "careof"})
_SPOKEN = frozenset({"name", "first", "middle", "last"})
_PERSON = _SPOKEN | {"title", "suffix"}

_LONGEST = 80  # characters of a header
_PREFIXES = tuple(prefix for prefix in sorted((*KINDS, *IDLE), key=len, reverse=True) if len(prefix) > 3)
_PLURAL = re.compile(r"\((?:s|es|e|n|en|r|er|x|in|innen|i)\)", re.IGNORECASE)
_NUMBERED = re.compile(r"(?:address|adresse|dirección|indirizzo|adres)\s*(\d+)\s*[-–—:]\s*(\S.*)\Z", re.IGNORECASE)
_BETWEEN = re.compile(r"\s*[/,;&+|\n]\s*|\s+(?:-|and|or|und|oder|et|ou|y|e|o|en|of)\s+", re.IGNORECASE)
_WORDS = re.compile(r"[^\W_]+(?:['’.][^\W_]+)*\.?")
_CAMEL = re.compile(r"(?<=[a-zß-ÿ])(?=[A-Z])")


@dataclass(frozen=True)
class Meaning:
    """What a header says: a role, which of a person's addresses it belongs to, and the roles that share the column.

    kind : "" or "home", "business", "1" …; parts : in their order, where one column holds several things.
    """

    role: str
    kind: str = ""
    parts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Column:
    """A column of a table: its place from 1, its header, and what it means; None where that is not known."""

    number: int
    header: str
    meaning: Meaning | None = None

    @property
    def role(self) -> str | None:
        return self.meaning.role if self.meaning else None

    @property
    def kind(self) -> str:
        return self.meaning.kind if self.meaning else ""

    @property
    def name(self) -> str:
        """What to call it in a message."""
        return repr(self.header) if self.header else f"number {self.number}"


@lru_cache(maxsize=4096)
def meaning(header: str) -> Meaning | None:
    """What a header means by itself, None if that is not known."""
    if len(header) > _LONGEST:
        return None
    plain = _PLURAL.sub("", header)
    found = _known(plain) or _numbered(plain) or _stripped(plain)
    if found is not None and found.role != "name":
        return found
    several = _combined([part for part in _BETWEEN.split(plain) if part and key(part)]) or _segmented(plain)
    # of a name the order of its parts matters: "Name, Vorname"
    return several if found is None or (several and several.role == "name") else found


def _known(header: str) -> Meaning | None:
    for text in (header, re.sub(r"\(.*?\)", " ", header)):
        name = key(text)
        role = ROLES.get(name) or (ROLES.get(name.removesuffix("s")) if len(name) > 4 else None)
        role = role or (ROLES.get(name.rstrip("0123456789")) if name[:-1] else None)
        if role is not None and not (name not in ROLES and name[-1].isdigit() and role not in _PERSON):
            return Meaning(role)
    return None


def _numbered(header: str) -> Meaning | None:
    """One of several addresses of an address book: "Address 1 - Street"."""
    match = _NUMBERED.match(header.strip())
    if match is None:
        return None
    if key(match.group(2)) in _LABELS:
        return Meaning(LABEL, match.group(1))
    found = meaning(match.group(2))
    return replace(found, kind=match.group(1)) if found and found.role in ADDRESS else None


def _words(header: str) -> list[str]:
    return _WORDS.findall(_CAMEL.sub(" ", header))


def _stripped(header: str) -> Meaning | None:
    """The meaning without words that say whose address it is, or which one: "Guest name", "Home Street 2"."""
    words = _words(header)
    for i, word in enumerate(words):
        kind, rest = KINDS.get(key(word), ""), " ".join((*words[:i], *words[i + 1 :]))
        if not rest or not (kind or key(word) in IDLE):
            continue
        found = _known(rest) or _stripped(rest)
        if found is not None and key(rest) not in _AMBIGUOUS and _fits(found.role, kind):
            return replace(found, kind=kind or found.kind)
    name = key(header)
    for prefix in _PREFIXES:  # Lieferstraße, Gastname
        rest = name.removeprefix(prefix)
        if rest != name and rest in ROLES and rest not in _AMBIGUOUS:
            kind = KINDS.get(prefix, "")
            return Meaning(ROLES[rest], kind) if _fits(ROLES[rest], kind) else None
    return None


def _fits(role: str, kind: str) -> bool:
    # a "business title" is no form of address; parcels and bills have names of their own
    return not kind or role in ADDRESS or (kind in ("shipping", "billing") and role in _PERSON | {"company"})


def _combined(parts: Sequence[str]) -> Meaning | None:
    """What a column holds whose header names several things: "City/State/Zip"."""
    found = [_known(part) or _stripped(part) for part in parts]
    roles = [one.role for one in found if one is not None]
    kinds = {one.kind for one in found if one is not None and one.kind}
    if len(roles) < max(len(parts), 2) or len(kinds) > 1:
        return None
    role = _together(roles)
    return Meaning(role, kinds.pop() if kinds else "", tuple(roles)) if role else None


def _together(roles: Sequence[str]) -> str | None:
    several = set(roles)
    if len(several) == 1:
        return roles[0]
    if several <= {"company", "attention"}:
        return "company"
    if several & PEOPLE and several & (PLACES | {"street2"}):
        return "address"
    for role, members in (
        ("place", {"postcode", "city", "state", "county", "locality"}),
        ("street", {"street", "number", "extra", "street2", "box"}),
        ("name", _PERSON | {"company", "attention"}),
        ("country", {"country", "state", "county"}),
        ("address", ADDRESS),
    ):
        if several <= members and (role in several or role in ("place", "name", "address")):
            return "title" if several <= {"title", "suffix"} else role
    return None


def _segmented(header: str) -> Meaning | None:
    """The same where nothing but spaces stands between: "City ST Zip"."""
    words = _words(header)

    def split(start: int) -> list[str] | None:
        if start == len(words):
            return []
        for end in range(len(words), start, -1):
            text = " ".join(words[start:end])
            rest = split(end) if key(text) in ROLES else None
            if rest is not None:
                return [text, *rest]
        return None

    found = _combined(split(0) or []) if 1 < len(words) <= 8 else None
    kept = found is not None and (set(found.parts) <= ADDRESS or set(found.parts) <= _SPOKEN)
    return found if kept else None


def columns(headers: Sequence[str]) -> list[Column]:
    """What each column holds, with the meanings that depend on the other columns settled.

    "Nom", "Name" or "Nombre" beside a column for the first name is the last name, beside one for the last name it
    is the first name; "Adresse" beside columns for postcode or city is the street; "Region" is the state and
    "Ortsteil" the town where there is no other column for it.
    """
    found = [Column(n, header, meaning(header)) for n, header in enumerate(headers, 1)]
    kinds = {column.kind for column in found}
    for kind in sorted(kinds):
        mine = {column.role for column in found if column.kind in ("", kind)}
        found = [_settled(column, mine) if column.kind == kind else column for column in found]
    return [_beside(found, i) for i in range(len(found))]


def _settled(column: Column, roles: set[str | None]) -> Column:
    """A column's meaning beside columns of these roles; the kind of address is the same."""
    role, single = column.role, not (column.meaning and column.meaning.parts)
    if role == "name" and single and key(column.header) in _LONE and ("first" in roles) != ("last" in roles):
        return _as(column, "last" if "first" in roles else "first")
    if role == "address" and single and "street" not in roles and {"postcode", "city", "place"} & roles:
        return column if any(key(column.header).endswith(name) for name in _WHOLE) else _as(column, "street")
    if role == "locality" and "city" not in roles:
        return _as(column, "city")
    if role == "county":
        return _as(column, "state") if "state" not in roles else Column(column.number, column.header)
    return column


# words for a name that may be one half of it
_LONE = frozenset(map(key, ("name", "nom", "nombre", "nome", "naam")))


def _as(column: Column, role: str) -> Column:
    return Column(column.number, column.header, Meaning(role, column.kind))


def _beside(found: Sequence[Column], i: int) -> Column:
    """ "Nr." is as often a running number as a house number: believed only beside the street."""
    near = {column.role for column in found[max(i - 1, 0) : i + 2]}
    lonely = found[i].role == "number" and key(found[i].header) in _AMBIGUOUS and "street" not in near
    return Column(found[i].number, found[i].header) if lonely else found[i]


def role(word: str) -> str | None:
    """The role that a word names: a role itself, or a header of that meaning."""
    if word in NAMES:
        return word
    found = meaning(word)
    return found.role if found and not found.kind else None


def addressable(found: Iterable[Column]) -> bool:
    """Whether these columns can hold an address at all."""
    return any(column.role in PLACES for column in found)


def understood() -> str:
    """A few of the headers that are understood, for an error message."""
    return (
        "name, first name, last name, company, street, address 2, postal code, city, state, country or address "
        "(also in German, French, Spanish, Italian and Dutch: Straße, PLZ, Ort, code postal, ville, ciudad …)"
    )
