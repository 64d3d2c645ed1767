"""Runs a benchmark by its name: any module of this folder that has a ``main()``."""

from __future__ import annotations

import ast
import importlib
import os
import sys
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


def run(arguments: list[str]) -> int:
    known = names()
    if not arguments:
        print("\n".join(f"{name:<12} {about}" for name, about in known.items()))
        return 0
    unknown = [name for name in arguments if name not in known]
    if unknown:
        print(f"No benchmark is called {unknown[0]!r}; there are: {', '.join(known)}.", file=sys.stderr)
        return 2
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):  # one thread each, before numpy is imported
        os.environ.setdefault(variable, "1")
    for name in arguments:
        importlib.import_module(f"benchmarks.{name}").main()
    return 0


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
