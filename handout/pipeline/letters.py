"""A letter file in its hands, on pages, in files: the head and the options are checked, its runs set, its pages drawn.

A page is a function of the letter, the options, the seed and the row: `draw_letter` gives the same for the same.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from handout.completion.completed_hand import complete_hand
from handout.errors import InputError, MissingCharacters
from handout.hand.measures import ink_colours
from handout.inking.mixing import mix_inks, paste_pictures, recolour_ink
from handout.letters.document import LetterFile, LetterHead, PictureRoom, Signature, blocks_in
from handout.letters.rows import LetterSetting
from handout.letters.runs import Runs, WriterOptions, lines_of, runs_of, write_runs
from handout.letters.setting import LetterPage, set_letter
from handout.motion.timing import time_in_air
from handout.page_sizes import margins
from handout.pipeline import texts
from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions
from handout.pipeline.results import Facts
from handout.pipeline.signatures import find_signature, placed_signature, size
from handout.pipeline.texts import INK, Pages, WritingTask, draw, letter_facts, prepare
from handout.progress import Tell, silent
from handout.values import Drawing, Line, Placed, Raster, Stroke
from handout.writing.choosing import Rewrites
from handout.writing.layout import Layout

if TYPE_CHECKING:
    from handout.hand.drawn import Hand
    from handout.hand.scanned import ScannedHand
    from handout.pipeline.rereading import Doubt, Rereader
    from handout.writing.text import Borrowed

_PDF_DPI = 300.0  # pixels an inch of a letterhead in PDF, as PNG files have
_SET = 0.5  # of the work on a letter before it is drawn, as of a text
Options = TypeVar("Options", WritingOptions, SheetOptions, PictureOptions)
_PAGE = 250  # characters: no page of a letter holds fewer, but for its pictures
_FILES = ("hand", "paper", "pen")  # of these, such as may name a file beside the letter


@dataclass(frozen=True)
class LetterDocument:
    """A letter with its options, checked (a `pipeline.writing.Document`).

    tasks : of each of its hands by the names in the letter, "" for that of the letter.
    first, following : layouts of the first page and the others.
    """

    letter: LetterFile
    tasks: Mapping[str, WritingTask]
    first: Layout
    following: Layout
    timed: bool = True

    def background(self, page: int) -> Path | None:
        """The file that previews show behind the writing of a page, numbered from 1."""
        head = self.letter.head
        own = (head.first if page == 1 else head.following).background
        name = head.background if own is None else own
        return None if name in (None, "none") else self.letter.folder / str(name)

    @property
    def name(self) -> str:
        """Of its file."""
        return self.letter.name

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on what of the source is not written."""
        return self.letter.dropped

    @property
    def inks(self) -> tuple[str, ...]:
        """The inks that it names besides its own."""
        spans = (span for paragraph in self.letter.paragraphs for span in paragraph.spans)
        return tuple(sorted({span.manner.ink for span in spans} - {""}))

    @property
    def task(self) -> WritingTask:
        """The task of the letter's own hand, whose scanned ink takes the colour that is asked for."""
        main = self.tasks[""]
        return replace(main, picture=replace(main.picture, ink=None))

    def draw(self, wanted: frozenset[str] = INK, row: int | None = None, tell: Tell = silent) -> Pages:
        """The pages of the letter, as those of a text; see `TextDocument.draw`.

        Raises InputError, MissingCharacters, DoesNotFit: the message has the line of the letter.
        """
        tell(0.0, "setting the letter")
        hands, pages = _set_pages(self, row)
        about = {"title": texts.title(self.letter.text), "pages": len(pages)} | ({} if row is None else {"row": row})
        at, shown = self.task.layout.at, [*enumerate(pages, 1)]
        if at is not None and len(pages) > 1:
            shown = [shown[_find_page(self.letter, pages, at)]]
        drawings = []
        for count, (number, page) in enumerate(shown):
            tell(_SET + (1 - _SET) * count / len(shown), f"writing {number}/{len(pages)}")
            drawings.append(_draw_page(page, self, hands, {**about, "page_number": number}, wanted))
        one = shown[0][0] if len(shown) < len(pages) else None
        return Pages([page.whole for _, page in shown], drawings, partial(_word_places, self, shown), one)

    def check(self, row: int | None = None) -> None:
        """Set the pages and draw none; raises as `draw` does."""
        _set_pages(self, row)


