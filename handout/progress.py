"""Progress of long work, reported to a function; who shows it is not the work's concern."""

from __future__ import annotations

from collections.abc import Callable

# share of the work that is done, 0 to 1, and what is being done
Tell = Callable[[float, str], None]


def silent(share: float, stage: str) -> None:
    """Reports to nobody."""


def narrow_reports(tell: Tell, begin: float, end: float, prefix: str = "") -> Tell:
    """The reports of a part of greater work, which goes from `begin` to `end` of that; `prefix` is put before them."""

    def report(share: float, stage: str) -> None:
        tell(begin + (end - begin) * share, prefix + stage)

    return report
