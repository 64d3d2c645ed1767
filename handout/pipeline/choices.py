"""What a caller can choose from: hands, pens, papers, pages, styles and plotters that are known by name here."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from handout import page_sizes
from handout.hand import library
from handout.inking.papers import PAPERS
from handout.inking.pen import PENS, brushes
from handout.motion.styles import style
from handout.pipeline.devices import list_devices
from handout.pipeline.kept_hands import list_hands, listed_file
from handout.pipeline.results import Facts
from handout.sinks import suffixes


def choices(files: Sequence[Path] = ()) -> Facts:
    """All that is known by name, in the order in which it is shown, and the hands of some .hand files, which win."""
    known, given, own = list_hands(), {path.stem: path for path in files}, library.own_scanned()
    scanned = [hand for hand in known.scanned if hand.name not in given]
    hands: list[Facts] = [{**hand.facts(), "about": hand.about, "drawn": True, "own": False} for hand in known.drawn]
    for hand in (*(listed_file(path) for path in given.values()), *scanned):
        mine = {"own": hand.name in own or hand.name in given, "removable": hand.name in own and hand.name not in given}
        hands.append({**hand.facts(), "about": hand.about, "drawn": False, **mine})
    machines = [machine for machine in list_devices() if machine.kind == "plotter"]
    return {
        "hands": hands,
        "pens": [*PENS, *brushes()],
        "papers": list(PAPERS),
        "pages": list(page_sizes.NAMES),
        "styles": style.names(),
        "formats": suffixes(),
        "plotters": [{"name": machine.name, "title": machine.title} for machine in machines],
    }
