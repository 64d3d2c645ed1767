"""A form's own pages with the writing on top of them.

What a page shows is left as it is: the streams of its content stay, and the writing is drawn after them.  Viewers draw
fields over the page, where they would hide the writing, so that their frames become part of the page; only signatures
stay fields.

Source: ISO 32000-1:2008, 12.5.5 (algorithm 8.1, where the appearance of a field lies).
"""

from __future__ import annotations

import io
import re
from collections.abc import Collection, Mapping, Sequence
from itertools import count
from typing import Any

from handout.pdf_forms.fields import DEEPEST, Field, Kind, PdfForm, find_inherited, full_name, is_widget, open_pdf
from handout.units import POINT

# what of the appearance of a text field is its value: between these it is drawn
_VALUE = re.compile(rb"/Tx\s+BMC\b.*?\bEMC\b", re.DOTALL)
_HIDDEN = 1 << 1 | 1 << 5  # flags of what is not seen


def blank(form: PdfForm, answered: Collection[str]) -> bytes:
    """The form with the frames of its fields as part of its pages, without the values of those that are answered.

    Raises InputError: it cannot be read; see `fields.open_pdf`.
    """
    with open_pdf(form.path) as document:
        for page in document.pages:
            _flatten(document, page, form.fields_by_name, answered)
        root = document.Root
        signatures = [each for each in root.get("/AcroForm", {}).get("/Fields", ()) if _has_signature(each)]
        if signatures:
            root.AcroForm.Fields = _array(signatures)
            _remove_keys(root.AcroForm, "/XFA", "/NeedAppearances", "/CO")
        else:
            _remove_keys(root, "/AcroForm")
        _remove_keys(root, "/NeedsRendering", "/Perms")
        return _save_bytes(document)


def _resource(page: Any, resource: Any, kind: str) -> str:
    """The name of a resource that is added to a page: the same in every run."""
    import pikepdf

    # of no kind may a resource have the name: pikepdf replaces those of others, too
    known = {str(name) for each in page.resources.values() if isinstance(each, pikepdf.Dictionary) for name in each}
    name = next(name for n in count() if (name := f"/Writing{n}") not in known)
    return str(page.add_resource(resource, pikepdf.Name(kind), pikepdf.Name(name)))


def _array(items: Sequence[Any]) -> Any:
    import pikepdf

    return pikepdf.Array(list(items))


def _has_signature(field: Any, depth: int = 0) -> bool:
    """Whether a field is a signature, or has one below it."""
    if str(field.get("/FT", "")) == "/Sig":
        return True
    return depth < DEEPEST and any(_has_signature(each, depth + 1) for each in field.get("/Kids", ()))


def _remove_keys(dictionary: Any, *keys: str) -> None:
    for key in keys:
        if key in dictionary:
            del dictionary[key]


def _save_bytes(document: Any) -> bytes:
    stream = io.BytesIO()
    document.save(stream, deterministic_id=True, compress_streams=True)
    return stream.getvalue()


def _flatten(document: Any, page: Any, fields: Mapping[str, Field], answered: Collection[str]) -> None:
    """Draw the fields of a page on it, and take them away."""
    annotations = list(page.obj.get("/Annots", ()))
    named = {n: fields.get(full_name(each)) for n, each in enumerate(annotations) if is_widget(each)}
    kinds: dict[int, Kind | None] = {n: None if field is None else field.kind for n, field in named.items()}
    gone = [n for n, kind in kinds.items() if kind != "signature"]
    if not gone:
        return
    drawn = [_appearance(document, page, annotations[n], answered) for n in gone]
    page.contents_add(b"q\n", prepend=True)
    page.contents_add(b"\nQ\n" + b"".join(drawn))
    page.obj.Annots = _array([each for n, each in enumerate(annotations) if n not in gone])


