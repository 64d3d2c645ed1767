"""Text out of bytes: UTF-8 and UTF-16 by what the bytes are, eight-bit encodings by the letters that they make.

A file of eight-bit text does not say what it is: 0x8A is ä in Mac OS Roman, Š in Windows-1252 and è in DOS.  Every
encoding is tried on the words that hold such bytes.  What it makes of them is judged by the languages that it takes to
explain their letters, as few as possible, and by where the characters stand: a capital inside a word, a sign between
letters and a third consonant in a row say that the encoding is another one.

Why by hand: charset-normalizer 3.5 decodes 75 of 156 short lists of names rightly, this 139.

Source: own method; the orders of letters and the figures, in nats, are estimates set by hand, and were measured on
names that had no part in that (docs/printing.md).
"""

from __future__ import annotations

import io
import math
import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass

from handout.errors import InputError

_BOMS = (
    (b"\xef\xbb\xbf", "utf-8", "UTF-8"),
    (b"\xff\xfe\x00\x00", "utf-32", "UTF-32"),
    (b"\x00\x00\xfe\xff", "utf-32", "UTF-32"),
    (b"\xff\xfe", "utf-16", "UTF-16"),
    (b"\xfe\xff", "utf-16", "UTF-16"),
)
_DOCUMENTS = (
    (b"PK\x03\x04", "a Word or Pages document, or a ZIP file"),
    (b"\xd0\xcf\x11\xe0", "a document of an old Word"),
    (b"{\\rtf", "a document in RTF"),
    (b"%PDF-", "a PDF"),
    (b"\x89PNG", "a picture"),
    (b"\xff\xd8\xff", "a picture"),
)
# codec → name, and how much rarer such files are than those of Windows-1252
_EIGHT_BIT = {
    "cp1252": ("Windows-1252", 0.0),
    "mac_roman": ("Mac OS Roman", -1.0),
    "cp1250": ("Windows-1250", -1.0),
    "iso8859_15": ("ISO 8859-15", -1.5),
    "iso8859_2": ("ISO 8859-2", -2.0),
    "cp1254": ("Windows-1254", -2.0),
    "cp850": ("DOS 850", -2.0),
    "cp1257": ("Windows-1257", -4.0),
    "cp852": ("DOS 852", -6.0),
    "mac_latin2": ("Mac OS Central European", -9.0),
    "cp1251": ("Windows-1251", -5.0),
    "cp1253": ("Windows-1253", -5.0),
    "koi8_r": ("KOI8-R", -6.0),
}
# the letters of a language beyond ASCII, the most frequent first
_LANGUAGES = {
    "German": "üäöß",
    "French": "éèçêàôâîëïûùœ",
    "Spanish": "óíáñéúü",
    "Portuguese": "ãçáéíóêâõúàô",
    "Italian": "èàòùìé",
    "Dutch": "ëéïöüè",
    "Swedish": "åäöéü",
    "Danish": "øåæéö",
    "Finnish": "äöåšž",
    "Catalan": "óàíèéçúòïü",
    "Irish": "áíéóú",
    "Icelandic": "óáíðéöþúýæ",
    "Polish": "łóńśżąęćź",
    "Czech": "áíéěščřýžůúňóťď",
    "Slovak": "áíéčšýžľúťňôäďóĺŕ",
    "Hungarian": "áéóöőíüúű",
    "Croatian": "ćčšžđ",
    "Slovene": "čšž",
    "Romanian": "ăâîșțşţ",
    "Turkish": "ışğüöçâ",
    "Estonian": "äõöüšž",
    "Lithuanian": "ėšžūųąčįę",
    "Latvian": "āīēšņūļžčķģ",
}
_SCRIPTS = ("CYRILLIC", "GREEK")  # letters of which any language will do
# What characters and languages weigh, nats, set by hand so that names in thirteen encodings were read right
_FOREIGN, _RARE_SIGN, _CONTROL = -7.0, -8.0, -12.0  # a letter of no language, a rare sign, a control character
_ANOTHER = 5.0  # cost of every language after the first
_ALONE = -2.0  # a letter without another beside it
_INSIDE = -6.0  # a capital behind a small letter, or letters of two scripts in a word
_CROWD = -1.5  # a third vowel, or a third consonant, in a row
_VOWELS = frozenset("aeiouyæœøı")
_WORST = -8.5  # a character on average: below this no encoding makes words of the bytes
_WORD = re.compile(r"[^\s,;|\"']+")
_UNTEXT = re.compile(r"[\x00-\x08\x0e-\x19\x1c-\x1f]")
_MOST_WORDS = 500  # that are judged, for speed
_ZEROS = 0.5  # share of every second byte that is zero in UTF-16 of a European language


