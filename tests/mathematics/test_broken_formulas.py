"""Over two hundred broken formulas: faults in places of many kinds, and nested a thousandfold; each is one sentence."""

import itertools

import pytest

from handout.errors import InputError
from handout.mathematics.parser import MOST_NESTED, WrongFormula, read_formula
from handout.writing.text import written_units

# a fault, what is said of it, and where in it that is; it may stand anywhere
ANYWHERE = [
    (r"\foo", r"\foo is not known here", 0),
    (r"\frca{a}{b}", r"\frca is not known here", 0),
    (r"x^2^3", "there are two of an exponent", 3),
    (r"x_1_2", "there are two of an index", 3),
    (r"{x^{a}}^b^c", "there are two of an exponent", 9),
    ("a#b", "# says nothing there", 1),
    ("5%", "% says nothing there", 1),
    (r"\mathbb{x}", r"\mathbb is known of", 0),
    (r"\mathbb{NN}", r"\mathbb is known of", 0),
    (r"\not x", r"\not stands before nothing that can be struck through", 0),
    (r"\not{\frac12}", r"\not stands before nothing that can be struck through", 0),
    (r"\rangle", r"\rangle closes nothing", 0),
    (r"\rceil", r"\rceil closes nothing", 0),
    (r"\langle a", r"\langle is not closed", 0),
    (r"\begin{tikz}x\end{tikz}", r"\begin{tikz} is not known", 0),
    (r"\begin{matrix}a\end{cases}", r"\end{cases} closes \begin{matrix}", 15),
    (r"\begin x", r"\begin lacks its name in braces", 0),
    (r"\left( a \middle) b \right)", r"\middle is known of | alone", 9),
    (r"\left x \right)", r"x is no bracket: the bracket behind \left is missing", 6),
    (r"\text x", r"\text lacks its brace {", 6),
    (r"\text{a \alpha}", r"\alpha stands in the words of \text", 8),
    (r"\sqrt[3{x}", "the bracket [ of a root's degree is not closed", 0),
    (r"{x^}", "the exponent behind ^ is missing", 3),
    (r"{x_}", "the index behind _ is missing", 3),
    (r"{\frac{a}}", "the denominator of a fraction is missing", 9),
    (r"{\frac}", "the numerator of a fraction is missing", 6),
    (r"{\sqrt}", "what stands under the root is missing", 6),
    (r"{\binom{n}}", r"the lower part of \binom is missing", 10),
    (r"{\hat}", r"what \hat stands over is missing", 5),
    (r"{\overset{a}}", r"what \overset sets it on is missing", 12),
]
AROUND = [("{}", 0), ("x + {} - y", 4), (r"\frac{{{}}}{{2}}", 6), (r"\sqrt{{{}}}", 6), ("a^{{{}}}", 3), ("(1, {})", 4)]
AROUND += [(r"\left[ {} \right]", 7), (r"\begin{{pmatrix}} 1 & {} \\ 3 & 4 \end{{pmatrix}}", 20)]
# what nothing closes, up to the end
OPEN = [
    ("{a", "the brace { is not closed", 0),
    (r"\frac{a", "the brace { is not closed", 5),
    (r"\left( a", r"\left is not closed by \right", 0),
    (r"\begin{cases} a", r"\begin{cases} is not closed by \end{cases}", 0),
    (r"\begin{cases", "a brace } is missing at its end", 12),
    (r"\text{a", r"the brace of \text is not closed", 5),
    (r"a^", "the exponent behind ^ is missing", 2),
    (r"\sqrt", "what stands under the root is missing", 5),
    (r"\left", r"the bracket behind \left is missing at its end", 5),
    ("a}", "} closes nothing", 1),
    (r"a \end{cases}", r"\end closes nothing: no \begin is before it", 2),
    (r"a \right)", r"\right closes nothing", 2),
]
BROKEN = [
    (around.format(fault), sentence, before + at)
    for (fault, sentence, at), (around, before) in itertools.product(ANYWHERE, AROUND)
    if not (fault == r"\langle a" and around.endswith(")"))
]
BROKEN += [(before + fault, sentence, len(before) + at) for fault, sentence, at in OPEN for before in ("", "x = ")]


def refusal(source):
    units = list(f"${source}$")
    with pytest.raises(WrongFormula) as told:
        read_formula(units, 0, len(units), displayed=False)
    return told.value


def test_there_are_two_hundred():
    assert len({source for source, _, _ in BROKEN}) >= 200


@pytest.mark.parametrize(("source", "sentence", "at"), BROKEN)
def test_a_fault_is_one_sentence_with_its_place_wherever_it_stands(source, sentence, at):
    wrong = refusal(source)
    said = str(wrong)
    assert sentence in said and wrong.at == at + 1
    assert len(said) < 500 and "\n" not in said and not said.endswith(".")


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize(
    ("opening", "closing"),
    [("{", "}"), ("(", ")"), ("[", "]"), ("x^{", "}"), (r"\frac{1}{", "}"), (r"\frac{", "}{2}"), (r"\sqrt{", "}"),
     (r"\sqrt[", "]{x}"), (r"\left(", r"\right)"), (r"\langle ", r"\rangle "), (r"\hat{", "}"), (r"\binom{n}{", "}"),
     (r"\begin{matrix}", r"\end{matrix}"), (r"\overset{a}{", "}"), (r"\mathbf{", "}"), (r"\not{", "}"),
     (r"\pmod{", "}"), (r"\text{", "}"), ("|(", ")|"), (r"\{", r"\}")],
)  # fmt: skip
def test_what_is_nested_a_thousandfold_is_one_sentence(opening, closing, closed):
    for deep in (MOST_NESTED + 1, 60, 1000):
        wrong = refusal(opening * deep + "x" + closing * deep * closed)
        assert "\n" not in str(wrong) and len(str(wrong)) < 200 and 0 <= wrong.at <= MOST_NESTED * len(opening) + 40
    with pytest.raises(InputError, match=r"^Formula at line 2, character \d+: .*\.$"):
        written_units(f"a\n${opening * 1000}x{closing * 1000 * closed}y$")
