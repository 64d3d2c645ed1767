"""The hands at hand: the built-in and the user's own ones by name, others by the path of their file."""

from __future__ import annotations

import difflib
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from handout import shipped
from handout.errors import InputError
from handout.hand import drawn
from handout.hand.drawn import Hand

if TYPE_CHECKING:  # what reads scanned hands takes longer to load than a drawn one
    from handout.hand.scanned import ScannedHand

_FILES = (".toml", ".svg")  # of drawn hands
_HOUSE = Path(__file__).resolve().parent / "house"


def names() -> list[str]:
    """Names of the built-in hands and of the user's own drawn ones."""
    return sorted(_paths())


def _paths() -> dict[str, Path]:
    built_in = {path.stem: path for path in sorted(_HOUSE.glob("*.toml"))}
    folder = shipped.user_folder("hands")
    return built_in | {path.stem: path for ending in _FILES[::-1] for path in sorted(folder.glob(f"*{ending}"))}


def scanned_files() -> dict[str, Path]:
    """Name → .hand file of the scanned hands: those that come with the program, and the user's own, which win."""
    return {path.stem: path for path in sorted(_HOUSE.glob("*.hand"))} | own_scanned()


def own_scanned() -> dict[str, Path]:
    """Name → .hand file of the user's own scanned hands."""
    folder = shipped.user_folder("hands")
    return {path.stem: path for path in sorted(folder.glob("*.hand"))} if folder.is_dir() else {}


def comes_with_program(path: Path) -> bool:
    """Whether a .hand file is one of the program's own, which nobody should write to."""
    return path.resolve().parent == _HOUSE


def scanned_file(name: str) -> Path:
    """The .hand file of a scanned hand: one of `scanned()`, or a path that ends in .hand.

    Raises InputError: no such hand (the message lists the nearest).
    """
    if name.endswith(".hand"):
        return Path(name)
    paths = scanned_files()
    if name not in paths:
        near = difflib.get_close_matches(name, paths, 3, 0.5) or sorted(paths)
        instead = f"use {', '.join(near)}, or the path of a .hand file" if near else "give the path of a .hand file"
        raise InputError(f"No scanned hand is called {name!r}: {instead}.")
    return paths[name]


def own_file(name: str) -> Path:
    """Where the user's own scanned hand of that name is kept, or would be.

    Raises InputError: no name for a file, or that of a drawn hand.
    """
    if not name.replace("-", "").replace("_", "").isalnum():
        raise InputError(f"A hand cannot be called {name!r}: use letters, digits, - and _.")
    if name in _paths():
        raise InputError(f"A drawn hand is called {name!r}: choose another name.")
    return shipped.user_folder("hands") / f"{name}.hand"


@lru_cache(maxsize=8)
def _read_hand(path: Path) -> Hand:
    if path.suffix == ".svg":
        from handout.hand import svg_font

        return svg_font.read_svg_font(path)
    return drawn.read_drawn_hand(path)


@lru_cache(maxsize=2)
def _load_scanned(path: Path, state: tuple[int, ...]) -> ScannedHand:
    """A scanned hand, loaded again only if its file has changed, which `state` tells."""
    from handout.hand import file

    return file.load(path)


def path(name: str) -> Path:
    """The file of a hand that `find` finds."""
    if name.endswith((".hand", *_FILES)):
        return Path(name)
    return _paths()[name] if name in _paths() else scanned_file(name)


def find(name: str) -> Hand | ScannedHand:
    """The hand `name`, drawn or scanned: one of `names()` or `scanned()`, or the path of a .toml, .hand or .svg file.

    Raises InputError: no such hand (the message lists the nearest), or a file that cannot be read.
    """
    if not name.endswith((".hand", *_FILES)) and name not in _paths() and name not in scanned_files():
        names_ = sorted({*_paths(), *scanned_files()})
        near = difflib.get_close_matches(name, names_, 3, 0.5) or names_
        raise InputError(
            f"No hand is called {name!r}: use {', '.join(near)}, or the path of a .hand, .toml or .svg file."
        )
    if name.endswith(".hand") or (name not in _paths() and name in scanned_files()):
        place = scanned_file(name)
        # of one that is missing, reading it says what is wrong
        about = place.stat() if place.is_file() else None
        return _load_scanned(place, (about.st_mtime_ns, about.st_ino, about.st_size) if about else ())
    return load(name)


def load(name: str) -> Hand:
    """The hand `name`: one of `names()`, or the path of a drawn hand's TOML file or of a single-line SVG font.

    Raises InputError: no such hand (the message lists the nearest), a scanned hand, or a file that cannot be read.
    """
    if name.endswith(_FILES):
        return _read_hand(Path(name).resolve())
    paths = _paths()
    if name.endswith(".hand") or (name not in paths and name in scanned_files()):
        raise InputError(f"{name} is a scanned hand, where a drawn one is wanted: use {', '.join(sorted(paths))}.")
    if name not in paths:
        near = difflib.get_close_matches(name, paths, 3, 0.5) or sorted(paths)
        raise InputError(f"No hand is called {name!r}: use {', '.join(near)}, or the path of a .toml or .svg file.")
    return _read_hand(paths[name])
