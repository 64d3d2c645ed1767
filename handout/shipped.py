"""Finds the data folders such as `devices/`, `styles/` and `poses/`, wherever the program runs from.

A file of the user's own (in the platform's configuration folder) wins over a shipped one of the same name.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import platformdirs

_PACKAGE = Path(__file__).resolve().parent


@cache
def folder(name: str) -> Path:
    """The shipped data folder `name`, such as ``"devices"``: in the wheel, else in the checkout."""
    inside = _PACKAGE / "_shipped" / name
    return inside if inside.is_dir() else _PACKAGE.parent / name


def user_folder(name: str) -> Path:
    """Where the user's own files of that kind live; it need not exist."""
    return Path(platformdirs.user_config_dir("handout", appauthor=False)) / name


def files(name: str, pattern: str) -> dict[str, Path]:
    """Stem → path of every file of data folder `name` that matches `pattern`; the user's own win."""
    paths: dict[str, Path] = {}
    for place in (folder(name), user_folder(name)):
        if place.is_dir():
            paths |= {path.stem: path for path in sorted(place.glob(pattern))}
    return paths
