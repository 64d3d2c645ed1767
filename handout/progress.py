"""How long work tells whoever waits for it how far it has come; who shows that is not its business."""

from __future__ import annotations

from collections.abc import Callable

# share of the work that is done, 0 to 1, and what is being done
Tell = Callable[[float, str], None]


def silent(share: float, stage: str) -> None:
    """Nobody waits."""


def within(tell: Tell, begin: float, end: float, prefix: str = "") -> Tell:
    """What a part of a greater work tells, which goes from `begin` to `end` of that; `prefix` is put before it."""

    def told(share: float, stage: str) -> None:
        tell(begin + (end - begin) * share, prefix + stage)

    return told
