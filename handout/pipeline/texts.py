"""A text in a hand, on pages: the options are checked, the hand is completed, the text is set and drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from handout import __version__, units
from handout.errors import DoesNotFit, InputError
from handout.hand import library
from handout.hand.places import graphemes
from handout.inking.papers import PAPERS
from handout.page_sizes import margins, page
from handout.pipeline.options import (
    PictureOptions,
    PoseOptions,
    SheetOptions,
    StyleOptions,
    WritingOptions,
    millimetres,
    pace,
    seed_of,
)
from handout.pipeline.results import Facts, Tally
from handout.progress import Tell, silent
from handout.sinks import Look
from handout.sinks import check_outputs as check_outputs
from handout.values import Drawing, Line, Manuscript, Placed
from handout.writing.compose import each_page, each_part
from handout.writing.layout import Layout
from handout.writing.text import LEFT_OUT, Borrowed, find_unseen

if TYPE_CHECKING:
    from handout.hand.drawn import Hand
    from handout.hand.scanned import ScannedHand
    from handout.motion.styles.style import Style
    from handout.pipeline.lined_paper import LinedPaper
    from handout.pipeline.rereading import Doubt
    from handout.writing.pages import Sheet

_SET = 0.5  # of the work on a text before it is drawn, when its letters are on their pages; measured
_HURRIED = 2.5  # pace of --speed fast in a file, set by eye; a plotter goes as fast as it can instead
# what a page in a scanned hand may be wanted as; a drawn hand has strokes only
INK, STROKES = frozenset({"ink"}), frozenset({"strokes"})


@dataclass(frozen=True)
class WritingTask:
    """The options of a piece of writing, checked, with the hand and the layout that they mean.

    fast : whether a plotter goes as fast as it can; `speed` is a factor then.
    slips : words in 100 that are begun wrongly.
    pen_hand : the scanned hand whose pen a scanned hand is written with, if not its own.
    traced : whether a scanned hand is written with a pen that is no scanned hand's, along its recovered pen paths.
    coloured : whether a colour of the ink was given, which the strokes of a scanned hand then have.
    look : of pictures, with the lines of the paper where they are written on.
    paper : the lined paper that is written on.
    strict : whether words that read as others are an error.
    pose : how the pen is held.
    style : the handstyle in which the strokes are moved through.
    untaken : that the hand's file lacks corrections, or what the hand does not follow, if so.
    picture : the options of pictures, as they were asked for.
    """

    hand: Hand | ScannedHand
    layout: Layout
    look: Look
    seed: int
    kinematics: str
    speed: float
    fast: bool
    pages: int | None
    fallback: bool
    slips: float = 0.0
    pen_hand: ScannedHand | None = None
    traced: bool = False
    coloured: bool = False
    paper: LinedPaper | None = None
    strict: bool = False
    pose: PoseOptions = field(default_factory=PoseOptions)
    style: Style | None = None
    untaken: tuple[str, ...] = ()
    picture: PictureOptions = PictureOptions()

    @property
    def given_notes(self) -> tuple[str, ...]:
        """What the user is told of the hand's file and of the lined paper."""
        return self.untaken if self.paper is None else (*self.untaken, *self.paper.notes)


