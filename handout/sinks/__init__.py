"""Drawings out: which suffix becomes which format, and writing all files of a call or none.

An output format is added here, as an entry of `FORMATS` and a function beside the others; help texts and errors list
what is there.  Formats are imported only when they are written.

- `svg`, `pdf`, `eps`: strokes as smooth paths; `paths`: numbers, widths and moves that they write.
- `dxf`: strokes as centre lines, scanned ink as outlines; `layers`: what a layer is, and its name, in SVG and DXF.
- `png`, `picture_pdf`: pixels, for the screen and for printers.
- `inkml`, `drawing_json`: every sample with its channels; `plans`: lognormal plans and how they fit.
- `about`: what every output says of where it came from.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from handout import atomic
from handout.errors import InputError
from handout.inking.papers import Paper
from handout.inking.pen import BY_FOOTPRINT, Pen, rgb
from handout.progress import Tell, narrow_reports, silent
from handout.sinks.layers import By
from handout.values import Array, Drawing

__all__ = [
    "OF_INK", "Look", "Paper", "Pen", "check_outputs", "drawing_file", "losses", "suffixes", "write_drawings",
]  # fmt: skip

PageSink = Callable[[Drawing], bytes]


@dataclass(frozen=True)
class Look:
    """How pictures of writing look.

    pen : of strokes; scanned ink looks as it was scanned.
    dpi : pixels an inch, 20 to 4800, of formats made of pixels.
    paper : that PNG files show the ink on; white without one.
    transparent : whether PNG files are without paper.
    show_travel : whether pictures of strokes (SVG, PDF, PNG) show how the lifted pen travels between them.
    footprint : whether lines (SVG, PDF, EPS) are as wide as the pen leaves them where it is held so.
    layers : what a layer is in formats that have some (SVG, DXF).
    """

    pen: Pen = field(default_factory=Pen)
    dpi: float = 300.0
    paper: Paper = field(default_factory=Paper)
    transparent: bool = False
    show_travel: bool = False
    footprint: bool = False
    layers: By = "ink"


_USUAL = Look()


def _svg(pages: Sequence[Drawing], look: Look) -> bytes:
    from handout.sinks.svg import to_svg

    return to_svg(_mark_page(pages[0], look), **_line_look(look), by=look.layers)


def _line_look(look: Look) -> dict[str, Any]:
    return {"pen_width": look.pen.width, "colour": look.pen.colour, "show_travel": look.show_travel}


def _mark_page(page: Drawing, look: Look) -> Drawing:
    """A page whose lines are as wide as the pen leaves them, where that is to be shown."""
    if not look.footprint and look.pen.model not in BY_FOOTPRINT:
        return page
    from handout.inking import footprints

    return footprints.mark_drawing(page, look.pen)


def _png(pages: Sequence[Drawing], look: Look) -> bytes:
    import numpy as np

    from handout.inking import papers, pens, plain
    from handout.sinks import paths
    from handout.sinks.png import to_png

    (page,) = pages
    pen, dpi, rng = look.pen, look.dpi, pens.noise(page.about)
    if look.transparent:
        return to_png(pens.ink(page, dpi, pen, rng), about=page.about, paper=None)
    single_colour = page.ink is None and not any(stroke.colour for stroke in page.strokes) and not look.show_travel
    if single_colour and pen.model == "plain" and look.paper.name == "none" and page.beneath is None:
        cover = plain.coverage(page, dpi, width=pen.width)
        return to_png(cover, dpi, about=page.about, palette=plain.shades(rgb(pen.colour)))
    plain.shape(page, dpi, pen.width)  # refuses a page that no paper can be made for
    # the ink draws on children of its generator, so that it is the same on any paper
    sheet = papers.sheet(papers.place_lines(look.paper, page.about), page.page, dpi, pens.noise(page.about))
    if page.beneath is not None:
        white = np.full((*plain.shape(page, dpi, pen.width), 3), 255, dtype=np.uint8)
        sheet = page.beneath(white if sheet is None else sheet, dpi)
    image = pens.image(page, dpi, pen, rng, sheet)
    return to_png(paths.travel_over(image, page, dpi) if look.show_travel else image, dpi, about=page.about)


def _pdf(pages: Sequence[Drawing], look: Look) -> bytes:
    """Vector strokes, or where there is scanned ink its pixels."""
    if all(page.ink is None for page in pages):
        from handout.sinks.pdf import to_pdf

        return to_pdf([_mark_page(page, look) for page in pages], **_line_look(look))
    from io import BytesIO

    from handout.inking import pens
    from handout.inking.device_pixels import device_pixels
    from handout.sinks.about import plain
    from handout.sinks.picture_pdf import PdfWriter

    stream = BytesIO()
    writer = PdfWriter(stream, plain(pages[0].about))
    for page in pages:
        writer.add(page.page, device_pixels(pens.ink(page, look.dpi, look.pen, pens.noise(page.about))))
    writer.finish()
    return stream.getvalue()


def _eps(pages: Sequence[Drawing], look: Look) -> bytes:
    """Vector strokes, or where there is scanned ink its outlines, filled."""
    from handout.sinks import eps

    (page,) = pages
    if page.ink is not None:
        return eps.outlines_eps(page, _areas(page, look))
    return eps.to_eps(_mark_page(page, look), **_line_look(look))


def _dxf(pages: Sequence[Drawing], look: Look) -> bytes:
    """Centre lines, or where there is scanned ink its outlines."""
    from handout.sinks import dxf

    (page,) = pages
    if page.ink is not None:
        return dxf.outlines_dxf(page, _areas(page, look))
    return dxf.to_dxf(page, colour=look.pen.colour, by=look.layers)


def _areas(page: Drawing, look: Look) -> Sequence[tuple[str, Sequence[Array]]]:
    from handout.inking import outline, pens

    return outline.areas(pens.ink(page, look.dpi, look.pen, pens.noise(page.about)))


def _inkml(pages: Sequence[Drawing], look: Look) -> bytes:
    from handout.sinks.inkml import to_inkml

    return to_inkml(pages[0])


def _json(pages: Sequence[Drawing], look: Look) -> bytes:
    from handout.sinks.drawing_json import to_json

    return to_json(pages[0])


@dataclass(frozen=True)
class Format:
    """A format of outputs.

    write : pages and how they look → a file; one page, or all of them where it holds them `together`.
    ink : whether it can show scanned ink; travel : whether it can show how a lifted pen travels.
    lost : what of writing it cannot hold, for a note; "" where that is what a picture is understood to lack.
    traced : what becomes of scanned ink in it, for a note; "" where it stays ink.
    """

    write: Callable[[Sequence[Drawing], Look], bytes]
    ink: bool = False
    travel: bool = False
    together: bool = False
    lost: str = ""
    traced: str = ""


FORMATS = {
    ".svg": Format(_svg, travel=True),
    ".pdf": Format(_pdf, ink=True, travel=True, together=True),
    ".png": Format(_png, ink=True, travel=True),
    ".inkml": Format(_inkml),
    ".json": Format(_json),
    ".eps": Format(_eps, ink=True, travel=True, traced="its shades and its grain are left out"),
    ".dxf": Format(
        _dxf,
        ink=True,
        lost="times, pressure and the width of lines, and the colours are the nearest of its palette",
        traced="each ink has a layer, and --pen plain gives centre lines instead",
    ),
}
OF_INK = tuple(suffix for suffix, form in FORMATS.items() if form.ink)
SHOW_TRAVEL = tuple(suffix for suffix, form in FORMATS.items() if form.travel)


def losses(paths: Sequence[str | Path], drawings: Sequence[Drawing]) -> list[str]:
    """Notes on what files of these names do not keep of these pages."""
    given, notes = {Path(path).suffix.lower() for path in paths}, []
    for suffix, form in FORMATS.items():
        if suffix in given and form.lost:
            notes.append(f"{suffix} files leave out {form.lost}.")
        if suffix in given and form.traced and any(page.ink is not None for page in drawings):
            notes.append(f"{suffix} files have scanned ink as its outlines; {form.traced}.")
    return notes


def suffixes(extra: Mapping[str, PageSink] | None = None) -> list[str]:
    """All suffixes that can be written, those of `extra` included."""
    return sorted({*FORMATS, *(extra or {})})


def check_outputs(
    paths: Sequence[str | Path], extra: Mapping[str, PageSink] | None = None, pages: int = 1
) -> list[Path]:
    """The files that `pages` pages become, checked before any work is done for them.

    Raises InputError: a suffix that is not known (the message lists the known ones), two outputs of the same name, or a
    place that cannot be written.
    """
    files = [file for path in paths for file in _files(Path(path), pages, extra)]
    resolved: set[Path] = set()
    for file in files:
        if file.resolve() in resolved:
            raise InputError(f"Two outputs would be written to {file}: give each a name of its own.")
        resolved.add(file.resolve())
        atomic.check_writable(file)
    return files


def write_drawings(
    drawings: Sequence[Drawing],
    paths: Sequence[str | Path],
    look: Look = _USUAL,
    *,
    extra: Mapping[str, PageSink] | None = None,
    tell: Tell = silent,
) -> list[Path]:
    """Write pages to files whose suffixes say the format.

    A PDF holds all pages; of the other formats each page gets a file of its own, numbered (``letter-1.svg``,
    ``letter-2.svg`` …) if there are several.  All files are made before the first is written.

    drawings : the pages, at least one.
    look : pen, paper and resolution of formats that show ink.
    extra : mapping of suffix to function, optional: further formats, such as ``{".gcode": to_gcode}``: each function
        gets a page and returns the file.
    tell : told how far it has come.

    Returns the files written, in the order of `paths`, pages in order.

    Raises InputError: no page, transparent paper, travel where it cannot be shown, or what `check_outputs` and the
    formats refuse.
    """
    if not drawings:
        raise InputError("There is no page to write.")
    _check_look(drawings, paths, look)
    files = check_outputs(paths, extra, len(drawings))
    contents: list[bytes] = []
    for number, path in enumerate(paths):
        part = narrow_reports(tell, number / len(paths), (number + 1) / len(paths))
        contents += _make_files(Path(path).suffix.lower(), drawings, look, extra or {}, part)
    atomic.write_all(zip(files, contents, strict=True))
    return files


def drawing_file(drawing: Drawing, path: Path, look: Look = _USUAL) -> bytes:
    """What a file of one page holds; `path` says its format, and what it is called where that is refused."""
    _check_look([drawing], [path], look)
    (data,) = _make_files(path.suffix.lower(), [drawing], look, {}, silent)
    return data


def _check_look(drawings: Sequence[Drawing], paths: Sequence[str | Path], look: Look) -> None:
    """Raise InputError where ink, travel or paper cannot be shown as asked for."""
    kinds = {Path(path): Path(path).suffix.lower() for path in paths}
    inked = any(page.ink is not None and not page.strokes for page in drawings)
    for path, suffix in kinds.items():
        if inked and suffix not in OF_INK:
            raise InputError(
                f"{path}: the page has scanned ink and no strokes: write it as {' or '.join(OF_INK)}, or trace it."
            )
    if look.show_travel and look.transparent:
        raise InputError("A transparent picture has ink only: leave out --transparent, or --show-travel.")
    if look.show_travel and not set(kinds.values()) & {*SHOW_TRAVEL}:
        raise InputError(f"Travel is shown in pictures: give a file in one of {', '.join(SHOW_TRAVEL)}.")
    if look.transparent and look.paper.name != "none":
        raise InputError("A picture is either transparent or on paper: leave out one of the two.")


def _files(path: Path, pages: int, extra: Mapping[str, PageSink] | None) -> list[Path]:
    suffix = path.suffix.lower()
    if suffix not in suffixes(extra):
        formats = ", ".join(suffixes(extra))
        which = f"the suffix {path.suffix!r} is not known" if path.suffix else "the name has no suffix"
        raise InputError(f"{path}: {which}; the formats that can be written are {formats}.")
    if pages == 1 or (suffix in FORMATS and FORMATS[suffix].together):
        return [path]
    return [path.with_name(f"{path.stem}-{number}{path.suffix}") for number in range(1, pages + 1)]


def _make_files(
    suffix: str, drawings: Sequence[Drawing], look: Look, extra: Mapping[str, PageSink], tell: Tell
) -> list[bytes]:
    """The files of one format."""
    form = FORMATS.get(suffix)
    if form is not None and form.together:
        tell(0.0, f"drawing {suffix}")
        return [form.write(drawings, look)]
    contents = []
    for number, page in enumerate(drawings):
        tell(number / len(drawings), f"drawing {suffix} {number + 1}/{len(drawings)}")
        contents.append(form.write([page], look) if form is not None else extra[suffix](page))
    return contents
