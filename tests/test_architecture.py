"""The arrows between the rooms run one way, and the command starts without heavy imports."""

import ast
import gc
import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "handout"
LAB = PACKAGE.parent / "handout_lab"

# room → rooms it may import, besides itself and the ground floor; those of the laboratory are called lab.NAME
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
    "journal_lines",
    "libraries",
    "shipped",
    "signals",
    "profiles",
    "markers",
    "markup",
    "networks",
    "pathdata",
    "tables",
    "tiff",
    "progress",
    "summary",
}
MAY = {
    "scanning": set(),
    "colour": set(),
    "hand": {"reading", "scanning"},
    "reading": set(),
    "mathematics": set(),
    "writing": {"hand", "mathematics"},
    "motion": {"hand", "writing"},
    "inking": {"hand", "writing", "motion", "scanning"},
    "letters": {"hand", "mathematics", "writing", "inking"},
    "completion": {"hand", "writing", "motion", "inking"},
    "sinks": {"motion", "inking"},
    "sources": {"motion"},
    "printing": {"writing", "inking", "sinks"},
    "merging": {"mathematics", "printing"},
    "calibrating": {"hand", "writing", "motion", "inking", "sinks", "colour", "printing"},
    "plotting": {"hand", "writing", "motion", "sinks", "sources"},
    "prompting": {"hand"},
    "pdf_forms": {"hand", "writing"},
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
        "pdf_forms",
        "prompting",
        "reading",
        "scanning",
        "tagging",
        "colour",
        "calibrating",
        "merging",
    },
    # stand-ins for machines; nothing of the product stands on them
    "simulated": {"calibrating", "colour", "hand", "plotting"},
    "web": {"pipeline"},
    "cli": {"pipeline", "web"},
    "plugins": {"pipeline", "cli"},
    "__main__": {"cli"},
    # the laboratory, which the product never imports: it finds the verbs by their entry points
    "lab.offset_press": {"simulated"},
    "lab.ink_comparison": set(),
    "lab.author": {"hand", "inking", "motion", "scanning", "simulated", "tagging", "writing"},
    "lab.ipp": {"printing"},
    "lab.reading": {"reading"},
    "lab.score": {"scanning", "motion"},
    "lab.simulated": {"plotting", "simulated"},
    "lab.study": {"hand", "prompting", "simulated"},
    "lab.training": {
        "hand", "inking", "motion", "prompting", "reading", "scanning", "sources", "tagging", "writing", "lab.author",
        "lab.reading", "completion", "pipeline",
    },
    "lab.pipeline": {"hand", "pipeline", "prompting", "scanning", "sources", "tagging", "lab.score", "lab.study"},
    "lab.cli": {"cli", "lab.pipeline", "pipeline"},
}  # fmt: skip
# files that load a room which they may not import, inside the function that needs it: a simulated device, which a
# user's ``sim`` calls for, and what draws values for notebooks
DOORS = {
    "handout/__init__.py": "pipeline",
    "handout/plotting/connections.py": "simulated",
    "handout/pipeline/calibrating.py": "simulated",
    "handout/pipeline/calibration_desk.py": "simulated",
}
HEAVY = {
    "numpy", "scipy", "sklearn", "skimage", "cv2", "colour", "reportlab", "rich", "PIL", "serial", "torch", "tifffile",
    "markdown_it", "mdit_py_plugins", "starlette",
}  # fmt: skip


def room(module: str) -> str:
    package, *inner = module.split(".")
    name = inner[0] if inner and inner[0] != "__init__" else ""
    folder = LAB if package == "handout_lab" else PACKAGE
    name = name if (folder / name).is_dir() or (folder / f"{name}.py").is_file() else ""
    return f"lab.{name}" if folder == LAB else name


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


def loaded(node: ast.AST) -> str:
    """The module that a call of `import_module` names, with * for what is filled in when it runs; "" of other nodes."""
    if not isinstance(node, ast.Call) or "import_module" not in ast.unparse(node.func):
        return ""
    asked = node.args[0]
    parts = asked.values if isinstance(asked, ast.JoinedStr) else [asked]
    return "".join(str(part.value) if isinstance(part, ast.Constant) else "*" for part in parts)


