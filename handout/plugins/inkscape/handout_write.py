"""Inkscape's Extensions → Text → Write by hand: has `handout write` make strokes and puts them into the document.

Copy this file and `handout_write.inx` into Inkscape's folder of user extensions.  Inkscape's own Python runs it, 3.8 or
newer, and needs no package: ``handout_write.py --text=… --hand=… [--id=SELECTED …] DOCUMENT.svg`` writes the changed
document to standard output; what is on standard error, Inkscape shows.

Source: W3C, SVG 1.1 (lengths, transforms, shapes); Inkscape's own extensions, for how they are called.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as xml

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from xml.etree.ElementTree import Element

    Point = tuple[float, float]
    Map = tuple[float, float, float, float, float, float]  # x' = a x + c y + e, y' = b x + d y + f
    Place = tuple[float, float, float, float, str | None]

_SVG = "{http://www.w3.org/2000/svg}"
_INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
_SODIPODI = "{http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd}"
_XLINK = "{http://www.w3.org/1999/xlink}"
_MM = 96 / 25.4  # px
_UNITS = {"": 1.0, "px": 1.0, "mm": _MM, "cm": 10 * _MM, "in": 96.0, "pt": 4 / 3, "pc": 16.0, "q": _MM / 4}
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_LENGTH = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Z]*)\s*$")
_ARC = re.compile(r"[\s,]*".join([f"({_NUMBER.pattern})"] * 3 + ["([01])"] * 2 + [f"({_NUMBER.pattern})"] * 2))
_COMMAND = re.compile(r"([MmLlHhVvCcSsQqTtAaZz])([^MmLlHhVvCcSsQqTtAaZz]*)")
_TAKES = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7}
_BOXES = ("rect", "image", "foreignObject")
_LEAST = 20.0  # mm that a selection must be wide and high to be written into: the least page of handout
_MARGIN = "2mm"  # within a selection, for letters lean out; set by eye
# Inkscape sets these for its own Python, and another one would not start with them
_OWN = ("PYTHONHOME", "PYTHONPATH", "LD_LIBRARY_PATH", "LD_PRELOAD")


class WriteRefused(Exception):
    """What cannot be done, in a sentence for the user."""


def main(arguments: Sequence[str]) -> int:
    """Change a document as Inkscape asks; 0, or 1 where that is refused."""
    asked = _parse_arguments(arguments)
    try:
        names, root = _read_document(asked.document)
        for prefix, address in names:
            xml.register_namespace(prefix, address)
        place = _place(root, asked.id)
        drawing, told = _write_drawing(asked, place)
        _insert_drawing(root, drawing, place, told, asked)
    except WriteRefused as error:
        print(error, file=sys.stderr)
        return 1
    for note in told.get("notes", []):
        print(note, file=sys.stderr)
    sys.stdout.buffer.write(xml.tostring(root, encoding="utf-8", xml_declaration=True))
    return 0


def _parse_arguments(arguments: Sequence[str]) -> Any:
    parser = argparse.ArgumentParser()
    for name in ("text", "hand", "align", "command", "ink", "fit"):
        parser.add_argument(f"--{name}", default="")
    for name in ("seed", "x_height", "line_spacing", "pen_width"):
        parser.add_argument(f"--{name}", type=float, default=0.0)
    parser.add_argument("--id", action="append", default=[])
    parser.add_argument("document")
    return parser.parse_known_args(arguments)[0]  # Inkscape says more than is needed here


def _read_document(path: str | Path) -> tuple[list[tuple[str, str]], Element]:
    """The names of a document's namespaces, and its root; comments are kept."""
    try:
        data = Path(path).read_bytes()
        names = [name for _, name in xml.iterparse(BytesIO(data), ["start-ns"])]
        parser = xml.XMLParser(target=xml.TreeBuilder(insert_comments=True, insert_pis=True))
        # names that ElementTree gives itself cannot be given to it
        return [name for name in names if not re.match(r"ns\d+$", name[0])], xml.fromstring(data, parser)
    except (OSError, xml.ParseError) as error:
        raise WriteRefused(f"The document cannot be read: {error}.") from error


# Where it is written


