"""The arrows between the rooms run one way, and the command starts without heavy imports."""

import ast
import gc
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "handout"

# room → rooms it may import, besides itself and the ground floor
GROUND = {
    "",
    "values",
    "alphabet",
    "branching",
    "chains",
    "hooks",
    "hues",
    "peaks",
    "page_sizes",
    "units",
    "encodings",
    "errors",
    "atomic",
    "shipped",
    "signals",
    "profiles",
    "markers",
    "markup",
    "networks",
    "pathdata",
    "tables",
    "tiff",
    "notebook",
    "progress",
    "summary",
}
MAY = {
    "scanning": set(),
    "colour": set(),
    "hand": {"reading", "scanning"},
    "reading": set(),
    "writing": {"hand"},
    "motion": {"hand", "writing"},
    "inking": {"hand", "writing", "motion", "scanning"},
    "letters": {"hand", "writing", "inking"},
    "completion": {"hand", "writing", "motion", "inking"},
    "sinks": {"motion", "inking"},
    "sources": {"motion"},
    "printing": {"writing", "inking", "sinks", "colour"},
    "merging": {"printing"},
    "calibrating": {"hand", "writing", "motion", "inking", "sinks", "colour", "printing"},
    "plotting": {"hand", "writing", "motion", "sinks", "sources"},
    "score": {"scanning", "motion"},
    "prompting": {"hand"},
    "pdf_forms": {"hand", "writing"},
    "study": {"hand", "prompting"},
    "tagging": {"hand", "writing", "motion", "inking", "scanning", "prompting"},
    "pipeline": {
        "completion",
        "hand",
        "letters",
        "writing",
        "motion",
        "inking",
        "sinks",
        "sources",
        "printing",
        "plotting",
        "score",
        "pdf_forms",
        "prompting",
        "reading",
        "scanning",
        "study",
        "tagging",
        "colour",
        "calibrating",
        "merging",
    },
    # stand-ins for people and machines, and what makes the files that ship; nothing of the product stands on them
    "simulated": {
        "calibrating",
        "colour",
        "hand",
        "inking",
        "motion",
        "plotting",
        "printing",
        "scanning",
        "study",
        "tagging",
        "writing",
    },
    "training": {
        "hand",
        "inking",
        "motion",
        "prompting",
        "reading",
        "scanning",
        "simulated",
        "sources",
        "tagging",
        "writing",
    },
    "web": {"pipeline"},
    "cli": {"pipeline", "web"},
    "plugins": {"pipeline", "cli"},
    "__main__": {"cli"},
}
# files of the product that load a simulated device, inside the function that a user's ``sim`` calls
DOORS = {"pipeline/calibrating.py", "pipeline/calibration_desk.py", "pipeline/guided_calibration.py"}
HEAVY = {
    "numpy", "scipy", "sklearn", "skimage", "cv2", "colour", "reportlab", "rich", "PIL", "serial", "torch", "tifffile",
    "markdown_it", "mdit_py_plugins", "starlette",
}  # fmt: skip


def room(module: str) -> str:
    name = module.split(".")[1] if "." in module else ""
    return name if (PACKAGE / name).is_dir() or (PACKAGE / f"{name}.py").is_file() else ""


@cache
def parsed(path: Path) -> ast.Module:
    # the collector, which would look through all trees again and again, would take five times as long as parsing
    gc.disable()
    try:
        return ast.parse(path.read_text(encoding="utf-8"))
    finally:
        gc.freeze()
        gc.enable()


_LEAVES = {"ctx", "op", "ops"}  # fields that hold no expression


def walked(tree: ast.AST) -> list[ast.AST]:
    """What `ast.walk` gives, in its order, but operators and contexts, in a third of the time."""
    nodes = [tree]
    for node in nodes:
        for name in node._fields:
            if name not in _LEAVES:
                value = getattr(node, name, None)
                if isinstance(value, ast.AST):
                    nodes.append(value)
                elif isinstance(value, list):
                    nodes += [each for each in value if isinstance(each, ast.AST)]
    return nodes


@cache
def nodes_of(path: Path) -> list[ast.AST]:
    """All nodes of a file."""
    return walked(parsed(path))


@cache
def imports(path: Path) -> frozenset[str]:
    found = set()
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{path}: relative import"
            found.add(node.module)
            if node.module == "handout":
                found |= {f"handout.{alias.name}" for alias in node.names}
    return frozenset(name for name in found if name.split(".")[0] == "handout")


