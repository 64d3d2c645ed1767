"""Options of other plotter programs (axicli, saxi) and what they are here, as elsewhere.toml says it."""

from __future__ import annotations

import tomllib
from pathlib import Path


def ours() -> dict[str, str]:
    """What is said of each such option, by its name."""
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def hint(option: str) -> str | None:
    """What an option that is not there is called here, in a sentence; None: nobody knows it."""
    named = ours().get(option.lstrip("-").replace("_", "-"))
    return None if named is None else f"{option} is not an option here: {named}."
