"""How well the writing order of ink is recovered, where it is known: on simulated pages, and on recorded pens.

Columns: strokes found; of these in the right direction; words (letters) whose strokes are all found and in order; and
those whose directions are right, too; words in order if dots, bars and accents are left out, since people differ in
when they write them; of the length drawn, how much lies off the ink; lifts within words that are kept.
What counts as what is told in `benchmarks.followed`.  Goals: .95, .90, .85.

- simulated pages: a built-in hand writes, the simulated author's pen and scanner make a page, the ordinary reading
  makes a hand of it, and that hand's own page is traced.  The forms that tell how letters are written are those of the
  other built-in hands, never of the one that wrote; when it writes its dots and bars, which no ink shows, is told.
- recorded letters: with HANDOUT_DATA, letters and digits of a dozen writers, inked in ballpoint, scanned and read.
- recorded words: with HANDOUT_DATA, English words that three writers hardly joined, and joined German words of
  thirteen, read with their text as a user's page is.  The two have nothing in common: English words are all right more
  than twice as often.

Beside ours: the same without any letter's forms (only what movements cost), and from left to right, each piece from its
leftmost end by the straightest way on.  Last, what tracing a page of 300 words takes, against composing it.

What limits it is not the line graph: the true pen laid on the graphs of whole words, gaps in the ink bridged, gets all
but one of 526 recorded English words all right, and .98 of 120 joined German ones; cut into sub-strokes between forks,
ends and turns, of at most 9 half widths in rings and loops, .97 of 236 English ones.  The best of the first sixteen
candidates of every letter, chosen by one who knows the truth, gets about .66 where the product gets .64 (140 words of
three other pages).  So most is lost where words are cut into letters.  Of 143 English words that went wrong 32 had lost
a stroke of a t, mostly one whose bar crosses a loop.
Of 102 words of three pages, in order with everything .61; without crossbars of words .55, without turning points .54,
without the direction of loops .56; of the 140, .64 with everything and .56 without ways over ink, or without habits.

Of 41 English words of one writer that went wrong, 34 had a stroke whose way within one path was wrong: upstrokes hidden
under stems (h, b, t), returns (d), rings begun elsewhere (o).  A third of that is told by the ink, which is wider and
darker where the pen passed twice (`network.InkWeights`): of 173 English words that took no part in this .64 in order
without and .70 with it, of 50 German ones .50 and .48; the reader of pen paths misreads .35 of the letters written in
csafe w0180 without, and .32 with it.  It misreads .65 of the letters of joined German words on their *true* paths, and
.71 on recovered ones: what joined hands read like says little of the order.

That the pen may go back at the end of a letter over a line whose ink tells nothing, and that 32 ways of a letter are
compared for 16, was chosen on 165 words of one English writer (.67 all right before, .72 after); of 302 words of the
two others .715 are all right before and .735 after, of 161 German ones .42 and .42.

In 69 of 361 words of two writers an order is told to be guessed: .52 of these are wrong, and .21 of the others; margins
were set on the 165 words of the third (20 told, .60 and .23).  Of 289 joined German words 68 are told so, .82 of them
wrong, and .57 of the others, where most goes wrong before an order is chosen.

A network that knows the letter (35 000 weights, bidirectional recurrence with attention) and weighs its eight cheapest
ways beside their costs, learned of 4451 letters: of 358 words of two writers kept out all letters are right in .731 for
.723 where recorded pens are learned from, too; aimed at nearness to the pen's way .651.  The best of eight gets .828.
Of drawn hands alone it gains nothing (.723 early, .698 later).

A model of whole words (attention over their sub-strokes, a pointer to the next, 159 000 weights, beam of six) that
learned of 442 recorded words of 14 writers and of 450 of drawn hands goes on as the pen did in .93 of single steps of
two writers kept out; of their 361 words .47 are in order where the product gets .75, and all that either has all right
are .80.  Its cross-entropy a step is .15 in words that it learned of and .29 in others: it has too few.  What ships may
learn only of drawn hands and of 27 recorded words of two writers.

Dearer third passes (.6 for .1) read better in one page by one reader of two (csafe w0180, .28 for .31 and .41 for .40),
and cost a word of the third writer.

Bars that bend, where both their ends are loose, and feet by which a t, i, u or w is led in, were named by twenty
words of csafe w0180 that went wrong: two readers misread .26 and .36 of its letters, .29 and .39 before; of 361 words
of two writers .795 are in order and .767 all right, .778 and .756 before; of 185 joined German ones .432 and .384,
.438 and .389 before. Paths that are smoothed by .04, .08 or .12 x-heights read the same (.308, .300, .298 for .292;
.369, .363, .385 for .369): what is misread is no noise of the line graph.

Two dots over an i beside a j, bars whose ink failed beside the stem, and letters that a neighbour's line cuts in two
were named by 93 words that went wrong (all of one writer, and every second one of two others).  Of all 361 words of two
writers .806 are in order and .781 all right, .789 and .762 before; of 99 that nobody had looked at .848 and .838, .828
and .818 before; no word of the three became wrong.  What did not help: no ligature between letters that hardly ever
join (of 526 words 6 right, 7 wrong), 12 instances that tell a habit (7 words of one writer wrong), no lead-in to stems
under an x-height (2 right, 4 wrong), forms that are joined where this letter is not (joined German 8 right, 5 wrong;
English one wrong), and ways that may differ from forms at both ends of words (none gained).

How much of what a reader of pen paths misreads is the order's, letters of recorded pens on true paths, on these laid on
the line graph, and on recovered ones: English .096, .103, .156 and .031, .032, .084 (two writers), joined German .52,
.53, .60.  So the line graph costs nothing, order and needless retracing .05 to .08; the rest is the reader's.  Words
that are all right here lose .03, too: an r that begins at the tip of its arm and goes back is a detour that is allowed.
Since lines are cut at shoulders of r the two writers' .117 (recovered, both together) are .108, a second reader's .119
.114, and of 38 r 11 begin so and not 26; of single letters kept out .0920 apart from the pen's way and not .0937.
Paths are longer than the pen's by 6 % in words that are all right, and by 10 % in others.

Other costs do not help: of 42 words of two writers .31 are in order, and .33 for the best of fourteen whole words
each, traced with lifts, turns and retracing made dearer or cheaper and without forms.  What goes wrong there, by eye:
upstrokes that the stroke down hides (e, w, P, R), lifts where letters touch, stems retraced where the pen began anew,
bars written leftwards.  Dots and bars that are written at the first lift after their letter and not at the end of the
word: of 148 words of eight writers .41 in order for .38, with none worse.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations, groupby, pairwise
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks import recorded
from benchmarks.followed import NEAR, Tally, tally
from handout.errors import InputError
from handout.hand import library
from handout.hand.letter_classes import X_HEIGHT
from handout.hand.scanned import ScannedHand
from handout.motion.recovery import pen_paths, stroke_order
from handout.motion.recovery.letter_forms import HANDS
from handout.motion.recovery.letter_line import Candidate, LetterLine, LetterStrokes
from handout.motion.recovery.letter_tracing import trace_letter
from handout.motion.recovery.network import CostWeights, Ends, build_network, chain_vertices
from handout.motion.recovery.traversal import beam_search
from handout.page_sizes import page
from handout.scanning.written_page import read_page
from handout.tagging.page_tagging import hand_of_pages, tag_page
from handout.values import Array, Glyph, Indices, Ink, Line, LineGraph, Manuscript, Page, Placed
from handout.writing.bending import unbent
from handout.writing.joining import set_line
from handout.writing.layout import Layout
from handout.writing.word_layout import layout_model
from handout_lab.author import page_score
from handout_lab.author.simulate import Desk, simulate

TEXT = (
    "Dear Max, the parcel came on Tuesday, quite dry in spite of the rain. Both jars were whole! We have put six of "
    "them by for winter and given the rest to Vera and her boys. Your father fixed the gate again; it had just begun "
    "to hang. Could you find out whether the King's Lane office still opens at 8, or not until 9? I would rather not "
    "walk there twice. With much love, Zoe"
)
_ASTRAY = 0.3  # of a gap, for each of its width that it lies away from where a space is looked for
# a page that no constant was set on, with more letters that get into one another's way
KEPT_OUT = (
    "Both jackets fit him. The thirty-five fish that fled left a filthy tank behind; Kate, Hugh and Quentin took extra "
    "buckets to the lake. We kept the old brass key for you: box 47, left shelf. Auntie Fay thought the theatre too "
    "hot, although the night itself felt quite lovely. Please excuse my haste, I just caught the ferry. Yours, Alfred "
    "Vaughan"
)
_STRAIGHT = CostWeights(against=0.0, jump=0.05)
Recover = Callable[[LetterLine, str, tuple[str, ...]], LetterStrokes]


def ours(line: LetterLine, letter: str, hands: tuple[str, ...]) -> LetterStrokes:
    """As the product does it."""
    return trace_letter(line, letter, hands=hands)


def without_forms(line: LetterLine, letter: str, hands: tuple[str, ...]) -> LetterStrokes:
    """Only what movements cost."""
    return trace_letter(line, letter, hands=())


def left_to_right(line: LetterLine, letter: str, hands: tuple[str, ...]) -> LetterStrokes:
    """From the leftmost end by the straightest way on; what is left over next, from its leftmost end."""
    net = build_network(line.xy, line.radius, line.density, line.edges)
    ends = range(len(net.node))
    first = min([end for end in ends if net.is_loose(end)] or ends, key=lambda end: float(net.position(end)[0]))
    (only,) = beam_search(net, line.x_height, Ends((first,)), weights=_STRAIGHT, most=1, width=1)
    strokes = tuple(chain_vertices(net, stroke) for stroke in only.strokes)
    return LetterStrokes(strokes, (False,) * len(strokes))


METHODS: dict[str, Recover] = {"ours": ours, "no forms": without_forms, "left to right": left_to_right}


def as_written(hand: ScannedHand) -> Manuscript:
    """The first page of a hand, every glyph where it was written."""
    known, scan, lines, word = layout_model(hand), hand.pages[0], dict[int, list[int]](), -1
    for number, glyph in enumerate(hand.glyphs):
        if glyph.page == 0:
            lines.setdefault(glyph.line, []).append(number)
    found = []
    for line, numbers in sorted(lines.items()):
        centres, own = hand.centres[numbers], [hand.glyphs[n].word for n in numbers]
        parted = np.array([True, *(a != b for a, b in pairwise(own))])
        forms = [known.forms[number] for number in numbers]
        joints = known.joints(numbers, parted.tolist())
        graphs = set_line(forms, [unbent()] * len(numbers), centres, joints, known.spread.x_height)
        placed = []
        for number, graph, apart in zip(numbers, graphs, parted, strict=True):
            word += bool(apart)
            xy = scan.to_picture(line, graph.xy) * scan.pixel
            ink = Ink(LineGraph(xy, graph.radius * scan.pitch, graph.density, graph.uv, graph.edges), 0, number)
            letter = Glyph(hand.glyphs[number].letter, (), (), 0.0)
            placed.append(Placed(letter, (), not apart, word, hand.glyphs[number].at, ink))
        found.append(Line("", tuple(placed), 0.0))
    return Manuscript(tuple(found), Page(scan.shape[1] * scan.pixel, scan.shape[0] * scan.pixel), scan.x_height)


def traced(hand: ScannedHand, recover: Recover, hands: tuple[str, ...] = HANDS, late: str = "letter") -> list[Array]:
    """The paths of a hand's own first page; `late` as in `pen_paths`."""
    stroke_order._MODELS.clear()
    if recover is ours:
        return _traced(hand, hands, late)

    def only(line: LetterLine, letter: str, hands: tuple[str, ...], **_: float) -> list[Candidate]:
        found = recover(line, letter, hands)
        return [Candidate(found.strokes, 0.0, lambda: (found.delayed, found.bars or found.delayed))]

    with patch.object(stroke_order, "candidates", only):
        return _traced(hand, hands, late)


