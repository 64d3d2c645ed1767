"""The names that columns of address tables have, as people and programs write them, in twelve languages.

A new name of a column is one more word here, beside those of its role; a word that says whose address a column holds
("home", "Liefer") goes to the kinds of address.  Names are compared without case, accents, spaces and punctuation.
"""

from __future__ import annotations

import re
import unicodedata

# Role → names of columns of that role.  English, German, French, Spanish, Italian, Dutch; Russian, Ukrainian,
# Belarusian, Bulgarian, Serbian, Greek.
_ROLES: dict[str, str] = {
    "name": """name, full name, fullname, recipient, addressee, contact, contact name, to, display name
        Name, Vollständiger Name, Empfänger, Kontakt, Vor- und Nachname, Vor- und Zuname, Vor-/Nachname, Name Vorname
        nom complet, nom et prénom, nom prénom, prénom et nom, prénom nom, destinataire, nom
        nombre, nombre completo, nombre y apellidos, destinatario, nome, nome completo, nome e cognome, nominativo
        naam, volledige naam, ontvanger, geadresseerde
        guest, guest name, plus one, plus ones, names on envelope, name on envelope, invitee, invited, household
        household name, family
        family names, couple, party, attendee, names, recipient names, customer, client
        Gast, Gäste, Gastname, Gästename, Namen, Familie, Eingeladene, Empfängername, Kunde
        invité, invités, noms, famille, invitado, invitados, nombres, familia, ospite, ospiti, invitati, famiglia
        nomi
        gast, gasten, namen, genodigde, genodigden, klant
        имя, ФИО, полное имя, получатель, имя и фамилия, имя фамилия, фамилия имя, гость, гости, імʼя, ПІБ
        одержувач, імʼя та прізвище
        име, име и фамилия, име и презиме, прималац, ονοματεπώνυμο, όνομα, παραλήπτης""",
    "title": """title, prefix, honorific, Titel, Anrede, civilité, titre, tratamiento, título, titolo
        aanhef, titulatuur, name prefix, salutation, courtesy title, akademischer Titel, Titel/Anrede
        Anrede/Titel""",
    "first": """first name, firstname, given name, forename, first, Vorname, Rufname, prénom, nombre de pila
        primo nome, voornaam
        име лично, собствено име, ιδιο όνομα, μικρό όνομα""",
    "suffix": """suffix, name suffix, generational suffix, post-nominals, Namenszusatz, suffixe, sufijo, suffisso
        achtervoegsel""",
    "middle": """middle name, middle, second name, zweiter Vorname, deuxième prénom, segundo nombre, tussenvoegsel
        additional name, weitere Vornamen, middle initial
        отчество, по батькові, презиме бащино, πατρώνυμο""",
    "last": """last name, lastname, surname, family name, last, Nachname, Familienname, Zuname
        nom de famille, nom de naissance, apellido, apellidos, primer apellido, cognome, achternaam, familienaam
        фамилия, прізвище, прозвішча, фамилно име, презиме, επώνυμο""",
    "company": """company, company name, organisation, organization, business, firm, employer, institution
        organization name, organisation name
        organization 1 name
        Firma, Firmenname, Unternehmen, Betrieb, Institution, Organisation
        société, entreprise, raison sociale, organisme, empresa, razón social, compañía, sociedad, organización
        azienda, società, ditta, ragione sociale, impresa, bedrijf, bedrijfsnaam, organisatie, firma
        компания, организация, фирма, предприятие, компанія, організація, предузеће, εταιρεία, επιχείρηση""",
    "careof": "c/o, care of, chez, presso, per Adresse, p. A.",
    "attention": """attention, attn, department, dept, division
        organization department, organization 1 department
        Abteilung, zu Händen, z. Hd., zHd, service, à l'attention de, a la atención de, departamento
        alla cortese attenzione, reparto, dipartimento, ter attentie van, t.a.v., afdeling""",
    "street": """street, street address, street name, street and number, street 1, address line 1, address 1, address1
        line 1, addr 1, road, house number and street
        streetaddress, street addr, addr, adress 1, Strasse/Nr, Strassenname und Hausnummer
        Straße, Straße und Hausnummer, Straße Nr., Straße Hausnummer, Straße Hausnr., Straße und Nr., Str.
        Straßenname, Adresszeile 1, Adresse 1, Anschrift 1
        rue, voie, rue et numéro, numéro et rue, n° et rue, numéro et voie, n° et voie, adresse ligne 1
        calle, calle y número, domicilio, vía, dirección 1, dirección línea 1
        via, via e numero, via e numero civico, indirizzo 1, via/piazza
        straat, straatnaam, straat en huisnummer, straat en nummer, adres 1, adresregel 1
        улица, улица и номер, улица и дом, улица дом, улица и број, вулиця, вулиця та номер, вуліца, οδός
        οδός και αριθμός, διεύθυνση 1""",
    "number": """house number, house no, number, no., building number, street number, Hausnummer, Hausnr., Nr.
        Haus-Nr.
        numéro, n°, numéro de rue, número, núm., número de calle, numero civico, civico, numero
        huisnummer, huisnr., nummer, nr
        дом, номер дома, будинок, номер будинку, кућни број, αριθμός""",
    "street2": """street 3, street 2, Straße 2, Straße 3, rue 2, calle 2, via 2, straat 2, address line 2
        address 2, line 2, addr 2, address line 3, address 3, line 3
        Adresszeile 2, Adresse 2, Anschrift 2, Adresszeile 3, adresse ligne 2, adresse 3
        dirección 2, dirección línea 2, indirizzo 2, adres 2, adresregel 2""",
    "extra": """apartment, apt, apt number, apt no, apartment number, unit number, suite number, ste
        extended address, Etage
        Wohnung, Türnummer, Stiege, unit, suite, flat, floor, building, Adresszusatz, Zusatz, Adresszusatz 2
        Stockwerk
        complément, complément d'adresse, bâtiment, étage, appartement, résidence
        piso, puerta, complemento, escalera, interno, scala, piano, palazzina
        toevoeging, huisnummertoevoeging, bus
        квартира, кв., корпус, подъезд, этаж, під'їзд, поверх, апартамент, вход, етаж, стан, спрат, διαμέρισμα
        όροφος""",
    "box": """PO box, P.O. box, post office box, Postfach, boîte postale, BP, apartado, apartado de correos
        casella postale, CP casella, postbus
        абонентский ящик, а/я, абонентська скринька, пощенска кутия, поштански фах, ταχυδρομική θυρίδα, Τ.Θ.""",
    "postcode": """postal code, postcode, post code, ZIP, ZIP code, zipcode, eircode, pin code
        zip or postal code, zip 5, post codes
        PLZ, Postleitzahl, code postal, CP, NPA, código postal, C.P., cód. postal, CAP, codice postale
        codice di avviamento postale, postnummer
        индекс, почтовый индекс, індекс, поштовий індекс, паштовы індэкс, пощенски код, п.к., поштански број
        ταχυδρομικός κώδικας, Τ.Κ.""",
    "city": """city, town, post town, municipality, place, city name
        Ort, Stadt, Wohnort, Gemeinde, Ortsname, ville, localité, commune
        ciudad, población, localidad, municipio, città, comune, località, plaats, woonplaats, stad, gemeente
        город, населённый пункт, місто, населений пункт, горад, град, населено място, място, место, πόλη""",
    "locality": """locality, suburb, village, neighbourhood, neighborhood, dependent locality, hamlet
        Ortsteil, Ortschaft, Stadtteil, lieu-dit, quartier, hameau, barrio, colonia, frazione, quartiere
        wijk, buurt
        район, село, деревня, посёлок, вёска, χωριό, συνοικία""",
    "state": """state, ST, province, territory, state code, Bundesland, Kanton, Provinz, canton, provincia, estado
        prov.
        sigla provincia, provincie, Bundesland/Kanton
        область, край, вобласць, νομός, покрајина""",
    "county": """county, region, région, département, comunidad autónoma, regione, Landkreis, Kreis""",
    "place": """city st zip, city state zip, city state zip code, city and zip, zip city, postcode city
        postcode and city
        PLZ Ort, PLZ und Ort, PLZ Stadt, Postleitzahl Ort, Postleitzahl und Ort
        code postal ville, code postal et ville, CP ville, CP et ville, NPA localité, NPA ville
        CP ciudad, CP población, CP localidad, código postal y ciudad, CAP città, CAP e città, CAP località
        postcode plaats, postcode en plaats, postcode woonplaats, postcode en woonplaats""",
    "country": """country, country name, country code, country/region, nation
        Land, Staat, Ländercode, pays, code pays, país, código de país, paese, nazione, stato, landcode
        страна, країна, краіна, држава, земља, държава, χώρα""",
    "address": """address, adress, addresses, full address, formatted, formatted address, where to send, send to
        postal address, mailing address, address block, delivery address
        shipping address, Adresse, Anschrift, Postadresse, Postanschrift, Adressblock, Lieferadresse
        adresse complète, adresse postale, dirección, dirección completa, dirección postal
        indirizzo, indirizzo completo, indirizzo postale, adres, volledig adres, postadres, recapito
        адрес, почтовый адрес, полный адрес, адреса, поштова адреса, адрас, διεύθυνση, ταχυδρομική διεύθυνση""",
}

