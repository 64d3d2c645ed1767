"""Letters on their pages: every word, in order, and in its place."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from handout.errors import DoesNotFit
from handout.letters import load
from handout.pipeline.letters import prepare_letter
from handout.pipeline.options import SheetOptions, WritingOptions
from handout.pipeline.texts import STROKES
from handout.sinks import Look, write_drawings

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
    pages = prepare_letter(load(text, "x.md"), WritingOptions(seed=seed), options).draw(wanted)
    return pages.manuscripts, pages.drawings


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


@pytest.mark.parametrize(
    ("text", "signs"),
    [("so $y_1$*5* is", "soy15is"), ("*a*$x^2$", "ax2"), (r"**5**$x$**5**, \$3", "5x5,$3")],
)
def test_markup_right_beside_a_formula_makes_no_money_of_it(text, signs):
    assert letters(drawn(text)[0]) == signs


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
        ("fine\n\nfine\n[" + "m" * 60 + "]{size=3}", "^x.md, line 4: '.*mm wide"),
        ("| " + " | ".join(["mmmmmmmm"] * 9) + " |\n" + "|--" * 9 + "|\n", "table"),
        ("---\n[box.a]\nx='9mm'\ny='9mm'\nw='50mm'\nh='8mm'\n---\n::: a\none\n\ntwo\n:::", "box a"),
        ("---\n[box.a]\nx='99mm'\ny='9mm'\nw='80mm'\nh='80mm'\n---\n::: a\none\n:::", "beyond the page"),
    ],
)
def test_what_does_not_fit_is_told_with_its_line(text, words):
    with pytest.raises(Exception, match=words if words[0] == "^" else f"x.md, line [1-9].*{words}"):
        drawn(text)


def test_pages_may_be_limited():
    with pytest.raises(DoesNotFit, match=r"x\.md, line 1: here the page is full"):
        drawn("word " * 60, pages=1, page="74x105mm")
    assert len(drawn("word " * 60, page="74x105mm")[0]) > 1


def test_no_line_ends_at_a_space_that_ties():
    text = "Cher M.\u00a0Dupont, cela fait 10\u202f[000]{size=1.1}&nbsp;*€*, M.\u00a0[Ann]{hand=house-print} et "
    text += "3\u00a0$x$. "
    for width in (75, 83, 90, 97):
        (page,), _ = drawn(text * 2, page=f"{width}x200mm")
        whole = "\n".join(line.text for line in page.lines)
        assert [whole.count(part) for part in ("M. Dupont,", "10 000 €,", "M. Ann", "3 x.")] == [2] * 4


def places(page, word):
    """The letters of a word of a page: (n, 2) mm, of the first line that has it."""
    for line in page.lines:
        text = "".join(placed.glyph.letter for placed in line.placed)
        if word in text:
            first = text.index(word)
            glyphs = [placed for placed in line.placed if placed.glyph.letter][first : first + len(word)]
            return np.vstack([stroke for placed in glyphs for stroke in placed.strokes])
    raise AssertionError(f"{word} is not written")


BOXED = (
    "---\n[box.a]\nx='20mm'\ny='15mm'\nw='60mm'\nh='40mm'\n---\n::: a\nAnn\nLondon\n:::\n\n{.date}\n2 May\n\nDear Ann"
)


def test_a_box_is_where_the_head_says_and_the_text_below_it():
    ((page,), _) = drawn(BOXED)
    assert 18 < places(page, "Ann")[:, 0].min() < 30 and places(page, "Ann")[:, 1].min() > 14
    assert places(page, "London")[:, 1].max() < 56
    assert places(page, "2")[:, 0].min() > 80 and places(page, "2")[:, 1].max() < 40
    assert places(page, "Dear")[:, 1].min() > 55


def test_words_stand_beside_a_picture_and_a_preview_shows_it(tmp_path):
    Image.new("RGB", (60, 40), (255, 0, 0)).save(tmp_path / "photo.png")
    text = "![a photo](photo.png){.right width=50mm}\n\n" + "some words beside it " * 12
    task = prepare_letter(load(text, "x.md", tmp_path), WritingOptions(seed=1), SheetOptions(page="A5"))
    pages = task.draw(STROKES)
    ((page,), (drawing,)) = pages.manuscripts, pages.drawings
    height = 50 * 40 / 60
    beside = [s.xy[:, 0].max() for s in drawing.strokes if s.xy[:, 1].min() < task.first.margin[0] + height - 2]
    below = [s.xy[:, 0].max() for s in drawing.strokes if s.xy[:, 1].min() > task.first.margin[0] + height + 8]
    right = page.page.width - task.first.margin[1]
    assert beside and max(beside) < right - 50 < max(below)
    write_drawings([drawing], [tmp_path / "page.png"], Look(dpi=50))
    shown = np.asarray(Image.open(tmp_path / "page.png").convert("RGB"))
    y, x = (round(v * 50 / 25.4) for v in (task.first.margin[0] + height / 2, right - 25))
    assert shown[y, x].tolist() == [255, 0, 0]


def test_what_does_not_fit_is_shrunk_where_that_is_asked_for():
    text = "# Head\n\n" + "word " * 40 + "\n\n| a | b |\n|---|---|\n| word word | c |"
    task = prepare_letter(load(text), WritingOptions(seed=1, fit=True), SheetOptions(page="100x80mm"))
    pages = task.draw(STROKES)
    ((page,), _) = pages.manuscripts, pages.drawings
    assert page.x_height == 2.5 * page.about["shrunk"][0] < 2.5 and letters([page]) == "".join(load(text).text.split())


def test_underlines_stay_under_their_words():
    ((page,), _) = drawn("one *two* three **four** five")
    (line,) = page.lines
    marks = [placed for placed in line.placed if not placed.glyph.letter]
    assert [len(mark.strokes) for mark in marks] == [1, 2]
    for mark, word in zip(marks, ("two", "four"), strict=True):
        under, over = np.vstack(mark.strokes), places(page, word)
        assert abs(under[:, 0].min() - over[:, 0].min()) < 3 and abs(under[:, 0].max() - over[:, 0].max()) < 3
        assert under[:, 1].min() > line.baseline - 1


def test_the_columns_of_a_table_are_ruled_and_stand_below_each_other():
    ((page,), _) = drawn("| one | two |\n|:--|--:|\n| a long cell | b |\n| c | d |")
    assert np.ptp([places(page, word)[:, 0].min() for word in ("one", "along")]) < 3
    assert np.ptp([places(page, word)[:, 0].max() for word in ("two", "b")]) < 3
    ruled = [s for line in page.lines for p in line.placed if not p.glyph.letter for s in p.strokes]
    assert sorted(np.ptp(s[:, 1]) > np.ptp(s[:, 0]) for s in ruled) == [False, True]


def test_a_table_begins_below_the_picture_that_words_stand_beside(tmp_path):
    Image.new("RGB", (40, 60)).save(tmp_path / "photo.png")
    text = "![](photo.png){.left width=30mm}\n\n| one | two |\n|---|---|\n| " + "some words " * 12 + " | more |"
    task = prepare_letter(load(text, "x.md", tmp_path), WritingOptions(seed=1), SheetOptions(page="A5"))
    pages = task.draw(STROKES)
    (_, (drawing,)) = pages.manuscripts, pages.drawings
    low, high = drawing.bounds[:2], drawing.bounds[2:]
    assert low[1] > task.first.margin[0] + 45 and high[0] < 148 - task.first.margin[1] + 3


@pytest.mark.slow
def test_a_scanned_hand_writes_letters_in_other_inks(small_hand):
    text = "ten *hens* and [ten men]{ink=#ff0000}\n\n- a hen\n"
    task = prepare_letter(load(text), WritingOptions(hand=small_hand, seed=1), SheetOptions(page="A6"))
    pages = task.draw()
    ((page,), (drawing,)) = pages.manuscripts, pages.drawings
    rgba = drawing.ink(100).rgba / 255
    ink = rgba[rgba[:, :, 3] > 0.5][:, :3]
    red = ink[:, 0] > ink[:, 2] + 0.3
    assert 0.1 < red.mean() < 0.9
    assert letters([page]) == "tenhensandtenmenahen"


def test_a_table_over_several_pages_is_ruled_on_each_where_it_is():
    rows = "".join(f"| {'some words ' * (1 + n % 4)} | x |\n" for n in range(8))
    head = "---\n[first]\nmargin='10mm,10mm,10mm,20mm'\n[following]\nmargin='10mm,20mm,10mm,10mm'\n---\n"
    pages, _ = drawn(f"{head}before\n\n| a | b |\n|---|---|\n{rows}", page="90x80mm")
    assert len(pages) > 2
    for page in pages:
        placed = [p for line in page.lines for p in line.placed]
        x = np.concatenate([s[:, 0] for p in placed if p.glyph.letter == "x" for s in p.strokes])
        words = np.concatenate([[0.0], *(s[:, 0] for p in placed if p.glyph.letter in tuple("sdm") for s in p.strokes)])
        lines = [s for p in placed if not p.glyph.letter for s in p.strokes if np.ptp(s[:, 1]) > np.ptp(s[:, 0])]
        assert len(lines) == 1 and words.max() < lines[0][:, 0].mean() < x.min()
        tops = [s[:, 1].min() for p in placed for s in p.strokes]
        assert lines[0][:, 1].min() > min(tops) - 4
