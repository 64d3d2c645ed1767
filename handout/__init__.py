"""handout writes any text in a person's handwriting and puts it on paper.

The few functions that are the product, offered by name and imported only when used::

    hand = handout.load("house-joined")
    pages = handout.compose("Dear Ada, …", hand, handout.Layout(page="A5"), rng)
    drawing = handout.trace(pages[0], hand, rng)
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_PUBLIC: dict[str, str] = {}

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'handout' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
