"""Mutation campaign: user files of every kind, damaged at random: each is used, or refused in a sentence.

A file of each of the kinds in `KINDS` is made, and read by its verb; then it is mutated (bytes turned, lost, doubled or
put in, numbers made extreme, lines moved, the file cut; a part of a packed file, packed again) and read again, each
time in a process of its own.  A failure is an exception that reaches the border, another exit code than 0, 2, 3 and 4,
a death, or more than 30 s.

1,240 files (seeds 2000 to 2030): none hangs, nine end in an exception: UNIPEN whose channels change or are empty (4),
scanned hands (2) and calibrations (2) whose arrays are damaged, a pose library of huge strokes (1).  1,240
more (seeds 5100 to 5130): none of these again; two end in an exception, tables of answers without a row, which are
refused since.  The corrections are of another hand, and refused unharmed as well.
"""

from __future__ import annotations

import contextlib
import io
import json
import multiprocessing
import os
import re
import runpy
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
import zipfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from handout.cli import main as command

ROOT = Path(__file__).resolve().parents[1]
SEEDS = range(2000, 2031)  # of each kind; with 40 kinds 1,240 files
HANGS = 30.0  # s
CODES = (0, 2, 3, 4)  # done, bad input, device, some rows not made: `handout.cli.main`
_TABLE = (
    "name,street,postcode,city,gift,date\nAnn Maß,Weg 1,89073,Ulm,jam,2026-03-01\nBen Ost,Way 2,1010,Wien,,1.3.2026\n"
)
_UNIPEN = (
    '.VERSION 1.0\n.COORD X Y T P\n.X_POINTS_PER_INCH 254\n.SEGMENT WORD 0-1 OK "go"\n.PEN_DOWN\n100 100 0 10\n'
    "110 100 10 400\n120 110 20 500\n.PEN_UP\n.PEN_DOWN\n130 130 40 5\n140 120 50 5\n150 125 60 5\n"
)
_VCARD = "BEGIN:VCARD\nVERSION:3.0\nN:Maß;Ann;;;\nFN:Ann Maß\nADR;TYPE=HOME:;;Weg 1;Ulm;;89073;Germany\nEND:VCARD\n"
_PRINT = ("--dry-run", "out.pdf", "--printer", "pdf", "--hand", "house-print", "--pen", "plain")
# kind → file, and the arguments that read it
KINDS: dict[str, tuple[str, tuple[str, ...]]] = {
    "text": ("a.txt", ("write", "--file", "a.txt", "-o", "out.svg")),
    "letter": ("letter.md", ("write", "letter.md", "-o", "out.svg")),
    "letter of a table": ("merge.md", ("print", "table.csv", "--letter", "merge.md", *_PRINT)),
    "template": ("merge.txt", ("print", "table.csv", "--letter", "merge.txt", *_PRINT)),
    "table, csv": ("table.csv", ("print", "table.csv", *_PRINT)),
    "table, tsv": ("table.tsv", ("print", "table.tsv", "--letter", "merge.txt", *_PRINT)),
    "table, xlsx": ("table.xlsx", ("print", "table.xlsx", *_PRINT)),
    "table, ods": ("table.ods", ("print", "table.ods", *_PRINT)),
    "address book, vcf": ("book.vcf", ("print", "book.vcf", *_PRINT)),
    "drawn hand": ("hand.toml", ("write", "hello", "--hand", "hand.toml", "-o", "out.svg")),
    "scanned hand": ("small.hand", ("write", "an", "--hand", "small.hand", "--fallback", "-o", "out.svg")),
    "style": ("style.toml", ("write", "go", "--style", "style.toml", "-o", "out.svg")),
    "learned style": ("learned.style", ("write", "go", "--style", "learned.style", "-o", "out.svg")),
    "configuration": ("config.toml", ("--config", "config.toml", "write", "hello", "-o", "out.svg")),
    "plotter": ("plotter.toml", ("export", "go", "--device", "plotter.toml", "-o", "out.gcode")),
    "printer": ("printer.toml", ("print", "table.csv", "--dry-run", "out.pdf", "--printer", "printer.toml")),
    "brush": ("crayon.brush", ("brush", "show", "crayon.brush", "-o", "out.png")),
    "pose": ("stylus.pose", ("pose", "show", "stylus.pose", "-o", "out.png")),
    "drawing, svg": ("a.svg", ("restyle", "a.svg", "-o", "out.svg")),
    "drawing, json": ("a.json", ("restyle", "a.json", "-o", "out.svg")),
    "drawing, inkml": ("a.inkml", ("restyle", "a.inkml", "-o", "out.svg")),
    "pointer events": ("events.json", ("restyle", "events.json", "-o", "out.svg")),
    "unipen": ("a.dat", ("restyle", "a.dat", "-o", "out.svg")),
    "svc": ("a.svc", ("restyle", "a.svc", "-o", "out.svg")),
    "gml": ("a.gml", ("restyle", "a.gml", "-o", "out.svg")),
    "cyn": ("a.cyn", ("restyle", "a.cyn", "-o", "out.svg")),
    "plan": ("plan.json", ("strokes", "draw", "plan.json", "-o", "out.svg")),
    "targets": ("targets.json", ("strokes", "draw", "targets.json", "--style", "calm", "-o", "out.svg")),
    "signature, png": ("sign.png", ("write", "signed.md", "-o", "out.svg")),
    "picture, jpg": ("pic.jpg", ("write", "pictured.md", "-o", "out.png")),
    "lined paper": ("lined.png", ("write", "hello", "--paper", "lined.png", "--page", "A6", "-o", "out.svg")),
    "form": ("form.pdf", ("fill", "form.pdf", "form.csv", "-o", "out.svg")),
    "answers": ("form.csv", ("fill", "form.pdf", "form.csv", "-o", "out.svg")),
    "chart, ti3": ("a.ti3", ("calibrate", "build", "a.ti3", "--printer", "sim", "--method", "tps")),
    "calibration": ("a.npz", ("print", "table.csv", "--calibration", "a.npz", *_PRINT)),
    "corrections": ("fix.json", ("hand", "edit", "small.hand", "fix.json", "-o", "out.hand")),
    "proof": ("proof.json", ("print", "table.csv", "--approved", "proof.json", *_PRINT)),
    "journal of a plot": ("state/handout/plots/p/journal", ("plot", "--resume", "p", "--port", "sim:")),
    "plot": ("state/handout/plots/p/job.json", ("plot", "--again", "p", "--port", "sim:")),
    "journal of a batch": ("state/handout/batches/b.jsonl", ("print", "table.csv", "--printer", "sim", "--resume")),
}
_NASTY = (
    *(
        b"\x00",
        b"\xff\xfe",
        b"\xef\xbb\xbf",
        b"\n",
        b"\r",
        b"\t",
        b'"',
        b"'",
        b"\\",
        b"{",
        b"}",
        b"[",
        b"]",
        b"|",
        b"#",
    ),
    *(b"{{", b"{% for x in y %}", b"nan", b"inf", b"-1", b"0", b"1e309", b"9" * 40, b"null", b"true", b"<", b"&x;"),
    *(b"[" * 2000, b"**" * 400, b"a" * 5000, b"../../x", b"\xe2\x80\xae", b"\xf0\x9f\xa6\x8a", b"%s", b"| |\n|--|\n"),
)
_NUMBERS = (b"0", b"-1", b"1e309", b"-1e-300", b"nan", b"9" * 30, b"65536", b"0.5", b"1e6", b'""', b"null")


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """A file with one to four damages; of a packed one most often in one of its parts."""
    if data.startswith(b"PK") and rng.random() < 0.75:
        with contextlib.suppress(Exception):
            return _repacked(data, rng)
    for _ in range(rng.integers(1, 5)):
        data = _damaged(data, rng)
    return data


