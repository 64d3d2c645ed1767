"""Outputs of drawings: which suffix becomes which format, and writing them all or none.

Formats are imported only when they are written.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from handout import atomic
from handout.errors import InputError
from handout.values import Drawing

__all__ = ["Pen", "check_outputs", "suffixes", "write_drawing", "write_drawings"]

PageSink = Callable[[Drawing], bytes]


@dataclass(frozen=True)
class Pen:
    """What formats that show ink draw with.

    width : mm, 0.02 to 50; colour : ``"#rrggbb"``.

    Raises
    ------
    InputError
        A width out of its bounds, or no such colour.
    """

    width: float = 0.3
    colour: str = "#1a1a2e"

    def __post_init__(self) -> None:
        from handout.sinks import paths

        paths.rgb(self.colour)
        paths.check_width(self.width)


def _svg(page: Drawing, pen: Pen, dpi: float) -> bytes:
    from handout.sinks.svg import to_svg

    return to_svg(page, pen_width=pen.width, colour=pen.colour)


def _png(page: Drawing, pen: Pen, dpi: float) -> bytes:
    from handout.inking import plain
    from handout.sinks import paths
    from handout.sinks.png import to_png

    cover = plain.coverage(page, dpi, width=pen.width)
    return to_png(cover, dpi, about=page.about, palette=plain.shades(paths.rgb(pen.colour)))


def _inkml(page: Drawing, pen: Pen, dpi: float) -> bytes:
    from handout.sinks.inkml import to_inkml

    return to_inkml(page)


def _json(page: Drawing, pen: Pen, dpi: float) -> bytes:
    from handout.sinks.drawing_json import to_json

    return to_json(page)


_PAGES: dict[str, Callable[[Drawing, Pen, float], bytes]] = {
    ".svg": _svg,
    ".png": _png,
    ".inkml": _inkml,
    ".json": _json,
}


def suffixes(extra: Mapping[str, PageSink] | None = None) -> list[str]:
    """All suffixes that can be written, those of `extra` included."""
    return sorted({*_PAGES, ".pdf", *(extra or {})})


def check_outputs(paths: Sequence[Path], extra: Mapping[str, PageSink] | None = None, pages: int = 1) -> list[Path]:
    """The files that `pages` pages become, checked before any work is done for them.

    Raises
    ------
    InputError
        A suffix that is not known (the message lists the known ones), two outputs of the same name, or a place
        that cannot be written.
    """
    files = [file for path in paths for file in _files(path, pages, extra)]
    seen: set[Path] = set()
    for file in files:
        if file.resolve() in seen:
            raise InputError(f"Two outputs would be written to {file}: give each a name of its own.")
        seen.add(file.resolve())
        atomic.check_writable(file)
    return files


def write_drawings(
    drawings: Sequence[Drawing],
    paths: Sequence[Path],
    *,
    pen: Pen | None = None,
    dpi: float = 300.0,
    extra: Mapping[str, PageSink] | None = None,
) -> list[Path]:
    """Write pages to files whose suffixes say the format.

    A PDF holds all pages; of the other formats each page gets a file of its own, numbered (``letter-1.svg``,
    ``letter-2.svg`` …) if there are several.  All files are made before the first is written.

    Parameters
    ----------
    drawings : sequence of Drawing
        The pages, at least one.
    paths : sequence of Path
    pen : Pen, optional
        For formats that show ink.
    dpi : float
        Pixels per inch, 20 to 4800, for formats made of pixels.
    extra : mapping of suffix to function, optional
        Further formats, such as ``{".gcode": to_gcode}``: each function gets a page and returns the file.

    Returns
    -------
    list of Path
        The files written, in the order of `paths`, pages in order.

    Raises
    ------
    InputError
        No page, or what `check_outputs` and the formats refuse.
    """
    if not drawings:
        raise InputError("There is no page to write.")
    files = check_outputs(paths, extra, len(drawings))
    pen = pen or Pen()
    made = [data for path in paths for data in _made(path.suffix.lower(), drawings, pen, dpi, extra or {})]
    for file, data in zip(files, made, strict=True):
        atomic.write(file, data)
    return files


def write_drawing(
    drawing: Drawing,
    path: Path,
    *,
    pen: Pen | None = None,
    dpi: float = 300.0,
    extra: Mapping[str, PageSink] | None = None,
) -> Path:
    """Write one page to one file; see `write_drawings`."""
    return write_drawings([drawing], [path], pen=pen, dpi=dpi, extra=extra)[0]


def _files(path: Path, pages: int, extra: Mapping[str, PageSink] | None) -> list[Path]:
    suffix = path.suffix.lower()
    if suffix not in suffixes(extra):
        known = ", ".join(suffixes(extra))
        which = f"the suffix {path.suffix!r} is not known" if path.suffix else "the name has no suffix"
        raise InputError(f"{path}: {which}; the formats that can be written are {known}.")
    if pages == 1 or suffix == ".pdf":
        return [path]
    return [path.with_name(f"{path.stem}-{number}{path.suffix}") for number in range(1, pages + 1)]


def _made(suffix: str, drawings: Sequence[Drawing], pen: Pen, dpi: float, extra: Mapping[str, PageSink]) -> list[bytes]:
    if suffix == ".pdf":
        from handout.sinks.pdf import to_pdf

        return [to_pdf(drawings, pen_width=pen.width, colour=pen.colour)]
    if suffix in _PAGES:
        return [_PAGES[suffix](page, pen, dpi) for page in drawings]
    return [extra[suffix](page) for page in drawings]