def _traced(hand: ScannedHand, hands: tuple[str, ...], late: str) -> list[Array]:
    return [
        path.xy
        for line in as_written(hand).lines
        for path in pen_paths.pen_paths(line.placed, hand, hands, delayed_after=late)
    ]


def simulated(name: str, *, kept_out: bool = False) -> tuple[ScannedHand, list[Array], list[int]]:
    """A hand read from a page that `name` wrote, and the true strokes, mm on the scan, with their words."""
    layout = Layout(page("A5"), x_height=2.5)
    text, writing, reading = (KEPT_OUT, 29, 7) if kept_out else (TEXT, 11, 1)
    made = simulate(text, library.load(name), Desk(layout=layout), rng=np.random.default_rng(writing))
    found = tag_page(page_score.read(made), page_score.transcript(made), rng=np.random.default_rng(reading))
    true = [path.xy * made.truth.pixel for path in made.truth.paths]
    return hand_of_pages(name, [found]), true, [stroke.word for stroke in made.drawing.strokes]


def judged(
    hand: ScannedHand, true: Sequence[Array], words: Sequence[int], hands: tuple[str, ...] = HANDS, late: str = "letter"
) -> dict[str, Tally]:
    """Every method on a hand's own page."""
    seen = hand.pages[0].graph.uv * hand.pages[0].pixel
    return {name: tally(true, words, traced(hand, recover, hands, late), seen) for name, recover in METHODS.items()}