def _place(root: Element, selected: Iterable[str]) -> Place:
    """x, y, width, height (px) of what is selected, and the margin in it; of the page, with its usual margin (None)."""
    width, height = _page(root)
    points: list[Point] = []  # about what is selected, px
    for element in (_find_element(root, name) for name in selected):
        if element is not None:
            outside = _map_to(root, element)
            points += [_map_point(outside, point) for point in _points(root, element)]
    if not points:
        return 0.0, 0.0, width, height, None
    left, right = min(x for x, _ in points), max(x for x, _ in points)
    top, bottom = min(y for _, y in points), max(y for _, y in points)
    least = _LEAST * _MM
    if right - left < least or bottom - top < least:  # it says where to begin: from there to the edges of the page
        right, bottom = width, height
    if right - left < least or bottom - top < least:
        raise WriteRefused(
            f"There is no room: select an object of {_LEAST:g} mm, or one further from the edges of the page."
        )
    return left, top, right - left, bottom - top, _MARGIN


def _page(root: Element) -> Point:
    """Width and height of a document, px."""
    box = _view_box(root)
    given = [_length(root.get(name)) for name in ("width", "height")]
    width, height = (size or (box[2 + i] if box else 0.0) for i, size in enumerate(given))
    if not min(width, height) > 0:
        raise WriteRefused("The document has no size: set one in File, Document Properties.")
    return width, height


def _view_box(root: Element) -> list[float]:
    """x, y, width, height of the viewBox; none where it is none."""
    box = _numbers(root.get("viewBox"))
    return box if len(box) == 4 and min(box[2:]) > 0 else []


def _numbers(text: str | None) -> list[float]:
    return [float(number) for number in _NUMBER.findall(text or "")]


def _length(text: str | None) -> float:
    """px; 0 for a share of something, and for what is no length."""
    match = _LENGTH.match(text or "")
    return float(match.group(1)) * _UNITS.get(match.group(2).lower(), 0.0) if match else 0.0


def _on_page(root: Element) -> Map:
    """The map from a document's units to px."""
    box = _view_box(root)
    if not box:
        return _make_shift(0.0, 0.0)
    width, height = _page(root)
    x, y = width / box[2], height / box[3]
    if not root.get("preserveAspectRatio", "").strip().startswith("none"):
        x = y = min(x, y)
    return x, 0.0, 0.0, y, (width - x * box[2]) / 2 - box[0] * x, (height - y * box[3]) / 2 - box[1] * y


def _map_to(root: Element, element: Element) -> Map:
    """The map from the units inside an element to px."""
    parents = {child: parent for parent in root.iter() for child in parent}
    chain = []
    while element is not root:
        chain.append(_transform(element))
        element = parents[element]
    found = _on_page(root)
    for one in reversed(chain):
        found = _compose_maps(found, one)
    return found


def _find_element(root: Element, name: str) -> Element | None:
    return next((element for element in root.iter() if name and element.get("id") == name), None)


def _points(root: Element, element: Element) -> list[Point]:
    """Points about an element, in its own units; curves lie within their control points."""
    kind = element.tag[len(_SVG) :] if isinstance(element.tag, str) and element.tag.startswith(_SVG) else ""
    if kind in ("g", "a"):
        return [_map_point(_transform(child), point) for child in element for point in _points(root, child)]
    if kind != "use":
        return _shape(kind, element)
    target = _find_element(root, (element.get("href") or element.get(f"{_XLINK}href") or "")[1:])
    if target is None or target.tag in (element.tag, f"{_SVG}g"):  # what a group uses might be the group itself
        return []
    moved = _compose_maps(_make_shift(_length(element.get("x")), _length(element.get("y"))), _transform(target))
    return [_map_point(moved, point) for point in _points(root, target)]


def _shape(kind: str, element: Element) -> list[Point]:
    def side(name: str) -> float:
        return _length(element.get(name))

    if kind in _BOXES:
        return _corners(side("x"), side("y"), side("width"), side("height"))
    if kind in ("circle", "ellipse"):
        wide, high = side("r") or side("rx"), side("r") or side("ry")
        return _corners(side("cx") - wide, side("cy") - high, 2 * wide, 2 * high)
    if kind == "line":
        return [(side("x1"), side("y1")), (side("x2"), side("y2"))]
    if kind in ("polyline", "polygon"):
        return _pairs(_numbers(element.get("points")))
    return _path(element.get("d", "")) if kind == "path" else [(side("x"), side("y"))] if kind == "text" else []


def _corners(x: float, y: float, width: float, height: float) -> list[Point]:
    return [(x, y), (x + width, y), (x, y + height), (x + width, y + height)]


