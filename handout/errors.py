"""Everything that can go wrong, as one tree.

    HandoutError
    ├── InputError            exit code 2: what was asked for cannot be done as asked
    │   ├── MissingCharacters     the hand has no form for some characters
    │   ├── DoesNotFit            text larger than its page, drawing larger than the bed
    │   ├── ProfileError          a machine's TOML file is wrong
    │   └── TableError            a CSV that cannot be read as addresses
    └── DeviceError           exit code 3: the machine or its port
        ├── PortError             the port cannot be opened, or was lost
        ├── DeviceSilent          nothing answered in time
        ├── DeviceHeld            it was held, and nobody let it go on
        ├── PrinterError          a print queue is missing, or refused a page
        └── DeviceAlarm           the machine reported an error or an alarm
            └── DeviceGarbled         a command came over wrong

A message is one sentence or two: what, where, the bound, the way out.  It never needs a traceback, and what it quotes
of the user's is cut to what a screen can show.
"""

import contextlib
import errno
import re
from collections.abc import Iterator

_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_NO_ROOM = "The disk is full: what was kept before is as it was. Make room, then do this again."
_TOO_DEEP = "What was given is nested too deeply to be read, one thing within another hundreds of times: nest it less."
# characters of a word, and of a message, beyond which its middle is left out; set by eye: more than names of files and
# lists of what may be said have, less than a screen
_MOST_WORD, _MOST_MESSAGE = 300, 3000
_LONG_WORD = re.compile(rf"\S{{{_MOST_WORD + 1},}}")


def shorten_message(message: str) -> str:
    """A message without the middle of what it quotes, where that is longer than anybody reads."""
    message = _LONG_WORD.sub(lambda word: _without_middle(word.group(), _MOST_WORD), message)
    return _without_middle(message, _MOST_MESSAGE) if len(message) > _MOST_MESSAGE else message


def _without_middle(text: str, most: int) -> str:
    half = most // 2 - 20
    return f"{text[:half]} … ({len(text) - 2 * half} characters more) … {text[-half:]}"


class HandoutError(Exception):
    """Root of the tree; `exit_code` is what the command returns for it."""

    exit_code = 2

    def __str__(self) -> str:
        return shorten_message(super().__str__())


class InputError(HandoutError):
    """What the user gave cannot be used as it is."""


class MissingCharacters(InputError):
    """The hand lacks forms for some characters of the text."""


class DoesNotFit(InputError):
    """Something is larger than the place it has to go."""


class ProfileError(InputError):
    """A machine description in a TOML file is not valid."""


class TableError(InputError):
    """A table of addresses cannot be read."""


class DeviceError(HandoutError):
    """A machine, or the way to it, failed."""

    exit_code = 3


class PortError(DeviceError):
    """A port cannot be opened, or the connection was lost."""


class DeviceSilent(DeviceError):
    """The machine did not answer in time."""


class DeviceHeld(DeviceError):
    """The machine is held or waits for a person, and nobody is there."""


class PrinterError(DeviceError):
    """A print queue cannot be reached, does not exist, or refused a page."""


class DeviceAlarm(DeviceError):
    """The machine reported an error or stopped with an alarm."""


class DeviceGarbled(DeviceAlarm):
    """A command came over wrong or not at all: what the machine has done since it was last certain may be wrong."""


@contextlib.contextmanager
def reported(doing: str) -> Iterator[None]:
    """A block in which something is done with a file, such as "read notes.txt": InputError where that fails."""
    try:
        yield
    except OSError as error:
        raise InputError(f"Cannot {doing}: {error.strerror or error}.") from error


def reason(error: BaseException) -> str:
    """Why something ended, for a journal: what the error says, or what it is."""
    return str(error) or ("it was interrupted" if isinstance(error, KeyboardInterrupt) else type(error).__name__)


def at_border(error: BaseException | None) -> str:
    """The sentence for an error that any work may meet, also where it was raised again as another; "" for all others.

    That is a full disk, and what is nested more deeply than Python goes.
    """
    if isinstance(error, RecursionError):
        return _TOO_DEEP
    while error is not None and getattr(error, "errno", None) not in _FULL:
        error = error.__cause__ or error.__context__
    return "" if error is None else _NO_ROOM