def recorded_letters(folder: Path) -> tuple[dict[str, Tally], dict[str, Tally]]:
    """Every method on single letters: every second one, and the others, which were kept out."""
    found = {name: Tally() for name in METHODS}, {name: Tally() for name in METHODS}
    for number, cell in enumerate(recorded.cells(recorded.letters(folder))):
        line = alone(cell)
        for name, recover in METHODS.items():
            paths = [cell.graph.xy[own] for own in recover(line, cell.recording.text, HANDS).strokes]
            found[number % 2][name] += tally(cell.strokes, [0] * len(cell.strokes), paths, cell.graph.xy)
    return found


def alone(cell: recorded.Cell) -> LetterLine:
    """The line of a recorded letter, which stands alone."""
    graph, high = cell.graph, float(np.ptp(cell.graph.xy[:, 1]))
    small = high if cell.recording.text in X_HEIGHT else 0.6 * high
    return LetterLine(graph.xy * (1, -1), graph.radius, graph.density, graph.edges, max(small, 0.5))


def recorded_words(pages: Sequence[Sequence[recorded.Recording]]) -> dict[str, Tally]:
    """Every method on pages of words, each of one writer."""
    found, told = {name: Tally() for name in METHODS}, list[tuple[bool, bool]]()
    for hand, strokes, words, _ in read_pages(pages):
        for name, result in judged(hand, strokes, words).items():
            found[name] += result
        told += guesses(hand, strokes, words)
    for said in (True, False):
        wrong = [bad for guessed, bad in told if guessed is said]
        share = sum(wrong) / max(len(wrong), 1)
        print(f"  order {'guessed' if said else 'not guessed'}: {len(wrong)} words, {share:.2f} of them not all right")
    return found


