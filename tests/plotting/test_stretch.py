"""The part of a plot that is asked for: whole words, by share, time or name, over several sheets."""

import dataclasses
import itertools

import pytest
from cursive import page
from hypothesis import given
from hypothesis import strategies as st

from handout import profiles
from handout.errors import InputError
from handout.plotting import plan
from handout.plotting.jobs import store
from handout.plotting.jobs.parts import SheetStretch, name_stretch, pieces
from handout.plotting.jobs.store import JobOptions

PROFILE = profiles.find("simulated", "plotter")
TEXTS = (["Dear", "Ada,", "thank", "you"], ["for", "the", "letter", "and", "the", "stamps."])
PAGES = [
    dataclasses.replace(drawn, about={**drawn.about, "words": texts})
    for texts, drawn in zip(TEXTS, (page(1, words=4), page(2, words=6)), strict=True)
]


def words(part):
    """The words of a part, each once."""
    drawn = [(p.sheet, stroke.word) for p in part for stroke in PAGES[p.sheet].strokes[p.first : p.stop]]
    return [TEXTS[sheet][word] for sheet, word in dict.fromkeys(drawn)]


def part(**asked):
    return pieces(PAGES, lambda drawn: [plan(drawn, PROFILE)], **asked)


@pytest.mark.parametrize(
    ("asked", "first", "last", "count"),
    [
        ({}, "Dear", "stamps.", 10),
        ({"from_word": "dear", "to_word": "ada"}, "Dear", "Ada,", 2),
        ({"from_word": "you", "to_word": "for the"}, "you", "the", 3),
        ({"from_word": "the stamps"}, "the", "stamps.", 2),
        ({"from_word": "letter", "to_word": "the"}, "letter", "the", 3),
        ({"from_word": "4", "to_word": "6"}, "you", "the", 3),
        ({"sheets": "2", "from_word": "2", "to_word": "3"}, "the", "letter", 2),
        ({"sheets": "2-", "end": "0.1%"}, "for", "for", 1),
        ({"begin": "99.9%"}, "stamps.", "stamps.", 1),
        ({"end": "0.5s"}, "Dear", "Dear", 1),
        ({"sheets": "1", "begin": "0%", "end": "100%"}, "Dear", "you", 4),
    ],
)
def test_it_begins_and_ends_with_whole_words(asked, first, last, count):
    chosen = words(part(**asked))
    assert (chosen[0], chosen[-1], len(chosen)) == (first, last, count)


def test_a_time_is_that_of_the_announced_plot():
    plans = [plan(drawn, PROFILE) for drawn in PAGES]
    whole = sum(planned.duration for planned in plans)
    begin = plans[0].duration + float(plans[1].starts[plans[1].toolpath.first[-1]])  # of the last stroke of all
    assert words(part(begin=f"{begin + 0.01:.2f}s")) == ["stamps."]
    assert words(part(begin=f"0m{plans[0].duration:.2f}s", end="1h"))[-1] == "stamps."
    with pytest.raises(InputError, match="Nothing lies between"):
        part(begin="1m", end=f"{whole / 9:.1f}s")


def test_a_time_is_that_of_the_layers_at_their_speeds():
    def halved(drawn):
        """The first two words as always, the others at half that pace."""
        runs = [tuple(each for each in drawn.strokes if (each.word < 2) == first) for first in (True, False)]
        return [
            plan(dataclasses.replace(drawn, strokes=run), PROFILE, pace=pace)
            for run, pace in zip(runs, (1.0, 0.5), strict=True)
        ]

    first, second = halved(PAGES[0])
    asked = f"{first.duration + 0.9 * second.duration:.2f}s"
    assert words(pieces(PAGES, halved, begin=asked))[0] == "you"
    assert words(part(begin=asked))[0] != "you", "at one pace the sheet is done by then"


@given(st.floats(0.0, 100.0), st.floats(0.0, 100.0))
def test_parts_that_follow_each_other_are_the_whole(a, b):
    low, high = sorted((round(a, 1), round(b, 1)))
    if high - low < 0.2 or low < 0.1 or high > 99.9:
        return
    parts = [part(end=f"{low}%"), part(begin=f"{low}%", end=f"{high}%"), part(begin=f"{high}%")]
    strokes = [{(p.sheet, at) for p in some for at in range(p.first, p.stop)} for some in parts]
    everything = {(number, at) for number, drawn in enumerate(PAGES) for at in range(len(drawn.strokes))}
    assert set.union(*strokes) == everything
    for before, after in itertools.pairwise(parts):  # no more than the word at the border is in both
        assert len(set(words(before)) & set(words(after)) - {"the"}) <= 1


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"from_word": "deer"}, "--from-word: 'deer' is not there; there is dear"),
        ({"from_word": "letter", "to_word": "Dear"}, "'Dear' is not there after the beginning of the part"),
        ({"to_word": "11"}, "there is no word 11; there are 10"),
        ({"begin": "40"}, "'40' is neither a share such as 40% nor a time such as 2m30s"),
        ({"end": "101%"}, "more than 100%"),
        ({"begin": "1%", "from_word": "Ada"}, "two ways to say one thing"),
        ({"sheets": "3"}, "3 is not within the sheets that there are, 1 to 2"),
        ({"sheets": "a"}, "'a' is no number of a sheet"),
        ({"begin": "100%"}, "Nothing lies between 100% and the end"),
        ({"end": "0s"}, "Nothing lies between the beginning and 0s"),
    ],
)
def test_what_cannot_be_is_one_sentence(asked, said):
    with pytest.raises(InputError, match=said):
        part(**asked)


def test_it_is_called_by_its_words():
    assert name_stretch(part(from_word="you", to_word="for"), PAGES).startswith(
        'Of sheets 1 to 2, from "you" to "for": 0.'
    )
    assert name_stretch([SheetStretch(0, 0, 1), SheetStretch(2, 0, 1)], [*PAGES, PAGES[0]]).startswith(
        "Of sheets 1, 3, from"
    )
    assert name_stretch([SheetStretch(1, 0, 1)], [dataclasses.replace(drawn, about={}) for drawn in PAGES]).startswith(
        "Of sheet 2: 0."
    )


def test_the_drawings_of_the_last_finished_jobs_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)
    jobs = [store.create([page(words=1)], PROFILE, JobOptions(), place=tmp_path) for _ in range(3)]
    for job in jobs[:2]:
        with job.open() as kept:
            kept.finish()
    store.drop_drawings(tmp_path, keep=1)
    assert [bool(list(job.folder.glob("page-*"))) for job in jobs] == [False, True, True]
    assert store.drawn_before(jobs[1].name, tmp_path).name == jobs[1].name
    with pytest.raises(InputError, match=f"drawings of {jobs[0].name} are not kept any more.*Those of"):
        store.drawn_before(jobs[0].name, tmp_path)