def at_the_head(path: Path) -> set[str]:
    """Modules of the package that are imported with the file itself, not by one of its functions or for types only."""
    head = [node for node in parsed(path).body if isinstance(node, ast.ImportFrom)]
    return {f"{node.module}.{alias.name}" for node in head for alias in node.names if node.module}


@cache
def arrows() -> list[tuple[str, str, str]]:
    rows = []
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        home = "" if parts == ("__init__",) else parts[0]
        rows += [(str(path.relative_to(PACKAGE)), home, room(name)) for name in imports(path)]
    return rows


def door(file: str, to: str) -> bool:
    return file in DOORS and to == "simulated"


@pytest.mark.slow
def test_what_runs_loads_no_simulated_device_at_its_head():
    """One that is asked for is loaded by the function that was asked; what trains is never loaded."""
    wrong = [
        f"{path.relative_to(PACKAGE)} imports {name}"
        for path in PACKAGE.rglob("*.py")
        if path.relative_to(PACKAGE).parts[0] not in ("simulated", "training")
        for name in at_the_head(path)
        if name.startswith(("handout.simulated", "handout.training"))
    ]
    assert wrong == []
    assert any(name.startswith("handout.simulated") for name in at_the_head(PACKAGE / "training/scanned_hands.py"))


@pytest.mark.slow
def test_imports_run_one_way():
    wrong = [
        f"{file} imports {to}"
        for file, home, to in arrows()
        if to != home and to not in GROUND and (home in GROUND or to not in MAY[home]) and not door(file, to)
    ]
    assert wrong == []


@pytest.mark.slow
def test_motion_knows_of_scanned_writing_only_the_forms():
    inner = {
        name
        for path in (PACKAGE / "motion").rglob("*.py")
        for name in imports(path)
        if name.startswith("handout.writing.forms")
    }
    assert inner == {"handout.writing.forms"}


def test_no_room_may_import_what_it_does_not():
    used = {home: {to for _, other, to in arrows() if other == home} for home in MAY}
    assert {home: unused for home in MAY if (unused := MAY[home] - used[home])} == {}


def test_the_rule_can_fail():
    assert {home for _, home, _ in arrows()} >= {"writing", "motion", "cli"}
    assert "cli" not in MAY["writing"]


def test_nothing_that_runs_imports_training():
    assert {home for _, home, to in arrows() if to == "training"} <= {"training"}


def test_the_command_is_typed():
    untyped = [
        f"{path.name}:{node.lineno}"
        for path in (PACKAGE / "cli").glob("*.py")
        for node in nodes_of(path)
        if (isinstance(node, ast.Name) and node.id == "Any") or (isinstance(node, ast.Attribute) and node.attr == "Any")
    ]
    assert untyped == []


def test_the_pipeline_knows_no_terminal():
    for path in (PACKAGE / "pipeline").glob("*.py"):
        tree = nodes_of(path)
        modules = {alias.name for node in tree if isinstance(node, ast.Import) for alias in node.names}
        modules |= {str(node.module) for node in tree if isinstance(node, ast.ImportFrom)}
        assert not {name.split(".")[0] for name in modules} & {"click", "rich"}, path.name
        printing = {node.lineno for node in tree if isinstance(node, ast.Name) and node.id == "print"}
        assert path.name == "job_pages.py" or not printing, path.name  # which is a program of its own


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["--version"],
        ["write", "--help"],
        ["plot", "--help"],
        ["calibrate", "wizard", "--help"],
        ["hand", "read", "--help"],
        ["restyle", "--help"],
        ["asemic", "--help"],
    ],
)
def test_help_is_light(arguments):
    code = (
        "import sys\n"
        "from handout.cli import main\n"
        "try:\n"
        f"    main({arguments!r})\n"
        "except SystemExit as leave:\n"
        "    assert leave.code == 0, leave.code\n"
        "print('HEAVY', sorted({name.split('.')[0] for name in sys.modules} & set(" + repr(sorted(HEAVY)) + ")))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.rstrip().endswith("HEAVY []"), done.stdout[-300:]


def test_importing_handout_imports_nothing_numeric():
    code = (
        "import sys, handout; print(sorted({n.split('.')[0] for n in sys.modules} & set(" + repr(sorted(HEAVY)) + ")))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_public_names_resolve():
    import handout

    for name in handout.__all__:
        assert getattr(handout, name) is not None
