"""A form to fill in: makes form.pdf, whose fields examples/form.csv answers.

python examples/form.py
handout fill form.pdf
handout fill form.pdf examples/form.csv -o filled.pdf
"""

import sys

from reportlab.lib.colors import Color, black, white
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

PALE, RULE = Color(0.93, 0.95, 0.98), Color(0.35, 0.4, 0.5)


def main(path: str) -> None:
    """Draw two pages: who joins, and what they want."""
    canvas = Canvas(path, pagesize=(210 * mm, 297 * mm), invariant=True)
    canvas.setTitle("Application for membership")
    _heading(canvas, "Application for membership", "Rowing club on the lake  ·  please fill in by hand")
    for name, label, y, required in [("surname", "Surname", 240, True), ("first_name", "First name", 226, True)]:
        _box(canvas, name, label, 60, y, 120, required=required)
    _rule(canvas, "street", "Street, number", 60, 212, 120)
    _comb(canvas, "postcode", "Postal code", 60, 198, 5)
    _rule(canvas, "city", "City", 110, 198, 70)
    _comb(canvas, "born", "Born (ddmmyyyy)", 60, 184, 8)
    _rule(canvas, "email", "E-mail", 60, 170, 120)
    _label(canvas, "Membership", 20, 156)
    for place, value in enumerate(("adult", "junior", "family")):
        x = 60 + 32 * place
        canvas.acroForm.radio(
            name="membership", value=value, tooltip="Membership", x=x * mm, y=155 * mm, size=4.5 * mm,
            selected=False, buttonStyle="cross", shape="square", borderColor=RULE, fillColor=white, borderWidth=0.7,
        )  # fmt: skip
        canvas.drawString((x + 7) * mm, 156 * mm, value)
    for name, label, y in [
        ("swims", "I can swim 200 m in clothes", 142),
        ("newsletter", "Send me the newsletter", 133),
    ]:
        canvas.acroForm.checkbox(
            name=name, tooltip=label, x=60 * mm, y=y * mm, size=4.5 * mm, borderColor=RULE, fillColor=white,
            borderWidth=0.7, buttonStyle="cross", fieldFlags="",
        )  # fmt: skip
        canvas.drawString(67 * mm, (y + 1) * mm, label)
    _label(canvas, "Boat", 20, 121)
    canvas.acroForm.choice(
        name="boat", tooltip="Boat", options=["single scull", "double scull", "coxed four", "eight"],
        value="single scull", x=60 * mm, y=119 * mm, width=60 * mm, height=7 * mm, borderColor=RULE, fillColor=white,
        borderWidth=0.7, fieldFlags="combo",
    )  # fmt: skip
    canvas.showPage()
    _heading(canvas, "What we should know", "Second page")
    _rule(canvas, "surname", "Surname", 60, 240, 120)
    _label(canvas, "Illnesses, wishes, who brought you to us", 20, 226)
    canvas.setStrokeColor(RULE)
    canvas.setLineWidth(0.5)
    for line in range(6):
        canvas.line(20 * mm, (214 - 9 * line) * mm, 190 * mm, (214 - 9 * line) * mm)
    _field(canvas, "remarks", "Remarks", 20, 168, 170, 55, "multiline")
    _label(canvas, "Message to the crew", 20, 155)
    _field(canvas, "message", "Message", 20, 120, 170, 32, "multiline", framed=True)
    _label(canvas, "Signature", 20, 100)
    canvas.line(60 * mm, 99 * mm, 140 * mm, 99 * mm)
    canvas.showPage()
    canvas.save()


def _heading(canvas: Canvas, title: str, under: str) -> None:
    canvas.setFont("Helvetica-Bold", 18)
    canvas.drawString(20 * mm, 268 * mm, title)
    canvas.setFont("Helvetica", 10)
    canvas.drawString(20 * mm, 261 * mm, under)


def _label(canvas: Canvas, text: str, x: float, y: float) -> None:
    canvas.setFont("Helvetica", 9)
    canvas.setFillColor(black)
    canvas.drawString(x * mm, y * mm, text)


def _field(
    canvas: Canvas, name: str, label: str, x: float, y: float, width: float, height: float, flags: str = "",
    *, framed: bool = False, longest: int | None = None,
) -> None:  # fmt: skip
    canvas.acroForm.textfield(
        name=name, tooltip=label, x=x * mm, y=y * mm, width=width * mm, height=height * mm, fieldFlags=flags,
        borderWidth=0.7 if framed else 0, borderColor=RULE if framed else None, fillColor=PALE if framed else None,
        maxlen=longest, forceBorder=framed,
    )  # fmt: skip


def _box(canvas: Canvas, name: str, label: str, x: float, y: float, width: float, *, required: bool) -> None:
    _label(canvas, label + (" *" if required else ""), 20, y + 2)
    _field(canvas, name, label, x, y, width, 8, "required" if required else "", framed=True)


def _rule(canvas: Canvas, name: str, label: str, x: float, y: float, width: float) -> None:
    _label(canvas, label, 20 if x == 60 else x - 10, y + 1)
    canvas.setStrokeColor(RULE)
    canvas.setLineWidth(0.5)
    canvas.line(x * mm, y * mm, (x + width) * mm, y * mm)
    _field(canvas, name, label, x, y, width, 8)


def _comb(canvas: Canvas, name: str, label: str, x: float, y: float, cells: int) -> None:
    _label(canvas, label, 20, y + 2)
    canvas.setStrokeColor(RULE)
    canvas.setLineWidth(0.5)
    canvas.grid([(x + 6 * cell) * mm for cell in range(cells + 1)], [y * mm, (y + 8) * mm])
    _field(canvas, name, label, x, y, 6 * cells, 8, "comb", longest=cells)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "form.pdf")
