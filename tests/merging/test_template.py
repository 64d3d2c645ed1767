"""Letters with gaps: what fills them, and what is refused with the line that is wrong."""

import string
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import InputError
from handout.merging.template import LetterTemplate, escape_markdown, title_name

ROW = {"first_name": "Anna", "gift": "", "birthday": "2026-03-01", "many": "3", "tricky": "*A* {{ gift }} =SUM(A1)"}
HEADERS = {"First name": "Anna"}


def filled(text, language="en-GB", markdown=False, **changed):
    letter = LetterTemplate(text, "letter.txt", markdown=markdown)
    letter.check([*ROW], [*HEADERS], "people.csv")
    return letter.fill(ROW | changed, HEADERS, language)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("Dear {{ first_name }},\nhello", "Dear Anna,\nhello"),
        ('Dear {{ row["First name"] }}', "Dear Anna"),
        ("{% if gift %}\nThanks for {{ gift }}\n{% else %}\nHello\n{% endif %}\nYours", "Hello\nYours"),
        ('{{ gift|default("a present") }}', "a present"),
        ("{{ birthday|date }}", "1 March 2026"),
        ('{{ birthday|date("d. MMMM", language="de") }}', "1. März"),
        ("{% for n in [1, 2] %}{{ n }}{% if not loop.last %}, {% endif %}{% endfor %}", "1, 2"),
        ("{% set next = many|int + 1 %}{{ next }}", "4"),
        ("{{ first_name[0] }}.", "A."),
        ("{% if gift == '' %}none{% endif %}", "none"),
        ("{{ tricky }}", ROW["tricky"]),
        ("{# no comment #}", "{# no comment #}"),
        ("Dear A{% if many %} and B{% endif %}\nwelcome", "Dear A and B\nwelcome"),
        ("Dear A{% if gift %} and B{% endif %}\nwelcome", "Dear A\nwelcome"),
        ("{% if many %}{{ many }}{% endif %}\n\nYours", "3\n\nYours"),
        ("Ada\n{% if gift %}{{ gift }}{% endif %}\n1 Road", "Ada\n1 Road"),
        ("so {## a comment ##}\nmuch\n{## another ##}\nof it", "so \nmuch\nof it"),
    ],
)
def test_gaps_are_filled(text, wanted):
    assert filled(text) == wanted


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a\n{{ firstname }}", "line 2: people.csv has no column 'firstname' .did you mean first_name.*; it has"),
        ("{{ firstname|default('x') }}", "no column 'firstname'"),
        ('{{ row["Frst name"] }}', "no column 'Frst name' .did you mean First name"),
        ("a\nb {{ gift }}", r"line 2: 'gift' is empty: fill it in, or write \{\{ gift\|default"),
        ("{% if true %}\n{{ gift|upper }}\n{% endif %}", "line 2: 'gift' is empty"),
        ("{{ gift < 3 }}", "line 1: 'gift' is empty"),
        ("Hi {{ first_name", "line 1: .* is never closed"),
        ("a\nb\n{% if gift %}c", "line 3: .* is never closed"),
        ("{{ ''.__class__ }}", "line 1: .__class__ cannot be looked up"),
        ("{{ first_name['__class__'] }}", "line 1: a gap would be filled with nothing"),
        ("{{ first_name.upper() }}", "line 1: nothing can be called"),
        ("{% for n in range(10**9) %}x{% endfor %}", "line 1: nothing can be called"),
        ("{% for n in [1] recursive %}{{ loop(n) }}{% endfor %}", "line 1: "),
        ("{{ many * 10**9 }}", "line 1: a letter has gaps, if, for and set, and no pow"),
        ("{{ first_name * 1000000 }}", "line 1: a text . a number cannot be worked out"),
        ("{{ 999999999999 * 999999999999 }}", "a number grows too large"),
        ("{% set a = 'aaaaaaaa' %}" + "{% set a = a + a %}\n" * 40, "line 12: a text grows beyond"),
        ("{% set a = 'a' %}" + "{% set a = a|replace('a', 'aaaaaaaa') %}" * 40, "a text grows beyond"),
        ("{% macro m() %}{% endmacro %}", "no macro"),
        ("{% include 'other.txt' %}", "no include"),
        ("{{ first_name|pprint }}", "there is no filter 'pprint'; there are date, default"),
        ("{{ many / 0 }}{{ many|int / 0 }}", "cannot be worked out"),
        ("{{ many|int / 0 }}", "divided by zero"),
        ("{{ first_name < 3 }}", "a text is taken for a number"),
        ("{{ first_name|date }}", "'Anna' is no date such as 2026-03-01"),
        ("{{ '3/4/2026'|date(language='en') }}", "one date in Britain and another in America"),
        ("{{ " + "(" * 5000 + "1" + ")" * 5000 + " }}", "nested too deeply"),
        ("{% if gift %}" * 3000 + "{% endif %}" * 3000, "nested too deeply"),
        ("x" * 300_000, "no letter is as long"),
    ],
)
def test_what_is_wrong_is_one_sentence_with_its_line(text, words):
    with pytest.raises(InputError, match=words) as refused:
        filled(text)
    assert str(refused.value).startswith("letter.txt")