def prepare_letter(
    letter: LetterFile,
    writing: WritingOptions = WritingOptions(),
    sheet: SheetOptions = SheetOptions(),
    picture: PictureOptions = PictureOptions(),
    given: Collection[str] | None = None,
) -> LetterDocument:
    """Check a letter's head and the options, and load its hands.

    given : the options by their names that are wanted whatever the head says; None: those that are not as usual.

    Raises InputError: an option is wrong, or a hand is missing.
    """
    own_margins = not _is_given("margin", sheet, given)
    writing, sheet, picture = (
        _apply_head(letter, writing, given),
        _apply_head(letter, sheet, given),
        _apply_head(letter, picture, given),
    )
    tasks = {"": prepare(writing, sheet, picture)}
    writing = replace(writing, seed=tasks[""].seed)
    for name in letter.hands:
        if name:
            try:
                tasks[name] = prepare(replace(writing, hand=_path_beside(letter, name)), sheet, picture, lined=False)
            except InputError as error:
                spans = (span for paragraph in letter.paragraphs for span in paragraph.spans)
                line = next(span.line for span in spans if span.manner.hand == name)
                raise letter.wrong(line, str(error)) from error
    layout, head = tasks[""].layout, letter.head
    first, following = (
        replace(layout, margin=margins(text, layout.page)) if text is not None and own_margins else layout
        for text in (head.first.margin, head.following.margin)
    )
    task = LetterDocument(letter, tasks, first, following)
    for page in (1, 2):
        if (background := task.background(page)) is not None and not background.is_file():
            raise letter.wrong(1, f"there is no background {background}.")
    return task


def _is_given(name: str, options: Any, given: Collection[str] | None) -> bool:
    """Whether an option was asked for by the caller."""
    if given is not None:
        return name in given
    usual = next(field.default for field in fields(options) if field.name == name)
    return bool(getattr(options, name) != usual)


def _apply_head(letter: LetterFile, options: Options, given: Collection[str] | None) -> Options:
    """Options, with what the head says of those that the caller did not ask for."""
    said: dict[str, Any] = {}
    for name in {each.name for each in fields(options)} & {*LetterHead.__struct_fields__}:
        value = getattr(letter.head, name)
        if value is not None and not _is_given(name, options, given):
            said[name] = _path_beside(letter, value) if name in _FILES else value
    return replace(options, **said)


def _path_beside(letter: LetterFile, name: str) -> str:
    """A name, or the path of a file of that name beside the letter."""
    path = letter.folder / name
    return str(path) if Path(name).suffix and path.is_file() else name


def _find_page(letter: LetterFile, pages: Sequence[LetterPage], at: int) -> int:
    """Which page, from 0, holds a place in a letter's source: of a line on several, as far on as in the line."""
    ends = list(accumulate(len(line) + 1 for line in letter.lines))
    line = min(bisect_right(ends, at), len(ends) - 1) + 1
    share = min(1.0, 1 - (ends[line - 1] - at) / (len(letter.lines[line - 1]) + 1))
    runs = runs_of(letter)  # without page numbers, which come behind all others
    of_places = {name: runs.lines(name) for name in runs.hands}
    found = [
        sorted(
            of_places[voice.hand][placed.at]
            for voice, layer in page.layers.items()
            for one in layer.lines
            for placed in one.placed
            if placed.at < len(of_places.get(voice.hand, ()))
        )
        for page in pages
    ]
    here = sum(lines.count(line) for lines in found)
    before = accumulate(lines.count(line) if here else len(lines) and lines[-1] >= line for lines in found)
    return next((n for n, count in enumerate(before) if count and count >= share * here), len(pages) - 1)


def _word_places(task: LetterDocument, pages: Sequence[tuple[int, LetterPage]]) -> tuple[Facts, ...]:
    """Each word and its box, as of a text; `at` counts through the texts of all hands, see `_first_places`."""
    first, found = _first_places(runs_of(task.letter, _page_numbers(task.letter)), task.tasks), dict[int, Facts]()
    for number, page in pages:
        for voice, manuscript in page.layers.items():
            for word in texts.word_places([manuscript]):
                # what is struck out comes before the word in whose place it stands
                at = first[voice.hand] + cast("int", word["at"])
                found[at] = {**word, "page": number, "at": at}
    return tuple(found[at] for at in sorted(found))


