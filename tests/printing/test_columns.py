import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.printing import column_names, columns


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
        (["Имя", "Фамилия", "Улица", "Дом", "Квартира", "Индекс", "Город", "Область", "Страна"],
         ["first", "last", "street", "number", "extra", "postcode", "city", "state", "country"]),
        (["ПІБ", "Вулиця", "Будинок", "Поштовий індекс", "Місто", "Країна"],
         ["name", "street", "number", "postcode", "city", "country"]),
        (["Ονοματεπώνυμο", "Οδός", "Αριθμός", "Τ.Κ.", "Πόλη", "Χώρα"],
         ["name", "street", "number", "postcode", "city", "country"]),
        (["Nr.", "Name", "Anschrift"], [None, "name", "address"]),
        (["Name", "Adresse", "PLZ/Ort"], ["name", "street", "place"]),
        (["name", "c/o", "strasse", "E-Mail"], ["name", "careof", "street", None]),
    ],
)  # fmt: skip
def test_headers_of_many_languages(headers, roles):
    assert [column.role for column in columns.columns(headers)] == roles


@given(st.text(max_size=20))
def test_a_key_does_not_depend_on_case_or_spacing(header):
    assert column_names.normalise(f" {header} ".upper().lower()) == column_names.normalise(header.upper().lower())
    assert column_names.normalise(column_names.normalise(header)) == column_names.normalise(header)


def test_no_header_means_two_things():
    seen: dict[str, str] = {}
    for role, text in column_names._NAMES["roles"].items():
        for key in set(column_names._read_names(text)):
            assert key not in seen, f"{key} is both {seen[key]} and {role}"
            seen[key] = role
    assert len(seen) > 400


def test_a_table_of_names_is_not_addressable():
    assert not columns.addressable(columns.columns(["Name", "Mail"]))
    assert columns.addressable(columns.columns(["Name", "Anschrift"]))


def roles_of(text, delimiter=","):
    return [(column.role, column.kind) for column in columns.columns(text.split(delimiter))]


def plain(text, delimiter=","):
    return [role for role, kind in roles_of(text, delimiter) if not kind]


def test_headers_that_hold_several_things():
    assert plain("Guest(s),Street Address,Apt,City/State/Zip") == ["name", "street", "extra", "place"]
    assert plain("Name, Vorname;Strasse/Hausnr.;PLZ Wohnort", ";") == ["name", "street", "place"]
    assert plain("Nom & Prénom;N° et rue;CP/Ville;Société/Service", ";") == ["name", "street", "place", "company"]
    assert plain("Gast/Gäste,City ST Zip,State/Province,ZIP/Postal code") == ["name", "place", "state", "postcode"]
    assert plain("Name and address,Street/Zip/City") == ["address", "address"]


def test_headers_as_programs_write_them():
    assert plain("guest_name,mailingStreet,zipCode,cityName") == ["name", "street", "postcode", "city"]
    assert plain("Names on envelope,Invitees,RSVP,Table no.,E-mail Address") == ["name", "name", None, None, None]
    assert plain("Name 1,Name 2,Street 2,Straße") == ["name", "name", "street2", "street"]
    assert plain("Business Title,Job Title,Work Phone,Customer number,Guest number,Street") == [None] * 5 + ["street"]


def test_which_of_several_addresses_a_column_belongs_to():
    outlook = (
        "Home Street,Home Street 2,Home City,Home Country/Region,Business Postal Code,Other State,Home Address PO Box"
    )
    assert roles_of(outlook) == [
        ("street", "home"), ("street2", "home"), ("city", "home"), ("country", "home"), ("postcode", "business"),
        ("state", "other"), ("box", "home"),
    ]  # fmt: skip
    german = "Straße geschäftlich,Straße geschäftlich 2,Ort privat,Lieferstraße,Rechnungs-PLZ,Bundesland/Kanton privat"
    assert roles_of(german) == [
        ("street", "business"), ("street2", "business"), ("city", "home"), ("street", "shipping"),
        ("postcode", "billing"), ("state", "home"),
    ]  # fmt: skip
    google = "Address 1 - Label,Address 1 - Formatted,Address 1 - Region,Address 2 - Street,Organization 1 - Title"
    assert roles_of(google) == [("label", "1"), ("address", "1"), ("state", "1"), ("street", "2"), (None, "")]


def test_a_region_is_the_state_only_where_there_is_none():
    assert plain("Name,City,County") == ["name", "city", "state"]
    assert plain("Name,City,State,County") == ["name", "city", "state", None]
    assert plain("Name,Suburb,Postcode") == ["name", "city", "postcode"]
    assert plain("Name,Suburb,City") == ["name", "locality", "city"]


@given(st.text(max_size=30))
def test_any_header_has_a_meaning_or_none(header):
    found = columns.meaning(header)
    assert found is None or found.role in {*column_names.ROLE_NAMES, columns.LABEL}