def prepare(
    writing: WritingOptions,
    sheet: SheetOptions = SheetOptions(),
    picture: PictureOptions = PictureOptions(),
    *,
    lined: bool = True,
) -> WritingTask:
    """Check the options, and load the hand that they name; `lined` : whether it writes on the lines of its paper."""
    name = sheet.page_name
    if picture.paper not in PAPERS:
        from handout.pipeline.lined_paper import page_name

        name = page_name(sheet, picture)
    (fast, factor), seed, look = (
        pace(writing.speed),
        seed_of(writing.seed),
        replace(picture.look(styled=writing.style is not None), footprint=writing.pose is not None),
    )
    hand = library.find(writing.hand) if isinstance(writing.hand, str) else writing.hand
    hand, behind = hand.with_language(writing.language).with_haste(writing.haste), tuple[str, ...]()
    if hand.pages is not None and isinstance(writing.hand, str):
        from handout.hand.file import tell_foreign
        from handout.hand.pending import untaken

        behind = (*untaken(writing.hand), *filter(None, [tell_foreign(hand)]))
    hand, behind = _wish_legible(hand, writing.legible, behind)
    paper = page(name)
    layout = Layout(
        page=paper,
        margin=margins(sheet.margin, paper),
        x_height=hand.x_height if writing.x_height is None else millimetres(writing.x_height, "x-height"),
        line_spacing=millimetres(writing.line_spacing, "line spacing") if writing.line_spacing else None,
        align=writing.align,
        fit=writing.fit,
        jitter=writing.jitter,
        rewritten=tuple((int(at), int(times)) for at, times in writing.rewritten),
        at=sheet.at,
    )
    task = WritingTask(
        hand,
        layout,
        look,
        seed,
        writing.kinematics,
        factor,
        fast,
        sheet.pages,
        writing.fallback,
        writing.slips,
        _pen_hand(picture.pen, hand) if picture.pen is not None and picture.has_scanned_pen else None,
        hand.pages is not None and not picture.has_scanned_pen and (picture.pen, writing.style) != (None, None),
        picture.ink is not None,
        strict=writing.strict,
        pose=_pose(writing),
        style=_style(writing),
        untaken=behind,
        picture=picture,
    )
    if not lined or picture.paper == "none":
        return task
    from handout.pipeline.lined_paper import lined_paper

    on = lined_paper(task.layout, task.hand, writing, sheet, look.paper)
    look = task.look if on.paper is None else replace(task.look, paper=on.paper)
    return replace(task, layout=on.layout, look=look, paper=on)


def _wish_legible(
    hand: Hand | ScannedHand, wish: float, notes: tuple[str, ...]
) -> tuple[Hand | ScannedHand, tuple[str, ...]]:
    """The hand, written as legibly as is wished, and notes; a drawn hand stays as it is, which is said."""
    if not wish:
        return hand, notes
    if hand.pages is None:
        return hand, (*notes, f"--legible: {hand.name} is a drawn hand, as legible as it was drawn.")
    from handout.pipeline.hand_learning import learn_beside
    from handout.writing.legibility import misreadings, prefer_legible

    misreadings(hand)  # so that what is worked out is kept of the hand as it is, not as it is wished
    learn_beside(hand)
    return prefer_legible(hand, wish), notes


def _pen_hand(pen: str, hand: Hand | ScannedHand) -> ScannedHand:
    """The scanned hand whose pen is asked for."""
    if hand.pages is None:
        raise InputError(f"pen: {pen} holds scanned ink, which only scanned hands can be written with.")
    from handout.hand import file

    return file.load(library.scanned_file(pen))


def _style(writing: WritingOptions) -> Style | None:
    """The handstyle that is asked for."""
    if writing.style is None:
        given = [name for name in ("prime", "temperature") if getattr(writing, name) is not None]
        if given:
            raise InputError(f"--{given[0]} is for learned styles: name one with --style.")
        return None
    from handout.pipeline.styles import style_of

    return style_of(StyleOptions(writing.style, prime=writing.prime, temperature=writing.temperature))


def _pose(writing: WritingOptions) -> PoseOptions:
    """How the pen is held; what cannot be read is refused before anything is written."""
    if writing.pose is not None:
        from handout.pipeline.poses import pose_model

        pose_model(writing.pose)
    return PoseOptions(writing.pose, writing.pose_method)


@dataclass(frozen=True)
class Pages:
    """What a document is on its pages.

    manuscripts, drawings : of every page, in order.
    words : of every word where it is: page, place in the text, letters, box; see `word_places`.
    number : of the page, where it is one of several; None: these are all.
    """

    manuscripts: Sequence[Manuscript]
    drawings: Sequence[Drawing]
    words: Callable[[], Sequence[Facts]] = tuple
    number: int | None = None

    @property
    def tally(self) -> Tally:
        """What has been written."""
        return Tally.from_pages(self.manuscripts, self.drawings)


