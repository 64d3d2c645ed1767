"""Divides a job into parts: by sheet, by layer, and wherever the pen has drawn as much as it may between checks.

A stretch of a plot can be asked for, too: which sheets, and from which place to which, by share, time or word. It
begins and ends with whole words (of drawings, strokes), in the order in which they are drawn: the word that a place
lies in belongs to it. Shares are of the ink of the sheets that are asked for, times those of their announced time.
"""

from __future__ import annotations

import dataclasses
import difflib
import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Literal, NamedTuple

import msgspec
import numpy as np

from handout.errors import InputError
from handout.plotting.planning.plan import Plan
from handout.profiles import PenTurn
from handout.values import Array, Drawing, Stroke

Layers = Literal["none", "name", "colour"]


def turn_of(layer: str, turns: Sequence[PenTurn]) -> PenTurn:
    """The turn of a layer."""
    return next((turn for turn in turns if turn.layer == layer), PenTurn(layer))


def in_turn(layers: Iterable[str], turns: Sequence[PenTurn]) -> list[str]:
    """Layers in the order in which they are drawn; those that are left out come last."""
    order = {turn.layer: number for number, turn in enumerate(turns)}
    return sorted(layers, key=lambda name: (turn_of(name, turns).out, order.get(name, len(order))))


class PlotPart(msgspec.Struct, frozen=True, array_like=True):
    """Strokes that are drawn without help from a person.

    page : its number, from 0; copy : from 0; layer : name or colour of the layer.
    first, stop : its strokes are ``strokes[first:stop]`` of the page as `arranged`; ink : mm they draw.
    checked : mm the pen has drawn when it is to be looked at before this part; 0 if it is not to be.
    """

    page: int
    copy: int
    layer: str
    first: int
    stop: int
    ink: float
    checked: float = 0.0


class PageLayer(msgspec.Struct, frozen=True, array_like=True):
    """One layer of a page as `arranged`.

    ends : where each of its words ends, as an index of the page's strokes; ink : mm that each word draws.
    """

    name: str
    first: int
    ends: tuple[int, ...]
    ink: tuple[float, ...]


def layer_of(stroke: Stroke, layers: Layers) -> str:
    """The layer a stroke is drawn with."""
    return {"none": "", "name": stroke.layer, "colour": stroke.colour}[layers]


def arrange_layers(drawing: Drawing, layers: Layers, turns: Sequence[PenTurn] = ()) -> Drawing:
    """The drawing with its strokes layer after layer, `in_turn`, else in the order in which the layers first occur."""
    if layers == "none":
        return drawing
    names = in_turn(dict.fromkeys(layer_of(stroke, layers) for stroke in drawing.strokes), turns)
    strokes = tuple(stroke for name in names for stroke in drawing.strokes if layer_of(stroke, layers) == name)
    return dataclasses.replace(drawing, strokes=strokes)


def without(drawing: Drawing, layers: Layers, turns: Sequence[PenTurn]) -> Drawing:
    """The drawing without the layers that are left out; itself where none is."""
    out = [turn.layer for turn in turns if turn.out]
    strokes = tuple(stroke for stroke in drawing.strokes if layer_of(stroke, layers) not in out) if out else ()
    return dataclasses.replace(drawing, strokes=strokes) if out else drawing


def survey(drawing: Drawing, layers: Layers) -> tuple[PageLayer, ...]:
    """The layers of an `arranged` page with their words, as `parts` takes them."""
    surveyed, at = [], 0
    for name, group in itertools.groupby(drawing.strokes, lambda stroke: layer_of(stroke, layers)):
        first, ends, ink = at, [], []
        for word in words_of(list(group)):
            at += len(word)
            ends.append(at)
            ink.append(sum(stroke.length for stroke in word))
        surveyed.append(PageLayer(name, first, tuple(ends), tuple(ink)))
    return tuple(surveyed)


def words_of(strokes: Sequence[Stroke]) -> Iterator[list[Stroke]]:
    """Runs of strokes of one word; a stroke of unknown word is a run by itself."""
    run: list[Stroke] = []
    for stroke in strokes:
        if run and (stroke.word < 0 or stroke.word != run[-1].word):
            yield run
            run = []
        run.append(stroke)
    if run:
        yield run


