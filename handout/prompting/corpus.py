"""Sentences to choose from: the shipped ones, or those of any text."""

from __future__ import annotations

import string
import unicodedata
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import regex

from handout import encodings
from handout.errors import InputError, reported

PRINTABLE = string.ascii_letters + string.digits + string.punctuation
_FOLDER = Path(__file__).resolve().parent
_MOST = 20_000_000  # bytes
_LONGEST = 40  # words; more is surely not one sentence, and no fun to copy

# how these are typed where there is no key for them; written by hand they look the same
_TYPED = str.maketrans(
    dict.fromkeys("‘’‚ʼ′´", "'")
    | dict.fromkeys("“”„″«»", '"')
    | dict.fromkeys("‐‑‒–—―−", "-")
    | {"…": "...", "\u00ad": "", "\u200b": "", "\ufeff": "", "ﬁ": "fi", "ﬂ": "fl", "ﬀ": "ff"}
)
# letters that are no base letter with a mark
_PLAIN = str.maketrans(
    {"ß": "ss", "æ": "ae", "Æ": "Ae", "œ": "oe", "Œ": "Oe", "ø": "o", "Ø": "O", "ł": "l", "Ł": "L", "đ": "d"}
    | {"Đ": "D", "ð": "d", "Ð": "D", "þ": "th", "Þ": "Th", "ı": "i", "º": "o", "ª": "a"}
)
# what may end a sentence: stops, closing marks, a space, and then a capital or a number, perhaps after opening marks
_END = regex.compile(r"(\S*?)([.!?]+['\")\]]*+) (?=['\"(\[]*+([\p{Lu}\p{N}]))")
# a full stop after these, or after a single capital, ends no sentence; after the second kind, none before a number
_SHORT = regex.compile(r"(?:Mrs?|[MD]rs?|Ms|Fr|St|Prof|Rev|[SJ]r|Hon|Capt|Col|Gen|Lt|vs|viz|cf|e\.g|i\.e|\p{Lu})")
_NUMBERED = regex.compile(r"(?:[Nn][or]|pp?|vol|ch|fig)")
_BLANK = regex.compile(r"\n\s*\n")


def as_typed(text: str) -> str:
    """`text` in NFC, with quotation marks, dashes and dots as one types them on a plain keyboard."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", text).translate(_TYPED))


def plain(sentence: str, allowed: frozenset[str]) -> str | None:
    """The sentence in `allowed` characters, accents left off where these are not among them; None if it has others.

    Accents are optional in this way: Zoë is asked of an author who wants ë, Zoe of all others.
    """
    if allowed.issuperset(sentence):
        return sentence
    bare = ((char, unicodedata.normalize("NFD", char.translate(_PLAIN))) for char in sentence)
    written = "".join(
        char if char in allowed else "".join(c for c in plain if not unicodedata.combining(c)) for char, plain in bare
    )
    return written if allowed.issuperset(written) else None


def sentences(text: str) -> list[str]:
    """Split a text into its sentences, each once, in the order of their first appearance.

    Lines that are broken within a paragraph are joined; a heading or an entry of a list, which has no full stop,
    ends at an empty line. What is longer than 40 words is left out.
    """
    whole: dict[str, None] = {}
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    lines = [line.strip() for line in text.split("\n") if line.strip()]
    if sum(line[-1] in ".!?\"')]" for line in lines) >= 0.9 * len(lines):  # a list of sentences, not wrapped lines
        text = "\n\n".join(lines)
    for paragraph in _BLANK.split(text):
        flat = " ".join(paragraph.split())
        for part in _split_sentences(flat):
            if part and len(part.split()) <= _LONGEST:
                whole.setdefault(part)
    return list(whole)


def _split_sentences(paragraph: str) -> Iterator[str]:
    begin = 0
    for match in _END.finditer(paragraph):
        word, stop, following = match.groups()
        word = word.lstrip("'\"([")
        short = _SHORT.fullmatch(word) or (_NUMBERED.fullmatch(word) and following.isdecimal())
        if stop == "." and short:
            continue
        yield paragraph[begin : match.end(2)]
        begin = match.end()
    yield paragraph[begin:]


@cache
def shipped_sentences(language: str = "en") -> tuple[str, ...]:
    """The sentences in a language that come with the program, one a line of its file.

    Raises InputError: there are none in that language.
    """
    code = language.replace("_", "-").partition("-")[0].lower()
    known = {path.stem.partition("-")[2] or "en": path for path in sorted(_FOLDER.glob("corpus*.txt"))}
    if code not in known:
        raise InputError(f"language: no sentences in {language!r} come with the program, only in {', '.join(known)}.")
    return tuple(known[code].read_text(encoding="utf-8").splitlines())


def read_text(path: Path) -> str:
    """A text file, as it is typed (see `as_typed`).

    Raises InputError: it cannot be read, is longer than 20 MB, is no text, or holds no letters.
    """
    with reported(f"read {path}"):
        data = path.read_bytes()
    if len(data) > _MOST:
        raise InputError(f"{path} is longer than {_MOST} bytes: a part of it will do as well.")
    try:
        text = encodings.decode(data).text
    except encodings.NoText as error:
        raise InputError(f"{path} is not text: {error}; save it as UTF-8.") from error
    if not any(char.isalpha() for char in text):
        raise InputError(f"{path} holds no letters: give a file of text.")
    return as_typed(text)


def usable(texts: Iterable[str], allowed: frozenset[str]) -> list[str]:
    """The sentences that can be asked for when only `allowed` characters may be, each once, two words or more."""
    fitting = (plain(sentence, allowed) for sentence in texts)
    return list(dict.fromkeys(sentence for sentence in fitting if sentence and len(sentence.split()) > 1))
