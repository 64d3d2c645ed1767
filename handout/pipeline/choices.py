"""What a caller can choose from: hands, pens, papers, pages, styles and plotters that are known by name here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from handout import page_sizes
from handout.hand import library
from handout.inking.papers import PAPERS
from handout.inking.pen import PENS, brushes
from handout.motion.styles import style
from handout.pipeline.devices import list_devices
from handout.pipeline.kept_hands import ListedHand, list_hands, listed_file
from handout.pipeline.results import Facts, Result
from handout.sinks import suffixes


@dataclass(frozen=True)
class Choices(Result):
    """The names, each list in the order in which it is shown; hands as `kept_hands.ListedHand`."""

    drawn: Sequence[ListedHand]
    scanned: Sequence[ListedHand]
    own: frozenset[str]  # scanned hands that may be changed
    removable: frozenset[str]  # of them, those that are kept among the user's own

    def facts(self) -> Facts:
        hands = [{**hand.facts(), "about": hand.about, "drawn": True, "own": False} for hand in self.drawn]
        hands += [
            {
                **hand.facts(),
                "about": hand.about,
                "drawn": False,
                "own": hand.name in self.own,
                "removable": hand.name in self.removable,
            }
            for hand in self.scanned
        ]
        return {
            "hands": hands,
            "pens": [*PENS, *brushes()],
            "papers": list(PAPERS),
            "pages": list(page_sizes.NAMES),
            "styles": style.names(),
            "formats": suffixes(),
            "plotters": [
                {"name": machine.name, "title": machine.title}
                for machine in list_devices()
                if machine.kind == "plotter"
            ],
        }


def choices(files: Sequence[Path] = ()) -> Choices:
    """All that is known by name, and the hands of some .hand files, which win over those of their names."""
    known, given = list_hands(), {path.stem: path for path in files}
    scanned = [hand for hand in known.scanned if hand.name not in given]
    scanned = [*(listed_file(path) for path in given.values()), *scanned]
    own = frozenset(library.own_scanned())
    return Choices(known.drawn, scanned, own | given.keys(), own - given.keys())
