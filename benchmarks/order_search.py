"""A random search for the constants of the recovery of writing order, with a fixed budget.

Those of `network.CostWeights` and of matching were found by such a search, on fewer sets; those of forms that few
people write by one over ways that had been found before; those of guides and loops by hand.  The whole budget of this
one has not been run since.

Every try multiplies a few of the weights, those of `network.CostWeights` and those of `letter_forms.FormWeights` by
which ways over a letter are compared with forms, by random factors near 1 and measures again; what is better is kept
and changed further.  Measured are simulated pages of the three built-in hands and every second one of the recorded
letters of HANDOUT_DATA; without that, the pages alone.  What is maximised is the mean, over these sets, of the share of
strokes found and right and of words all right.  The other half of the letters, other texts and recorded words take no
part: they are for judging what was found, once.

Run as `python -m benchmarks.order_search [tries] [seed]`; it prints every gain, and at last all constants.  A try takes
half a minute; the result is for a person to round and write into the modules, where it helps on what took no part.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks import order_recovery, recorded
from benchmarks.followed import Tally, tally
from handout.hand import library
from handout.hand.scanned import ScannedHand
from handout.motion.recovery import letter_forms
from handout.motion.recovery.letter_forms import HANDS
from handout.motion.recovery.letter_line import LetterLine, LetterStrokes
from handout.motion.recovery.letter_tracing import trace_letter
from handout.motion.recovery.network import WEIGHTS
from handout.values import Array

TRIES, SEED = 60, 1
_CHANGED = 3  # weights that a try changes, at most
_FACTOR = 0.25  # deviation of the logarithm of a factor
# of the weights of forms those that were searched: see `letter_forms.FormWeights`
SEARCHED = (
    *("unlike", "loop", "spared", "near", "farthest", "aimed", "open", "lifted", "passed", "left_out", "most_left_out"),
    *("guided_lift", "one_hand", "other", "rare", "loop_above", "loop_high"),
)
Values = Mapping[str, float]
Page = tuple[str, ScannedHand, list[Array], list[int]]


def usual() -> dict[str, float]:
    """The weights as they are."""
    of_forms = {f"forms.{name}": value for name, value in asdict(letter_forms.WEIGHTS).items() if name in SEARCHED}
    return {**{f"costs.{name}": value for name, value in asdict(WEIGHTS).items()}, **of_forms}


def measured(values: Values, pages: Sequence[Page], cells: Sequence[recorded.Cell]) -> float:
    """How good the recovery is with some weights."""
    parts = {
        part: {name.removeprefix(part): value for name, value in values.items() if name.startswith(part)}
        for part in ("costs.", "forms.")
    }
    weights = replace(WEIGHTS, **parts["costs."])

    def recover(line: LetterLine, letter: str, hands: tuple[str, ...]) -> LetterStrokes:
        return trace_letter(line, letter, hands=hands, weights=weights)

    # forms keep what they cost
    for cached in (letter_forms._forms, letter_forms._form, letter_forms.ductus):
        cached.cache_clear()
    with patch.object(letter_forms, "WEIGHTS", replace(letter_forms.WEIGHTS, **parts["forms."])):
        found = [_page(page, recover) for page in pages]
        if cells:
            found.append(_letters(cells, recover))
    return float(np.mean([(one.right / one.strokes + one.good / one.words) / 2 for one in found]))


def _page(page: Page, recover: order_recovery.Recover) -> Tally:
    name, hand, true, words = page
    others = tuple(other for other in HANDS if other != name)
    paths = order_recovery.traced(hand, recover, others, library.load(name).delayed_after)
    return tally(true, words, paths, hand.pages[0].graph.uv * hand.pages[0].pixel)


def _letters(cells: Sequence[recorded.Cell], recover: order_recovery.Recover) -> Tally:
    found = Tally()
    for cell in cells:
        line = order_recovery.alone(cell)
        paths = [cell.graph.xy[own] for own in recover(line, cell.recording.text, HANDS).strokes]
        found += tally(cell.strokes, [0] * len(cell.strokes), paths, cell.graph.xy)
    return found


def search(pages: Sequence[Page], cells: Sequence[recorded.Cell], tries: int, rng: np.random.Generator) -> Values:
    """The best constants that were found."""
    best: Values = usual()
    most = measured(best, pages, cells)
    print(f"as they are: {most:.4f}", flush=True)
    for number in range(1, tries + 1):
        names = rng.choice(sorted(best), size=int(rng.integers(1, _CHANGED + 1)), replace=False)
        tried = {**best, **{str(name): best[str(name)] * float(np.exp(rng.normal(0, _FACTOR))) for name in names}}
        good = measured(tried, pages, cells)
        if good > most:
            best, most = tried, good
            changes = ", ".join(f"{name} {tried[name]:.3g}" for name in names)
            print(f"{number:4d}: {most:.4f}  {changes}", flush=True)
    return best


def main() -> None:
    """Search, and print what was found."""
    tries, seed = map(int, [*sys.argv[1:3], *[str(TRIES), str(SEED)][len(sys.argv[1:3]) :]])
    pages = [(name, *order_recovery.simulated(name)) for name in HANDS]
    given = os.environ.get("HANDOUT_DATA")
    folder = Path(given) / "pen" / "unipen" if given else None
    cells = list(recorded.cells(recorded.letters(folder)))[::2] if folder is not None and folder.is_dir() else []
    before = usual()
    for name, value in search(pages, cells, tries, np.random.default_rng(seed)).items():
        print(f"{name:<28}{before[name]:>8.3g} → {value:.3g}" if value != before[name] else f"{name:<28}{value:>8.3g}")


if __name__ == "__main__":
    main()
