"""What a PDF form asks for: its fields (AcroForm), their kinds, and where on its pages they lie.

Needs `pikepdf`, an optional library.

Source: ISO 32000-1:2008, 12.5.6.19 (widgets), 12.7 (interactive forms), 14.11.2 (page boxes).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from handout import units
from handout.errors import InputError
from handout.units import POINT
from handout.values import Page

Kind = Literal["text", "check", "radio", "choice", "signature"]
Align = Literal["left", "centre", "right"]
Box = tuple[float, float, float, float]
Matrix = tuple[float, float, float, float, float, float]

MOST_PAGES = 500  # of a form; set by eye, ten times the longest tax return
MOST_WIDGETS = 5000  # likewise
_MOST_BYTES = 100_000_000  # of a file, which is read whole
_LONGEST_SIDE = 5080.0  # mm, of a page: 14,400 units of 1/72 inch
DEEPEST = 32  # fields above a widget: more is a circle
# flags of fields and of annotations, as the bits of table 221 and 226 to 230, and of table 165
_READ_ONLY, _REQUIRED = 1 << 0, 1 << 1
_MULTILINE, _PASSWORD, _FILE, _COMB = 1 << 12, 1 << 13, 1 << 20, 1 << 24
_RADIO, _PUSH, _EDIT = 1 << 15, 1 << 16, 1 << 18
_HIDDEN, _NO_VIEW = 1 << 1, 1 << 5


@dataclass(frozen=True)
class Widget:
    """One place of a field.

    page : number of its page, from 0.
    box : (left, top, right, bottom), mm of the page as it is shown, origin at the top left.
    turn : quarters of a turn that its text is turned by, anticlockwise.
    state : of a check box or radio button, what it stands for when it is marked.
    """

    page: int
    box: Box
    turn: int = 0
    state: str = ""


@dataclass(frozen=True)
class Field:
    """A field of a form.

    name : its full name, with the names of those that it is part of.
    label : what the form calls it to people; "" if it does not.
    cells : of a field with one letter a cell, how many there are; 0 otherwise.
    longest : most characters, or None.
    options : (what stands for it in the file, what is shown) of every choice.
    free : whether a choice may be something else.
    value : what is printed in it.
    """

    name: str
    kind: Kind
    widgets: tuple[Widget, ...]
    label: str = ""
    required: bool = False
    read_only: bool = False
    multiline: bool = False
    cells: int = 0
    longest: int | None = None
    options: tuple[tuple[str, str], ...] = ()
    free: bool = False
    align: Align = "left"
    value: str = ""


@dataclass(frozen=True)
class PdfForm:
    """A form as it was read.

    pages : its pages as they are shown; matrices : of each, from mm of the page to the file's own coordinates.
    fields : in the order of the pages.
    notes : phrases on what of it cannot be filled in.
    """

    path: Path
    pages: tuple[Page, ...]
    matrices: tuple[Matrix, ...]
    fields: tuple[Field, ...]
    notes: tuple[str, ...] = ()

    @property
    def fields_by_name(self) -> Mapping[str, Field]:
        """The fields by their names."""
        return {field.name: field for field in self.fields}


@contextmanager
def open_pdf(path: Path) -> Iterator[Any]:
    """Open a PDF with pikepdf. Raises InputError: the library is missing; not a PDF, damaged, locked, or too large."""
    try:
        import pikepdf
    except ImportError as error:
        raise InputError(f"Filling in {path} needs the library pikepdf: pip install 'handout-driver[pdf]'.") from error
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise InputError(
                f"{path} has more than {_MOST_BYTES / 1e6:.0f} MB; save the form alone, without its scans."
            )
        with pikepdf.open(path) as document:
            yield document
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
    except pikepdf.PasswordError as error:
        raise InputError(f"{path} is locked by a password: save a copy without one and fill in that.") from error
    except (pikepdf.PikepdfError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError) as error:
        raise InputError(f"{path} is no PDF, or damaged: open it in a PDF viewer and save or print it anew.") from error


def read_form(path: Path) -> PdfForm:
    """Read the fields of a form.

    Raises InputError: it cannot be read (see `open_pdf`), or may not be filled in; it has no fields, or too many pages
    or fields.
    """
    with open_pdf(path) as document:
        count = len(document.pages)
        if count > MOST_PAGES:
            raise InputError(
                f"{path} has {count:,} pages, and a form at most {MOST_PAGES}: save the pages to fill in as a file."
            )
        if not document.allow.modify_form:
            raise InputError(f"{path} does not permit that its fields are filled in: ask whoever made it for another.")
        shown = [_frame_page(page) for page in document.pages]
        found = _Fields()
        for number, page in enumerate(document.pages):
            for annotation in page.obj.get("/Annots", ()):
                found.add(annotation, number, shown[number][1], path)
        root = document.Root.get("/AcroForm", {})
        if not found.fields:
            raise InputError(_without_fields(path, count, xfa="/XFA" in root))
        return PdfForm(
            path,
            tuple(page for page, _ in shown),
            tuple(matrix for _, matrix in shown),
            tuple(found.make_fields()),
            tuple(found.notes(root)),
        )


def _without_fields(path: Path, pages: int, *, xfa: bool) -> str:
    if xfa:
        return (
            f"{path} is an XFA form, whose fields are not on its pages: open it in the program that it was made for, "
            "print it to a PDF, and write on that with handout write --paper."
        )
    return (
        f"{path} has no fields on its {units.count(pages, 'page')}: handout write --paper {path} writes on its lines."
    )


def _frame_page(page: Any) -> tuple[Page, Matrix]:
    """A page as it is shown, and the matrix from its mm (y down) to the file's coordinates."""
    left, bottom, right, top = _box(page)
    unit = float(page.obj.get("/UserUnit", 1))
    scale = 1 / (POINT * unit)
    width, height = (right - left) / scale, (top - bottom) / scale
    if max(width, height) > _LONGEST_SIDE:
        raise ValueError("a page larger than any")
    turn = page.rotation % 360
    matrix = {
        0: (scale, 0, 0, -scale, left, top),
        90: (0, scale, scale, 0, left, bottom),
        180: (-scale, 0, 0, scale, right, bottom),
        270: (0, -scale, -scale, 0, right, top),
    }[turn]
    return (Page(height, width) if turn % 180 else Page(width, height)), matrix


