"""The user's calibrations: one folder each, by printer, paper and time; the newest of a printer and paper is used.

A folder holds `about.json`, `patches.ti3` (what the chart's scan showed), `table.npz`, once it was verified
`strip.json` and `verification.json`, and what the pen wrote in the chart's frame.  It appears whole or not at all.
"""

from __future__ import annotations

import contextlib
import difflib
import json
import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from handout import atomic, profiles, shipped
from handout.errors import InputError, reported

if TYPE_CHECKING:
    from handout.colour.models.forward import Patches
    from handout.colour.reading import Scribble
    from handout.colour.table import ColourTable


ABOUT, TABLE, PATCHES = "about.json", "table.npz", "patches.ti3"
STRIP, VERIFICATION = "strip.json", "verification.json"
_SCRIBBLE, _PEN, _REPORT = "scribble.npz", "pen.json", "report.html"


@dataclass(frozen=True)
class Calibration:
    """What is known of one printer and paper as one scanner sees them.

    folder : where it is kept; None for a table that came as a file of its own.
    table_file : of the colour table.
    printer, paper, scanner, method : as they were named.
    date : when the table was built.
    misses : ΔE00 by which the model misses its own patches, on the mean; None where that is not known.
    """

    folder: Path | None
    table_file: Path
    printer: str
    paper: str
    date: datetime
    scanner: str = ""
    method: str = ""
    misses: float | None = None

    @property
    def name(self) -> str:
        """``printer/paper``."""
        return f"{self.printer}/{self.paper}"

    @property
    def patches_file(self) -> Path | None:
        """The CGATS table of the chart's patches."""
        return None if self.folder is None else self.folder / PATCHES

    def age(self) -> int:
        """Days since it was made."""
        return max(0, (now() - self.date).days)

    def table(self) -> ColourTable:
        """Its colour table; raises InputError."""
        from handout.colour.table import load

        return load(self.table_file)

    def describe(self) -> str:
        """Name, date and age, as they are said in a message."""
        days = self.age()
        old = "made today" if days == 0 else f"{days} day{'s' if days > 1 else ''} old"
        return f"calibration {self.name} of {self.date:%Y-%m-%d} ({old})"

    def facts(self) -> dict[str, Any]:
        """What ``--json`` prints of it."""
        return {
            "printer": self.printer, "paper": self.paper, "made": self.date.isoformat(timespec="seconds"),
            "age_days": self.age(), "scanner": self.scanner, "method": self.method, "misses": self.misses,
            "folder": str(self.folder or self.table_file), "verification": self.load_kept(VERIFICATION),
            "pen": {"written": self.scribble() is not None, "hand": self.pen_of()},
        }  # fmt: skip

    def load_kept(self, name: str) -> dict[str, Any] | None:
        """What was found last of its `STRIP` (see `strip.VerificationStrip.facts`) or `VERIFICATION`; None: nothing."""
        path = None if self.folder is None else self.folder / name
        return read_json(path) if path is not None and path.is_file() else None

    def keep(self, name: str, facts: Mapping[str, Any]) -> None:
        """Remember what was found last."""
        if self.folder is None:
            raise InputError(
                f"{self.table_file} is a table by itself, to which nothing can be added: name the printer."
            )
        atomic.write(self.folder / name, json.dumps(dict(facts), indent=1).encode())

    def scribble(self) -> Scribble | None:
        """What was written in the chart's frame with a pen; None if nothing was.  Raises InputError."""
        if self.folder is None or not (self.folder / _SCRIBBLE).is_file():
            return None
        from handout.colour.reading.pen_field import load

        return load(self.folder / _SCRIBBLE)

    def pen_of(self) -> str:
        """The hand whose pen wrote in the chart's frame; empty if nobody said."""
        return str((self.load_kept(_PEN) or {}).get("hand", ""))

    def keep_scribble(self, path: Path, hand: str) -> None:
        """Take along what was written in the chart's frame with the pen of a hand."""
        assert self.folder is not None
        atomic.write(self.folder / _SCRIBBLE, path.read_bytes())
        self.keep(_PEN, {"hand": hand})

    def keep_report(self, path: Path) -> None:
        """Take a report along."""
        assert self.folder is not None
        atomic.write(self.folder / _REPORT, path.read_bytes())

    @property
    def report(self) -> Path | None:
        """The report on its chart and strip, if there is one."""
        path = None if self.folder is None else self.folder / _REPORT
        return path if path is not None and path.is_file() else None