def _appearance(document: Any, page: Any, annotation: Any, answered: Collection[str]) -> bytes:
    """What draws a field on its page."""
    import pikepdf

    if int(annotation.get("/F", 0)) & _HIDDEN:
        return b""
    is_answered = full_name(annotation) in answered
    look = annotation.get("/AP", {}).get("/N")
    if isinstance(look, pikepdf.Dictionary) and not isinstance(look, pikepdf.Stream):
        look = look.get("/Off" if is_answered else str(annotation.get("/AS", "/Off")))
        if look is None:  # nothing is seen of a button that has no look for its state
            return b""
    elif isinstance(look, pikepdf.Stream) and is_answered:
        look = _without_value(document, look, has_value=bool(find_inherited(annotation, "/V")))
    rectangle: Any = pikepdf.Rectangle(annotation.Rect)
    if not isinstance(look, pikepdf.Stream):
        # the ground and the border of a field that has no appearance of its own
        characteristics = annotation.get("/MK", {})
        lines = []
        sides = f"{rectangle.llx:.3f} {rectangle.lly:.3f} {rectangle.width:.3f} {rectangle.height:.3f} re"
        for key, operators, paint in (("/BG", ("g", "rg", "k"), "f"), ("/BC", ("G", "RG", "K"), "S")):
            colour = [float(part) for part in characteristics.get(key, ())]
            if len(colour) in (1, 3, 4):
                operator = operators[{1: 0, 3: 1, 4: 2}[len(colour)]]
                lines.append(f"q {' '.join(f'{part:.4g}' for part in colour)} {operator} 1 w {sides} {paint} Q\n")
        return "".join(lines).encode()
    return _place_appearance(page, look, rectangle)


def _without_value(document: Any, look: Any, *, has_value: bool) -> Any:
    """The appearance of a field without its value; None where the two cannot be parted."""
    content = look.read_bytes()
    if "/BBox" not in look or (has_value and _VALUE.search(content) is None):
        return None
    form = document.make_stream(_VALUE.sub(b"", content))
    for key in ("/BBox", "/Matrix", "/Resources"):
        if key in look:
            form[key] = look[key]
    return form


def _place_appearance(page: Any, look: Any, rectangle: Any) -> bytes:
    """The operators that draw an appearance so that it fills a rectangle of its page."""
    import pikepdf

    look.Type, look.Subtype = pikepdf.Name.XObject, pikepdf.Name.Form
    matrix: Any = pikepdf.Matrix(look.get("/Matrix", (1, 0, 0, 1, 0, 0)))
    box = matrix.transform(pikepdf.Rectangle(look.BBox))
    if not (box.width > 0 and box.height > 0):
        return b""
    a, d = rectangle.width / box.width, rectangle.height / box.height
    e, f = rectangle.llx - a * box.llx, rectangle.lly - d * box.lly
    return f"q {a:.6f} 0 0 {d:.6f} {e:.4f} {f:.4f} cm {_resource(page, look, '/XObject')} Do Q\n".encode()


def fill_form(base: bytes, form: PdfForm, writing: Mapping[int, tuple[bytes, bool]]) -> bytes:
    """A form's pages with writing on them.

    base : as `blank` makes it.
    writing : by the number of a page from 0: a PDF of one page, as large as that is shown, and whether it is a picture
        on white, through which the form is seen as through ink.
    """
    import pikepdf

    with pikepdf.open(io.BytesIO(base)) as document:
        for number, (content, picture) in writing.items():
            page = document.pages[number]
            with pikepdf.open(io.BytesIO(content)) as written:
                ink = document.copy_foreign(written.pages[0].as_form_xobject())
            if picture:
                ink.Group = pikepdf.Dictionary(S=pikepdf.Name.Transparency, CS=pikepdf.Name.DeviceRGB, I=True)
            state = pikepdf.Dictionary(Type=pikepdf.Name.ExtGState, BM=pikepdf.Name.Multiply)
            name = _resource(page, ink, "/XObject")
            blend = f"{_resource(page, state, '/ExtGState')} gs " if picture else ""
            a, b, c, d, e, f = form.matrices[number]
            # the page of writing is in points, y up, from its lower left corner
            height = form.pages[number].height
            parts = (a * POINT, b * POINT, -c * POINT, -d * POINT, e + c * height, f + d * height)
            placing = " ".join(f"{part:.6f}" for part in parts)
            page.contents_add(b"q\n", prepend=True)
            page.contents_add(f"\nQ q {blend}{placing} cm {name} Do Q\n".encode())
        return _save_bytes(document)
