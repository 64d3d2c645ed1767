"""What a person is asked of a scanned hand's letters, and what the answers make of it."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from handout.errors import InputError
from handout.hand import file
from handout.hand.corrections import KeepOut, Label
from handout.pipeline import letter_questions
from handout.pipeline.kept_hands import answer_questions, check_hand
from handout.pipeline.letter_questions import WrittenUse, ask_letters, draw_questions, read_answers
from handout.pipeline.rereading import ReadWord


@pytest.fixture(autouse=True)
def few_words(monkeypatch):
    monkeypatch.setattr(letter_questions, "SETTINGS", replace(letter_questions.SETTINGS, words=60))


def kept_questions():
    spot = {"page": 0, "at": [10.0, 20.0]}
    glyphs = [{"letter": letter, **spot, "at": [10.0 * k, 20.0]} for k, letter in enumerate("sea")]
    word = {"text": "sea", "meant": 1, "glyphs": glyphs}
    question = {"letter": "e", "wrong": 1.5, "uses": 4, "words": [word, word], "glyphs": [glyphs[1], glyphs[0]]}
    return json.dumps({"questions": [question, question]}).encode()


@pytest.mark.slow
def test_a_letter_that_is_another_is_asked_about_first(small_hand):
    wrong = set(small_hand.numbers_of_letter("n").tolist())
    lying = tuple(
        replace(glyph, letter="k") if number in wrong else glyph for number, glyph in enumerate(small_hand.glyphs)
    )
    asked = ask_letters(replace(small_hand, glyphs=lying), 50)
    assert [question.wrong for question in asked] == sorted((question.wrong for question in asked), reverse=True)
    named = {number for question in asked for number in question.glyphs}
    assert len(named) == sum(len(question.glyphs) for question in asked), "a glyph is asked about once"
    # of those that are always wrong the one that is written most
    worst = max(asked, key=lambda question: (round(question.wrong / question.uses, 2), question.wrong))
    assert worst.letter == "k" and worst.wrong > 0.5 * worst.uses and worst in asked[:6]
    assert all(use.word.text[use.index] == question.letter for question in asked for use in question.shown)


def test_capitals_are_asked_about_where_sentences_have_them(small_hand, monkeypatch):
    glyphs = tuple(replace(g, letter="N") if g.letter == "n" else g for g in small_hand.glyphs)
    written = list[str]()

    def write(hand, words, rng):
        written.extend(words)
        raise InputError("enough")

    monkeypatch.setattr(letter_questions, "write_words", write)
    monkeypatch.setattr(letter_questions.corpus, "shipped_sentences", lambda: ("Nee, e.", "Nee! nee?"))
    with pytest.raises(InputError, match="enough"):
        ask_letters(replace(small_hand, glyphs=glyphs), 9)
    assert "Nee" in written


def test_letters_that_read_worse_than_their_likes_come_before_those_written_most(small_hand, monkeypatch):
    def uses(hand):
        word = ReadWord("n", 0, np.zeros(1, dtype=np.intp), np.zeros((1, 1)), np.zeros(1))
        worst = int(hand.numbers_of_letter("n")[0])
        for letter, times in (("e", 9), ("n", 1)):
            for number in hand.numbers_of_letter(letter).tolist() * times:
                yield WrittenUse(number, word, 0, 0.0, 1.0, 0.9 if number == worst else 0.1)

    monkeypatch.setattr(letter_questions, "_write_uses", uses)
    monkeypatch.setattr(letter_questions, "unclear_letters", lambda hand: {})
    monkeypatch.setattr(letter_questions, "SETTINGS", replace(letter_questions.SETTINGS, alike=1e-9))
    first, second = ask_letters(small_hand, 2)
    assert first.letter == "n" and first.glyphs == (small_hand.numbers_of_letter("n")[0],)
    assert first.wrong == pytest.approx(0.8) and second.wrong == pytest.approx(0.0)
    monkeypatch.setattr(letter_questions, "unclear_letters", lambda hand: {"e": 0.9})
    (of_e,) = (question for question in ask_letters(small_hand, 1000) if question.letter == "e")
    assert set(of_e.glyphs) == set(small_hand.numbers_of_letter("e").tolist())


def test_a_hand_without_words_is_asked_nothing(small_hand):
    silent = replace(small_hand, glyphs=())
    assert ask_letters(silent, 5) == [] and draw_questions(silent, []).shape[2] == 3


@pytest.mark.slow
def test_what_is_answered_is_written_no_more(small_hand_file, tmp_path):
    path = tmp_path / "mine.hand"
    path.write_bytes(small_hand_file.read_bytes())
    told = check_hand(str(path), sheet=tmp_path / "sheet.png", questions=3).told
    questions = json.loads((tmp_path / "sheet.json").read_text())["questions"]
    assert questions == json.loads(json.dumps(told["questions"])) and 0 < len(questions) <= 3
    assert Image.open(tmp_path / "sheet.png").height > 100 * len(questions)
    first = questions[0]
    edited = answer_questions(str(path), tmp_path / "sheet.json", ["1"])
    assert edited.told["made"] == len(first["glyphs"]) and not edited.told["changes"]
    out = [glyph for glyph in file.load(path).glyphs if glyph.kept_out]
    assert len(out) == len(first["glyphs"]) and {glyph.letter for glyph in out} == {first["letter"]}
    again = check_hand(str(path), sheet=tmp_path / "again.png", questions=200).told["questions"]
    places = [glyph["at"] for question in again for word in question["words"] for glyph in word["glyphs"]]
    assert places and first["glyphs"][0]["at"] not in places


@pytest.mark.slow
def test_a_letter_of_which_none_is_left_is_told_and_a_file_of_something_else_is_kept(small_hand_file, tmp_path):
    path, beside = tmp_path / "mine.hand", tmp_path / "sheet.json"
    path.write_bytes(small_hand_file.read_bytes())
    beside.write_text("{}")
    with pytest.raises(InputError, match=r"sheet\.json would go with the sheet, and holds something else"):
        check_hand(str(path), sheet=tmp_path / "sheet.png")
    assert beside.read_text() == "{}" and not (tmp_path / "sheet.png").exists()
    beside.unlink()
    hand = file.load(path)
    (number,) = hand.numbers_of_letter("j").tolist()
    page = hand.pages[hand.glyphs[number].page]
    at = page.graph.uv[hand.glyphs[number].vertices[9]].round(1).tolist()
    glyph = {"letter": "j", "page": 0, "at": at}
    beside.write_text(
        json.dumps({"questions": [{"letter": "j", "wrong": 1, "uses": 1, "words": [], "glyphs": [glyph]}]})
    )
    told = answer_questions(str(path), beside, ["1"])
    assert "None is left to write of j: texts with it need --fallback, or another page." in told.notes


def test_answers_name_rows_words_and_letters():
    def answered(text):
        return read_answers(kept_questions(), "sheet.json", [text])

    assert answered("1") == [KeepOut(0, (10.0, 20.0), "e"), KeepOut(0, (0.0, 20.0), "s")]
    assert answered("2b") == [KeepOut(0, (10.0, 20.0), "e")]
    assert answered("1a3, 2b=o 1a3") == [KeepOut(0, (20.0, 20.0), "a"), Label(0, (10.0, 20.0), "o")]


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(alphabet="0123ab9=x .-", max_size=8))
def test_answers_that_are_to_nothing_are_refused_in_a_sentence(text):
    try:
        assert read_answers(kept_questions(), "sheet.json", [text])
    except InputError as error:
        assert re.fullmatch(r"[A-Z][^\n]+\.", str(error))


@pytest.mark.parametrize("data", [b"", b"[]", b'{"corrections": []}', b"\xff", b'{"questions": [1]}'])
def test_a_file_of_something_else_is_refused(data):
    with pytest.raises(InputError, match="does not hold the questions of a sheet"):
        read_answers(data, "sheet.json", ["1"])
