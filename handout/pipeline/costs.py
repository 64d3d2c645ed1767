"""What a batch costs: paper, ink or pens, and machine time, at the prices that are known; what is not known is said."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import msgspec

from handout.errors import InputError
from handout.pipeline.results import Facts
from handout.profiles import Plotter, Prices, Printer

_PRICES = [name for name in Prices.__struct_fields__ if name != "currency"]
_MEASURES = ("ink_load", "pen_length")  # that are no prices, but what these are of
_MOST = 1e6  # of a price, as in a profile


@dataclass(frozen=True)
class Spent:
    """What a batch uses: sheets and envelopes; mm² of paper under ink; mm of line; s of a plotter, None without one."""

    sheets: int = 0
    envelopes: int = 0
    covered: float = 0.0
    line: float = 0.0
    machine: float | None = None


@dataclass(frozen=True)
class Costs:
    """What it costs: each item in money, None where its price is not known; `lacking` names the prices for these."""

    currency: str
    items: Mapping[str, float | None]
    lacking: tuple[str, ...]

    @property
    def total(self) -> float:
        """Of what is known."""
        return sum(cost for cost in self.items.values() if cost is not None)

    def facts(self) -> Facts:
        """For JSON."""
        items = {name: None if cost is None else round(cost, 4) for name, cost in self.items.items()}
        return {"currency": self.currency, **items, "total": round(self.total, 4), "unknown": list(self.lacking)}

    def sentence(self) -> str:
        """In words."""
        if all(cost is None for cost in self.items.values()):
            return f"What it costs is not known: give prices with --prices {'=…,'.join(self.lacking)}=…"
        known = ", ".join(f"{name} {cost:.2f}" for name, cost in self.items.items() if cost is not None)
        money = f"{self.total:.2f} {self.currency}".strip()
        if not self.lacking:
            return f"Cost: {money} ({known})."
        unknown = " and ".join(name for name, cost in self.items.items() if cost is None)
        return f"Cost: {money} ({known}) without {unknown}: not known is {', '.join(self.lacking)}."


def prices(machine: Plotter | Printer | None, given: str) -> Prices:
    """The prices of a machine's profile, with those that are given as ``"sheet=0.02,hour=4,currency=EUR"`` over them.

    Raises InputError: an unknown price, or one that is no number from 0.
    """
    changes: dict[str, str | float] = {}
    for part in filter(None, (part.strip() for part in given.split(","))):
        name, _, value = part.partition("=")
        changes[name] = value if name == "currency" else _price(name, value, part)
    return msgspec.structs.replace(machine.prices if machine is not None else Prices(), **changes)


def _price(name: str, value: str, part: str) -> float:
    try:
        price = float(value) if name in _PRICES else math.nan
    except ValueError:
        price = math.nan
    if not 0 <= price <= _MOST or (price == 0 and name in _MEASURES):
        known = ", ".join(_PRICES)
        raise InputError(f"prices: {part!r} is none; write sheet=0.02,hour=4.50,currency=EUR, of {known}.")
    return price


def costs(spent: Spent, at: Prices, plotted: bool) -> Costs:
    """What is spent, at these prices: by pens on a plotter, else by ink."""
    volume = None if at.ink_load is None else spent.covered * 1e-6 * at.ink_load
    pens = None if at.pen_length is None else spent.line * 1e-3 / at.pen_length
    # item → how much of it, its price, and what that is not known without
    wanted: dict[str, tuple[float | None, float | None, dict[str, float | None]]] = {}
    if spent.sheets:
        wanted["paper"] = spent.sheets, at.sheet, {"sheet": at.sheet}
    if spent.envelopes:
        wanted["envelopes"] = spent.envelopes, at.envelope, {"envelope": at.envelope}
    if plotted:
        wanted["pens"] = pens, at.pen, {"pen": at.pen, "pen_length": at.pen_length}
    else:
        wanted["ink"] = volume, at.ink, {"ink": at.ink, "ink_load": at.ink_load}
    if spent.machine is not None:
        wanted["machine"] = spent.machine / 3600, at.hour, {"hour": at.hour}
    items = {
        name: None if amount is None or price is None else amount * price for name, (amount, price, _) in wanted.items()
    }
    lacking = [name for _, _, needed in wanted.values() for name, value in needed.items() if value is None]
    return Costs(at.currency, items, tuple(lacking))