def _repacked(data: bytes, rng: np.random.Generator) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w") as new:
        names = old.namelist()
        hit = names[rng.integers(len(names))]
        for name in names:
            part = old.read(name)
            if name != hit or rng.random() < 0.9:  # else it is missing
                new.writestr(name, _damaged(part, rng) if name == hit else part)
    return out.getvalue()


def _damaged(data: bytes, rng: np.random.Generator) -> bytes:
    at, other = sorted(int(n) for n in rng.integers(0, len(data) + 1, 2))
    short, kind = min(other, at + int(rng.integers(1, 40))), rng.integers(10)
    if kind == 0 and len(data):
        at = min(at, len(data) - 1)
        return data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]
    if kind == 1:
        return data[:at] + data[short:]
    if kind == 2:
        return data[:other] + data[at:short] * int(rng.integers(2, 60)) + data[other:]
    if kind == 3:
        return data[: at if rng.random() < 0.7 else 0]
    if kind in (4, 5):
        return data[:at] + _NASTY[rng.integers(len(_NASTY))] + data[at:]
    if kind in (6, 7) and (found := list(re.finditer(rb"-?\d+(\.\d+)?", data))):
        number = found[rng.integers(len(found))]
        return data[: number.start()] + _NUMBERS[rng.integers(len(_NUMBERS))] + data[number.end() :]
    if kind == 8:
        lines = data.split(b"\n")
        rng.shuffle(lines)
        return b"\n".join(lines)
    return data[:at] + rng.bytes(int(rng.integers(1, 60))) + data[short:]


