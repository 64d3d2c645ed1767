"""What a study shows: real words cut from the pages of a hand, and the same words made in it without their lines."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, repeat
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.hand import file, library
from handout.hand.places import graphemes
from handout.pipeline import hands
from handout.pipeline.options import ReadingOptions, SheetOptions, WritingOptions
from handout.pipeline.results import Listener
from handout.pipeline.texts import draw, prepare, set_parts
from handout.progress import Tell
from handout.scanning.picture_files import read_picture
from handout.tagging.page_sources import filled_sheet
from handout_lab.study.design import Snippet
from handout_lab.study.snippets import WIDEST, LooseLetters, Picture, Run, WrittenWords, on_white, without_lines

if TYPE_CHECKING:
    from handout.hand.scanned import ScannedHand

_PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".pdf", ".bmp", ".webp")
_SMALL = 400  # pixels, wide: two pictures of a page so small are compared
_FORM = 0.02  # by which their heights, in widths, may differ
_SAME = 0.7  # correlation above which they are the same; pages of one writer on one form have under 0.3
_PLACE = "170x70mm", "25mm,10mm"  # a sheet that any snippet fits, and its margins
_REFERENCES = (2, 10)  # lines of a hand that stand above pairs and are nothing else: least, most
_TELLING = 20  # letters that a reference has at least, where there are such; set by eye
_REFERENCE = 160.0  # mm, how wide they may be
_FITTING = 0.8  # of the snippets that are counted on: others are too large for their frame; 13 % were, of four hands
_SHARE = 0.1  # of its lines, between these
_FINEST = 600.0  # dpi of pictures: a pen's line shows nothing finer
_Line = tuple[int, int, int]  # of a hand, a page of it, a line of that
MOST_FOLDS = 4  # each takes a hand that is read, completed and written in by itself


@dataclass(frozen=True, eq=False)
class Material:
    """A hand of a study, and the pages that its real snippets are cut from.

    pages : those of the hand itself, of which only some may be `used`, and then others.
    """

    hand: ScannedHand
    pages: tuple[WrittenWords, ...]
    used: tuple[int, ...]

    def own(self, page: int) -> bool:
        """Whether a page is one of the hand's: its glyphs could be in what is made."""
        return page < len(self.hand.pages)

    def hand_without(self, lines: Collection[tuple[int, int]]) -> ScannedHand:
        """The hand without some lines (page, line), as far as they are on pages of its own."""
        gone = {(page, line) for page, line in lines if self.own(page)}
        return without_lines(self.hand, gone) if gone else self.hand

    def runs(self, widest: float = WIDEST) -> list[Run]:
        """Every snippet that could be cut, up to so many mm wide."""
        return [replace(run, page=number) for number in self.used for run in self.pages[number].runs(widest)]

    @property
    def dpi(self) -> float:
        """Of its pictures."""
        return min(_FINEST, max(words.page.dpi for words in self.pages))


def material(name: str, scans: Path | None, dpi: float | None, listener: Listener) -> Material:
    """A hand with its pages, or with those that are scanned in a folder.

    A scan that is one of the hand's own pages is not read again.

    Raises
    ------
    InputError
        Not a scanned hand; no scans, or nothing says what is written on one.
    """
    hand = file.load(library.scanned_file(name))
    own = tuple(WrittenWords(hand, number) for number in range(len(hand.pages)))
    if scans is None:
        return Material(hand, own, tuple(range(len(own))))
    known, fresh = _told_apart(pictures_in(scans), hand)
    if not fresh:
        return Material(hand, own, tuple(sorted(known)))
    texts = [text for path in fresh if (text := path.with_suffix(".txt")).is_file()]
    read = hands.read(f"{hand.name}, other pages", fresh, texts, options=ReadingOptions(dpi), listener=listener).hand
    others = tuple(WrittenWords(read, number) for number in range(len(read.pages)))
    again = {k for k, words in enumerate(others) if _page_among(words.page.on_paper(), hand) is not None}
    known |= {number for k in again if (number := _page_among(others[k].page.on_paper(), hand)) is not None}
    used = (*sorted(known), *(len(own) + k for k in range(len(others)) if k not in again))
    return Material(hand, (*own, *others), used)


def pictures_in(folder: Path) -> list[Path]:
    """The scans in a folder, by their names; a file is one.

    Raises
    ------
    InputError
        There are none.
    """
    if folder.is_file():
        return [folder]
    try:
        found = sorted(path for path in folder.iterdir() if path.suffix.lower() in _PICTURES)
    except OSError as error:
        raise InputError(f"Cannot read {folder}: {error.strerror or error}.") from error
    if not found:
        raise InputError(f"{folder} holds no scans: put pictures of the pages there.")
    return found