def _box(page: Any) -> Box:
    """The part of a page that is shown: its crop box, inside its media box."""

    def corners(box: Any) -> Box:
        a, b, c, d = (float(value) for value in box)
        return min(a, c), min(b, d), max(a, c), max(b, d)

    media, crop = corners(page.mediabox), corners(page.cropbox)
    inner = (max(media[0], crop[0]), max(media[1], crop[1]), min(media[2], crop[2]), min(media[3], crop[3]))
    box = inner if inner[0] < inner[2] and inner[1] < inner[3] else media
    if not (box[2] - box[0] > 1 and box[3] - box[1] > 1):
        raise ValueError("a page without extent")
    return box


def find_inherited(item: Any, key: str) -> Any:
    """The value of a field's key, its own or that of the nearest field above it; None without one."""
    for _ in range(DEEPEST):
        if key in item:
            return item[key]
        if "/Parent" not in item:
            return None
        item = item["/Parent"]
    raise ValueError("fields in a circle")


def full_name(item: Any) -> str:
    """The name of a field, with those of the fields above it."""
    parts: list[str] = []
    for _ in range(DEEPEST):
        if "/T" in item:
            parts.append(str(item["/T"]))
        if "/Parent" not in item:
            return ".".join(reversed(parts))
        item = item["/Parent"]
    raise ValueError("fields in a circle")


def is_widget(annotation: Any) -> bool:
    """Whether an annotation of a page is a place of a field."""
    return str(annotation.get("/Subtype", "")) == "/Widget"


