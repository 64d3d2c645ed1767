"""Status codes of IPP, states of jobs and printers and their reasons, and what they mean in words.

A reason that a printer gives and nobody understands gets its words in `_REASONS`.

Source: RFC 8011 §5.3.7–5.3.8 and §5.4.11–5.4.12 (states and their reasons), §4.1.6 and appendix B (status codes);
PWG 5100.13 for what multifunction printers add.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum


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
