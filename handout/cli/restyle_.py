"""`handout restyle`: a drawing in another handstyle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from handout import units
from handout.cli.console import Console
from handout.cli.options import verb
from handout.pipeline.declarations import argument, output
from handout.pipeline.options import PictureOptions, PoseOptions, StyleOptions

if TYPE_CHECKING:
    from handout.pipeline.drawings import Styled


@verb("restyle")
def command(
    console: Console,
    source: Path = argument(metavar="DRAWING"),
    output: tuple[Path, ...] = output("SVG, PNG, PDF …"),
    styling: StyleOptions = StyleOptions(),
    posing: PoseOptions = PoseOptions(),
    picture: PictureOptions = PictureOptions(),
) -> None:
    """Draw DRAWING (SVG, InkML, JSON, UNIPEN, SVC, CYN, UIM or GML) in another handstyle.

    Every line is taken as a letter is: its extremes and corners become targets, which a hand in that style moves
    through. What `handout write` wrote as SVG, InkML or JSON can be restyled too.

    \b
    handout restyle drawing.svg -o tag.svg --style fast-tag --seed 1
    handout restyle drawing.svg -o brushed.png --pose artist.pose --pen brush

    With --pose the pen is held as the strokes of a library were; the drawing itself stays as it is unless a --style, or
    --trajectory, is asked for.
    """
    from handout.pipeline.drawings import restyle

    result = restyle(source, output, styling, picture, posing)
    left_out = f" Left out: {', '.join(result.told['left_out'])}." if result.told["left_out"] else ""
    count = result.source.about.get("drawings") if result.source is not None else None
    several = f" The file's {count} drawings lie beside and below one another." if count else ""
    warnings = "".join(f" Warning: {loss}" for loss in result.told["warnings"])
    console.report(result, sentence(result) + left_out + several + warnings)


def sentence(result: Styled) -> str:
    """One sentence about a drawing in a handstyle."""
    told = result.told
    manners = [f"in the style {told['style']}"] if told["style"] else []
    manners += [f"with the pose of {told['pose']}"] if "pose" in told else []
    return (
        f"Wrote {', '.join(map(str, result.files))}: {units.count(told['strokes'], 'stroke')} {' '.join(manners)}; "
        f"{units.duration(told['duration_s'])} of writing; seed {result.seed}."
    )
