"""Corrections: each does what it says, finds its letter by place, and leaves what was found as it is."""

from dataclasses import replace
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.completion.completed_hand import complete_hand
from handout.errors import InputError, MissingCharacters
from handout.hand import corrections as made_by
from handout.hand import file
from handout.hand.corrections import (
    Confirm,
    Corrections,
    Cut,
    Join,
    JournalEntry,
    KeepOut,
    Label,
    Link,
    Merge,
    Outline,
    Paint,
    Placing,
    Remove,
    Rule,
    Split,
    Unlink,
    read_corrections,
)
from handout.hand.ligatures import LigatureFinder
from handout.hand.page_editor import vertices_along
from handout.hand.scanned import NOBODY
from handout.hand.vetting import vet
from handout.tagging import relearning
from handout.values import LineGraph
from handout.writing.glyph_index import better_lent, doubt, index_glyphs


def apply(hand, corrections):
    """Letters may be called what the transcript has not, so that a name tells which glyph is meant."""
    return made_by.apply(hand, corrections, strict=False)


def at(hand, number):
    """A place well within a glyph: its vertex farthest from those of other glyphs."""
    page, own = hand.pages[0], hand.glyphs[number].vertices
    others = np.setdiff1d(np.concatenate([g.vertices for g in hand.glyphs]), own)
    away = np.linalg.norm(page.graph.uv[own][:, None] - page.graph.uv[others][None], axis=2).min(axis=1)
    return tuple(page.graph.uv[own[int(away.argmax())]].tolist())


def word(hand, text):
    """Numbers of the glyphs of a word."""
    letters = "".join(glyph.letter for glyph in hand.glyphs)
    first = letters.index(text)
    return list(range(first, first + len(text)))


def consistent(hand):
    """Every vertex in one glyph at most; neighbours each other's; ligatures between the two they join."""
    owner = np.full(len(hand.pages[0].graph), NOBODY)
    for number, glyph in enumerate(hand.glyphs):
        assert (owner[glyph.vertices] == NOBODY).all()
        owner[glyph.vertices] = number
    for number, glyph in enumerate(hand.glyphs):
        for way in glyph.ligatures:
            assert owner[way.path[0]] == number and owner[way.path[-1]] == glyph.after
    return hand


def test_label(small_hand):
    v = word(small_hand, "even")[1]
    hand = consistent(apply(small_hand, [Label(page=0, at=at(small_hand, v), text="u", place="start")]))
    assert hand.glyphs[v].letter == "u" and hand.glyphs[v].place == "start" and hand.glyphs[v].confidence == 1
    assert small_hand.glyphs[v].letter == "v"
    same = [g.letter for i, g in enumerate(hand.glyphs) if i != v]
    assert same == [g.letter for i, g in enumerate(small_hand.glyphs) if i != v]


def test_remove_and_label_again(small_hand):
    e, v, n = word(small_hand, "eve")
    spot = at(small_hand, v)
    gone = consistent(apply(small_hand, [Remove(page=0, at=spot)]))
    assert len(gone.glyphs) == len(small_hand.glyphs) - 1
    assert gone.glyphs[e].after == NOBODY and not gone.glyphs[e].ligatures and gone.glyphs[e + 1].before == NOBODY
    assert gone.glyphs[n - 1].letter == "e"
    back = consistent(apply(small_hand, [Remove(page=0, at=spot), Label(page=0, at=spot, text="w")]))
    (number,) = back.numbers_of_letter("w")
    assert np.array_equal(back.glyphs[number].vertices, small_hand.glyphs[v].vertices)
    assert back.glyphs[number].line == small_hand.glyphs[v].line


