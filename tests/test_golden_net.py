"""What every document becomes at every destination, byte for byte: SHA-256 of all that some seventy runs leave behind.

The net catches what no other test looks at: a change that was not meant to change any output changes none of these.
The table, golden/net.toml, is made anew only on purpose, and keeps why:

    python tests/test_golden_net.py --renew "the o of house-joined is wider"

It is the table of one processor and of one version of each library that makes numbers; on others the runs are skipped.
"""

import contextlib
import hashlib
import io
import json
import os
import platform
import re
import runpy
import shlex
import sys
import tempfile
import tomllib
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from unittest import mock

import cv2
import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from handout import __version__
from handout.cli import main
from handout.simulated.plotter.port import SimulatedPlotter

ROOT = Path(__file__).resolve().parent.parent
TABLE = Path(__file__).parent / "golden" / "net.toml"
DRAWN = ("house-joined", "house-print", "house-quick")
SCANNED = ("house-joined-ballpoint", "house-print-fountain")
MACHINES = {  # dialect → machine, and the fault by which a plot on it breaks off
    "grbl": ("grbl-servo", "alarm"),
    "marlin": ("marlin-servo", "unplugged"),
    "ebb": ("axidraw-v3", "reset"),
    "hpgl": ("hp-7475a", "unplugged"),
    "klipper": ("klipper-servo", "lost-board"),
}
LIBRARIES = ("numpy", "scipy", "opencv-contrib-python-headless", "pillow", "reportlab", "pikepdf", "scikit-image")
ADA = '"Dear Ada, 3 parcels came. Thank you!"'
# what differs between two runs that are alike: times, and names that are made of them
VARYING = (
    (rb"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d+)?)?(Z|[+-]\d\d:?\d\d)?", b"<time>"),
    (rb"\b(jan|feb|mar|apr|may|jun|jul|aug|sep|oct|nov|dec)\d{1,2}-\d+\b", b"<job>"),
    (rb"\bhandout [0-9a-f]{6} (?=row )", b"<batch> "),
    (rb"D:\d{14}([Z+-][\d']*)?", b"<time>"),
    (re.escape(__version__.encode()), b"<version>"),
)


