"""Formulas flow in a text as words do."""

import itertools

import numpy as np
import pytest

from handout.errors import DoesNotFit, InputError, MissingCharacters
from handout.hand.library import load
from handout.mathematics.signs import ACCENTS, COMMAND_BRACKETS, LARGE_SIGNS, PAIRS
from handout.page_sizes import margins, page
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout.writing.text import FormulaLetters, lacking, paragraphs_of, written_units

HAND = load("house-print")
PAPER = page("a5")
BRACKETS = {sign: f"\\{name}" for name, sign in COMMAND_BRACKETS.items() if sign not in "[]|"}


def layout(**options):
    return Layout(**{"page": PAPER, "margin": margins("15mm", PAPER), "x_height": 2.0, "jitter": 1.0, **options})


def written(text, **options):
    return compose(text, HAND, layout(**options), np.random.default_rng(1))


def heights(placed):
    """Letter → its lowest and highest place over the baseline of its line, mm."""
    found = {}
    for line in placed.lines:
        for each in line.placed:
            y = line.baseline - np.concatenate([stroke[:, 1] for stroke in each.strokes])
            found[each.glyph.letter] = (float(y.min()), float(y.max()))
    return found


def test_text_without_formulas_is_spelt_as_it_stands():
    assert written_units("a $5 b $6") == (list("a $5 b $6"), [])
    assert written_units(r"a\$b$") == (["a", "", "$", "b", "$"], [])


def test_letters_of_a_formula_keep_their_places_in_the_text():
    units, (formula,) = written_units(r"so $\alpha=1$.")
    assert {at: unit for at, unit in enumerate(units) if unit} == {
        0: "s",
        1: "o",
        2: " ",
        4: "α",
        10: "=",
        11: "1",
        13: ".",
    }
    assert formula.source == r"$\alpha=1$"


def test_what_stands_beside_a_formula_is_never_parted_from_it():
    (pieces,) = paragraphs_of("see ($x-y$), or", HAND.repertoire)
    formula = pieces[2]
    assert isinstance(formula, FormulaLetters) and "".join(letter.base for letter in formula) == "(x–y),"
    assert [part is None for part, _ in formula.parts] == [True, False, True]


def test_a_displayed_formula_is_a_paragraph_of_its_own():
    paragraphs = paragraphs_of("We have $$x=1$$, and\nso $$y\n=2$$\nmore", HAND.repertoire)
    spelt = [
        "".join(letter.base for piece in each if not isinstance(piece, int) for letter in piece) for each in paragraphs
    ]
    assert spelt == ["Wehave", "x=1,", "and", "so", "y=2", "more"]


def test_lacking_letters_are_those_of_the_formula_and_not_its_commands():
    assert lacking(r"$\frac{x}{ש}$", HAND.repertoire) == {"ש": [10]}
    with pytest.raises(MissingCharacters, match=r"'ש' .line 1, character 11."):
        written(r"$\frac{x}{ש}$")


def test_a_broken_formula_is_named_with_its_line():
    with pytest.raises(
        InputError, match=r"^Formula at line 2, character 13: the denominator of a fraction is missing.$"
    ):
        written("First\nso $\\frac{x}$ is")


def test_a_fraction_stands_above_and_below_its_rule():
    found = heights(written(r"$\frac{a}{b}$", jitter=0.0)[0])
    assert found["a"][0] > found[""][1] - 0.1 and found["b"][1] < found[""][0] + 0.1


def test_exponents_are_high_and_small_and_indices_low():
    found = heights(written("$x^a_c$", jitter=0.0)[0])
    assert found["a"][0] > 0.8 and found["c"][0] < -0.3
    assert np.ptp(found["a"]) < 1.7 and np.ptp(found["x"]) > 1.6


def test_a_root_covers_what_stands_under_it():
    (line,) = written(r"$\sqrt{abc}$")[0].lines
    (root,) = [placed for placed in line.placed if not placed.glyph.letter]
    letters = np.concatenate([stroke for placed in line.placed if placed.glyph.letter for stroke in placed.strokes])
    roof = root.strokes[0][-3:]
    assert roof[:, 1].max() < letters[:, 1].min() and roof[-1, 0] >= letters[:, 0].max()