def test_merge_takes_the_outer_neighbours(small_hand):
    e, v, following = word(small_hand, "eve")
    before = small_hand.glyphs[e].before
    one = Merge(page=0, at=at(small_hand, e), other=at(small_hand, v), text="w")
    hand = consistent(apply(small_hand, [one]))
    (number,) = hand.numbers_of_letter("w")
    glyph = hand.glyphs[number]
    both = np.union1d(small_hand.glyphs[e].vertices, small_hand.glyphs[v].vertices)
    assert np.array_equal(glyph.vertices, both)
    assert glyph.before == before and glyph.after == following - 1 and glyph.place == "start"
    assert bool(glyph.ligatures) == bool(small_hand.glyphs[v].ligatures)
    # the other way round, the same
    other = apply(small_hand, [Merge(page=0, at=one.other, other=one.at, text="w")])
    assert np.array_equal(other.glyphs[other.numbers_of_letter("w")[0]].vertices, both)
    assert other.glyphs[other.numbers_of_letter("w")[0]].place == "start"


def test_split_is_merge_undone(small_hand):
    m = int(small_hand.numbers_of_letter("m")[0])
    spot = at(small_hand, m)
    uv = small_hand.pages[0].graph.uv[small_hand.glyphs[m].vertices]
    x = float(np.median(uv[:, 0]))
    cut = Split(page=0, a=(x, uv[:, 1].min() - 9), b=(x, uv[:, 1].max() + 9), texts=("r", "w"))
    hand = consistent(apply(small_hand, [cut]))
    r, w = int(hand.numbers_of_letter("r")[0]), int(hand.numbers_of_letter("w")[0])
    assert (w, hand.glyphs[r].after, hand.glyphs[w].before) == (r + 1, w, r)
    assert hand.glyphs[r].before == small_hand.glyphs[m].before and hand.glyphs[w].after == m + 2
    assert hand.glyphs[r].ligatures, "the cut stroke leads from one to the other"
    left, right = (hand.pages[0].graph.uv[hand.glyphs[i].vertices, 0].mean() for i in (r, w))
    assert left < x < right
    whole = apply(small_hand, [cut, Merge(page=0, at=spot, other=(2 * x - spot[0], spot[1]), text="m")])
    merged = [g for g in consistent(whole).glyphs if g.letter == "m"]
    assert any(np.array_equal(g.vertices, small_hand.glyphs[m].vertices) for g in merged)


def test_split_without_names_leaves_the_smaller_part_unnamed(small_hand):
    m = int(small_hand.numbers_of_letter("m")[0])
    uv = small_hand.pages[0].graph.uv[small_hand.glyphs[m].vertices]
    x = float(np.percentile(uv[:, 0], 75))
    hand = apply(small_hand, [Split(page=0, a=(x, uv[:, 1].min() - 9), b=(x, uv[:, 1].max() + 9))])
    assert [hand.glyphs[i].letter for i in (m, m + 1)] == ["m", ""]
    assert "" not in hand.letters and len(hand.glyphs[m].vertices) > len(hand.glyphs[m + 1].vertices)


def test_unlink_link_and_place(small_hand):
    e, v, _ = word(small_hand, "eve")
    spots = at(small_hand, e), at(small_hand, v)
    assert small_hand.glyphs[e].ligatures
    apart = consistent(apply(small_hand, [Unlink(page=0, at=spots[0])]))
    assert not apart.glyphs[e].ligatures and apart.glyphs[e].after == v
    again = consistent(apply(apart, [Link(page=0, at=spots[0], other=spots[1])]))
    assert [w.path.tolist() for w in again.glyphs[e].ligatures] == [
        w.path.tolist() for w in small_hand.glyphs[e].ligatures
    ]
    placed = apply(small_hand, [Placing(page=0, at=spots[0], place="alone")])
    assert placed.glyphs[e].place == "alone"


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        (Label(page=0, at=(5.0, 400.0), text="a"), "no writing within 1 mm"),
        (Label(page=3, at=(5.0, 5.0), text="a"), "no such page"),
        (Label(page=-1, at=(5.0, 5.0), text="a"), "no such page"),
        (Remove(page=0, at=(0.0, -1e300)), "no letter at"),
        (Split(page=0, a=(800.0, 300.0), b=(900.0, 300.0)), "does not cross"),
    ],
)
def test_what_finds_nothing_is_refused_by_number(small_hand, wrong, says):
    good = Label(page=0, at=at(small_hand, 0), text="A")
    with pytest.raises(InputError, match=rf"Correction 2 .*{says}"):
        apply(small_hand, [good, wrong])


