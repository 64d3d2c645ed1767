"""Sentences that several verbs end with, made of the figures of a result."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from textwrap import shorten
from typing import TYPE_CHECKING

from handout import units
from handout.pipeline.results import Tally

if TYPE_CHECKING:
    from handout.pipeline.plotting import Plotted

_MANY = 20  # characters: where more than one word in so many is a guess of its order, that is said
_LONGEST_TEX = 60  # characters of a formula that is named


def names(files: Iterable[object]) -> str:
    """The names of some files."""
    return ", ".join(map(str, files))


def writing_time(tally: Tally) -> str:
    """How long the writing would take by hand; "" where strokes are not known."""
    return f"{units.duration(tally.duration)} of writing; " if tally.strokes else ""


def tell_plotted(result: Plotted) -> str:
    """What was plotted, how long it took, what is to be said of its letters, and how faithful it was."""
    took = f"{units.count(result.sheets, 'sheet')} in {units.duration(result.executed_s)}"
    return f"Plotted {took}; seed {result.seed}.{tell_letters(result.tally)}\n{result.fidelity}".strip()


def tell_size(tally: Tally) -> str:
    """How much smaller than asked for texts were written; "" where none was."""
    if not tally.shrunk:
        return ""
    least, many = f"{min(tally.shrunk):.0%}", f"{len(tally.shrunk)} of {tally.pages} pages"
    if tally.pages == 1:
        return f" Written at {least} of its size, so that it fits."
    return f" Written smaller: {many}, down to {least} of their size, so that all fits."


def tell_letters(tally: Tally) -> str:
    """What is said of a smaller size, of letters lent or doubtful, of words that may be misread, slips, formulas."""
    formulas = ""
    if tally.formulas:
        first, count = shorten(tally.formulas[0], _LONGEST_TEX, placeholder=" …"), len(tally.formulas)
        formulas = (
            f" Taken as {'a formula:' if count == 1 else f'{count} formulas, the first'} {first}; \\$ is the sign."
        )
    slips = f" {units.count(len(tally.slips), 'slip')} of the pen struck out." if tally.slips else ""
    order, guessed = "", len(tally.order)
    if _MANY * guessed > tally.characters:
        order = (
            f" The ink does not tell the order of the strokes in {units.count(guessed, 'word')}, among them "
            f"{tally.order[0]['word']}: it is guessed; say in the studio, letter by letter, how one is written, and "
            "its like follow."
        )
    inks = ""
    if tally.other_inks:
        named = units.listed(letter + _times(count) for letter, count in Counter(tally.other_inks).items())
        inks = f" In another ink, as the author wrote none in the usual one: {named}; --pen ballpoint has one ink."
    return f"{tell_size(tally)}{tell_lent(tally)}{tell_doubts(tally)}{inks}{slips}{order}{formulas}"


def tell_lent(tally: Tally) -> str:
    """What was written for characters that the hand lacks, or doubts, in some sentences; "" where there are none."""
    by_source: dict[str, list[tuple[str, int]]] = {}
    for (letter, source), count in tally.lent_letters.items():
        by_source.setdefault(source, []).append((letter, count))
    alone = [f"{forms[0][0]} ({source}{_times(forms[0][1])})" for source, forms in by_source.items() if len(forms) == 1]
    sentence = f" Lent to the hand: {', '.join(alone)}." if alone else ""
    for source, forms in by_source.items():
        if len(forms) > 1:
            letters = [f"{letter} ({count} times)" if count > 1 else letter for letter, count in forms]
            sentence += f" Lent to the hand, {source}: {', '.join(letters)}."
    gone = [letter + _times(count) for letter, count in tally.left_out.items()]
    sentence += f" Left out, since the hand has no form for it: {', '.join(gone)}." if gone else ""
    doubtful = [letter + _times(count) for letter, count in tally.doubtful_letters.items()]
    return sentence + (
        f" All that the hand has are doubtful of: {', '.join(doubtful)}; --fallback lends others, and `handout hand "
        "prompt --for` makes a sheet to write them again."
        if doubtful
        else ""
    )


def tell_doubts(tally: Tally) -> str:
    """One sentence about the words that strangers may misread; "" where there are none."""
    if not tally.doubtful:
        return ""
    named = units.listed(f"{doubt['word']} as {doubt['reads_as'] or 'nothing'}" for doubt in tally.doubtful)
    (letter, count), *_ = Counter(doubt["letter"] for doubt in tally.doubtful).most_common(1)
    return (
        f" May be misread: {named}{f' ({count} for {letter})' if 1 < count < len(tally.doubtful) else ''}; "
        "other seeds choose other letters, --legible clearer ones."
    )


def _times(count: int) -> str:
    return f", {count} times" if count > 1 else ""


def tell_hooks(told: Mapping[str, float]) -> str:
    """What of the time of a plot is for dips and the like, as a part of a sentence; "" for nothing."""
    if "hooks_s" not in told:
        return ""
    what = units.count(int(told["dips"]), "dip") if told["dips"] else "hooks"
    return f", {units.duration(told['hooks_s'])} of it for {what}"