# Which of a person's addresses a column belongs to: words before or behind what the column holds.
_KINDS: dict[str, str] = {
    "home": "home, private, personal, residential, privat, Privatadresse, domicile, particular, casa, privato, thuis",
    "business": """business, work, office, company, geschäftlich, dienstlich, Firmen, Büro, bureau, professionnel
        professionnelle, trabajo, oficina, lavoro, ufficio, zakelijk, werk""",
    "other": "other, weitere, weiterer, andere, autre, otro, otra, altro, altra, overig",
    "shipping": "shipping, delivery, ship to, Liefer, Versand, livraison, envío, spedizione, lever",
    "billing": "billing, invoice, bill to, Rechnungs, Rechnung, facturation, facturación, fatturazione, factuur",
}
# words that say nothing about what a column holds
_FILLERS = """mailing, postal, post, mail, primary, main, contact, recipient, recipients, guest, guests, customer
    client, invitee, current, address, Adresse, adresse, Empfänger, Gast, Gäste, Kunden, Kontakt, Post, destinataire
    invité, dirección, destinatario, indirizzo, ospite, adres, ontvanger, your, our, their, the, partner, spouse
    Ehepartner, conjoint, pareja"""

# names of a column that says which address its neighbours hold ("Address 1 - Label")
LABELS = frozenset({"label", "type"})
# as often a running number as a house number
AMBIGUOUS_NUMBERS = frozenset({"number", "no", "nr", "nummer", "numero", "num", "n"})
# the whole name, or the half of it that no other column holds
AMBIGUOUS_NAMES = frozenset({"name", "nom", "nombre", "nome", "naam", "имя", "име", "імя", "ονομα"})
# ends of names of an address as a whole, also beside columns for its parts; other words for "address" are the street
_WHOLE_ADDRESS = """full address, address block, formatted, formatted address, Adressblock, adresse complète
    dirección completa, indirizzo completo, volledig adres"""


