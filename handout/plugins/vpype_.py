"""handout in vpype: ``vpype handout "Dear Ada" --hand house-joined linesimplify write out.svg``; drawings to and fro.

vpype knows lines in CSS pixels and no time: what comes back from it is a drawing that is not timed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click
import numpy as np
import vpype
import vpype_cli

from handout import page_sizes, pathdata
from handout.cli.options import list_options
from handout.errors import HandoutError, InputError
from handout.pipeline.declarations import build_options, bundle
from handout.pipeline.options import SheetOptions, WritingOptions
from handout.units import PX
from handout.values import Drawing, Page, Stroke

_TOLERANCE = 0.02  # mm between the strokes and the lines that vpype gets
_DOT = 1e-2  # px
_PACE, _LIFT = 50.0, 0.1  # mm/s and s, of lines without times
_MARGIN = 5.0  # mm around lines whose page is not known


class _TextFirst(click.Command):
    """A command of a chain whose options may also follow its text, as in `handout write`.

    In a chain click ends a command's options at its first argument, for what follows may be the next command.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        takes = {name: not getattr(param, "is_flag", False) for param in self.params for name in param.opts}
        before = _options_end(args, 0, takes)
        end = _options_end(args, before + 1, takes)
        text = args[before : before + 1]
        args = [*args[:before], *args[before + 1 : end], *text, *args[end:]]
        return super().parse_args(ctx, args)


def _options_end(args: list[str], at: int, takes: dict[str, bool]) -> int:
    """Where the options that begin at `at` end; `takes` tells which have a value."""
    while at < len(args) and args[at].partition("=")[0] in takes:
        at += 2 if takes[args[at].partition("=")[0]] and "=" not in args[at] else 1
    return at


@click.command("handout", cls=_TextFirst)
@click.argument("text", type=vpype_cli.TextType())
@click.option("-l", "--layer", type=vpype_cli.LayerType(accept_new=True), help="Target layer or 'new'.")
@click.option("--page", "page_name", help=f"{page_sizes.HELP} Default: the page of the pipeline, or A5.")
@click.option("--margin", help="e.g. 15mm, or 20mm,15mm, or four from the top clockwise.")
@vpype_cli.global_processor  # type: ignore[untyped-decorator]
def command(document: Any, text: str, layer: Any, page_name: str | None, margin: str | None, **options: Any) -> Any:
    """Write TEXT in handwriting.

    The page of the pipeline becomes that of the writing unless it has one already.
    """
    from handout.pipeline.writing import drawings

    if not page_name and document.page_size is not None:
        width, height = (side * PX for side in document.page_size)
        page_name = f"{width:.3f}x{height:.3f}mm"
    try:
        sheet = SheetOptions(page_name, margin, 1, usual_page="A5")
        (drawing,) = drawings(text, build_options(WritingOptions(), options), sheet)
        into = None if layer is None else vpype_cli.single_to_layer_id(layer, document)
        add(drawing, document, into)
    except HandoutError as error:
        raise click.ClickException(str(error)) from error
    return document


# all options of writing but slips
command.params += list_options(bundle(WritingOptions(), leave_out=("slips",)))
command.help_group = "handout"  # type: ignore[attr-defined]


def add(drawing: Drawing, document: Any, layer: int | None = None) -> None:
    """Add a drawing to a vpype document.

    layer : the layer all of it goes to; default: a layer for every name and colour of the drawing's own, of which those
        without any are added to layer 1.
    """
    kinds = dict.fromkeys((stroke.layer, stroke.colour) for stroke in drawing.strokes)
    for name, colour in kinds:
        into = layer or (document.free_id() if name or colour else 1)
        strokes = [stroke for stroke in drawing.strokes if (stroke.layer, stroke.colour) == (name, colour)]
        document.add(lines(strokes), into)
        if name and layer is None:
            document.layers[into].set_property(vpype.METADATA_FIELD_NAME, name)
        if colour and layer is None:
            document.layers[into].set_property(vpype.METADATA_FIELD_COLOR, vpype.Color(colour))
    if document.page_size is None:
        document.page_size = (drawing.page.width / PX, drawing.page.height / PX)


def lines(strokes: list[Stroke]) -> Any:
    """Strokes as a vpype LineCollection, without the samples that are not needed to stay within 0.02 mm."""
    from shapely.geometry import LineString

    found = vpype.LineCollection()
    for stroke in strokes:
        z = stroke.xy @ np.array([1, 1j]) / PX
        dot = np.abs(z - z[0]).max() < _DOT
        # vpype drops what has no length; a dot of the pen is a very short line there
        if dot:
            found.append(np.array([z[0], z[0] + _DOT]))
        else:
            line = LineString(np.column_stack([z.real, z.imag]))
            found.append(np.array(line.simplify(_TOLERANCE / PX).coords) @ np.array([1, 1j]))
    return found


def from_document(document: Any) -> Drawing:
    """A vpype document as a drawing: lines in their order, layer by layer, with the layers' names and colours.

    Raises InputError: there are no lines in it.
    """
    strokes = tuple(_strokes(document))
    if not strokes:
        raise InputError("The vpype document has no lines: there is nothing to draw.")
    if document.page_size is not None:
        width, height = (float(side) * PX for side in document.page_size)
    else:
        reach = np.max([stroke.xy.max(axis=0) for stroke in strokes], axis=0)
        width, height = (max(float(side) + _MARGIN, 2 * _MARGIN) for side in reach)
    return Drawing(strokes, Page(width, height), {}, timed=False)


def _strokes(document: Any) -> Iterator[Stroke]:
    clock = 0.0
    for number in sorted(document.layers):
        layer = document.layers[number]
        name = layer.property(vpype.METADATA_FIELD_NAME) or (str(number) if len(document.layers) > 1 else "")
        colour = layer.property(vpype.METADATA_FIELD_COLOR)
        shade = "" if colour is None else f"#{colour.red:02x}{colour.green:02x}{colour.blue:02x}"
        for line in layer:
            xy = np.column_stack([line.real, line.imag]) * PX
            step = np.hypot(*np.diff(xy, axis=0).T)
            kept = pathdata.anchor_ends(xy[np.concatenate([[True], step > 1e-4])])
            t = clock + np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(kept, axis=0).T)) / _PACE])
            yield Stroke(t, kept, layer=name, colour=shade)
            clock = float(t[-1]) + _LIFT
