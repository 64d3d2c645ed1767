"""The figure of a study as SVG: panels as in seed 000, figure 14, with the same figures as the table."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence

from handout_lab.study.design import ENVELOPES, PAIRS, SINGLES
from handout_lab.study.scoring import GUESSING, Scores, Share, Skill

_WIDE, _HIGH, _GAP = 250, 170, 62  # of a panel, and between panels; pixels
_FACE = "font-family='Liberation Sans, Arial, sans-serif'"
_BLUE, _RED, _GREY = "#3b6ea8", "#b3261e", "#777777"
_NAMES = {SINGLES: "real or made", PAIRS: "which of two", ENVELOPES: "envelopes"}


def figure(scores: Mapping[str, Scores], difficulty: Mapping[str, Sequence[float]], title: str) -> bytes:
    """The figure.

    Parameters
    ----------
    scores : of the questionnaires that there are.
    difficulty : of those the histogram of snippets, in tenths.
    """
    rows = []
    for kind, each in scores.items():
        panels = [
            _distribution(f"{kind}-1  scores of people: {_NAMES[kind]}", each.skill),
            _shares(f"{kind}-2  told right, by hand", each.hands),
        ]
        if kind in difficulty:
            panels.append(_histogram(f"{kind}-3  snippets, by how many told them", difficulty[kind]))
        if len(each.conditions) > 1:
            panels.append(_shares(f"{kind}-4  told right, by condition", each.conditions))
        rows.append(panels)
    whole = {f"{kind} {_NAMES[kind]}": each.share for kind, each in scores.items()}
    rows.append([_shares("C  all together", whole)])
    across = max(map(len, rows))
    width, height = across * (_WIDE + _GAP) + _GAP, len(rows) * (_HIGH + _GAP) + _GAP + 22
    body = [
        f"<g transform='translate({_GAP + column * (_WIDE + _GAP)},{_GAP + row * (_HIGH + _GAP)})'>{panel}</g>"
        for row, panels in enumerate(rows)
        for column, panel in enumerate(panels)
    ]
    told = (
        "Bars: 95 % intervals for other people and words; thin lines: answers taken as independent. Dashed: guessing."
    )
    return (
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}' width='{width}' height='{height}' "
        f"{_FACE} font-size='11'>\n<rect width='100%' height='100%' fill='white'/>\n"
        f"{_text(_GAP, 26, title, size=15)}\n" + "\n".join(body) + f"\n{_text(_GAP, height - 16, told)}\n</svg>\n"
    ).encode()


def _text(x: float, y: float, text: str, *, size: int = 11, anchor: str = "start", colour: str = "#111111") -> str:
    place = f"x='{x:.1f}' y='{y:.1f}' font-size='{size}' text-anchor='{anchor}' fill='{colour}'"
    return f"<text {place}>{html.escape(text)}</text>"


def _line(x1: float, y1: float, x2: float, y2: float, colour: str = "#111111", more: str = "") -> str:
    return f"<line x1='{x1:.1f}' y1='{y1:.1f}' x2='{x2:.1f}' y2='{y2:.1f}' stroke='{colour}' {more}/>"


def _axes(title: str, up: Sequence[tuple[float, str]], across: Sequence[tuple[float, str]], below: str) -> str:
    """The frame of a panel; places of its marks are shares of its height and width."""
    parts = [_text(0, -10, title, size=12), _line(0, 0, 0, _HIGH), _line(0, _HIGH, _WIDE, _HIGH)]
    for at, word in up:
        parts += [_line(-4, _HIGH * (1 - at), 0, _HIGH * (1 - at)),
                  _text(-7, _HIGH * (1 - at) + 4, word, anchor="end")]  # fmt: skip
    for at, word in across:
        parts.append(_text(_WIDE * at, _HIGH + 15, word, anchor="middle"))
    parts.append(_text(_WIDE / 2, _HIGH + 30, below, anchor="middle", colour=_GREY))
    return "".join(parts)


def _percents(most: float = 1.0) -> list[tuple[float, str]]:
    return [(k / 4, f"{k / 4 * most:.0%}") for k in range(5)]


def _distribution(title: str, skill: Skill) -> str:
    """How many people have how many rows right, and what guessing would give."""
    people = max(1, sum(skill.scores.values()))
    most = max(0.05, *(count / people for count in (*skill.scores.values(), *skill.expected.values())))
    step = _WIDE / (skill.rows + 1)
    every = max(1, (skill.rows + 1) // 6)
    marks = [((k + 0.5) / (skill.rows + 1), str(k)) for k in range(0, skill.rows + 1, every)]
    parts = [_axes(title, _percents(most), marks, f"right of {skill.rows}; {people} people")]
    for k, count in skill.scores.items():
        high = _HIGH * count / people / most
        parts.append(f"<rect x='{(k + 0.1) * step:.1f}' y='{_HIGH - high:.1f}' width='{0.8 * step:.1f}' "
                     f"height='{high:.1f}' fill='{_BLUE}'/>")  # fmt: skip
    points = " ".join(
        f"{(k + 0.5) * step:.1f},{_HIGH * (1 - value / people / most):.1f}" for k, value in skill.expected.items()
    )
    parts.append(f"<polyline points='{points}' fill='none' stroke='{_GREY}' stroke-dasharray='4 3'/>")
    return "".join(parts)


def _shares(title: str, shares: Mapping[str, Share]) -> str:
    """Shares with their intervals."""
    step = _WIDE / max(1, len(shares))
    names = [((k + 0.5) / len(shares), _short(name, step)) for k, name in enumerate(shares)]
    parts = [_axes(title, _percents(), names, "")]
    parts.append(_line(0, _HIGH * (1 - GUESSING), _WIDE, _HIGH * (1 - GUESSING), _GREY, "stroke-dasharray='4 3'"))
    for k, share in enumerate(shares.values()):
        x, y = (k + 0.5) * step, _HIGH * (1 - share.share)
        parts.append(_line(x, _HIGH * (1 - share.both[0]), x, _HIGH * (1 - share.both[1]), _RED, "stroke-width='7'"))
        parts.append(_line(x, _HIGH * (1 - share.exact[0]), x, _HIGH * (1 - share.exact[1]), "#111111"))
        parts.append(f"<circle cx='{x:.1f}' cy='{y:.1f}' r='4' fill='white' stroke='#111111'/>")
        parts.append(_text(x + 9, y + 4, f"{share.share:.1%}"))
    return "".join(parts)


def _short(name: str, room: float) -> str:
    """A name as it fits: a letter takes about 6 pixels."""
    most = max(3, int(room / 6))
    return name if len(name) <= most else name[: most - 1] + "…"


def _histogram(title: str, shares: Sequence[float]) -> str:
    """Shares of the snippets by tenths of the people who told them."""
    most = max(0.05, *shares)
    step = _WIDE / len(shares)
    marks = [(k / 4, f"{k / 4:.0%}") for k in range(5)]
    bars = [
        f"<rect x='{(k + 0.08) * step:.1f}' y='{_HIGH * (1 - share / most):.1f}' width='{0.84 * step:.1f}' "
        f"height='{_HIGH * share / most:.1f}' fill='{_BLUE}'/>"
        for k, share in enumerate(shares)
    ]
    return _axes(title, _percents(most), marks, "of the answers right") + "".join(bars)
