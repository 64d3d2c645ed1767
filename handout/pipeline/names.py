"""What may be called by name, listed and checked without loading what the names stand for; and all that a page lists.

`KNOWN` and `CHECKS` are by what an option is called wherever it is (``hand``, ``x_height``): what its value may be.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from pathlib import Path

from handout import page_sizes, shipped, units
from handout.errors import InputError
from handout.inking.pen import PENS, brushes, colour_code
from handout.pipeline.options import pace
from handout.pipeline.results import Facts

_HOUSE = Path(__file__).resolve().parents[1] / "hand" / "house"
# the endings of files that may stand for a name
_ENDINGS = {
    "hand": (".hand", ".toml", ".svg"), "pen": (".brush", ".hand"), "style": (".toml", ".style"), "pose": (".pose",)
}  # fmt: skip


def hands() -> list[str]:
    """Hands that come with the program, and the user's own."""
    folders = (_HOUSE, shipped.user_folder("hands"))
    return sorted({path.stem for place in folders for path in place.glob("*") if path.suffix in _ENDINGS["hand"]})


def _machines(kind: str) -> list[str]:
    return [name.removeprefix(f"{kind}-") for name in _profiles(kind)]


def _profiles(kind: str | None = None) -> list[str]:
    from handout import profiles

    return profiles.names(kind)


def _ports() -> list[str]:
    from serial.tools.list_ports import comports

    return [*sorted(port.device for port in comports()), "auto", "sim:"]


def colour_formats() -> tuple[str, ...]:
    """That a calibration can be written as."""
    from handout.colour import exports

    return tuple(exports.FORMATS)


KNOWN: dict[str, Callable[[], list[str]]] = {
    "hand": hands,
    "pen": lambda: [*PENS, *brushes(), *hands()],
    "style": lambda: sorted(shipped.files("styles", "*.toml") | shipped.files("styles", "*.style")),
    "pose": lambda: sorted(shipped.files("poses", "*.pose")),
    "device": lambda: _machines("plotter"),
    "printer": lambda: _machines("printer"),
    "machine": _profiles,
    "port": _ports,
    "page": lambda: list(page_sizes.NAMES),
}


def _check_name(what: str) -> Callable[[str], object]:
    def check(text: str) -> None:
        choices = KNOWN[what]()
        if not text.endswith(_ENDINGS[what]) and text not in choices:
            near = difflib.get_close_matches(text, choices, 3, 0.5) or choices
            endings = " or ".join(", ".join(_ENDINGS[what]).rsplit(", ", 1))
            raise InputError(f"no {what} is called {text!r}: use {', '.join(near)}, or a {endings} file.")

    return check


def _paper(text: str) -> None:
    from handout.inking.papers import parse_paper as paper

    paper(text)


def _country(text: str) -> None:
    from handout.printing.address import find

    if text and find(text) is None:
        raise InputError(f"no country is called {text!r}: give its name or its code, such as Germany or DE.")


def _language(text: str) -> None:
    from babel import Locale, UnknownLocaleError

    try:
        Locale.parse(text.replace("-", "_"))
    except (ValueError, UnknownLocaleError):
        raise InputError(f"{text!r} is no language; give its code, such as de, fr or en-GB.") from None


def _plotter(text: str) -> object:
    from handout import profiles

    return profiles.locate(text, "plotter")


CHECKS: dict[str, Callable[[str], object]] = {
    "hand": _check_name("hand"),
    "pen": _check_name("pen"),
    "style": _check_name("style"),
    "pose": _check_name("pose"),
    "device": _plotter,
    "page": page_sizes.page,
    "paper": lambda text: None if text == "none" else _paper(text),
    "ink": colour_code,
    "speed": pace,
    "home_country": _country,
    "language": _language,
    **dict.fromkeys(("x_height", "line_spacing", "pen_width"), units.length),
}


def list_choices(files: Sequence[Path] = ()) -> Facts:
    """All that a page can choose by name, in the order in which it is shown; the hands of some .hand files win."""
    from handout.hand import library
    from handout.inking.papers import PAPERS
    from handout.motion.styles import style
    from handout.pipeline.devices import list_devices
    from handout.pipeline.kept_hands import list_hands, listed_file
    from handout.sinks import suffixes

    known, given, own = list_hands(), {path.stem: path for path in files}, library.own_scanned()
    scanned = [hand for hand in known.scanned if hand.name not in given]
    listed: list[Facts] = [{**hand.facts(), "about": hand.about, "drawn": True, "own": False} for hand in known.drawn]
    for hand in (*(listed_file(path) for path in given.values()), *scanned):
        mine = {"own": hand.name in own or hand.name in given, "removable": hand.name in own and hand.name not in given}
        listed.append({**hand.facts(), "about": hand.about, "drawn": False, **mine})
    machines = [machine for machine in list_devices() if machine.kind == "plotter"]
    return {
        "hands": listed,
        "pens": [*PENS, *brushes()],
        "papers": list(PAPERS),
        "pages": list(page_sizes.NAMES),
        "styles": style.names(),
        "formats": suffixes(),
        "plotters": [{"name": machine.name, "title": machine.title} for machine in machines],
    }
