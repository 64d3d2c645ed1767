"""Letters on their pages: every word, in order, and in its place."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import DoesNotFit
from handout.letters import load
from handout.pipeline.letters import draw_letter, prepare_letter
from handout.pipeline.options import SheetOptions, WritingOptions
from handout.pipeline.writing import STROKES

WORD = st.text("abcdefghijklmnopqrstuvwxyzABCD,.", min_size=1, max_size=8).filter(lambda word: word.strip(",."))
TEXT = st.lists(WORD, min_size=1, max_size=9).map(" ".join)
MARKUP = st.sampled_from(
    ["{}", "*{}*", "**{}**", "~~{}~~", "[{}]{{size=1.2}}", "[{}]{{ink=navy}}", "[{}]{{hand=house-print}}"]
)
SPANS = st.lists(st.tuples(MARKUP, TEXT).map(lambda pair: pair[0].format(pair[1])), min_size=1, max_size=3).map(
    " ".join
)
BLOCK = st.one_of(
    SPANS,
    TEXT.map("## {}".format),
    TEXT.map("> {}".format),
    st.lists(SPANS, min_size=1, max_size=3).map(lambda items: "\n".join(f"- {item}" for item in items)),
    TEXT.map("{{.right}}\n{}".format),
    WORD.map("| a | b |\n|---|---|\n| {} | c |".format),
)


def drawn(text, seed=1, wanted=STROKES, **sheet):
    options = SheetOptions(**({"page": "A5"} | sheet))
    return draw_letter(prepare_letter(load(text, "x.md"), WritingOptions(seed=seed), options), wanted=wanted)


def letters(pages):
    return "".join(placed.glyph.letter for page in pages for line in page.lines for placed in line.placed)


@pytest.mark.slow
@settings(max_examples=12)
@given(st.lists(BLOCK, min_size=1, max_size=4))
def test_all_words_come_out_in_order(blocks):
    text = "\n\n".join(blocks)
    pages, _ = drawn(text)
    assert letters(pages) == "".join(load(text).text.split())
    for page in pages:
        words = [placed.word for line in page.lines for placed in line.placed]
        assert words == sorted(words)


def test_the_same_seed_gives_the_same_strokes():
    text = "Dear *Ann*,\n\n- one\n- ~~two~~\n\n| a | b |\n|---|---|\n| c | d |\n"
    once, again, other = (drawn(text, seed)[1][0].strokes for seed in (1, 1, 2))
    assert all(np.array_equal(a.xy, b.xy) and np.array_equal(a.t, b.t) for a, b in zip(once, again, strict=True))
    assert len(once) != len(other) or not np.array_equal(once[0].xy, other[0].xy)


def test_inks_sizes_and_hands_share_one_page_and_one_clock():
    pages, (drawing,) = drawn("one [two]{ink=#a00} three [four]{hand=house-print size=1.5} five")
    assert {stroke.colour for stroke in drawing.strokes} == {"", "#aa0000"}
    assert letters(pages) == "onetwothreefourfive"
    starts = [float(stroke.t[0]) for stroke in drawing.strokes]
    assert starts == sorted(starts)
    red = np.concatenate([stroke.xy[:, 0] for stroke in drawing.strokes if stroke.colour])
    black = [float(stroke.xy[:, 0].min()) for stroke in drawing.strokes if not stroke.colour]
    assert min(black) < red.min() and max(black) > red.max()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("fine\n\n[" + "m" * 60 + "]{size=3}", "mm wide"),
        ("| " + " | ".join(["mmmmmmmm"] * 9) + " |\n" + "|--" * 9 + "|\n", "table"),
        ("---\n[box.a]\nx='9mm'\ny='9mm'\nw='50mm'\nh='8mm'\n---\n::: a\none\n\ntwo\n:::", "box a"),
        ("---\n[box.a]\nx='99mm'\ny='9mm'\nw='80mm'\nh='80mm'\n---\n::: a\none\n:::", "beyond the page"),
    ],
)
def test_what_does_not_fit_is_told_with_its_line(text, words):
    with pytest.raises(Exception, match=f"x.md, line [1-9].*{words}"):
        drawn(text)


def test_pages_may_be_limited():
    with pytest.raises(DoesNotFit, match=r"x\.md, line 1: here the page is full"):
        drawn("word " * 60, pages=1, page="74x105mm")
    assert len(drawn("word " * 60, page="74x105mm")[0]) > 1