def _runs() -> dict[str, tuple[str, ...]]:
    """Name → the commands of a run, each but for its `handout`; all of one run work in one folder."""
    runs: dict[str, tuple[str, ...]] = {}
    for hand in DRAWN:
        for suffix in ("svg", "png", "pdf", "inkml", "json", "dxf", "eps"):
            runs[f"text {hand} {suffix}"] = (f"write {ADA} --hand {hand} --page A6 --dpi 150 -o a.{suffix}",)
    for hand in SCANNED:
        outputs = "-o a.svg -o a.png -o a.pdf -o a.inkml -o a.json -o a.dxf"
        runs[f"text {hand}"] = (f"write {ADA} --hand {hand} --page A6 --dpi 150 {outputs}",)
    for name, options in {
        "sigma-lognormal": "--kinematics sigma-lognormal -o a.svg -o a.inkml",
        "slips, haste, right": "--slips 20 --haste 0.5 --align right -o a.svg",
        "style": "--style fast-tag -o a.svg -o a.json",
        "brush pen": "--pen brushpen --ink navy --dpi 150 -o a.png",
        "sumi on laid paper": "--pen sumi --paper laid --dpi 100 -o a.png",
        "ruled paper": "--paper ruled:8mm --dpi 100 -o a.png -o a.svg",
        "layers of words": "--layer-by word -o a.svg -o a.dxf",
    }.items():
        runs[f"text, {name}"] = (f"write {ADA} --page A6 {options}",)
    runs["text, two pages"] = (f"write --file {ROOT}/examples/letter.txt --page A6 --pages 9 -o a.pdf -o a.svg",)
    for hand in (DRAWN[0], SCANNED[0]):
        options = f"--hand {hand} --dpi 100 -o a.pdf -o a.svg -o a.png"
        runs[f"letter file {hand}"] = (f"write {ROOT}/examples/thank-you.md {options}",)
    for dialect, (machine, fault) in MACHINES.items():
        suffix = {"ebb": "ebb", "hpgl": "hpgl"}.get(dialect, "gcode")
        runs[f"program {dialect}"] = (f"export {ADA} --device {machine} --page A6 --x-height 2mm -o a.{suffix}",)
        plot = f"plot {ADA} --device {machine} --page A6 --x-height 2mm --report report.json --port"
        runs[f"plot {dialect}"] = (f"{plot} sim:",)
        runs[f"plot {dialect}, broken off"] = (
            f'{plot} "sim:?fault={fault}&after=200"',
            "plot --resume --at-zero --port sim: --report resumed.json",
        )
    runs["plot again, a part"] = (f"plot {ADA} --page A6 --port sim:", "plot --again --port sim: --from-word parcels")
    runs["plot preview"] = (f"plot {ADA} --page A6 --show-travel --dry-run a.svg",)
    runs["plot rows"] = (
        f"plot {ROOT}/examples/people.csv --letter card.md --rows 2-3 --page 100x70mm --grid 2x1 --port sim: --device "
        "grbl-servo",
    )
    runs["plot scanned"] = (f'plot "Dear Ada" --hand {SCANNED[0]} --page A6 --port sim: --report report.json',)
    drawing = f"{ROOT}/tests/golden/loops.svg"
    runs["drawing, SVG"] = (
        f"export {drawing} --order travel -o a.gcode",
        f"plot {drawing} --layers colour --port sim:",
    )
    inkml = f"write {ADA} --page A6 -o a.inkml"
    runs["drawing, InkML"] = (inkml, "export a.inkml -o a.hpgl", "export a.inkml -o a.ebb")
    for style in ("fast-tag", "calm", "blackletter"):
        runs[f"restyled {style}"] = (f"restyle {drawing} --style {style} -o a.svg -o a.json",)
        runs[f"asemic {style}"] = (f"asemic --style {style} --letters 4 -o a.svg",)
    runs["restyled InkML, posed"] = (inkml, "restyle a.inkml --pose light -o b.svg -o b.json")
    runs["form"] = (
        f"fill form.pdf {ROOT}/examples/form.csv -o a.pdf -o a.svg --dpi 72 -o a.png",
        f"fill form.pdf {ROOT}/examples/form.csv --writing-only -o b.pdf",
    )
    runs["form, plotted"] = (f"fill form.pdf {ROOT}/examples/form.csv --port sim: --yes",)
    envelope = f"print {ROOT}/examples/envelope.csv --rows 2-3"
    runs["envelopes PDF"] = (f"{envelope} --dry-run a.pdf",)
    runs["envelopes PNG, back"] = (
        f'{envelope} --return-address "Bo, 1 Elm Road" --return-at back --home-country USA --dry-run a.png',
    )
    runs["envelopes, scanned"] = (f"{envelope} --hand {SCANNED[1]} --dry-run a.pdf",)
    for kind in ("pdf", "pwg", "urf"):
        runs[f"envelopes printed, {kind}"] = (f"{envelope} --printer sim --format {kind}",)
    merged = f"{ROOT}/examples/people.csv --letter card.md --rows 2-3 --page A6"
    runs["letters and envelopes PDF"] = (f"print {merged} --with-envelopes --tick --dry-run a.pdf",)
    runs["letters SVG"] = (f"print {merged} --dry-run a.svg",)
    runs["letters printed"] = (f"print {merged} --printer sim",)
    runs["proof"] = (f"proof {merged} --with-envelopes -o proof.html -o proof.pdf",)
    runs["proof of a plotter"] = (f"proof {merged} --device grbl-servo -o proof.html",)
    return runs


RUNS = _runs()
QUICK = (
    "text house-joined svg", "text house-print inkml", "text house-quick json", "text house-joined dxf", "text, style",
    "program grbl", "program marlin", "program ebb", "program hpgl", "program klipper", "plot grbl", "restyled calm",
)  # fmt: skip
SEEDED = ("write", "export", "plot", "fill", "print", "proof", "restyle", "asemic")