def samples(folder: Path) -> None:
    """A file of each kind, and what their verbs need besides, in a folder that is the current one."""
    for source in ("form.csv", "letter.md", "signature.png"):
        shutil.copy(ROOT / "examples" / source, folder)
    for source in ("styles/learned.style", "brushes/crayon.brush"):
        shutil.copy(ROOT / source, folder)
    shutil.copy(ROOT / "poses/stylus.pose", folder)
    for source, name in (
        ("handout/hand/house/house-print.toml", "hand.toml"),
        ("handout/hand/house/house-print-fountain.hand", "small.hand"),
        ("styles/calm.toml", "style.toml"), ("devices/plotter-grbl-servo.toml", "plotter.toml"),
        ("devices/printer-epson.toml", "printer.toml"), ("examples/corrections.json", "fix.json"),
    ):  # fmt: skip
        shutil.copy(ROOT / source, folder / name)
    head = '+++\npage = "A6"\nhand = "house-print"\n+++\n'
    kinds = ("pointerdown", *["pointermove"] * 8, "pointerup")
    events = [
        {"type": kind, "x": n, "y": n % 3, "timeStamp": 9 * n, "pressure": 0.5, "tiltX": 10}
        for n, kind in enumerate(kinds)
    ]
    points = "".join(f"<pt><x>0.{n}</x><y>0.{n % 4}</y><time>0.{n}</time></pt>" for n in range(1, 9))
    posed = "".join(f"{n} {n / 100} 0.{n}1 0.{n}2 0.5 10 0.1 0.2\n" for n in range(1, 6))
    cells = "| for | on |\n|--|--|\n| {{ gift|default('') }} | {{ date|date }} |\n"
    texts = {
        "a.txt": "Dear Ann,\nthe jam is finished – 3 of 4.\n\nYours\n",
        "merge.md": f"{head}Dear {{{{ name }}}},\n\n{cells}",
        "merge.txt": "Dear {{ name }},\n{% if gift %}thanks for {{ gift }}{% endif %} {{ date|date }}\n",
        "table.csv": _TABLE,
        "table.tsv": _TABLE.replace(",", "\t"),
        "book.vcf": _VCARD,
        "a.dat": _UNIPEN,
        "config.toml": 'seed = 3\npage = "A6"\n[write]\nhand = "house-print"\nfit = true\n',
        "events.json": json.dumps(events),
        "a.svc": "6\n" + "".join(f"{100 * n} {90 * n} {10 * n} 1 900 600 {50 * n}\n" for n in range(1, 7)),
        "a.cyn": f"head\n1\nstroke 0\n5\n{posed}",
        "a.gml": f"<GML><tag><drawing><stroke>{points}</stroke></drawing></tag></GML>",
        "targets.json": '{"targets": [[0, 30], [8, 0], [16, 30], [24, 0], [32, 30]]}',
        "signed.md": f"{head}Hello\n\n::: signature sign.png\nBen\n:::\n",
        "pictured.md": f"{head}Hello\n\n![](pic.jpg)\n",
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    _pictures(folder)
    sys.argv = ["form.py", "form.pdf"]
    runpy.run_path(str(ROOT / "examples/form.py"), run_name="__main__")
    _workbooks(folder)
    _chart(folder)
    for arguments in (
        ("write", "go on", "--hand", "house-print", *("-o", "a.svg", "-o", "a.json", "-o", "a.inkml")),
        ("strokes", "fit", "a.inkml", "-o", "plan.json"),
        ("proof", "table.csv", "--hand", "house-print", "--pen", "plain", "-o", "proof.html", "--seed", "1"),
        ("plot", "go", "--port", "sim:", "--name", "p"),
        ("print", "table.csv", "--printer", "sim"),
    ):
        outcome(arguments)
    state = folder / "state/handout"
    for plot in (state / "plots").glob("*"):
        plot.rename(state / "plots/p")
    for batch in (state / "batches").glob("*.jsonl"):
        KINDS["journal of a batch"] = (str(batch.relative_to(folder)), KINDS["journal of a batch"][1])


def _pictures(folder: Path) -> None:
    from PIL import Image, ImageDraw

    shutil.copy(ROOT / "examples/signature.png", folder / "sign.png")
    Image.new("RGB", (60, 40), "tan").save(folder / "pic.jpg")
    sheet = Image.new("L", (620, 874), 250)
    for y in range(120, 800, 60):
        ImageDraw.Draw(sheet).line([(40, y), (580, y)], 120, 2)
    sheet.save(folder / "lined.png", dpi=(150, 150))


def _workbooks(folder: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    for line in _TABLE.splitlines():
        book.active.append(line.split(","))
    book.save(folder / "table.xlsx")
    with zipfile.ZipFile(folder / "table.ods", "w") as packed:
        packed.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        packed.writestr("content.xml", "<office:document-content/>")


def _chart(folder: Path) -> None:
    from handout.colour import cgats, chart_files
    from handout.colour.models.forward import Patches

    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 6)] * 3), axis=-1).reshape(-1, 3)
    patches = Patches(grid, 0.1 + 0.8 * grid**1.2, np.full(len(grid), 0.002))
    cgats.write(folder / "a.ti3", chart_files.ti3(patches))
    outcome(("calibrate", "build", "a.ti3", "--printer", "sim", "--method", "tps"))
    outcome(("calibrate", "export", "--printer", "sim", "--format", "npz", "-o", "a.npz"))


