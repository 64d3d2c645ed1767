"""The layers of a drawing in files that have some: of each ink, line or word, under names that a person can read."""

from __future__ import annotations

import textwrap
from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

from handout.values import Drawing

By = Literal["ink", "line", "word"]
_INSIDE: dict[By, tuple[By, ...]] = {"ink": ("line", "word"), "line": ("word",), "word": ()}
_LONGEST = 40  # characters of a line's text in its name


def layers(drawing: Drawing, by: By = "ink") -> dict[str, list[int]]:
    """The strokes of each layer, by their numbers, in the order of writing.

    by : "ink": a layer for every layer and colour of the drawing's own, "Page 1" where these are all alike; "line" and
        "word": a layer for each of them, where the drawing tells of such.
    """
    return _group_strokes(drawing, by, range(len(drawing.strokes)), alone=True)


def group_inside(drawing: Drawing, by: By, strokes: Sequence[int]) -> tuple[By | None, dict[str, list[int]]]:
    """The groups in a layer of that kind and their kind: its lines or, of a line, its words; none in a word.

    Strokes of no line or word have the name "".
    """
    for kind in _INSIDE[by]:
        found = _group_strokes(drawing, kind, strokes, alone=False)
        if list(found) != [""]:
            return kind, found
    return None, {"": list(strokes)}


def _group_strokes(drawing: Drawing, by: By, strokes: Sequence[int], *, alone: bool) -> dict[str, list[int]]:
    """Numbers of strokes under the names of their groups; `alone`: whether the names stand for themselves."""
    if by == "ink":
        page = drawing.about.get("page_number")
        usual = f"Page {page if isinstance(page, int) else 1}"
        several = len({stroke.colour for stroke in drawing.strokes}) > 1
        named = ((stroke.layer, stroke.colour if several else "") for stroke in drawing.strokes)
        name = dict(enumerate(" ".join(filter(None, parts)) or usual for parts in named))
    else:
        name = _read_text(drawing).names(by, alone, strokes)
    found: dict[str, list[int]] = {}
    for number in strokes:
        found.setdefault(name[number], []).append(number)
    return found


class _Text:
    """What a drawing tells of its words and lines."""

    def __init__(self, drawing: Drawing) -> None:
        words, lines = drawing.about.get("words"), drawing.about.get("lines")
        self._strokes = drawing.strokes
        self._words = [str(word) for word in words] if isinstance(words, list | tuple) else []
        self._first = sorted(at for at in lines if isinstance(at, int)) if isinstance(lines, list | tuple) else []

    def names(self, by: By, alone: bool, strokes: Sequence[int]) -> dict[int, str]:
        """The names of some strokes' lines or words, by their numbers."""
        name = self._line if by == "line" else self._number_word if alone else self._word
        words = {number: self._strokes[number].word for number in strokes}
        known = {word: name(word) if word >= 0 else "" for word in set(words.values())}
        return {number: known[word] or ("Page 1" if alone else "") for number, word in words.items()}

    def _word(self, word: int) -> str:
        return (self._words[word] if word < len(self._words) else "") or f"word {word + 1}"

    def _number_word(self, word: int) -> str:
        """Words come more than once, and layers are sorted by their names."""
        return f"{word + 1:03d} {self._word(word)}".removesuffix(f" word {word + 1}")

    def _line(self, word: int) -> str:
        line = bisect_right(self._first, word)
        if not line:
            return ""
        behind = self._first[line] if line < len(self._first) else len(self._words)
        text = " ".join(self._words[self._first[line - 1] : behind])
        return f"line {line}: {textwrap.shorten(text, _LONGEST, placeholder=' …')}" if text else f"line {line}"


_read_text = lru_cache(maxsize=1)(_Text)  # each line of a drawing asks
