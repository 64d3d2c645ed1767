"""Draws the rooms of the program and the arrows between them into docs/architecture.md: python tests/house_map.py

The parts between markers are made from the code itself; `test_house_map.py` fails when they are out of date.
"""

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

from test_architecture import DOORS, GROUND, LAB, MAY, PACKAGE, arrows, door, parsed

DOCUMENT = PACKAGE.parent / "docs" / "architecture.md"


def rooms() -> dict[str, set[str]]:
    """Each room, and the rooms that its files import; the ground floor, which all import, is left out."""
    graph: dict[str, set[str]] = {}
    for file, home, to in arrows():
        if home in GROUND or "__" in home or home == "lab." or door(file, to):
            continue
        graph.setdefault(home, set())
        if to != home and to not in GROUND:
            graph[home].add(to)
    return graph


def reduced(graph: dict[str, set[str]]) -> dict[str, set[str]]:
    """The arrows that are not implied by others: a → c is left out where there are a → b and b → c."""
    order = list(TopologicalSorter(graph).static_order())  # raises where arrows run in a circle
    reach: dict[str, set[str]] = {}
    for room in order:
        reach[room] = graph.get(room, set()).union(*(reach[to] for to in graph.get(room, ())))
    return {
        room: {to for to in targets if not any(to in reach[other] for other in targets - {to})}
        for room, targets in graph.items()
    }


def mermaid() -> str:
    """The graph of the rooms as a Mermaid drawing: who imports, above; who is imported, below."""
    graph = reduced(rooms())
    lines = [f"    {room} --> {to}" for room in sorted(graph) for to in sorted(graph[room])]
    doors = {Path(file).parts[1] for file, to in DOORS.items() if to == "simulated"}
    lines += [f"    {room} -. sim .-> simulated" for room in sorted(doors)]
    lonely = [f"    {room}" for room in sorted(graph) if not graph[room] and not any(room in t for t in graph.values())]
    lines = [re.sub(r"\blab\.", "lab_", line) for line in lines]  # what mermaid takes for names
    return "\n".join(["```mermaid", "graph TD", *lines, *lonely, "```", "", *table()])


def table() -> list[str]:
    """The rooms that each room may import, as the architecture test has it; all may import the ground floor."""
    rows = [f"| `{room}` | {', '.join(sorted(MAY[room])) or 'the ground floor alone'} |" for room in sorted(rooms())]
    return ["| room | may import |", "|---|---|", *rows]


def said(path: Path) -> str:
    """The first line of a file's docstring."""
    text = ast.get_docstring(parsed(path)) or ""
    return text.split("\n\n")[0].replace("\n", " ").strip()


def folders() -> str:
    """Every folder of code with what its `__init__.py` says of it."""
    found = sorted(path for package in (PACKAGE, LAB) for path in package.rglob("__init__.py"))
    rows = [f"| `{path.parent.relative_to(PACKAGE.parent).as_posix()}/` | {said(path)} |" for path in found]
    return "\n".join(["| folder | what is in it |", "|---|---|", *rows])


def drawn(text: str) -> str:
    """The document with its made parts as the code is now."""
    for name, part in (("graph", mermaid()), ("folders", folders())):
        head, rest = text.split(f"<!-- {name} -->\n")
        _, tail = rest.split(f"<!-- /{name} -->")
        text = f"{head}<!-- {name} -->\n{part}\n<!-- /{name} -->{tail}"
    return text


if __name__ == "__main__":
    DOCUMENT.write_text(drawn(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