@cache
def imports(path: Path) -> frozenset[str]:
    found = set()
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{path}: relative import"
            found.add(node.module)
            if node.module in ("handout", "handout_lab"):
                found |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif name := loaded(node):
            found.add(name.partition("*")[0].rpartition(".")[0] if "*" in name else name)
    return frozenset(name for name in found if name.split(".")[0] in ("handout", "handout_lab"))


def at_the_head(path: Path) -> set[str]:
    """Modules of the package that are imported with the file itself, not by one of its functions or for types only."""
    head = [node for node in parsed(path).body if isinstance(node, ast.ImportFrom)]
    return {f"{node.module}.{alias.name}" for node in head for alias in node.names if node.module}


@cache
def arrows() -> list[tuple[str, str, str]]:
    rows = []
    for path in [*PACKAGE.rglob("*.py"), *LAB.rglob("*.py")]:
        file = path.relative_to(PACKAGE.parent)
        home = room(".".join(file.with_suffix("").parts))
        rows += [(str(file), home, room(name)) for name in imports(path)]
    return rows


def door(file: str, to: str) -> bool:
    return DOORS.get(file) == to


@pytest.mark.slow
def test_what_runs_loads_no_simulated_device_at_its_head():
    """One that is asked for is loaded by the function that was asked."""
    wrong = [
        f"{path.relative_to(PACKAGE)} imports {name}"
        for path in PACKAGE.rglob("*.py")
        if path.relative_to(PACKAGE).parts[0] != "simulated"
        for name in at_the_head(path)
        if name.startswith("handout.simulated")
    ]
    assert wrong == []
    assert any(name.startswith("handout.simulated") for name in at_the_head(LAB / "offset_press.py"))


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


def test_the_product_never_imports_the_laboratory():
    """Nor names it anywhere: what joins them is the group of entry points alone."""
    assert {home for _, home, to in arrows() if to.startswith("lab.")} <= {home for home in MAY if home[:4] == "lab."}
    named = [
        f"{path.relative_to(PACKAGE)}:{node.lineno}"
        for path in PACKAGE.rglob("*.py")
        for node in nodes_of(path)
        if isinstance(node, ast.Constant) and node.value == "handout_lab"
    ]
    assert named == []
    assert ("handout_lab/pipeline/study.py", "lab.pipeline", "lab.study") in arrows()


def test_the_command_is_typed():
    untyped = [
        f"{path.name}:{node.lineno}"
        for path in [*(PACKAGE / "cli").glob("*.py"), *(LAB / "cli").glob("*.py")]
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
        ["study", "make", "--help"],
        ["score", "--help"],
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


def test_a_drawn_hand_loads_what_it_needs(tmp_path):
    """Loading takes most of the time of a sentence, and several threads take more of it than one."""
    code = (
        "import json, sys\n"
        "from handout.cli import main\n"
        "try:\n"
        f"    main(['write', 'Dear Ada, the parcel came.', '-q', '-o', {str(tmp_path / 'a.svg')!r}])\n"
        "except SystemExit as leave:\n"
        "    assert leave.code == 0, leave.code\n"
        "loaded = sorted(sys.modules)\n"
        "from threadpoolctl import threadpool_info\n"
        "threads = [pool['num_threads'] for pool in threadpool_info() if pool['user_api'] == 'blas']\n"
        "print(json.dumps([loaded, threads]))\n"
    )
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    loaded, threads = json.loads(done.stdout)
    own = [name for name in loaded if name.partition(".")[0] == "handout"]
    assert len(own) <= 65, own
    assert not {name.split(".")[1] for name in own if "." in name} & {"scanning", "tagging", "reading", "letters"}
    assert not {
        "cv2",
        "skimage",
        "scipy.optimize",
        "scipy.signal",
        "scipy.linalg",
        "scipy.special",
        "threadpoolctl",
    } & {*loaded}
    assert threads and set(threads) == {1}


def test_handout_and_the_server_of_its_studio_import_nothing_numeric():
    code = (
        "import sys, handout\nprint('starlette' in sys.modules)\nimport handout.web.server\n"
        "print(*{n.split('.')[0] for n in sys.modules} & set(" + repr(sorted(HEAVY)) + "))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "starlette"]


def test_public_names_resolve():
    import handout

    for name in handout.__all__:
        assert getattr(handout, name) is not None
