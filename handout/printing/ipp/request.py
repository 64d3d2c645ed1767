"""What a printer is asked for with a page, within what it can do, and what its answers mean in words.

A reason that a printer gives and nobody understands gets its words in `_REASONS`.

Source: RFC 8011 §5.3.7–5.3.8 and §5.4.11–5.4.12 (states and their reasons), §4.1.6 and appendix B (status codes);
PWG 5100.13 for what multifunction printers add.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from handout.errors import ProfileError
from handout.printing.ipp.message import Attribute, Message, MessageTag, Range, Resolution, attribute
from handout.printing.queue import Ticket

_DOTS_AN_INCH = 3  # the unit of a resolution, see `message.Resolution`
_HUNDREDTHS = 100  # PWG 5100.7: media-col has its lengths in 1/100 mm
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


_PHRASES = {
    0x0400: "it does not understand the request",
    0x0401: "it does not allow that",
    0x0402: "it asks for a name and a password, which cannot be given here",
    0x0403: "it does not allow that to this computer",
    0x0404: "it is too late for that",
    0x0405: "it waited too long for the page",
    0x0406: "it knows no such thing",
    0x0407: "it does not keep that any longer",
    0x0408: "the page is too large for it",
    0x040A: "it cannot print this kind of document",
    0x040B: "it cannot do what was asked for",
    0x040D: "it does not know the character set",
    0x0411: "it found an error in the document",
    0x0412: "it found an error in the document",
    0x0500: "it has an error within",
    0x0501: "it does not know this operation",
    0x0502: "it is not in service",
    0x0503: "it does not speak this version of IPP",
    0x0504: "it has a fault",
    0x0505: "it has a passing fault",
    0x0506: "it accepts no jobs at present",
    0x0507: "it is busy",
    0x0508: "the job was cancelled",
    0x050B: "it has too many jobs",
}

# keyword without its ending -error, -warning or -report → what it means to the person at the printer
_REASONS = {
    "media-empty": "the tray is empty",
    "media-needed": "it wants paper or envelopes put in",
    "media-jam": "the paper has jammed",
    "media-low": "the tray is nearly empty",
    "media-path-media-jam": "the paper has jammed",
    "media-not-loaded": "the sheet that was asked for is not in the tray",
    "input-tray-missing": "a tray is missing",
    "input-manual-input-request": "it waits for a sheet to be fed by hand",
    "output-area-full": "the output tray is full",
    "output-area-almost-full": "the output tray is nearly full",
    "output-tray-missing": "the output tray is missing",
    "marker-supply-low": "an ink is low",
    "marker-supply-empty": "an ink is used up",
    "marker-waste-almost-full": "the waste ink pad is nearly full",
    "marker-waste-full": "the waste ink pad is full",
    "toner-low": "the toner is low",
    "toner-empty": "the toner is used up",
    "cover-open": "a cover is open",
    "door-open": "a door is open",
    "interlock-open": "a door is open",
    "paused": "it has been paused",
    "moving-to-paused": "it is being paused",
    "shutdown": "it is switched off or shutting down",
    "stopping": "it is stopping",
    "spool-area-full": "its memory is full",
    "connecting-to-device": "it is being reached",
    "timed-out": "it does not answer the print server",
    "offline": "it is off line",
    "printer-stopped": "the printer is stopped",
    "printer-stopped-partly": "the printer is stopped in part",
    "job-incoming": "the page is still arriving",
    "job-data-insufficient": "the page has not arrived",
    "job-printing": "it is printing",
    "job-queued": "it waits its turn",
    "job-hold-until-specified": "it is held until a given time",
    "job-password-wait": "it waits for a password at the printer",
    "resources-are-not-ready": "the sheet or the tray that was asked for is not ready",
    "job-canceled-by-user": "it was cancelled by the user",
    "job-canceled-by-operator": "it was cancelled at the print server",
    "job-canceled-at-device": "it was cancelled at the printer",
    "job-canceled-after-timeout": "it was cancelled after waiting too long",
    "aborted-by-system": "the printer gave it up",
    "unsupported-document-format": "the printer cannot print this kind of document",
    "document-format-error": "the printer found an error in the document",
    "document-unprintable-error": "the printer cannot print the document",
    "processing-to-stop-point": "it is being stopped",
    "job-completed-with-errors": "it ended with errors",
    "job-completed-with-warnings": "it ended with warnings",
    "job-completed-successfully": "it was printed",
}
_ENDINGS = ("-error", "-warning", "-report")
# no more sheets can have come out while one of these lasts
_BLOCKING = {
    *("media-empty", "media-needed", "media-jam", "media-path-media-jam", "marker-supply-empty", "toner-empty"),
    *("cover-open", "door-open", "interlock-open", "input-tray-missing"),
}


def phrase(code: int) -> str:
    """A status code as a phrase about the printer."""
    return _PHRASES.get(code, f"it answered with status {code:#06x}")


def _without_severity(keyword: str) -> str:
    # the keyword as a whole first: document-format-error is no error of "document-format"
    if keyword in _REASONS:
        return keyword
    return next((keyword.removesuffix(ending) for ending in _ENDINGS if keyword.endswith(ending)), keyword)


def reason_phrase(keywords: Sequence[str]) -> str:
    """Reasons of a state as one phrase, each once and in order; empty if there is nothing to say."""
    plain = dict.fromkeys(_without_severity(keyword) for keyword in keywords if keyword not in ("none", "job-printing"))
    return ", ".join(dict.fromkeys(_REASONS.get(keyword, keyword.replace("-", " ")) for keyword in plain))


def blocks_output(keywords: Sequence[str]) -> bool:
    """Whether a printer with these reasons cannot be bringing out sheets."""
    return any(
        _without_severity(keyword) in _BLOCKING and not keyword.endswith(("-warning", "-report"))
        for keyword in keywords
    )


def is_jammed(keywords: Sequence[str]) -> bool:
    """Whether paper is stuck: an empty tray, by contrast, is what the last sheet leaves behind."""
    return any(_without_severity(keyword).endswith("media-jam") for keyword in keywords)
