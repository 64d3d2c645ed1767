"""What the columns of an address table mean: headers as people write them, in six languages."""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence

# Role → headers that mean it; compared without case, accents, spaces and punctuation.  English, German, French,
# Spanish, Italian, Dutch.
_HEADERS: dict[str, str] = {
    "name": """name, full name, fullname, recipient, addressee, contact, contact name, to, display name
        Name, Vollständiger Name, Empfänger, Kontakt, Vor- und Nachname, Vor- und Zuname, Vor-/Nachname, Name Vorname
        nom complet, nom et prénom, nom prénom, prénom et nom, prénom nom, destinataire, nom
        nombre, nombre completo, nombre y apellidos, destinatario, nome, nome completo, nome e cognome, nominativo
        naam, volledige naam, ontvanger, geadresseerde""",
    "title": """title, prefix, honorific, Titel, Anrede, civilité, titre, tratamiento, título, titolo
        aanhef, titulatuur""",
    "first": """first name, firstname, given name, forename, first, Vorname, Rufname, prénom, nombre de pila
        primo nome, voornaam""",
    "middle": "middle name, middle, second name, zweiter Vorname, deuxième prénom, segundo nombre, tussenvoegsel",
    "last": """last name, lastname, surname, family name, last, Nachname, Familienname, Zuname
        nom de famille, nom de naissance, apellido, apellidos, primer apellido, cognome, achternaam, familienaam""",
    "company": """company, company name, organisation, organization, business, firm, employer, institution
        Firma, Firmenname, Unternehmen, Betrieb, Institution, Organisation
        société, entreprise, raison sociale, organisme, empresa, razón social, compañía, sociedad, organización
        azienda, società, ditta, ragione sociale, impresa, bedrijf, bedrijfsnaam, organisatie, firma""",
    "careof": "c/o, care of, chez, presso, per Adresse, p. A.",
    "attention": """attention, attn, department, dept, division
        Abteilung, zu Händen, z. Hd., zHd, service, à l'attention de, a la atención de, departamento
        alla cortese attenzione, reparto, dipartimento, ter attentie van, t.a.v., afdeling""",
    "street": """street, street address, street name, street and number, street 1, address line 1, address 1, address1
        line 1, addr 1, mailing street, road
        Straße, Straße und Hausnummer, Straße Nr., Straße Hausnummer, Straße Hausnr., Straße und Nr., Str.
        Straßenname, Adresszeile 1, Adresse 1, Anschrift 1
        rue, voie, rue et numéro, numéro et rue, n° et rue, numéro et voie, n° et voie, adresse ligne 1
        calle, calle y número, domicilio, vía, dirección 1, dirección línea 1
        via, via e numero, via e numero civico, indirizzo 1, via/piazza
        straat, straatnaam, straat en huisnummer, straat en nummer, adres 1, adresregel 1""",
    "number": """house number, house no, number, no., building number, street number, Hausnummer, Hausnr., Nr., Haus-Nr.
        numéro, n°, numéro de rue, número, núm., número de calle, numero civico, civico, numero
        huisnummer, huisnr., nummer, nr""",
    "street2": """street 2, address line 2, address 2, line 2, addr 2, address line 3, address 3, line 3
        Adresszeile 2, Adresse 2, Anschrift 2, Adresszeile 3, adresse ligne 2, adresse 3
        dirección 2, dirección línea 2, indirizzo 2, adres 2, adresregel 2""",
    "extra": """apartment, apt, unit, suite, flat, floor, building, Adresszusatz, Zusatz, Adresszusatz 2, Stockwerk
        complément, complément d'adresse, bâtiment, étage, appartement, résidence
        piso, puerta, complemento, escalera, interno, scala, piano, palazzina
        toevoeging, huisnummertoevoeging, bus""",
    "box": """PO box, P.O. box, post office box, Postfach, boîte postale, BP, apartado, apartado de correos
        casella postale, CP casella, postbus""",
    "postcode": """postal code, postcode, post code, ZIP, ZIP code, zipcode, eircode, pin code, mailing zip
        PLZ, Postleitzahl, code postal, CP, NPA, código postal, C.P., cód. postal, CAP, codice postale
        codice di avviamento postale, postnummer""",
    "city": """city, town, post town, locality, municipality, suburb, village, mailing city
        Ort, Stadt, Wohnort, Ortschaft, Gemeinde, ville, localité, commune
        ciudad, población, localidad, municipio, città, comune, località, plaats, woonplaats, stad, gemeente""",
    "state": """state, province, region, county, state/province, territory, mailing state
        Bundesland, Kanton, Provinz, Region, canton, région, département, provincia, comunidad autónoma, estado
        regione, prov., sigla provincia, provincie""",
    "place": """city state zip, city state zip code, city and zip, zip city, postcode city, postcode and city
        PLZ Ort, PLZ und Ort, PLZ Stadt, Postleitzahl Ort, Postleitzahl und Ort
        code postal ville, code postal et ville, CP ville, CP et ville, NPA localité, NPA ville
        CP ciudad, CP población, CP localidad, código postal y ciudad, CAP città, CAP e città, CAP località
        postcode plaats, postcode en plaats, postcode woonplaats, postcode en woonplaats""",
    "country": """country, country name, country code, country/region, nation, mailing country
        Land, Staat, Ländercode, pays, code pays, país, código de país, paese, nazione, stato, landcode""",
    "address": """address, full address, postal address, mailing address, address block, delivery address
        shipping address, Adresse, Anschrift, Postadresse, Postanschrift, Adressblock, Lieferadresse
        adresse complète, adresse postale, dirección, dirección completa, dirección postal
        indirizzo, indirizzo completo, indirizzo postale, adres, volledig adres, postadres, recapito""",
}