@dataclass
class _Fields:
    """The fields of a form, as their places are found."""

    fields: dict[str, tuple[Any, Kind, list[Widget]]] = field(default_factory=dict)
    widgets: int = 0
    hidden: set[str] = field(default_factory=set)
    unwritten: set[str] = field(default_factory=set)

    def add(self, annotation: Any, page: int, matrix: Matrix, path: Path) -> None:
        """One annotation of a page, if it is a field's place."""
        if not is_widget(annotation):
            return
        self.widgets += 1
        if self.widgets > MOST_WIDGETS:
            raise InputError(f"{path} has more than {MOST_WIDGETS:,} fields, which no form has: split it.")
        name, flags = full_name(annotation), int(find_inherited(annotation, "/Ff") or 0)
        kind = _kind(str(find_inherited(annotation, "/FT")), flags)
        if kind is None:
            return
        if int(annotation.get("/F", 0)) & (_HIDDEN | _NO_VIEW):
            self.hidden.add(name)
            return
        if kind == "text" and flags & (_PASSWORD | _FILE):
            self.unwritten.add(name)
            return
        box = _on_page([float(value) for value in annotation["/Rect"]], matrix)
        characteristics = annotation.get("/MK", {})
        # by how many degrees the page is turned clockwise when it is shown
        _, b, _, d, *_ = matrix
        page_turn = (0 if d < 0 else 180) if b == 0 else (90 if b > 0 else 270)
        turned = int(characteristics.get("/R", 0)) - page_turn
        place = Widget(page, box, turned // 90 % 4, _state(annotation))
        if min(box[2] - box[0], box[3] - box[1]) > 0:
            self.fields.setdefault(name, (annotation, kind, []))[2].append(place)

    def make_fields(self) -> Iterator[Field]:
        """The fields that are shown."""
        for name, (annotation, kind, widgets) in self.fields.items():
            yield _field(name, annotation, kind, tuple(widgets))

    def notes(self, form: Any) -> list[str]:
        """Phrases on what cannot be filled in; `form` : the file's /AcroForm."""
        signatures = [name for name, (_, kind, _) in self.fields.items() if kind == "signature"]
        calculated = [full_name(each) for each in form.get("/CO", ())]
        said = [
            (signatures, "{} left empty, to be signed"),
            (sorted(self.unwritten), "{} left empty: passwords and files are not written"),
            (sorted(self.hidden - set(self.fields)), "{} not shown on the pages, and left out"),
            (calculated, "{} calculated by viewers, and not here: the table has to hold the results"),
        ]
        sentences = []
        for names, phrase in said:
            if names:
                listed = units.listed(names, _MOST_NAMED)
                sentences.append(phrase.format(f"{listed} {'is' if len(names) == 1 else 'are'}"))
        signed = (each for each in form.get("/Fields", ()) if str(each.get("/FT", "")) == "/Sig")
        if int(form.get("/SigFlags", 0)) & 1 and any(find_inherited(each, "/V") is not None for each in signed):
            sentences.append("the form was signed, and its signature no longer holds once it is filled in")
        if "/XFA" in form:
            sentences.append("its XFA part is left out")
        return sentences


_MOST_NAMED = 6  # fields that a note names


def _kind(kind: str, flags: int) -> Kind | None:
    if kind == "/Btn":
        return None if flags & _PUSH else "radio" if flags & _RADIO else "check"
    kinds: dict[str, Kind] = {"/Tx": "text", "/Ch": "choice", "/Sig": "signature"}
    return kinds.get(kind)


def _on_page(rectangle: list[float], matrix: Matrix) -> Box:
    """A rectangle of the file in mm of the page as it is shown."""
    a, b, c, d, e, f = matrix
    area = a * d - b * c
    corners = []
    for x, y in (rectangle[:2], rectangle[2:]):
        corners.append(((d * (x - e) - c * (y - f)) / area, (a * (y - f) - b * (x - e)) / area))
    (x0, y0), (x1, y1) = corners
    return min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)


def _state(annotation: Any) -> str:
    """What a button stands for when it is marked: the name of its appearance that is not "Off"."""
    normal = annotation.get("/AP", {}).get("/N", {})
    if not hasattr(normal, "keys") or "/BBox" in normal:
        return ""
    return next((str(key)[1:] for key in normal if str(key) != "/Off"), "")


def _field(name: str, annotation: Any, kind: Kind, widgets: tuple[Widget, ...]) -> Field:
    flags = int(find_inherited(annotation, "/Ff") or 0)
    multiline = kind == "text" and bool(flags & _MULTILINE)
    most = int(find_inherited(annotation, "/MaxLen") or 0) if kind == "text" else 0
    aligned: dict[int, Align] = {1: "centre", 2: "right"}
    return Field(
        name,
        kind,
        widgets,
        label=str(find_inherited(annotation, "/TU") or "").strip(),
        required=bool(flags & _REQUIRED),
        read_only=bool(flags & _READ_ONLY),
        multiline=multiline,
        cells=most if flags & _COMB and most > 0 and not multiline else 0,
        longest=most if most > 0 else None,
        options=_options(annotation, kind, widgets),
        free=kind == "choice" and bool(flags & _EDIT),
        align=aligned.get(int(find_inherited(annotation, "/Q") or 0), "left"),
        value="" if kind == "signature" else _text(find_inherited(annotation, "/V")),
    )


def _text(value: Any) -> str:
    """A value as it is shown: a string or a name; of several, the first; of a stream, nothing."""
    import pikepdf

    if isinstance(value, pikepdf.Array):
        return _text(value[0]) if len(value) else ""
    if value is None or isinstance(value, pikepdf.Stream | pikepdf.Dictionary):
        return ""
    text = str(value)
    return "" if text == "/Off" else text.removeprefix("/")


def _options(annotation: Any, kind: Kind, widgets: tuple[Widget, ...]) -> tuple[tuple[str, str], ...]:
    import pikepdf

    listed = list(find_inherited(annotation, "/Opt") or ())
    if kind == "choice":
        pairs = (list(each) if isinstance(each, pikepdf.Array) else [each] for each in listed)
        return tuple((str(pair[0]), str(pair[-1])) for pair in pairs if pair)
    if kind not in ("radio", "check"):
        return ()
    states = dict.fromkeys(widget.state for widget in widgets if widget.state)
    # of buttons that are numbered, /Opt says what the numbers mean
    return tuple((s, str(listed[int(s)]) if s.isdecimal() and int(s) < len(listed) else s) for s in states)
