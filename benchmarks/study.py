"""A study with simulated people: are their ticks read right, and do the figures give back how good they are?

Alone it does a little of both.  `reading(people, first)`: sheets are printed, filled in, scanned by the simulated
flatbed, and read; seeds below 100 are those that the reader was fitted on.  `answering(runs)`: answers of people of
known skill are scored, and how often the intervals hold the truth is counted.  `whole(folder, skill)`: the sheets of a
study that `handout study make --about` made are filled in, scanned into that folder, read and scored.
`coverage(runs)`: small studies of people of known skill go all that way in memory, each with sheets, people and pens
of its own, and how often the intervals hold that skill is counted; twelve seconds a run.

The sheets of `reading` show scribbles, since nobody looks at them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.prompting.sheet_layout import PAPERS
from handout.scanning.pdf_pages import drawn_page
from handout.simulated.printer import Inkjet
from handout_lab.author.worn_flatbed import WornFlatbed
from handout_lab.study import answers, design, participant, scoring, sheets
from handout_lab.study.design import Key, Person, Snippet
from handout_lab.study.figure import figure
from handout_lab.study.participant import Participant
from handout_lab.study.snippets import Picture

SLIPS = 0.12  # of rows that are marked otherwise than asked
PRINTED_DPI = 300.0
OFTEN = (0.3, 0.4, 0.3)  # how often people scan at 150, 200 and 300 dpi
COARSE, QUICK = (0.7, 0.3, 0.0), 200.0  # the same, and the dpi of print, where many sheets are scanned
LETTER_WIDE = 168  # pixels of 20 dpi: A4 has fewer


def key(people: int, snippets: int, seed: int, envelopes: int = 15, pairs: int = 10) -> Key:
    """A study of nothing."""
    rng = np.random.default_rng(seed)
    plans = design.dealt([range(snippets)], people, 10, pairs, rng)
    seen = design.envelopes(envelopes, (envelopes + 1) // 2, people, rng)
    everybody = tuple(Person(a, b, c) for (a, b), c in zip(plans, seen, strict=True))
    words = tuple(Snippet(k % 3, 0, k, f"words {k}", 0) for k in range(snippets))
    return Key(seed, ("one", "two", "three"), words, everybody)


def scribbles(count: int, rng: np.random.Generator) -> list[Picture]:
    """Pictures as of words."""
    import cv2

    found = []
    for _ in range(count):
        picture = np.full((120, 700, 3), 255, dtype=np.uint8)
        at = np.cumsum(rng.normal((9, 0), (6, 12), (70, 2)), axis=0) + np.array([10, 60])
        cv2.polylines(picture, [np.clip(at, 4, (690, 115)).astype(np.int32).reshape(-1, 1, 2)], False, (60, 50, 90), 4)
        found.append(Picture(picture, 80.0, 300.0))
    return found


def scanner(rng: np.random.Generator, often: tuple[float, float, float] = OFTEN) -> tuple[WornFlatbed, float]:
    """A flatbed with faults of its own, and its resolution; `often`: shares of 150, 200 and 300 dpi."""
    dpi = float(rng.choice([150, 200, 300], p=often))
    turned = float(rng.choice([0, np.pi / 2, np.pi, -np.pi / 2], p=[0.6, 0.1, 0.2, 0.1]) + rng.normal(0, 0.02))
    bed = WornFlatbed(
        gamma=float(rng.uniform(1.8, 2.4)), blur=float(rng.uniform(0.03, 0.08)), noise=float(rng.uniform(0.002, 0.015)),
        shading=float(rng.uniform(0, 0.15)), rotation=turned, slack=2.0, border=float(rng.uniform(3, 12)),
        lid=float(rng.uniform(0.2, 0.95)), warp=float(rng.choice([0, 0.3, 0.8])), dust=float(rng.choice([0, 3, 12])),
        white=float(rng.uniform(0.9, 1.1)), grey=bool(rng.random() < 0.3), jpeg=int(rng.choice([0, 60, 85])),
        contrast=float(rng.choice([0.0, 0.5])),
    )  # fmt: skip
    return bed, dpi


@dataclass
class Scanned:
    """A sheet as it was scanned, with what was done to its rows."""

    picture: NDArray[np.uint8]
    record: sheets.SheetRecord
    doings: list[participant.Doing]


def scanned(
    made: Key,
    number: int,
    study: str,
    pdf: tuple[bytes, int],
    told: float | dict[str, list[str]],
    rng: np.random.Generator,
    quick: bool = False,
) -> Iterator[Scanned]:
    """The sheets of a person (from 1), filled in and scanned.

    pdf : the file, and pages in it before his; told : what he answers in each questionnaire, or how skilled he is.
    quick : print and scan coarsely, and leave the cover out.
    """
    person, who = made.people[number - 1], Participant.anyone(rng)
    page = PAPERS[0] if drawn_page(Path("sheets.pdf"), 1, 20.0, pdf[0]).shape[1] < LETTER_WIDE else PAPERS[1]
    meant = participant.answered(person, told, rng) if isinstance(told, float) else told
    printed_dpi, often = (QUICK, COARSE) if quick else (PRINTED_DPI, OFTEN)
    for at, record in enumerate(sheets.records(page, study, number, person, about=True), 1):
        if quick and record.kind == sheets.COVER:
            continue
        rows = sheets.rows(page, record)
        doings = []
        for row in rows:
            options = meant.get(record.kind)
            choice = row.answers.index(options[row.number - 1]) if options else int(rng.integers(len(row.answers)))
            doings.append(participant.doing(who, choice, len(row.answers), SLIPS, rng))
        printer = Inkjet(str(rng.choice(["white", "cream", "recycled"])))
        sheet = printer.print_page(drawn_page(Path("sheets.pdf"), pdf[1] + at, printed_dpi, pdf[0]), printed_dpi)
        bed, dpi = scanner(rng, often)
        picture = np.asarray(bed.scan(participant.filled(sheet, rows, doings, who, rng), dpi, rng), dtype=np.uint8)
        yield Scanned(picture, record, doings)


def of_nothing(
    made: Key,
    number: int,
    study: str,
    rng: np.random.Generator,
    told: float | dict[str, list[str]] = 0.6,
    quick: bool = False,
) -> Iterator[Scanned]:
    """The sheets of a person, with scribbles for writing, on either paper."""
    page = PAPERS[int(rng.integers(len(PAPERS)))]
    pictures = scribbles(4, rng)
    shown = {(k, kind): (pictures[k % 4], 1.0) for k in range(len(made.snippets)) for kind in ("real", "made")}
    show = sheets.Show(shown, {0: (pictures[0], 1.0)}, "A study")
    person = made.people[number - 1]
    records = sheets.records(page, study, number, person, about=True)
    pdf = sheets.to_pdf(page, [(record, person) for record in records], show)
    yield from scanned(made, number, study, (pdf, 0), told, rng, quick)


def whole(folder: Path, skill: float) -> None:
    """A study that `handout study make --about` made, from the paper to its figures."""
    from PIL import Image

    from handout_lab.pipeline import study as pipeline

    data = (folder / "study.key").read_bytes()
    made, name, pdf = design.opened(folder / "study.key"), design.name_of(data), (folder / "sheets.pdf").read_bytes()
    scans = folder / "scans"
    scans.mkdir()
    before = 0
    for number in range(1, len(made.people) + 1):
        rng = np.random.default_rng([number, 6])
        for page in scanned(made, number, name, (pdf, before), skill, rng):
            Image.fromarray(page.picture).save(scans / f"{number:03d}-{page.record.page}.png")
            last = page.record.pages
        before += last
    read = pipeline.read([scans], folder / "answers.csv")
    scored = pipeline.score(folder / "answers.csv", output=folder / "figure.svg")
    print(f"{read.sheets} sheets, {len(read.answers)} rows, {len(read.doubtful)} doubtful, unread {read.unread}")
    for kind, each in scored.scores.items():
        share = each.share
        held = "held" if share.both[0] <= skill <= share.both[1] else "missed"
        print(f"{kind}: skill {skill}, {share.right} of {share.of}, {share.both}: {held}")


def reading(people: int, first: int) -> None:
    """Count ticks that are read right."""
    made = key(people, 24, first)
    counts, wrong = Counter[str](), []
    for number in range(1, people + 1):
        rng = np.random.default_rng([first + number, 4])
        pages = list(of_nothing(made, number, "0123456789ab", rng))
        read, truth = [], {}
        for page in pages:
            try:
                read.append(one := answers.read_sheet(page.picture, f"person {number}, page {page.record.page}"))
            except Exception as error:  # counted, and shown
                counts["pages lost"] += 1
                wrong.append(f"person {number}, page {page.record.page}: {error}")
                continue
            assert one.record == page.record
            for row, done in zip(one.rows, page.doings, strict=True):
                kind = "P" if page.record.kind == sheets.COVER else page.record.kind
                item = row.row.questionnaire if kind == "P" else str(row.row.number)
                truth[number, kind, item] = (row, done)
        found, _ = answers.answers(read)
        for answer in found:
            row, done = truth[answer.place]
            counts[verdict := judged(answer, row, done)] += 1
            if not verdict.endswith("right") and "doubtful, as" not in verdict:
                shares = [f"{m.share:.3f} {m.depth:.2f} {m.sides:.2f}" for m in row.marks or ()]
                wrong.append(f"{answer.place} {verdict}: {answer.why}; {shares} {done.marks}")
    plain = sum(n for what, n in counts.items() if what.startswith("plain"))
    print(f"{people} people from seed {first}: {dict(counts)}")
    print(f"of {plain} rows whose answer is plain {counts['plain, read right'] / plain:.4f} read right")
    print("\n".join(wrong))


def judged(answer: answers.Answer, row: answers.ReadRow, done: participant.Doing) -> str:
    """What became of a row."""
    if done.answer is None:
        return "not plain, doubtful, as it should" if not answer.answer else "not plain, but decided"
    if not answer.answer:
        return "plain, but doubtful"
    return "plain, read right" if answer.answer == row.row.answers[done.answer] else "plain, read WRONG"


@cache
def middle_of(skill: float, spread: float) -> float:
    """The mean of a normal variable of that spread whose logistic has the mean `skill`."""
    z = np.random.default_rng(0).normal(0, spread, 100_000)
    middles = np.linspace(-2, 2, 401)
    means = [float(np.mean(1 / (1 + np.exp(-(middle + z))))) for middle in middles]
    return float(np.interp(skill, means, middles))


def told(made: Key, skill: float, people: float, snippets: float, rng: np.random.Generator) -> list[scoring.Judgement]:
    """Answers to A and B of people whose mean skill is known; on logits people and snippets differ by so much.

    skill : the mean share that is right, over all people and snippets that there could be.
    """
    ease = rng.normal(0, snippets, (len(made.snippets), 2))
    middle = middle_of(skill, float(np.hypot(people, snippets)))
    found = []
    for number, person in enumerate(made.people, 1):
        own = middle + rng.normal(0, people)
        for column, kind in enumerate((design.SINGLES, design.PAIRS)):
            for item in person.items(kind):
                right = rng.random() < 1 / (1 + np.exp(-(own + ease[item.snippet, column])))
                said = participant.said(item, sheets.ANSWERS[kind], bool(right))
                found.append(scoring.Judgement(number, kind, item.snippet, item.condition, "", item.truth, said))
    return found


def answering(runs: int) -> None:
    """How often the intervals hold the skill that was put in, at the level of answers."""
    for people, snippets in ((0.0, 0.0), (0.5, 0.0), (0.5, 0.5)):
        for skill in (0.54, 0.75):
            held, width = Counter[str](), Counter[str]()
            for run in range(runs):
                rng = np.random.default_rng([run, 11])
                judged = told(key(60, 40, run, envelopes=0), skill, people, snippets, rng)
                share = scoring.share_of([one for one in judged if one.questionnaire == design.SINGLES])
                for kind in ("exact", "people", "both"):
                    low, high = getattr(share, kind)
                    held[kind] += low <= skill <= high
                    width[kind] += high - low
            shares = ", ".join(f"{kind} {held[kind] / runs:.3f} (±{width[kind] / runs / 2:.3f})" for kind in held)
            print(f"skill {skill}, spread of people {people}, of snippets {snippets}: {runs} runs, held: {shares}")


@dataclass
class Small:
    """A small study that went from its sheets to its figures: how its rows were read, and its shares."""

    rows: Counter[str]
    shares: dict[str, scoring.Share]


def small(run: int, skill: float, people: int) -> Small:
    """Everybody is as skilled in A; in B people and snippets differ by 0.5 on logits, and `skill` is the mean.

    Covers are not read: everybody agrees.
    """
    made, study = key(people, 24, run, envelopes=0, pairs=4), f"{run:012x}"
    rng = np.random.default_rng([run, 12])
    drawn = {design.SINGLES: told(made, skill, 0, 0, rng), design.PAIRS: told(made, skill, 0.5, 0.5, rng)}
    read, truth, rows = [], {}, Counter[str]()
    for number in range(1, people + 1):
        meant = {
            kind: [one.answer for one in each if one.person == number and one.questionnaire == kind]
            for kind, each in drawn.items()
        }
        for page in of_nothing(made, number, study, np.random.default_rng([run, number, 13]), meant, quick=True):
            try:
                read.append(one := answers.read_sheet(page.picture, f"run {run}, person {number}"))
            except InputError as error:
                rows["sheets lost"] += 1
                print(f"run {run}, person {number}, page {page.record.page}: {error}")
                continue
            for row, done in zip(one.rows, page.doings, strict=True):
                truth[number, row.row.questionnaire, str(row.row.number)] = row, done
            rows["sheets"] += 1
    found, _ = answers.answers(read)
    for answer in found:
        rows[verdict := judged(answer, *truth[answer.place])] += 1
        if verdict.startswith("plain, but") or "WRONG" in verdict:
            print(f"run {run}, {answer.place}: {verdict}, {answer.why}")
    agreed = [answers.Answer(study, number, sheets.COVER, "consent", "yes") for number in range(1, people + 1)]
    figures = scoring.scores(made, scoring.taken(made, [*found, *agreed]))
    return Small(rows, {kind: each.share for kind, each in figures.items()})


def coverage(runs: int, first: int = 2000, people: int = 8) -> None:
    """How often the intervals hold the skill that was put in, from printed sheets to figures; .54 and .75 in turn."""
    rows, held, width = Counter[str](), Counter[tuple[str, str]](), Counter[tuple[str, str]]()
    for run in range(first, first + runs):
        skill = (0.54, 0.75)[run % 2]
        done = small(run, skill, people)
        rows += done.rows
        for kind, share in done.shares.items():
            for name in ("both", "people", "exact"):
                low, high = getattr(share, name)
                held[kind, name] += low <= skill <= high
                width[kind, name] += high - low
        if (run - first + 1) % 10 == 0:
            print(f"{run - first + 1} studies of {people} people: {dict(rows)}; {dict(held)}", flush=True)
    plain = sum(n for what, n in rows.items() if what.startswith("plain"))
    right = rows["plain, read right"] / plain
    print(f"{runs} studies of {people} people: {right:.4f} of {plain} plain rows read right; {dict(rows)}")
    for kind, spread in ((design.SINGLES, "all alike"), (design.PAIRS, "people and words differ by 0.5")):
        shares = ", ".join(
            f"{name} {held[kind, name] / runs:.0%} (±{width[kind, name] / runs / 2:.3f})"
            for name in ("both", "people", "exact")
        )
        print(f"  {kind}, {spread}: the known skill is held by {shares}")


def figure_of_many() -> bytes:
    """The figure of a study of 170 simulated people of skill .54 and three hands, as SVG."""
    made = key(170, 48, 7, envelopes=0)
    judged = told(made, 0.54, 0.35, 0.6, np.random.default_rng(1))
    hands = ("H1", "H2", "H3")
    parts = tuple(replace(one, hand=hands[made.snippets[one.snippet].hand]) for one in judged)
    figures = scoring.scores(made, scoring.Taken(parts, {}, 0, 0, (), ()))
    histograms = {
        kind: scoring.difficulty_histogram([one for one in parts if one.questionnaire == kind]) for kind in figures
    }
    return figure(figures, histograms, "170 simulated people of skill .54")


def main() -> None:
    """A little of both."""
    answering(100)
    reading(8, 1000)


if __name__ == "__main__":
    main()
