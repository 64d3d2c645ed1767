"""Signatures: scribbles that are scanned once and set under letters, as ink in pictures and prints, as strokes else.

A signature is kept as a scanned hand whose letters are not known.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from handout import atomic, shipped
from handout.errors import InputError
from handout.hand import file
from handout.hand.scanned import NOBODY
from handout.pipeline.results import Delivery
from handout.values import Glyph, Ink, Line, LineGraph, Manuscript, Page, Placed

if TYPE_CHECKING:
    from handout.hand.scanned import ScannedHand
    from handout.letters.rows import Pasted

_LARGEST = 150.0  # mm: a page of writing is no signature


def add_signature(name: str, scan: str | Path, dpi: float | None = None, *, again: bool = False) -> Delivery:
    """Keep the signature on a scan, which shows nothing else, under a name.

    dpi : pixels an inch, where the file does not say; again : take the place of one of that name.

    Raises InputError: no name for a file, one that is taken, or a scan that cannot be read or shows more than a
    signature.
    """
    if not name.replace("-", "").replace("_", "").isalnum():
        raise InputError(f"A signature cannot be called {name!r}: use letters, digits, - and _.")
    path = _folder() / f"{name}.hand"
    if path.exists() and not again:
        raise InputError(f"There is a signature called {name} already: give --again to replace it, or another name.")
    hand = _read_scan(Path(scan), dpi)
    path.parent.mkdir(parents=True, exist_ok=True)
    atomic.check_writable(path)
    file.save(hand, path)
    width, height = (round(side, 1) for side in size(hand))
    return Delivery(files=(path,), told={"name": name, "path": str(path), "width": width, "height": height})


def list_signatures() -> Delivery:
    """The names of the signatures that are kept."""
    folder = _folder()
    return Delivery(told={"names": [path.stem for path in sorted(folder.glob("*.hand"))] if folder.is_dir() else []})


def find_signature(name: str, folder: Path = Path()) -> ScannedHand:
    """A signature by its name, or by the name of a scan or a .hand file in a folder.

    Raises InputError: no such signature, or a file that cannot be read.
    """
    path = folder / name if Path(name).suffix else _folder() / f"{name}.hand"
    if not path.is_file():
        known = ", ".join(list_signatures().told["names"])
        raise InputError(
            f"no signature is called {name}: {f'there are {known}; ' if known else ''}scan one and keep it "
            f"with handout hand signature add {Path(name).stem} scan.png."
        )
    return _load_signature(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _load_signature(path: Path, _changed: int) -> ScannedHand:
    return file.load(path) if path.suffix.lower() == ".hand" else _read_scan(path, None)


def _folder() -> Path:
    return shipped.user_folder("signatures")


def _read_scan(scan: Path, dpi: float | None) -> ScannedHand:
    from handout.scanning.written_page import read_page
    from handout.tagging.page_tagging import pen_of_pages

    hand = pen_of_pages(scan.stem, [read_page(scan, dpi)])
    width, height = size(hand)
    if max(width, height) > _LARGEST:
        raise InputError(
            f"{scan}: its ink is {width:.0f} x {height:.0f} mm, more than a signature: cut the scan to the signature, "
            "or give --dpi if its resolution is another."
        )
    return hand


def size(signature: ScannedHand) -> tuple[float, float]:
    """Width and height of the ink of a signature, mm."""
    low, high = _bounds(signature)
    return float(high[0] - low[0]), float(high[1] - low[1])


def _bounds(signature: ScannedHand) -> tuple[np.ndarray, np.ndarray]:
    graph = signature.pages[0].graph
    if not len(graph):
        raise InputError(f"{signature.name} shows no line of a pen.")
    radius = graph.radius[:, None]
    return (graph.xy - radius).min(axis=0), (graph.xy + radius).max(axis=0)


def placed_signature(signature: ScannedHand, place: Pasted, page: Page) -> Manuscript:
    """A signature at its place on a page."""
    graph, (low, high) = signature.pages[0].graph, _bounds(signature)
    scale = place.width / float(high[0] - low[0])
    xy = (graph.xy - low) * scale + (place.x, place.y)
    ink = Ink(LineGraph(xy, graph.radius * scale, graph.density, graph.uv, graph.edges), 0, NOBODY)
    scribble = Placed(Glyph("", (), (), 0.0), (), joined=False, word=place.word, at=0, ink=ink)
    line = Line("", (scribble,), place.y + place.height)
    return Manuscript((line,), page, signature.pages[0].x_height * scale)
