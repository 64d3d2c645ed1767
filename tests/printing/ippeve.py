"""CUPS' own IPP Everywhere printer, on the loopback with a message bus and a name service of its own."""

import os
import shutil
import signal
import socket
import subprocess
import time
from contextlib import contextmanager, suppress
from pathlib import Path

_PATH = os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/usr/local/sbin"])
_BUS = """<!DOCTYPE busconfig PUBLIC "-//freedesktop//DTD D-Bus Bus Configuration 1.0//EN"
 "http://www.freedesktop.org/standards/dbus/1.0/busconfig.dtd">
<busconfig><type>session</type><listen>unix:path={folder}/bus</listen><auth>EXTERNAL</auth>
<policy context="default"><allow send_destination="*" eavesdrop="true"/><allow eavesdrop="true"/><allow own="*"/>
</policy></busconfig>
"""
_NAMES = """[server]
use-ipv4=yes
use-ipv6=no
allow-interfaces=lo
[publish]
publish-hinfo=no
publish-workstation=no
"""
# keeps what came out: the document as it was received, and what the printer was told of it
_PRINT = """#!/bin/sh
touch "{folder}/begun"
while [ -f "{folder}/slow" ]; do sleep 0.05; done
n=$(ls "{folder}/printed" | grep -c document)
cp "$1" "{folder}/printed/$n.document"
env | grep '^IPP_' > "{folder}/printed/$n.told"
"""
FORMATS = "application/pdf,image/jpeg,image/pwg-raster,image/urf"


class Missing(Exception):
    """Why it cannot be run here."""


class Everywhere:
    """The printer; it can be killed and started again."""

    def __init__(self, folder: Path, formats: str = FORMATS) -> None:
        self.folder, self._formats = folder, formats
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        for name in ("spool", "keys", "printed"):
            (folder / name).mkdir(exist_ok=True)
        (folder / "print.sh").write_text(_PRINT.format(folder=folder))
        (folder / "print.sh").chmod(0o755)
        self._process: subprocess.Popen | None = None

    def uri(self, scheme: str = "ipp") -> str:
        return f"{scheme}://localhost:{self.port}/ipp/print"

    def start(self) -> None:
        command = [
            _program("ippeveprinter"), "-n", "localhost", "-p", str(self.port), "-d", str(self.folder / "spool"), "-k",
            "-K", str(self.folder / "keys"), "-s", "10,5", "-2", "-c", str(self.folder / "print.sh"),
            "-f", self._formats, "-r", "off", "Test",
        ]  # fmt: skip
        bus = {**os.environ, "DBUS_SYSTEM_BUS_ADDRESS": f"unix:path={self.folder}/bus"}
        self._process = _started(command, self.folder / "printer.log", bus)
        _until(lambda: _answers(self.port), self._process, "ippeveprinter does not answer")

    def kill(self) -> None:
        """Switch it off in the middle of whatever it does, with the script that prints; one that never began is off."""
        if self._process is not None:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()

    @property
    def documents(self) -> list[bytes]:
        return [path.read_bytes() for path in self._printed("document")]

    @property
    def told(self) -> list[dict[str, str]]:
        return [
            dict(line.split("=", 1) for line in path.read_text().splitlines() if "=" in line)
            for path in self._printed("told")
        ]

    def _printed(self, kind: str) -> list[Path]:
        return sorted((self.folder / "printed").glob(f"*.{kind}"), key=lambda path: int(path.stem))


@contextmanager
def services(folder: Path):
    """The message bus and the name service that it cannot do without."""
    bus, names = _program("dbus-daemon"), _program("avahi-daemon")
    (folder / "bus.conf").write_text(_BUS.format(folder=folder))
    (folder / "names.conf").write_text(_NAMES)
    address = {**os.environ, "DBUS_SYSTEM_BUS_ADDRESS": f"unix:path={folder}/bus"}
    running = []
    try:
        running.append(
            _started([bus, f"--config-file={folder}/bus.conf", "--nofork", "--nopidfile"], folder / "bus.log", address)
        )
        _until(lambda: (folder / "bus").exists(), running[0], "dbus-daemon does not start")
        options = ["-f", str(folder / "names.conf"), "--no-drop-root", "--no-chroot", "--no-rlimits", "--debug"]
        log = folder / "names.log"
        running.append(_started([names, *options], log, address))
        _until(lambda: "startup complete" in log.read_text(), running[1], "avahi-daemon does not start")
        yield
    finally:
        for process in reversed(running):
            with suppress(ProcessLookupError):  # it ended by itself; the others are still to be ended
                os.killpg(process.pid, signal.SIGTERM)
            process.wait()


def _program(name: str) -> str:
    found = shutil.which(name, path=_PATH)
    if found is None:
        raise Missing(f"{name} is not installed (Debian: cups-ipp-utils, dbus, avahi-daemon)")
    return found


def _started(command, log: Path, environment) -> subprocess.Popen:
    with log.open("ab") as stream:
        return subprocess.Popen(command, stdout=stream, stderr=stream, env=environment, start_new_session=True)


def _until(ready, process: subprocess.Popen, complaint: str) -> None:
    end = time.monotonic() + 15
    while not ready():
        if process.poll() is not None or time.monotonic() > end:
            raise Missing(f"{complaint} (exit status {process.poll()})")
        time.sleep(0.02)


def _answers(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), 1).close()
    except OSError:
        return False
    return True
