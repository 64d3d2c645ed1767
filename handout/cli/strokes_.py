"""`handout strokes`: movements of a hand behind recorded or drawn strokes."""

from __future__ import annotations

from pathlib import Path

import click

from handout import units
from handout.cli.console import Console
from handout.cli.options import JSON, verb
from handout.pipeline.declarations import option, output
from handout.pipeline.options import PictureOptions, StyleOptions


@click.group("strokes")
def command() -> None:
    """Explain strokes by the movements of a hand, and draw such plans."""


@verb("fit", command)
def fit(
    trace: Path,
    output: Path | None = output("Write the plans here, as JSON.", required=False),
    report: Path | None = option(None, "Write a picture of trace, fit and speeds here (SVG)."),
    shape_only: bool = option(False, "Ignore the times of the trace."),
    as_json: bool = JSON,
) -> None:
    """Find the plan behind every stroke of TRACE: InkML, UNIPEN, SVC, GML, SVG or a drawing in JSON.

    A plan is a few aimed pulses of lognormal speed. With the times of a recorded pen it keeps them; of a drawing
    without times it is made from the shape alone.

    \b
    handout strokes fit trace.inkml -o plan.json --report fit.svg
    """
    from handout.pipeline.drawings import fit_strokes

    result = fit_strokes(trace, output, report, shape_only=shape_only)
    told = result.told
    sentence = f"{units.count(told['movements'], 'movement')}, {units.count(told['strokes'], 'stroke')}"
    if told["path_db"] is not None:
        sentence += f"; path {told['path_db']:.1f} dB"
    if told["speed_db"] is not None:
        sentence += f", speed {told['speed_db']:.1f} dB (medians)"
    if not told["timed"]:
        sentence += "; from the shape alone"
    sentence += f"; wrote {', '.join(told['files'])}." if told["files"] else "."
    Console(as_json, quiet=as_json).report(result, sentence)


@verb("draw", command)
def draw(
    console: Console,
    plan: Path,
    output: tuple[Path, ...] = output("SVG, InkML, PNG …"),
    styling: StyleOptions = StyleOptions(),
    picture: PictureOptions = PictureOptions(),
) -> None:
    """Draw the plans of PLAN, a JSON file that `fit` wrote, changed by hand or not, or of targets alone.

    Targets alone are drawn in a style, plans only if one is given.

    \b
    handout strokes draw plan.json -o again.svg
    echo '{"targets": [[0, 30], [8, 0], [16, 30], [24, 0], [32, 30]]}' > targets.json
    handout strokes draw targets.json --style calm -o wave.svg
    """
    from handout.pipeline.drawings import draw_plans

    result = draw_plans(plan, output, styling, picture)
    console.report(
        result, f"Wrote {', '.join(map(str, result.files))}: {units.count(result.told['strokes'], 'movement')}."
    )


@verb("vary", command)
def vary(
    console: Console,
    plan: Path,
    output: tuple[Path, ...] = output("SVG, InkML, PNG …"),
    copies: int = option(20, "1 to 500."),
    styling: StyleOptions = StyleOptions(),
    picture: PictureOptions = PictureOptions(),
) -> None:
    """Draw PLAN many times on one sheet, each copy a little different.

    \b
    handout strokes vary plan.json --copies 20 -o sheet.svg
    """
    from handout.pipeline.drawings import draw_plans

    result = draw_plans(plan, output, styling, picture, copies)
    console.report(result, f"Wrote {', '.join(map(str, result.files))}: {copies} copies; seed {result.seed}.")
