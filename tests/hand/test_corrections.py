"""Corrections: each does what it says, finds its letter by place, and leaves what was found as it is."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.hand.corrections import (
    Corrections,
    Label,
    Link,
    Merge,
    Placing,
    Remove,
    Split,
    Unlink,
    apply,
    read_corrections,
)
from handout.hand.ligatures import LigatureFinder
from handout.hand.scanned import NOBODY


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
    (number,) = back.of("w")
    assert np.array_equal(back.glyphs[number].vertices, small_hand.glyphs[v].vertices)
    assert back.glyphs[number].line == small_hand.glyphs[v].line


def test_merge_takes_the_outer_neighbours(small_hand):
    e, v, following = word(small_hand, "eve")
    before = small_hand.glyphs[e].before
    one = Merge(page=0, at=at(small_hand, e), other=at(small_hand, v), text="w")
    hand = consistent(apply(small_hand, [one]))
    (number,) = hand.of("w")
    glyph = hand.glyphs[number]
    both = np.union1d(small_hand.glyphs[e].vertices, small_hand.glyphs[v].vertices)
    assert np.array_equal(glyph.vertices, both)
    assert glyph.before == before and glyph.after == following - 1 and glyph.place == "start"
    assert bool(glyph.ligatures) == bool(small_hand.glyphs[v].ligatures)
    # the other way round, the same
    other = apply(small_hand, [Merge(page=0, at=one.other, other=one.at, text="w")])
    assert np.array_equal(other.glyphs[other.of("w")[0]].vertices, both)
    assert other.glyphs[other.of("w")[0]].place == "start"


def test_split_is_merge_undone(small_hand):
    m = int(small_hand.of("m")[0])
    spot = at(small_hand, m)
    uv = small_hand.pages[0].graph.uv[small_hand.glyphs[m].vertices]
    x = float(np.median(uv[:, 0]))
    cut = Split(page=0, a=(x, uv[:, 1].min() - 9), b=(x, uv[:, 1].max() + 9), texts=("r", "w"))
    hand = consistent(apply(small_hand, [cut]))
    r, w = int(hand.of("r")[0]), int(hand.of("w")[0])
    assert (w, hand.glyphs[r].after, hand.glyphs[w].before) == (r + 1, w, r)
    assert hand.glyphs[r].before == small_hand.glyphs[m].before and hand.glyphs[w].after == m + 2
    assert hand.glyphs[r].ligatures, "the cut stroke leads from one to the other"
    left, right = (hand.pages[0].graph.uv[hand.glyphs[i].vertices, 0].mean() for i in (r, w))
    assert left < x < right
    whole = apply(small_hand, [cut, Merge(page=0, at=spot, other=(2 * x - spot[0], spot[1]), text="m")])
    merged = [g for g in consistent(whole).glyphs if g.letter == "m"]
    assert any(np.array_equal(g.vertices, small_hand.glyphs[m].vertices) for g in merged)


def test_split_without_names_leaves_the_smaller_part_unnamed(small_hand):
    m = int(small_hand.of("m")[0])
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
    o = int(small_hand.of("o")[-1])  # its ring is closed
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
            ways = joining.between(number, glyph.after, glyph.line)
            assert [w.path.tolist() for w in ways] == [w.path.tolist() for w in glyph.ligatures]
            back = joining.between(glyph.after, number, glyph.line)
            assert sorted(w.path.tolist()[::-1] for w in back) == sorted(w.path.tolist() for w in ways)


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
