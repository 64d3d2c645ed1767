"""Divides a job into parts: by sheet, by layer, and wherever the pen has drawn as much as it may between checks."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import Literal

import msgspec

from handout.errors import InputError
from handout.values import Drawing, Stroke

Layers = Literal["none", "name", "colour"]


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


def arrange_layers(drawing: Drawing, layers: Layers) -> Drawing:
    """The drawing with its strokes layer after layer, in the order in which the layers first occur."""
    if layers == "none":
        return drawing
    names = dict.fromkeys(layer_of(stroke, layers) for stroke in drawing.strokes)
    strokes = tuple(stroke for name in names for stroke in drawing.strokes if layer_of(stroke, layers) == name)
    return dataclasses.replace(drawing, strokes=strokes)


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


def parts(pages: Sequence[Sequence[PageLayer]], copies: int = 1, every: float | None = None) -> list[PlotPart]:
    """All parts of a job in order: copy after copy, page after page, layer after layer.

    Parameters
    ----------
    pages : as `survey` found them.
    every : mm of ink after which a pen is to be looked at; parts end between words then.

    Raises
    ------
    InputError
        Less than 10 mm between two looks.
    """
    if every is not None and not every >= 10.0:
        raise InputError(f"pause every: {every:g} mm of ink is less than 10 mm; give a length such as 20m.")
    used: dict[str, float] = {}  # mm a pen has drawn since it was last looked at
    in_order: list[PlotPart] = []
    for copy, (page, layers) in itertools.product(range(copies), enumerate(pages)):
        for layer in layers:
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


def list_requests(before: PlotPart | None, part: PlotPart, pages: int, layers: Sequence[str]) -> list[str]:
    """What a person has to do before a part, each as one request.

    Parameters
    ----------
    before : the part before it; None for the first.
    pages : how many pages one copy has.
    layers : the names of all layers of the job.
    """
    requests = []
    if before is not None and (before.copy, before.page) != (part.copy, part.page):
        requests.append(f"Put in sheet {part.copy * pages + part.page + 1}")
    if len(layers) > 1 and (before is None or before.layer != part.layer):
        requests.append(f"Put in the pen for {name_layer(part.layer)}")
    if part.checked:
        requests.append(f"The pen has drawn {part.checked / 1000:.1f} m: check it")
    return requests


def name_layer(layer: str) -> str:
    """A layer as it is called in a sentence."""
    return f"layer {layer!r}" if layer else "what is in no layer"