def machine() -> str:
    """What the numbers depend on beside the program: libraries, and how this processor adds and multiplies."""
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 97, 97))
    with threadpool_limits(1):  # as the runs; sums depend on how they are parted
        seen = [a @ b, np.exp(a), np.sin(a), np.linalg.inv(a), (a.astype(np.float32) @ b.astype(np.float32))]
    digest = hashlib.sha256(b"".join(values.tobytes() for values in seen)).hexdigest()[:12]
    second = ["a second reader"] if find_spec("rapidocr") else []
    return ", ".join([f"{platform.machine()} {digest}", *(f"{name} {version(name)}" for name in LIBRARIES), *second])


def caught(commands: tuple[str, ...], place: Path) -> dict[str, str]:
    """SHA-256 of what a run leaves: its files, what each command says, and what it sends to simulated plotters."""
    folder = place / "work"
    folder.mkdir()
    (folder / "card.md").write_text("Dear {{ first_name }},\n\nthank you for {{ gift or 'coming' }}!\n\nBo\n")
    with mock.patch.object(sys, "argv", ["form.py", str(folder / "form.pdf")]):
        runpy.run_path(str(ROOT / "examples" / "form.py"), run_name="__main__")
    given = set(folder.iterdir())
    homes = {name: str(place / name) for name in ("XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME")}
    write, sent, found = SimulatedPlotter.write, [], dict[str, bytes]()

    def overheard(port: SimulatedPlotter, data: bytes) -> None:
        sent.append(data)
        write(port, data)

    cv2.setNumThreads(1)
    with (
        threadpool_limits(1),  # sums depend on how they are parted
        contextlib.chdir(folder),
        mock.patch.dict(os.environ, {**homes, "TZ": "UTC", "COLUMNS": "100", "HANDOUT_CONFIG": "none"}),
        mock.patch.object(SimulatedPlotter, "write", overheard),
    ):
        for number, command in enumerate(commands):
            words = shlex.split(command)
            told = ["--seed", "1"] if words[0] in SEEDED and not {"--resume", "--again"} & set(words) else []
            out, err = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as leave:
                main([*words, *told, "--json"])
            found[f"{number} {words[0]}: exit code"] = str(leave.value.code).encode()
            found[f"{number} {words[0]}: standard output"] = out.getvalue().encode()
            found[f"{number} {words[0]}: standard error"] = err.getvalue().encode()
    found |= {"sent to the plotter": b"".join(sent)} if sent else {}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path not in given:
            found[path.relative_to(folder).as_posix()] = path.read_bytes()
    return {name: hashlib.sha256(alike(data, place)).hexdigest() for name, data in found.items()}


def alike(data: bytes, place: Path) -> bytes:
    """What a run left without what differs from run to run."""
    for root, name in ((place, b"<folder>"), (ROOT, b"<checkout>")):
        data = data.replace(str(root).encode(), name)
    for pattern, name in VARYING:
        data = re.sub(pattern, name, data)
    return data


@pytest.fixture(scope="module")
def table():
    known = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    if known["machine"] != machine():
        pytest.skip(f"the table was made on {known['machine']}; this is {machine()}")
    return known["runs"]


def test_the_table_has_every_run_and_a_reason():
    known = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    assert known["runs"].keys() == RUNS.keys() and known["reason"].strip() and set(QUICK) <= RUNS.keys()


@pytest.mark.parametrize("name", [pytest.param(one, marks=() if one in QUICK else pytest.mark.slow) for one in RUNS])
def test_nothing_has_changed(name, table, tmp_path):
    found = caught(RUNS[name], tmp_path)
    changed = sorted(part for part in found.keys() | table[name].keys() if found.get(part) != table[name].get(part))
    assert changed == [], 'if that is wanted: python tests/test_golden_net.py --renew "why"'


def renew(reason: str) -> None:
    """Make the table anew."""
    lines = [f"reason = {json.dumps(reason, ensure_ascii=False)}", f"machine = {json.dumps(machine())}"]
    for name, commands in RUNS.items():
        with tempfile.TemporaryDirectory() as place:
            found = caught(commands, Path(place))
        lines += ["", f"[runs.{json.dumps(name)}]", *(f"{json.dumps(k)} = {json.dumps(v)}" for k, v in found.items())]
        print(name, file=sys.stderr)
    TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] != "--renew" or not sys.argv[2].strip():
        sys.exit('Say why: python tests/test_golden_net.py --renew "the o of house-joined is wider"')
    renew(sys.argv[2])
