"""What a printer is asked for with a page, within what it can do, and what its answers mean in words.

A reason that a printer gives and nobody understands gets its words in phrases.toml.

Source: RFC 8011 §5.3.7–5.3.8 and §5.4.11–5.4.12 (states and their reasons), §4.1.6 and appendix B (status codes);
PWG 5100.13 for what multifunction printers add.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from pathlib import Path

from handout.errors import ProfileError
from handout.printing.ipp.message import Attribute, Message, MessageTag, Range, Resolution, attribute
from handout.printing.queue import Ticket

_DOTS_AN_INCH = 3  # the unit of a resolution, see `message.Resolution`
_HUNDREDTHS = 100  # PWG 5100.7: media-col has its lengths in 1/100 mm
_MOST_SHEETS = 6  # that are named where one is refused
_PLAIN = (MessageTag.KEYWORD, MessageTag.ENUM, MessageTag.INTEGER, MessageTag.BOOLEAN, MessageTag.NAME)


@dataclass(frozen=True)
class Capabilities:
    """The attributes that a printer has reported."""

    message: Message

    def texts(self, name: str) -> tuple[str, ...]:
        """The values of an attribute that are text; none if the printer does not have it."""
        return tuple(
            value.value for value in self.message.find_all(name, MessageTag.PRINTER) if isinstance(value.value, str)
        )

    @property
    def formats(self) -> tuple[str, ...]:
        """MIME types of the documents that it prints."""
        return self.texts("document-format-supported")

    @property
    def operations(self) -> frozenset[int]:
        """The operations that it knows."""
        values = self.message.find_all("operations-supported", MessageTag.PRINTER)
        return frozenset(value.value for value in values if isinstance(value.value, int))

    @property
    def reasons(self) -> tuple[str, ...]:
        """The printer's reasons for its state."""
        return self.texts("printer-state-reasons")

    def raster_dpi(self, wanted: int) -> int:
        """The resolution for PWG raster that is nearest to `wanted`: the least of those above it, else the greatest."""
        values = self.message.find_all("pwg-raster-document-resolution-supported", MessageTag.PRINTER)
        square = sorted(
            value.value.across
            for value in values
            if isinstance(value.value, Resolution)
            and value.value.unit == _DOTS_AN_INCH
            and value.value.across == value.value.along
        )
        return next((dpi for dpi in square if dpi >= wanted), square[-1] if square else wanted)

    def urf_dpi(self, wanted: int) -> int:
        """The same for URF, whose resolutions stand in one keyword: RS300-600."""
        listed = next((word[2:] for word in self.texts("urf-supported") if word.startswith("RS")), "")
        square = sorted(int(part) for part in listed.split("-") if part.isdigit())
        return next((dpi for dpi in square if dpi >= wanted), square[-1] if square else wanted)


def job_attributes(ticket: Ticket, capabilities: Capabilities) -> tuple[Attribute, ...]:
    """The attributes of a job: the sheet by its size, tray and kind of paper; never scaled.

    Raises ProfileError: a tray or an option that the printer does not have.
    """
    attributes = [_sheet(ticket, capabilities)]
    if "none" in capabilities.texts("print-scaling-supported"):
        attributes.append(attribute("print-scaling", MessageTag.KEYWORD, "none"))
    if capabilities.message.find_all("copies-supported", MessageTag.PRINTER):
        attributes.append(attribute("copies", MessageTag.INTEGER, ticket.copies))
    if "one-sided" in capabilities.texts("sides-supported"):
        attributes.append(attribute("sides", MessageTag.KEYWORD, "one-sided"))
    options = {name: _option(name, value, capabilities) for name, value in ticket.options.items()}
    return (*(item for item in attributes if item.name not in options), *options.values())


def _sheet(ticket: Ticket, capabilities: Capabilities) -> Attribute:
    """The sheet by size, tray and kind; by name alone for an old printer that has no media-col."""
    if capabilities.texts("media-col-supported") or not capabilities.texts("media-supported"):
        return attribute("media-col", MessageTag.COLLECTION, _media_col(ticket, capabilities))
    if ticket.source:
        raise ProfileError("The printer lets nobody choose a tray: leave the tray out.")
    return attribute("media", MessageTag.KEYWORD, ticket.media)


def _media_col(ticket: Ticket, capabilities: Capabilities) -> tuple[Attribute, ...]:
    across, along = (round(side * _HUNDREDTHS) for side in (ticket.sheet.width, ticket.sheet.height))
    size = (attribute("x-dimension", MessageTag.INTEGER, across), attribute("y-dimension", MessageTag.INTEGER, along))
    members = [attribute("media-size", MessageTag.COLLECTION, size)]
    trays = capabilities.texts("media-source-supported")
    if ticket.source:
        if ticket.source not in trays:
            raise ProfileError(f"The printer has no tray {ticket.source!r}; {_name_listed('trays', trays)}.")
        members.append(attribute("media-source", MessageTag.KEYWORD, ticket.source))
    if ticket.type and ticket.type in capabilities.texts("media-type-supported"):
        members.append(attribute("media-type", MessageTag.KEYWORD, ticket.type))
    return tuple(members)


