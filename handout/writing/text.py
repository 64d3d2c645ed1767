"""Text as it is typed, turned into what a hand can write: graphemes, each a letter and its accents.

First the characters that a pen writes alike, and what may stand for one that a hand lacks.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, groupby, pairwise, zip_longest
from typing import TYPE_CHECKING

import regex

from handout.errors import InputError, MissingCharacters
from handout.hand.diacritics import compose_grapheme, decompose_grapheme
from handout.hand.places import graphemes
from handout.hand.protocol import Repertoire

if TYPE_CHECKING:
    from handout.mathematics.formulas import Formula

# what says where a line may break and which way letters run: it leaves no ink, and pages here run from left to right
_INVISIBLE = regex.compile(r"[\u00ad\u034f\u061c\u180e\u200b-\u200f\u202a-\u202e\u2060-\u2064\u2066-\u206f\ufeff]")
# Characters that look the same when written by hand; "" is not written at all
SAME = str.maketrans(
    {
        "\t": "    ",
        "\u2010": "-",
        "\u2011": "-",
        "\u2012": "–",
        "\u2015": "—",
        "\u2212": "–",
        "\u2032": "’",
        "\u2033": "”",
        "\u02bc": "’",
        "\u2024": ".",
        "\u2044": "/",
        "\u037e": ";",
        "ﬀ": "ff",
        "ﬁ": "fi",
        "ﬂ": "fl",
        "ﬃ": "ffi",
        "ﬄ": "ffl",
        "\u0133": "ij",
        "\u0132": "IJ",
        "ŉ": "’n",
        "ǆ": "dž",
        "ǅ": "Dž",
        "Ǆ": "DŽ",
        "ǉ": "lj",
        "ǈ": "Lj",
        "Ǉ": "LJ",
        "ǌ": "nj",
        "ǋ": "Nj",
        "Ǌ": "NJ",
        "\ufe0e": "",
        "\ufe0f": "",
        "\u1e9e": "SS",
        "\u212b": "Å",
        "\u2126": "Ω",
        "\u00b4": "’",
        "º": "°",
    }
)
# what a pen writes alike; a scanned hand has them as its transcript was typed
ALIKE = {
    "'": "’‘",
    "’": "'‘",
    "‘": "'’",
    '"': ("”", "“", "''"),
    "“": ('"', "”"),
    "”": ('"', "“"),
    "–": "-—",
    "—": "–-",
    "-": "–",
    "…": ("...",),
    "ŀ": ("l·",),
    "Ŀ": ("L·",),
    "●": "•",
    "∙": "·",
    "⋅": "·",
    "♥": "❤",
    "✔": "✓",
    "✘": "✗",
    "✕": "✗",
    "✖": "✗",
    "⭐": "★",
    "🙂": "☺",
    "☏": "☎",
    "✆": "☎",
    "➔": "→",
    "➜": "→",
    "➡": "→",
    "⬅": "←",
    "⬆": "↑",
    "⬇": "↓",
    "⩽": "≤",
    "⩾": "≥",
    "ℓ": "l",
    # Greek and Cyrillic letters; a tonos stands before its capital
    **{accented: ("’" + own, "’" + like) for accented, own, like in zip("ΆΈΉΊΌΎΏ", "ΑΕΗΙΟΥΩ", "AEHIOYΩ", strict=True)},
    **dict(zip("ΑΒΕΖΗΙΚΜΝΟΡΤΥΧονµАВЕІЈКМНОРСТХЅаеіјорсухѕ", "ABEZHIKMNOPTYXovμABEIJKMHOPCTXSaeijopcyxs", strict=True)),
}
# without U+00A0, U+2007 and U+202F, at which a line must not end: see `spaces_of`
SPACES = str.maketrans(
    dict.fromkeys("\u1680\u2000\u2001\u2002\u2003\u2004\u2005\u2006\u2008\u2009\u200a\u205f\u3000", " ")
)
NEWLINES = regex.compile(r"\r\n|[\r\v\f\x85\u2028\u2029]")
# what may stand for a character when the user accepts similar forms, besides letters without their marks
SIMILAR = {
    **dict(zip("đĐħĦŧŦłŁıŋŊĸſəƏ", "dDhHtTlLinNkseE", strict=True)),
    "™": "TM",
    "©": "(c)",
    "®": "(R)",
    "№": "No",
    "•": "·",
    "→": "->",
    "←": "<-",
    "≤": "<=",
    "≥": ">=",
    "≈": "~",
    "±": "+/-",
    "✓": "v",
    "✗": "x",
    "★": "*",
    "☐": "[]",
}
# pictures and signs that a text can do without
_PICTURE = regex.compile(r"\A\P{L}*[\p{Extended_Pictographic}\p{Emoji_Modifier}\p{Regional_Indicator}\u20e3]")
# the letters of another alphabet, in which a name may stand a second time
_FOREIGN = regex.compile(r"\A(?=\p{L})\P{Latin}")
_CLOSING, _OPENING, _BRACKETS = frozenset(".,;:!?…)]»”’"), frozenset("([«“„‘"), frozenset("()[]/·,;.")
_NAMES = 2  # words with capitals beside a name in another alphabet that surely are that name, and no salutation

_MOST_NAMED = 20  # characters that a complaint lists
_FEW = 40  # letters of a hand that can be told one by one
_OVERLAY = 1  # the combining class of strokes through a character
LEFT_OUT = "left out"
_BREAK_AFTER = "-–—/"  # a line may end behind these, as behind a hyphen


@dataclass(frozen=True, slots=True)
class Letter:
    """What is written for one grapheme: a letter that the hand has, the accents on it, and where it stands."""

    base: str
    marks: tuple[str, ...]
    at: int


class FormulaLetters(tuple[Letter, ...]):
    """The letters of a formula, with what stands right before and behind it.

    parts : the formulas, and None for words beside them, each with the letters of its leaves, or of that word.
    """

    parts: tuple[tuple[Formula | None, tuple[tuple[Letter, ...], ...]], ...]

    def __new__(cls, letters: Sequence[Letter], formulas: Sequence[Formula]) -> FormulaLetters:
        """Of letters in the order of their text, and the formulas that they are in."""
        from handout.mathematics.formulas import leaves

        piece = super().__new__(cls, letters)
        of = {at: number for number, formula in enumerate(formulas) for at in range(*formula.at)}
        parts: list[tuple[Formula | None, tuple[tuple[Letter, ...], ...]]] = []
        for number, group in groupby(letters, key=lambda letter: of.get(letter.at, -1)):
            own = list(group)
            if number < 0:
                parts.append((None, (tuple(own),)))
                continue
            tree = formulas[number].tree
            parts.append((formulas[number], tuple(tuple(x for x in own if x.at in leaf.at) for leaf in leaves(tree))))
        piece.parts = tuple(parts)
        return piece

    def split(self) -> Iterator[Piece]:
        """Each formula, and each word beside one, by itself."""
        for formula, words in self.parts:
            letters = sorted((letter for word in words for letter in word), key=lambda letter: letter.at)
            yield letters if formula is None else FormulaLetters(letters, [formula])

    @property
    def words(self) -> Iterator[tuple[Letter, ...]]:
        """What the hand sets as words, in the order of writing."""
        yield from (word for _, words in self.parts for word in words if word)


class TiedSpaces(int):
    """A number of spaces at which no line may end."""


# a number of spaces, or the letters between two of them
Piece = int | Sequence[Letter]


@dataclass(frozen=True)
class Borrowed:
    """What was written for a grapheme that a hand lacks, and where in the text, graphemes from 0.

    source : what of, in words; `LEFT_OUT` if nothing was written.
    of_author : whether all of it is the author's.
    doubted : the hand has the letter, but all its glyphs are doubtful.
    """

    letter: str
    source: str
    of_author: bool
    at: tuple[int, ...]
    doubted: bool = False


def normalise(text: str) -> str:
    """Text in NFC, with one kind of newline and of space, and look-alikes as the hands have them."""
    text = unicodedata.normalize("NFC", NEWLINES.sub("\n", _INVISIBLE.sub("", text)))
    return unicodedata.normalize("NFC", text.translate(SAME).translate(SPACES))


def written_units(text: str, *, marked: bool = False) -> tuple[list[str], list[Formula]]:
    r"""What is written for each grapheme of a normalised text, "" for nothing, and the formulas in it.

    Of a formula the letters of its leaves are, of ``\$`` the sign.

    marked : whether every other ``$`` belongs to a formula, whatever stands beside it, as in the runs of a letter.

    Raises InputError: a formula that cannot be written; the message has its place.
    """
    typed = graphemes(text)
    if "$" not in typed:
        return typed, []
    from handout.mathematics.formulas import leaves
    from handout.mathematics.parser import WrongFormula, find_formulas, read_formula

    written, formulas = list(typed), list["Formula"]()
    for begin, end, displayed in find_formulas(typed, marked=marked):
        try:
            formula = read_formula(typed, begin, end, displayed)
        except WrongFormula as error:
            before = "".join(typed[: error.at]).split("\n")
            line, column = len(before), len(graphemes(before[-1])) + 1
            raise InputError(f"Formula at line {line}, character {column}: {error}.") from error
        formulas.append(formula)
        written[begin:end] = [""] * (end - begin)
        for leaf in leaves(formula.tree):
            for sign, at in zip(leaf.text, leaf.at, strict=True):
                written[at] = sign
    inside = {at for formula in formulas for at in range(*formula.at)}
    for at, pair in enumerate(pairwise(typed)):
        if pair == ("\\", "$") and at not in inside:
            written[at] = ""
    return written, formulas


def paragraphs_of(text: str, hand: Repertoire, *, fallback: bool = False, marked: bool = False) -> list[list[Piece]]:
    """The paragraphs of a text in the letters of a hand: what is written in one go, and the numbers of spaces between.

    A displayed formula is a paragraph of its own.

    fallback, errors : see `spell`; marked : see `written_units`.
    """
    text = normalise(text)
    formulas = written_units(text, marked=marked)[1]
    inside = {at: formula for formula in formulas for at in range(*formula.at)}
    return [
        [
            FormulaLetters(piece, formulas)
            if not isinstance(piece, int) and any(letter.at in inside for letter in piece)
            else piece
            for piece in _pieces(paragraph, inside)
        ]
        for paragraph in _part_paragraphs(spell(text, hand, fallback=fallback, marked=marked), inside)
    ]


def _part_paragraphs(tokens: Iterable[Letter | str], inside: Mapping[int, Formula]) -> list[list[Letter | str]]:
    """The tokens, parted at newlines and around displayed formulas; a sign right behind one of these stays there."""
    paragraphs, last = list[list[Letter | str]]([[]]), -1
    shown: Formula | None = None  # whose paragraph it is
    for token in tokens:
        if token == "\n":
            paragraphs.append([])
            last, shown = -1, None
            continue
        if isinstance(token, Letter):
            here = inside.get(token.at)
            if here is None and token.at == last + 1 and not token.base.isalnum():
                here = shown
            here = here if here is not None and here.displayed else None
            if last >= 0 and here is not shown:
                paragraphs.append([])
            shown, last = here, token.at if here is None else max(token.at, here.at[1] - 1)
        paragraphs[-1].append(token)
    return paragraphs


def _pieces(paragraph: Sequence[Letter | str], inside: Collection[int]) -> Iterator[Piece]:
    """What is written in one go, and between them the number of spaces; a line may break after a hyphen.

    inside : places of formulas, which are not parted.
    """
    piece: list[Letter] = []
    spaces = ""
    for token in paragraph:
        if isinstance(token, str):
            if piece:
                yield piece
                piece = []
            spaces += token
            continue
        if spaces:
            yield spaces_of(spaces)
            spaces = ""
        if len(piece) > 1 and piece[-1].base in _BREAK_AFTER and token.base.isalpha() and piece[-1].at not in inside:
            yield piece
            piece = []
        piece.append(token)
    if piece:
        yield piece


def spaces_of(between: str) -> int:
    """The number of spaces between two words of a normalised text; `TiedSpaces` where each holds its line together."""
    return len(between) if " " in between or not between else TiedSpaces(len(between))


def may_part(before: Collection[str], word: Collection[str]) -> bool:
    """Whether a line may end between two words: not behind a « that stands alone, nor before such a » or !"""
    return not ((before and _OPENING.issuperset(before)) or (word and _CLOSING.issuperset(word)))


def spell(text: str, hand: Repertoire, *, fallback: bool = False, marked: bool = False) -> Iterator[Letter | str]:
    """The graphemes of normalised `text` as letters of a hand, one by one; spaces and newlines as they are.

    The whole text is checked before this returns.

    fallback : accept borrowed forms: an accent that the hand lacks is left out, a letter is taken from the other case,
        and a picture (an emoji), or a name in another alphabet beside the same in this one, is not written; `borrowed`
        tells what.
    marked : see `written_units`.

    Raises InputError: nothing to write. MissingCharacters: the hand lacks characters; the message lists all of them
    with their places.
    """
    units = written_units(text, marked=marked)[0]
    inked = {at: unit for at, unit in enumerate(units) if unit and not unit.isspace()}
    forms = {unit: _form(unit, hand, 0, fallback) for unit in inked.values()}
    omitted = _find_omitted(units, forms)
    needed = {unit for at, unit in inked.items() if at not in omitted}
    missing = {unit for unit in (needed if fallback else forms) if not forms[unit]}
    if missing:
        places = _places(graphemes(text), {at: unit for at, unit in inked.items() if unit in missing})
        raise MissingCharacters(_complaint(places, hand, fallback, missing - needed))
    if not needed:
        which = "the text holds nothing but what is left out" if forms else "the text is empty"
        raise InputError(f"There is nothing to write: {which}.")
    return _spelt(units, hand, omitted, fallback)


def may_omit(grapheme: str) -> bool:
    """Whether a text may do without a grapheme, where similar forms are accepted and there is none."""
    return bool(_PICTURE.match(grapheme) or _FOREIGN.match(grapheme))


def find_unseen(text: str) -> list[Borrowed]:
    """The invisible characters of a text, which no hand writes, and where, graphemes of the normalised text from 0.

    What joins the parts of an emoji is of that emoji.
    """
    places: dict[str, list[int]] = {}
    pieces = _INVISIBLE.split(text)
    starts = accumulate(len(graphemes(normalise(piece))) for piece in pieces)
    for piece, char, at in zip(pieces, _INVISIBLE.findall(text), starts, strict=False):
        if char != "\u200d" or not _PICTURE.match(piece.rstrip("\ufe0f")[-1:]):
            places.setdefault(_name(char), []).append(at)
    return [Borrowed(name, LEFT_OUT, False, tuple(where)) for name, where in places.items()]


def _find_omitted(units: Sequence[str], forms: Mapping[str, Sequence[Letter]]) -> set[int]:
    """The places of what no form is there for and a text can do without, with the brackets around it."""
    omitted = {at for at, unit in enumerate(units) if not forms.get(unit, unit) and _PICTURE.match(unit)}
    parted = groupby((at for at, unit in enumerate(units) if unit), lambda at: units[at].isspace())
    words = [list(places) for spaces, places in parted if not spaces]
    foreign = [_is_foreign([units[at] for at in word], forms) for word in words]
    for number, word in enumerate(words):
        if foreign[number] and _is_named_beside(units, words, foreign, number):
            omitted.update(_in_brackets(units, word))
    return omitted


def _in_brackets(units: Sequence[str], word: Sequence[int]) -> range:
    """The places of a word without the signs at its ends, but with the brackets that it stands in."""
    letters = [at for at in word if units[at] not in _BRACKETS]
    begin, end = letters[0], letters[-1] + 1
    bracketed = word[0] < begin and end <= word[-1] and units[begin - 1] + units[end] in ("()", "[]")
    return range(begin - bracketed, end + bracketed)


def _is_foreign(word: Sequence[str], forms: Mapping[str, Sequence[Letter]]) -> bool:
    """Whether a word is of letters of another alphabet, which the hand has not all."""
    letters = [unit for unit in word if unit not in _BRACKETS]
    return all(map(_FOREIGN.match, letters)) and not all(forms[unit] for unit in letters)


def _is_named_beside(
    units: Sequence[str], words: Sequence[Sequence[int]], foreign: Sequence[bool], number: int
) -> bool:
    """Whether words with capitals stand in the same line right beside a foreign one, enough of them to be a name."""
    for way in (-1, 1):
        count, at = 0, number
        while 0 <= (then := at + way) < len(words):
            between = units[words[min(at, then)][-1] + 1 : words[max(at, then)][0]]
            if "\n" in between or not (foreign[then] or units[words[then][0]][0].isupper()):
                break
            count, at = count + (not foreign[then]), then
        if count >= _NAMES:
            return True
    return False


def _spelt(units: Sequence[str], hand: Repertoire, omitted: set[int], fallback: bool) -> Iterator[Letter | str]:
    """The letters, without what is left out and the space that only parted it from the rest."""
    kept = [at for at, unit in enumerate(units) if unit and at not in omitted]
    last = "\n"
    for at, following in zip_longest(kept, kept[1:]):
        after = "\n" if following is None else units[following]
        gone = units[at] == " " and (at - 1 in omitted or at + 1 in omitted)
        if gone and (
            last.isspace() or last in _OPENING or (at + 1 in omitted and (after.isspace() or after in _CLOSING))
        ):
            continue
        last = units[at]
        yield from [last] if last.isspace() else _form(last, hand, at, fallback)


def _form(grapheme: str, hand: Repertoire, at: int, fallback: bool) -> Sequence[Letter]:
    return _letters(grapheme, hand, at) or (borrow(grapheme, hand, at) if fallback else [])


def _places(typed: Sequence[str], missing: Mapping[int, str]) -> dict[str, list[str]]:
    """Where in a text some graphemes stand, in words; `missing` : place → grapheme."""
    places: dict[str, list[str]] = {}
    line, column = 1, 0
    for at, unit in enumerate(typed):
        column += 1
        if unit == "\n":
            line, column = line + 1, 0
        if at in missing:
            places.setdefault(missing[at], []).append(f"line {line}, character {column}")
    return places


def lacking(text: str, hand: Repertoire, *, marked: bool = False) -> dict[str, list[int]]:
    """The graphemes of normalised `text` that a hand has no letter for, and where they stand, graphemes from 0.

    marked : see `written_units`.
    """
    places: dict[str, list[int]] = {}
    for at, grapheme in enumerate(written_units(text, marked=marked)[0]):
        if grapheme and not grapheme.isspace() and not _letters(grapheme, hand, at):
            places.setdefault(grapheme, []).append(at)
    return places


def _letters(grapheme: str, hand: Repertoire, at: int) -> list[Letter]:
    """The grapheme as one letter of the hand, accented if it has no form of its own; [] if the hand lacks it."""
    for same in (grapheme, *ALIKE.get(grapheme, ())):
        if all(part in hand.letters for part in same):
            return [Letter(part, (), at) for part in same]
    base, marks = decompose_grapheme(grapheme)
    if marks and all(mark in hand.marks for mark in marks):
        return [Letter(same, marks, at) for same in (base, *ALIKE.get(base, ())) if same in hand.letters][:1]
    return []


def borrow(grapheme: str, hand: Repertoire, at: int) -> list[Letter]:
    """Similar forms that a hand writes for a grapheme that it lacks; [] if it has none."""
    base, marks = decompose_grapheme(grapheme)
    marks_left = tuple(mark for mark in marks if mark in hand.marks)
    if not base.isalpha() and any(unicodedata.combining(mark) == _OVERLAY for mark in marks if mark not in marks_left):
        base, marks_left = grapheme, ()  # a sign without its stroke says something else: ≠ is not =
    for choice in (
        SIMILAR.get(base, base),
        unicodedata.normalize("NFKC", base).translate(SAME),
        base.swapcase(),
    ):  # ½ is 1/2
        if choice and all(part in hand.letters for part in choice):
            return [Letter(part, marks_left if i == 0 else (), at) for i, part in enumerate(choice)]
    return []


def list_borrowed(text: str, hand: Repertoire, *, marked: bool = False) -> list[Borrowed]:
    """What a hand writes for the graphemes of normalised `text` that it lacks, where similar forms are accepted.

    marked : see `written_units`.
    """
    letters = []
    for grapheme, places in lacking(text, hand, marked=marked).items():
        written = "".join(spelt(letter) for letter in borrow(grapheme, hand, 0))
        letters.append(Borrowed(grapheme, instead(written), False, tuple(places)))
    return letters


def instead(written: str) -> str:
    """In words, what is written for a character that a hand lacks; nothing: it is left out."""
    return f"{written} in its place" if written else LEFT_OUT


def _complaint(missing: dict[str, list[str]], hand: Repertoire, fallback: bool, spared: Collection[str]) -> str:
    named = [
        f"{_name(grapheme)} ({'; '.join(places[:3])}{f' and {len(places) - 3} more' if len(places) > 3 else ''})"
        for grapheme, places in list(missing.items())[:_MOST_NAMED]
    ]
    more = f", and {len(missing) - _MOST_NAMED} others" if len(missing) > _MOST_NAMED else ""
    few = f"; it can write only {''.join(sorted(hand.letters))}" if 0 < len(hand.letters) < _FEW else ""
    way_out = _way_out(missing, hand, fallback, spared)
    return f"The hand {hand.name} has no form for {', '.join(named)}{more}{few}: {way_out}."


def _way_out(missing: Collection[str], hand: Repertoire, fallback: bool, spared: Collection[str]) -> str:
    if any(unicodedata.bidirectional(grapheme[0]) in ("R", "AL") for grapheme in missing):
        return "handout writes from left to right alone"
    if fallback:
        return "use another hand"
    names = [_name(grapheme) for grapheme in missing if grapheme in hand.lendable]
    which = f", which can supply {'all' if len(names) == len(missing) else ' '.join(names)} of them" if names else ""
    pictures = [grapheme for grapheme in missing if grapheme in spared]
    ways = [f"accept similar forms{which}"] if names or any(borrow(one, hand, 0) for one in missing) else []
    ways += [f"leave {_pictures(pictures, missing)} out"] if pictures else []
    return "use another hand" + (f", or --fallback to {' and '.join(ways)}" if ways else "")


def _pictures(pictures: Sequence[str], missing: Collection[str]) -> str:
    if len(missing) == 1:
        return "it"
    return "them" if len(pictures) == len(missing) else " ".join(map(_name, pictures[:_MOST_NAMED]))


def _name(grapheme: str) -> str:
    if grapheme.isprintable():
        return f"'{grapheme}'"
    return "+".join(f"U+{ord(char):04X}" for char in grapheme)


def spelt(letter: Letter) -> str:
    """The grapheme that a letter and its accents are, NFC."""
    return compose_grapheme(letter.base, letter.marks)
