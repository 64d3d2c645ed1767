"""Letter files: what Markdown becomes, and one sentence with the line for what is wrong."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.letters import load
from handout.letters.document import Boxed, DrawnRule, List, Paragraph, Quote, Signature, TableBlock

HEAD = '---\nhand = "house-print"\n[box.address]\nx = "10mm"\ny = "10mm"\nw = "60mm"\nh = "30mm"\n---\n'


def spans(text):
    (paragraph,) = load(text).blocks
    return {span.text.strip(): span.manner for span in paragraph.spans}


def test_emphasis_is_underlined_as_pens_do():
    found = spans("*one* **two** *three*{.wavy} [four]{.double} ~~five~~ six")
    assert [found[word].underline for word in ("one", "two", "three", "four", "five", "six")] == [
        "straight", "double", "wavy", "double", "", "",
    ]  # fmt: skip
    assert found["five"].struck and not found["six"].struck


def test_values_of_attributes_need_no_quotes():
    found = spans("[red]{ink=#a00 size=1.3} [blue]{ink=navy} [Ben]{hand=house-print}")
    assert (found["red"].ink, found["red"].size, found["blue"].ink) == ("#aa0000", 1.3, "#000080")
    assert found["Ben"].hand == "house-print"


def test_blocks_become_what_they_are():
    letter = load(
        f"{HEAD}::: address\nAnn\nLondon\n:::\n\n{{.date}}\n2 May\n\n# Dear Ann\n\n{{.centre}}\nhello\n\n- a\n- b\n\n"
        "3) c\n4) d\n\n> so\n\n| x | y |\n|--:|---|\n| 1 | 2 |\n\n***\n\n::: signature\nBen\n:::\n\n{.ps}\nP.S. more\n"
    )
    kinds = (Boxed, Paragraph, Paragraph, Paragraph, List, List, Quote, TableBlock, DrawnRule, Signature, Paragraph)
    assert tuple(map(type, letter.blocks)) == kinds
    box, date, heading, hello, dashes, numbers, _, table, rule, signature, postscript = letter.blocks
    assert letter.head.hand == "house-print" and letter.boxes["address"].w == 60
    assert "".join(span.text for span in box.blocks[0].spans) == "Ann\nLondon"
    assert (date.side, date.kind, heading.level, hello.side, postscript.kind) == (
        "right", "date", 1, "centre", "postscript",
    )  # fmt: skip
    assert heading.spans[0].manner.size > 1.3
    assert dashes.marker == "dash" and not dashes.items[0].label.spans
    assert [item.label.spans[0].text for item in numbers.items] == ["3)", "4)"]
    assert [cell.side for cell in table.rows[0]] == ["right", None]
    assert rule.kind == "flourish" and signature.blocks[0].spans[0].text == "Ben"


def test_a_head_may_stand_between_plus_signs():
    assert load('+++\npage = "A6"\n+++\nHello').head.page == "A6"


def test_a_soft_break_is_a_space_and_a_hard_one_a_line():
    (paragraph,) = load("one\ntwo\\\nthree").blocks
    assert "".join(span.text for span in paragraph.spans) == "one two\nthree"
    assert [span.line for span in paragraph.spans if span.text in ("one", "two", "three")] == [1, 2, 3]


def test_what_is_dropped_is_told_with_its_line():
    letter = load("a [shop](https://example.org) here\n\n<!-- a note -->\n\nand **this", "x.md")
    assert [sentence.split(":")[0] for sentence in letter.dropped] == ["x.md, line 1", "x.md, line 3", "x.md, line 5"]
    assert "https://example.org" in letter.dropped[0]


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("fine\n\na {.right", 3, "brace"),
        ("a\n\n\nb {{ first_name }}", 4, "table"),
        ("fine\n\n{.rigth}\nword", 4, "right"),
        ("[a]{sze=2}", 1, "size"),
        ("[a]{size=big}", 1, "number"),
        ("[a]{size=99}", 1, "0.4 to 6"),
        ("[a]{ink=blurple}", 1, "colour"),
        ("[a]{onclick=x}", 1, "onclick"),
        ("---\nfoo: bar\n---\nx", 2, "TOML"),
        ("---\nhnd = 'x'\n---\nx", 2, "hand"),
        ("---\n[first]\nmargn = '2mm'\n---\nx", 3, "margin"),
        ("---\npage = 3\n---\nx", 2, "page"),
        ("+++\nx", 1, "closed"),
        ("---\nx", 1, "closed"),
        ("x\n\n::: foo\nbar\n:::", 3, "foo"),
        ("::: date\nbar", 1, "closed"),
        ("x\n\n<b>x</b>", 3, "HTML"),
        ("a `b`", 1, "code"),
        ("x\n\n    code", 3, "code"),
        ("```\na\n```", 1, "code"),
        ("- " * 1000 + "x", 1, "within"),
        (">" * 1000 + "x", 1, "within"),
        ("a\n\n![a](none.png)", 3, "picture"),
        ("a ![a](none.png)", 1, "paragraph of its own"),
    ],
)
def test_what_is_wrong_is_one_sentence_with_its_line(text, line, words):
    with pytest.raises(InputError) as error:
        load(text, "x.md")
    assert str(error.value).startswith(f"x.md, line {line}: ") and words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(("text", "words"), [("", "nothing to write"), ("x" * 10**7, "10000000 characters")])
def test_nothing_and_too_much_are_refused(text, words):
    with pytest.raises(InputError, match=words):
        load(text, "x.md")


# every construct that letters know, each with nothing in it too
_WORDS = (
    "", "", "a", "two words", "*", "**", "_", "~~", "[]", "[]{.wavy}", "[x]{.double}", "[x]{ink=red size=1.2}",
    "*[]{}*", "**b**", "*i*{.wavy}", "~~[]~~", "[](x)", "[a](b)", "[a][b]", "{.right}", "\\", "\\{", "&nbsp;",
    "<!-- c -->", "|", "  \n", "\n", "\u200b", "\ufeff", "\x00", "![](none.png)", "`c`", "{{ x }}", "<b>",
)  # fmt: skip
_BLOCKS = (
    "", "#", "##  ", "# # #", "-", "- ", "1.", "999999999. x", "*", "***", "---", "===", "| |",
    "| a | b |\n|---|---|\n| 1 | |", "| |\n|--|",
    "|a|\n|:-:|\n||", ">", ">>>", "> #", "> | |\n> |--|\n> ", ":::", "::: date\n:::", "::: ps\n\n:::",
    "::: signature\n:::", "::: signature x\n#\n:::", "::: address\n#\n:::", "{.date}", "{.page}\n***", "{.right}\n#",
    "{size=0.9}\n| a |\n|-|\n| |", "```\n```", "    code", "<div>", "[a]: b", "[a]: <>\n[a]", "---\n---", "+++\n+++",
    "a\n===",
)  # fmt: skip
_INLINE = st.lists(st.sampled_from(_WORDS), max_size=5).map("".join)
_ROW = st.lists(_INLINE.map(lambda text: text.replace("\n", " ")), max_size=4).map(lambda row: f"|{'|'.join(row)}|")
_TABLE = st.lists(_ROW, min_size=1, max_size=4).map(
    lambda rows: "\n".join([rows[0], "|" + "---|" * max(rows[0].count("|") - 1, 1), *rows[1:]])
)
_BLOCK = st.tuples(
    st.sampled_from(["", "", "> ", "- ", "1. ", "# ", "{.right}\n", "::: date\n"]),
    st.one_of(_INLINE, _TABLE, st.sampled_from(_BLOCKS)),
).map("".join)


@settings(max_examples=300)
@given(st.lists(_BLOCK, min_size=1, max_size=4), st.sampled_from(["\n", "\n\n"]))
def test_any_letter_is_read_or_refused_in_a_sentence(blocks, between):
    try:
        letter = load(between.join(blocks), "x.md", None)
    except InputError as error:
        assert str(error).startswith("x.md")
    else:
        assert letter.blocks


@pytest.mark.parametrize(
    "text",
    ["| a | b |\n|---|---|\n| 1 | |", "| a | b |\n|---|---|\n| 1 |", "| | b |\n|---|---|", "x\n\n#", "x []{.wavy}",
     "> | x |\n> |--|\n> "],
)  # fmt: skip
def test_what_is_empty_is_written_as_nothing(text):
    assert "".join(load(text).text.split()) in ("ab1", "b", "x")


@pytest.mark.parametrize("text", ["#", "[]{.wavy}", "| |\n|--|", "<!-- only a note -->", "> "])
def test_a_letter_of_nothing_but_empty_blocks_is_refused(text):
    with pytest.raises(InputError, match="nothing to write"):
        load(text)


def words_of(text):
    return [span.text for paragraph in load(text).paragraphs for span in paragraph.spans]


def test_nothing_in_a_formula_is_markdown():
    assert words_of(r"so $a_1*b_2*c$ and $\sum_{i=1}^n [x](y)$ is") == [
        "so ", "$a_1*b_2*c$", " and ", r"$\sum_{i=1}^n [x](y)$", " is",
    ]  # fmt: skip


def test_money_stays_money_in_letters():
    assert words_of(r"costs $5 and \$6.") == [r"costs \$5 and ", r"\$", "6."]


def test_a_displayed_formula_has_its_lines_and_stands_in_the_middle():
    letter = load("a\n\n$$\nx\n= 2\n- 1\n$$.\n\n- b\n\n  $$y$$\n\nc $$z$$ d")
    assert [type(block) for block in letter.blocks] == [Paragraph, Paragraph, List, Paragraph]
    assert letter.blocks[1].spans[0].text == "$$ x = 2 - 1 $$." and letter.blocks[1].side == "centre"
    assert [span.text for span in letter.blocks[3].spans] == ["c ", "\n$$z$$\n", " d"]


def test_lines_behind_a_displayed_formula_are_counted():
    with pytest.raises(InputError, match=r"^the letter, line 6: a block of code"):
        load("a\n$$\nx\n$$\n\n```\nb\n```")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a\n\nso $x^{2$", r"^the letter, line 3: formula, character 4: the brace { is not closed\.$"),
        ("$$\nx\n\\foo\n$$", r"^the letter, line 3: formula, character 1: \\foo is not known here"),
    ],
)
def test_a_broken_formula_is_named_with_its_line(text, sentence):
    with pytest.raises(InputError, match=sentence):
        load(text)