def normalise(header: str) -> str:
    """A header without case, accents, spaces and punctuation: ``" Straße / Nr. "`` → ``"strassenr"``."""
    plain = unicodedata.normalize("NFKD", unicodedata.normalize("NFKD", header).casefold())
    return "".join(c for c in plain if c.isalnum())


def identifier(header: str) -> str:
    """A header as a name in a letter: ``"First name"`` → ``first_name``, ``"Straße/Nr."`` → ``strasse_nr``."""
    plain = unicodedata.normalize("NFKD", unicodedata.normalize("NFKD", header).casefold())
    letters = "".join(c for c in plain if not unicodedata.combining(c))
    name = "_".join(re.findall(r"[^\W_]+", letters))
    return f"c{name}" if name[:1].isdigit() else name


def _split_headers(text: str) -> list[str]:
    return [header for header in text.replace("\n", ",").split(",") if normalise(header)]


def _invert(table: dict[str, str]) -> dict[str, str]:
    """Normalised header → what it means; of two meanings the first."""
    meanings: dict[str, str] = {}
    for meaning, headers in table.items():
        for header in _split_headers(headers):
            meanings.setdefault(normalise(header), meaning)
    return meanings


ROLES = _invert(_ROLES)
# what a column may say of how its row is made; no header means it by itself
SETTINGS = ("text", "hand", "pen", "language", "copies")
ROLE_NAMES = (*_ROLES, *SETTINGS)
KINDS = _invert(_KINDS)
FILLERS = frozenset(map(normalise, _split_headers(_FILLERS)))
WHOLE_ADDRESS = tuple(map(normalise, _split_headers(_WHOLE_ADDRESS)))
