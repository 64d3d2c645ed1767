r"""Formulas read: TeX → a tree, or one sentence that names the place that is wrong.

A ``$`` opens a formula where no space follows it and no letter or digit is before it, and one closes it where no space
is before it and no digit behind: so "$5 and $6" and "5$, 6$" are money.  ``$$ … $$`` is a formula on a line of its own,
and ``\$`` is the sign itself.

Source: Knuth, The TeXbook, 1984; pandoc's manual for the sign (extension tex_math_dollars).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from handout.errors import InputError
from handout.mathematics import signs
from handout.mathematics.formulas import (
    Accent,
    CellGrid,
    Fenced,
    Formula,
    Fraction,
    Gap,
    Large,
    Leaf,
    Node,
    Root,
    Row,
    Scripts,
    is_tall,
    leaves,
)

MOST_NESTED = 24  # levels of groups and brackets: more than anybody writes, and fewer than the interpreter goes down
MOST_LONG = 2_000  # graphemes of one formula; set by eye: more than a page full
_WORD_GAP = 0.8  # x-heights between words of a text in a formula
_THOUSAND = 3  # digits behind a comma that belongs to a number
_FENCES = {  # environments: brackets, sides of columns, and the gap between these, x-heights
    **{"matrix": ("", "", "c", 1.2), "smallmatrix": ("", "", "c", 0.8), "array": ("", "", "c", 1.2)},
    **{"pmatrix": ("(", ")", "c", 1.2), "bmatrix": ("[", "]", "c", 1.2), "Bmatrix": ("{", "}", "c", 1.2)},
    **{"vmatrix": ("|", "|", "c", 1.2), "Vmatrix": ("‖", "‖", "c", 1.2)},
    **{"cases": ("{", "", "l", 1.4), "rcases": ("", "}", "l", 1.4), "gathered": ("", "", "c", 1.2)},
    **dict.fromkeys(("aligned", "align", "align*", "split", "alignedat", "eqnarray"), ("", "", "rl", 1.6)),
    **dict.fromkeys(("equation", "equation*", "gather", "gather*", "displaymath"), ("", "", "c", 1.2)),
}
_OPENING, _CLOSING = frozenset("(["), frozenset(")]")
_SMALL = (("^", "_", "'", "’", "′"), ("limits", "nolimits"))  # what may follow a base: signs, and commands
_GROWING_ONLY = frozenset("⟨⟩⌈⌉⌊⌋‖")  # brackets that no hand has as letters


class WrongFormula(InputError):
    """A formula that cannot be written; at : where, graphemes of the text from 0."""

    def __init__(self, what: str, at: int = 0) -> None:
        super().__init__(what)
        self.at = at


@dataclass(frozen=True)
class _Token:
    """A command (its name without the backslash) or a single character."""

    text: str
    at: int
    command: bool = False

    def __str__(self) -> str:
        return f"\\{self.text}" if self.command else self.text


def find_formulas(units: Sequence[str], *, marked: bool = False) -> Iterator[tuple[int, int, bool]]:
    """Where formulas stand in the characters of a text, delimiters counted, and whether each is displayed.

    marked : whether no sign is money but those behind a backslash.
    """
    at = 0
    while at < len(units):
        if units[at] == "$":
            displayed = "".join(units[at : at + 2]) == "$$"
            end = find_end(units, at, displayed=displayed, marked=marked)
            if end:
                yield at, end, displayed
            at = end or at + displayed + 1
        else:
            at += 2 if "".join(units[at : at + 2]) == "\\$" else 1


def find_end(units: Sequence[str], begin: int, *, displayed: bool, marked: bool = False) -> int:
    """Where what follows a formula begins whose first sign is at `begin`; 0 if none begins there."""
    sign, first = "$$"[: 1 + displayed], begin + 1 + displayed
    at = first
    while at < len(units) and "".join(units[at : at + len(sign)]) != sign:
        if units[at] == "\n" and not displayed:
            return 0
        at += 2 if units[at] == "\\" else 1
    if at >= len(units) or at == first:
        return 0
    end = at + len(sign)
    before, following = "".join(units[max(begin - 1, 0) : begin]), "".join(units[end : end + 1])
    money = units[first].isspace() or units[at - 1].isspace() or following.isdecimal() or following == "$"
    return 0 if (money or before.isalnum()) and not (displayed or marked) else end


def read_formula(units: Sequence[str], begin: int, end: int, displayed: bool) -> Formula:
    """The formula whose delimiters are part of `units[begin:end]`.

    Raises WrongFormula: one sentence without its place, which is `at`.
    """
    wide = 1 + displayed
    source = "".join(units[begin:end])
    if end - begin > MOST_LONG:
        raise WrongFormula(f"it is {end - begin} characters long, and {MOST_LONG} are the most: part it", begin)
    tree = _Reader(list(_tokens(units, begin + wide, end - wide)), end - wide).whole()
    if not any(leaves(tree)):
        raise WrongFormula("it has no letter, digit or sign to write", begin)
    return Formula(tree, source, (begin, end), displayed)


def _tokens(units: Sequence[str], begin: int, end: int) -> Iterator[_Token]:
    at = begin
    while at < end:
        unit, start = units[at], at
        at += 1
        if unit != "\\":
            yield _Token(unit, start)
            continue
        if at >= end:
            raise WrongFormula("a backslash stands at its end", start)
        while at < end and units[at].isascii() and units[at].isalpha():
            at += 1
        at = max(at, start + 2)
        name = "".join(units[start + 1 : at])
        if name in ("align", "gather", "equation") and units[at : at + 1] == ["*"]:
            at += 1
        yield _Token(" " if name.isspace() else name, start, command=True)


@dataclass
class _Reader:
    """Reads the tokens of one formula from left to right; `end` : where it ends, `depth` : of what is being read."""

    tokens: list[_Token]
    end: int
    place: int = 0
    depth: int = 0

    # Tokens

    def _peek(self, *, spaces: bool = False) -> _Token | None:
        while not spaces and self.place < len(self.tokens) and self.tokens[self.place].text.isspace():
            if self.tokens[self.place].command:
                break
            self.place += 1
        return self.tokens[self.place] if self.place < len(self.tokens) else None

    def _take(self, what: str) -> _Token:
        token = self._peek()
        if token is None:
            raise WrongFormula(f"{what} is missing at its end", self.end)
        self.place += 1
        return token

    def _is(self, text: str, *, command: bool = False) -> bool:
        token = self._peek()
        return token is not None and token.text == text and token.command == command

    def _deeper(self, by: int, at: int) -> None:
        self.depth += by
        if self.depth > MOST_NESTED:
            raise WrongFormula(f"it is nested more than {MOST_NESTED} deep: write it in parts", at)

    # Rows

    def whole(self) -> Node:
        """All of the formula."""
        rows = self._cells()
        if (token := self._peek()) is not None:
            closes = "no \\begin is before it" if token.text == "end" else "nothing before it opens it"
            raise WrongFormula(f"{token} closes nothing: {closes}", token.at)
        if len(rows) == 1 and len(rows[0]) == 1:
            return rows[0][0]
        return CellGrid(tuple(rows), "rl", 1.6, meeting=True)

    def _cells(self) -> list[tuple[Node, ...]]:
        """Rows of cells up to what closes them."""
        rows, cells = list[tuple[Node, ...]](), list[Node]()
        while True:
            cells.append(self._row())
            if self._is("&"):
                self.place += 1
                continue
            rows.append(tuple(cells))
            cells = []
            if not (self._is("\\", command=True) or self._is("cr", command=True)):
                break
            self.place += 1
            if self._is("["):  # room below the row, as \\[2pt]
                while self._take("the ] of a distance").text != "]":
                    pass
        if len(rows) > 1 and rows[-1] == (Row(()),):
            rows.pop()
        return rows

    def _row(self, closing: str = "") -> Node:
        """Side by side up to what closes it, which is left to be read."""
        items, opened = list[Node](), list[tuple[int, _Token]]()
        while (token := self._peek()) is not None and not self._ends(token, closing):
            sign, match = bracket(token), -1
            node: Node
            if sign in _CLOSING or sign in ("}", "|"):
                match = _match(opened, sign, len(items))
            if match >= 0:
                self.place += 1
                self.depth -= len(opened) - match
                begin, opening = opened[match]
                body, left, right = Row(tuple(items[begin + 1 :])), bracket(opening), bracket(token)
                node = Fenced(left, (body,), right)
                if not is_tall(body) and left != "|":  # the hand's own do; a bar that leans is a slash
                    ends = _leaf(opening, left, signs.OPENING), _leaf(token, right, signs.CLOSING)
                    node = Row((ends[0], *body.items, ends[1]))
                del items[begin:], opened[match:]
            else:
                if sign in _OPENING or sign in ("{", "|"):
                    opened.append((len(items), token))
                    self._deeper(1, token.at)
                node = self._atom()
            items.append(self._with_scripts(node))
        self.depth -= len(opened)
        return items[0] if len(items) == 1 else Row(tuple(items))

    def _ends(self, token: _Token, closing: str) -> bool:
        if token.command:
            return token.text in ("\\", "cr", "end", "right", "middle") or bracket(token) == closing != ""
        return token.text in ("}", "&") or bracket(token) == closing != ""

    def _group(self, what: str) -> Node:
        """What braces hold, or a single sign."""
        if not self._is("{"):
            token = self._peek()
            if token is None or self._ends(token, "") or token.text in ("^", "_"):
                raise WrongFormula(f"{what} is missing", self.end if token is None else token.at)
            if token.text.isdecimal():  # of \frac12 and x^12 the first digit alone
                self.place += 1
                return _leaf(token, token.text, signs.NUMBER)
            self._deeper(1, token.at)
            node = self._atom()
            self.depth -= 1
            return node
        opening = self._take("{")
        self._deeper(1, opening.at)
        row = self._row()
        if not self._is("}"):
            raise WrongFormula("the brace { is not closed", opening.at)
        self.place += 1
        self.depth -= 1
        return row

    def _with_scripts(self, base: Node) -> Node:
        """A base with what stands small beside it, or above and below."""
        found, primes = dict[str, Node](), 0
        limits = isinstance(base, Large | Leaf) and base.limits
        limits = limits or (isinstance(base, Accent) and base.kind in ("overbrace", "underbrace"))
        while (token := self._peek()) is not None and (token.text in _SMALL[token.command]):
            self.place += 1
            if token.command:
                limits = token.text == "limits"
            elif token.text in "^_":
                which = "exponent" if token.text == "^" else "index"
                if which in found:
                    raise WrongFormula(f"there are two of an {which} at one place: put braces around one", token.at)
                found[which] = self._group(f"the {which} behind {token.text}")
            else:
                primes += 1
        upper = found.get("exponent")
        if primes:
            upper = Row((Large("′", primes, limits=False), *([] if upper is None else [upper])))
        if upper is None and not found:
            return base
        return Scripts(base, found.get("index"), upper, limits)

    # Atoms

    def _atom(self) -> Node:
        token = self._take("a sign")
        if token.command:
            return self._command(token)
        if token.text in "^_":
            self.place -= 1  # of nothing, as in the isotope ^{14}C
            return Row(())
        if token.text == "{":
            self.place -= 1
            return Row((self._group("a group"),))  # so that the comma of 3{,}5 is no punctuation
        if token.text in ("#", "%", "$"):
            raise WrongFormula(f"{token.text} says nothing there: write \\{token.text} for the sign itself", token.at)
        if token.text == "~":
            return Gap(signs.SPACES[" "])
        if token.text.isdecimal():
            return self._number(token)
        for sign, count, limits in signs.LARGE_SIGNS.values():
            if token.text == sign and count == 1:
                return Large(sign, 1, limits)
        if token.text == "|":
            return Large("|", 1, limits=False)
        if token.text in "([":
            return _leaf(token, token.text, signs.OPENING)
        if token.text in ")]":
            return _leaf(token, token.text, signs.CLOSING)
        text = {"-": "–", "*": "·", "'": "’", "l": "ℓ"}.get(token.text, token.text)  # l alone looks like 1
        return _leaf(token, text, signs.kind_of(token.text))

    def _number(self, first: _Token) -> Leaf:
        digits = [first]
        while (token := self._peek(spaces=True)) is not None and not token.command:
            ahead = [t.text if not t.command else "" for t in self.tokens[self.place + 1 : self.place + 5]]
            more = [each.isdecimal() for each in (*ahead, "", "", "", "")]
            point = token.text == "." and more[0]
            comma = token.text == "," and all(more[:_THOUSAND]) and not more[_THOUSAND]
            if not (token.text.isdecimal() or point or comma):
                break
            digits.append(token)
            self.place += 1
        return Leaf(tuple(t.text for t in digits), tuple(t.at for t in digits), signs.NUMBER)

    def _command(self, token: _Token) -> Node:
        name = token.text
        if name in signs.COMMANDS:
            sign, kind = signs.COMMANDS[name]
            return Leaf(tuple(sign), tuple(range(token.at, token.at + len(sign))), kind)
        if name in signs.FUNCTIONS:
            at = tuple(range(token.at + 1, token.at + 1 + len(name)))
            return Leaf(tuple(name), at, signs.WORD, signs.FUNCTIONS[name])
        if name in ("#", "%", "$", "&", "_"):
            return Leaf((name,), (token.at + 1,), signs.ORDINARY)
        if name in signs.LARGE_SIGNS:
            return Large(*signs.LARGE_SIGNS[name])
        if name in signs.SPACES or name in signs.IGNORED:
            return Gap(signs.SPACES.get(name, 0.0))
        if name in signs.ACCENTS:
            return Accent(self._group(f"what \\{name} stands over"), signs.ACCENTS[name])
        if sign := bracket(token):
            if sign in _GROWING_ONLY:
                return self._growing(token, sign)
            return Large("|", 1, limits=False) if sign == "|" else _leaf(token, sign, signs.ORDINARY)
        return self._construct(token)

    def _construct(self, token: _Token) -> Node:
        """Fractions, roots, brackets and tables."""
        name = token.text
        if name in signs.TEXTS:
            return self._text(token)
        if name in signs.FACES or name in ("mathbb", "operatorname"):
            return self._in_face(token)
        if name in ("bmod", "pmod", "mod"):
            return self._modulus(token)
        match name:
            case "frac" | "dfrac" | "tfrac" | "cfrac":
                return Fraction(
                    self._group("the numerator of a fraction"), self._group("the denominator of a fraction")
                )
            case "binom" | "dbinom" | "tbinom":
                above, below = self._group("the upper part of \\binom"), self._group("the lower part of \\binom")
                return Fenced("(", (Fraction(above, below, ruled=False),), ")")
            case "sqrt":
                return self._root(token)
            case "overset" | "stackrel" | "underset" | "xrightarrow" | "xleftarrow":
                return self._stacked(token)
            case "not":
                of = self._group("what \\not strikes through")
                sign = signs.NEGATED.get("".join(of.text)) if isinstance(of, Leaf) else None
                if not isinstance(of, Leaf) or sign is None:
                    raise WrongFormula("\\not stands before nothing that can be struck through", token.at)
                return Leaf((sign,), of.at, signs.RELATION)
            case "left":
                return self._brackets(token)
            case "begin":
                return self._environment(token)
        raise WrongFormula(f"{token} is not known here: write it with other commands, or as \\text{{…}}", token.at)

    def _stacked(self, token: _Token) -> Node:
        """Something with small signs right above or below it."""
        small = self._group(f"what {token} sets above or below")
        if token.text.startswith("x"):
            arrow = _leaf(token, "→" if token.text == "xrightarrow" else "←", signs.RELATION)
            return Scripts(arrow, None, small, limits=True)
        base = self._group(f"what {token} sets it on")
        lower, upper = (small, None) if token.text == "underset" else (None, small)
        return Scripts(base, lower, upper, limits=True)

    def _root(self, token: _Token) -> Node:
        degree = None
        if self._is("["):
            self.place += 1
            self._deeper(1, token.at)
            degree = self._row("]")
            if not self._is("]"):
                raise WrongFormula("the bracket [ of a root's degree is not closed", token.at)
            self.place += 1
            self.depth -= 1
        return Root(self._group("what stands under the root"), degree)

    def _modulus(self, token: _Token) -> Node:
        name = Leaf(
            tuple("mod"), tuple(range(token.at + len(token.text) - 2, token.at + len(token.text) + 1)), signs.WORD
        )
        if token.text != "pmod":
            return name
        body = self._group("the number behind \\pmod")
        left, right = (_leaf(token, "(", signs.OPENING), Leaf((")",), (token.at + 1,), signs.CLOSING))
        return Row((Gap(signs.SPACES[" "]), left, name, body, right))

    def _text(self, token: _Token) -> Node:
        """Words as they are typed, up to the brace that closes them."""
        opening = self._take("the brace { of a text")
        if str(opening) != "{":
            raise WrongFormula(f"{token} lacks its brace {{", opening.at)
        end = next((i for i, unit in enumerate(self.tokens) if i >= self.place and str(unit) == "}"), None)
        if end is None:
            raise WrongFormula(f"the brace of {token} is not closed", opening.at)
        inner = self.tokens[self.place : end]
        if wrong := next((unit for unit in inner if (unit.command and len(unit.text) > 1) or str(unit) == "{"), None):
            raise WrongFormula(f"{wrong} stands in the words of {token}: close its brace before it", wrong.at)
        self.place = end + 1
        items = list[Node]()
        for space, group in groupby(inner, key=lambda unit: unit.text.isspace()):
            own = list(group)
            leaf = Leaf(tuple(u.text for u in own), tuple(u.at + u.command for u in own), signs.ORDINARY)
            items.append(Gap(_WORD_GAP) if space else leaf)
        return Row(tuple(items))

    def _in_face(self, token: _Token) -> Node:
        """Letters in another face: as any letter, those of one word together, and ℝ with its double stroke."""
        begin = self.place
        body = self._group(f"what \\{token.text} is to be")
        own = [each for each in self.tokens[begin : self.place] if each.text not in "{}" and not each.text.isspace()]
        if token.text == "mathbb":
            if len(own) != 1 or own[0].text not in signs.BLACKBOARD:
                raise WrongFormula(f"\\mathbb is known of {', '.join(signs.BLACKBOARD)} alone", token.at)
            return _leaf(own[0], signs.BLACKBOARD[own[0].text], signs.ORDINARY)
        if own and all(each.text.isalpha() and not each.command for each in own):
            kind = signs.WORD if token.text == "operatorname" else signs.ORDINARY
            return Leaf(tuple(each.text for each in own), tuple(each.at for each in own), kind)
        return body

    def _growing(self, token: _Token, sign: str) -> Node:
        """Between brackets that no hand has as letters: they are drawn."""
        closing = signs.PAIRS.get(sign, sign)
        if sign not in signs.PAIRS and sign != "‖":
            raise WrongFormula(f"{token} closes nothing", token.at)
        self._deeper(1, token.at)
        body = self._row(closing)
        if (end := self._peek()) is None or bracket(end) != closing:
            raise WrongFormula(f"{token} is not closed", token.at)
        self.place += 1
        self.depth -= 1
        return Fenced(sign, (body,), closing)

    def _brackets(self, token: _Token) -> Node:
        left = self._bracket(r"the bracket behind \left")
        self._deeper(1, token.at)
        parts = [self._row()]
        while self._is("middle", command=True):
            middle = self._take(r"\middle")
            if self._bracket(r"the bar behind \middle") != "|":
                raise WrongFormula(r"\middle is known of | alone", middle.at)
            parts.append(self._row())
        if not self._is("right", command=True):
            raise WrongFormula(r"\left is not closed by \right", token.at)
        self.place += 1
        self.depth -= 1
        return Fenced(left, tuple(parts), self._bracket(r"the bracket behind \right"))

    def _bracket(self, what: str) -> str:
        token = self._take(what)
        sign = bracket(token)
        if not sign:
            raise WrongFormula(f"{token} is no bracket: {what} is missing", token.at)
        return "" if sign == "." else sign

    def _environment(self, token: _Token) -> Node:
        name = self._name(token)
        if name not in _FENCES:
            known = ", ".join(sorted(each for each in _FENCES if not each.endswith("*")))
            raise WrongFormula(f"\\begin{{{name}}} is not known: there are {known}", token.at)
        left, right, sides, gap = _FENCES[name]
        if name in ("array", "alignedat"):
            columns = self._name(token)
            sides = "".join(side for side in columns if side in "lcr") or sides
        self._deeper(1, token.at)
        rows = self._cells()
        if not self._is("end", command=True):
            raise WrongFormula(f"\\begin{{{name}}} is not closed by \\end{{{name}}}", token.at)
        closing = self._take("\\end")
        other = self._name(closing)
        if other != name:
            raise WrongFormula(f"\\end{{{other}}} closes \\begin{{{name}}}", closing.at)
        self.depth -= 1
        grid = CellGrid(tuple(rows), sides, gap, meeting=sides == "rl" and name != "array")
        return Fenced(left, (grid,), right) if left or right else grid

    def _name(self, token: _Token) -> str:
        """What stands in braces right behind a command."""
        if not self._is("{"):
            raise WrongFormula(f"{token} lacks its name in braces", token.at)
        self.place += 1
        name = ""
        while (unit := self._take("a brace }")).text != "}":
            name += unit.text
        return name


def bracket(token: _Token) -> str:
    """The bracket that a token is, "" for none."""
    return (signs.COMMAND_BRACKETS if token.command else signs.SIGN_BRACKETS).get(token.text, "")


def _match(opened: Sequence[tuple[int, _Token]], sign: str, here: int) -> int:
    """Which of the brackets that are open is closed by a sign, −1 for none; a bar closes a bar, not right behind it."""
    for number in reversed(range(len(opened))):
        left = bracket(opened[number][1])
        if left == "|" != sign:
            continue  # a bar that nothing closes stands between two things
        fits = (left in _OPENING and sign in _CLOSING) or (left + sign) in ("{}", "||")
        return (
            number if fits and not (sign == "|" and (number + 1 < len(opened) or opened[number][0] + 1 == here)) else -1
        )
    return -1


def _leaf(token: _Token, text: str, kind: str) -> Leaf:
    return Leaf((text,), (token.at,), kind)