def test_what_cannot_be_done_is_refused(small_hand):
    o = int(small_hand.numbers_of_letter("o")[-1])  # its ring is closed
    spot = at(small_hand, o)
    uv = small_hand.pages[0].graph.uv[small_hand.glyphs[o].vertices]
    middle = uv.mean(axis=0)
    for wrong, says in (
        (Label(page=0, at=spot, text="ab"), "not one letter"),
        (Label(page=0, at=spot, text=" "), "not one letter"),
        (Merge(page=0, at=spot, other=spot), "on one letter"),
        (Link(page=0, at=spot, other=spot), "on one letter"),
        (Link(page=0, at=spot, other=at(small_hand, 0)), "different lines"),
        (Unlink(page=0, at=at(small_hand, len(small_hand.glyphs) - 1)), "not joined"),
        # from inside the loop to its left: one stroke of a ring cut
        (Split(page=0, a=tuple(middle), b=(uv[:, 0].min() - 5, middle[1])), "still hangs together"),
    ):
        with pytest.raises(InputError, match=says):
            apply(small_hand, [wrong])


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(st.data())
def test_any_corrections_leave_a_hand(small_hand, data):
    places = [at_vertex(small_hand, data) for _ in range(6)]
    kinds = st.sampled_from([Label, Merge, Split, Remove])
    made = []
    for a, b in pairwise(places):
        kind = data.draw(kinds)
        one = {
            Label: lambda a, b: Label(page=0, at=a, text="q"),
            Merge: lambda a, b: Merge(page=0, at=a, other=b),
            Split: lambda a, b: Split(page=0, a=a, b=b),
            Remove: lambda a, b: Remove(page=0, at=a),
        }[kind](a, b)
        try:
            apply(small_hand, [*made, one])
        except InputError as error:
            assert f"Correction {len(made) + 1} " in str(error)
        else:
            made.append(one)
    consistent(apply(small_hand, made))


def at_vertex(hand, data):
    uv = hand.pages[0].graph.uv
    return tuple(uv[data.draw(st.integers(0, len(uv) - 1))].tolist())


def test_joints_of_a_page_are_found_again(small_hand):
    """Ligatures depend on whose the vertices are, and on nothing else."""
    owner = np.full(len(small_hand.pages[0].graph), NOBODY)
    for number, glyph in enumerate(small_hand.glyphs):
        owner[glyph.vertices] = number
    joining = LigatureFinder(small_hand.pages[0], owner)
    for number, glyph in enumerate(small_hand.glyphs):
        if glyph.after >= 0:
            ways = joining.ligatures_between(number, glyph, glyph.after)
            assert [w.path.tolist() for w in ways] == [w.path.tolist() for w in glyph.ligatures]


def test_corrections_are_read_from_json():
    listed = b'[{"do": "label", "page": 0, "at": [1, 2], "text": "a"}, {"do": "place", "page": 1, "at": [1, 2.5], "place": "end"}]'  # noqa: E501
    found = read_corrections(listed, "x.json")
    assert found == (Label(page=0, at=(1, 2), text="a"), Placing(page=1, at=(1, 2.5), place="end"))
    assert read_corrections(b'{"corrections": ' + listed + b"}", "x.json") == found
    assert Corrections(found).corrections == found
    for wrong in (
        b"",
        b"{",
        b'[{"do": "fly", "page": 0}]',
        b'[{"do": "remove", "page": 0}]',
        b'{"format": 2}',
        b"\xff",
    ):
        with pytest.raises(InputError, match=r"x\.json"):
            read_corrections(wrong, "x.json")


