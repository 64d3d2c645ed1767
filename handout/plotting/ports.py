"""Ports move bytes to and from a machine and know nothing of what these mean; and which serial ports there are."""

from __future__ import annotations

import contextlib
import errno
import re
import time
from abc import abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol, cast

from handout.errors import PortError
from handout.plotting.bed import BedPlacement
from handout.values import Drawing, Page


class Port(Protocol):
    """What a driver needs of a connection."""

    def write(self, data: bytes) -> None:
        """Send bytes; PortError if the connection is lost."""

    def read(self, timeout: float) -> bytes:
        """What has come in; waits up to `timeout` seconds for a first byte, and returns nothing if none comes."""

    def close(self) -> None:
        """Close the connection; harmless if it is closed."""


class InstrumentedPort(Port):
    """A port to a machine that also tells what its pen really did, and by which clock: the simulated plotter."""

    @property
    @abstractmethod
    def keeps_real_time(self) -> bool:
        """Whether its time passes while nobody reads."""

    @property
    @abstractmethod
    def time(self) -> float:
        """What its clock would show now, s."""

    @property
    @abstractmethod
    def executed_s(self) -> float:
        """Seconds from the first instruction of the plot to the end of the last motion or pause."""

    @abstractmethod
    def lay(self, page: Page, placement: BedPlacement) -> None:
        """Lay a fresh sheet on the bed; times of execution start anew."""

    @abstractmethod
    def executed_drawing(self) -> Drawing:
        """What the pen has drawn on the sheet, with the times at which it was executed."""


def clock_of(port: Port) -> Callable[[], float]:
    """The clock of a port, s: that of the simulation if it has one, else this computer's."""
    return (lambda: cast(InstrumentedPort, port).time) if hasattr(port, "time") else time.monotonic


class TimedReader:
    """Reads from a port and counts the time that passes while it does.

    time : s so far. A read that returns nothing has waited for its whole time; for any other the clock is asked.
    since : s by the port's clock, when the last bytes had certainly not come in yet: the beginning of the read before.
    """

    def __init__(self, port: Port) -> None:
        self.port, self.time = port, 0.0
        self._clock = clock_of(port)
        self.since = self._begun = self._clock()

    def read(self, timeout: float) -> bytes:
        """What has come in; waits up to `timeout` s for a first byte."""
        self.since, self._begun = self._begun, self._clock()
        data = self.port.read(timeout)
        self.time += self._clock() - self._begun if data else timeout
        return data


class SerialPort:
    """A port of pyserial's: a device, or one of its addresses."""

    def __init__(self, url: str, baud: int) -> None:
        import serial

        self.url = url
        try:
            more = {} if "://" in url else {"exclusive": True}
            self._serial: Any = serial.serial_for_url(url, baudrate=baud, timeout=0.1, write_timeout=10, **more)
        except (OSError, ValueError) as error:  # pyserial's own errors are OSErrors
            raise PortError(_explain_failure(url, error)) from error
        _keep_awake(self._serial)

    def write(self, data: bytes) -> None:
        """Send bytes."""
        try:
            self._serial.write(data)
        except OSError as error:
            raise PortError(self._lost_message()) from error

    def read(self, timeout: float) -> bytes:
        """What has come in; waits up to `timeout` seconds for a first byte."""
        try:
            if self._serial.timeout != timeout:
                self._serial.timeout = timeout
            data: bytes = self._serial.read(1)
            while data and (more := self._serial.in_waiting):
                data += self._serial.read(more)
            return data
        except (OSError, TypeError) as error:  # pyserial raises TypeError where a port was closed under it
            raise PortError(self._lost_message()) from error

    def close(self) -> None:
        """Close the connection."""
        self._serial.close()

    def _lost_message(self) -> str:
        return f"The connection to {self.url} is lost: is the plotter still plugged in and switched on?"


def _explain_failure(url: str, error: Exception) -> str:
    """One sentence on why a port cannot be opened, and one on which there are."""
    if "://" in url:
        return f"{url} cannot be opened ({_reason(error)}): check the address, and that the machine is on the network."
    text, number = str(error), getattr(error, "errno", None)
    if not url:
        reason = "No port was given."
    elif number == errno.ENOENT or "FileNotFoundError" in text:
        reason = f"{url} does not exist: is the plotter plugged in and switched on?"
    elif number == errno.EACCES:
        reason = f"{url} may not be used by you: on Linux, join the group dialout (or uucp) and log in again."
    elif number in (errno.EBUSY, errno.EAGAIN) or "PermissionError" in text:  # Windows refuses a port in use
        reason = f"{url} is in use: close the other program that talks to the plotter."
    else:
        reason = f"{url} cannot be opened as a serial port ({_reason(error)}): check the name."
    ports = serial_ports()
    return f"{reason} Serial ports found: {', '.join(ports)}." if ports else f"{reason} No serial port was found."


def _reason(error: Exception) -> str:
    return re.sub(r"\s+", " ", getattr(error, "strerror", None) or str(error)).rstrip(".")


def _keep_awake(port: Any) -> None:
    """Closing the port must not drop its DTR line: a controller that has that on its reset forgets where it is.

    The first opening resets such a controller (an Uno) all the same; the second finds it as it was left.
    """
    try:
        import termios
    except ImportError:  # Windows
        return
    with contextlib.suppress(AttributeError, OSError, ValueError, TypeError, termios.error):  # a socket, some terminals
        modes = termios.tcgetattr(port.fileno())
        modes[2] &= ~termios.HUPCL
        termios.tcsetattr(port.fileno(), termios.TCSANOW, modes)


class SerialDevice(NamedTuple):
    """A serial port of this computer: its name, what it is called, and its USB id (vendor, product) if it has one."""

    name: str
    title: str
    usb: tuple[int, int] | None

    @property
    def usb_text(self) -> str:
        """As it is usually written, ``04d8:fd92``; empty if it has none."""
        return "" if self.usb is None else f"{self.usb[0]:04x}:{self.usb[1]:04x}"


def serial_devices() -> list[SerialDevice]:
    """The serial ports of this computer, by name."""
    from serial.tools import list_ports

    rows = [(port.device, port.description or "", port.vid, port.pid) for port in list_ports.comports()]
    return sorted(
        SerialDevice(name, "" if title == "n/a" else title, None if vid is None or pid is None else (vid, pid))
        for name, title, vid, pid in rows
    )


def serial_ports() -> list[str]:
    """Names of the serial ports of this computer."""
    return [port.name for port in serial_devices()]