def read_pages(
    pages: Sequence[Sequence[recorded.Recording]],
) -> Iterator[tuple[ScannedHand, list[Array], list[int], dict[int, str]]]:
    """Pages of one writer each, inked and read: hands, true strokes, mm, with their words, and texts of these."""
    for some in pages:
        strokes, of = recorded.sheet(some)
        try:
            made = tag_page(
                read_page(recorded.inked(strokes)), "\n".join(r.text for r in some), rng=np.random.default_rng(1)
            )
        except InputError as error:
            print(f"  writer {some[0].source[:5]}: {len(some)} rows were not read: {error}")
            continue
        words = [100 * row + word for row, r in enumerate(some) for word in r.words or split(strokes, of, row, r.text)]
        texts = {100 * row + k: text for row, r in enumerate(some) for k, text in enumerate(r.text.split())}
        yield hand_of_pages("recorded", [made]), strokes, words, texts


def most_within(ink: Array, true: Sequence[Array], words: Sequence[int]) -> int:
    """The word in the box of whose true strokes most of some ink, (n, 2) mm, lies."""

    def share(word: int) -> float:
        own = np.concatenate([xy for xy, of in zip(true, words, strict=True) if of == word])
        return float(((ink > own.min(axis=0) - NEAR) & (ink < own.max(axis=0) + NEAR)).all(axis=1).mean())

    return max(sorted(set(words)), key=share)


