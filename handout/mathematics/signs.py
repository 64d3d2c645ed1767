r"""What the commands of TeX mean: the character that is written for each, and how it stands to its neighbours.

Source: the names are those of plain TeX (Knuth, The TeXbook, 1984, appendix F), LaTeX and amsmath.
"""

from __future__ import annotations

ORDINARY, NUMBER, WORD, BINARY, RELATION = "ordinary", "number", "word", "binary", "relation"
PUNCTUATION, OPENING, CLOSING, LARGE = "punctuation", "opening", "closing", "large"

_GREEK = (
    "alpha α beta β gamma γ delta δ epsilon ε varepsilon ε zeta ζ eta η theta θ vartheta θ iota ι kappa κ lambda λ "
    "mu μ nu ν xi ξ pi π varpi π rho ρ varrho ρ sigma σ varsigma ς tau τ upsilon υ phi φ varphi φ chi χ psi ψ omega ω "
    "Gamma Γ Delta Δ Theta Θ Lambda Λ Xi Ξ Pi Π Sigma Σ Upsilon Υ Phi Φ Psi Ψ Omega Ω"
)
_ORDINARY = (
    "infty ∞ partial ∂ nabla ∇ emptyset ∅ varnothing ∅ forall ∀ exists ∃ neg ¬ lnot ¬ ell ℓ hbar ħ Re Re Im Im "
    "angle ∠ triangle △ degree ° ldots … dots … cdots ⋯ vdots ⋮ ddots ⋱ backslash \\ top ⊤ "
    "bot ⊥ dag † square □ Box □ checkmark ✓ pounds £ euro € S §"
)
_BINARY = (
    "pm ± mp ∓ times × div ÷ cdot · ast * star * circ ∘ bullet • cap ∩ cup ∪ setminus \\ wedge ∧ land ∧ vee ∨ lor ∨ "
    "oplus ⊕ otimes ⊗"
)
_RELATIONS = (
    "leq ≤ le ≤ leqslant ≤ geq ≥ ge ≥ geqslant ≥ neq ≠ ne ≠ equiv ≡ approx ≈ cong ≅ sim ∼ simeq ≃ propto ∝ ll ≪ gg ≫ "
    "in ∈ notin ∉ ni ∋ subset ⊂ supset ⊃ subseteq ⊆ supseteq ⊇ perp ⊥ parallel ∥ lt < gt > to → rightarrow → "
    "longrightarrow → leftarrow ← gets ← leftrightarrow ↔ Rightarrow ⇒ implies ⇒ Leftarrow ⇐ Leftrightarrow ⇔ iff ⇔ "
    "mapsto ↦ uparrow ↑ downarrow ↓ rightleftharpoons ⇌ therefore ∴ because ∵ colon : vdash ⊢ models ⊨"
)
_FUNCTIONS = (
    "sin cos tan cot sec csc arcsin arccos arctan sinh cosh tanh coth ln log lg exp lim limsup liminf max min sup inf "
    "det dim ker deg gcd arg Pr hom"
)
_WITH_LIMITS = frozenset(["lim", "limsup", "liminf", "max", "min", "sup", "inf", "det", "gcd", "Pr"])
# big signs that are drawn as high as their place asks: the sign, how often, and whether limits stand below and above
LARGE_SIGNS = {
    "sum": ("∑", 1, True),
    "prod": ("∏", 1, True),
    "coprod": ("∐", 1, True),
    "bigcup": ("⋃", 1, True),
    "bigcap": ("⋂", 1, True),
    "int": ("∫", 1, False),
    "iint": ("∫", 2, False),
    "iiint": ("∫", 3, False),
    "oint": ("∮", 1, False),
}
# what may stand for a bracket that grows: single signs, and commands; "." for one that is not drawn
SIGN_BRACKETS = {**{sign: sign for sign in "()[]|/."}, "<": "⟨", ">": "⟩"}
COMMAND_BRACKETS = {
    **dict(zip(("{", "}", "|", "lbrace", "rbrace", "langle", "rangle"), "{}‖{}⟨⟩", strict=True)),
    **dict(zip(("lvert", "rvert", "vert", "mid", "lVert", "rVert", "Vert"), "||||‖‖‖", strict=True)),
    **dict(zip(("lceil", "rceil", "lfloor", "rfloor", "lbrack", "rbrack"), "⌈⌉⌊⌋[]", strict=True)),
}
PAIRS = {"(": ")", "[": "]", "{": "}", "⟨": "⟩", "⌈": "⌉", "⌊": "⌋"}
SPACES = {  # x-heights
    **{",": 0.3, ":": 0.4, ">": 0.4, ";": 0.5, " ": 0.6, "!": -0.1, "quad": 1.6, "qquad": 3.2},
    **{"enspace": 0.8, "thinspace": 0.3, "space": 0.6},
}
ACCENTS = {
    **{"hat": "hat", "widehat": "hat", "bar": "bar", "overline": "bar", "vec": "vec", "overrightarrow": "vec"},
    **{"dot": "dot", "ddot": "ddot", "tilde": "tilde", "widetilde": "tilde", "underline": "under"},
    **{"overbrace": "overbrace", "underbrace": "underbrace", "boxed": "box", "cancel": "cancel"},
}
# letters in another face are written as any letter, but for those that people double a stroke of
FACES = frozenset(
    ("mathrm", "mathbf", "mathit", "mathsf", "mathcal", "boldsymbol", "bm", "mathscr", "mathfrak", "mathnormal")
)
BLACKBOARD = dict(zip("NZQRCPE", "ℕℤℚℝℂℙ𝔼", strict=True))
TEXTS = frozenset(["text", "textrm", "textbf", "textit", "mbox", "textsf", "textnormal"])
# how large TeX sets something, or in which face: people write what it asks as large as it is
IGNORED = frozenset(
    (
        *(
            "displaystyle",
            "textstyle",
            "scriptstyle",
            "nonumber",
            "notag",
            "big",
            "Big",
            "bigg",
            "Bigg",
            "bigl",
            "bigr",
        ),
        *("Bigl", "Bigr", "biggl", "biggr", "Biggl", "Biggr", "rm", "bf", "it", "strut", "mathstrut"),
    )
)
NEGATED = {"=": "≠", "∈": "∉", "≡": "≢", "<": "≮", ">": "≯", "⊂": "⊄", "∃": "∄"}


def _pairs(names: str, kind: str) -> dict[str, tuple[str, str]]:
    words = names.split()
    return dict(zip(words[::2], ((sign, kind) for sign in words[1::2]), strict=True))


# name of a command → what is written, and its kind
COMMANDS = {
    **_pairs(_GREEK, ORDINARY),
    **_pairs(_ORDINARY, ORDINARY),
    **_pairs(_BINARY, BINARY),
    **_pairs(_RELATIONS, RELATION),
}
FUNCTIONS = {name: name in _WITH_LIMITS for name in _FUNCTIONS.split()}
_KINDS = {
    **dict.fromkeys("+-–−*×÷·±∓∩∪∧∨∘⊕⊗", BINARY),
    **dict.fromkeys("=<>≤≥≠≈≡∼~≅∝∈∉⊂⊆⊃⊇→←↔⇒⇐⇔↦:≪≫⊥∥∴|", RELATION),
    **dict.fromkeys(",;", PUNCTUATION),
}


def kind_of(sign: str) -> str:
    """How a character stands to its neighbours."""
    return NUMBER if sign.isdecimal() else _KINDS.get(sign, ORDINARY)
