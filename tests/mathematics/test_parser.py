"""Formulas found in a text and read."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.mathematics.formulas import CellGrid, Fenced, Fraction, Large, Leaf, Row, Scripts, leaves
from handout.mathematics.parser import WrongFormula, find_formulas, read_formula
from handout.mathematics.signs import COMMANDS, FUNCTIONS, LARGE_SIGNS


def read(source):
    units = ["$", *source, "$"]
    return read_formula(units, 0, len(units), displayed=False).tree


def words(source):
    return ["".join(leaf.text) for leaf in leaves(read(source))]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("$5 and $6", []),
        ("US$30 or $40, from $5-$10", []),
        ("a $x$ b", ["$x$"]),
        ("$x$5", []),
        ("I have 5$, you have 6$.", []),
        ("A$AP and US$-Konto, US$", []),
        ("the $n$th (3-$a$)", ["$n$", "$a$"]),
        ("$ x$ $x $", []),
        (r"\$x$ a", []),
        (r"$\$5$", [r"$\$5$"]),
        ("$$a\nb$$ and $c$.", ["$$a\nb$$", "$c$"]),
        ("$a\nb$", []),
        ("$$ and $$$", ["$$ and $$"]),
        ("$", []),
        ("$$", []),
        ("\\", []),
    ],
)
def test_a_sign_that_is_money_opens_no_formula(text, found):
    assert [text[begin:end] for begin, end, _ in find_formulas(list(text))] == found


def test_numbers_functions_and_words_are_one_leaf_each():
    assert words(r"\sin 12.5 + x_{10}y") == ["sin", "12.5", "+", "x", "10", "y"]
    assert words(r"1,000 + f(1,2)") == ["1,000", "+", "f", "(", "1", ",", "2", ")"]
    assert words(r"\text{if not } x") == ["if", "not", "x"]
    assert words(r"\frac12 x^34") == ["1", "2", "x", "3", "4"]


def test_leaves_know_their_places():
    tree = read(r"\alpha + \sin\beta")
    assert [leaf.at for leaf in leaves(tree)] == [(1,), (8,), (11, 12, 13), (14,)]


def test_brackets_grow_only_around_what_is_tall():
    assert isinstance(read(r"(\frac{a}{b})^2").base, Fenced)
    assert words("(a+b)^2") == ["(", "a", "+", "b", ")", "2"]
    assert isinstance(read("(a+b)^2").base, Row)


def test_bars_close_bars_or_stand_between():
    assert words("P(A|B) + |x|") == ["P", "(", "A", "B", ")", "+", "x"]  # bars are drawn
    assert isinstance(read("a|b").items[1], Large) and isinstance(read("|x|"), Fenced)
    norm = read(r"||\frac{x}{2}||")
    assert isinstance(norm, Fenced) and isinstance(norm.parts[0].items[0], Fenced)


def test_a_bracket_that_nothing_closes_is_a_sign():
    assert words("[0,1) (a ]0,1[") == ["[", "0", ",", "1", ")", "(", "a", "]", "0", ",", "1", "["]


def test_signs_between_rows_make_a_table_of_a_formula():
    tree = read(r"a &= b \\ c &= d \\")
    assert isinstance(tree, CellGrid) and [len(row) for row in tree.rows] == [2, 2]


@pytest.mark.parametrize(
    ("source", "sentence", "at"),
    [
        (r"\frac{1}", "the denominator of a fraction is missing", 9),
        (r"x^{2", "the brace { is not closed", 3),
        ("x}", "} closes nothing", 2),
        (r"1+\foo", r"\foo is not known here", 3),
        ("x^2^3", "there are two of an exponent at one place", 4),
        (r"\left( x", r"\left is not closed by \right", 1),
        (r"\begin{matrix} a & b", r"is not closed by \end{matrix}", 1),
        (r"\begin{matrix} a \end{cases}", r"\end{cases} closes \begin{matrix}", 18),
        (r"\begin{tikz}", r"\begin{tikz} is not known", 1),
        (r"\sqrt", "what stands under the root is missing", 6),
        (r"\text{a $", "is not closed", 6),
        ("a # b", "# says nothing there", 3),
        ("x_", "the index behind _ is missing", 3),
        ("\\", "a backslash stands at its end", 1),
        (r"\int", "no letter, digit or sign", 0),
        (r"\mathbb{x}", r"\mathbb is known of", 1),
        (r"\rangle", "closes nothing", 1),
        (r"\middle| x", "closes nothing", 1),
        ("{" * 900 + "x" + "}" * 900, "nested more than 24 deep", 25),
        ("(" * 900 + "x" + ")" * 900, "nested more than 24 deep", 25),
        (r"\sqrt" * 390 + " x", "nested more than 24 deep", None),
        ("x^" * 900 + "x", "there are two of an exponent", None),
        (r"\hat" * 400 + " x", "nested more than 24 deep", None),
        ("x" * 3000, "2000 are the most", 0),
    ],
)
def test_what_cannot_be_read_is_named_with_its_place(source, sentence, at):
    with pytest.raises(WrongFormula) as told:
        read(source)
    assert sentence in str(told.value)
    assert at is None or told.value.at == at


@pytest.mark.parametrize("name", [*COMMANDS, *FUNCTIONS])
def test_every_command_is_written(name):
    assert len(list(leaves(read(f"\\{name} x")))) == 2


@pytest.mark.parametrize("name", LARGE_SIGNS)
def test_every_large_sign_is_read_with_limits(name):
    assert isinstance(read(f"\\{name}_a^b x").items[0], Scripts)


PIECES = [
    *("x", "2", "+", "=", "^", "_", "{", "}", "&", r"\\", "(", ")", "|", "[", "]", " ", "'", "#", "~", "%"),
    *(r"\frac", r"\sqrt", r"\left(", r"\right)", r"\begin{cases}", r"\end{cases}", r"\text{", r"\sum", r"\alpha"),
    *(r"\hat", r"\middle|", r"\langle", r"\rangle", r"\binom", r"\not", r"\mathbb", r"\foo", r"\lim", r"\{", r"\}"),
    *(r"\limits", r"\pmod", r"\overset", r"\operatorname", r"\left", r"\right", r"\begin", r"\end", "\\"),
]


@given(st.lists(st.sampled_from(PIECES), max_size=14))
def test_any_pieces_are_a_formula_or_one_sentence(pieces):
    source = "".join(pieces)
    try:
        tree = read(source)
    except WrongFormula as error:
        assert "\n" not in str(error) and 0 <= error.at <= len(source) + 2
    else:
        placed = [at for leaf in leaves(tree) for at in leaf.at]
        assert placed == sorted(set(placed)) and all(0 < at <= len(source) for at in placed)
        assert isinstance(tree, Leaf | Row | Fraction) or tree is not None