def strictly(hand, *corrections):
    return consistent(made_by.apply(hand, corrections))


def box(hand, numbers, by=2.0):
    """A rectangle around some glyphs."""
    uv = np.concatenate([hand.pages[0].graph.uv[hand.glyphs[i].vertices] for i in numbers])
    (left, top), (right, bottom) = uv.min(axis=0) - by, uv.max(axis=0) + by
    return ((left, top), (right, top), (right, bottom), (left, bottom))


def test_confirmed_letters_are_sure(small_hand):
    v = word(small_hand, "even")[1]
    hand = strictly(small_hand, Confirm(page=0, at=at(small_hand, v), text="v"))
    assert [i for i, g in enumerate(hand.glyphs) if g.confirmed] == [v] and hand.glyphs[v].confidence == 1
    for wrong, says in (
        (Confirm(page=0, at=at(small_hand, v), text="w"), "is called 'v', not 'w'"),
        (Confirm(page=0, at=(5.0, 400.0)), "no letter within 1 mm"),
        (Label(page=0, at=at(small_hand, v), text="q"), "line 1, “an even line, this”, has no 'q'"),
        (Outline(page=0, within=box(small_hand, [v]), text="q"), "has no 'q'"),
        (Outline(page=0, within=((1, 1), (4, 1), (1, 4)), text="v"), "no writing inside"),
        (Outline(page=0, within=((1, 1), (4, 1)), text="v"), "make no polygon"),
    ):
        with pytest.raises(InputError, match=says):
            strictly(small_hand, wrong)


@pytest.mark.slow
def test_a_letter_that_is_right_may_be_kept_out_of_what_is_written(small_hand, tmp_path):
    v, path = word(small_hand, "even")[1], tmp_path / "a.hand"
    spot = at(small_hand, v)
    hand = strictly(small_hand, KeepOut(page=0, at=spot, text="v"))
    assert hand.glyphs[v].confirmed and hand.glyphs[v].kept_out and v not in hand.numbers_of_letter("v").tolist()
    assert hand.letters.get("v", 0) == small_hand.letters["v"] - 1
    index = index_glyphs(hand)
    assert v not in index.of("v").tolist() and hand.glyphs[v].letter == "v"
    file.save(small_hand, path)
    entry = JournalEntry((KeepOut(page=0, at=spot),))
    file.record(path, path, small_hand, hand, entry)
    assert file.load(path).glyphs[v].kept_out and file.journal(path).entries == (entry,)
    file.rewind(path, path, 0)
    assert not file.load(path).glyphs[v].kept_out and not file.load(path).glyphs[v].confirmed
    file.rewind(path, path, 1)
    kept = file.load(path)
    again = strictly(kept, KeepOut(page=0, at=spot, out=False))
    file.record(path, path, kept, again, JournalEntry((KeepOut(page=0, at=spot, out=False),)))
    assert file.load(path).glyphs[v].confirmed and not file.load(path).glyphs[v].kept_out
    # another name is another letter, which nobody kept out; without any left the hand lacks it
    assert not strictly(hand, Label(page=0, at=spot, text="e")).glyphs[v].kept_out
    others = [KeepOut(page=0, at=at(hand, n)) for n in small_hand.numbers_of_letter("v").tolist()]
    with pytest.raises(MissingCharacters, match="v"):
        complete_hand(strictly(small_hand, *others), "even")
    taught = relearning.correct(small_hand, [KeepOut(page=0, at=spot)]).hand
    assert [g.letter for g in taught.glyphs if g.kept_out] == ["v"]


