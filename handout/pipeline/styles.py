"""Handstyles: the one that is asked for, and styles learned from examples."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, cast

import numpy as np
from msgspec.structs import replace

from handout import atomic, units
from handout.errors import InputError
from handout.motion.learned.model import LearnedMovement, Lesson, learn, primer_of
from handout.motion.learned.sequences import Inputs
from handout.motion.styles.manner import MEASURES, measure_manner
from handout.motion.styles.style import Style, check_style, find
from handout.motion.styles.style_file import to_bytes
from handout.motion.styles.targets import letter_height
from handout.pipeline.inputs import output_path
from handout.pipeline.options import LessonOptions, StyleOptions, seed_of
from handout.pipeline.results import SILENT, Delivery, Listener
from handout.sources import read_drawing
from handout.tables import Angle
from handout.units import count
from handout.values import Drawing

_USUAL_STYLE = "fast-tag"
_LEAN = MEASURES.index("lean")
_USUAL_LEAN = 0.15  # rad: of what goes down, half-way between house-print and house-joined
_STEEPEST = 15.0  # degrees that a learned style leans more than usual, or less: by eye, letters still read
_NOISE = 0.02  # heights of a letter: motor noise at --jitter 1; set by eye


def style_of(styling: StyleOptions) -> Style:
    """The style that is asked for, changed as asked.

    Raises InputError: there is no such style, or a number is outside its bounds.
    """
    style = find(styling.style or _USUAL_STYLE)
    if styling.smooth is not None:
        movement = replace(style.movement, smooth=styling.smooth)
        style = replace(style, movement=movement)
    if styling.shear is not None:
        lean = Angle(units.parse(styling.shear, "angle", "shear", default="deg"))
        style = replace(style, form=replace(style.form, shear=lean))
    if styling.jitter is not None:
        noise = replace(style.jitter, size=_NOISE * styling.jitter)
        style = replace(style, jitter=noise)
    style = _moved_as_asked(style, styling)
    try:
        return check_style(style)
    except ValueError as error:
        raise InputError(f"style {style.name}: {error}") from error


def _moved_as_asked(style: Style, styling: StyleOptions) -> Style:
    """The style, if it is a learned one primed and as warm as asked."""
    given = [name for name in ("prime", "temperature") if getattr(styling, name) is not None]
    if not given:
        return style
    if style.model is None:
        raise InputError(f"--{given[0]} is for learned styles (.style): {style.name} moves by rules.")
    learned = style.learned
    if styling.temperature is not None:
        learned = replace(learned, temperature=styling.temperature)
    if styling.prime is not None and styling.prime not in style.model.primers:
        style = replace(style, model=_prime_model(style, style.model, styling.prime))
    return replace(style, learned=replace(learned, primer=styling.prime or learned.primer))


def _prime_model(style: Style, model: LearnedMovement, name: str) -> LearnedMovement:
    """The model with a drawing's file as another primer."""
    if not Path(name).suffix:
        known = ", ".join(model.primers) or "none"
        raise InputError(f"prime: {name!r} is no example of {style.name} ({known}), nor the file of a drawing.")
    drawing = read_drawing(name)
    try:
        primer = primer_of(drawing)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
    return LearnedMovement(model.dynamics, model.structure, {**model.primers, name: primer})


# what a learned style's file says
_TOML = """\
title = {title}
notes = {notes}

[form]
shear = "{lean:.0f}deg"         # how much more the examples lean to the right than a plain hand

[learned]
temperature = 0.5      # chance: 1 as in the examples
hold = 1.0             # how far the path is led through the places that a drawing passes
keep = 0.75            # share of a drawing's own bends and overlaps that stays where its words cannot be read
duration = "{duration:.0f}ms"

[brush]
kind = "speed"
width = 0.08
thin = 0.3
pace = 1.0
taper = 0.2
"""


def learn_style(
    examples: Sequence[str | Path],
    output: str | Path,
    lesson: LessonOptions = LessonOptions(),
    listener: Listener = SILENT,
) -> Delivery:
    """Learn how a hand moves from drawings (GML, InkML, UNIPEN, SVG …), one is enough, and keep it as a .style file.

    The drawings of a file with several are examples each.

    Raises InputError: a drawing that cannot be read, too little or too much to learn from, or a file of another name.
    """
    path = output_path(output, ".style", "a learned style is kept as")
    drawings = [drawing for example in examples for drawing in split_drawings(read_drawing(example))]
    untimed = sum(not drawing.timed or "timing" in drawing.about for drawing in drawings)
    how = Lesson(lesson.size, cast(Inputs, lesson.inputs))
    rng = np.random.default_rng(seed_of(lesson.seed))
    learned = learn({path.stem: drawings}, rng, how, listener.progress)
    seen = [measure_manner([s.xy for s in each.strokes], letter_height(each))[_LEAN] for each in drawings]
    slow = "Examples without times say nothing of how fast the hand is."
    told = {
        "style": path.stem,
        "drawings": len(drawings),
        "strokes": learned.strokes,
        "duration_s": round(learned.duration, 3),
        "lean_deg": round(float(np.clip(np.degrees(np.arctan(np.mean(seen)) - _USUAL_LEAN), -_STEEPEST, _STEEPEST))),
        "primers": list(learned.movement.primers),
        "seed": lesson.seed,
        "files": [str(path)],
    }
    atomic.write(path, to_bytes(toml_of(lesson.title or path.stem, told), learned.movement))
    return Delivery(seed=lesson.seed, files=(path,), told=told, notes=(slow,) if untimed else ())


def toml_of(title: str, told: Mapping[str, Any]) -> str:
    """The text that a learned style's file begins with; told : of it, as `learn_style` does."""
    notes = f"Learned from {count(told['drawings'], 'drawing')}, {count(told['strokes'], 'stroke')}."
    duration, lean = 1e3 * told["duration_s"], told["lean_deg"]
    return _TOML.format(title=json.dumps(title), notes=json.dumps(notes), duration=duration, lean=lean)


def split_drawings(drawing: Drawing) -> list[Drawing]:
    """The drawings of a file that holds several; any other is one."""
    if "drawings" not in drawing.about:
        return [drawing]
    groups = groupby(drawing.strokes, key=lambda stroke: stroke.word)
    return [dataclasses.replace(drawing, strokes=tuple(strokes)) for _, strokes in groups]
