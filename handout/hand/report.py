"""A scanned hand to look at: its letters in numbers and side by side, its pages with what was found on them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.hand.places import PLACES
from handout.hand.scanned import ScannedHand, ScannedPage
from handout.hand.vetting import vet
from handout.libraries import cv2

LEAST = 8  # instances of a letter that let the choice vary (seed 000, §6.2.1)


def facts(hand: ScannedHand) -> dict[str, Any]:
    """Plain lists and numbers: pages, letters by place, rare letters, and letters worth a look.

    Places are pixels of the scan, pages are numbered from 0 as in corrections.
    """
    return {
        "name": hand.name,
        "title": hand.title,
        "glyphs": len(hand.glyphs),
        "joined": sum(bool(glyph.ligatures) for glyph in hand.glyphs),
        "unnamed": sum(not glyph.letter for glyph in hand.glyphs),
        "pages": [_page(hand, number) for number in range(len(hand.pages))],
        "letters": [
            {"letter": letter, **{p: hand.instances[letter, p] for p in PLACES}, "total": hand.letters[letter]}
            for letter in hand.letters
        ],
        "short": [letter for letter, count in hand.letters.items() if count < LEAST],
        "least": LEAST,
        "kept_out": sum(glyph.kept_out for glyph in hand.glyphs),
        "doubtful": [_describe_doubt(hand, number) for number in doubtful(hand)],
        "write_again": {letter: sure for letter, sure in sure_letters(hand).items() if sure < LEAST},
    }


def doubtful(hand: ScannedHand) -> list[int]:
    """Numbers of the glyphs that may not be what they are called, the least probable first."""
    return [int(number) for number in vet(hand).worst_first]


def sure_letters(hand: ScannedHand) -> dict[str, int]:
    """Letter → how many of its glyphs are sure, the fewest first."""
    each = zip(hand.glyphs, vet(hand).sure.tolist(), strict=True)
    sure = Counter(glyph.letter for glyph, good in each if good and not glyph.kept_out)
    return dict(sorted(((letter, sure[letter]) for letter in hand.letters), key=itemgetter(1, 0)))


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


def _describe_doubt(hand: ScannedHand, number: int) -> dict[str, Any]:
    glyph = hand.glyphs[number]
    middle = hand.pages[glyph.page].graph.uv[glyph.vertices[len(glyph.vertices) // 2]]
    return {
        "letter": glyph.letter,
        "page": glyph.page,
        "line": glyph.line,
        "at": [round(float(v), 1) for v in middle],
        "confidence": round(glyph.confidence, 2),
        "probability": round(float(vet(hand).probability[number]), 2),
        "verdict": vet(hand).verdict(number),
    }


Pixels = NDArray[np.uint8]

_SURE = ((32, 96, 208), (16, 128, 96))  # of every other letter
_DOUBTED, _LOST, _UNNAMED = (232, 128, 0), (208, 24, 24), (176, 32, 176)
_WAY, _NOBODY = (120, 120, 120), (190, 190, 190)
_UP = 1.35  # x-heights over the baseline where names are written, or over the letter if that is higher
_PALE = 0.35  # of the ink that is kept under the lines
UNIT = 26  # pixels of an x-height on a contact sheet
_WIDE, _MARGIN, _NAME, _GAP = 1600, 20, 70, 10  # pixels of a contact sheet


def overlay(hand: ScannedHand, page: int) -> Pixels:
    """A page with every letter that was found on it.

    Its pixels are those of the scan, so that places can be read off for corrections.

    Returns (h, w, 3) uint8: letters in blue and green by turns, in orange where doubtful, in red where refused; unnamed
    ones in purple, ligatures and what belongs to no letter in grey; over each letter its name.
    """
    from PIL import Image, ImageDraw, ImageFont

    sheet = hand.pages[page]
    picture = sheet.on_paper(_PALE)
    here = [i for i, glyph in enumerate(hand.glyphs) if glyph.page == page]
    _dots(picture, sheet, np.arange(len(sheet.graph)), _NOBODY)
    for i in here:
        _dots(picture, sheet, hand.body(i), _colour(hand, i))
        for way in hand.glyphs[i].ligatures:
            _dots(picture, sheet, way.path[1:-1], _WAY)
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    for i in here:
        up = max(_UP * sheet.x_height / sheet.pitch, float(hand.outline(i)[:, 1].max()) + 0.05)
        x, y = sheet.to_picture(hand.glyphs[i].line, [hand.centre(i)[0], up])[0].tolist()
        font = ImageFont.load_default(max(10.0, 0.55 * sheet.x_height / sheet.pixel))
        draw.text((x, y), hand.glyphs[i].letter or "?", fill=_colour(hand, i), font=font, anchor="mb")
    return np.asarray(image)


def _colour(hand: ScannedHand, number: int) -> tuple[int, int, int]:
    glyph = hand.glyphs[number]
    if not glyph.letter:
        return _UNNAMED
    verdict = vet(hand).verdict(number)
    return _LOST if verdict == "refused" else _DOUBTED if verdict == "doubtful" else _SURE[number % 2]


def _dots(picture: Pixels, page: ScannedPage, vertices: NDArray[np.intp], colour: tuple[int, int, int]) -> None:
    x, y = np.rint(page.graph.uv[vertices]).astype(np.intp).T
    height, width = picture.shape[:2]
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        picture[np.clip(y + dy, 0, height - 1), np.clip(x + dx, 0, width - 1)] = colour


def cutout(hand: ScannedHand, number: int) -> tuple[Pixels, tuple[int, int]]:
    """The ink of one glyph. Returns (h, w, 4) uint8, and (x, y) of its first pixel in the picture of its page."""
    glyph, page = hand.glyphs[number], hand.pages[hand.glyphs[number].page]
    uv, radius = page.graph.uv[glyph.vertices], page.graph.radius[glyph.vertices] / page.pixel + 1.5
    low = np.floor((uv - radius[:, None]).min(axis=0)).astype(int)
    high = np.ceil((uv + radius[:, None]).max(axis=0)).astype(int) + 1
    corner = np.array(page.texture.corner)
    low, high = np.maximum(low, corner), np.minimum(high, corner + page.texture.shape[::-1])
    mask = np.zeros(np.maximum(high - low, 1)[::-1], dtype=np.uint8)
    for (x, y), r in zip(np.rint(uv - low).astype(int).tolist(), np.ceil(radius).astype(int).tolist(), strict=True):
        cv2.circle(mask, (x, y), r, 255, -1)
    (x0, y0), (x1, y1) = low - corner, high - corner
    ink = page.texture.rgba[y0:y1, x0:x1].copy()
    ink[mask[: ink.shape[0], : ink.shape[1]] == 0] = 0
    return ink, (int(low[0]), int(low[1]))


def contact_sheet(hand: ScannedHand, most: int = 24) -> Pixels:
    """(h, w, 3) uint8: the letters of a hand in rows, at most so many of each, all on one baseline and of one size."""
    from PIL import Image, ImageDraw, ImageFont

    rows = [row for letter in sorted(hand.letters) for row in _rows(hand, letter, most)]
    high = round(UNIT * 4.2)
    picture = np.full((2 * _MARGIN + high * max(1, len(rows)), _WIDE, 3), 255, dtype=np.uint8)
    for number, (_, cells) in enumerate(rows):
        base = _MARGIN + number * high + round(UNIT * 2.7)
        x = _MARGIN + _NAME
        for cell, up in cells:
            lay(picture, cell, x, base - up)
            x += cell.shape[1] + _GAP
    image = Image.fromarray(picture)
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(26.0)
    for number, (name, _) in enumerate(rows):
        place = (_MARGIN, _MARGIN + number * high + round(UNIT * 2.7))
        draw.text(place, name, fill=(150, 0, 0), font=font, anchor="ls")
    return np.asarray(image)


def _rows(hand: ScannedHand, letter: str, most: int) -> Iterable[tuple[str, list[tuple[Pixels, int]]]]:
    """(name and count, or "" where a letter goes on; pictures with their height over the baseline)."""
    numbers = sorted(hand.numbers_of_letter(letter).tolist(), key=lambda i: -vet(hand).probability[i])[:most]
    name, cells, wide = f"{letter} {len(hand.numbers_of_letter(letter))}", list[tuple[Pixels, int]](), 0
    for number in numbers:
        cell = cell_of(hand, number)
        if cells and wide + cell[0].shape[1] + _GAP > _WIDE - 2 * _MARGIN - _NAME:
            yield name, cells
            name, cells, wide = "", [], 0
        cells.append(cell)
        wide += cell[0].shape[1] + _GAP
    yield name, cells


def cell_of(hand: ScannedHand, number: int) -> tuple[Pixels, int]:
    """A glyph on white, its x-height `UNIT` pixels, and how many pixels its upper edge is over the baseline."""
    glyph, page = hand.glyphs[number], hand.pages[hand.glyphs[number].page]
    ink, (x, y) = cutout(hand, number)
    scale = UNIT * page.pixel / page.x_height
    part = ink[:, :, 3:].astype(np.float32) / 255
    white = np.rint(255 * (1 - part) + ink[:, :, :3] * part).astype(np.uint8)
    size = (max(1, round(white.shape[1] * scale)), max(1, round(white.shape[0] * scale)))
    scaled = np.asarray(cv2.resize(white, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    up = (float(page.base(glyph.line, x + ink.shape[1] / 2)) - y) * scale
    return scaled, round(up)


def lay(picture: Pixels, cell: Pixels, x: int, y: int) -> None:
    """Darken a picture by another, whose first pixel comes to (x, y)."""
    top, left = max(y, 0), max(x, 0)
    under = picture[top : max(y + cell.shape[0], 0), left : x + cell.shape[1]]
    under[:] = np.minimum(under, cell[top - y :, left - x :][: under.shape[0], : under.shape[1]])


_CELL = 150, 118  # pixels of a glyph in its word, width and height
_BASE = 78  # pixels from the upper edge of such a picture to the baseline


def in_its_word(hand: ScannedHand, number: int, page: Pixels) -> Pixels:
    """(h, w, 3): a glyph in the colour of its verdict, what stands around it pale."""
    glyph, sheet = hand.glyphs[number], hand.pages[hand.glyphs[number].page]
    scale = UNIT * sheet.pixel / sheet.x_height
    middle = hand.centre(number)[0] * sheet.unit
    move = np.array([_CELL[0] / 2 - scale * middle, _BASE - scale * float(sheet.base(glyph.line, middle))])
    way = np.column_stack([np.eye(2) * scale, move])
    ink, corner = cutout(hand, number)
    own = np.zeros(page.shape[:2], dtype=np.float32)
    own[corner[1] : corner[1] + ink.shape[0], corner[0] : corner[0] + ink.shape[1]] = ink[:, :, 3] / 255
    around, part = (
        np.asarray(cv2.warpAffine(each, way, _CELL, flags=cv2.INTER_LINEAR, borderValue=edge))
        for each, edge in ((page, (255, 255, 255)), (own, 0))
    )
    pale = 255 - _PALE * (255.0 - around)
    mixed = pale * (1 - part[:, :, None]) + np.array(_colour(hand, number)) * part[:, :, None]
    return np.clip(np.rint(mixed), 0, 255).astype(np.uint8)
