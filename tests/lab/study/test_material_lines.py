"""Which lines stand above pairs, and who sees letters taken by chance."""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from handout.errors import InputError
from handout_lab.pipeline.options import StudyOptions
from handout_lab.pipeline.study import _all_random, _people, _referred
from handout_lab.pipeline.study_material import Parted, _reference_lines
from handout_lab.study.design import Item
from handout_lab.study.snippets import Run


def test_lines_of_many_words_stand_above_pairs_before_short_ones():
    texts = {0: "or pray. Lift", 1: "the quick brown fox jumps over", 2: "hint of", 3: "lazy dogs, and jumps again"}
    longest = {(0, 0, n): Run(0, n, (n,), text) for n, text in texts.items()}
    assert {line for _, _, line in _reference_lines([*longest, (0, 0, 4), (1, 0, 0)], longest, 0)} == {1, 3}


def test_no_reference_comes_again_before_all_were_there():
    kept = [SimpleNamespace(snippet=SimpleNamespace(hand=k % 2)) for k in range(12)]
    lots = Parted((), tuple((k % 2, Run(0, k, (k,), "words")) for k in range(6)))
    found = _referred([Item(k, "left") for k in range(12)], kept, lots, np.random.default_rng(1))
    assert all(item.reference % 2 == item.snippet % 2 for item in found)
    assert Counter(item.reference for item in found) == dict.fromkeys(range(6), 2)
    assert len({item.reference for item in found[:6]}) == 6


def people(count, folds=2, **options):
    """Some people of a study, whose last snippets have no random selection."""
    kept = [SimpleNamespace(snippet=SimpleNamespace(hand=0, fold=k % folds), random=k < 20 or None) for k in range(24)]
    lots = Parted(((),) * folds, ((0, Run(0, 0, (0,), "words")),))
    asked = StudyOptions(people=count, singles=2, pairs=2, controls=0, **options)
    return _people(kept, lots, asked, np.random.default_rng(1)), kept


def test_random_selection_is_seen_beside_the_hand_s_own_or_by_every_other_person():
    beside, kept = people(6, random=3)
    for person in beside:
        assert Counter(item.condition for item in person.pairs) == {"made": 2, "random": 3}
        assert len({item.snippet for item in (*person.singles, *person.pairs)}) == 7
        assert all(kept[item.snippet].random for item in person.pairs if item.condition == "random")
    apart, _ = people(12, random_people=True)
    seen = [{item.condition for item in (*person.singles, *person.pairs)} for person in apart]
    assert seen == [{"made"}, {"random"}, {"random"}, {"made"}] * 3
    often = Counter((item.snippet, item.condition) for who in apart for item in (*who.singles, *who.pairs))
    assert set(often.values()) == {1}  # none comes again before all of its condition were there
    for folds in (1, 3, 4):
        few = [person.pairs[0].condition for person in people(4, folds, random_people=True)[0]]
        assert Counter(few) == {"made": 2, "random": 2}
    assert len(_all_random(kept, 2, 10)[0]) == 20
    with pytest.raises(InputError, match="Some people could see 10, and each is to see 11"):
        _all_random(kept, 2, 11)