@dataclass(frozen=True)
class TextDocument:
    """A text that is written (a `pipeline.writing.Document`); layout : that of the task, if None."""

    text: str
    task: WritingTask
    layout: Layout | None = None
    notes: tuple[str, ...] = ()
    inks: tuple[str, ...] = ()
    timed: bool = True

    @property
    def name(self) -> str:
        """The beginning of the text."""
        return title(self.text)

    def draw(self, wanted: frozenset[str] = INK, row: int | None = None, tell: Tell = silent) -> Pages:
        """The pages of the text.

        wanted : of a scanned hand, its `INK` or its `STROKES` or both.
        row : of a batch, each of which varies in its own way.
        """
        tell(0.0, "setting the text")
        task, sheets = self.set_pages(row)
        pages = list(sheets)
        about = {"title": title(self.text), "pages": len(pages)} | ({} if row is None else {"row": row})
        drawings = []
        for count, sheet in enumerate(pages):
            tell(_SET + (1 - _SET) * count / len(pages), f"writing {count + 1}/{len(pages)}")
            drawings.append(draw(sheet.manuscript, task, sheet.rng, {**about, "page_number": sheet.number}, wanted))
        manuscripts, first = [sheet.manuscript for sheet in pages], pages[0].number
        one = None if first == 1 and pages[-1].last else first
        return Pages(manuscripts, drawings, lambda: tuple(word_places(manuscripts, first)), one)

    def set_pages(self, row: int | None = None) -> tuple[WritingTask, Iterator[Sheet]]:
        """The pages, each set when it is asked for, and the task with the hand that has all their letters."""
        task, layout = self.task, self.layout or self.task.layout
        own = partial(each_page, self.text, layout=layout, pages=task.pages, fallback=task.fallback, slips=task.slips)
        return _set_text(self.text, own, task, row)

    def check(self, row: int | None = None) -> None:
        """Raise as `draw` would; pages are set only where their number is bounded, or nothing may be misread."""
        set_, sheets = self.set_pages(row)
        bounded = self.task.pages is not None or (self.layout or self.task.layout).fit
        if set_.hand.pages is not None and (bounded or self.task.strict):
            for _ in sheets:
                pass


def set_parts(
    texts: Sequence[str], layouts: Sequence[Layout], task: WritingTask, row: int
) -> tuple[WritingTask, Iterator[Sheet]]:
    """Set several texts one after the other, each on a page and in a layout of its own; else as `set_pages`.

    Raises DoesNotFit: one of them is larger than its layout; see `try_parts`.
    """

    def compose(**options: Any) -> Iterator[Sheet]:
        sheets = each_part(texts, layouts=layouts, fallback=task.fallback, **options)
        for text, sheet in zip(texts, sheets, strict=True):
            if sheet is None:
                raise DoesNotFit(f"{title(text)!r} is larger than its place.")
            yield sheet

    return _set_text("\n".join(texts), compose, task, row)


def try_parts(texts: Sequence[str], layouts: Sequence[Layout], task: WritingTask, row: int) -> list[Sheet | None]:
    """Set them without reading any word again; None stands for a text that is larger than its layout."""
    hand, _ = _complete_hand(task, "\n".join(texts))
    return list(each_part(texts, hand, layouts, [task.seed, row], fallback=task.fallback))


def _complete_hand(task: WritingTask, text: str) -> tuple[Hand | ScannedHand, Sequence[Borrowed]]:
    """The hand with all letters of a text, and the letters that it lacked; a drawn hand borrows while it writes."""
    if task.hand.pages is None and not task.fallback:
        return task.hand, []
    from handout.completion.completed_hand import complete_hand

    return complete_hand(task.hand, text, fallback=task.fallback, seed=task.seed)


