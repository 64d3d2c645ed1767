"""Text out of bytes: every encoding that people's files are in, by names that the method was not made with."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout import encodings

WESTERN = "Käthe Müller;Björn Åkesson;Zoë Brontë;François Lefèvre;Íñigo Núñez;João Gonçalves;Søren Kjær;Jürgen Weiß"
CENTRAL = "Łukasz Wiśniewski;Žofie Dvořáková;Jiří Němec;Małgorzata Dąbrowska;Gdańsk;Plzeň;Krzysztof Żółć"
TURKISH = "Ayşe Yıldız;Çağla Güneş;İzmir;Doğan Öztürk;Beşiktaş"
BALTIC = "Jonas Kazlauskas;Rūta Žemaitė;Vytautas Šimkus;Kęstutis;Eglė Jurgaitytė;Klaipėda;Šiauliai"


def lines(text, codec):
    return ("Name;Ort\n" + "\n".join(text.split(";")) + "\n").encode(codec)


@pytest.mark.parametrize(
    ("text", "codec", "name"),
    [
        (WESTERN, "cp1252", "Windows-1252"),
        (WESTERN, "mac_roman", "Mac OS Roman"),
        (WESTERN, "cp850", "DOS 850"),
        (CENTRAL, "cp1250", "Windows-1250"),
        (CENTRAL, "iso8859_2", "ISO 8859-2"),
        (CENTRAL, "cp852", "DOS 852"),
        (CENTRAL, "mac_latin2", "Mac OS Central European"),
        (TURKISH, "cp1254", "Windows-1254"),
        (BALTIC, "cp1257", "Windows-1257"),
        ("Анна Иванова;Сергей Петров", "cp1251", "Windows-1251"),
        ("Ελένη Παπαδοπούλου;Γιώργος", "cp1253", "Windows-1253"),
    ],
)
def test_the_encoding_is_told_by_the_letters_that_it_makes(text, codec, name):
    data = lines(text, codec)
    found = encodings.decode(data)
    assert found.text == data.decode(codec) and found.encoding == name and found.guessed
    assert found.example in text


def test_a_single_name_in_mac_roman():
    assert encodings.decode("Käthe Müller\n".encode("mac_roman")).text == "Käthe Müller\n"
    assert encodings.decode("Käthe Müller\n".encode("cp1252")).text == "Käthe Müller\n"


@pytest.mark.parametrize("codec", ["utf-8", "utf-8-sig", "utf-16", "utf-32", "utf-16-le", "utf-16-be"])
def test_what_the_bytes_say_themselves_is_no_guess(codec):
    found = encodings.decode(f"Name\n{WESTERN}\n".encode(codec))
    assert found.text == f"Name\n{WESTERN}\n" and not found.guessed and found.encoding.startswith("UTF-")


def test_lines_that_are_utf8_among_others_stay_so():
    found = encodings.decode("José\n".encode() + b"\n" + "Käthe\r".encode("cp1252") + b"Ada\n")
    assert found.text == "José\n\nKäthe\rAda\n" and found.odd == {2} and found.example == "Käthe"


@pytest.mark.parametrize("data", [b"\xff\xfe\x00", b"name\x00\x01", b"\xef\xbb\xbf\xff", b"a\x07b"])
def test_what_is_no_text(data):
    with pytest.raises(encodings.NoText):
        encodings.decode(data)


@given(st.binary(max_size=60))
def test_any_bytes_are_text_or_none(data):
    try:
        found = encodings.decode(data)
    except encodings.NoText:
        return
    assert found.odd or not found.guessed


@given(st.text(max_size=40).filter(lambda text: not text.startswith("\ufeff") and "\0" not in text))
def test_utf8_is_never_mistaken(text):
    try:
        assert encodings.decode(text.encode()).text == text
    except encodings.NoText:
        assert any(ord(char) < 32 for char in text)