def guesses(hand: ScannedHand, true: Sequence[Array], words: Sequence[int]) -> list[tuple[bool, bool]]:
    """Of each word of a hand's own page whether its order is told to be guessed, and whether it is not all right."""
    wrong = set(tally(true, words, traced(hand, ours), hand.pages[0].graph.uv * hand.pages[0].pixel).wrong)
    found = []
    for line in as_written(hand).lines:
        told = {facts["at"] for facts in pen_paths.list_guessed(line.placed, hand)}
        for _, units in groupby(line.placed, key=lambda unit: unit.word):
            letters = list(units)
            ink = np.concatenate([unit.ink.graph.xy for unit in letters if unit.ink is not None])
            found.append((letters[0].at in told, most_within(ink, true, words) in wrong))
    return found


def split(strokes: Sequence[Array], of: Indices, row: int, text: str) -> Iterator[int]:
    """The word of each stroke of a row: wide gaps part them, about where the text has its spaces."""
    own = [strokes[i] for i in np.flatnonzero(of == row).tolist()]
    bounds = sorted((float(xy[:, 0].min()), float(xy[:, 0].max())) for xy in own)
    gaps, right = [], bounds[0][1]
    for low, high in bounds[1:]:
        gaps.append((low - right, (low + right) / 2))
        right = max(right, high)
    letter = (right - bounds[0][0]) / len(text)
    spaces = [bounds[0][0] + (i + 0.5) * letter for i, unit in enumerate(text) if unit == " "]

    def fit(chosen: Sequence[tuple[float, float]]) -> float:
        return sum(gap - _ASTRAY * abs(x - space) for (gap, x), space in zip(chosen, spaces, strict=True))

    cuts = [x for _, x in max(combinations(gaps, len(spaces)), key=fit)]
    yield from (int(np.searchsorted(cuts, float(xy[:, 0].mean()))) for xy in own)


def seconds() -> tuple[float, float]:
    """CPU seconds that it takes to compose a page of 300 words, and from that to its drawing."""
    from handout.motion.trace import trace
    from handout.writing.compose import compose

    hand, rng = library.find("house-joined-ballpoint"), np.random.default_rng(1)
    assert isinstance(hand, ScannedHand)
    for name in HANDS:
        library.load(name)
    text = (Path(__file__).parent / "three-hundred-words.txt").read_text(encoding="utf-8")
    clock = [time.process_time()]
    sheet, *_ = compose(text, hand, Layout(page("A4")), rng)
    clock.append(time.process_time())
    trace(sheet, hand, rng)
    composing, tracing = np.diff([*clock, time.process_time()]).tolist()
    return composing, tracing


def main() -> None:
    """Print the table."""
    names = f"{'strokes':>9}{'found':>8}{'direction':>11}{'words':>7}{'in order':>10}{'all right':>11}"
    print(f"{'':<42}{names}{'less marks':>12}{'off ink':>9}{'lifts kept':>12}")
    for name in HANDS:
        for kept_out in (False, True):
            hand, true, words = simulated(name, kept_out=kept_out)
            others = tuple(other for other in HANDS if other != name)
            said = name + ", kept out" * kept_out
            _print(said, judged(hand, true, words, others, library.load(name).delayed_after))
    given = os.environ.get("HANDOUT_DATA")
    folder = Path(given) / "pen" / "unipen" if given else None
    if folder is None or not folder.is_dir():
        print("HANDOUT_DATA names no folder with recorded pens: simulated pages only.")
    else:
        for said, tallies in zip(("letters", "letters, kept out"), recorded_letters(folder), strict=True):
            _print(f"recorded {said}", tallies)
        _print("recorded English", recorded_words(recorded.english(folder)))
        _print("recorded German", recorded_words(recorded.writers(recorded.words(folder))))
    composing, tracing = seconds()
    share = tracing / composing
    print(f"300 words to a drawing: {share:.2f} of the time to compose them (goal 1.4); {tracing:.1f} s CPU (goal 5)")


def _print(what: str, found: dict[str, Tally]) -> None:
    for name, one in found.items():
        share, (off, kept) = one.shares(), one.drawing()
        print(
            f"{what + ', ' + name:<42}{one.strokes:>9}{share[0]:>8.3f}{share[1]:>11.3f}{one.words:>7}"
            f"{share[2]:>10.3f}{share[3]:>11.3f}{one.bodies / max(one.words, 1):>12.3f}{off:>9.4f}{kept:>12.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
