import pytest

from handout.printing import address


def lines(**fields):
    found, _, problem = address.lines({role: [cell] for role, cell in fields.items()})
    assert not problem
    return found


@pytest.mark.parametrize(
    ("fields", "written"),
    [
        ({"postcode": "01067", "city": "Dresden", "street": "Weg", "number": "3", "country": "DE"},
         ("A", "Weg 3", "01067 Dresden", "GERMANY")),
        ({"postcode": "67000", "city": "Strasbourg", "street": "rue X", "number": "27", "extra": "Bât. C",
          "country": "France"}, ("A", "Bât. C", "27 rue X", "67000 Strasbourg", "FRANCE")),
        ({"postcode": "02138", "city": "Cambridge", "state": "MA", "street": "4 Elm St", "extra": "Apt 3",
          "country": "United States"}, ("A", "4 Elm St", "Apt 3", "Cambridge, MA 02138", "UNITED STATES")),
        ({"postcode": "LS6 2AB", "city": "Leeds", "state": "West Yorkshire", "street": "9 Lane", "country": "UK"},
         ("A", "9 Lane", "Leeds", "West Yorkshire", "LS6 2AB", "UNITED KINGDOM")),
        ({"postcode": "V6B 4N7", "city": "Vancouver", "state": "BC", "street": "2 Maple"},
         ("A", "2 Maple", "Vancouver BC V6B 4N7")),
        ({"postcode": "SW1A 2AA", "city": "London", "street": "10 Downing Street"},
         ("A", "10 Downing Street", "London", "SW1A 2AA")),
        ({"postcode": "62704", "city": "Springfield", "state": "IL", "street": "5 Oak"},
         ("A", "5 Oak", "Springfield, IL 62704")),
        ({"postcode": "00186", "city": "Roma", "state": "RM", "street": "Via X 6", "country": "Italia"},
         ("A", "Via X 6", "00186 Roma RM", "ITALIA")),
        ({"place": "8001 Zürich", "street": "Gasse 5", "country": "Schweiz"},
         ("A", "Gasse 5", "8001 Zürich", "SCHWEIZ")),
        ({"postcode": "5600", "city": "Vega", "street": "Way 1", "country": "Atlantis"},
         ("A", "Way 1", "5600 Vega", "ATLANTIS")),
        ({"postcode": "1054", "city": "Budapest", "street": "Báthory utca 3", "country": "Magyarország"},
         ("A", "Budapest", "Báthory utca 3", "1054", "MAGYARORSZÁG")),
        ({"postcode": "100-0001", "city": "Chiyoda-ku", "state": "Tokyo", "street": "1-1 Chiyoda", "country": "JP"},
         ("A", "1-1 Chiyoda", "Chiyoda-ku, Tokyo", "100-0001", "JAPAN")),
        ({"postcode": "018956", "city": "Singapore", "street": "10 Bayfront Avenue", "country": "SG"},
         ("A", "10 Bayfront Avenue", "SINGAPORE 018956", "SINGAPORE")),
        ({"postcode": "34122", "city": "Fatih", "state": "İstanbul", "street": "Yol 1", "country": "Türkiye"},
         ("A", "Yol 1", "34122 Fatih/İstanbul", "TÜRKIYE")),
        ({"postcode": "8010", "city": "Graz", "company": "Werk", "careof": "Bo", "street": "Weg 2", "country": "AUT"},
         ("Werk", "A", "c/o Bo", "Weg 2", "8010 Graz", "AUSTRIA")),
        ({"postcode": "101000", "city": "Москва", "street": "ул. Мира 1", "country": "Россия"},
         ("A", "ул. Мира 1", "Москва", "101000", "РОССИЯ")),
        ({"postcode": "10563", "city": "Αθήνα", "street": "Ερμού", "number": "24", "country": "Ελλάδα"},
         ("A", "Ερμού 24", "10563 Αθήνα", "ΕΛΛΑΔΑ")),
        ({"city": "Hong Kong", "state": "Kowloon", "street": "8 Road", "country": "USA"},
         ("A", "8 Road", "Hong Kong, Kowloon", "USA")),
    ],
)  # fmt: skip
def test_lines_in_the_order_of_the_country(fields, written):
    assert lines(name="A", **fields) == written


