"""What is read of forms: kinds and places of fields, turned pages, and files that are none."""

import pikepdf
import pytest
from forms import COMB, CYCLE, MULTILINE, RADIO, REQUIRED, blank, field, frame, states
from pikepdf import Array, Dictionary, Name, String

from handout.errors import InputError
from handout.pdf_forms.fields import MOST_PAGES, MOST_WIDGETS, read_form

POINT = 25.4 / 72


def read(pdf, path):
    pdf.save(path)
    return read_form(path)


def test_every_kind_of_field_is_read(tmp_path):
    pdf = blank()
    field(pdf, "name", (60, 700, 260, 720), Ff=REQUIRED, TU=String("Your name"), Q=2, V=String("Ada"))
    field(pdf, "code", (60, 600, 160, 620), Ff=COMB, MaxLen=5)
    field(pdf, "text", (60, 500, 260, 580), Ff=MULTILINE, MaxLen=90)
    field(pdf, "ok", (60, 400, 70, 410), "Btn", AP=states(pdf, "Yes"), AS=Name.Off)
    field(pdf, "boat", (60, 300, 160, 320), "Ch", Opt=Array([Array([String("8+"), String("eight")]), String("four")]))
    field(pdf, "sign", (60, 200, 160, 220), "Sig")
    field(pdf, "push", (60, 100, 160, 120), "Btn", Ff=1 << 16)
    field(pdf, "secret", (60, 50, 160, 70), Ff=1 << 13)
    field(pdf, "hidden", (60, 20, 160, 40)).F = 2
    pdf.Root.AcroForm.CO, pdf.Root.AcroForm.XFA = Array([pdf.Root.AcroForm.Fields[1]]), String("<xdp/>")
    form = read(pdf, tmp_path / "a.pdf")
    fields = form.fields_by_name
    assert list(fields) == ["name", "code", "text", "ok", "boat", "sign"]
    name, code, text = fields["name"], fields["code"], fields["text"]
    assert (name.kind, name.required, name.label, name.align, name.value) == ("text", True, "Your name", "right", "Ada")
    assert (code.cells, code.longest, text.cells, text.longest, text.multiline) == (5, 5, 0, 90, True)
    assert fields["ok"].widgets[0].state == "Yes" and fields["ok"].options == (("Yes", "Yes"),)
    assert fields["boat"].options == (("8+", "eight"), ("four", "four")) and fields["sign"].kind == "signature"
    said = " / ".join(form.notes)
    assert "sign is left empty" in said and "secret is left empty" in said and "hidden is not shown" in said
    assert "code is calculated by viewers" in said and "XFA part is left out" in said
    assert name.widgets[0].box == pytest.approx([60 * POINT, 122 * POINT, 260 * POINT, 142 * POINT])


def test_fields_have_the_names_of_those_they_are_part_of_and_all_their_places(tmp_path):
    pdf = blank(2)
    above = pdf.make_indirect(Dictionary(T=String("person"), FT=Name.Tx, Ff=REQUIRED))
    for page in range(2):
        place = field(pdf, "name", (60, 700, 260, 720), page=page)
        place.Parent = above
        del place["/FT"]
    for n, state in enumerate(("a", "b")):
        field(pdf, "pick", (60 + 20 * n, 400, 70 + 20 * n, 410), "Btn", Ff=RADIO, AP=states(pdf, state))
    form = read(pdf, tmp_path / "a.pdf")
    person, pick = form.fields
    assert person.name == "person.name" and [w.page for w in person.widgets] == [0, 1] and person.required
    assert pick.kind == "radio" and [w.state for w in pick.widgets] == ["a", "b"]


# a field at the top left of the page as it is shown, whichever way that is turned, 200 x 20 points
PLACES = {
    0: (60, 700, 260, 720),
    90: (100, 60, 120, 260),
    180: (295, 100, 495, 120),
    270: (475, 542, 495, 742),
}


@pytest.mark.parametrize("turn", PLACES)
def test_places_are_those_of_the_page_as_it_is_shown(tmp_path, turn):
    pdf = blank(rotate=turn, crop=(30, 40, 565, 800))
    field(pdf, "a", PLACES[turn], MK=Dictionary(R=turn))
    form = read(pdf, tmp_path / "a.pdf")
    (page,), (widget,) = form.pages, form.fields[0].widgets
    sides = (535 * POINT, 760 * POINT)
    assert (page.width, page.height) == pytest.approx(sides if turn % 180 == 0 else sides[::-1])
    left, top, right, bottom = widget.box
    assert (right - left, bottom - top) == pytest.approx((200 * POINT, 20 * POINT)) and widget.turn == 0
    corners = {0: (30, 80), 90: (20, 70), 180: (70, 60), 270: (58, 70)}
    assert (left, top) == pytest.approx([side * POINT for side in corners[turn]])
    # and back to where it is in the file
    a, b, c, d, e, f = form.matrices[0]
    back = [(a * x + c * y + e, b * x + d * y + f) for x, y in ((left, top), (right, bottom))]
    x0, y0, x1, y1 = PLACES[turn]
    assert sorted(p[0] for p in back) == pytest.approx([x0, x1]) and sorted(p[1] for p in back) == pytest.approx(
        [y0, y1]
    )


def _saved(change, **how):
    def make(path):
        pdf = blank()
        place = field(pdf, "a", (60, 700, 260, 720), MK=frame())
        change(pdf, place)
        pdf.save(path, **how)

    return make


def _many(pdf, place):
    pdf.pages[0].obj.Annots = Array([place] * (MOST_WIDGETS + 1))


def _xfa(pdf, _place):
    pdf.pages[0].obj.Annots, pdf.Root.AcroForm.XFA = Array(), String("<xdp/>")


def _set(key, value):
    return lambda _pdf, place: place.__setitem__(key, value)


LOCKED = pikepdf.Encryption(owner="o", user="u")
FORBIDDEN = pikepdf.Encryption(owner="o", user="", allow=pikepdf.Permissions(modify_form=False))
BAD = {
    "locked": (_saved(lambda *_: None, encryption=LOCKED), "locked by a password"),
    "forbidden": (_saved(lambda *_: None, encryption=FORBIDDEN), "does not permit"),
    "xfa": (_saved(_xfa), "is an XFA form"),
    "fields in a circle": (_saved(lambda _, place: place.__setitem__("/Parent", place)), "damaged"),
    "two corners": (_saved(_set("/Rect", Array([1, 2]))), "damaged"),
    "a field without extent": (_saved(_set("/Rect", Array([9, 9, 9, 9]))), "has no fields on its 1 page"),
    "too many fields": (_saved(_many), "more than 5,000 fields"),
    "pages in a circle": (lambda path: path.write_bytes(CYCLE), "damaged"),
    "text": (lambda path: path.write_text("a form"), "is no PDF"),
    "nothing": (lambda path: path.write_bytes(b""), "is no PDF"),
    "no file": (lambda path: None, "No such file"),
    "too many pages": (lambda path: blank(MOST_PAGES + 1).save(path), "has 501 pages, and a form at most 500"),
}


@pytest.mark.parametrize("what", BAD)
def test_what_is_no_form_is_refused_in_one_sentence(tmp_path, what):
    make, words = BAD[what]
    make(tmp_path / "bad.pdf")
    with pytest.raises(InputError, match=words) as refused:
        read_form(tmp_path / "bad.pdf")
    assert "\n" not in str(refused.value) and str(refused.value).startswith(str(tmp_path / "bad.pdf"))
