"""`handout hand`: hands read from scans or recorded pens, listed, shown, checked, corrected, given away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import click

from handout import units
from handout.cli import sentences
from handout.cli.console import Console
from handout.cli.options import JSON, LISTENING, UNSEEN, verb
from handout.pipeline.declarations import argument, bundle, option, output
from handout.pipeline.options import PictureOptions, PromptOptions, ReadingOptions, WritingOptions

if TYPE_CHECKING:
    from handout.pipeline.results import Told

_NAMED = 8  # letters that changed and are named; the others are in the JSON
_LEAST_SURE = 0.7  # share of letters that are not doubtful, below which a look is advised; set by eye


@click.group("hand")
def command() -> None:
    """List and show hands, make sheets to write one on, and read them from scanned pages."""


@verb("prompt", command)
def make_prompt(
    console: Console,
    output: str = output("The PDF file for the sheets."),
    prompting: PromptOptions = PromptOptions(),
    verbose: bool = option(
        False, "A table of how often each letter and pair will be there.", flags=("--verbose", "-v")
    ),
) -> None:
    """Make sheets to write on, so that a scan of them becomes a hand.

    The sentences are chosen so that few pages hold as many instances of every letter and pair as possible. Print the
    sheets at their true size, copy each line, and scan them in colour at 300 dpi or more; marks and codes on the sheets
    say what was to be written where. With --verbose a table says how often each letter and pair will
    be there.

    \b
    handout hand prompt -o prompt.pdf
    handout hand prompt -o prompt.pdf --pages 6 --also äöüß€ --target my-letters.txt
    handout hand prompt -o again.pdf --for me.hand
    """
    from handout.pipeline.prompts import prompt

    result = prompt(output, prompting)
    coverage = result.coverage
    if verbose and not console.as_json:
        click.echo(f"{coverage.table()}\n{coverage.summary()}")
    hint = "" if verbose or console.as_json else " (--verbose lists them)"
    told, minutes = result.told, result.told["minutes"]
    # as they are known: to 5, or to one where there are few
    about = units.count(5 * round(minutes / 5) if minutes >= 10 else max(1, round(minutes)), "minute")
    pages = units.count(told["pages"], "page")
    sheets = f"Wrote {sentences.names(result.files)}: {pages}, {told['words']} words, about {about} of writing"
    if again := told.get("write_again"):
        console.report(result, f"{sheets}, for what {prompting.hand} has few sure ones of: {' '.join(again)}.")
    else:
        console.report(result, f"{sheets}; {coverage.short()} fewer than {coverage.least} times{hint}.")


@verb("read", command)
def read_hand(
    console: Console,
    name: str,
    scans: tuple[str, ...] = option(
        (),
        "A scanned page: PNG, JPEG, TIFF, PDF; of several pages all, or FILE:2, or FILE:2-4. Repeatable.",
        flags=("--scan",),
    ),
    inks: tuple[str, ...] = option(
        (), "A recorded pen: .inkml .dat .svc .gml .svg .json; or a single-line SVG font. Repeatable.", flags=("--ink",)
    ),
    texts: tuple[str, ...] = option(
        (), "A text file with what is on it, line by line; in the same order.", flags=("--text",)
    ),
    output: str = output("The .hand file."),
    reading: ReadingOptions = ReadingOptions(),
) -> None:
    """Read a hand from scanned pages, or from recordings of a pen, and their texts, and call it NAME.

    A sheet made with `handout hand prompt` needs no text: it says itself what is written on it, and may be
    photographed. A recording with labels of texts or words, as UNIPEN has, needs none either, nor does a
    font. Words that were struck out are ~~marked so~~ in the text. Look at what was found with `handout hand check`.

    \b
    handout hand read mine --scan page1.png --text page1.txt --scan page2.png --text page2.txt -o mine.hand
    handout hand read mine --scan both.pdf --text page1.txt --text page2.txt -o mine.hand
    handout hand read mine --scan sheet1.png --scan sheet2.png -o mine.hand
    handout hand read mine --ink page.inkml --text page.txt -o mine.hand
    """
    from handout.pipeline import hands

    with console.working():
        result = hands.read(name, scans, texts, output, reading, inks=inks, listener=console)
    hand, path, doubtful = result.hand, result.files[0], len(result.told["doubtful"])
    missing = sum(len(page["missing"]) for page in result.told["found"])
    sentence = (
        f"Wrote {path}: {units.count(len(hand.glyphs), 'letter')} on {units.count(len(hand.pages), 'page')}, "
        f"{len(hand.letters)} different ones; {doubtful} doubtful, {missing} not found."
    )
    if doubtful + missing > (1 - _LEAST_SURE) * len(hand.glyphs):
        sentence += f" Many are doubtful: look at them with `handout hand check {path} -o overlay.png`."
    console.report(result, sentence)


@command.group("signature")
def signature() -> None:
    """Signatures for letters: scribbles that are scanned once."""


@verb("add", signature)
def add_signature(
    console: Console,
    name: str,
    scan: str,
    dpi: float | None = option(None, "Pixels an inch of the scan, where the file does not say."),
    again: bool = option(False, "Replace the signature of that name."),
) -> None:
    """Keep the signature on a SCAN, which shows nothing else, as NAME; a letter has it as ::: signature NAME.

    \b
    handout hand signature add ben scan.png
    """
    from handout.pipeline import signatures

    result = signatures.add_signature(name, scan, dpi, again=again)
    told = result.told
    console.report(result, f"Wrote {told['path']}: {told['width']:.0f} x {told['height']:.0f} mm.")


@verb("list", signature)
def list_signatures(console: Console) -> None:
    """The signatures that are kept."""
    from handout.pipeline import signatures

    result = signatures.list_signatures()
    console.report(result, "\n".join(result.told["names"]) or "No signature is kept.")


@verb("list", command)
def list_(as_json: bool = JSON) -> None:
    """The hands that are known by name: drawn ones and scanned ones, the program's and your own."""
    from handout.pipeline.kept_hands import list_hands

    hands = list_hands()
    if as_json:
        Console(as_json, quiet=True).report(hands, "")
        return
    listed = [*hands.drawn, *hands.scanned]
    width = max(len(hand.name) for hand in listed)
    for hand in listed:
        click.echo(f"{hand.name:<{width}}  {hand.title}; {hand.about}")


