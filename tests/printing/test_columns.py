import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.printing import columns


@pytest.mark.parametrize(
    ("headers", "roles"),
    [
        (["Full Name", "Company", "Street Address", "Address 2", "ZIP code", "City", "State", "Country"],
         ["name", "company", "street", "street2", "postcode", "city", "state", "country"]),
        (["Vorname", "Nachname", "Firma", "Straße", "Hausnr.", "Adresszusatz", "PLZ", "Ort", "Land"],
         ["first", "last", "company", "street", "number", "extra", "postcode", "city", "country"]),
        (["Civilité", "Prénom", "NOM", "Société", "N°", "Rue", "Complément d'adresse", "Code postal", "Ville", "Pays"],
         ["title", "first", "last", "company", "number", "street", "extra", "postcode", "city", "country"]),
        (["Nombre", "Apellidos", "Dirección", "Código Postal", "Población", "Provincia", "País"],
         ["first", "last", "street", "postcode", "city", "state", "country"]),
        (["Nome", "Cognome", "Indirizzo", "CAP", "Città", "Prov.", "Paese"],
         ["first", "last", "street", "postcode", "city", "state", "country"]),
        (["Voornaam", "Achternaam", "Straat", "Huisnummer", "Postcode", "Woonplaats", "Land"],
         ["first", "last", "street", "number", "postcode", "city", "country"]),
        (["Nr.", "Name", "Anschrift"], [None, "name", "address"]),
        (["Name", "Adresse", "PLZ/Ort"], ["name", "street", "place"]),
        (["name", "c/o", "strasse", "E-Mail"], ["name", "careof", "street", None]),
    ],
)  # fmt: skip
def test_headers_of_six_languages(headers, roles):
    assert columns.roles(headers) == roles


@given(st.text(max_size=20))
def test_a_key_does_not_depend_on_case_or_spacing(header):
    assert columns.key(f" {header} ".upper().lower()) == columns.key(header.upper().lower())
    assert columns.key(columns.key(header)) == columns.key(header)


def test_no_header_means_two_things():
    seen: dict[str, str] = {}
    for role, headers in columns._HEADERS.items():
        for key in {columns.key(header) for header in headers.replace("\n", ",").split(",")} - {""}:
            assert key not in seen, f"{key} is both {seen[key]} and {role}"
            seen[key] = role
    assert len(seen) > 200


def test_a_table_of_names_is_not_addressable():
    assert not columns.addressable(columns.roles(["Name", "Mail"]))
    assert columns.addressable(columns.roles(["Name", "Anschrift"]))