def name_sheets(ticket: Ticket, capabilities: Capabilities) -> str:
    """The sheet that is asked for, and the nearest in size of those that a printer lists; "" where it lists none."""
    wanted, listed = (ticket.sheet.width, ticket.sheet.height), list[tuple[float, ...]]()
    for size in capabilities.message.find_all("media-size-supported", MessageTag.PRINTER):
        parts = size.value if isinstance(size.value, tuple) else ()
        sides = [side.values[0].value for side in parts]
        fixed = tuple(side / _HUNDREDTHS for side in sides if isinstance(side, int))
        listed += [fixed] if len(fixed) == len(wanted) else []
    if not listed:
        return ""
    nearest = sorted(set(listed), key=lambda sides: math.dist(sides, wanted))[:_MOST_SHEETS]
    names = ", ".join(f"{across:.0f} x {along:.0f}" for across, along in nearest)
    return f"The sheet is {wanted[0]:.0f} x {wanted[1]:.0f} mm; the nearest that it lists: {names} mm."


def _option(name: str, value: str, capabilities: Capabilities) -> Attribute:
    """An option with the type that the printer's list of its values has."""
    listed = capabilities.message.find_all(f"{name}-supported", MessageTag.PRINTER)
    if not listed:
        raise ProfileError(f"The printer has no option {name!r}: leave it out of the profile's options.")
    ranged = any(isinstance(allowed.value, Range) for allowed in listed)
    tag = MessageTag.INTEGER if ranged else listed[0].tag
    if tag not in _PLAIN:
        raise ProfileError(f"The option {name!r} is no number and no word: leave it out of the profile's options.")
    if tag in (MessageTag.KEYWORD, MessageTag.NAME):
        if value not in capabilities.texts(f"{name}-supported"):
            known = _name_listed("the values", tuple(str(each.value) for each in listed))
            raise ProfileError(f"{name} = {value!r} is not among {known}.")
        return attribute(name, tag, value)
    if tag == MessageTag.BOOLEAN:
        return attribute(name, tag, value.lower() in ("true", "yes", "1"))
    try:
        return attribute(name, tag, int(value))
    except ValueError:
        raise ProfileError(f"{name} = {value!r} must be a whole number.") from None


def _name_listed(what: str, names: tuple[str, ...]) -> str:
    return f"{what} that it lists: {', '.join(names)}" if names else f"it lists no {what}"


class IppStatus(IntEnum):
    """Status codes after which something particular is done."""

    OK = 0x0000
    SUBSTITUTED = 0x0001
    NOT_POSSIBLE = 0x0404
    NOT_FOUND = 0x0406
    GONE = 0x0407
    NOT_SUPPORTED = 0x040B
    INTERNAL_ERROR = 0x0500
    OPERATION_NOT_SUPPORTED = 0x0501
    UNAVAILABLE = 0x0502
    VERSION_NOT_SUPPORTED = 0x0503
    DEVICE_ERROR = 0x0504
    TEMPORARY_ERROR = 0x0505
    BUSY = 0x0507
    TOO_MANY_JOBS = 0x050B


# after these the printer can be asked again a little later
RETRYABLE = frozenset({IppStatus.UNAVAILABLE, IppStatus.TEMPORARY_ERROR, IppStatus.BUSY, IppStatus.TOO_MANY_JOBS})
# after these a page may have been taken all the same
DOUBTFUL = frozenset({IppStatus.INTERNAL_ERROR, IppStatus.DEVICE_ERROR, IppStatus.TEMPORARY_ERROR})


class JobState(IntEnum):
    """Where a job is."""

    PENDING = 3
    HELD = 4
    PROCESSING = 5
    STOPPED = 6
    CANCELED = 7
    ABORTED = 8
    COMPLETED = 9

    @property
    def is_over(self) -> bool:
        """Whether it will not change again."""
        return self >= JobState.CANCELED


@cache
def _phrases() -> dict[str, dict[str, str]]:
    """What phrases.toml says of statuses and reasons."""
    return tomllib.loads(Path(__file__).with_name("phrases.toml").read_text(encoding="utf-8"))


_ENDINGS = ("-error", "-warning", "-report")
# no more sheets can have come out while one of these lasts
_BLOCKING = {
    *("media-empty", "media-needed", "media-jam", "media-path-media-jam", "marker-supply-empty", "toner-empty"),
    *("cover-open", "door-open", "interlock-open", "input-tray-missing"),
}


def phrase(code: int) -> str:
    """A status code as a phrase about the printer."""
    return _phrases()["statuses"].get(f"{code:#06x}", f"it answered with status {code:#06x}")


def _without_severity(keyword: str) -> str:
    # the keyword as a whole first: document-format-error is no error of "document-format"
    if keyword in _phrases()["reasons"]:
        return keyword
    return next((keyword.removesuffix(ending) for ending in _ENDINGS if keyword.endswith(ending)), keyword)


def reason_phrase(keywords: Sequence[str]) -> str:
    """Reasons of a state as one phrase, each once and in order; empty if there is nothing to say."""
    plain = dict.fromkeys(_without_severity(keyword) for keyword in keywords if keyword not in ("none", "job-printing"))
    words = _phrases()["reasons"]
    return ", ".join(dict.fromkeys(words.get(keyword, keyword.replace("-", " ")) for keyword in plain))


def blocks_output(keywords: Sequence[str]) -> bool:
    """Whether a printer with these reasons cannot be bringing out sheets."""
    return any(
        _without_severity(keyword) in _BLOCKING and not keyword.endswith(("-warning", "-report"))
        for keyword in keywords
    )


def is_jammed(keywords: Sequence[str]) -> bool:
    """Whether paper is stuck: an empty tray, by contrast, is what the last sheet leaves behind."""
    return any(_without_severity(keyword).endswith("media-jam") for keyword in keywords)
