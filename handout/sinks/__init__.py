"""Outputs of drawings: which suffix becomes which format, and writing them all or none.

Formats are imported only when they are written.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from handout import atomic
from handout.errors import InputError
from handout.inking.papers import Paper
from handout.inking.pen import Pen, rgb
from handout.progress import Tell, silent, within
from handout.values import Drawing

__all__ = ["OF_INK", "Paper", "Pen", "check_outputs", "suffixes", "write_drawing", "write_drawings"]

PageSink = Callable[[Drawing], bytes]


@dataclass(frozen=True)
class _Look:
    """What formats that show ink are drawn with; only those made of pixels know paper."""

    pen: Pen
    dpi: float
    paper: Paper
    transparent: bool
    travel: bool = False


def _svg(page: Drawing, look: _Look) -> bytes:
    from handout.sinks.svg import to_svg

    return to_svg(page, pen_width=look.pen.width, colour=look.pen.colour, show_travel=look.travel)


def _png(page: Drawing, look: _Look) -> bytes:
    from handout.inking import papers, pens, plain
    from handout.sinks import travel
    from handout.sinks.png import to_png

    pen, dpi, rng = look.pen, look.dpi, pens.noise(page.about)
    if look.transparent:
        return to_png(pens.ink(page, dpi, pen, rng), about=page.about, paper=None)
    one = page.ink is None and not any(stroke.colour for stroke in page.strokes) and not look.travel
    if one and pen.model == "plain" and look.paper.name == "none":
        cover = plain.coverage(page, dpi, width=pen.width)
        return to_png(cover, dpi, about=page.about, palette=plain.shades(rgb(pen.colour)))
    plain.shape(page, dpi, pen.width)  # refuses a page that no paper can be made for
    # the ink draws on children of its generator, so that it is the same on any paper
    sheet = papers.sheet(papers.under(look.paper, page.about), page.page, dpi, pens.noise(page.about))
    image = pens.image(page, dpi, pen, rng, sheet)
    return to_png(travel.over(image, page, dpi) if look.travel else image, dpi, about=page.about)


def _pdf(pages: Sequence[Drawing], look: _Look) -> bytes:
    """Vector strokes, or where there is scanned ink its pixels."""
    if all(page.ink is None for page in pages):
        from handout.sinks.pdf import to_pdf

        return to_pdf(pages, pen_width=look.pen.width, colour=look.pen.colour, show_travel=look.travel)
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


def _inkml(page: Drawing, look: _Look) -> bytes:
    from handout.sinks.inkml import to_inkml

    return to_inkml(page)


def _json(page: Drawing, look: _Look) -> bytes:
    from handout.sinks.drawing_json import to_json

    return to_json(page)


_PAGES: dict[str, Callable[[Drawing, _Look], bytes]] = {
    ".svg": _svg,
    ".png": _png,
    ".inkml": _inkml,
    ".json": _json,
}


OF_INK = (".pdf", ".png")  # formats that can show scanned ink
SHOW_TRAVEL = (".svg", ".pdf", ".png")  # formats that can show how a lifted pen travels


def suffixes(extra: Mapping[str, PageSink] | None = None) -> list[str]:
    """All suffixes that can be written, those of `extra` included."""
    return sorted({*_PAGES, ".pdf", *(extra or {})})


def check_outputs(
    paths: Sequence[str | Path], extra: Mapping[str, PageSink] | None = None, pages: int = 1
) -> list[Path]:
    """The files that `pages` pages become, checked before any work is done for them.

    Raises
    ------
    InputError
        A suffix that is not known (the message lists the known ones), two outputs of the same name, or a place
        that cannot be written.
    """
    files = [file for path in paths for file in _files(Path(path), pages, extra)]
    seen: set[Path] = set()
    for file in files:
        if file.resolve() in seen:
            raise InputError(f"Two outputs would be written to {file}: give each a name of its own.")
        seen.add(file.resolve())
        atomic.check_writable(file)
    return files


def write_drawings(
    drawings: Sequence[Drawing],
    paths: Sequence[str | Path],
    *,
    pen: Pen | None = None,
    dpi: float = 300.0,
    paper: Paper | None = None,
    transparent: bool = False,
    show_travel: bool = False,
    extra: Mapping[str, PageSink] | None = None,
    tell: Tell = silent,
) -> list[Path]:
    """Write pages to files whose suffixes say the format.

    A PDF holds all pages; of the other formats each page gets a file of its own, numbered (``letter-1.svg``,
    ``letter-2.svg`` …) if there are several.  All files are made before the first is written.

    Parameters
    ----------
    drawings : sequence of Drawing
        The pages, at least one.
    paths : sequence of str or Path
    pen : Pen, optional
        For formats that show ink.
    dpi : float
        Pixels per inch, 20 to 4800, for formats made of pixels.
    paper : Paper, optional
        What PNG files show the ink on; white without one.
    transparent : bool
        Leave the paper out of PNG files.
    show_travel : bool
        Show in pictures of strokes (SVG, PDF, PNG) how the lifted pen travels between them.
    extra : mapping of suffix to function, optional
        Further formats, such as ``{".gcode": to_gcode}``: each function gets a page and returns the file.
    tell : function, optional
        Told how far it has come.

    Returns
    -------
    list of Path
        The files written, in the order of `paths`, pages in order.

    Raises
    ------
    InputError
        No page, transparent paper, travel where it cannot be shown, or what `check_outputs` and the formats refuse.
    """
    if not drawings:
        raise InputError("There is no page to write.")
    _check_strokes(drawings, paths)
    look = _Look(pen or Pen(), dpi, paper or Paper(), transparent, show_travel)
    if show_travel:
        _check_travel(paths, transparent)
    if transparent and look.paper.name != "none":
        raise InputError("A picture is either transparent or on paper: leave out one of the two.")
    files = check_outputs(paths, extra, len(drawings))
    made: list[bytes] = []
    for number, path in enumerate(paths):
        part = within(tell, number / len(paths), (number + 1) / len(paths))
        made += _made(Path(path).suffix.lower(), drawings, look, extra or {}, part)
    for file, data in zip(files, made, strict=True):
        atomic.write(file, data)
    return files


def _check_strokes(drawings: Sequence[Drawing], paths: Sequence[str | Path]) -> None:
    """Raise InputError for a format made of strokes where pages have scanned ink and no strokes."""
    if all(page.strokes or page.ink is None for page in drawings):
        return
    for path in map(Path, paths):
        if path.suffix.lower() not in OF_INK:
            raise InputError(
                f"{path}: the page has scanned ink and no strokes: write it as {' or '.join(OF_INK)}, or trace it."
            )


def _check_travel(paths: Sequence[str | Path], transparent: bool) -> None:
    """Raise InputError where the moves of a lifted pen cannot be shown."""
    if transparent:
        raise InputError("A transparent picture has ink only: leave out --transparent, or --show-travel.")
    if not any(Path(path).suffix.lower() in SHOW_TRAVEL for path in paths):
        raise InputError(f"Travel is shown in pictures: give a file in one of {', '.join(SHOW_TRAVEL)}.")


def write_drawing(
    drawing: Drawing,
    path: str | Path,
    *,
    pen: Pen | None = None,
    dpi: float = 300.0,
    paper: Paper | None = None,
    transparent: bool = False,
    extra: Mapping[str, PageSink] | None = None,
) -> Path:
    """Write one page to one file; see `write_drawings`."""
    return write_drawings([drawing], [path], pen=pen, dpi=dpi, paper=paper, transparent=transparent, extra=extra)[0]


def _files(path: Path, pages: int, extra: Mapping[str, PageSink] | None) -> list[Path]:
    suffix = path.suffix.lower()
    if suffix not in suffixes(extra):
        known = ", ".join(suffixes(extra))
        which = f"the suffix {path.suffix!r} is not known" if path.suffix else "the name has no suffix"
        raise InputError(f"{path}: {which}; the formats that can be written are {known}.")
    if pages == 1 or suffix == ".pdf":
        return [path]
    return [path.with_name(f"{path.stem}-{number}{path.suffix}") for number in range(1, pages + 1)]


def _made(
    suffix: str, drawings: Sequence[Drawing], look: _Look, extra: Mapping[str, PageSink], tell: Tell
) -> list[bytes]:
    if suffix == ".pdf":
        tell(0.0, f"drawing {suffix}")
        return [_pdf(drawings, look)]
    made = []
    for number, page in enumerate(drawings):
        tell(number / len(drawings), f"drawing {suffix} {number + 1}/{len(drawings)}")
        made.append(_PAGES[suffix](page, look) if suffix in _PAGES else extra[suffix](page))
    return made
