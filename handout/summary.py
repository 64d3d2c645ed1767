"""How values show themselves: those that hold arrays or many parts as one line, and in notebooks as pictures."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Set
from typing import Any

_LONGEST = 40  # characters of a text, or of a part, that are shown
_FEW = 4  # numbers that are shown rather than counted

_painters: list[Callable[[str, Any], Any]] = []  # one at most


def show_by(painter: Callable[[str, Any], Any]) -> None:
    """Say what draws values for notebooks: called with ``"svg"`` or ``"png"`` and the value, it gives str or bytes.

    The package itself says so (`handout/__init__.py`): values know nothing of the rooms that draw.
    """
    _painters[:] = [painter]


def as_svg(value: Any) -> str | None:
    """A value as a notebook shows it; the `_repr_svg_` of those that have one."""
    svg: str | None = _painters[0]("svg", value)
    return svg


def as_png(value: Any) -> bytes | None:
    """The same as pixels; `_repr_png_`."""
    png: bytes | None = _painters[0]("png", value)
    return png


def one_line(value: Any) -> str:
    """A dataclass by its name and fields: arrays by their shape, ``<120 × 2>``, and collections by their number.

    Fields that have their default value, and those that are kept out of every `repr`, are left out.
    """
    parts = []
    for field in dataclasses.fields(value):
        part = getattr(value, field.name)
        # arrays have no default, and are never compared
        usual = part is None or (isinstance(part, bool | int | float | str | frozenset) and part == field.default)
        if field.repr and not usual:
            parts.append(f"{field.name}={_part(part)}")
    return f"{type(value).__name__}({', '.join(parts)})"


def _part(part: Any) -> str:
    shape = getattr(part, "shape", None)
    if isinstance(shape, tuple) and shape and hasattr(part, "dtype"):
        return f"<{' × '.join(map(str, shape))}>"
    if isinstance(part, float):
        return f"{part:.6g}"
    if isinstance(part, str):
        return repr(part if len(part) <= _LONGEST else f"{part[: _LONGEST - 1]}…")
    if (
        isinstance(part, tuple | list)
        and len(part) <= _FEW
        and all(isinstance(one, bool | int | float) for one in part)
    ):
        return f"({', '.join(_part(one) for one in part)})"
    if isinstance(part, tuple | list | Mapping | Set):
        return f"<{len(part)}>"
    text = " ".join(repr(part).split())
    return text if len(text) <= _LONGEST else f"{type(part).__name__}(…)"