def read_json(path: Path) -> dict[str, Any]:
    """A file of a calibration; raises InputError."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=dict[str, Any])
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path} cannot be read as part of a calibration: make a new one.") from error


def now() -> datetime:
    """The time, with its zone."""
    return datetime.now().astimezone()


PLAIN = "plain"
_FACTS = ("printer", "paper", "made", "scanner", "method", "version")
_MOST_NAME = 60  # characters; file systems take 255 bytes


def folder() -> Path:
    """Where calibrations are kept; it need not exist."""
    return shipped.own_folder("data") / "calibrations"


def key(name: str) -> str:
    """What a printer or a paper is called in the store: a profile's name without ``printer-``, only letters and digits.

    Raises InputError: nothing is left of it.
    """
    stem = Path(name).stem if name.endswith(".toml") else name
    cleaned = re.sub(r"[^a-z0-9._]+", "-", stem.strip().lower()).strip("-.")
    cleaned = profiles.full(cleaned.removeprefix("printer-"))[:_MOST_NAME]
    if not cleaned:
        raise InputError(f"{name!r} cannot be the name of a printer or a paper: use letters and digits.")
    return cleaned


def build(
    place: Path, patches: Patches, printer: str, paper: str, scanner: str = "", method: str = "forward"
) -> Calibration:
    """Make a calibration of a chart's patches in the folder `place`, which appears when all is done.

    Raises InputError: patches that no table can be made of, an unknown method, or a folder that cannot be written.
    """
    from handout.colour import cgats, table
    from handout.colour.chart_files import ti3
    from handout.colour.models import fit

    model = fit(patches, method)
    about = {
        "printer": key(printer), "paper": key(paper), "made": now().isoformat(timespec="seconds"),
        "scanner": scanner,
    }  # fmt: skip
    colour_table = table.build(model, about)
    with _new_folder(place) as work:
        table.save(colour_table, work / TABLE)
        keywords = {name.upper(): value for name, value in about.items() if value}
        cgats.write(work / PATCHES, ti3(patches, keywords))
        facts = {name: colour_table.about.get(name, "") for name in _FACTS} | {
            "misses": round(float(model.misses.mean()), 3)
        }
        atomic.write(work / ABOUT, json.dumps(facts, indent=1).encode())
    return load(place)


def add(calibration: Calibration) -> Calibration:
    """Keep a calibration among the user's own, once; it is the one that is used from now on."""
    assert calibration.folder is not None
    kept = (
        other.folder for other in list_stored(calibration.printer, calibration.paper) if other.date == calibration.date
    )
    place = next(kept, None) or _place(calibration.printer, calibration.paper, calibration.date)
    with _new_folder(place) as work:
        for path in calibration.folder.iterdir():
            shutil.copy2(path, work / path.name)
    return load(place)


def build_stored(patches: Patches, printer: str, paper: str, scanner: str = "", method: str = "forward") -> Calibration:
    """`build` among the user's own calibrations."""
    return build(_place(key(printer), key(paper), now()), patches, printer, paper, scanner, method)


def load(place: Path) -> Calibration:
    """The calibration in a folder, or of a colour table's file. Raises InputError: it is none."""
    if place.is_dir():
        about, table_file, home = read_json(place / ABOUT), place / TABLE, place
    else:
        from handout.colour.table import load as load_table

        about, table_file, home = dict(load_table(place).about), place, None
    try:
        date = datetime.fromisoformat(str(about["made"]))
        return Calibration(
            home, table_file, str(about["printer"]), str(about["paper"]), date, str(about.get("scanner", "")),
            str(about.get("method", "")), about.get("misses"),
        )  # fmt: skip
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(f"{place} does not say what it was made for: build it again (calibrate build).") from error


def list_stored(printer: str = "", paper: str = "") -> list[Calibration]:
    """Stored calibrations, all or of a printer and a paper, the newest first; folders that are none are passed over."""
    calibrations = []
    # a name with a dot in front is a folder that was never finished
    for path in folder().glob("*/*/[!.]*/" + ABOUT):
        with contextlib.suppress(InputError):
            calibrations.append(load(path.parent))
    names = key(printer) if printer else "", key(paper) if paper else ""
    calibrations = [c for c in calibrations if names[0] in ("", c.printer) and names[1] in ("", c.paper)]
    return sorted(calibrations, key=lambda calibration: (calibration.date, str(calibration.folder)), reverse=True)


def newest(printer: str, paper: str = "") -> Calibration | None:
    """The newest of a printer, and of a paper if one is named; None if there is none."""
    return next(iter(list_stored(key(printer), paper)), None)


def find_wanted(printer: str, paper: str = "") -> Calibration:
    """As `newest`, where there has to be one. Raises InputError: there is none; the message lists what there is."""
    calibration = newest(printer, paper)
    if calibration is not None:
        return calibration
    names = sorted({stored.name for stored in list_stored()})
    which = f"{key(printer)}/{key(paper)}" if paper else key(printer)
    near = difflib.get_close_matches(which, names, 3, 0.3) or names
    have = f"there are calibrations for {', '.join(near)}" if near else "nothing is calibrated yet"
    raise InputError(
        f"There is no calibration for {which}; {have}. Make one with: handout calibrate wizard --printer "
        f"{key(printer)}."
    )


def _place(printer: str, paper: str, date: datetime) -> Path:
    base = folder() / printer / paper
    name = f"{date:%Y-%m-%dT%H%M%S}"
    return next(p for n in range(1000) if not (p := base / (f"{name}-{n}" if n else name)).exists())


@contextlib.contextmanager
def _new_folder(place: Path) -> Iterator[Path]:
    """A folder that takes the place of `place` when the block ends without an error."""
    with reported(f"write {place}"):
        place.parent.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(dir=place.parent, prefix=".new-"))
    try:
        yield work
        if place.exists():
            shutil.rmtree(place)
        work.chmod(0o755)
        atomic.move_folder(work, place)
    except BaseException:
        shutil.rmtree(work, ignore_errors=True)
        raise


def read_patches(path: Path) -> Patches:
    """The patches of a .ti3 that the reading of a chart has made.

    Raises InputError: not such a file, or patches that no printer can be known by.
    """
    from handout.colour import cgats
    from handout.colour.chart_files import from_ti3
    from handout.colour.models.forward import Patches

    return Patches(*from_ti3(cgats.read_tables(path)))
