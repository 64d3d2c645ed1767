"""Alphabets of Latin letters: sentences that hold all of a language's, written without borrowed forms."""

import unicodedata

import numpy as np
import pytest
from click.testing import CliRunner

from handout.cli import cli
from handout.errors import MissingCharacters
from handout.hand.diacritics import DOTLESS, compose_grapheme, decompose_grapheme
from handout.hand.library import load
from handout.hand.protocol import Repertoire
from handout.page_sizes import page
from handout.writing.compose import compose
from handout.writing.drawn_forms import accent_glyph
from handout.writing.layout import Layout
from handout.writing.text import LEFT_OUT, borrow, list_borrowed, normalise, spell

HANDS = ("house-joined", "house-quick", "house-print")
SENTENCES = {
    "Belarusian": "Ў Іўі худы жвавы чорт у зялёнай камізэльцы пабег пад’есці фаршу з юшкай. ЭЁЫЦЩ",
    "Bulgarian": "Ах, чудна българска земьо, полюшвай цъфтящи жита! ЩЪЮЯ ЖЗЙ ѝ",
    "Catalan": "Jove xef, porti whisky amb quinze glaçons d’hidrogen, coi! Col·leció de l'àvia, al·lot, paraŀlel.",
    "Croatian": "Gojazni đačić s biciklom drži hmelj i finu vatu u džepu nošnje. ĐURĐA ŽIVI U ČAKOVCU. ǆ ǉ ǌ",
    "Czech": "Příliš žluťoučký kůň úpěl ďábelské ódy. ŤĎŇ ŘÍŠE ŮŽAS",
    "Esperanto": "Eĥoŝanĝo ĉiuĵaŭde. ĈĜĤĴŜŬ",
    "Estonian": "Põdur Zagrebi tšellomängija-följetonist Ciqo külmetas kehvas garaažis.",
    "Greek": "Ξεσκεπάζω την ψυχοφθόρα βδελυγμία. ΑΒΓΔΕΖΗΘΙΚΛΜΝΞΟΠΡΣΤΥΦΧΨΩ ΐ ΰ ϊ ϋ ή ί ό ύ ώ Ά Έ Ϊ ς",
    "Hungarian": "Árvíztűrő tükörfúrógép. ÁRVÍZTŰRŐ TÜKÖRFÚRÓGÉP",
    "Latvian": "Glāžšķūņa rūķīši dzērumā čiepj Baha koncertflīģeļu vākus. ĀČĒĢĪĶĻŅŠŪŽ Ŗ ŗ",
    "Lithuanian": "Įlinkdama fechtuotojo špaga sublykčiojusi pragręžė apvalų arbūzą. ĄČĘĖĮŠŲŪŽ",
    "Maltese": "Għajnuna għall-ħobż taż-żwieġ: il-ġenituri ċempluli. ĊĠĦŻ",
    "Polish": "Pchnąć w tę łódź jeża lub ośm skrzyń fig. ZAŻÓŁĆ GĘŚLĄ JAŹŃ",
    "Romanian": "Muzicologă în bej vând whisky și tequila, preț fix. ȘȚĂÂÎ ŞŢ şţ",
    "Russian": "Съешь же ещё этих мягких французских булок, да выпей чаю. ЁЙЪЫЬЭЮЯЩЖ а́ ы́",
    "Sami": "Vuol Ruoŧa geđggiid leat máŋga luosa ja čuovžža. Ŋ Ŧ Đ",
    "Serbian": "Фијуче ветар у шибљу, леди пасаже и куће иза њих и гунђа у оџацима. ЂЉЊЋЏ",
    "Slovak": "Kŕdeľ ďatľov učí koňa žrať kôru. Ľubica, vŕba, ĺ Ĺ Ŕ ť",
    "Turkish": "Pijamalı hasta yağız şoföre çabucak güvendi. İSTANBUL IŞIK ĞÜÖÇ",
    "Ukrainian": "Щурячий бугай із їжаком-харцизом в’ючись підписали ґешефт у єнах. ЄЇҐЩ",
    "Welsh": "Parciais fy jac codi baw hud llawn dŵr ger tŷ Mabon. ŴŶ ŵŷ",
}
EXTENDED_A = "".join(map(chr, range(0x100, 0x180)))
SIGNS = "•–—½¼¾¹²³→←↑↓✓✗★❤☺☎№™©®°±×÷≈≠≤≥"


@pytest.mark.parametrize("name", HANDS)
def test_every_sentence_is_written_without_borrowed_forms(name):
    known = load(name).repertoire
    others = {"Extended-A": EXTENDED_A, "signs": SIGNS, "look-alikes": "♥ ✔ ✖ ☺️ ➜"}
    for language, text in {**SENTENCES, **others}.items():
        for form in ("NFC", "NFD"):
            written = normalise(unicodedata.normalize(form, text))
            assert list(spell(written, known)), language
            assert list_borrowed(written, known) == [], language


@pytest.mark.parametrize("name", HANDS)
def test_a_language_writes_letters_its_own_way(name):
    hand = load(name)
    serbian = hand.with_language("sr-Cyrl-RS")
    assert hand.with_language("ru") is hand and len(serbian.glyphs) == len(hand.glyphs)
    for letter in "б" if name == "house-print" else "бгпт":  # printed, г п т have no forms of their own
        ours, theirs = (each.glyphs[letter][0] for each in (hand, serbian))
        assert ours.letter == theirs.letter == letter
        assert not np.array_equal(np.vstack(ours.strokes), np.vstack(theirs.strokes)), letter
    assert serbian.glyphs["ж"] is hand.glyphs["ж"]


