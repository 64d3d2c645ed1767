"""Outputs of a drawing: which suffix becomes which format, and writing them all or none.

Formats are imported only when they are written.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from handout import atomic
from handout.errors import InputError
from handout.values import Drawing

__all__ = ["suffixes", "write_drawing"]

PageSink = Callable[[Drawing], bytes]


@dataclass(frozen=True)
class _Pen:
    width: float
    colour: str
    dpi: float


def _svg(page: Drawing, pen: _Pen) -> bytes:
    from handout.sinks.svg import to_svg

    return to_svg(page, pen_width=pen.width, colour=pen.colour)


def _png(page: Drawing, pen: _Pen) -> bytes:
    from handout.inking import plain
    from handout.sinks import paths
    from handout.sinks.png import to_png

    cover = plain.coverage(page, pen.dpi, width=pen.width)
    return to_png(cover, pen.dpi, about=page.about, palette=plain.shades(paths.rgb(pen.colour)))


def _inkml(page: Drawing, pen: _Pen) -> bytes:
    from handout.sinks.inkml import to_inkml

    return to_inkml(page)


def _json(page: Drawing, pen: _Pen) -> bytes:
    from handout.sinks.drawing_json import to_json

    return to_json(page)


_PAGES: dict[str, Callable[[Drawing, _Pen], bytes]] = {".svg": _svg, ".png": _png, ".inkml": _inkml, ".json": _json}


def suffixes(extra: Mapping[str, PageSink] | None = None) -> list[str]:
    """All suffixes that `write_drawing` knows, those of `extra` included."""
    return sorted({*_PAGES, ".pdf", *(extra or {})})


def write_drawing(
    drawings: Sequence[Drawing],
    paths: Sequence[Path],
    *,
    dpi: float = 300.0,
    pen_width: float = 0.5,
    colour: str = "#1a1a2e",
    extra: Mapping[str, PageSink] | None = None,
) -> list[Path]:
    """Write pages to files whose suffixes say the format.

    A PDF holds all pages; of the other formats each page gets a file of its own, which is numbered
    (``letter-1.svg``, ``letter-2.svg`` …) if there are several.  All files are made before the first is written.

    Parameters
    ----------
    drawings : sequence of Drawing
        The pages, at least one.
    paths : sequence of Path
    dpi : float
        Of formats made of pixels.
    pen_width : float
        mm; `colour` as ``"#rrggbb"``: of formats that show ink.
    extra : mapping of suffix to function, optional
        Further formats, such as ``{".gcode": to_gcode}``: each function gets a page and returns the file.

    Returns
    -------
    list of Path
        The files written, in the order of `paths`, pages in order.

    Raises
    ------
    InputError
        No page, an unknown suffix, two outputs of the same name, or a place that cannot be written.
    """
    pen, extra = _Pen(pen_width, colour, dpi), extra or {}
    if not drawings:
        raise InputError("There is no page to write.")
    targets = [(path, _targets(path, len(drawings), extra)) for path in paths]
    flat = [file for _, files in targets for file in files]
    seen: set[Path] = set()
    for file in flat:
        if file.resolve() in seen:
            raise InputError(f"Two outputs would be written to {file}: give each a name of its own.")
        seen.add(file.resolve())
        atomic.check_writable(file)
    made = [data for path, _ in targets for data in _made(path.suffix.lower(), drawings, pen, extra)]
    for file, data in zip(flat, made, strict=True):
        atomic.write(file, data)
    return flat


def _targets(path: Path, pages: int, extra: Mapping[str, PageSink]) -> list[Path]:
    suffix = path.suffix.lower()
    if suffix not in suffixes(extra):
        known = ", ".join(suffixes(extra))
        raise InputError(f"{path}: no output format has the suffix {path.suffix or '(none)'!r}; known are {known}.")
    if pages == 1 or suffix == ".pdf":
        return [path]
    return [path.with_name(f"{path.stem}-{number}{path.suffix}") for number in range(1, pages + 1)]


def _made(suffix: str, drawings: Sequence[Drawing], pen: _Pen, extra: Mapping[str, PageSink]) -> list[bytes]:
    if suffix == ".pdf":
        from handout.sinks.pdf import to_pdf

        return [to_pdf(drawings, pen_width=pen.width, colour=pen.colour)]
    if suffix in _PAGES:
        return [_PAGES[suffix](page, pen) for page in drawings]
    return [extra[suffix](page) for page in drawings]