# language → its letters → log probability; the frequencies fall as one over the rank
_FREQUENCIES = {
    name: {letter: -math.log((n + 1) * ranks) for n, letter in enumerate(letters)}
    for name, letters in _LANGUAGES.items()
    for ranks in [sum(1 / n for n in range(1, len(letters) + 1))]
}


class NoText(InputError):
    """Bytes that are no text; `line` is the first, from 1, that is none, 0 where that cannot be said."""

    def __init__(self, why: str, line: int = 0) -> None:
        super().__init__(why)
        self.line = line


@dataclass(frozen=True)
class DecodedText:
    """A text and how it was read.

    encoding : as people call it; guessed : decided by the letters alone; odd : numbers, from 0, of the lines that the
    guess concerns (the others are valid UTF-8).
    """

    text: str
    encoding: str
    guessed: bool = False
    odd: frozenset[int] = frozenset()

    @property
    def example(self) -> str:
        """A word by which the user can judge a guess; empty if there is none."""
        lines = list(io.StringIO(self.text, newline="")) if self.odd else []
        words = (word for n in sorted(self.odd) if n < len(lines) for word in _WORD.findall(lines[n]))
        return next((word for word in words if not word.isascii()), "")


def decode(data: bytes) -> DecodedText:
    """The text in some bytes; a byte order mark is left out, line ends are kept.

    Raises NoText: they are no text in any encoding that is known.
    """
    for bom, codec, name in _BOMS:
        if data.startswith(bom):
            try:
                return DecodedText(data.decode(codec).removeprefix("\ufeff"), name)
            except UnicodeError as error:
                raise NoText(f"it begins as {name} but is damaged") from error
    utf16 = _utf16(data)
    if utf16 is not None:
        return utf16
    for head, kind in _DOCUMENTS:
        if data.startswith(head):
            raise NoText(f"it is {kind}")
    if re.search(rb"[\x00-\x08\x0e-\x19\x1c-\x1f]", data):
        raise NoText("it holds bytes that no text has")
    try:
        return DecodedText(data.decode("utf-8"), "UTF-8")
    except UnicodeDecodeError:
        return _eight_bit(data)


def _utf16(data: bytes) -> DecodedText | None:
    """UTF-16 without a byte order mark: every second byte of European text is zero."""
    pairs = len(data) // 2
    if not pairs or len(data) % 2:
        return None
    for codec, zero, letter in (("utf-16-le", 1, 0), ("utf-16-be", 0, 1)):
        zeros, others = data[zero::2].count(0), data[letter::2].count(0)
        if zeros >= _ZEROS * pairs and not others:
            try:
                text = data.decode(codec)
            except UnicodeError:
                return None
            return None if _UNTEXT.search(text) else DecodedText(text, f"UTF-16{codec[-3:].upper()} without a mark")
    return None


def _eight_bit(data: bytes) -> DecodedText:
    """Eight-bit text; lines that are valid UTF-8 among it are taken as that."""
    lines = data.splitlines(keepends=True)
    odd = frozenset(n for n, line in enumerate(lines) if line.decode("utf-8", "ignore").encode() != line)
    codec = most_likely_codec([lines[n] for n in sorted(odd)])
    if codec is None:
        raise NoText("it is in no encoding that makes words of its letters", min(odd) + 1)
    text = "".join(line.decode(codec if n in odd else "utf-8") for n, line in enumerate(lines))
    return DecodedText(text, _EIGHT_BIT[codec][0], True, odd)