def parts(
    pages: Sequence[Sequence[PageLayer]], copies: int = 1, every: float | None = None, turns: Sequence[PenTurn] = ()
) -> list[PlotPart]:
    """All parts of a job in order: copy after copy, page after page, layer after layer, without those left out.

    pages : as `survey` found them.
    every : mm of ink after which a pen is to be looked at; parts end between words then.

    Raises InputError: less than 10 mm between two looks.
    """
    if every is not None and not every >= 10.0:
        raise InputError(f"pause every: {every:g} mm of ink is less than 10 mm; give a length such as 20m.")
    used: dict[str, float] = {}  # mm a pen has drawn since it was last looked at
    in_order: list[PlotPart] = []
    for copy, (page, layers) in itertools.product(range(copies), enumerate(pages)):
        named = {layer.name: layer for layer in layers if not turn_of(layer.name, turns).out}
        for layer in map(named.__getitem__, in_turn(named, turns)):
            if every is None:
                in_order.append(PlotPart(page, copy, layer.name, layer.first, layer.ends[-1], sum(layer.ink)))
            else:
                in_order += _divide_layer(page, copy, layer, every, used)
    return in_order


def _divide_layer(page: int, copy: int, layer: PageLayer, every: float, used: dict[str, float]) -> Iterator[PlotPart]:
    """One layer, cut where its pen has drawn enough."""
    first, ink, checked = layer.first, 0.0, 0.0
    before = used.get(layer.name, 0.0)
    begin = layer.first
    for end, more in zip(layer.ends, layer.ink, strict=True):
        if before > 0 and before + more > every:
            if begin > first:
                yield PlotPart(page, copy, layer.name, first, begin, ink, checked)
            first, ink, checked, before = begin, 0.0, before, 0.0
        before, ink, begin = before + more, ink + more, end
    used[layer.name] = before
    yield PlotPart(page, copy, layer.name, first, begin, ink, checked)


def list_requests(
    before: PlotPart | None, part: PlotPart, pages: int, layers: Sequence[str], turns: Sequence[PenTurn] = ()
) -> list[str]:
    """What a person has to do before a part, each as one request.

    before : the part before it; None for the first.
    pages : how many pages one copy has.
    layers : the names of all layers of the job.
    """
    requests = []
    if before is not None and (before.copy, before.page) != (part.copy, part.page):
        requests.append(f"Put in sheet {part.copy * pages + part.page + 1}")
    pens = [turn_of(each.layer, turns).pen or name_layer(each.layer) for each in (before, part) if each is not None]
    if len(layers) > 1 and len({*pens}) == (2 if before else 1):
        named = turn_of(part.layer, turns).pen
        requests.append(f"Put in {named}" if named else f"Put in the pen for {name_layer(part.layer)}")
    if part.checked:
        requests.append(f"The pen has drawn {part.checked / 1000:.1f} m: check it")
    return requests


def name_layer(layer: str) -> str:
    """A layer as it is called in a sentence."""
    return f"layer {layer!r}" if layer else "what is in no layer"


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
    plan_page: Callable[[Drawing], Iterable[Plan]],
    *,
    begin: str | None = None,
    end: str | None = None,
    from_word: str | None = None,
    to_word: str | None = None,
    sheets: str = "",
) -> list[SheetStretch]:
    """What is drawn of the pages, whose strokes are in the order in which they are drawn.

    plan_page : the plans of a page, one after the other, by which it is timed.
    begin, end : a share such as "40%", or a time such as "2m30s"; None: not limited.
    from_word, to_word : a word or several, or the number of one, from 1 on the first sheet that is asked for.
    sheets : numbers such as "2", "2-3", "1,4-"; "": all.

    Raises InputError: what is asked for cannot be read, is not there, or has nothing in it.
    """
    if (begin and from_word) or (end and to_word):
        raise InputError("--from and --from-word (--to and --to-word) are two ways to say one thing: give one of them.")
    words = [word for sheet in _sheets(sheets, len(pages)) for word in _words(pages[sheet], sheet)]

    def read_mark(text: str) -> tuple[float, Array]:
        return _marks(text, words, pages, plan_page)

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
    text: str, words: Sequence[_Word], pages: Sequence[Drawing], plan_page: Callable[[Drawing], Iterable[Plan]]
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
    return 3600 * hours + 60 * minutes + seconds, _clock(words, pages, plan_page)


def _clock(words: Sequence[_Word], pages: Sequence[Drawing], plan_page: Callable[[Drawing], Iterable[Plan]]) -> Array:
    """(words + 1,) float, s: when each begins by the announced time, and when all is done."""
    begins, later = list[float](), 0.0
    for sheet, group in itertools.groupby(words, lambda word: word.sheet):
        starts, before = list[float](), later
        for planned in plan_page(pages[sheet]):
            starts += (later + planned.starts[planned.toolpath.first]).tolist()
            later += planned.duration
        begins += [starts[word.first] if word.first else before for word in group]
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
