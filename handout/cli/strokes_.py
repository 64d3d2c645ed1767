"""`handout strokes`: movements of a hand behind recorded or drawn strokes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from handout import units


@click.group("strokes")
def command() -> None:
    """Explain strokes by the movements of a hand, and draw such plans."""


@command.command("fit")
@click.argument("trace", type=click.Path(path_type=Path))
@click.option("--output", "-o", type=click.Path(path_type=Path), help="Write the plans here, as JSON.")
@click.option("--report", type=click.Path(path_type=Path), help="Write a picture of trace, fit and speeds here (SVG).")
@click.option("--shape-only", is_flag=True, help="Ignore the times of the trace.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
def fit(trace: Path, output: Path | None, report: Path | None, shape_only: bool, as_json: bool) -> None:
    """Find the plan behind every stroke of TRACE: InkML, UNIPEN, SVC, GML, SVG or a drawing in JSON.

    A plan is a few aimed pulses of lognormal speed. With the times of a recorded pen it keeps them; of a drawing
    without times it is made from the shape alone.

    \b
    handout strokes fit trace.inkml -o plan.json --report fit.svg
    """
    from handout import atomic
    from handout.errors import InputError
    from handout.motion.reconstruction import planned_page
    from handout.sinks import fit_svg, plans_json
    from handout.sources import read_drawing

    for path, suffix in ((output, ".json"), (report, ".svg")):
        if path is not None and path.suffix.lower() != suffix:
            raise InputError(f"{path}: this is written as {suffix[1:].upper()}; give a name that ends in {suffix}.")
    drawing = read_drawing(trace)
    if not drawing.strokes:
        raise InputError(f"{trace} has no strokes.")
    timed = drawing.timed and not shape_only and "timing" not in drawing.about
    page = planned_page.fit(drawing, timed=timed)
    files = {}
    if output is not None:
        files[output] = plans_json.to_json(page)
    if report is not None:
        files[report] = fit_svg.to_svg(drawing, page)
    for path, data in files.items():
        atomic.write(path, data)
    facts = _facts(page) | {"files": [str(path) for path in files]}
    if as_json:
        click.echo(json.dumps(facts, ensure_ascii=False))
    else:
        click.echo(_said(facts), err=True)


def _facts(page: Any) -> dict[str, Any]:
    """What `--json` prints: counts, and medians of how well the movements are explained."""
    import numpy as np

    moved = [one for one in page.fits if one.plan.strokes]
    speeds = [one.speed for one in moved if one.speed is not None]
    return {
        "movements": len(page.fits),
        "dots": len(page.fits) - len(moved),
        "strokes": sum(one.plan.strokes for one in moved),
        "timed": page.timed,
        "path_db": round(float(np.median([one.place for one in moved])), 2) if moved else None,
        "speed_db": round(float(np.median(speeds)), 2) if speeds else None,
        "speed_db_least": round(min(speeds), 2) if speeds else None,
    }


def _said(facts: dict[str, Any]) -> str:
    said = f"{units.count(facts['movements'], 'movement')}, {units.count(facts['strokes'], 'stroke')}"
    if facts["path_db"] is not None:
        said += f"; path {facts['path_db']:.1f} dB"
    if facts["speed_db"] is not None:
        said += f", speed {facts['speed_db']:.1f} dB (medians)"
    if not facts["timed"]:
        said += "; from the shape alone"
    return said + (f"; wrote {', '.join(facts['files'])}." if facts["files"] else ".")


@command.command("draw")
@click.argument("plan", type=click.Path(path_type=Path))
@click.option("--output", "-o", multiple=True, required=True, type=click.Path(path_type=Path), help="SVG, InkML, PNG …")
def draw(plan: Path, output: tuple[Path, ...]) -> None:
    """Draw the plans of PLAN, a JSON file that `fit` wrote, changed by hand or not.

    \b
    handout strokes draw plan.json -o again.svg
    """
    from handout.errors import InputError
    from handout.motion.reconstruction import planned_page
    from handout.sinks import check_outputs, write_drawings
    from handout.sources import plans_json

    check_outputs(output)
    try:
        data = plan.read_bytes()
    except OSError as error:
        raise InputError(f"Cannot read {plan}: {error.strerror or error}.") from error
    try:
        page = plans_json.from_json(data)
    except InputError as error:
        raise InputError(f"{plan}: {error}") from error
    files = write_drawings([planned_page.drawing(page)], output)
    click.echo(f"Wrote {', '.join(map(str, files))}.", err=True)
