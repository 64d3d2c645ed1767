"""Lines of scanned glyphs: what was in the source comes back, what is joined is joined, nothing runs through."""

import numpy as np
import pytest

from handout.writing.joining import _clear
from handout.writing.spacing import resolve_collisions
from tests.writing.lines_of_glyphs import bent, gaps, heights, set_line


def whole(manner, numbers, new_word, seed=0, variation=1.0):
    rng = np.random.default_rng(seed)
    dx = gaps(manner, numbers, new_word, rng, variation)
    y = heights(manner, numbers, new_word, rng, variation)
    bends = bent(manner, numbers, rng, variation)
    dx = resolve_collisions(manner.spacing, np.array(numbers), np.array(new_word), dx, y, bends)
    x = np.concatenate([[0.0], np.cumsum(dx)])
    return x, y, set_line(manner, numbers, x, y, new_word, bends)


def test_a_text_of_the_source_comes_back_at_its_own_places(small_hand, small_manner, small_lines):
    """Every vertex lies where it lay, with its own ink: the texture can be the same to the pixel."""
    page = small_hand.pages[0]
    for number, line in enumerate(small_lines):
        x, _, graphs = whole(small_manner, line.numbers, line.new_word, variation=0)
        shift = line.centre[0, 0] - x[0]
        seen = set()
        for glyph, graph in zip(line.numbers, graphs, strict=True):
            assert np.allclose(page.to_picture(number, graph.xy + np.array([shift, 0.0])), graph.uv, atol=1e-6)
            rounded = {tuple(place) for place in np.round(graph.uv, 4).tolist()}
            own = page.graph.uv[small_hand.glyphs[glyph].vertices]
            assert {tuple(place) for place in np.round(own, 4).tolist()} <= rounded
            seen |= rounded
        vertices = np.concatenate([small_hand.glyphs[i].vertices for i in line.numbers])
        assert seen == {tuple(place) for place in np.round(page.graph.uv[vertices], 4).tolist()}


@pytest.mark.slow
def test_both_letters_have_the_whole_of_their_ligature(small_manner, jumbles):
    joined, between = 0, small_manner.spacing.joints.joints_between
    for numbers, new_word in jumbles:
        _, _, graphs = whole(small_manner, numbers, new_word)
        for k in range(len(numbers) - 1):
            first, second = (small_manner.forms[int(numbers[k + i])] for i in (0, 1))
            pairs = () if new_word[k + 1] else between(*numbers[k : k + 2].tolist())
            places = [{tuple(p) for p in np.round(graph.xy, 9).tolist()} for graph in graphs[k : k + 2]]
            bodies = [len(first.xy), len(second.xy)]
            shared = places[0] & places[1]
            for out, into in pairs:
                count = max(len(out), len(into))
                start = tuple(np.round(graphs[k].xy[out.anchor], 9).tolist())
                end = tuple(np.round(graphs[k + 1].xy[into.anchor], 9).tolist())
                assert start in shared and end in shared and len(shared) >= count
                assert out.anchor < bodies[0] and into.anchor < bodies[1]
                joined += 1
            if not pairs:
                assert not shared
    assert joined > 3


@pytest.mark.slow
def test_graphs_hang_together_as_their_glyphs_do(small_manner, jumbles):
    """No stroke comes loose: a graph has no more pieces than the body and its ways had."""
    for numbers, new_word in jumbles:
        _, _, graphs = whole(small_manner, numbers, new_word)
        for number, graph in zip(numbers, graphs, strict=True):
            form = small_manner.forms[int(number)]
            from handout.values import LineGraph

            body = LineGraph(form.xy, form.radius, form.density, form.uv, form.edges)
            assert graph.components.max() == body.components.max()
            assert np.array_equal(graph.uv[: len(form.xy)], form.uv)
            assert np.array_equal(graph.radius[: len(form.xy)], form.radius), "the line keeps its width"
            assert graph.lengths.max() < 0.1


def test_a_loose_exit_ends_at_the_letter_that_it_meets():
    stroke = np.column_stack([np.linspace(0, 1, 21), np.zeros(21)])
    thin = np.full(21, 0.02)
    post = np.column_stack([np.full(9, 0.5), np.linspace(-0.2, 0.2, 9)])
    kept = _clear(stroke, thin, post, np.full(9, 0.02))
    assert kept == 10, "it touches the post and does not cross it"
    assert _clear(stroke, thin, post + np.array([0, 1]), np.full(9, 0.02)) == 21
    assert _clear(stroke, thin, post - np.array([0.5, 0]), np.full(9, 0.02)) >= 1


def test_words_are_not_joined(small_manner, small_lines):
    line = small_lines[0]
    k = next(k for k in range(len(line.numbers) - 1) if small_manner.forms[int(line.numbers[k])].exits)
    numbers = line.numbers[k : k + 2]
    for parted, count in ((False, 1), (True, 0)):
        _, _, (one, other) = whole(small_manner, numbers, [True, parted], variation=0)
        shared = {tuple(p) for p in np.round(one.xy, 9).tolist()} & {tuple(p) for p in np.round(other.xy, 9).tolist()}
        assert bool(shared) == bool(count)


def test_the_same_seed_gives_the_same_line(small_manner, jumbles):
    numbers, new_word = jumbles[1]
    one, same, other = (whole(small_manner, numbers, new_word, seed)[2] for seed in (4, 4, 5))
    for a, b in zip(one, same, strict=True):
        assert a.xy.tobytes() == b.xy.tobytes() and a.radius.tobytes() == b.radius.tobytes()
    assert any(a.xy.shape != b.xy.shape or not np.allclose(a.xy, b.xy) for a, b in zip(one, other, strict=True))


def test_a_glyph_used_twice_is_not_the_same_twice(small_manner):
    graphs = whole(small_manner, [7, 7, 7], [True, True, True])[2]
    own = [graph.xy - graph.xy.mean(axis=0) for graph in graphs]
    assert np.abs(own[0] - own[1]).max() > 0.003 and np.abs(own[1] - own[2]).max() > 0.003


def test_nothing_to_set(small_manner):
    assert set_line(small_manner, [], [], [], [], []) == []


@pytest.mark.slow
def test_a_sentence_is_set_at_once(small_manner):
    """Sixty letters in well under a second, however busy the machine."""
    from time import process_time
    from timeit import repeat

    numbers = np.random.default_rng(1).integers(0, len(small_manner.forms), 60)
    # the best of three: what else the machine does is in the others
    took = repeat(lambda: whole(small_manner, numbers, np.arange(60) % 5 == 0), timer=process_time, number=1, repeat=3)
    assert min(took) < 0.8