def _pairs(numbers: Sequence[float]) -> list[Point]:
    return list(zip(numbers[::2], numbers[1::2]))  # noqa: B905 (strict is of Python 3.10)


def _path(data: str) -> list[Point]:
    """The ends and the control points of a path; of an arc, what lies a radius about its ends."""
    points: list[Point] = []
    at = start = (0.0, 0.0)
    for command, text in _COMMAND.findall(data):
        kind, numbers = command.upper(), _arguments(command, text)
        if kind == "Z":
            at = start
            continue
        for n in range(0, len(numbers) - _TAKES[kind] + 1, _TAKES[kind]):
            part, (x, y) = numbers[n : n + _TAKES[kind]], at if command.islower() else (0.0, 0.0)
            if kind in "HV":
                part = [part[0], at[1] - y] if kind == "H" else [at[0] - x, part[0]]
            given = [(x + a, y + b) for a, b in _pairs(part[-2:] if kind == "A" else part)]
            radius = max(part[:2]) if kind == "A" else 0.0
            about = [at, *given] if radius else given
            points += [corner for a, b in about for corner in _corners(a - radius, b - radius, 2 * radius, 2 * radius)]
            at = given[-1]
            start = at if kind == "M" and n == 0 else start
    return points


def _arguments(command: str, text: str) -> list[float]:
    if command not in "Aa":
        return _numbers(text)
    # nothing need stand between the flags of an arc and what comes after them
    return [float(number) for arc in _ARC.findall(text) for number in arc]


def _make_shift(x: float, y: float) -> Map:
    return 1.0, 0.0, 0.0, 1.0, x, y


def _transform(element: Element) -> Map:
    """What the transforms of an element do together."""
    found = _make_shift(0.0, 0.0)
    for name, inside in re.findall(r"(\w+)\s*\(([^)]*)\)", element.get("transform", "")):
        found = _compose_maps(found, _make_map(name, _numbers(inside)))
    return found


def _make_map(name: str, n: list[float]) -> Map:
    """One transform; one that there is not changes nothing."""
    n = [*n, *[0.0] * (6 - len(n))] if name != "scale" or len(n) > 1 else [n[0], n[0]] if n else [1.0, 1.0]
    cos, sin, tan = math.cos(math.radians(n[0])), math.sin(math.radians(n[0])), math.tan(math.radians(n[0]))
    if name == "matrix":
        return n[0], n[1], n[2], n[3], n[4], n[5]
    if name == "translate":
        return _make_shift(n[0], n[1])
    if name == "scale":
        return n[0], 0.0, 0.0, n[1], 0.0, 0.0
    if name == "rotate":
        return cos, sin, -sin, cos, n[1] - cos * n[1] + sin * n[2], n[2] - sin * n[1] - cos * n[2]
    return 1.0, tan if name == "skewY" else 0.0, tan if name == "skewX" else 0.0, 1.0, 0.0, 0.0


def _compose_maps(outer: Map, inner: Map) -> Map:
    """The map that first does `inner`, then `outer`."""
    a, b, c, d, e, f = outer
    p, q, r, s, t, u = inner
    return a * p + c * q, b * p + d * q, a * r + c * s, b * r + d * s, a * t + c * u + e, b * t + d * u + f


def _map_point(one: Map, point: Point) -> Point:
    a, b, c, d, e, f = one
    return a * point[0] + c * point[1] + e, b * point[0] + d * point[1] + f


# What is written


def _command(given: str) -> str:
    """How handout is called: as the user says, or as it is found."""
    given = given.strip().strip('"') or "handout"
    beside = Path(sys.executable).with_name("handout")  # where it was installed into Inkscape's own Python
    usual = [beside, Path.home() / ".local/bin/handout", Path.home() / "AppData/Roaming/Python/Scripts/handout.exe"]
    for one in [given, *(map(str, usual) if given == "handout" else [])]:
        found = shutil.which(str(Path(one).expanduser()) if "~" in one else one)
        if found:
            return found
    named = f" as {given}" if given != "handout" else ""
    raise WriteRefused(
        f"handout was not found{named}. Install it (pip install handout-driver), or give its path on the page Program: "
        "in an environment it is bin/handout, on Windows Scripts\\handout.exe. An Inkscape from Flatpak or Snap may "
        "not start other programs: take another of its packages."
    )