def test_names():
    where = {"street": "Weg 1", "city": "Ulm"}
    assert lines(first="Ada", last="Lovelace", title="Dr.", **where)[0] == "Dr. Ada Lovelace"
    assert lines(name="Ada Lovelace", title="Dear Ms", **where)[0] == "Ada Lovelace"
    assert lines(name="Dr. Ada", title="Dr.", **where)[0] == "Dr. Ada"
    assert lines(name="Ada", attention="Sales", company="Engines", careof="Byron", **where)[:4] == (
        "Ada", "Sales", "Engines", "c/o Byron",
    )  # fmt: skip


def test_a_block_gets_the_name_and_country_it_lacks():
    assert lines(name="Ada", address="Weg 1\n89073 Ulm", country="DE") == ("Ada", "Weg 1", "89073 Ulm", "GERMANY")
    assert lines(name="Ada", address="Ada\nWeg 1\nULM\nDeutschland", country="Deutschland") == (
        "Ada", "Weg 1", "ULM", "DEUTSCHLAND",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("country", "code", "words"),
    [
        ("DE", "1067", "(01067)"), ("Deutschland", "D-1067", "(01067)"), ("France", "6000", "(06000)"),
        ("Italia", "186", "(00186)"), ("España", "8001", "(08001)"), ("US", "2138", "(02138)"),
        ("USA", "2138-1234", "(02138)"), ("CH", "800", "4"), ("Österreich", "106", "4"), ("België", "100", "4"),
        ("Norge", "150", "(0150)"), ("DE", "010677", "check it"),
    ],
)  # fmt: skip
def test_zeros_that_a_spreadsheet_dropped(country, code, words):
    _, warnings, _ = address.lines(
        {"name": ["A"], "street": ["B"], "city": ["C"], "postcode": [code], "country": [country]}
    )
    assert len(warnings) == 1 and words in warnings[0] and code in warnings[0]


@pytest.mark.parametrize(
    ("country", "code"),
    [("DE", "01067"), ("FR", "F-67000"), ("SE", "114 55"), ("US", "02138-1234"), ("UK", "LS6 2AB"), ("NL", "1017 JH"),
     ("PL", "00-950"), ("", "1067"), ("CA", "V6B 4N7"), ("CH", "8001")],
)  # fmt: skip
def test_codes_that_are_right_are_left_alone(country, code):
    fields = {"street": ["B"], "city": ["C"], "postcode": [code]} | ({"country": [country]} if country else {})
    assert address.lines(fields)[1] == []


def test_a_code_that_became_a_decimal_number_is_mended():
    found, warnings, _ = address.lines({"street": ["B"], "city": ["Bonn"], "postcode": ["53111.0"]})
    assert "53111 Bonn" in found and "53111.0" in warnings[0]


def test_a_street_without_a_city_is_mentioned():
    assert address.lines({"street": ["Weg 1"]})[1] == ["it names no city"]
    assert address.lines({"street": ["Weg 1"], "postcode": ["01067"]})[1] == ["it names no city"]
    assert not address.lines({"street": ["Weg 1"], "postcode": ["01067 Dresden"]})[1]
    assert not address.lines({"street": ["1 Bras Basah"], "postcode": ["189702"], "country": ["Singapore"]})[1]


def test_a_country_in_another_script_is_spelt_as_the_sender_does():
    germany, greece, serbia = map(address.find, ("DE", "GR", "RS"))
    spelt = [address.spell_abroad("РОССИЯ", germany), address.spell_abroad("FRANCE", greece),
             address.spell_abroad("DEUTSCHLAND", serbia)]  # fmt: skip
    assert spelt == ["RUSSLAND", "ΓΑΛΛΙΑ", "НЕМАЧКА"]
    assert address.spell_abroad("ITALIA", germany) == "ITALIA" and address.spell_abroad("12", germany) == "12"
    assert address.last_line("Ελλάδα") == "ΕΛΛΑΔΑ"


def test_tidy():
    assert address.tidy("  A\u00a0 b\u200b \r\n\r\n\tc\u000bd\u00ad ") == "A b\nc\nd"
    assert address.tidy("e\u0301") == "é"


def test_countries_are_found_in_their_languages():
    for name in ("Deutschland", "allemagne", "Duitsland", "D", "GERMANY"):
        found = address.find(name)
        assert found is not None and found.code == "DE"
    assert address.find("Atlantis") is None
    every = {"Россия": "RU", "대한민국": "KR", "Ísland": "IS", "USA": "US", "UK": "GB", "GER": "DE", "Holland": "NL"}
    found = {name: country.code for name in every if (country := address.find(name))}
    assert found == every
    assert address.last_line("de") == "GERMANY" and address.last_line("Deutschland") == "DEUTSCHLAND"
