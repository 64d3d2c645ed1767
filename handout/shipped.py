"""Finds the data folders such as `devices/` and `styles/`, wherever the program runs from, and the folders of the user.

A file of the user's own (in the platform's configuration folder) wins over a shipped one of the same name.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Literal

import platformdirs

_PACKAGE = Path(__file__).resolve().parent


@cache
def folder(name: str) -> Path:
    """The shipped data folder `name`, such as ``"devices"``: in the wheel, else in the checkout."""
    inside = _PACKAGE / "_shipped" / name
    return inside if inside.is_dir() else _PACKAGE.parent / name


def own_folder(kind: Literal["config", "data", "state"]) -> Path:
    """Where the platform keeps a user's settings, data, or state for this program; it need not exist.

    An account without a home folder, or with one that is another's, has none: nothing is found in what is returned
    then, and an error that it cannot be made says why.
    """
    ask = {"config": platformdirs.user_config_dir, "data": platformdirs.user_data_dir}
    try:
        place = Path(ask.get(kind, platformdirs.user_state_dir)("handout", appauthor=False))
        place.exists()
    except PermissionError:
        return Path("/the home folder may not be read, set HOME") / kind
    except RuntimeError:  # newer platformdirs, where older ones give "~" itself
        place = Path()
    return place if place.is_absolute() else Path("/no home folder is known, set HOME") / kind


def user_folder(name: str) -> Path:
    """Where the user's own files of that kind live; it need not exist."""
    return own_folder("config") / name


def files(name: str, pattern: str) -> dict[str, Path]:
    """Stem → path of every file of data folder `name` that matches `pattern`; the user's own win."""
    paths: dict[str, Path] = {}
    for place in (folder(name), user_folder(name)):
        if place.is_dir():
            paths |= {path.stem: path for path in sorted(place.glob(pattern))}
    return paths