def _write_drawing(asked: Any, place: Place) -> tuple[Element, dict[str, Any]]:
    """The drawing that handout makes for a place, and what it tells of it."""
    text = asked.text.replace("\\n", "\n").replace("\\t", " ")  # so Inkscape hands on line breaks
    if not text.strip():
        raise WriteRefused("There is no text to write.")
    call = [_command(asked.command), "write", "--file", "-", "--json", "--quiet", "--pages", "1"]
    call += ["--page", f"{place[2] / _MM:.3f}x{place[3] / _MM:.3f}mm", "--hand", asked.hand.strip() or "house-joined"]
    call += [] if place[4] is None else ["--margin", place[4]]
    call += ["--seed", f"{asked.seed:.0f}"] if asked.seed else []
    lengths = {"x-height": asked.x_height, "line-spacing": asked.line_spacing, "pen-width": asked.pen_width}
    for name, length in lengths.items():
        call += [f"--{name}", f"{length:g}mm"] if length > 0 else []
    call += ["--align", asked.align] if asked.align else []
    call += ["--fit"] if asked.fit == "true" else []
    call += ["--ink", f"#{int(asked.ink, 0) >> 8 & 0xFFFFFF:06x}"] if asked.ink else []  # from red, green, blue, alpha
    with tempfile.TemporaryDirectory() as folder:
        drawing = Path(folder) / "writing.svg"
        told = _run_handout([*call, "--output", str(drawing)], text)
        return _read_document(drawing)[1], told


def _run_handout(call: list[str], text: str) -> dict[str, Any]:
    surroundings = {name: value for name, value in os.environ.items() if name not in _OWN}
    surroundings["PYTHONUTF8"] = "1"
    hidden = getattr(subprocess, "CREATE_NO_WINDOW", 0)
    try:
        done = subprocess.run(
            call, input=text.encode("utf-8"), capture_output=True, env=surroundings, creationflags=hidden, check=False
        )
    except OSError as error:
        raise WriteRefused(f"{call[0]} cannot be started: {error}.") from error
    if done.returncode:
        said = done.stderr.decode("utf-8", "replace").strip()
        raise WriteRefused(said or f"{call[0]} failed and said nothing (exit code {done.returncode}).")
    try:
        told: dict[str, Any] = json.loads(done.stdout.decode("utf-8"))
    except ValueError:
        raise WriteRefused(f"{call[0]} does not answer as handout does: is it another program?") from None
    return told


def _insert_drawing(root: Element, drawing: Element, place: Place, told: dict[str, Any], asked: Any) -> None:
    """Put the strokes of a drawing into the document's current layer, in its units."""
    view = root.find(f"{_SODIPODI}namedview")
    layer = _find_element(root, "" if view is None else view.get(f"{_INKSCAPE}current-layer", ""))
    layer = root if layer is None else layer
    a, b, c, d, e, f = _map_to(root, layer)
    size = a * d - b * c
    if abs(size) < 1e-12:
        raise WriteRefused("The layer is scaled to nothing: choose another layer.")
    undone = (d / size, -b / size, -c / size, a / size, (c * f - d * e) / size, (b * e - a * f) / size)
    change = _compose_maps(undone, (_MM, 0.0, 0.0, _MM, place[0], place[1]))
    taken = {element.get("id") for element in root.iter()}
    name = next(f"handout-{n}" for n in range(1, len(taken) + 2) if f"handout-{n}" not in taken)
    matrix = f"matrix({' '.join(f'{part:.8g}' for part in change)})"
    group = xml.SubElement(layer, f"{_SVG}g", {"id": name, "transform": matrix})
    group.set(f"{_INKSCAPE}label", " ".join(asked.text.replace("\\n", " ").split())[:40])
    said = f"Written by handout: hand {told.get('hand')}, seed {told.get('seed')}."
    xml.SubElement(group, f"{_SVG}desc").text = said
    group.extend(_prefix_names(ink, f"{name}-") for ink in drawing.findall(f"{_SVG}g") if ink.get("class") == "ink")


def _prefix_names(ink: Element, prefix: str) -> Element:
    """A layer of the drawing as a group whose names do not meet those of the document."""
    for element in ink.iter():
        if "id" in element.attrib:
            element.set("id", prefix + element.attrib["id"])
        if "clip-path" in element.attrib:
            element.set("clip-path", element.attrib["clip-path"].replace("#", f"#{prefix}"))
        element.attrib.pop("class", None)
        element.attrib.pop(f"{_INKSCAPE}groupmode", None)
    return ink


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