def _set_text(
    text: str, compose: Callable[..., Iterator[Sheet]], task: WritingTask, row: int | None
) -> tuple[WritingTask, Iterator[Sheet]]:
    """Give the hand of a task all letters of a text, then set the text with `compose`."""
    author = task.hand
    hand, lacking = _complete_hand(task, text)
    compose = partial(compose, hand=hand, seed=[task.seed] if row is None else [task.seed, row])
    sheets = compose() if author.pages is None or hand.pages is None else _reread_text(compose, hand, author, task)
    task = replace(task, hand=hand)
    if any(letter.doubted for letter in lacking):
        sheets = iter(pages := list(sheets))
        lines = [line for sheet in pages for line in sheet.manuscript.lines]
        placed = (placed for line in lines for placed in line.placed if placed.glyph.letter)
        lacking = list(written_letters(lacking, placed, author))
    left_out = [*lacking, *find_unseen(text)]
    borrowed = [letter_facts(letter) if row is None else {"row": row, **letter_facts(letter)} for letter in left_out]
    return task, (_add_about(sheet, "borrowed", borrowed) for sheet in sheets) if borrowed else sheets


def written_letters(
    letters: Sequence[Borrowed], placed: Iterable[Placed], author: Hand | ScannedHand
) -> Iterator[Borrowed]:
    """Of the letters that a hand lacked those that were placed, and those that were left out."""
    own, lent = set[int](), set[int]()
    for each in placed if letters else ():
        foreign = each.ink is not None and author.pages is not None and each.ink.number >= len(author.glyphs)
        (lent if foreign else own).add(each.at)
    for letter in letters:
        # of a doubtful letter its own form may have been written all the same
        there = lent if letter.doubted and not letter.of_author else own | lent
        at = letter.at if letter.source == LEFT_OUT else tuple(place for place in letter.at if place in there)
        if at:
            yield replace(letter, at=at)


def _reread_text(
    compose: Callable[..., Iterator[Sheet]], hand: ScannedHand, author: ScannedHand, task: WritingTask
) -> Iterator[Sheet]:
    """The pages of a text in a scanned hand, each with the words of it that read as others.

    Raises InputError: there are some, and the task is strict.
    """
    from handout.pipeline.rereading import reread

    # without variation the best glyphs are wanted, always the same: what reads badly is only told
    tries = None if task.layout.jitter else 0
    sheets, doubts, _ = reread(lambda reader: compose(proofread=reader), hand, author, tries)
    refuse_doubts(doubts, task)
    for sheet in sheets:
        here = [
            {**doubt.facts(), "box": word_box(sheet.manuscript.lines[doubt.line - 1], doubt.word)}
            for doubt in doubts
            if doubt.page == sheet.number
        ]
        yield _add_about(sheet, "doubtful", here) if here else sheet


def word_places(pages: Sequence[Manuscript], first: int = 1) -> Iterator[Facts]:
    """Each word: its page, from `first`, its place in the text, its letters, and its box (`word_box`)."""
    for number, sheet in enumerate(pages, first):
        for line in sheet.lines:
            for _, group in groupby(line.placed, key=lambda placed: placed.word):
                letters = [placed for placed in group if placed.glyph.letter]
                if (box := _box(letters)) is not None:
                    word = "".join(placed.glyph.letter for placed in letters)
                    yield {"page": number, "at": letters[0].at, "word": word, "box": box}


def _box(letters: Sequence[Placed]) -> list[float] | None:
    inks = [placed.ink.graph.xy for placed in letters if placed.ink is not None]
    if not (places := inks or [stroke for placed in letters for stroke in placed.strokes]):
        return None
    xy = np.concatenate(places)
    return [round(float(at), 2) for at in (*xy.min(axis=0), *xy.max(axis=0))]


def word_box(line: Line, word: str) -> list[float] | None:
    """Where the ink of a word lies: x least, y least, x greatest, y greatest, mm; None where it is not on the line."""
    for _, group in groupby(line.placed, key=lambda placed: placed.word):
        letters = list(group)
        if "".join(placed.glyph.letter for placed in letters) == word and (box := _box(letters)) is not None:
            return box
    return None


