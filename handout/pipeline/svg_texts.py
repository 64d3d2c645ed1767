"""The texts of an SVG that is plotted: written in the hand, each at its place, size and angle; and what it asks for."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from handout import units
from handout.errors import InputError
from handout.pipeline.results import Facts
from handout.pipeline.texts import STROKES, WritingTask, draw, set_parts, title
from handout.sources.svg.document import Text
from handout.values import TURNS, Array, Drawing, Manuscript, Page, Stroke
from handout.writing.layout import FOOT_ABOVE_RULE, Layout, Ruling

_LINE = 1.2  # times the size of letters: the usual distance of lines in CSS, in which those of the hand are to fit
_LARGEST = 0.5  # of the size of letters: x-height of usual fonts, as CSS takes it for an ex; the hand's is no larger
_AROUND = 60.0  # mm of blank paper around what is set
_SPACE = 0.4  # of the size of letters: a blank at the end of a part; set by eye, beside the hands' own
_PAUSE = 0.1  # s between a text and what is drawn before and behind it


def with_texts(name: str, drawing: Drawing, task: WritingTask) -> tuple[Drawing, Manuscript | None, tuple[str, ...]]:
    """A drawing with its texts written by the hand of a task, their writing, and sentences on what was written or not.

    A text whose letters the hand lacks, that is too small or too large to be written, or goes over the edge of the
    sheet, is left out and named.
    """
    if "texts" not in drawing.about:
        return drawing, None, ()
    texts: tuple[Text, ...] = drawing.about["texts"]
    about = {key: value for key, value in drawing.about.items() if key != "texts"}
    written, left = _try_texts(texts, task)
    placed = _place_texts(texts, written)
    for number, group in tuple(placed.items()):
        xy = np.concatenate([stroke.xy for stroke in group])
        if (xy < 0).any() or (xy > (drawing.page.width, drawing.page.height)).any():
            left[title(texts[number].text)] = "it would go over the edge of the sheet: move it, or make it smaller"
            del placed[number], written[number]
    strokes = _in_order(drawing.strokes, texts, placed)
    notes = [f"{units.count(len(written), 'text')} of {name} written in {task.hand.name}."] if written else []
    notes += [f"Left out of {name}, the text {text!r}: {why}." for text, why in left.items()]
    if not strokes:
        raise InputError(f"{name}: there is nothing to draw. {' '.join(notes)}")
    drawing = replace(drawing, strokes=strokes, about=about, timed=drawing.timed or not drawing.strokes)
    whole = _join_pages([manuscript for _, manuscript in written.values()], drawing.page)
    return drawing, whole, tuple(notes)


def _join_pages(manuscripts: Sequence[Manuscript], page: Page) -> Manuscript:
    """All that was written, and what is told of it, as of one page."""
    told = {name: [x for each in manuscripts for x in each.about.get(name, ())] for name in ("borrowed", "doubtful")}
    return Manuscript(tuple(line for each in manuscripts for line in each.lines), page, 0.0, told)


def _try_texts(
    texts: Sequence[Text], task: WritingTask
) -> tuple[dict[int, tuple[Drawing, Manuscript]], dict[str, str]]:
    """Write the texts that can be written (number → pages), and say why the others cannot."""
    layouts, left = dict[int, Layout](), dict[str, str]()
    for number, text in enumerate(texts):
        try:
            if text.text.strip():
                layouts[number] = _layout(text, task)
        except InputError as error:
            left[title(text.text)] = str(error).rstrip(".")
    try:
        return _write_texts(texts, layouts, task), left
    except InputError:  # which of them
        for number, layout in tuple(layouts.items()):
            try:
                _write_texts(texts, {number: layout}, task)
            except InputError as error:
                left[title(texts[number].text)] = str(error).rstrip(".")
                del layouts[number]
    return _write_texts(texts, layouts, task), left


def _scale(text: Text) -> float:
    """mm a px, on average of all directions."""
    return math.sqrt(abs(float(np.linalg.det(text.to_mm[:, :2]))))


def _layout(text: Text, task: WritingTask) -> Layout:
    """How a text is set on a line of its own, its beginning at `_AROUND`, `_AROUND`, in mm of its page."""
    x_height = min(_LARGEST, _LINE / task.hand.pitch) * text.size * _scale(text)
    return Layout(
        Page(2 * _AROUND + 20 * x_height * len(text.text), 2 * _AROUND),
        (0.0, 0.0, 0.0, _AROUND),
        x_height,
        align="left",
        jitter=task.layout.jitter,
        ruling=Ruling(((_AROUND + FOOT_ABOVE_RULE, 0.0),)),
    )


def _write_texts(
    texts: Sequence[Text], layouts: dict[int, Layout], task: WritingTask
) -> dict[int, tuple[Drawing, Manuscript]]:
    """Some of the texts, each on a page of its own."""
    if not layouts:
        return {}
    task, sheets = set_parts([texts[number].text.strip() for number in layouts], [*layouts.values()], task, 0)
    pages = zip(layouts, sheets, strict=True)
    return {number: (draw(sheet.manuscript, task, sheet.rng, {}, STROKES), sheet.manuscript) for number, sheet in pages}


def _place_texts(
    texts: Sequence[Text], written: dict[int, tuple[Drawing, Manuscript]]
) -> dict[int, tuple[Stroke, ...]]:
    """The strokes of every text where it belongs, mm on the drawing's page."""
    placed, chunk = dict[int, tuple[Stroke, ...]](), list[tuple[int, float]]()
    ends = {number for number, text in enumerate(texts) if text.x is not None} | {len(texts)}
    at = 0.0
    for number, text in enumerate(texts):
        at += text.dx
        chunk.append((number, at))
        if number in written:
            bounds = written[number][0].bounds
            wide = (bounds[2] - _AROUND) / _scale(text) if bounds is not None else 0.0
            at += max(wide, 0.0) + _SPACE * text.size * (text.text.endswith(" ") + text.text.startswith(" "))
        if number + 1 in ends:
            first = texts[chunk[0][0]]
            start = (first.x or 0.0) - at * {"middle": 0.5, "end": 1.0}.get(first.anchor, 0.0)
            for each, begin in chunk:
                if each in written:
                    blank = _SPACE * texts[each].size * texts[each].text.startswith(" ")
                    placed[each] = _move_strokes(texts[each], written[each][0].strokes, start + begin + blank)
            chunk, at = [], 0.0
    return placed


