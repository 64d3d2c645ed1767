"""The part of a plot that is drawn: which sheets, and from which place to which, by share, time or word.

A part begins and ends with whole words (of drawings, strokes), in the order in which they are drawn: the word that a
place lies in belongs to it.  Shares are of the ink of the sheets that are asked for, times those of their announced
time.
"""

from __future__ import annotations

import difflib
import itertools
import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from handout.errors import InputError
from handout.plotting.jobs.parts import words_of
from handout.plotting.planning.plan import Speed
from handout.plotting.planning.planner import plan
from handout.profiles import Plotter
from handout.values import Array, Drawing

_TIME = re.compile(r"(?:(\d+(?:\.\d+)?)h)?(?:(\d+(?:\.\d+)?)m(?:in)?)?(?:(\d+(?:\.\d+)?)s)?")
_SHARE = re.compile(r"(\d+(?:\.\d+)?)\s*%")
_SHEETS = re.compile(r"(\d+)(-)?(\d+)?")


class SheetStretch(NamedTuple):
    """Strokes of a sheet: its number, from 0, the first of them and the one after the last."""

    sheet: int
    first: int
    stop: int


class _Word(NamedTuple):
    """Strokes of one word: `SheetStretch`, the word's number on its sheet (−1: unknown), its text, mm of ink."""

    sheet: int
    first: int
    stop: int
    number: int
    text: str
    ink: float


def pieces(
    pages: Sequence[Drawing],
    profile: Plotter,
    speed: Speed = 1.0,
    *,
    begin: str | None = None,
    end: str | None = None,
    from_word: str | None = None,
    to_word: str | None = None,
    sheets: str = "",
) -> list[SheetStretch]:
    """What is drawn of the pages, whose strokes are in the order in which they are drawn.

    Parameters
    ----------
    begin, end : a share such as "40%", or a time such as "2m30s"; None: not limited.
    from_word, to_word : a word or several, or the number of one, from 1 on the first sheet that is asked for.
    sheets : numbers such as "2", "2-3", "1,4-"; "": all.

    Raises
    ------
    InputError
        What is asked for cannot be read, is not there, or has nothing in it.
    """
    if (begin and from_word) or (end and to_word):
        raise InputError("--from and --from-word (--to and --to-word) are two ways to say one thing: give one of them.")
    words = [word for sheet in _sheets(sheets, len(pages)) for word in _words(pages[sheet], sheet)]

    def read_mark(text: str) -> tuple[float, Array]:
        return _marks(text, words, pages, profile, speed)

    first, last = _find_first(begin, from_word, words, read_mark), len(words) - 1
    if end:
        place, marks = read_mark(end)
        last = int(np.searchsorted(marks[:-1], place, side="left")) - 1
    elif to_word:
        last = _find(to_word, words, first, "--to-word")[1]
    if first > last:
        places = f"{begin or from_word or 'the beginning'} and {end or to_word or 'the end'}"
        raise InputError(f"Nothing lies between {places}: is one before the other?")
    chosen = itertools.groupby(words[first : last + 1], lambda word: word.sheet)
    return [SheetStretch(sheet, (run := list(group))[0].first, run[-1].stop) for sheet, group in chosen]


def _find_first(
    begin: str | None, word: str | None, words: Sequence[_Word], marked: Callable[[str], tuple[float, Array]]
) -> int:
    """The run of strokes that a part begins with."""
    if begin:
        place, marks = marked(begin)
        return int(np.searchsorted(marks[1:], place, side="right"))
    return _find(word, words, 0, "--from-word")[0] if word else 0


def name_stretch(part: Sequence[SheetStretch], pages: Sequence[Drawing]) -> str:
    """A part as it is called in a sentence."""
    first, last, many = part[0], part[-1], len(part)
    begin, end = (
        _text(pages[piece.sheet], pages[piece.sheet].strokes[stroke].word)
        for piece, stroke in ((first, first.first), (last, last.stop - 1))
    )
    words = f', from "{begin}" to "{end}"' if begin and end else ""
    numbers = [f"{piece.sheet + 1}" for piece in part]
    gaps = last.sheet - first.sheet >= many
    sheets = f"sheets {', '.join(numbers) if gaps else f'{numbers[0]} to {numbers[-1]}'}"
    sheets = f"sheet {numbers[0]}" if many == 1 else sheets
    ink = sum(stroke.length for piece in part for stroke in pages[piece.sheet].strokes[piece.first : piece.stop])
    whole = sum(page.pen_down for page in pages)
    return f"Of {sheets}{words}: {ink / 1000:.2f} of {whole / 1000:.2f} m of ink."