@pytest.mark.slow
def test_that_a_letter_is_confirmed_makes_it_no_likelier_to_be_written(small_hand):
    """It is refused no longer, and costs what it did."""
    odd, letter, glyphs = int(small_hand.numbers_of_letter("e")[0]), "h", list(small_hand.glyphs)
    glyphs[odd] = replace(glyphs[odd], letter=letter, confidence=1.0)  # an odd one of its letter
    before = replace(small_hand, glyphs=tuple(glyphs))
    after = apply(before, [Confirm(page=0, at=at(before, odd))])
    assert vet(before).refused[odd] and vet(after).verdict(odd) == "sure"
    assert doubt(after)[odd] == pytest.approx(doubt(before)[odd], abs=1e-6) and doubt(after)[odd] > 5
    assert odd not in index_glyphs(before).all_candidates(letter, "middle").numbers
    assert odd in index_glyphs(after).all_candidates(letter, "middle").numbers
    assert not better_lent(apply(before.take_glyphs([odd]), [Confirm(page=0, at=at(before, odd))]), letter)


def test_a_name_takes_its_letter_of_the_transcript(small_hand):
    """Ink that is named is that letter of the text; what was taken for it has no name any more."""
    e, v, _ = word(small_hand, "eve")
    hand = strictly(small_hand, Label(page=0, at=at(small_hand, e), text="v"))
    assert (hand.glyphs[e].letter, hand.glyphs[e].at) == ("v", small_hand.glyphs[v].at)
    assert (hand.glyphs[v].letter, hand.glyphs[v].at) == ("", NOBODY)
    whole = strictly(small_hand, Outline(page=0, within=box(small_hand, [v]), text="v"))
    (number,) = whole.numbers_of_letter("v")
    assert whole.glyphs[number].at == small_hand.glyphs[v].at and whole.glyphs[number].confirmed
    # a letter left of one that is confirmed comes before it in the text
    with pytest.raises(InputError, match="has no 'h'"):
        strictly(small_hand, Confirm(page=0, at=at(small_hand, v)), Label(page=0, at=at(small_hand, e), text="h"))


def test_where_a_baseline_is_off_a_letter_stays_in_its_line(small_hand):
    """The neighbouring line is nearer to the ink then, and has a letter of that name, but far from there."""
    page = small_hand.pages[0]
    x = {i: float(page.graph.uv[g.vertices, 0].mean()) for i, g in enumerate(small_hand.glyphs)}
    on_line = [(g.letter, g.line) for g in small_hand.glyphs]
    number, other = max(
        ((i, k) for i, g in enumerate(small_hand.glyphs) for k, h in enumerate(small_hand.glyphs)
         if g.letter == h.letter and g.line == h.line + 1 and on_line.count((g.letter, g.line)) == 1),
        key=lambda pair: abs(x[pair[0]] - x[pair[1]]),
    )  # fmt: skip
    glyph, tall = small_hand.glyphs[number], page.x_height / page.pixel
    middle = page.graph.uv[glyph.vertices].mean(axis=0)
    baselines = np.array(page.baselines)
    above = float(page.base(small_hand.glyphs[other].line, middle[0]))
    baselines[glyph.line, 0] += middle[1] + (middle[1] - above + 1.5 * tall) - float(page.base(glyph.line, middle[0]))
    bent = replace(small_hand, pages=(replace(page, baselines=baselines),))
    off = [
        abs(bent.pages[0].to_line(i, middle)[0, 1] * page.pitch / page.x_height - 0.5) for i in range(len(baselines))
    ]
    assert off[glyph.line] > off[glyph.line - 1] == min(off)
    made = made_by.apply(bent, [Outline(page=0, within=box(small_hand, [number]), text=glyph.letter)])
    (again,) = [one for one in made.glyphs if one.at == glyph.at]
    assert again.confirmed and again.line == glyph.line
    assert any(one.at == small_hand.glyphs[other].at and not one.confirmed for one in made.glyphs)