def outcome(arguments: tuple[str, ...]) -> str:
    """What the command came to, in a process of its own: its exit code in words, or what is wrong."""
    read, write = os.pipe()
    child = os.fork()
    if not child:
        try:
            os.setsid()
            os.close(read)
            os.write(write, _told(arguments).encode("utf-8", "replace"))
        finally:  # whatever happens, nothing of the campaign goes on in the child
            os._exit(0)
    os.close(write)
    said, until = b"", time.monotonic() + HANGS
    while (left := until - time.monotonic()) > 0 and select.select([read], [], [], left)[0]:
        if not (part := os.read(read, 65536)):
            break
        said += part
    hangs = left <= 0
    if hangs:
        os.killpg(child, signal.SIGKILL)
    os.close(read)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return f"hangs for {HANGS:.0f} s" if hangs else said.decode() or f"died of {status}"


def _told(arguments: tuple[str, ...]) -> str:
    """In the child: run the command, and what it came to."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    sys.stdout = sys.stderr = io.TextIOWrapper(io.BytesIO())
    try:
        command(list(arguments))
    except SystemExit as leave:
        return f"exit code {leave.code or 0}"
    except BaseException as error:
        frames = traceback.extract_tb(error.__traceback__)
        ours = next((frame for frame in reversed(frames) if "/handout" in frame.filename), frames[-1])
        return f"{type(error).__name__} in {Path(ours.filename).name}:{ours.lineno} {ours.name}: {str(error)[:120]}"
    return "exit code 0"


def one(kind: str, seed: int, folder: Path) -> str:
    """Read a mutated file of a kind in a copy of a folder; what is wrong with how that ended, or its exit code."""
    rng = np.random.default_rng([seed, *kind.encode()])
    name, arguments = KINDS[kind]
    with tempfile.TemporaryDirectory() as place:
        shutil.copytree(folder, place, dirs_exist_ok=True)
        os.chdir(place)
        for variable in ("STATE", "CONFIG", "DATA", "CACHE"):
            os.environ[f"XDG_{variable}_HOME"] = str(Path(place, variable.lower()))
        path = Path(place, name)
        path.write_bytes(mutated(path.read_bytes(), rng))
        try:
            return outcome(arguments)
        finally:
            os.chdir(folder)


def failed(said: str) -> bool:
    """Whether what a run came to is none of what is documented."""
    return said not in {f"exit code {code}" for code in CODES}


@contextlib.contextmanager
def _prepared() -> Iterator[Path]:
    """A folder with samples, in which all settings are kept, too."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.chdir(folder)
        for variable in ("STATE", "CONFIG", "DATA", "CACHE"):
            os.environ[f"XDG_{variable}_HOME"] = str(folder / variable.lower())
        samples(folder)
        try:
            yield folder
        finally:
            os.chdir(before)


def _one(case: tuple[str, int, Path]) -> tuple[str, int, str]:
    return (*case[:2], one(*case))


def main(seeds: range = SEEDS) -> None:
    """Print every failure with its seed, and how the files of each kind ended."""
    ends: dict[str, Counter[str]] = {}
    with _prepared() as folder:
        for kind, (_, arguments) in KINDS.items():
            print(f"{kind:20} unharmed: {outcome(arguments)}", flush=True)
        cases = [(kind, seed, folder) for seed in seeds for kind in KINDS]
        with multiprocessing.get_context("fork").Pool(2) as pool:
            for kind, seed, said in pool.imap_unordered(_one, cases):
                ends.setdefault(kind, Counter())["FAILED" if failed(said) else said] += 1
                if failed(said):
                    print(f"{kind}, seed {seed}: {said}", flush=True)
    for kind, found in ends.items():
        print(f"{kind:20} " + ", ".join(f"{count} {said}" for said, count in found.most_common()))
    print(f"{len(cases)} files, {sum(found['FAILED'] for found in ends.values())} failures")