@verb("show", command)
def show(
    console: Console,
    name: str,
    output: tuple[str, ...] = output("A file for the sheet: .png .svg .pdf …"),
    text: str | None = option(None, "Of a scanned hand: show which of its letters would write this, and why."),
    writing: WritingOptions = bundle(WritingOptions(), leave_out=("slips",)),
    picture: PictureOptions = PictureOptions(),
) -> None:
    """Write a specimen sheet of the hand NAME at three times its size: every form of every character, and text.

    Of a scanned hand, or a .hand file, its letters side by side, as PNG; with --text, for every letter of it those
    that might have been taken, what each would have cost, and the one that was.

    \b
    handout hand show house-joined -o sheet.png
    handout hand show me.hand --text "quick" -o choices.png
    """
    from handout.pipeline.kept_hands import show_hand

    result = show_hand(name, output, text, writing, picture)
    sentence = f"Wrote {sentences.names(result.files)}"
    if forms := result.told.get("forms"):
        sentence += f": {units.count(forms, 'form')}; seed {result.seed}."
    elif "letters" in result.told:
        letters, different = units.count(result.told["glyphs"], "letter"), len(result.told["letters"])
        sentence += f": {letters}, {different} different ones."
    else:
        sentence += f".{sentences.tell_lent(result.tally)}"
    console.report(result, "\n".join([*result.told.get("why", ()), sentence]))


@verb("check", command)
def check(
    console: Console,
    name: str,
    output: str | None = output(
        "A PNG file for the pages with what was found; several pages are numbered.", required=False
    ),
    text: str | None = option(
        None, "A text to be written: says how it comes by letters that are missing.", flags=("--for",)
    ),
    sheet: str | None = option(
        None, "A PNG file for the letters that may read badly, in words that are written with them."
    ),
    questions: int | None = option(None, "Rows of that sheet; default: 24.", least=1, most=200),
) -> None:
    """Show what the scanned hand NAME (or a .hand file) holds, and what of it is doubtful.

    In the picture each letter is named: blue and green where sure, orange where doubtful, red where refused (it is not
    written while another stands), ligatures and what belongs to no letter in grey. A pixel of it is one of the scan, as
    corrections count them. Letters of which few are sure are named: `handout hand prompt --for NAME` makes a sheet of
    exactly those.

    With --sheet words are written in the hand and read; a row of the sheet is a question: does the underlined letter
    read as the one that is named? Those come first that harm most. `handout hand answer` takes the answers.

    \b
    handout hand check mine.hand -o overlay.png --for "Quick zebras jump"
    handout hand check mine.hand --sheet sheet.png
    handout hand answer mine.hand sheet.json 1 4b 7=o
    """
    from handout.pipeline.kept_hands import check_hand

    if questions is not None and sheet is None:
        raise click.UsageError("--questions is the number of rows of --sheet.")
    result = check_hand(name, output, text, sheet, questions or 24)
    if not console.as_json and not console.quiet:
        click.echo(result.table)
    console.report(result, _tell_check(result.told))


