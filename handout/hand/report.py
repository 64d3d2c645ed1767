"""What a scanned hand has, in numbers: for `handout hand check`."""

from __future__ import annotations

from typing import Any

from handout.hand.places import PLACES
from handout.hand.scanned import DOUBTFUL, ScannedHand

LEAST = 8  # instances of a letter that let the choice vary (seed 000, §6.2.1)


def facts(hand: ScannedHand) -> dict[str, Any]:
    """Plain lists and numbers: pages, letters by place, which of them are few, which worth a look.

    Places are pixels of the scan, pages are numbered from 0 as in corrections.
    """
    return {
        "name": hand.name,
        "title": hand.title,
        "glyphs": len(hand.glyphs),
        "joined": sum(bool(glyph.ligatures) for glyph in hand.glyphs),
        "unnamed": sum(not glyph.letter for glyph in hand.glyphs),
        "pages": [_page(hand, number) for number in range(len(hand.pages))],
        "letters": [_letter(hand, letter) for letter in hand.letters],
        "short": [letter for letter, count in hand.letters.items() if count < LEAST],
        "least": LEAST,
        "doubtful": [_doubted(hand, number) for number in doubtful(hand)],
    }


def doubtful(hand: ScannedHand) -> list[int]:
    """Numbers of the glyphs worth a look, the least certain first."""
    low = [i for i, glyph in enumerate(hand.glyphs) if glyph.confidence < DOUBTFUL or not glyph.letter]
    return sorted(low, key=lambda i: (hand.glyphs[i].confidence, i))


def table(hand: ScannedHand) -> str:
    """The letters as plain text; * marks what there is little of."""
    rows = [f"{'':2}{'':8}" + "".join(f"{place:>7}" for place in (*PLACES, "total"))]
    for letter, count in hand.letters.items():
        counts = [hand.instances[letter, place] for place in PLACES]
        rows.append(f"{'*' if count < LEAST else ' '} {letter:<8}" + "".join(f"{n:7d}" for n in (*counts, count)))
    return "\n".join(rows)


def _page(hand: ScannedHand, number: int) -> dict[str, Any]:
    page = hand.pages[number]
    return {
        "source": page.source,
        "dpi": round(page.dpi, 1),
        "pen": page.pen,
        "lines": len(page.baselines),
        "glyphs": sum(glyph.page == number for glyph in hand.glyphs),
        "x_height_mm": round(page.x_height, 2),
        "pitch_mm": round(page.pitch, 2),
        "slant": round(page.slant, 3),
    }


def _letter(hand: ScannedHand, letter: str) -> dict[str, Any]:
    return {"letter": letter, **{p: hand.instances[letter, p] for p in PLACES}, "total": hand.letters[letter]}


def _doubted(hand: ScannedHand, number: int) -> dict[str, Any]:
    glyph = hand.glyphs[number]
    middle = hand.pages[glyph.page].graph.uv[glyph.vertices[len(glyph.vertices) // 2]]
    return {
        "letter": glyph.letter,
        "page": glyph.page,
        "line": glyph.line,
        "at": [round(float(v), 1) for v in middle],
        "confidence": round(glyph.confidence, 2),
    }