def refuse_doubts(doubts: Sequence[Doubt], task: WritingTask) -> None:
    """Raise InputError where the task is strict and words read as others."""
    if doubts and task.strict:
        named = units.listed(f"{doubt.word} as {doubt.reads_as or 'nothing'}" for doubt in doubts)
        raise InputError(
            f"--strict: {units.count(len(doubts), 'word')} may be misread ({named}); use --legible, another "
            f"seed or other words, or say which letters of {task.hand.name} read badly (handout hand check --sheet)."
        )


def letter_facts(letter: Borrowed) -> Facts:
    """What `--json` prints of a letter that the hand lacked."""
    count = len(letter.at)
    return {
        "letter": letter.letter,
        "from": letter.source,
        "own": letter.of_author,
        **({"doubtful": True} if letter.doubted else {}),
        "count": count,
        "at": list(letter.at),
    }


def _add_about(sheet: Sheet, name: str, facts: Sequence[Facts]) -> Sheet:
    about = {**sheet.manuscript.about, name: facts}
    return sheet._replace(manuscript=replace(sheet.manuscript, about=about))


def title(text: str) -> str:
    """The beginning of a text, which titles its pages."""
    return " ".join(text.split())[:60]


def words(page: Manuscript) -> Facts:
    """The words of a page, and the number of the first word of each line; files and plots number strokes by them."""
    found: dict[int, str] = {}
    for line in page.lines:
        letters = [placed for placed in line.placed if placed.glyph.letter]
        # the glyph of a letter with an accent says the letter alone; where words were struck out the line says more
        spelt = graphemes("".join(line.text.split()))
        spelt = spelt if len(spelt) == len(letters) else [placed.glyph.letter for placed in letters]
        for placed, letter in zip(letters, spelt, strict=True):
            found[placed.word] = found.get(placed.word, "") + letter
    first = sorted({min(placed.word for placed in line.placed) for line in page.lines if line.placed})
    return {"words": [found.get(number, "") for number in range(max(found, default=-1) + 1)], "lines": first}


def program() -> str:
    """The versions that decide about every stroke, besides what is asked for."""
    from handout.reading import second_reader

    beside = " and a second reader" if second_reader.find() else ""  # with it other glyphs may be chosen
    return f"handout {__version__} with numpy {np.__version__}{beside}"


def draw(
    page: Manuscript,
    task: WritingTask,
    rng: np.random.Generator,
    about: Mapping[str, Any],
    wanted: frozenset[str] = INK,
) -> Drawing:
    """Draw a page as timed strokes or scanned ink (`wanted`: see `TextDocument.draw`), with what outputs keep."""
    if task.hand.pages is not None:
        from handout.pipeline.hand_learning import learn_beside

        learn_beside(task.hand.author or task.hand, strokes=task.traced or bool(wanted & STROKES))
    drawing = Drawing((), page.page, {})
    if task.hand.pages is None or task.traced or wanted & STROKES:
        from handout.motion.trace import trace

        speed = task.speed * (_HURRIED if task.fast else 1.0)
        drawing = trace(page, task.hand, rng, task.kinematics, speed=speed, jitter=task.layout.jitter)
        drawing = _apply_style(_in_colour(drawing, task), task, rng, page) if drawing.strokes else drawing
        if drawing.strokes and task.pose.pose is not None:
            from handout.pipeline.poses import with_pose

            drawing = with_pose(drawing, task.pose)
    if task.hand.pages is not None and not task.traced and wanted & INK:
        from handout.inking.pen_replacement import ink_drawing

        drawing = replace(ink_drawing(page, task.hand, task.pen_hand), strokes=drawing.strokes)
    told = {"program": f"handout {__version__}", "seed": task.seed, **words(page), **_other_inks(page, task)}
    return replace(drawing, about={**told, **about, **drawing.about})


def _other_inks(page: Manuscript, task: WritingTask) -> Facts:
    """The letters of a page in another ink than most of the author's, for what keeps their colours; nothing if none."""
    if task.hand.pages is None or task.pen_hand or task.traced:
        return {}
    from handout.hand.measures import in_other_ink

    other = in_other_ink(task.hand.author or task.hand)
    written = [(each.glyph.letter, each.ink.number) for line in page.lines for each in line.placed if each.ink]
    found = [letter for letter, number in written if 0 <= number < len(other) and other[number]]
    return {"other_inks": found} if found else {}


