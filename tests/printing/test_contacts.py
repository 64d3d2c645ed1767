"""Contacts of phones and address books as tables."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import TableError
from handout.printing.address_table import read_addresses
from handout.printing.contacts import read_contacts

CARDS = """BEGIN:VCARD\r
VERSION:3.0\r
N:Lovelace;Ada;;;\r
FN:Lady Ada Lovelace\r
item1.ADR;TYPE=WORK:;;9 Office Road;London;;E1 6AN;UK\r
item2.ADR;TYPE="HOME;x:y":;;1 Long\r
  Lane;London;;W1A 1AA;United Kingdom\r
TEL:1\r
TEL;TYPE=CELL:2\r
PHOTO;ENCODING=b:AAAA\r
 BBBB\r
END:VCARD\r
BEGIN:VCARD
VERSION:4.0
FN:Zoë Quill
ORG:Quill\\, Sons\\; Daughters;Ink
ADR;PREF=1:;;2 Rue Haute\\nbis;Paris;;75001;France
END:VCARD
"""


def test_names_and_addresses_are_read_and_the_rest_is_told(tmp_path):
    (tmp_path / "people.vcf").write_bytes(b"\xef\xbb\xbf" + CARDS.encode())
    table = read_addresses(tmp_path / "people.vcf")
    assert [row.lines for row in table] == [
        ("Ada Lovelace", "1 Long Lane", "London", "W1A 1AA", "UNITED KINGDOM"),
        ("Quill, Sons; Daughters", "Zoë Quill", "2 Rue Haute bis", "75001 Paris", "FRANCE"),
    ]
    assert "of the contacts names and addresses are read, not TEL (2), PHOTO (1)" in table.notes
    assert any("not 1 more" in note for note in table.notes)


def test_cards_of_an_older_phone_are_in_quoted_printable():
    text = (
        "BEGIN:VCARD\r\nVERSION:2.1\r\nN;CHARSET=UTF-8;ENCODING=QUOTED-PRINTABLE:M=C3=BCller=\r\n;J=C3=B6rg\r\n"
        "ADR;HOME;ENCODING=QUOTED-PRINTABLE:;;Hof 1=3B links=0D=0A2. Stock;K=F6ln;;50667;\r\n"
        "PHOTO;ENCODING=BASE64;JPEG:AAA=\r\n\r\nEND:VCARD\r\n"
    )
    (header, row), _ = read_contacts(text)
    assert dict(zip(header, row, strict=True)) == {
        "First name": "Jörg", "Last name": "Müller", "Street": "Hof 1; links 2. Stock", "City": "Köln",
        "Postal code": "50667",
    }  # fmt: skip
    (_, row), _ = read_contacts(text.replace("UTF-8", "KOI8-R").replace("M=C3=BCller=\r\n", "=E1=CE=CE=C1"))
    assert "Анна" in row


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (CARDS.replace("3.0", "1.0"), "card 1 is a vCard 1.0: export"),
        (CARDS.removesuffix("END:VCARD\n"), "not closed"),
        (CARDS.replace("VERSION:4.0", "what is this"), r"line \d+ is no line"),
    ],
)
def test_what_is_no_contacts_file_is_said(text, says):
    with pytest.raises(TableError, match=says):
        read_contacts(text)


PART = st.text(st.sampled_from('\\\\;,n:\n "éA\u2028') | st.characters(exclude_categories=["Cc", "Cs"]), max_size=12)


@given(st.lists(PART.filter(str.strip), min_size=7, max_size=7))
def test_what_is_escaped_comes_back(parts):
    """RFC 6350, §3.4: of a backslash, a comma, a semicolon and a line end in a part."""
    escaped = [re.sub(r"([\\\\,;])", r"\\\1", part).replace("\n", "\\n") for part in parts]
    text = f"BEGIN:VCARD\r\nVERSION:4.0\r\nADR:{';'.join(escaped)}\r\nEND:VCARD\r\n"
    (_, row), _ = read_contacts(text)
    assert row == [" ".join(part.split()) for part in parts]


@given(st.text(alphabet='ADRN:;,\\=\n\r "éPREF.', max_size=200))
def test_whatever_a_card_holds_is_read_or_refused(text):
    try:
        (header, *rows), _ = read_contacts(f"BEGIN:VCARD\nVERSION:4.0\n{text}\nEND:VCARD\n")
    except TableError:
        return
    assert all(len(row) == len(header) for row in rows)