def _set_pages(task: LetterDocument, row: int | None) -> tuple[Mapping[str, Hand | ScannedHand], list[LetterPage]]:
    """The pages of a letter, with what `Manuscript.about` says of them, and its hands with all letters they need."""
    letter, main = task.letter, task.task
    runs = runs_of(letter, _page_numbers(letter))
    key = [main.seed] if row is None else [main.seed, row]
    supplied = {name: _supply_letters(name, runs, task) for name in task.tasks}
    hands = {name: hand for name, (hand, _) in supplied.items()}
    readers = {name: _rereader(hand, task.tasks[name]) for name, hand in hands.items()}
    writers, first = {}, _first_places(runs, hands)
    for number, (name, hand) in enumerate(hands.items()):
        with _locate_errors(name, runs):
            layout, own, ruled = main.layout, task.tasks[name].layout.x_height, task.first.ruling is not None
            rewrites = Rewrites(tuple((at - first[name], times) for at, times in layout.rewritten))
            options = WriterOptions(own, layout.x_height, layout.jitter, main.fallback, main.slips, rewrites, ruled)
            writers[name] = write_runs(runs, name, hand, options, [*key, number], readers[name])
    limit = main.pages or (1 if main.layout.fit else None)
    setting = LetterSetting(letter, runs, writers, task.first, task.following, _sizes(letter), limit)
    pages = set_letter(setting, lines_of(runs, writers), [*key, len(writers)])
    doubts = [doubt for name, reader in readers.items() for doubt in _doubts(name, reader, pages)]
    texts.refuse_doubts([doubt for doubt, _ in doubts], main)
    lacked = {name: lacking for name, (_, lacking) in supplied.items()}
    return hands, _tell_words(pages, task, row, doubts, lacked)


def _page_numbers(letter: LetterFile) -> int:
    """The highest page number that a letter could have, 0 where it has none."""
    if letter.head.page_numbers == "none":
        return 0
    return 2 + len(letter.text) // _PAGE + len(letter.blocks) // 2


def _first_places(runs: Runs, hands: Iterable[str]) -> dict[str, int]:
    """Where each hand's text begins when the texts of all hands are put one behind the other, as words are told."""
    lengths = [len(runs.text(name)) + 1 if runs.of_hand(name) else 0 for name in hands]
    return dict(zip(hands, accumulate([0, *lengths]), strict=False))


def _supply_letters(name: str, runs: Runs, task: LetterDocument) -> tuple[Hand | ScannedHand, Sequence[Borrowed]]:
    """A hand with the letters of its runs, and what was supplied; see `complete_hand`."""
    hand, main = task.tasks[name].hand, task.task
    if not runs.of_hand(name):
        return hand, []
    with _locate_errors(name, runs):
        return complete_hand(hand, runs.text(name), fallback=main.fallback, seed=main.seed, marked=True)


@contextmanager
def _locate_errors(name: str, runs: Runs) -> Iterator[None]:
    """A block whose errors on lacking characters name the lines of the letter."""
    try:
        yield
    except MissingCharacters as error:
        raise MissingCharacters(runs.locate_message(name, str(error))) from error


def _rereader(hand: Hand | ScannedHand, task: WritingTask) -> Rereader | None:
    """What reads the words of a scanned hand, and has those written again that read as others; None: a drawn hand."""
    if hand.pages is None or task.hand.pages is None:
        return None
    from handout.pipeline import rereading

    # without variation the best glyphs are wanted, always the same: what reads badly is only told
    tries = rereading.SETTINGS.tries if task.layout.jitter else 0
    return rereading.Rereader(hand, task.hand, tries)


