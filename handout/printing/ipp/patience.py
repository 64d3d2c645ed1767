"""How long a printer is waited for that says it cannot answer now."""

from __future__ import annotations

from collections.abc import Callable

# s: the first pause, each twice as long as the one before, the longest, and how long in all
_FIRST, _LONGEST, _BOUND = 0.5, 10.0, 600.0


class Patience:
    """Pauses between attempts, up to a bound."""

    def __init__(self, wait: Callable[[float], object], say: Callable[[str], object]) -> None:
        """`wait` is called with seconds; `say` is told once that there is something to wait for."""
        self._wait, self._say = wait, say
        self._pause, self._waited = _FIRST, 0.0

    def pause(self, why: str, after: float | None = None) -> bool:
        """Wait before the next attempt; False, and no waiting, where the bound has been or would be passed.

        Parameters
        ----------
        why : what is said the first time, a sentence.
        after : s that the printer asks for; otherwise ever longer pauses.
        """
        seconds = self._pause if after is None else max(after, _FIRST)
        if self._waited >= _BOUND or (after is not None and self._waited + after > _BOUND):
            return False
        if not self._waited:
            self._say(why)
        self._wait(seconds)
        self._waited += seconds
        if after is None:
            self._pause = min(2 * self._pause, _LONGEST)
        return True
