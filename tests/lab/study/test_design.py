"""Who sees what is balanced; the key is of its study and no other."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import InputError
from handout_lab.study import design
from handout_lab.study.design import Item, Key, Person, Snippet


@given(st.integers(20, 40), st.integers(1, 30), st.integers(1, 2), st.integers(0, 99))
def test_every_snippet_has_every_role_as_often_as_any_other(count, people, folds, seed):
    parts = [list(range(k, count * folds, folds)) for k in range(folds)]
    plans = design.dealt(parts, people, 10, 10, np.random.default_rng(seed))
    often = Counter((row.snippet, kind, row.truth) for plan in plans for kind, rows in enumerate(plan) for row in rows)
    for part in parts:
        for role in ((0, "real"), (0, "made"), (1, "left"), (1, "right")):
            times = [often[snippet, *role] for snippet in part]
            assert max(times) - min(times) <= 1
    for number, (singles, pairs) in enumerate(plans):
        seen = [row.snippet for row in (*singles, *pairs)]
        assert len(set(seen)) == 20 and set(seen) <= set(parts[number % folds])
        assert Counter(row.truth for row in singles) == {"real": 5, "made": 5}
        assert Counter(row.truth for row in pairs) == {"left": 5, "right": 5}


def test_the_order_is_of_chance_and_seeded():
    plans = [design.dealt([range(20)], 4, 10, 10, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert plans[0] == plans[1] != plans[2]
    firsts = [singles[0].truth for singles, _ in design.dealt([range(20)], 40, 10, 10, np.random.default_rng(3))]
    assert 10 < firsts.count("real") < 30


def test_snippets_that_are_drawn_by_chance_are_seen_unequally_often():
    plans = design.dealt([range(30)], 30, 10, 10, np.random.default_rng(1), design.DRAWN)
    often = Counter(row.snippet for plan in plans for rows in plan for row in rows)
    assert max(often.values()) - min(often.values()) > 4
    assert all(len({row.snippet for rows in plan for row in rows}) == 20 for plan in plans)


def test_what_cannot_be_dealt_is_refused():
    with pytest.raises(InputError, match="even"):
        design.dealt([range(20)], 4, 5, 10, np.random.default_rng(1))
    with pytest.raises(InputError, match="19 snippets are too few"):
        design.dealt([range(20), range(19)], 4, 10, 10, np.random.default_rng(1))


def test_envelopes_are_the_same_for_all_in_another_order():
    seen = design.envelopes(15, 8, 5, np.random.default_rng(1))
    assert len({frozenset(each) for each in seen}) == 1 and len(set(seen)) == 5
    assert Counter(item.truth for item in seen[0]) == {"made": 8, "real": 7}


def test_a_key_opens_for_its_study_only(tmp_path):
    person = Person((Item(0, "made"),), (Item(1, "left", "control", 2),))
    key = Key(7, ("me",), (Snippet(0, 0, 3, "words", 1, "q", ("wards",), "b"),), (person,))
    path = tmp_path / "study.key"
    name = design.seal(key, path)
    assert design.opened(path, name) == key
    assert b"words" not in path.read_bytes() and len(name) == design.ID
    other = Key(8, key.hands, key.snippets, key.people)
    assert design.seal(other, path) != name
    with pytest.raises(InputError, match="another study, or it was changed"):
        design.opened(path, name)
    path.write_bytes(b"words")
    with pytest.raises(InputError, match="not the key"):
        design.opened(path)