def _apply_style(drawing: Drawing, task: WritingTask, rng: np.random.Generator, page: Manuscript) -> Drawing:
    """Move the drawing of a page in the style of the task.

    `about["style_losses"]` names what the style cannot show, `about["hard_to_read"]` the words that became so.
    """
    if task.style is None:
        return drawing
    from handout.motion.styles.restyling import losses, restyle
    from handout.pipeline.rereading import open_stroke_reader

    names = cast(Sequence[str], words(page)["words"])
    styled = restyle(drawing, task.style, rng, reading=open_stroke_reader(page, names))
    about = dict(styled.about)
    if lost := losses(drawing, styled, task.style):
        about["style_losses"] = lost
    if hard := name_hard_words(styled, names):
        about["hard_to_read"] = hard
    return replace(styled, about=about)


def name_hard_words(styled: Drawing, names: Sequence[str]) -> list[Facts]:
    """The words that became hard to read, and which letters of them; `names` : of all words, by their numbers."""
    hard = [(names[each["word"]], each["letters"]) for each in styled.about.get("hard_to_read", [])]
    return [{"word": word, "letters": [word[k] for k in letters]} for word, letters in hard]


def style_notes(task: WritingTask, drawings: Sequence[Drawing]) -> list[str]:
    """Notes on what of some pages their style cannot show or makes hard to read, and on what becomes of scanned ink."""
    if task.style is None:
        return []
    lost = dict.fromkeys(str(loss) for drawing in drawings for loss in drawing.about.get("style_losses", []))
    ink = f"--style: the strokes of {task.hand.name} are moved anew and drawn with a pen; its scanned ink is left out."
    hard = [each for drawing in drawings for each in drawing.about.get("hard_to_read", [])]
    return [*([ink] if task.hand.pages is not None else []), *lost, *hard_word_notes(hard)]


def hard_word_notes(hard: Sequence[Mapping[str, Any]]) -> list[str]:
    """A note that names the words that a style makes hard to read (as of `name_hard_words`), if there are any."""
    if not hard:
        return []
    named = units.listed(f"{each['word']} ({' '.join(each['letters'])})" for each in hard)
    return [f"{units.count(len(hard), 'word')} may be misread in this style, at the letters named: {named}."]


def _in_colour(drawing: Drawing, task: WritingTask) -> Drawing:
    """Give a drawing the ink colour that is asked for, where that is not the hand's own."""
    if not (task.coloured or task.pen_hand or task.traced):
        return drawing
    from handout.hand.measures import ink_colours

    # without a colour of their own, strokes have that of the pen that pictures are drawn with
    colour = ink_colours(task.pen_hand).colours[0] if task.pen_hand and not task.coloured else ""
    strokes = tuple(replace(stroke, colour=colour) for stroke in drawing.strokes)
    if task.traced:  # a pen makes its own width, not that of the pen on the scanned pages
        strokes = tuple(replace(stroke, width=None) for stroke in strokes)
    return replace(drawing, strokes=strokes)


def not_followed(task: WritingTask, ink_shown: bool) -> list[str]:
    """Notes on options that a scanned hand does not follow; `ink_shown`: whether its scanned ink itself is shown."""
    picture = task.picture
    if task.hand.pages is None or task.traced:
        return []
    name = task.hand.name
    notes = []
    if task.pose.pose is not None and ink_shown:
        notes.append(
            f"--pose: the ink of {name} stays as it was scanned in PNG and PDF files; its strokes have the pose."
        )
    notes += [f"--pen-width: lines are as wide as on the pages of {name}."] if picture.pen_width is not None else []
    if picture.ink is not None and ink_shown:
        notes.append(
            f"--ink: the ink of {name} stays as it was scanned in PNG and PDF files; strokes, as in SVG, have that "
            "colour. --pen FILE.hand lends another pen."
        )
    return notes
