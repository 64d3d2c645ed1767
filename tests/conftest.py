"""What several rooms test with: one small page, written by the simulated author and scanned, made once a run."""

import contextlib
import functools
import gc
import importlib
import os
import sys
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, settings

# the first example pays for imports, and other work may hold the machine: times are measured in benchmarks, not here
# and how many examples were drawn in vain, or were large, is a matter of luck
_LUCK = (HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large)
# half of the usual number of examples: properties are a fifth of the time of the tests, and every run tries others
settings.register_profile("handout", deadline=None, max_examples=50, suppress_health_check=_LUCK)
# the same examples each time, so that what is released is judged by itself alone; other runs find new ones
settings.register_profile("release", settings.get_profile("handout"), derandomize=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "handout"))

# every process of xdist has a core for itself: more threads than one would wait for each other
os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"), "1"))
# the programs that tests start do not compile all modules again
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


def _no_sync(handle):
    """Stands for `os.fsync`: no test cuts the power of this machine, and a disk takes milliseconds each time."""


os.fsync = _no_sync

# with xdist, what these make for all their tests, which takes seconds, is made once and not in every process; and the
# name service that ippeveprinter needs runs but once on a machine
_TOGETHER = (
    "calibrating", "colour", "inking/test_brushes.py", "lab/author", "lab/score",
    "motion/styles/test_seen_manner.py", "printing/test_ippeveprinter.py", "reading",
    "tagging/test_alignment.py", "tagging/test_page_tagging.py",
    "web/test_studio", "web",  # in two parts: all of it is longer than a third of the tests
)  # fmt: skip
# which parse it once, or build it
_OF_THE_CODE = ("tests/test_architecture.py", "tests/test_house.py", "tests/test_wheel.py")
_AT_ONCE = 8  # tests of a file that one process is given: each part costs the scheduler a look at all that were given


def pytest_sessionstart(session):
    """Each process of xdist imports a part of the tests first: the others find that compiled, when they collect it."""
    worker = getattr(session.config, "workerinput", None)
    if worker is None:
        return
    asked = [Path(name.partition("::")[0]).resolve() for name in session.config.args]
    every = Path(__file__).parent.rglob("test_*.py")
    paths = sorted(path for path in every if any(path.is_relative_to(place) for place in asked))
    for path in paths[int(worker["workerid"][2:]) :: worker["workercount"]]:
        sys.path.insert(0, str(path.parent))
        with contextlib.suppress(pytest.skip.Exception, Exception):  # collecting tells of it
            importlib.import_module(path.stem)
        sys.path.remove(str(path.parent))


# what is imported and collected stays: a collector that looked through it took 7 % of the time of the tests
gc.set_threshold(20_000)


def pytest_collection_finish(session):
    gc.freeze()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    """One more than there are cores: many tests wait for machines and browsers."""
    return (os.cpu_count() or 1) + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Tests that share fixtures are given to one process, the others a few of a file at a time to whichever is free.

    The marks of ``--dist loadgroup`` would say the same, but pytest-xdist 3.8 writes them into a field that pytest 9
    does not read.
    """
    from xdist.scheduler import LoadScopeScheduling

    class Together(LoadScopeScheduling):
        @functools.cached_property
        def _parts(self):
            """Which part of its file each test belongs to."""
            seen, parts = Counter(), {}
            for nodeid in self.collection:
                file = nodeid.partition("::")[0]
                parts[nodeid] = f"{file} {seen[file] // _AT_ONCE}"
                seen[file] += 1
            return parts

        def _split_scope(self, nodeid):
            if nodeid.startswith(_OF_THE_CODE):
                return _OF_THE_CODE[0]
            return next((name for name in _TOGETHER if nodeid.startswith("tests/" + name)), self._parts[nodeid])

        def schedule(self):
            """Parts of files without slow tests come last: no process does a long one while the others have none."""
            super().schedule()
            for part in list(self.workqueue):
                file = config.rootpath / part.partition(" ")[0]
                if file.suffix == ".py" and file.is_file() and "mark.slow" not in file.read_text(encoding="utf-8"):
                    self.workqueue.move_to_end(part)

    return Together(config, log) if config.getvalue("dist") != "no" else None


WRITTEN = "an even line, this\nof ten minute hens\nand it jumped off"


@pytest.fixture(scope="session")
def small_scan(tmp_path_factory):
    """A scan as a file, its text as a file, and the truth about it.

    It is stored, so that what is tested on it stays when the built-in hands change; it was made once by
    ``simulate(WRITTEN, load("house-joined"), Desk(layout=layout), rng=np.random.default_rng(5))`` with the layout
    ``Layout(page("90x50mm"), (6.0, 6.0, 6.0, 6.0), x_height=2.2)``.  `golden/small_scan.npz` keeps of its `Truth` the
    labels, the splits (x, y, before, after) and the rule.
    """
    import numpy as np
    from PIL import Image

    from handout_lab.author.truth import Split

    golden, folder = Path(__file__).parent / "golden", tmp_path_factory.mktemp("scan")
    kept = np.load(golden / "small_scan.npz", allow_pickle=False)
    truth = SimpleNamespace(
        labels=kept["labels"].astype(np.int32),
        letters=[SimpleNamespace(text=text, at=at) for at, text in enumerate(WRITTEN) if not text.isspace()],
        splits=tuple(Split((x, y), int(before), int(after)) for x, y, before, after in kept["splits"].tolist()),
        rule=float(kept["rule"]),
    )
    scan, text = folder / "page.png", folder / "page.txt"
    scan.write_bytes((golden / "small_scan.png").read_bytes())
    text.write_text(WRITTEN + "\n", encoding="utf-8")
    simulated = SimpleNamespace(image=np.asarray(Image.open(scan)), truth=truth)
    return SimpleNamespace(scan=scan, text=text, written=WRITTEN, simulated=simulated)


@pytest.fixture(scope="session")
def small_page(small_scan):
    """The same page read, and its letters found without learning from it."""
    import numpy as np

    from handout.scanning.written_page import read_page
    from handout.tagging.page_tagging import tag_page
    from handout.tagging.segmentation import by_segments_once

    written = read_page(small_scan.scan)
    made = tag_page(written, small_scan.written, rng=np.random.default_rng(1), method=by_segments_once)
    return SimpleNamespace(**vars(small_scan), read=written, made=made)


@pytest.fixture(scope="session")
def small_hand(small_page):
    """The hand that it shows."""
    from handout.tagging.page_tagging import hand_of_pages

    return hand_of_pages("small", [small_page.made], "A small hand")


@pytest.fixture(scope="session")
def small_hand_file(request, tmp_path_factory):
    """The same as a file, with what is worked out of it, as `handout hand read` leaves it; one process makes it."""
    from handout import atomic
    from handout.hand import file
    from handout.pipeline.hand_learning import learn

    own = tmp_path_factory.mktemp("hand") / "small.hand"
    every = tmp_path_factory.getbasetemp().parent if "PYTEST_XDIST_WORKER" in os.environ else own.parent
    made = every / "learnt.hand"
    with atomic.hold_file(made):
        if not made.exists():
            file.save(request.getfixturevalue("small_hand"), own)
            learn(own)
            atomic.write(made, own.read_bytes())
    own.write_bytes(made.read_bytes())
    return own