def test_removed_ink_is_dismissed_until_it_is_named(small_hand):
    v = word(small_hand, "even")[1]
    spot = at(small_hand, v)
    gone = strictly(small_hand, Remove(page=0, at=spot))
    assert np.array_equal(gone.pages[0].dismissed, small_hand.glyphs[v].vertices)
    back = strictly(small_hand, Remove(page=0, at=spot), Label(page=0, at=spot, text="v"))
    assert (
        not len(back.pages[0].dismissed)
        and back.glyphs[int(back.numbers_of_letter("v")[0])].at == small_hand.glyphs[v].at
    )


def test_ink_of_two_letters_stays_with_the_one_that_is_left(small_hand):
    """Where a crossbar crosses the letter beside it, its vertices are both letters'."""
    e, v = word(small_hand, "even")[:2]
    crossing = small_hand.glyphs[e].vertices[:3]
    shared = replace(small_hand.glyphs[v], vertices=np.union1d(small_hand.glyphs[v].vertices, crossing))
    both = replace(small_hand, glyphs=(*small_hand.glyphs[:v], shared, *small_hand.glyphs[v + 1 :]))
    own = np.setdiff1d(small_hand.glyphs[v].vertices, crossing)
    for gone, left in ((e, v), (v, e)):
        hand = strictly(both, Remove(page=0, at=at(small_hand, gone)))
        (kept,) = (g for g in hand.glyphs if g.at == both.glyphs[left].at)
        assert np.isin(crossing, kept.vertices).all() and not np.isin(crossing, hand.pages[0].dismissed).any()
    one = strictly(both, Merge(page=0, at=at(small_hand, e), other=at(small_hand, v), text="e"))
    assert np.array_equal(one.glyphs[e].vertices, np.union1d(small_hand.glyphs[e].vertices, own))
    taken = apply(both, [Outline(page=0, within=box(small_hand, [e], by=0.5), text="o")])
    (ring,) = (glyph for glyph in consistent(taken).glyphs if glyph.letter == "o" and glyph.confirmed)
    assert np.isin(crossing, ring.vertices).all()


def test_ink_is_painted_over_and_drawn(small_hand):
    page, v = small_hand.pages[0], word(small_hand, "even")[1]
    hand = strictly(small_hand, Paint(page=0, to="paper", polygon=box(small_hand, [v], 4.0)))
    assert "v" not in hand.letters and len(hand.pages[0].graph) < len(page.graph)
    assert hand.pages[0].texture.rgba[..., 3].astype(int).sum() < page.texture.rgba[..., 3].astype(int).sum()
    places = ((3.0, 5.0), (40.0, 5.0))  # outside the box of the ink that is there
    drawn = strictly(small_hand, Paint(page=0, to="ink", stroke=places, width=6.0))
    new = drawn.pages[0]
    assert len(new.graph) > len(page.graph) and new.on_paper()[5, 20].sum() < page.on_paper()[5, 20].sum()
    assert np.array_equal(new.on_paper()[100:], page.on_paper()[100:])
    for wrong, says in (
        (Paint(page=0, to="paper", stroke=((3.0, 3.0), (9.0, 3.0)), width=3.0), "there is no ink"),
        (Paint(page=0, to="paper", stroke=((-3.0, 3.0),), width=3.0), "off the page"),
        (Paint(page=0, to="paper", stroke=((3.0, 3.0),), width=1e4), "wide is outside 1 to"),
        (Paint(page=0, to="paper", stroke=((3.0, 3.0),)), "a stroke with its width, or a polygon"),
        (Paint(page=0, to="ink", polygon=((3, 3), (9, 3), (9, 9))), "a letter needs the pen's line"),
        (Rule(page=0, a=(3.0, 3.0), b=(90.0, 3.0), width=4.0), "no stroke runs along there"),
        (Cut(page=0, a=(3.0, 3.0), b=(9.0, 3.0)), "crosses no stroke"),
    ):
        with pytest.raises(InputError, match=says):
            strictly(small_hand, wrong)