def _doubts(name: str, reader: Rereader | None, pages: Sequence[LetterPage]) -> Iterator[tuple[Doubt, Line]]:
    """The words of a hand that still read as others, each with the line that it stands on."""
    if reader is None:
        return
    lines = {
        placed.at: ((number, row + 1), line)
        for number, page in enumerate(pages, 1)
        for voice, manuscript in page.layers.items()
        if voice.hand == name
        for row, line in zip(page.rows[voice], manuscript.lines, strict=True)
        for placed in line.placed
    }
    for at, doubt in reader.doubts({at: place for at, (place, _) in lines.items()}).items():
        yield doubt, lines[at][1]


def _list_placed(name: str, pages: Sequence[LetterPage]) -> Iterator[Placed]:
    """All letters that a hand has written."""
    lines = [line for page in pages for v, layer in page.layers.items() if v.hand == name for line in layer.lines]
    return (placed for line in lines for placed in line.placed if placed.glyph.letter)


def _tell_words(
    pages: Sequence[LetterPage],
    task: LetterDocument,
    row: int | None,
    doubts: Sequence[tuple[Doubt, Line]],
    lacked: Mapping[str, Sequence[Borrowed]],
) -> list[LetterPage]:
    """Add to the pages the facts on misread words, and on letters that hands lacked (`lacked`, by name)."""
    told = [{**doubt.facts(), "box": texts.word_box(line, doubt.word)} for doubt, line in doubts]
    lent = [
        ({} if row is None else {"row": row}) | letter_facts(each)
        for name, lacking in lacked.items()
        for each in texts.written_letters(lacking, _list_placed(name, pages), task.tasks[name].hand)
    ]
    borrowed: dict[str, Any] = {"borrowed": lent} if lent else {}
    found = []
    for number, page in enumerate(pages, 1):
        here = [doubt for doubt in told if doubt["page"] == number]
        more = borrowed | ({"doubtful": here} if here else {})
        found.append(replace(page, whole=replace(page.whole, about={**page.whole.about, **more})))
    return found


def _sizes(letter: LetterFile) -> dict[str | Path, tuple[float, float]]:
    """The sizes of the pictures (pixels) and signatures (mm) of a letter."""
    from PIL import Image

    sizes: dict[str | Path, tuple[float, float]] = {}
    for block in blocks_in(letter.blocks):
        if isinstance(block, PictureRoom):
            try:
                with Image.open(block.path) as picture:
                    sizes[block.path] = (float(picture.width), float(picture.height))
            except (OSError, ValueError, Image.DecompressionBombError) as error:
                raise letter.wrong(block.line, f"{block.path} cannot be read as a picture: {error}.") from error
        elif isinstance(block, Signature) and block.name:
            try:
                sizes[block.name] = size(find_signature(block.name, letter.folder))
            except InputError as error:
                raise letter.wrong(block.line, str(error)) from error
    return sizes


# Drawing


def _draw_page(
    page: LetterPage,
    task: LetterDocument,
    hands: Mapping[str, Hand | ScannedHand],
    about: Mapping[str, Any],
    wanted: frozenset[str],
) -> Drawing:
    """A page as one drawing, of a layer for each hand, ink and size, and one for each signature."""
    layers = []
    for voice, manuscript in page.layers.items():
        own = replace(task.tasks[voice.hand], hand=hands[voice.hand])
        drawing = draw(manuscript, own, page.rng.spawn(1)[0], about, wanted)
        # strokes have the ink of the whole letter from the pen that they are drawn with
        ink = voice.ink or (own.look.pen.colour if own.coloured and drawing.ink is not None else "")
        layers.append(_change_ink(drawing, ink, own))
    for place in page.signatures:
        signature = find_signature(str(place.source), task.letter.folder)
        own = replace(task.task, hand=signature, pen_hand=None)
        manuscript = placed_signature(signature, place, page.whole.page)
        drawing = draw(manuscript, own, page.rng.spawn(1)[0], about, wanted)
        layers.append(_change_ink(drawing, place.ink, own))
    told = {**(layers[0].about if layers else about), **texts.words(page.whole), **page.whole.about}
    drawing = Drawing((), page.whole.page, told, beneath=_beneath(task, page, int(about["page_number"])))
    if all(layer.strokes or layer.bounds is None for layer in layers):
        drawing = replace(drawing, strokes=_in_order(layers, page.whole.x_height))
    if all(layer.ink is None for layer in layers):
        return drawing
    inked = np.array([layer.bounds for layer in layers if layer.bounds is not None])
    bounds = (*inked[:, :2].min(axis=0).tolist(), *inked[:, 2:].max(axis=0).tolist()) if len(inked) else None
    return replace(drawing, ink=partial(_mix_layers, layers, task.task), inked=bounds)