def _tell_check(told: Told) -> str:
    """What a hand holds, and what a text would lack."""
    rare, least = told["short"], told["least"]
    many = {entry["letter"]: entry["total"] for entry in told["letters"]}
    lines = [
        f"{told['name']}: {units.count(told['glyphs'], 'letter')} on {units.count(len(told['pages']), 'page')}, "
        f"{len(told['doubtful'])} doubtful; {len(rare)} of {len(many)} fewer than {least} times"
        + (": " + " ".join(f"{letter}({many[letter]})" for letter in rare) if rare else "")
        + (f"; {told['kept_out']} not to be written" if told["kept_out"] else "")
        + "."
    ]
    if told["write_again"]:
        few = " ".join(f"{letter}({sure})" for letter, sure in told["write_again"].items())
        lines.append(f"Fewer than {least} are sure of {few}: `handout hand prompt --for` makes a sheet of those.")
    if told["unclear"]:
        lines.append(f"Strangers mostly take for other letters: {', '.join(told['unclear'])}.")
    if "lacks" in told:
        elsewhere = sorted({f"{lack['letter']} ({lack['place']})" for lack in told["lacks"] if lack["anywhere"]})
        lines += _tell_supply(told["supply"])
        if elsewhere:
            lines.append(f"In another place of a word only: {', '.join(elsewhere)}.")
    if told["files"]:
        lines.append(f"Wrote {sentences.names(told['files'])}.")
    return "\n".join(lines)


def _tell_supply(supply: Sequence[Mapping[str, str]]) -> list[str]:
    """How a text comes by the letters that its hand lacks."""
    if not supply:
        return ["Every letter of that text is there."]
    composed, borrowed, doubted = (
        ", ".join(f"{way['letter']} ({way['from']})" for way in supply if way["how"] == how)
        for how in ("composed", "lent", "doubted")
    )
    missing = ", ".join(way["letter"] for way in supply if way["how"] == "missing")
    lines = [f"Put together from what the author wrote: {composed}."] if composed else []
    lines += [f"Lent with --fallback, as the author never wrote it: {borrowed}."] if borrowed else []
    lines += [f"Lent with --fallback, as all that the author wrote are doubtful: {doubted}."] if doubted else []
    lines += [f"For that text there is no {missing}, and nothing to lend for it."] if missing else []
    return lines


@verb("tag", command)
def tag(
    path: str,
    port: int | None = LISTENING,
    no_browser: bool = UNSEEN,
) -> None:
    """Correct the letters of the hand PATH, a .hand file, in the browser: the studio, at Correct letters.

    \b
    handout hand tag mine.hand
    """
    from pathlib import Path

    from handout.cli.studio_ import open_studio

    open_studio((path,), f"letters/{Path(path).stem}", port, not no_browser, as_json=False)


@verb("answer", command)
def answer(
    console: Console,
    name: str,
    sheet: str,
    answers: tuple[str, ...] = argument(required=True),
    output: str | None = output("Another .hand file for the result; default: the same.", required=False),
) -> None:
    """Say which letters of a SHEET of the hand NAME read badly; SHEET is the .json that `handout hand check` wrote.

    7 has none of the letters of row 7 written any more, 7b not the one in its word b, 7b1 not the first letter of that
    word; 7b=o says that it is an o. `handout hand edit --undo` takes them back.

    \b
    handout hand check mine.hand --sheet sheet.png
    handout hand answer mine.hand sheet.json 1 4b 7=o
    """
    from handout.pipeline import kept_hands

    with console.working():
        result = kept_hands.answer_questions(name, sheet, answers, output, listener=console)
    console.report(result, _tell_edit(result.told))


