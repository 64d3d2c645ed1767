"""`handout study`: questionnaires on which people tell made writing from real, read back and scored."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from handout import units
from handout.cli.console import Console
from handout.cli.options import verb
from handout.pipeline.declarations import argument, option, output
from handout_lab.pipeline.options import StudyOptions

if TYPE_CHECKING:
    from handout_lab.pipeline.study import ScoredStudy, Scores, Share

_CAPTIONS = {"A": "A: real or made", "B": "B: which of two is made", "E": "E: envelopes"}
_FEW = 3  # snippets that are shown of the hardest, and of the easiest


@click.group(
    "study",
    short_help="Make, read and score a study: can people tell made writing from real?",
)
def command() -> None:
    """A study: can people tell what is made in a hand from what its writer wrote?"""


@verb("make", command)
def make(
    console: Console, output: str = output("A folder, new or empty."), study: StudyOptions = StudyOptions()
) -> None:
    """Make the sheets of a study: sheets.pdf to print, and its key, study.key, which nobody who takes part may see.

    Questionnaire A shows words and asks of each whether it is real or fake; B shows the same words twice, below a
    line of the same person's writing, and asks which is fake. Each person's sheets differ, and all is balanced but
    for --sampling random. Made words never hold a letter cut from the real ones that the same person sees.

    \b
    handout study make --hand me.hand --real scans/ --people 170 -o study/
    """
    from handout_lab.pipeline.study import make

    with console.working():
        result = make(output, study, listener=console)
    pages, people = units.count(result.pages, "page"), units.count(result.people, "person", "people")
    console.report(
        result,
        f"Wrote {result.files[0]}: {pages} for {people}, {units.count(result.snippets, 'snippet')} real and made; its "
        f"key is {result.files[1]}; study {result.name}, seed {result.seed}.",
    )


@verb("read", command)
def read(
    console: Console,
    scans: tuple[str, ...] = argument(required=True, metavar="SCAN..."),
    output: str = output("The CSV file for the answers."),
) -> int:
    """Read the filled sheets of a study from SCANs: pictures, PDF files, or folders of them, lying any way round.

    Rows that are not plain (two boxes marked, or none, or only a trace) are left empty in the table, with a picture of
    each beside it: look, and write the answers in.

    \b
    handout study read filled-scans/ -o answers.csv
    """
    from handout_lab.pipeline.study import read

    with console.working():
        result = read(scans, output, listener=console)
    sheets, people = units.count(result.sheets, "sheet"), units.count(result.people, "person", "people")
    console.report(
        result,
        f"Wrote {result.path}: {sheets} of {people}, {units.count(len(result.answers), 'row')}, "
        f"{len(result.doubtful)} doubtful.",
    )
    return 4 if result.unread else 0


@verb("score", command)
def score(
    console: Console,
    table: Path = argument(metavar="ANSWERS"),
    key: Path | None = option(None, "The study's key; default: looked for near the answers."),
    output: Path | None = output("An SVG file for the figure.", required=False),
    least_controls: int = option(0, "Leave out who told fewer of them.", least=0),
    seed: int = option(0, "Of the permutation test.", least=0),
) -> None:
    """Score the ANSWERS of a study: shares told right with 95 % intervals, skill, difficulty, confusions.

    Three intervals go with each share: "people+words" holds for other people and other words, and is the one to
    report; "people" for other people who see the same words; "exact" takes all answers as independent, which they
    hardly are.

    \b
    handout study score answers.csv -o figure.svg
    """
    from handout_lab.pipeline.study import score

    result = score(table, key, output, least_controls=least_controls, seed=seed)
    if not console.as_json:
        click.echo("\n".join(_table(result)))
    console.report(result, f"Scored {units.count(len(result.answers.judged), 'answer')} of study {result.study}.")


def _table(result: ScoredStudy) -> list[str]:
    lines = [f"{'':<40}{'right':>12}{'share':>8}  {'people+words':<15}{'people':<15}exact"]
    for kind, each in result.scores.items():
        lines.append(_row(_CAPTIONS[kind], each.share))
        lines += [_row(f"  {name}", share) for name, share in each.hands.items() if len(each.hands) > 1]
        if len(each.conditions) > 1:
            lines += [_row(f"  condition {name}", share) for name, share in each.conditions.items()]
            lines += [f"    {test.first} and {test.second} differ: {_p(test.p)}" for test in each.tests]
        for group, shares in each.groups.items():
            lines += [_row(f"  {group}: {name}", share) for name, share in shares.items() if len(shares) > 1]
        lines += _about(each)
    hard = [one for one in result.snippets if one.found_out == one.found_out]
    few = hard if len(hard) <= 2 * _FEW else (*hard[:_FEW], *hard[-_FEW:])
    return [*lines, *(f"made snippet told {one.found_out:.0%}: {one.text} ({one.hand})" for one in few)]


def _row(name: str, share: Share) -> str:
    counted = f"{share.right} / {share.of}"
    both, people, exact = (f"{low:.1%}–{high:.1%}" for low, high in (share.both, share.people, share.exact))
    return f"{name[:39]:<40}{counted:>12}{share.share:>8.1%}  {both:<15}{people:<15}{exact}"


def _p(p: float) -> str:
    return f"p = {p:.4f}" if p >= 0.00005 else "p < 0.0001"


def _about(scores: Scores) -> list[str]:
    skill, confusions = scores.skill, scores.confusions
    said = "; ".join(f"{truth} called {answer} {n}" for (truth, answer), n in confusions.counts.items())
    return [
        f"    guessing {_p(scores.share.p)}; d' = {confusions.sensitivity:.2f}, bias {confusions.bias:.2f}; {said}",
        f"    people differ by ±{skill.spread:.1%} of their own (all alike: {_p(skill.p)}); {len(skill.above)} did "
        f"better than 19 of 20 who guess, {skill.above_by_chance:.1f} would by chance",
    ]


@verb("judge", command)
def judge(
    console: Console,
    real: Path,
    made: Path,
    controls: bool = option(False, "Judge the judge: real writers against each other, and steady speeds."),
    seed: int = option(0, "Of the judge's learning.", least=0),
) -> None:
    """Let a machine tell MADE pen motion from REAL: two folders, with a folder in them for each writer.

    A small recurrent network learns from two-second windows of some writers and judges others. AUC is how often it
    takes a made window for more likely made than a real one: 50 % is guessing. Size, speed as a whole and pressure
    are not looked at; nothing of what it learns is kept.

    \b
    handout study judge recordings/ made/ --controls
    """
    from handout_lab.pipeline.judging import judge_motion

    with console.working():
        result = judge_motion(real, made, controls=controls, seed=seed, listener=console)
    if not console.as_json:
        kinds = {"made": result.made, "real writers, parted": result.real_control, "steady": result.steady_control}
        for name, one in kinds.items():
            if one is not None:
                click.echo(
                    f"{name:<22} AUC {one.auc:.1%} (95 %: {one.low:.1%}–{one.high:.1%}; {one.real} real and {one.made} "
                    f"other windows of {one.real_writers} and {one.made_writers} writers): {one.verdict}"
                )
    console.report(result, f"Judged the motion of {units.count(result.made.made_writers, 'made writer')}.")
