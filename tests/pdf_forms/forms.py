"""Forms as programs make them, good and bad, of a few objects each."""

import pikepdf
from pikepdf import Array, Dictionary, Name, String

PAGE = (0, 0, 595, 842)
COMB, MULTILINE, REQUIRED, RADIO = 1 << 24, 1 << 12, 1 << 1, 1 << 15


def blank(pages=1, rotate=0, box=PAGE, crop=None):
    """A PDF with an empty form."""
    pdf = pikepdf.new()
    for _ in range(pages):
        pdf.add_blank_page(page_size=(595, 842))
        page = pdf.pages[-1].obj
        page.MediaBox, page.Annots = Array(list(box)), Array()
        if rotate:
            page.Rotate = rotate
        if crop:
            page.CropBox = Array(list(crop))
    pdf.Root.AcroForm = pdf.make_indirect(Dictionary(Fields=Array()))
    return pdf


def field(pdf, name, rectangle, kind="Tx", page=0, **more):
    """A field with one place, which is what it returns."""
    widget = Dictionary(Type=Name.Annot, Subtype=Name.Widget, FT=Name("/" + kind), Rect=Array(list(rectangle)), F=4)
    widget.T = String(name)
    for key, value in more.items():
        widget[f"/{key}"] = value
    made = pdf.make_indirect(widget)
    pdf.pages[page].obj.Annots.append(made)
    pdf.Root.AcroForm.Fields.append(made)
    return made


def states(pdf, *names):
    """The appearances of a button: one for each name, and Off."""
    normal = Dictionary({f"/{name}": pdf.make_stream(b"", BBox=Array([0, 0, 1, 1])) for name in (*names, "Off")})
    return Dictionary(N=normal)


def frame(*shade):
    """How a field looks without an appearance: a black border, and a ground."""
    return Dictionary(BC=Array([0, 0, 0]), **({"BG": Array(list(shade))} if shade else {}))


CYCLE = b"""%PDF-1.4
1 0 obj<</Type/Catalog/Pages 2 0 R/AcroForm<</Fields[]>>>>endobj
2 0 obj<</Type/Pages/Count 1/Kids[3 0 R]>>endobj
3 0 obj<</Type/Pages/Count 1/Kids[2 0 R]/Parent 2 0 R>>endobj
trailer<</Root 1 0 R/Size 4>>
"""
