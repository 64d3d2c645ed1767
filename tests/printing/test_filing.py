"""What becomes of every cell of a table: written, or named as not written."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError, TableError
from handout.printing.address_table import read_addresses, read_rows


def read(tmp_path, text, encoding="utf-8", **given):
    path = tmp_path / "t.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return read_addresses(path, **given)


def lines_of(found):
    return [row.lines for row in found]


def test_headers_with_plurals_and_several_meanings_lose_nothing(tmp_path):
    text = "Guest(s),Street Address,Apt,City/State/Zip\n"
    text += 'Ada & Bob Byron,12 Elm St,4B,"Boston, MA 02138"\nCy,2 Oak,,NYC NY 2138\n'
    found = read(tmp_path, text)
    assert lines_of(found) == [
        ("Ada & Bob Byron", "12 Elm St", "4B", "Boston, MA 02138"), ("Cy", "2 Oak", "NYC, NY 2138"),
    ]  # fmt: skip
    assert found.unused == () and found.notes == () and "02138" in found[1].warnings[0]


def test_two_columns_of_one_meaning_are_both_written(tmp_path):
    text = "Anrede;Titel;Vorname;Nachname;Straße;Street;PLZ;Ort;Telefon\n"
    text += "Frau;Dr.;Käthe;Ahl;Weg 1;Haus C;01067;Dresden;03\n"
    found = read(tmp_path, text)
    assert lines_of(found) == [("Frau Dr. Käthe Ahl", "Weg 1", "Haus C", "01067 Dresden")]
    assert found.unused == ("Telefon",) and found.notes == ("this column is not used: 'Telefon'",)
    same = read(tmp_path, "Name,Street,Street,City\nAda,1 Lane,1 Lane,Ely\n")
    assert lines_of(same) == [("Ada", "1 Lane", "Ely")] and same.unused == ()


def test_two_people_are_two_lines(tmp_path):
    text = "First Name,Last Name,Partner First Name,Partner Last Name,Street,City\n"
    text += "Ada,Byron,Cy,Dee,1 Lane,Ely\nEve,Fox,,,2 Lane,Ely\n"
    assert [lines[:2] for lines in lines_of(read(tmp_path, text))] == [("Ada Byron", "Cy Dee"), ("Eve Fox", "2 Lane")]
    turned = read(tmp_path, 'Name/Vorname;Straße;Ort\n"Ahl, Käthe";Weg 1;Ulm\n')
    assert turned[0].lines[0] == "Käthe Ahl"


def test_what_is_not_written_of_a_column_that_is_used_is_said(tmp_path):
    text = "Anrede,Name,Adresse,Straße,PLZ,Ort\nSehr geehrte Frau,Ada Ahl,Altweg 7,Weg 1,89073,Ulm\n"
    found = read(tmp_path, text)
    assert lines_of(found) == [("Ada Ahl", "Weg 1", "89073 Ulm")] and found.unused == ("Anrede", "Adresse")
    assert found.notes == (
        "what 'Anrede' holds is not written in row 2: it opens a letter",
        "what 'Adresse' holds is not written in row 2: other columns say it otherwise",
    )


@settings(max_examples=60)
@given(
    st.permutations(
        ["Name", "Title", "Company", "Street", "Street", "Apt", "Address 2", "Zip", "City", "Notes", "Guest(s)"]
    ),
    st.lists(st.sampled_from(["", "Ada Byron", "1 Lane", "Dr.", "Ely", "B7"]), min_size=11, max_size=11),
)
def test_every_cell_is_written_or_its_column_is_named(tmp_path_factory, headers, cells):
    path = tmp_path_factory.getbasetemp() / "cells.csv"
    path.write_text("\n".join(",".join(row) for row in (headers, cells)) + "\n")
    try:
        found = read_addresses(path, nameless=True)
    except TableError:
        return
    told = " ".join([*found[0].lines, found[0].problem])
    for header, cell in zip(headers, cells, strict=True):
        assert not cell or cell in told or found[0].problem or any(header in note for note in found.notes)


OUTLOOK = (
    "First Name,Last Name,Company,Home Street,Home City,Home Postal Code,Business Street,Business City,"
    "Business Postal Code\nAda,Fox,Engines,1 Home,York,YO1 1AA,2 Work,Leeds,LS1 1AA\nBob,Gil,,,,,3 Work,Bath,BA1 1AA\n"
)


def test_an_address_book_with_several_addresses_a_person(tmp_path):
    found = read(tmp_path, OUTLOOK)
    assert [lines[-2:] for lines in lines_of(found)] == [("York", "YO1 1AA"), ("Bath", "BA1 1AA")]
    assert found.notes == (
        "what 'Company' holds is not written in row 2: it belongs to the business address",
        "row 2 has a business address too, which is not written; --address business chooses it",
    )
    assert found[0].lines[:2] == ("Ada Fox", "1 Home") and "Company" in found.unused
    work = read(tmp_path, OUTLOOK, address="work")
    assert [lines[-2] for lines in lines_of(work)] == ["Leeds", "Bath"]
    home = read(tmp_path, OUTLOOK, address="privat")
    assert "it has no home address: its business address is written" in home[1].warnings
    with pytest.raises(TableError, match="has home, business, and no 'billing'"):
        read(tmp_path, OUTLOOK, address="billing")


def test_an_address_of_no_kind_beside_one_of_some_kind(tmp_path):
    text = "Name,Street,City,Work Street,Work City\nAda,1 Lane,Ely,2 Road,York\n"
    plain, work = read(tmp_path, text), read(tmp_path, text, address="work")
    assert lines_of(plain) == [("Ada", "1 Lane", "Ely")] and lines_of(work) == [("Ada", "2 Road", "York")]
    assert "business address too" in plain.notes[0] and "plain address too" in work.notes[0]
    box = "Name,PO Box,Home City,Home Postal Code\nAda,Box 9,Ely,CB7\n"
    assert lines_of(read(tmp_path, box)) == [("Ada", "Box 9", "CB7 Ely")]


def test_orders_of_a_shop_go_to_the_name_on_the_parcel(tmp_path):
    text = "Name,Shipping Name,Shipping Street,Shipping City,Billing Name,Billing Street,Billing City\n"
    found = read(tmp_path, text + "#1001,Ada Fox,1 Elm St,Ely,Bob Gil,2 Oak St,York\n")
    assert lines_of(found) == [("Ada Fox", "1 Elm St", "Ely")]
    assert found.unused == ("Name", "Billing Name", "Billing Street", "Billing City") and len(found.notes) == 2


GOOGLE = (
    "Name,Given Name,Family Name,Name Prefix,Organization 1 - Title,Address 1 - Type,Address 1 - Formatted,"
    "Address 1 - Street,Address 1 - City,Address 1 - Region,Address 1 - Postal Code,Address 1 - Extended Address,"
    "Phone 1 - Value\nDr. Ada Fox,Ada,Fox,Dr.,CEO,Home,"
    '"1 Elm St\nApt 2\nBoston, MA 02138",1 Elm St,Boston,MA,02138,Apt 2,'
    '555\nBob,Bob,,,,Work,"Weg 1\n89073 Ulm",,,,,,\n'
)


def test_contacts_of_google(tmp_path):
    found = read(tmp_path, GOOGLE)
    assert lines_of(found) == [
        ("Dr. Ada Fox", "1 Elm St", "Apt 2", "Boston, MA 02138"), ("Bob", "Weg 1", "89073 Ulm"),
    ]  # fmt: skip
    assert set(found.unused) == {"Organization 1 - Title", "Phone 1 - Value"}
    newer = "First Name,Last Name,Labels,Address 1 - Label,Address 1 - Formatted,Address 1 - Street,Address 1 - City\n"
    assert lines_of(read(tmp_path, newer + 'Ada,Fox,* x,Home,"1 Lane\nEly",1 Lane,Ely\n')) == [
        ("Ada Fox", "1 Lane", "Ely")
    ]


def test_columns_as_the_user_says(tmp_path):
    text = "Tisch,Wer,Und,Straße,Ort\n1,Käthe,Ben,Weg 1,Ulm\n"
    found = read(tmp_path, text, columns=["name=Wer,name=Und", "none=Tisch"])
    assert lines_of(found) == [("Käthe", "Ben", "Weg 1", "Ulm")] and found.unused == ("Tisch",)
    assert lines_of(read(tmp_path, text, columns=["2=name"])) == [("Käthe", "Weg 1", "Ulm")]
    guests = read(tmp_path, "Guest(s);Wo, genau;Ort\nAda;Weg 1;Ulm\n", columns=["name=guest(s),street=Wo, genau"])
    assert lines_of(guests) == [("Ada", "Weg 1", "Ulm")]
    twice = "Name;Straße;Ort;Ort\nAda;Weg 1;Ulm;x\n"
    with pytest.raises(InputError, match='such as --columns "none=4"'):
        read(tmp_path, twice)
    for text in (twice, f"Gästeliste;;;\n;;;\n{twice}"):
        assert lines_of(read(tmp_path, text, columns=["none=4"])) == [("Ada", "Weg 1", "Ulm")]
    for wrong, words in (("name=Who", "no column 'Who'"), ("nmae=Wer", "did you mean name"), ("Wer", "does not say")):
        with pytest.raises(InputError, match=words):
            read(tmp_path, text, columns=[wrong])


def test_a_table_without_a_header(tmp_path):
    text = "Käthe,Weg 1,01067,Dresden\nBen,Weg 2,1067,Dresden\n"
    found = read(tmp_path, text, columns=["1=name,2=street,3=postcode,4=city"])
    assert [row.number for row in found] == [1, 2] and found[0].lines == ("Käthe", "Weg 1", "01067 Dresden")
    assert found.notes == ("there is no header: row 1 is the first address",)
    assert "(01067)" in found[1].warnings[0] and not found[0].warnings


def test_short_codes_without_a_country_are_questioned_once_where_all_are_alike(tmp_path):
    one = read(tmp_path, "Name;Straße;Ort\nA;Weg 1;1067 Dresden\n")
    assert "4 digits and no country is named" in one[0].warnings[0] and "(01067)" in one[0].warnings[0]
    swiss = "Name;Straße;PLZ;Ort\n" + "".join(f"A;Weg {n};800{n};Zürich\n" for n in range(1, 6))
    found = read(tmp_path, swiss)
    assert not any(row.warnings for row in found) and found.notes[0].startswith("rows 2-6: postal code 8001 has 4")
    assert not any(row.warnings for row in read(tmp_path, "Name;Ort;Land\nA;8001 Zürich;CH\n"))


def test_a_table_without_headings_is_told(tmp_path):
    (tmp_path / "names.csv").write_text("Anna,Meier\nJörg,Weiß\n", encoding="utf-8")
    found = read_rows(tmp_path / "names.csv")
    assert len(found) == 1 and "none of which is known (Anna, Meier)" in found.notes[0]


def test_tables_as_phones_and_office_programs_make_them(tmp_path):
    numbers = "Gästeliste;;;\n;;;\nName;Straße;PLZ;Ort;;\n"
    numbers += "“Ada; B”;Weg\u00a01;'01067;Dresden;;\nName;Straße;PLZ;Ort;;\n;;;;;\n\u00a0;;\n"
    found = read(tmp_path, numbers)
    assert lines_of(found) == [("Ada; B", "Weg 1", "01067 Dresden")] and found[0].number == 4
    assert found.notes == ("row 1 above the header is not read", "the header comes again in row 5, which is skipped")
    excel = 'sep=;\r\nName;Straße;PLZ;Ort\r\n"’s Gravenweg, Jan";"Weg 1\r\nHaus 2";="01067";Dresden\r\n'.encode(
        "cp1252"
    )
    assert read(tmp_path, excel)[0].lines == ("’s Gravenweg, Jan", "Weg 1", "Haus 2", "01067 Dresden")
    mac = "Name\tStraße\tOrt\rKäthe Müller\tWeg 1\t01067 Dresden\r".encode("mac_roman")
    found = read(tmp_path, mac)
    assert found[0].lines[0] == "Käthe Müller"
    assert found.notes == ("read as Mac OS Roman because it is not UTF-8: check the accents in 'Käthe', 'Müller'",)
    drawn = "| Name | Street | City |\n|---|:---:|---|\n| Ada | 1 Lane | Ely |\n"
    assert lines_of(read(tmp_path, drawn)) == [("Ada", "1 Lane", "Ely")]


def test_errors_of_a_spreadsheet_are_not_written(tmp_path):
    (row,) = read(tmp_path, "Name,Street,City\nAda,#REF!,Ely\n")
    assert row.problem == "the cell under 'Street' holds the error #REF!"


def test_a_street_that_no_column_holds_is_said(tmp_path):
    assert "no column is read as a street" in read(tmp_path, "Name,Wo,City\nAda,1 Lane,Ely\n").notes
