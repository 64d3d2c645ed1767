"""Characters that a pen writes alike, and what may stand for one that a hand lacks."""

from __future__ import annotations

import regex

# Characters that look the same when written by hand; "" is not written at all
SAME = str.maketrans(
    {
        "\t": "    ",
        "\u00ad": "",
        "\u200b": "",
        "\u200c": "",
        "\u200d": "",
        "\u2060": "",
        "\ufeff": "",
        "\u2010": "-",
        "\u2011": "-",
        "\u2012": "–",
        "\u2015": "—",
        "\u2212": "–",
        "\u2032": "’",
        "\u2033": "”",
        "\u02bc": "’",
        "\u2024": ".",
        "\u2044": "/",
        "\u037e": ";",
        "ﬀ": "ff",
        "ﬁ": "fi",
        "ﬂ": "fl",
        "ﬃ": "ffi",
        "ﬄ": "ffl",
        "\u0133": "ij",
        "\u0132": "IJ",
        "ŉ": "’n",
        "ǆ": "dž",
        "ǅ": "Dž",
        "Ǆ": "DŽ",
        "ǉ": "lj",
        "ǈ": "Lj",
        "Ǉ": "LJ",
        "ǌ": "nj",
        "ǋ": "Nj",
        "Ǌ": "NJ",
        "\ufe0e": "",
        "\ufe0f": "",
        "\u1e9e": "SS",
        "\u212b": "Å",
        "\u2126": "Ω",
        "\u00b4": "’",
        "º": "°",
    }
)
# what a pen writes alike; a scanned hand has them as its transcript was typed
ALIKE = {
    "'": "’‘",
    "’": "'‘",
    "‘": "'’",
    '"': ("”", "“", "''"),
    "“": ('"', "”"),
    "”": ('"', "“"),
    "–": "-—",
    "—": "–-",
    "-": "–",
    "…": ("...",),
    "ŀ": ("l·",),
    "Ŀ": ("L·",),
    "●": "•",
    "∙": "·",
    "⋅": "·",
    "♥": "❤",
    "✔": "✓",
    "✘": "✗",
    "✕": "✗",
    "✖": "✗",
    "⭐": "★",
    "🙂": "☺",
    "☏": "☎",
    "✆": "☎",
    "➔": "→",
    "➜": "→",
    "➡": "→",
    "⬅": "←",
    "⬆": "↑",
    "⬇": "↓",
    "⩽": "≤",
    "⩾": "≥",
}
# without U+00A0, U+2007 and U+202F, at which a line must not break
SPACES = str.maketrans(
    dict.fromkeys("\u1680\u2000\u2001\u2002\u2003\u2004\u2005\u2006\u2008\u2009\u200a\u205f\u3000", " ")
)
NEWLINES = regex.compile(r"\r\n|[\r\v\f\x85\u2028\u2029]")
# what may stand for a character when the user accepts similar forms, besides letters without their marks
SIMILAR = {
    **dict(zip("đĐħĦŧŦłŁıŋŊĸſəƏ", "dDhHtTlLinNkseE", strict=True)),
    "™": "TM",
    "©": "(c)",
    "®": "(R)",
    "№": "No",
    "•": "·",
    "→": "->",
    "←": "<-",
    "≤": "<=",
    "≥": ">=",
    "≈": "~",
    "±": "+/-",
    "✓": "v",
    "✗": "x",
    "★": "*",
    "☐": "[]",
}
# pictures and signs that a text can do without
PICTURE = regex.compile(r"\A\P{L}*[\p{Extended_Pictographic}\p{Emoji_Modifier}\p{Regional_Indicator}\u20e3]")