def _beneath(
    task: LetterDocument, page: LetterPage, number: int
) -> Callable[[NDArray[np.uint8], float], NDArray[np.uint8]] | None:
    """What previews of a page show under its ink: the letterhead, and pictures."""
    background, sheet = task.background(number), page.whole.page
    places = [(Path(each.source), (each.x, each.y, each.width, each.height)) for each in page.pictures]
    if background is not None:
        places.insert(0, (background, (0.0, 0.0, sheet.width, sheet.height)))
    if not places:
        return None

    def lay_pictures(paper: NDArray[np.uint8], dpi: float) -> NDArray[np.uint8]:
        return paste_pictures(paper, dpi, [(_pixels(path), place) for path, place in places])

    return lay_pictures


@lru_cache(maxsize=4)
def _pixels(path: Path) -> NDArray[np.uint8]:
    """(h, w, 3): a picture, or the first page of a PDF."""
    from PIL import Image, ImageOps

    try:
        if path.suffix.lower() != ".pdf":
            with Image.open(path) as picture:
                upright = ImageOps.exif_transpose(picture).convert("RGBA")
                white = Image.new("RGBA", upright.size, "white")
                return np.asarray(Image.alpha_composite(white, upright).convert("RGB"))
        try:
            import pypdfium2
        except ImportError as error:
            raise InputError(
                f"{path}: a background of PDF needs the extra pdf: pip install 'handout-driver[pdf]'."
            ) from error
        with pypdfium2.PdfDocument(path) as document:
            return np.asarray(document[0].render(scale=_PDF_DPI / 72).to_pil().convert("RGB"))
    except (OSError, ValueError, RuntimeError, Image.DecompressionBombError) as error:
        raise InputError(f"{path} cannot be read as a picture: {error}.") from error


def _change_ink(drawing: Drawing, colour: str, task: WritingTask) -> Drawing:
    """Give a drawing an ink of its own; "" leaves it as it is."""
    if not colour:
        return drawing
    strokes = tuple(replace(stroke, colour=colour) for stroke in drawing.strokes)
    if drawing.ink is None:
        return replace(drawing, strokes=strokes)
    pen: Any = task.pen_hand or task.hand
    was, ink = ink_colours(pen).colours[0], drawing.ink
    return replace(drawing, strokes=strokes, ink=lambda dpi: recolour_ink(ink(dpi), was, colour))


def _mix_layers(layers: Sequence[Drawing], task: WritingTask, dpi: float) -> Raster:
    """The ink of all layers of a page; the pen of pictures draws those that are strokes."""
    from handout.inking import pens

    return mix_inks(
        pens.ink(layer, dpi, task.look.pen, pens.noise(layer.about)) if layer.ink is None else layer.ink(dpi)
        for layer in layers
    )


def _in_order(layers: Sequence[Drawing], x_height: float) -> tuple[Stroke, ...]:
    """The strokes of all layers, word after word in the order of the page, on one clock."""
    if len(layers) < 2:
        return layers[0].strokes if layers else ()
    strokes = [(stroke.word, layer, at) for layer, each in enumerate(layers) for at, stroke in enumerate(each.strokes)]
    ordered, clock, before = list[Stroke](), 0.0, (-1, -1)
    for _, layer, at in sorted(strokes, key=lambda entry: entry[0]):
        stroke = layers[layer].strokes[at]
        if ordered:
            last = ordered[-1]
            if before == (layer, at - 1):  # as if nothing else were on the page
                clock += float(stroke.t[0] - layers[layer].strokes[at - 1].t[-1])
            else:
                way = float(np.linalg.norm(stroke.xy[0] - last.xy[-1])) / x_height
                clock += time_in_air(way, line=False, word=stroke.word != last.word)
        ordered.append(replace(stroke, t=stroke.t - stroke.t[0] + clock))
        clock, before = float(ordered[-1].t[-1]), (layer, at)
    return tuple(ordered)