def test_a_rule_goes_with_its_likes_and_leaves_the_letters(small_hand):
    page = small_hand.pages[0]
    width = page.shape[1] - 20.0
    rules = [Paint(page=0, to="ink", stroke=((10.0, y), (width, y)), width=3.0)
             for y in (float(page.base(line, 200.0)) + 25 for line in range(3))]  # fmt: skip
    ruled = strictly(small_hand, *rules)
    (a, b), *_ = [rule.stroke for rule in rules]
    bare, notes, _ = made_by.apply_and_tell(ruled, [Rule(page=0, a=a, b=b, width=6.0)])
    assert notes == ("2 rules like the one that was corrected went with it.",)
    assert abs(len(bare.pages[0].graph) - len(page.graph)) < 0.01 * len(page.graph)
    assert bare.letters == small_hand.letters
    alpha = [hand.pages[0].on_paper().astype(float) for hand in (bare, small_hand, ruled)]
    assert np.abs(alpha[0] - alpha[1]).mean() < 0.1 * np.abs(alpha[2] - alpha[1]).mean()


def test_strokes_are_cut_and_joined(small_hand):
    e = word(small_hand, "eve")[0]
    way = small_hand.glyphs[e].ligatures[0].path
    uv = small_hand.pages[0].graph.uv
    parting = int(np.flatnonzero(~np.isin(way, small_hand.glyphs[e].vertices))[0])
    middle, along = uv[way[parting - 1 : parting + 1]].mean(axis=0), uv[way[parting]] - uv[way[parting - 1]]
    across = 4 * np.array([-along[1], along[0]]) / np.linalg.norm(along)
    apart = strictly(small_hand, Cut(page=0, a=tuple(middle - across), b=tuple(middle + across)))
    assert not apart.glyphs[e].ligatures and apart.letters == small_hand.letters
    ends = [tuple(uv[v].tolist()) for v in way[parting - 1 : parting + 1]]
    again = strictly(apart, Join(page=0, at=ends[0], other=ends[1]))
    assert again.glyphs[e].ligatures
    with pytest.raises(InputError, match="hangs together already"):
        strictly(small_hand, Join(page=0, at=ends[0], other=ends[0]))
    with pytest.raises(InputError, match="strokes within 3 mm are joined"):
        strictly(small_hand, Join(page=0, at=ends[0], other=at(small_hand, 20)))


def test_every_correction_is_json(small_hand):
    made = (Paint(page=0, to="ink", stroke=((1.0, 2.0),), width=2.0), Rule(page=0, a=(1, 2), b=(3, 4), width=2.0),
            Outline(page=0, within=((1, 2), (3, 4), (5, 6)), text="a"), Confirm(page=1, at=(1, 2)),
            Cut(page=0, a=(1, 2), b=(3, 4)), Join(page=0, at=(1, 2), other=(3, 4)))  # fmt: skip
    assert read_corrections(msgspec.json.encode(Corrections(made)), "x.json") == made


def test_a_drawn_stroke_keeps_to_the_part_of_a_ring_that_was_meant():
    turn = np.linspace(0.3, 2 * np.pi - 0.3, 60)  # open on the right, where the ink has failed
    uv = 12 * np.column_stack([np.cos(turn), np.sin(turn)]) + 20
    edges, many = np.column_stack([np.arange(59), np.arange(1, 60)]), np.ones(60)
    ring, every = LineGraph(uv, many, many, uv, edges), np.arange(60)
    for way in (every, every[::-1], np.r_[20:40, 38:9:-1]):
        assert vertices_along(ring, every, uv[way]).tolist() == way.tolist()
    round_ = np.linspace(np.pi, 3 * np.pi + 0.4, 50)  # from the left all around, over the gap and its own beginning
    drawn = 12.7 * np.column_stack([np.cos(round_), np.sin(round_)]) + 20.4
    passed = vertices_along(ring, every, drawn)
    steps = np.diff(passed)
    assert np.count_nonzero(steps == -59) == 1 and (steps == 1).sum() > 60 and (steps == 59).sum() == 0
