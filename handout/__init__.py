"""handout writes any text in a person's handwriting and puts it on paper.

The few functions that are the product, offered by name and imported only when used.  What the commands do::

    mine = handout.read("me", ["page.jpg"], ["page.txt"]).hand
    handout.write("Dear Ada, …", ["letter.pdf"], handout.WritingOptions(hand=mine), handout.SheetOptions("A5"))

and the steps that they are made of::

    hand = handout.load("house-joined")
    page, *_ = handout.compose("Dear Ada, …", hand, handout.Layout(handout.page("A5")), rng)
    drawing = handout.trace(page, hand, rng)
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from handout.summary import show_by

__version__ = "0.1.0"

_PUBLIC = {
    "Layout": "handout.writing.layout",
    "Look": "handout.sinks",
    "MergeOptions": "handout.pipeline.options",
    "FillOptions": "handout.pipeline.options",
    "PictureOptions": "handout.pipeline.options",
    "PlotOptions": "handout.pipeline.plot_request",
    "PlotRequest": "handout.pipeline.plot_request",
    "PoseOptions": "handout.pipeline.options",
    "PrintOptions": "handout.pipeline.options",
    "ReadingOptions": "handout.pipeline.options",
    "SheetOptions": "handout.pipeline.options",
    "TableOptions": "handout.pipeline.options",
    "WritingOptions": "handout.pipeline.options",
    "apply": "handout.colour.table",
    "complete_hand": "handout.completion.completed_hand",
    "compose": "handout.writing.compose",
    "correct": "handout.tagging.relearning",
    "drawings": "handout.pipeline.writing",
    "each_page": "handout.writing.compose",
    "export": "handout.pipeline.writing",
    "fill": "handout.pipeline.filling",
    "find": "handout.hand.library",
    "ink": "handout.inking.plain",
    "learn_pose": "handout.pipeline.poses",
    "load": "handout.hand.library",
    "open_port": "handout.plotting",
    "page": "handout.page_sizes",
    "plan": "handout.plotting",
    "plot": "handout.pipeline.plotting",
    "plot_rows": "handout.pipeline.plot_rows",
    "print_": "handout.pipeline.printing",
    "prompt": "handout.pipeline.prompts",
    "proof": "handout.pipeline.proofing",
    "read": "handout.pipeline.hands",
    "read_addresses": "handout.printing.address_table",
    "restyle": "handout.motion.styles.restyling",
    "resume": "handout.pipeline.plotting",
    "run": "handout.plotting",
    "show_pose": "handout.pipeline.poses",
    "trace": "handout.motion.trace",
    "write": "handout.pipeline.writing",
    "write_drawings": "handout.sinks",
}

__all__ = ["__version__", *_PUBLIC]


show_by(lambda kind, value: getattr(import_module("handout.pipeline.notebook"), kind)(value))


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'handout' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