def test_a_tall_formula_takes_the_room_of_lines_and_stays_within_the_margins():
    matrix = r"$$\begin{pmatrix} 1 \\ 2 \\ 3 \\ 4 \end{pmatrix}$$"
    pages = written("\n".join(["Text before.", matrix] * 6))
    assert len(pages) > 1
    for sheet in pages:
        boxes = []
        for line in sheet.lines:
            xy = np.concatenate([stroke for placed in line.placed for stroke in placed.strokes])
            boxes.append((xy[:, 1].min(), xy[:, 1].max()))
            assert xy[:, 1].min() > 13 and xy[:, 1].max() < PAPER.height - 13
        assert all(above[1] < below[0] for above, below in itertools.pairwise(boxes))


@pytest.mark.parametrize("tight", [2.0, 2.6])
def test_tall_formulas_on_lines_below_each_other_do_not_touch(tight):
    text = "\n".join([r"$\frac{1}{1+\frac{1}{x}}$ and $x_{k_1}$", r"$x^{2^{2}}$ and $\frac{f^2}{q}$"] * 4)
    layout = Layout(page=PAPER, margin=margins("15mm", PAPER), x_height=2.0, jitter=0.0, line_spacing=tight * 2.0)
    for sheet in compose(text, HAND, layout, np.random.default_rng(3)):
        inks = [np.concatenate([s for placed in line.placed for s in placed.strokes])[:, 1] for line in sheet.lines]
        assert len(inks) > 2 and all(above.max() < below.min() for above, below in itertools.pairwise(inks))


def test_a_displayed_formula_stands_in_the_middle():
    (line,) = written("$$x=1$$")[0].lines
    xy = np.concatenate([stroke for placed in line.placed for stroke in placed.strokes])
    assert abs(0.5 * (xy[:, 0].min() + xy[:, 0].max()) - 0.5 * PAPER.width) < 2


def test_a_long_formula_is_broken_before_relations_only():
    lines = written("$" + " = ".join(["a+b+c+d"] * 8) + "$")[0].lines
    assert len(lines) > 1 and all(line.text.startswith("=") for line in lines[1:])


def test_a_formula_wider_than_the_page_is_refused():
    with pytest.raises(DoesNotFit, match=r"The formula .* is .* mm wide, and there are"):
        written("$" + "+".join(["abcd"] * 20) + "$")


def test_a_formula_higher_than_the_page_is_refused():
    rows = r"\\".join(["x"] * 60)
    with pytest.raises(DoesNotFit, match=r"mm high, and reaches \d+\.\d mm over the margin"):
        written(rf"$$\begin{{matrix}} {rows} \end{{matrix}}$$")


def test_slips_leave_formulas_alone():
    pages = compose("$abc$ " * 30, HAND, layout(), np.random.default_rng(1), slips=100.0)
    assert not any("slips" in sheet.about for sheet in pages)


def test_without_variation_a_formula_is_always_the_same():
    one, other = (
        compose(r"$\sqrt{\frac{a}{b}}$", HAND, layout(jitter=0.0), np.random.default_rng(seed)) for seed in (1, 2)
    )
    for a, b in zip(one[0].lines[0].placed, other[0].lines[0].placed, strict=True):
        if not a.glyph.letter:
            assert np.allclose(a.strokes[0], b.strokes[0])


@pytest.mark.parametrize("name", ACCENTS)
def test_every_accent_is_drawn(name):
    (line,) = written(rf"$\{name}{{ab}}$")[0].lines
    assert [placed.glyph.letter for placed in line.placed] == ["a", "b", ""]


@pytest.mark.parametrize("left", PAIRS)
def test_every_bracket_is_drawn_on_both_sides(left):
    (line,) = written(
        rf"$\left{BRACKETS.get(left, left)} \frac{{a}}{{b}} \right{BRACKETS.get(PAIRS[left], PAIRS[left])}$"
    )[0].lines
    boxes = [np.concatenate(placed.strokes)[:, 0] for placed in line.placed]
    assert len(boxes) == 5 and boxes[0].max() < boxes[1].min() and boxes[-1].min() > boxes[1].max()


@pytest.mark.parametrize("name", LARGE_SIGNS)
def test_every_large_sign_is_drawn(name):
    (line,) = written(rf"$\{name} a$")[0].lines
    assert [placed.glyph.letter for placed in line.placed] == [*[""] * LARGE_SIGNS[name][1], "a"]