def most_likely_codec(lines: Sequence[bytes]) -> str | None:
    """The codec that makes the most likely letters of some lines; None where none makes any sense."""
    words = list(dict.fromkeys(word for line in lines for word in line.split() if not word.isascii()))[:_MOST_WORDS]
    signs = sum(byte >= 0x80 for word in words for byte in word)
    best: tuple[float, str] | None = None
    for codec, (_, prior) in _EIGHT_BIT.items():
        try:
            texts = [word.decode(codec) for word in words]
        except UnicodeDecodeError:
            continue
        score = likelihood(texts)
        if score >= _WORST * signs and (best is None or score + prior > best[0]):
            best = score + prior, codec
    return best[1] if best else None


def likelihood(words: Sequence[str]) -> float:
    """How likely the characters of some words are that are not ASCII, in nats; the nearer to 0 the better."""
    standing = sum(_position_score(word, i) for word in words for i, char in enumerate(word) if not char.isascii())
    letters = [[c for c in word.lower() if not c.isascii() and c.isalpha() and c not in "ªº"] for word in words]
    return standing + _languages([word for word in letters if word])


def _languages(words: Sequence[Sequence[str]]) -> float:
    """The letters of words explained by as few languages as do it well."""
    unlisted = {c: -1.0 if _script(c) in _SCRIPTS else _FOREIGN for word in words for c in word}
    by_language = [[sum(table.get(c, unlisted[c]) for c in word) for word in words] for table in _FREQUENCIES.values()]
    # the first language costs nothing
    score, cost, total_cost = [len(word) * _FOREIGN for word in words], 0.0, 0.0
    while words:
        combined = [[max(pair) for pair in zip(score, scores, strict=True)] for scores in by_language]
        better = max(combined, key=sum)
        if sum(better) - sum(score) <= cost:
            break
        score, cost, total_cost = better, _ANOTHER, total_cost + cost
    return sum(score) - total_cost


def _position_score(word: str, i: int) -> float:
    """How usual it is for a character to stand where it does."""
    char, before, after = word[i], word[i - 1] if i else "", word[i + 1 : i + 2]
    if not char.isalpha() or char in "ªº":
        return _sign_score(char, before, after)
    neighbours = [letter for letter in (before, after) if letter.isalpha()]
    score = sum(_INSIDE for letter in neighbours if _script(letter) != _script(char))
    score += _case_score(char, before, after)
    if _script(char) == "LATIN" and len(neighbours) == 2:
        are_vowels = {unicodedata.normalize("NFD", letter)[0].lower() in _VOWELS for letter in (before, char, after)}
        score += _CROWD if len(are_vowels) == 1 else 0.0
    return score if neighbours else score + _ALONE


def _case_score(char: str, before: str, after: str) -> float:
    """Capitals do not follow small letters, nor a small letter stand among capitals."""
    if char.isupper() and before.islower():
        return _INSIDE
    among_capitals = before.isupper() and (after.isupper() or not after)
    return _INSIDE / 2 if char.islower() and char != "ß" and among_capitals else 0.0


def _sign_score(char: str, before: str, after: str) -> float:
    """Signs stand at the edge of a word, or by a number."""
    inside = before.isalpha() and after.isalpha()
    if char == "’":
        return -0.5 if inside else -1.5
    if inside or unicodedata.category(char) in ("Cc", "Cn", "Co"):
        return _CONTROL if unicodedata.category(char) in ("Cc", "Cn", "Co") else _RARE_SIGN
    if char in "“”„«»‘‚›‹–—…\u00a0":
        return -1.5
    if char in "°ºª":
        return -1.0 if before.lower() == "n" or before.isdigit() else _FOREIGN
    return -2.5 if char in "€£§·•½&" else _RARE_SIGN


def _script(char: str) -> str:
    return unicodedata.name(char, "?").split()[0]
