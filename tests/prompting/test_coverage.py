"""Counting instances by place, and saying what is too few."""

import json
from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from handout.prompting import corpus, sentence_choice


def test_places_in_words():
    found = sentence_choice.letters_by_place(['Anna, "I" 42!'])
    assert found == {
        ("A", "start"): 1, ("n", "middle"): 2, ("a", "end"): 1, (",", "alone"): 1, ('"', "alone"): 2,
        ("I", "alone"): 1, ("4", "start"): 1, ("2", "end"): 1, ("!", "alone"): 1,
    }  # fmt: skip
    assert sentence_choice.pairs_by_place(["Anna is x 421"]) == {
        ("An", "start"): 1, ("nn", "middle"): 1, ("na", "end"): 1, ("is", "alone"): 1, ("42", "start"): 1,
        ("21", "end"): 1,
    }  # fmt: skip


def test_marks_belong_to_their_letters():
    assert set(sentence_choice.letters_by_place(["o\u0323\u0308e"])) == {("o\u0323\u0308", "start"), ("e", "end")}


@given(st.text("abE1é,.' -", max_size=60))
def test_every_character_is_counted_once(text):
    found = sentence_choice.letters_by_place([text])
    totals = Counter()
    for (unit, _), count in found.items():
        totals[unit] += count
    assert totals == Counter(char for char in text if char != " ")
    words = found.total() - sum(count for (_, place), count in found.items() if place in ("middle", "end"))
    assert words == found.total() - sentence_choice.pairs_by_place([text]).total()


def test_a_prompt_is_reported_against_its_target():
    found = sentence_choice.measure_coverage(["aaaaaaaab bbbbbbbb c"], ["ab abd cab dd"], "z")
    rows = {row.unit: row for row in found.letters}
    assert [row.unit for row in found.letters] == ["a", "b", "d", "c", "z"]
    assert (rows["a"].start, rows["a"].middle, rows["a"].end, rows["a"].alone, rows["a"].total) == (1, 7, 0, 0, 8)
    assert rows["z"].share == 0 and rows["a"].share == 3 / 10
    assert [row.unit for row in found.short_letters] == ["d", "c", "z"]
    assert [row.unit for row in found.pairs] == ["ab", "bd", "ca", "dd"]
    assert [row.total for row in found.pairs] == [1, 0, 0, 0]
    assert json.loads(json.dumps(found.as_json()))["short_pairs"] == ["ab", "bd", "ca", "dd"]
    lines = found.table().splitlines()
    assert lines[2].split() == ["a", "30.00%", "1", "7", "0", "0", "8"]
    assert [line[0] for line in lines[2:7]] == [" ", " ", "*", "*", "*"]
    assert found.summary().startswith("3 of 5 letters fewer than 8 times: d(0) c(1) z(0)")


def test_two_hundred_pairs_are_reported():
    found = sentence_choice.measure_coverage([], corpus.shipped_sentences())
    assert len(found.pairs) == 200
    assert found.pairs[0].unit == "he" and found.pairs[0].share > found.pairs[-1].share > 0
    assert all(row.total == 0 for row in found.letters)


def test_what_a_hand_lacks_for_a_text():
    have = Counter({("a", "start"): 9, ("b", "end"): 2, ("b", "start"): 5, ("c", "end"): 1})
    found = sentence_choice.lacks("ab ab ab ax “ab” " + "ac " * 20, have)
    assert [(lack.letter, lack.place, lack.needed, lack.here, lack.anywhere) for lack in found] == [
        ('"', "alone", 2, 0, 0), ("x", "end", 1, 0, 0), ("c", "end", 20, 1, 1), ("b", "end", 4, 2, 7),
    ]  # fmt: skip
    assert sentence_choice.lacks("ab", have) == ()
    assert sentence_choice.lacks("ac ac ac", have, least=1) == ()


@given(st.lists(st.text("abc,", min_size=1, max_size=5), max_size=10))
def test_a_text_lacks_nothing_for_itself(texts):
    assert sentence_choice.lacks(" ".join(texts), sentence_choice.letters_by_place(texts)) == ()
