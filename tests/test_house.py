"""The shape of the code: functions fit on a screen, constants give a reason, sources exist, no file is in a circle."""

import ast
import re
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterable
from functools import cache
from graphlib import CycleError, TopologicalSorter

import pytest
from test_architecture import LAB, PACKAGE, loaded, nodes_of, parsed, walked

FILES = sorted([*PACKAGE.rglob("*.py"), *LAB.rglob("*.py")])
BUDGET = PACKAGE.parent / "tests" / "budget.toml"
BIBLIOGRAPHY = PACKAGE.parent / "docs" / "bibliography.md"
BRANCHES = (ast.If, ast.For, ast.While, ast.IfExp, ast.ExceptHandler, ast.Assert, ast.match_case, ast.comprehension)
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@cache
def functions() -> list[tuple[str, ast.FunctionDef]]:
    return [
        (f"{path.relative_to(PACKAGE.parent)}:{node.name}", node)
        for path in FILES
        for node in nodes_of(path)
        if isinstance(node, FUNCTIONS)
    ]


def length(function: ast.FunctionDef) -> int:
    """Lines of a function without its docstring."""
    lines = function.end_lineno - function.lineno + 1
    return lines - (function.body[0].end_lineno - function.body[0].lineno + 1 if ast.get_docstring(function) else 0)


def arguments(function: ast.FunctionDef) -> int:
    every = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    return len(every) - (bool(every) and every[0].arg in ("self", "cls"))


def complexity(function: ast.FunctionDef) -> int:
    """One, and one for every branch, condition, loop and filter (McCabe 1976, with conditions counted)."""
    total = 1
    for node in walked(function):
        total += isinstance(node, BRANCHES)
        total += len(node.values) - 1 if isinstance(node, ast.BoolOp) else 0
        total += len(node.ifs) if isinstance(node, ast.comprehension) else 0
    return total


def numeric(node: ast.expr) -> bool:
    """Whether an expression is a number, or a tuple or list of numbers."""
    if isinstance(node, ast.UnaryOp):
        return numeric(node.operand)
    if isinstance(node, ast.BinOp):
        return numeric(node.left) and numeric(node.right)
    if isinstance(node, ast.Tuple | ast.List):
        return bool(node.elts) and all(numeric(part) for part in node.elts)
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def silent_constants(text: str, tree: ast.Module) -> list[int]:
    """The lines of module-level numbers with no comment beside, above, or above the block that they stand in."""
    lines, silent, explained = text.splitlines(), [], -1
    for node in tree.body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None or not numeric(node.value):
            continue
        beside = any("#" in line for line in lines[node.lineno - 1 : node.end_lineno])
        above = node.lineno > 1 and lines[node.lineno - 2].lstrip().startswith("#")
        if beside or above or explained == node.lineno - 1:
            explained = node.end_lineno
        else:
            silent.append(node.lineno)
    return silent


# a type that names another, which when it runs it need not know; everything else that two files share is in a third
TYPES = {
    ("handout.hand.protocol", "handout.hand.scanned"),
    ("handout.plotting.dialects", "handout.plotting.planning.plan"),
}


def modules() -> dict[str, set[str]]:
    """Each module, and the modules it imports: at its head or in a function, by name, or for types alone.

    The package itself is left out: it imports by name what is asked of it, and what draws its values for notebooks.
    """
    names = {}
    for path in FILES:
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    del names["handout"]
    graph = {}
    for name, path in names.items():
        imported = set()
        for node in nodes_of(path):
            if isinstance(node, ast.ImportFrom) and node.module:
                members = {f"{node.module}.{alias.name}" for alias in node.names}
                imported |= {member if member in names else node.module for member in members}
            elif isinstance(node, ast.Import):
                imported |= {alias.name for alias in node.names}
            elif (asked := loaded(node)) != "*":
                pattern = re.escape(asked).replace(r"\*", r"[^.]*")
                imported |= {other for other in names if re.fullmatch(pattern, other)} if asked else set()
        graph[name] = {other for other in imported & names.keys() if (name, other) not in TYPES} - {name}
    return graph


@pytest.mark.slow
def test_functions_fit_on_a_screen():
    assert [name for name, function in functions() if length(function) > 80] == []


def test_functions_take_few_arguments():
    assert [name for name, function in functions() if arguments(function) > 8] == []


def test_few_functions_branch_much():
    many = [name for name, function in functions() if complexity(function) > 15]
    assert len(many) < 8, many


@pytest.mark.slow
def test_constants_give_their_reason():
    silent = [
        (path.name, line) for path in FILES for line in silent_constants(path.read_text(encoding="utf-8"), parsed(path))
    ]
    assert silent == []


