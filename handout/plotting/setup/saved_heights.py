"""A copy of a profile with other heights of the pen; comments and all else stay as they are."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from handout import atomic, profiles, shipped
from handout.errors import InputError
from handout.plotting.setup.pen_heights import Heights
from handout.profiles import Plotter

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,60}")
_FOUND = "found with: handout pen heights"


def place(name: str, again: bool) -> Path:
    """Where the user's own profile of that name lies.

    Raises
    ------
    InputError
        A name that is none, or of a file that is there and may not be replaced.
    """
    if not _NAME.fullmatch(name):
        raise InputError(f"{name!r} cannot name a profile: use letters, digits, - and _, such as my-plotter.")
    path = shipped.user_folder("devices") / f"plotter-{name.removeprefix('plotter-')}.toml"
    if path.exists() and not again:
        raise InputError(f"{path} is there already: give another name, or --again to replace it.")
    return path


def lines(heights: Heights, profile: Plotter) -> dict[str, float]:
    """The keys of the group ``[pen]`` that change.

    A pen that follows pressure presses as much deeper as it did, unless that was found, too.
    """
    pen = profile.pen
    keys = {"up": heights.up, "down": heights.down}
    if heights.pressed is not None:
        keys["pressed"] = heights.pressed
    elif pen.pressed is not None:
        keys["pressed"] = round(heights.down + pen.pressed - pen.down, 3)
    return keys


def edit_profile(text: str, keys: dict[str, float]) -> str:
    """A profile's text with other numbers in ``[pen]``; the comments of these lines say where they are from."""
    group, rows = "", list[str]()
    for row in text.splitlines():
        if heading := re.match(r"\s*\[([^\]]*)\]", row):
            group = heading.group(1).strip()
        match = re.match(r"(\s*)(\w+)(\s*=\s*)([-+.\w]+)\s*(?:#\s*(.*))?$", row)
        if group == "pen" and match and match.group(2) in keys:
            was = f"{match.group(4)} before" + (f": {match.group(5)}" if match.group(5) else "")
            number = f"{match.group(1)}{match.group(2)}{match.group(3)}{keys[match.group(2)]:g}"
            row = f"{number:<24} # {_FOUND}; {was}"
        rows.append(row)
        if group == "pen" and match and match.group(2) == "down" and not re.search(r"(?m)^\s*pressed\s*=", text):
            rows += [f"{f'pressed = {keys[name]:g}':<24} # {_FOUND}" for name in keys if name == "pressed"]
    return "\n".join(rows) + "\n"


def check(source: Path, keys: dict[str, float]) -> None:
    """Raise InputError unless a profile can have these numbers, before anything is tried with them."""
    try:
        _try_profile(edit_profile(source.read_text(encoding="utf-8"), keys), source, source, keys)
    except InputError as error:
        raise InputError(str(error).replace(f"{source}: ", "", 1)) from error


def save(source: Path, path: Path, keys: dict[str, float]) -> None:
    """Write the copy, whole and valid, or nothing.

    Raises
    ------
    InputError
        The numbers are none that a profile can have, or the file cannot be written.
    """
    text = edit_profile(source.read_text(encoding="utf-8"), keys)
    _try_profile(text, source, path, keys)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"Cannot write {path}: {error.strerror or error}.") from error
    atomic.write(path, text.encode("utf-8"))


def _try_profile(text: str, source: Path, path: Path, keys: dict[str, float]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        trial = Path(folder) / path.name
        trial.write_text(text, encoding="utf-8")
        try:
            profile = profiles.read_profile(trial)
        except InputError as error:
            raise InputError(str(error).replace(str(trial), str(path))) from error
    if not isinstance(profile, Plotter) or any(getattr(profile.pen, key) != value for key, value in keys.items()):
        wanted = ", ".join(f"{key} = {value:g}" for key, value in keys.items())
        raise InputError(
            f"{source}: its group [pen] is written in a way that is not understood; write {wanted} by hand."
        )
