"""Drawings and their movements: a drawing in another handstyle, a tag in letters of no alphabet, plans of strokes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from handout import atomic
from handout.errors import InputError
from handout.motion.styles.style import find
from handout.page_sizes import page
from handout.pipeline.inputs import output_path, read_bytes
from handout.pipeline.options import PictureOptions, PoseOptions, StyleOptions, seed_of
from handout.pipeline.poses import with_pose
from handout.pipeline.results import Delivery, Told
from handout.pipeline.styles import style_of
from handout.sinks import check_outputs, write_drawings
from handout.sources import read_drawing
from handout.values import Drawing, Page, Stroke

_LETTERS = 5  # of a tag
_SPACE = 0.1  # of the larger side of a copy, between copies on a sheet

if TYPE_CHECKING:
    from handout.motion.learned.training import PlanVariation
    from handout.motion.reconstruction.planned_page import PlannedPage


@dataclass(frozen=True, kw_only=True)
class Styled(Delivery):
    """A drawing in a handstyle; source : the drawing before, if there was one."""

    drawing: Drawing
    source: Drawing | None = None


def restyle(
    source: str | Path,
    outputs: Sequence[str | Path],
    styling: StyleOptions = StyleOptions(),
    picture: PictureOptions = PictureOptions(),
    posing: PoseOptions = PoseOptions(),
) -> Styled:
    """Draw a drawing (SVG, InkML, JSON, UNIPEN, SVC, CYN, UIM or GML) in another handstyle, to files.

    With a pose and no style the strokes stay where they are, and the pen is held as the pose library suggests.

    Raises InputError: the drawing cannot be read, or the style cannot draw it; a file that cannot be written.
    """
    from handout.motion.styles import restyling
    from handout.pipeline.rereading import open_drawing_reader
    from handout.pipeline.texts import hard_word_notes, name_hard_words

    check_outputs(outputs)
    look, seed = picture.look(styled=True), seed_of(styling.seed)
    style = None if posing.pose and styling == replace(StyleOptions(), seed=styling.seed) else style_of(styling)
    try:
        drawing = read_drawing(source)
        reading, names = open_drawing_reader(drawing) if style is not None and drawing.strokes else (None, [])
        rng = np.random.default_rng(seed)
        styled = drawing if style is None else restyling.restyle(drawing, style, rng, reading=reading)
        styled = with_pose(styled, posing)
    except InputError as error:
        raise InputError(str(error) if str(source) in str(error) else f"{source}: {error}") from error
    styled = replace(styled, about={**styled.about, "seed": seed})
    files = write_drawings([styled], outputs, replace(look, footprint=bool(posing.pose)))
    hard = name_hard_words(styled, names)
    losses = [] if style is None else [*restyling.losses(drawing, styled, style), *hard_word_notes(hard)]
    told = {
        "style": "" if style is None else style.name,
        **({"pose": held} if (held := str(styled.about.get("pose", "")) if posing.pose else "") else {}),
        "seed": seed,
        "strokes_before": len(drawing.strokes),
        "strokes": len(styled.strokes),
        "duration_s": round(styled.duration, 2),
        "left_out": [str(part) for part in drawing.about.get("left_out", [])],
        "warnings": losses,
        **({"hard_to_read": hard} if hard else {}),
        "files": [*map(str, files)],
    }
    return Styled(seed=seed, files=tuple(files), told=told, drawing=styled, source=drawing)


def asemic(
    outputs: Sequence[str | Path],
    letters: int | None = None,
    styling: StyleOptions = StyleOptions(),
    picture: PictureOptions = PictureOptions(),
    *,
    page_name: str = "148x105mm",
    structure: str | None = None,
) -> Styled:
    """Invent letters that mean nothing and write them as a tag, to files.

    letters : 1 to 60; None: 5.
    structure : a learned style whose examples the tag is built like; None: that of `styling`, if it has learned one.
    """
    from handout.motion.styles.asemic import tag

    check_outputs(outputs)
    look, style, seed = picture.look(styled=True), style_of(styling), seed_of(styling.seed)
    built = style if structure is None else find(structure)
    learned = built.model is not None and built.model.structure is not None
    if structure is not None and not learned:
        raise InputError(f"structure: {structure} has learned none; use a .style that handout style learn made.")
    drawing = tag(_LETTERS if letters is None else letters, style, page(page_name), np.random.default_rng(seed), built)
    drawing = replace(drawing, about={**drawing.about, "seed": seed})
    ends = "--letters: what is invented after examples ends as they do."
    notes = (ends,) if learned and letters is not None else ()
    files = tuple(write_drawings([drawing], outputs, look))
    told = {"style": style.name, "seed": seed, "letters": 0 if learned else letters or _LETTERS}
    told |= {"strokes": len(drawing.strokes), "duration_s": round(drawing.duration, 2), "files": [*map(str, files)]}
    return Styled(seed=seed, files=files, told=told, drawing=drawing, notes=notes)


@dataclass(frozen=True, kw_only=True)
class FittedStrokes(Delivery):
    """The plans behind the strokes of a drawing."""

    page: PlannedPage


def fit_strokes(
    trace: str | Path, output: Path | None = None, report: Path | None = None, *, shape_only: bool = False
) -> FittedStrokes:
    """Find the plan behind every stroke of a drawing; `output` (JSON) keeps the plans, `report` (SVG) shows the fit.

    Raises InputError: the drawing cannot be read or has no strokes; a file of another format is asked for.
    """
    from handout.motion.reconstruction import planned_page
    from handout.sinks import plans

    for path, suffix in ((output, ".json"), (report, ".svg")):
        if path is not None:
            output_path(path, suffix, "this is written as")
    drawing = read_drawing(trace)
    if not drawing.strokes:
        raise InputError(f"{trace} has no strokes.")
    timed = drawing.timed and not shape_only and "timing" not in drawing.about
    fitted = planned_page.fit(drawing, timed=timed)
    files = {}
    if output is not None:
        files[output] = plans.to_json(fitted)
    if report is not None:
        files[report] = plans.fit_report(drawing, fitted)
    atomic.write_all(files.items())
    return FittedStrokes(files=tuple(files), told=_fit_facts(fitted, files), page=fitted)


def _fit_facts(fitted: PlannedPage, files: Iterable[Path]) -> Told:
    """What is told of fitted strokes: how well paths and speeds are explained, medians."""
    moved = [fit for fit in fitted.fits if fit.plan.strokes]  # movements that are no dots
    speeds = [fit.speed for fit in moved if fit.speed is not None]  # dB, where times are known
    return {
        "movements": len(fitted.fits),
        "dots": len(fitted.fits) - len(moved),
        "strokes": sum(fit.plan.strokes for fit in moved),
        "timed": fitted.timed,
        "path_db": round(float(np.median([fit.place for fit in moved])), 2) if moved else None,
        "speed_db": round(float(np.median(speeds)), 2) if speeds else None,
        "speed_db_least": round(min(speeds), 2) if speeds else None,
        "files": [*map(str, files)],
    }


def draw_plans(
    plans: Path,
    outputs: Sequence[str | Path],
    styling: StyleOptions = StyleOptions(),
    picture: PictureOptions = PictureOptions(),
    copies: int | None = None,
) -> Delivery:
    """Draw the plans of a JSON file that `fit_strokes` wrote, changed by hand or not, or of targets alone, to files.

    Targets alone are moved through in a style, the usual one if none is asked for; plans only if one is.

    copies : draw them so many times on one sheet, each a little different: plans as those are from which styles are
        learned, in their targets, overlaps and bends; targets alone by chance of their style.  None: once, as they are.

    Raises InputError: the file cannot be read, or holds no plans; a number of copies outside 1 to 500.
    """
    if copies is not None and not 1 <= copies <= 500:
        raise InputError(f"copies: {copies} is outside 1 to 500.")
    check_outputs(outputs)
    seed = seed_of(styling.seed)
    draw, notes, styled = _drawer(plans, styling)
    if copies is None:
        drawing = draw(np.random.default_rng(seed), None)
    else:
        from handout.motion.learned.training import PlanVariation

        drawing = _side_by_side([draw(np.random.default_rng((seed, copy)), PlanVariation()) for copy in range(copies)])
    look = picture.look(styled=styled)
    files = write_drawings([replace(drawing, about={**drawing.about, "seed": seed})], outputs, look)
    told = {"strokes": len(drawing.strokes), "copies": copies or 1, "seed": seed, "files": [*map(str, files)]}
    return Delivery(seed=seed, files=tuple(files), told=told, notes=notes)


Drawer = Callable[[np.random.Generator, "PlanVariation | None"], Drawing]


def _drawer(plans: Path, styling: StyleOptions) -> tuple[Drawer, tuple[str, ...], bool]:
    """What draws the plans of a file, notes on what it leaves out, and whether a style does it."""
    from handout.motion.reconstruction import planned_page
    from handout.motion.styles import restyling, target_plans
    from handout.sources import plans as plan_files

    data = read_bytes(plans)
    alone = plan_files.look_like_targets(data)
    style = style_of(styling) if alone or styling != replace(StyleOptions(), seed=styling.seed) else None
    try:
        if alone:
            thrown = plan_files.read_targets(data)
            assert style is not None
            unused = "The ellipses are left out: a learned style takes targets as they are."
            notes = (unused,) if style.model is not None and thrown.has_ellipses else ()
            return lambda rng, _: target_plans.draw_plan(thrown, style, rng), notes, True
        fitted = plan_files.from_json(data)
    except InputError as error:
        raise InputError(f"{plans}: {error}") from error

    def draw(rng: np.random.Generator, variation: PlanVariation | None) -> Drawing:
        page = fitted if variation is None else planned_page.vary_page(fitted, variation, rng)
        drawing = planned_page.drawing(page)
        return drawing if style is None else restyling.restyle(drawing, style, rng)

    return draw, (), style is not None


def _side_by_side(drawings: Sequence[Drawing]) -> Drawing:
    """Drawings of about one size on one sheet, row by row, one after the other in time."""
    boxes = np.array([drawing.bounds or (0.0, 0.0, 1.0, 1.0) for drawing in drawings])
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    cell = (high - low) + _SPACE * float((high - low).max())
    columns = max(1, round(math.sqrt(len(drawings) * float(cell[1] / cell[0]) * math.sqrt(2))))
    rows = -(-len(drawings) // columns)
    strokes, clock = list[Stroke](), 0.0
    for number, drawing in enumerate(drawings):
        corner = cell * (number % columns, number // columns) + 0.5 * (cell - (high - low)) - low
        strokes += [replace(stroke, t=stroke.t + clock, xy=stroke.xy + corner) for stroke in drawing.strokes]
        clock += drawing.duration + 0.5
    size = cell * (columns, rows)
    about = {**drawings[0].about, "title": f"{len(drawings)} variations"}
    return Drawing(tuple(strokes), Page(float(size[0]), float(size[1])), about)
