"""What is worked out of a scanned hand once and kept with it, since it takes longer than writing a sentence.

A value is an array under a name; with the name goes the version of what worked it out, a constant beside it, so that
what an earlier program worked out otherwise is not found, and is worked out anew.  A hand that was changed is another
value of `ScannedHand` and knows nothing.  `hand.file` keeps values in .hand files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from weakref import WeakKeyDictionary

from handout.hand.scanned import ScannedHand
from handout.values import Array, readonly

_kept: WeakKeyDictionary[ScannedHand, Mapping[str, Sequence[float] | Array]] = WeakKeyDictionary()
_known: WeakKeyDictionary[ScannedHand, dict[str, Array]] = WeakKeyDictionary()


def learnt(
    hand: ScannedHand,
    name: str,
    version: int,
    count: int | None,
    work_out: Callable[[], Sequence[float] | Array],
) -> Array:
    """(count,) float, of any length where `count` is None: what is kept of a hand under a name, or worked out now.

    version : of what works it out.
    """
    known = _known.setdefault(hand, {})
    key = f"{name} {version}"
    if key not in known:
        kept = _kept.get(hand, {}).get(key)
        known[key] = readonly(work_out() if kept is None or count not in (None, len(kept)) else kept, count)
    return known[key]


def remember(hand: ScannedHand, values: Mapping[str, Sequence[float] | Array]) -> None:
    """Take what is known of a hand, as `known_values` has it, or as a file keeps it."""
    _kept[hand] = values


def known_values(hand: ScannedHand) -> Mapping[str, Array]:
    """All that was asked of a hand so far, by names and versions."""
    return _known.get(hand, {})