def _move_strokes(text: Text, strokes: Sequence[Stroke], x: float) -> tuple[Stroke, ...]:
    """Move the strokes of a text to its baseline, on which it begins at x, px."""
    turn, scale = text.to_mm[:, :2], _scale(text)
    angle = math.atan2(turn[1, 0], turn[0, 0])

    def on_page(xy: Array) -> Array:
        return np.asarray(((xy - _AROUND) / scale + (x, text.y)) @ turn.T + text.to_mm[:, 2])

    return tuple(
        replace(
            stroke,
            xy=on_page(stroke.xy),
            layer=text.layer,
            colour=text.colour or stroke.colour,
            **{name: values + angle for name in TURNS if (values := getattr(stroke, name)) is not None},
        )
        for stroke in strokes
    )


def _in_order(
    lines: Sequence[Stroke], texts: Sequence[Text], placed: dict[int, tuple[Stroke, ...]]
) -> tuple[Stroke, ...]:
    """Lines and texts one after the other, as they are painted, on one clock; words are counted through all texts."""
    strokes, clock, words = list[Stroke](), 0.0, 0
    at = 0
    for number, group in (*placed.items(), (len(texts), ())):
        until = texts[number].after if number < len(texts) else len(lines)
        parts = [(lines[at:until], 0), (group, words)]
        at = until
        for part, first in parts:
            if part:
                shift = clock - float(part[0].t[0])
                strokes += [replace(s, t=s.t + shift, word=s.word + first if s.word >= 0 else -1) for s in part]
                clock = float(strokes[-1].t[-1]) + _PAUSE
                words = max(words, *(stroke.word + 1 for stroke in strokes[-len(part) :]))
    return tuple(strokes)


def describe_drawing(name: str, drawing: Drawing) -> tuple[str, Facts]:
    """What a drawing asks for, in a sentence and for JSON: its sheet, where it lies there, its pens and its layers."""
    width, height = drawing.page.width, drawing.page.height
    box = [round(side, 1) for side in drawing.bounds or (0.0, 0.0, 0.0, 0.0)]
    colours = Counter(stroke.colour for stroke in drawing.strokes)
    layers = Counter(stroke.layer for stroke in drawing.strokes)
    pens, named = (
        units.listed(f"{name or 'none'} ({count})" for name, count in counts.most_common())
        for counts in (colours, layers)
    )
    left, top, right, bottom = box
    sentence = (
        f"{name} asks for a sheet of {width:.4g} x {height:.4g} mm: {units.count(len(drawing.strokes), 'stroke')} "
        f"from {left:g}, {top:g} to {right:g}, {bottom:g} mm from its upper left corner. Colours of pens: {pens}."
        + (f" Layers: {named}." if set(layers) != {""} else "")
    )
    facts: Facts = {"page_mm": [round(width, 2), round(height, 2)], "box_mm": box}
    return sentence, {**facts, "colours": dict(colours), "layers": dict(layers)}
