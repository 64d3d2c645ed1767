"""Runs benchmarks by their names: any module of this folder that has a ``main()``.

``--keep FILE.json`` keeps what each prints, with date, version, machine and CPU seconds, under its name; what other
benchmarks printed stays there.  ``--note TEXT`` is kept with it, where a run was not whole.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import importlib
import io
import json
import os
import platform
import sys
from datetime import date
from pathlib import Path

FOLDER = Path(__file__).parent


def names() -> dict[str, str]:
    """Name → first line of the docstring of every benchmark, found without importing it."""
    found = {}
    for path in sorted(FOLDER.glob("[!_]*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        if any(isinstance(node, ast.FunctionDef) and node.name == "main" for node in tree.body):
            found[path.stem] = (ast.get_docstring(tree) or "").partition("\n")[0]
    return found


class _Copied(io.StringIO):
    """What is printed, kept and shown."""

    def write(self, text: str) -> int:
        sys.__stdout__.write(text) if sys.__stdout__ else None
        return super().write(text)


def keep(name: str, file: Path, note: str = "") -> None:
    """Run a benchmark and keep what it prints in a file of JSON, in place of what it printed before."""
    from handout import __version__, atomic

    before, shown = sum(os.times()[:4]), _Copied()
    with contextlib.redirect_stdout(shown):
        importlib.import_module(f"benchmarks.{name}").main()
    runs = json.loads(file.read_text("utf-8")) if file.exists() else {}
    runs[name] = {
        "date": date.today().isoformat(),
        "version": __version__,
        "machine": f"{platform.platform(terse=True)}, {os.cpu_count()} processors, Python {platform.python_version()}",
        "cpu_seconds": round(sum(os.times()[:4]) - before, 1),
        "printed": shown.getvalue(),
        **({"note": note} if note else {}),
    }
    atomic.write(file, (json.dumps(runs, indent=1, ensure_ascii=False) + "\n").encode())


def run(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    parser.add_argument("names", nargs="*")
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--note", default="")
    given, known = parser.parse_args(arguments), names()
    if not given.names:
        print("\n".join(f"{name:<12} {about}" for name, about in known.items()))
        return 0
    unknown = [name for name in given.names if name not in known]
    if unknown:
        print(f"No benchmark is called {unknown[0]!r}; there are: {', '.join(known)}.", file=sys.stderr)
        return 2
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):  # one thread each, before numpy is imported
        os.environ.setdefault(variable, "1")
    for name in given.names:
        if given.keep:
            keep(name, given.keep, given.note)
        else:
            importlib.import_module(f"benchmarks.{name}").main()
    return 0


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