def test_a_row_is_written_as_its_language_does(tmp_path):
    for language in ("sr", "ru"):
        text = ["--hand", "house-print", "--seed", "1", "--language", language, "-o", str(tmp_path / f"{language}.svg")]
        assert CliRunner().invoke(cli, ["write", "Бој биће", *text]).exit_code == 0
    assert (tmp_path / "sr.svg").read_bytes() != (tmp_path / "ru.svg").read_bytes()


def test_what_looks_like_a_letter_is_written_with_it_whoever_writes():
    latin = Repertoire("latin", frozenset("abcehkopuxyABT"), frozenset({"\u0301"}))
    assert [letter.base for letter in spell("ВТАаеосрхυό".replace("υ", ""), latin)] == list("BTAaeocpxo")
    with pytest.raises(MissingCharacters, match="ἄ"):
        spell("ἄ", load("house-print").repertoire)
    assert [letter.base for letter in spell("Άρα", load("house-print").repertoire)] == list("’Αρα")
    assert [letter.base for letter in spell("ἄ", load("house-print").repertoire, fallback=True)] == ["α"]


@pytest.mark.slow
@pytest.mark.parametrize("name", HANDS)
def test_all_of_it_lies_on_the_page(name):
    text = "\n".join(SENTENCES.values())
    sheets = compose(text, load(name), Layout(page("A4"), x_height=2.5), np.random.default_rng(2))
    written = " ".join(line.text for sheet in sheets for line in sheet.lines)
    assert all(word in written for word in ("łódź", "žluťoučký", "yağız", "máŋga", "Għajnuna", "Árvíztűrő"))
    ink = np.vstack([s for sheet in sheets for line in sheet.lines for p in line.placed for s in p.strokes])
    assert np.isfinite(ink).all() and ink.min() > 5 and (ink < (205, 292)).all()


def test_what_is_decomposed_is_recomposed():
    for letter in EXTENDED_A + "șțȘȚéüñç":
        base, marks = decompose_grapheme(letter)
        # the comma below of Romanian is one letter, however it was typed
        assert compose_grapheme(base, marks) == letter.translate(str.maketrans("ŢţŅ", "ȚțŅ"))
    assert decompose_grapheme("ł") == ("l", ("\u0338",)) and decompose_grapheme("ı") == ("i", (DOTLESS,))


def made(hand, letter, seed=0):
    """Every form of a letter with its marks: (body, marks), each (n, 2)."""
    base, names = decompose_grapheme(letter)
    rng = np.random.default_rng(seed)
    for glyph in hand.glyphs[base]:
        whole = accent_glyph(glyph, names, hand, rng)
        body = [s for s, late in zip(glyph.strokes, glyph.delayed, strict=True) if not late]
        marks = [s for s in whole.strokes if not any(np.array_equal(s, own) for own in glyph.strokes)]
        yield glyph, body, marks, whole


@pytest.mark.slow
@pytest.mark.parametrize("name", HANDS)
def test_marks_are_where_a_pen_sets_them(name):
    hand = load(name)
    for letter in "ćĉėğőśůžňŔŹİŤĎ":
        for _, body, marks, _ in made(hand, letter):
            assert np.vstack(marks)[:, 1].min() > np.vstack(body)[:, 1].max() - 0.25, letter
    for letter in "ąęįųĄĘ":  # an ogonek hangs from its letter's foot
        for _, body, marks, _ in made(hand, letter):
            start = marks[0][0]
            away = np.hypot(*(np.vstack(body) - start).T).min()
            assert away < 0.12 and marks[0][:, 1].min() < -0.15, letter
    for letter in "łŁđħŧŦĦĐ":  # a stroke goes through
        for _, body, marks, _ in made(hand, letter):
            xy = np.vstack(marks)
            near = np.vstack([_evenly(s) for s in body])
            near = near[np.abs(near[:, 1] - xy[:, 1].mean()) < 0.15]
            assert ((xy[:, 0].min() < near[:, 0]) & (near[:, 0] < xy[:, 0].max())).any(), letter
    for letter in "ďľĽť":  # an apostrophe stands beside the top
        for _, body, marks, _ in made(hand, letter):
            xy, whole = np.vstack(marks), np.vstack(body)
            assert xy[:, 0].min() > whole[whole[:, 1] > whole[:, 1].max() - 0.5, 0].max(), letter
            assert abs(xy[:, 1].max() - whole[:, 1].max()) < 0.2
    for glyph, _, marks, whole in made(hand, "ı"):
        assert not marks and len(whole.strokes) == len(glyph.strokes) - sum(glyph.delayed)


def _evenly(stroke):
    at = np.linspace(0, len(stroke) - 1, 10 * len(stroke))
    return np.column_stack([np.interp(at, np.arange(len(stroke)), axis) for axis in stroke.T])


def test_accents_over_accents_do_not_touch():
    hand = load("house-print")
    circumflex, acute = next(made(hand, "ấ"))[2]
    assert acute[:, 1].min() > circumflex[:, 1].max()


def test_what_is_borrowed_is_listed():
    known = load("house-quick").repertoire
    text = normalise("ə and 😀 or ə, 1⃣")
    assert [(b.letter, b.source, b.at) for b in list_borrowed(text, known)] == [
        ("ə", "e in its place", (0, 11)),
        ("😀", LEFT_OUT, (6,)),
        ("1⃣", "1 in its place", (14,)),
    ]


def test_a_sign_never_loses_its_stroke():
    known = load("house-quick").repertoire
    bare = Repertoire(known.name, known.letters - {"≠"}, frozenset())
    assert borrow("≠", bare, 0) == [] and borrow("½", bare, 0) != []
    with pytest.raises(MissingCharacters, match="≠"):
        spell("≠", bare, fallback=True)