def test_no_letter_takes_long():
    """Loops within loops, whose turns together are counted, and a cell of ten megabytes."""
    begun = time.process_time()
    loops = "".join("{% for " + name + " in '" + "x" * 200 + "' %}" for name in "abc") + "{% endfor %}" * 3
    with pytest.raises(InputError, match="its loops turn more than 5000 times"):
        filled(loops)
    with pytest.raises(InputError, match="the cell under 'gift' has 10000000 characters, more than 20000"):
        filled("{{ gift }}", gift="x" * 10_000_000)
    with pytest.raises(InputError, match="the letter grows beyond 200000 characters"):
        filled("{% for a in '" + "x" * 4000 + "' %}" + "{{ gift }}" * 100 + "{% endfor %}", gift="x" * 200)
    assert time.process_time() - begun < 2.0


def test_a_date_follows_the_language_of_its_row():
    assert [filled("{{ birthday|date }}", language) for language in ("de", "fr", "en-US", "sv")] == [
        "1. März 2026", "1 mars 2026", "March 1, 2026", "1 mars 2026",
    ]  # fmt: skip
    assert filled("{{ birthday|date }}", "en-US", birthday="3/4/2026") == "March 4, 2026"
    assert filled("{{ birthday|date }}", "en-GB", birthday="3/4/2026") == "3 April 2026"
    with pytest.raises(InputError, match="the language 'Klingon' is no code such as de"):
        filled("{{ birthday|date }}", "Klingon")


@pytest.mark.parametrize(
    ("typed", "wanted"),
    [
        ("ANNA O'BRIEN-SMITH", "Anna O'Brien-Smith"),
        ("anna’s", "Anna’s"),
        ("jean-luc d'aubigné", "Jean-Luc D'Aubigné"),
        ("van der Berg", "van der Berg"),
        ("McDonald", "McDonald"),
    ],
)
def test_names_typed_in_one_case_get_capitals(typed, wanted):
    assert title_name(typed) == wanted


def test_what_is_in_a_cell_is_never_markdown():
    text = filled("{{ tricky }}", markdown=True)
    assert text == "\\*A\\* \\{\\{ gift \\}\\} \\=SUM\\(A1\\)"
    assert filled("**{{ gift }}**", markdown=True, gift="a\n    b") == "**a\\\nb**"


@given(st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=60))
def test_escaped_text_is_what_was_typed(text):
    """Without the backslashes before marks it is the text again, and no mark is without one."""
    made = escape_markdown(text)
    plain, at = "", 0
    while at < len(made):
        at += made[at] == "\\"
        assert made[at - 1] == "\\" or made[at] not in string.punctuation
        plain += made[at]
        at += 1
    assert plain == text.strip()


@given(st.text(max_size=40), st.sampled_from(["{{ %s }}", "{%% if %s %%}", "%s", "{%% for a in %s %%}"]))
def test_whatever_a_letter_holds_it_is_filled_or_refused(text, form):
    try:
        assert isinstance(filled(form % text), str)
    except InputError as refused:
        assert "\n" not in str(refused)


def test_cells_stand_in_formulas_as_numbers_or_words():
    letter = LetterTemplate(r"It is $\frac{ {{ sum }} }{2} + {{ x }}$, {{ sum }}.", "letter", markdown=True)
    assert letter.fill({"sum": "1,250.50", "x": "a$ {b}"}, {}) == (
        r"It is $\frac{ 1,250.50 }{2} + \text{a\$ \{b\}}$, 1\,250\.50."
    )


def test_signs_in_cells_open_no_formula():
    letter = LetterTemplate("{{ a }} and {{ b }}", "letter")
    assert letter.fill({"a": "$x", "b": "y$"}, {}) == r"\$x and y\$"


def test_a_sign_in_a_cell_right_before_a_formula_is_no_letter():
    letter = LetterTemplate("{{ a }}$x + {{ b }}$", "letter")
    assert letter.fill({"a": "$", "b": "c d"}, {}) == r"\$$x + \text{c d}$"
    assert letter.fill({"a": "5", "b": "c d"}, {}) == "5$x + c d$"