@verb("edit", command)
def edit(
    console: Console,
    name: str,
    corrections: str | None,
    output: str | None = output("Another .hand file for the result; default: the same.", required=False),
    undo: bool = option(False, "Take back what was corrected last."),
    redo: bool = option(False, "Make again what was taken back last."),
    history: bool = option(False, "Say what was corrected, and what else that changed."),
    no_learning: bool = option(False, "Do what the corrections say, and leave all other letters."),
) -> None:
    """Make the corrections of a JSON file to the hand NAME (or a .hand file), and learn from them.

    The pages that they are on are aligned anew; what else changed is said. CORRECTIONS may be a .hand file, too: of the
    same pages, read before. Places are pixels of the scan, as in the picture of `handout hand check`; pages are
    numbered from 0.

    \b
    {"corrections": [{"do": "label", "page": 0, "at": [812, 440], "text": "e"},
                     {"do": "confirm", "page": 0, "at": [640, 442]},
                     {"do": "keep_out", "page": 0, "at": [702, 441]},
                     {"do": "remove", "page": 0, "at": [90, 1300]},
                     {"do": "merge", "page": 0, "at": [300, 200], "other": [320, 204]},
                     {"do": "split", "page": 0, "a": [500, 600], "b": [505, 660], "texts": ["r", "n"]},
                     {"do": "paint", "page": 0, "to": "paper", "stroke": [[90, 80], [99, 84]], "width": 9}]}
    Others: outline (within, text), unlink (at), link (at, other), place (at, place: start, middle, end or alone),
    strokes (at, ways), baseline (line, a, b), rule (a, b, width), cut (a, b), join (at, other); paint takes a polygon,
    and ink, too.

    `confirm` says that a letter is what it is called and cut as it should be: it is refused no longer, and no likelier
    to be written. `keep_out` says that, too, and has it written no more ("out": false: again).
    """
    from handout.pipeline import kept_hands

    if sum((corrections is not None, undo, redo, history)) != 1:
        raise click.UsageError("Give a file of corrections, or one of --undo, --redo and --history.")
    lines = list[str]()
    if corrections is not None:
        with console.working():
            result = kept_hands.edit_hand(name, corrections, output, learning=not no_learning, listener=console)
    elif history:
        result = kept_hands.edits(name)
        for number, entry in enumerate(result.told["journal"], 1):
            kinds = ", ".join(correction["do"] for correction in entry["corrections"])
            undone = "" if entry["in_force"] else " (taken back)"
            lines.append(f"{number}{undone}: {kinds}; {_tell_changes(entry['changes'])}")
        lines = lines or [f"{result.told['files'][0]}: nothing was corrected."]
    else:
        result = kept_hands.undo_edits(name, 1 if undo else -1, output, listener=console)
    console.report(result, "\n".join(lines) or _tell_edit(result.told))


def _tell_edit(told: Told) -> str:
    """What was corrected, or taken back, and what else that changed."""
    wrote, total = f"Wrote {told['files'][0]}", told["corrections"]
    if not told["made"]:
        entries = sum(not entry["in_force"] for entry in told["journal"])
        more = f"; {units.count(entries, 'entry', 'entries')} can be made again" if entries else ""
        return f"{wrote}: {units.count(total, 'correction')} in force{more}."
    return f"{wrote}: {units.count(told['made'], 'correction')} made, {total} in all; {_tell_changes(told['changes'])}"


def _tell_changes(changes: Sequence[Told]) -> str:
    if not changes:
        return "no other letter changed."
    named = (f"{one['letter']} in “{one['word']}” (line {one['line'] + 1}, {one['how']})" for one in changes)
    return f"{units.count(len(changes), 'other letter')} changed: {units.listed(named, _NAMED)}."


@verb("pen", command)
def pen(
    console: Console,
    scans: tuple[str, ...] = argument(required=True, metavar="SCAN..."),
    output: str = output("The .hand file."),
    dpi: float | None = option(None, "Pixels an inch of the scans, where the files do not say."),
) -> None:
    """Keep a pen, to write in a scanned hand with: from scans of anything drawn with it, without a text.

    Half a page of loose waves, loops and strokes in all directions is enough, not over each other.

    \b
    handout hand pen scribble.png -o pen.hand
    """
    from handout.pipeline.kept_hands import keep_pen

    result = keep_pen(scans, output, dpi)
    width, pieces = result.details["width"], result.details["pieces"]
    console.report(result, f"Wrote {result.path}: a line {width:.2f} mm wide, {pieces} pieces of it.")


@verb("export", command)
def export(
    console: Console,
    name: str,
    output: str = output("The .hand file."),
    ink_only: bool = option(False, "Without the scans that it keeps beside the ink."),
) -> None:
    """Copy the scanned hand NAME into a file, to be given to somebody or kept."""
    from handout.pipeline.kept_hands import export_hand

    result = export_hand(name, output, ink_only=ink_only)
    console.report(result, f"Wrote {result.path}.")


@verb("import", command)
def import_(
    console: Console,
    source: str = argument(metavar="FILE"),
    name: str | None = option(None, "Call it so; default: the name of the file."),
    replace: bool = option(False, "In place of one that is there under that name."),
) -> None:
    """Put a .hand FILE among your own hands, so that its name is enough to use it."""
    from handout.pipeline.kept_hands import import_hand

    result = import_hand(source, name, replaced=replace)
    console.report(result, f"{result.name}: {units.count(result.letters, 'letter')}; kept in {result.path}.")


@verb("remove", command)
def remove(console: Console, name: str) -> None:
    """Delete the scanned hand NAME from among your own hands."""
    from handout.pipeline.kept_hands import remove_hand

    result = remove_hand(name)
    console.report(result, f"Deleted {result.path}.")