@pytest.mark.slow
def test_no_files_import_each_other_in_a_circle():
    try:
        TopologicalSorter(modules()).prepare()
    except CycleError as circle:
        raise AssertionError(" → ".join(circle.args[1])) from None


def lines_of_rooms() -> dict[str, int]:
    """The lines of code of each room, of the ground floor under its own name."""
    found = Counter[str]()
    for path in PACKAGE.rglob("*.py"):
        folders = path.relative_to(PACKAGE).parts[:-1]
        found[folders[0] if folders else "ground floor"] += len(path.read_text(encoding="utf-8").splitlines())
    return dict(found)


def short_helpers() -> list[str]:
    """Private functions that are called once in their file, and whose bodies have fewer than seven lines."""
    return [
        name
        for path in PACKAGE.rglob("*.py")
        for node in nodes_of(path)
        if isinstance(node, FUNCTIONS) and re.fullmatch(r"_[^_]\w*", node.name) and length(node) < 8
        if len(re.findall(rf"\b{node.name}\b", path.read_text(encoding="utf-8"))) == 2
        for name in [f"{path.relative_to(PACKAGE)}:{node.name}"]
    ]


@pytest.mark.slow
def test_rooms_keep_to_their_budgets():
    """Only `tests/budget.toml` raises a room's lines, and says why."""
    budget, lines = tomllib.loads(BUDGET.read_text(encoding="utf-8")), lines_of_rooms()
    assert lines.keys() == budget["lines"].keys()
    assert {room: count for room, count in lines.items() if count > budget["lines"][room]} == {}
    assert len(short_helpers()) <= budget["short_helpers"]


def test_files_of_tests_have_names_of_their_own():
    names = [path.name for path in (PACKAGE.parent / "tests").rglob("test_*.py")]
    assert sorted(set(names)) == sorted(names)  # pytest refuses the second of a name when all are run


# folders whose files are alike, one for each dialect of plotters: what is the same there is called the same
ALIKE = ("plotting/dialects", "simulated/plotter")


def meanings(paths: Iterable[str]) -> int:
    """How many meanings a name has that is defined in these files."""
    return len({next((folder for folder in ALIKE if path.startswith(folder)), path) for path in paths})


def test_the_name_of_a_class_means_one_thing():
    places = defaultdict(list)
    for path in PACKAGE.rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(path.relative_to(PACKAGE).as_posix())
    assert {name: paths for name, paths in places.items() if meanings(paths) > 1} == {}


def test_nothing_asks_for_the_class_of_a_hand():
    asking = [
        f"{path.relative_to(PACKAGE.parent)}:{node.lineno}"
        for path in FILES
        for node in nodes_of(path)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("isinstance", "type")
        if re.search(r"\b(Scanned)?Hand\b", " ".join(map(ast.unparse, node.args[1:])))
    ]
    assert asking == []


def test_every_source_is_in_the_bibliography():
    """`Source:` names this project's own method, a seed, or a work whose first author or number is listed."""
    listed = BIBLIOGRAPHY.read_text(encoding="utf-8")
    unknown = []
    for path in FILES:
        for source in re.findall(r"Source: ((?:[^\n]+\n?){1,3})", path.read_text(encoding="utf-8")):
            words = re.findall(r"own method|none of the seeds|seed 00[0-4]|[A-Z][\w./:-]{2,}", source)
            if not any(word in listed or word in ("own method", "none of the seeds") for word in words):
                unknown.append((str(path.relative_to(PACKAGE.parent)), source.splitlines()[0]))
    assert unknown == []


def test_the_measures_can_fail():
    function = ast.parse(
        "def f(self, a, *, b=1):\n    '''Doc.'''\n    return a if a and b else [c for c in b if c]"
    ).body[0]
    assert (length(function), arguments(function), complexity(function)) == (2, 2, 5)
    call = ast.parse("import_module(f'handout.motion.{name}')").body[0].value
    assert (loaded(call), loaded(ast.parse("open('a')").body[0].value)) == ("handout.motion.*", "")
    assert "handout.simulated.plotter" in modules()["handout.plotting.connections"], "by import_module, in a function"
    text = "A = 1\n# why\nB = 2\nC = (3, 4)\n\nD = 5  # why\nE = 'text'\n"
    assert silent_constants(text, ast.parse(text)) == [1]
    assert (
        meanings(["values.py", "writing/forms.py"]) == 2 and meanings([f"{ALIKE[0]}/a/b.py", f"{ALIKE[0]}/c.py"]) == 1
    )
