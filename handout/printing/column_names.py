"""The names that columns of address tables have, as people and programs write them, in twelve languages.

A new name of a column is one more word in column_names.toml, beside those of its role; a word that says whose address a
column holds ("home", "Liefer") goes to the kinds of address.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from pathlib import Path

_NAMES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
# names of a column that says which address its neighbours hold ("Address 1 - Label")
LABELS = frozenset({"label", "type"})
# as often a running number as a house number
AMBIGUOUS_NUMBERS = frozenset({"number", "no", "nr", "nummer", "numero", "num", "n"})
# the whole name, or the half of it that no other column holds
AMBIGUOUS_NAMES = frozenset({"name", "nom", "nombre", "nome", "naam", "имя", "име", "імя", "ονομα"})


def normalise(header: str) -> str:
    """A header without case, accents, spaces and punctuation: ``" Straße / Nr. "`` → ``"strassenr"``."""
    plain = unicodedata.normalize("NFKD", unicodedata.normalize("NFKD", header).casefold())
    return "".join(c for c in plain if c.isalnum())


def identifier(header: str) -> str:
    """A header as a name in a letter: ``"First name"`` → ``first_name``, ``"Straße/Nr."`` → ``strasse_nr``."""
    plain = unicodedata.normalize("NFKD", unicodedata.normalize("NFKD", header).casefold())
    letters = "".join(c for c in plain if not unicodedata.combining(c))
    name = "_".join(re.findall(r"[^\W_]+", letters))
    return f"c{name}" if name[:1].isdigit() else name


def _read_names(text: str) -> list[str]:
    """The names in a text of the file, normalised."""
    return [name for header in re.split("[,\n]", text) if (name := normalise(header))]


def _invert(table: dict[str, str]) -> dict[str, str]:
    """Normalised header → what it means; of two meanings the first."""
    return {name: meaning for meaning, text in reversed(table.items()) for name in _read_names(text)}


ROLES = _invert(_NAMES["roles"])
# what a column may say of how its row is made; no header means it by itself
SETTINGS = ("text", "hand", "pen", "language", "copies")
ROLE_NAMES = (*_NAMES["roles"], *SETTINGS)
KINDS = _invert(_NAMES["kinds"])
FILLERS = frozenset(_read_names(_NAMES["fillers"]))
WHOLE_ADDRESS = tuple(_read_names(_NAMES["whole_address"]))