def _told_apart(scans: Sequence[Path], hand: ScannedHand) -> tuple[set[int], list[Path]]:
    """Which pages of the hand some scans are, and the scans that are none of them."""
    known, fresh = set[int](), list[Path]()
    for path in scans:
        picture = None if path.suffix.lower() == ".pdf" else read_picture(path)
        number = None if picture is None else _page_among(picture.rgb, hand)
        if number is not None:
            known.add(number)
            continue
        if picture is not None and not path.with_suffix(".txt").is_file() and filled_sheet(picture) is None:
            raise InputError(
                f"Nothing says what is written on {path}: put its text, line by line, beside it as {path.stem}.txt."
            )
        fresh.append(path)
    return known, fresh


def _page_among(rgb: NDArray[np.uint8], hand: ScannedHand) -> int | None:
    """The page of a hand that a picture is, any way round."""
    for number, page in enumerate(hand.pages):
        shown = page.on_paper()
        for turns in range(4):
            turned = np.rot90(rgb, turns)
            if abs(turned.shape[0] / turned.shape[1] - shown.shape[0] / shown.shape[1]) < 0.02 and _alike(
                turned, shown
            ):
                return number
    return None


def _alike(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> bool:
    import cv2

    size = (_SMALL, round(_SMALL * a.shape[0] / a.shape[1]))
    small = [cv2.resize(x.mean(axis=2, dtype=np.float32), size, interpolation=cv2.INTER_AREA) for x in (a, b)]
    flat = [x - cv2.GaussianBlur(x, (0, 0), 8.0) for x in small]
    return float(np.corrcoef(flat[0].ravel(), flat[1].ravel())[0, 1]) > _SAME


@dataclass(frozen=True, eq=False)
class Parted:
    """Runs of all hands, dealt to folds by their lines.

    folds : of each fold the runs, with the number of their hand; references : the same.
    """

    folds: tuple[tuple[tuple[int, Run], ...], ...]
    references: tuple[tuple[int, Run], ...]

    def kept_out(self, hand: int, fold: int) -> set[tuple[int, int]]:
        """The lines (page, line) that the hand of a fold is made without."""
        return {(run.page, run.line) for k, run in (*self.folds[fold], *self.references) if k == hand}


def parted(materials: Sequence[Material], wanted: int, most: int, rng: np.random.Generator) -> Parted:
    """Lines for references, and the others in folds, so that a person can be shown `wanted` snippets of one fold.

    most : snippets of each hand; lines beyond are left out by chance.

    Where real snippets come from the hand's own pages, what is made for them is made without their lines, and without
    those of all else that the same person sees: each fold has a hand of its own.

    Raises
    ------
    InputError
        Too few snippets.
    """
    by_line = _by_line(materials)
    lines = [list(by_line)[k] for k in rng.permutation(len(by_line))]
    longest = _longest(materials)
    references = set(chain.from_iterable(_reference_lines(lines, longest, k) for k in range(len(materials))))
    lines = _enough([line for line in lines if line not in references], by_line, most)
    count = int(_FITTING * sum(len(by_line[line]) for line in lines))
    inside = any(materials[k].own(page) for k, page, _ in lines)
    number = min(MOST_FOLDS if inside else 1, count // max(1, wanted))
    if number < 1 + inside:
        raise InputError(_too_few(count, wanted, inside))
    folds: list[list[tuple[int, Run]]] = [[] for _ in range(number)]
    for line in lines:
        min(folds, key=len).extend(by_line[line])
    shown = tuple((line[0], run) for line, run in longest.items() if line in references)
    return Parted(tuple(map(tuple, folds)), shown)


def _longest(materials: Sequence[Material]) -> dict[_Line, Run]:
    """Of every line the longest part that may stand as a reference."""
    found = dict[_Line, Run]()
    for k, each in enumerate(materials):
        for run in each.runs(_REFERENCE):
            line = k, run.page, run.line
            found[line] = max(found.get(line, run), run, key=lambda one: len(one.text))
    return found


def _enough(lines: Sequence[_Line], by_line: Mapping[_Line, Sequence[object]], most: int) -> list[_Line]:
    """The first lines of each hand, until they hold so many snippets."""
    held: dict[int, int] = defaultdict(int)
    found = []
    for line in lines:
        if held[line[0]] < most:
            held[line[0]] += len(by_line[line])
            found.append(line)
    return found


def _by_line(materials: Sequence[Material]) -> dict[_Line, list[tuple[int, Run]]]:
    found: dict[_Line, list[tuple[int, Run]]] = defaultdict(list)
    for k, each in enumerate(materials):
        for run in each.runs():
            found[k, run.page, run.line].append((k, run))
    return found


def _reference_lines(lines: Sequence[_Line], longest: Mapping[_Line, Run], hand: int) -> list[_Line]:
    """Those of a hand that are kept for references: lines that show much before those of few letters."""

    def shown(line: _Line) -> int:
        return sum(map(str.isalpha, longest[line].text)) if line in longest else 0

    own = sorted((line for line in lines if line[0] == hand), key=lambda line: -min(shown(line), _TELLING))
    return own[: int(np.clip(round(_SHARE * len(own)), *_REFERENCES))]


def _too_few(count: int, wanted: int, inside: bool) -> str:
    room = count // (1 + inside)
    so = "of which the hand would have to lose all to make the same words" if inside else "which is all that there is"
    half = room // 4 * 2  # even numbers of both kinds
    ask = f"ask less (--singles {half} --pairs {half}) or give " if half else "give "
    return (
        f"The scans hold about {count} snippets, {so}, and each person is to see {wanted}: {ask}more pages, best "
        "such as the hand was not read from (--real)."
    )


@dataclass(frozen=True, eq=False)
class Twin:
    """The same words real and made; `control` in another person's hand, `random` of letters taken by chance."""

    snippet: Snippet
    real: Picture
    made: Picture
    control: Picture | None = None
    random: Picture | None = None


@dataclass(frozen=True, eq=False)
class _Made:
    """Words written in a hand.

    rise : of their line; lent : letters that the hand lacked; doubtful : words that read as others.
    """

    picture: Picture
    rise: float
    lent: str
    doubtful: tuple[str, ...]


def twins(
    materials: Sequence[Material], lots: Parted, control: ScannedHand | None, random: bool, seed: int, tell: Tell
) -> tuple[list[Twin], list[Picture]]:
    """Every run of every fold twice, and the references, which are there once; `random`: of loose letters, too."""
    found = list[Twin]()
    parts = [(fold, k) for fold in range(len(lots.folds)) for k in range(len(materials))]
    for done, (fold, k) in enumerate(parts):
        tell(done / len(parts), f"writing {done + 1}/{len(parts)}")
        runs = [run for number, run in lots.folds[fold] if number == k]
        if runs:
            hand = materials[k].hand_without(lots.kept_out(k, fold))
            loose = LooseLetters(hand) if random else None
            found += _twins(materials[k], runs, hand, (control, loose), (k, fold, seed))
    shown = [materials[k].pages[run.page].picture(run, 0.0, materials[k].dpi) for k, run in lots.references]
    return found, shown


def _twins(
    each: Material,
    runs: Sequence[Run],
    hand: ScannedHand,
    others: tuple[ScannedHand | None, LooseLetters | None],
    numbers: tuple[int, int, int],
) -> Iterator[Twin]:
    """Runs of one fold twice; `numbers` are those of the hand and of the fold, and the seed."""
    (number, fold, seed), (control, loose) = numbers, others
    rng = np.random.default_rng([seed, 9, number, fold])
    sizes, texts = [each.pages[run.page].page.x_height for run in runs], [run.text for run in runs]
    easy: Iterable[_Made | None] = repeat(None)
    if control is not None:
        easy = _made(control, texts, sizes, seed, each.dpi)
    for run, size, ours, other in zip(runs, sizes, _made(hand, texts, sizes, seed, each.dpi), easy, strict=False):
        real = each.pages[run.page].picture(run, ours.rise, each.dpi)
        snippet = Snippet(number, run.page, run.line, run.text, fold, ours.lent, ours.doubtful)
        random = None if loose is None else loose.picture(run.text, size, ours.rise, each.dpi, rng)
        yield Twin(snippet, real, ours.picture, None if other is None else other.picture, random)


def _made(
    hand: ScannedHand, texts: Sequence[str], x_heights: Sequence[float], seed: int, dpi: float
) -> Iterator[_Made]:
    """Texts written in a hand, one after the other, each with x-heights of its own."""
    sheet = SheetOptions(page=_PLACE[0], margin=_PLACE[1])
    task = prepare(WritingOptions(hand=hand, seed=seed, fallback=True), sheet)
    layouts = [replace(task.layout, x_height=x_height) for x_height in x_heights]
    task, pages = set_parts(texts, layouts, task, 0)
    first = 0
    for text, page in zip(texts, pages, strict=True):
        letters = range(first, first + len(graphemes(text)))
        first = letters.stop + 1
        drawing = draw(page.manuscript, task, page.rng, {})
        assert drawing.ink is not None, "a scanned hand writes with ink"
        rgba = np.asarray(drawing.ink(dpi).rgba / 255, dtype=np.float32)
        rgba[:, :, :3] *= rgba[:, :, 3:]
        ends = np.flatnonzero(rgba[:, :, 3].any(axis=0))[[0, -1]].astype(np.float64) * (25.4 / dpi)
        a, b = page.manuscript.lines[0].height_at(ends).tolist()
        about = page.manuscript.about
        lent = dict.fromkeys(
            str(each["letter"]) for each in about.get("borrowed", []) if any(at in letters for at in each["at"])
        )
        doubtful = tuple(str(each["word"]) for each in about.get("doubtful", []))
        picture = on_white(rgba, (a + b) / 2 * dpi / 25.4, dpi)
        yield _Made(picture, float((a - b) / (ends[1] - ends[0])), "".join(lent), doubtful)