_AMBIGUOUS = frozenset({"number", "no", "nr", "nummer", "numero", "num", "n"})

# any one of these makes a table something that can be addressed
_PLACES = frozenset({"street", "box", "place", "postcode", "city", "address"})


def key(header: str) -> str:
    """A header without case, accents, spaces and punctuation: ``" Straße / Nr. "`` → ``"strassenr"``."""
    plain = unicodedata.normalize("NFKD", unicodedata.normalize("NFKD", header).casefold())
    return "".join(c for c in plain if c.isalnum())


def _synonyms() -> dict[str, str]:
    found: dict[str, str] = {}
    for role, headers in _HEADERS.items():
        for header in headers.replace("\n", ",").split(","):
            found.setdefault(key(header), role)
    found.pop("", None)
    return found


_ROLES = _synonyms()


def role(header: str) -> str | None:
    """What a column of this header holds (a key of the table above), or None."""
    return _ROLES.get(key(header))


def roles(headers: Sequence[str]) -> list[str | None]:
    """What each column holds, with the meanings that depend on the other columns settled.

    "Nom", "Name" or "Nombre" beside a column for the first name is the last name, beside one for the last name it
    is the first name; "Adresse" beside columns for postcode or city is the street.
    """
    found = [role(header) for header in headers]
    for present, absent in (("first", "last"), ("last", "first")):
        if present in found and absent not in found:
            found = [absent if r == "name" else r for r in found]
    for i, header in enumerate(headers):
        # "Nr." is as often a running number as a house number: believed only beside the street
        beside = "street" in found[max(i - 1, 0) : i + 2]
        if found[i] == "number" and key(header) in _AMBIGUOUS and not beside:
            found[i] = None
    if "address" in found and "street" not in found and {"postcode", "city", "place"} & set(found):
        found = ["street" if r == "address" else r for r in found]
    return found


def addressable(found: Sequence[str | None]) -> bool:
    """Whether columns of these roles can hold an address at all."""
    return bool(_PLACES & set(found))


def understood() -> str:
    """A few of the headers that are understood, for an error message."""
    return (
        "name, first name, last name, company, street, address 2, postal code, city, state, country or address "
        "(also in German, French, Spanish, Italian and Dutch: Straße, PLZ, Ort, code postal, ville, ciudad …)"
    )