def _sheets(text: str, many: int) -> list[int]:
    chosen = set[int]()
    for part in filter(None, (part.strip() for part in text.split(","))):
        match = _SHEETS.fullmatch(part)
        if match is None:
            raise InputError(f"--sheets: {part!r} is no number of a sheet; write 2, 2-3 or 2-.")
        first = int(match.group(1))
        last = int(match.group(3)) if match.group(3) else many if match.group(2) else first
        if not 1 <= first <= last <= many:
            raise InputError(f"--sheets: {part} is not within the sheets that there are, 1 to {many}.")
        chosen |= set(range(first - 1, last))
    return sorted(chosen) if text.strip() else list(range(many))


def _words(page: Drawing, sheet: int) -> list[_Word]:
    at, words = 0, []
    for run in words_of(page.strokes):
        number = run[0].word
        ink = sum(stroke.length for stroke in run)
        words.append(_Word(sheet, at, at + len(run), number, _text(page, number), ink))
        at += len(run)
    return words


def _text(page: Drawing, word: int) -> str:
    texts = page.about.get("words") or []
    return str(texts[word]) if 0 <= word < len(texts) else ""


def _marks(
    text: str, words: Sequence[_Word], pages: Sequence[Drawing], profile: Plotter, speed: Speed
) -> tuple[float, Array]:
    """A place that is asked for, and where the words begin and the last ends, in its measure: mm of ink, or s."""
    if match := _SHARE.fullmatch(text.strip()):
        ink = np.append(0.0, np.cumsum([word.ink for word in words]))
        share = float(match.group(1))
        if share > 100:
            raise InputError(f"{text} is more than 100%.")
        return share / 100 * float(ink[-1]), ink
    match = _TIME.fullmatch(text.strip())
    if match is None or not any(match.groups()):
        raise InputError(f"{text!r} is neither a share such as 40% nor a time such as 2m30s.")
    hours, minutes, seconds = (float(part or 0.0) for part in match.groups())
    return 3600 * hours + 60 * minutes + seconds, _clock(words, pages, profile, speed)


def _clock(words: Sequence[_Word], pages: Sequence[Drawing], profile: Plotter, speed: Speed) -> Array:
    """(words + 1,) float, s: when each begins by the announced time, and when all is done."""
    begins, later = list[float](), 0.0
    for sheet, group in itertools.groupby(words, lambda word: word.sheet):
        planned = plan(pages[sheet], profile, speed=speed)
        starts = planned.starts[planned.toolpath.first]
        begins += [later + (float(starts[word.first]) if word.first else 0.0) for word in group]
        later += planned.duration
    return np.array([*begins, later])


def _find(text: str, words: Sequence[_Word], first: int, option: str) -> tuple[int, int]:
    """The first and last run of one or several words, from run `first` on, or of the word with a number."""
    runs: dict[tuple[int, int], list[int]] = {}
    for at, word in enumerate(words):
        if word.number >= 0:
            runs.setdefault((word.sheet, word.number), []).append(at)
    order = [runs[kind] for kind in sorted(runs)]
    if text.isdecimal():
        if not 1 <= int(text) <= len(order):
            raise InputError(f"{option}: there is no word {text}; there are {len(order)}.")
        found = order[int(text) - 1]
        return found[0], found[-1]
    names = [_plain(words[run[0]].text) for run in order]
    wanted = list(filter(None, map(_plain, text.split())))
    for at in range(len(order) - len(wanted) + 1) if wanted else ():
        if names[at : at + len(wanted)] == wanted and order[at][0] >= first:
            return order[at][0], max(run[-1] for run in order[at : at + len(wanted)])
    near = difflib.get_close_matches(_plain(text), list(filter(None, names)), 3)
    hint = f"; there is {', '.join(dict.fromkeys(near))}" if near else ""
    raise InputError(f"{option}: {text!r} is not there{' after the beginning of the part' if first else ''}{hint}.")


def _plain(text: str) -> str:
    """A word without case and without the punctuation around it."""
    return re.sub(r"^\W+|\W+$", "", text).casefold()
