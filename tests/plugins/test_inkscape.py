"""The extension for Inkscape, called as Inkscape calls it: options and a document in, the document out."""

import ast
import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from handout.sources.svg import from_svg

FOLDER = Path(__file__).resolve().parent.parent.parent / "handout/plugins/inkscape"
SCRIPT = FOLDER / "handout_write.py"
SVG = "{http://www.w3.org/2000/svg}"
NAMES = (
    'xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
    'xmlns:sodipodi="http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"'
)
DOCUMENT = f"""<svg {NAMES} width="210mm" height="148mm" viewBox="0 0 2100 1480"><!-- kept -->
<sodipodi:namedview inkscape:current-layer="layer2"/>
<g id="layer1"><rect id="box" x="200" y="300" width="800" height="500" transform="rotate(90 200 300)"/>
<path id="corner" d="m1000 200 h50 v-20 a5 5 0 0110 10z" fill="none"/><path id="edge" d="M2050 1400h20v9"/></g>
<g id="layer2" transform="translate(50 0) scale(2)"><circle id="round" cx="500" cy="300" r="150"/></g></svg>"""
# stands for handout: notes what it was asked, and writes two strokes whose ends are corners of the page
STAND_IN = f"""#!{sys.executable}
import json, sys
asked = sys.argv[1:]
width, height = asked[asked.index("--page") + 1][:-2].split("x")
open(asked[-1], "w").write('''<svg {NAMES}><g id="ink" class="ink" inkscape:groupmode="layer" inkscape:label="Page 1"
fill="none" stroke="#ff0000"><g inkscape:label="Dear"><path class="stroke" clip-path="url(#mark-0)"
d="M0 0L%s %s"/></g></g><g id="travel" class="travel"/></svg>''' % (width, height))
json.dump({{"asked": asked, "text": sys.stdin.read()}}, open(__file__ + ".json", "w"))
print(json.dumps({{"hand": "house-joined", "seed": 7, "notes": ["borrowed a letter"]}}))
"""


@pytest.fixture(scope="module")
def extension():
    spec = importlib.util.spec_from_file_location("handout_write", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def call(extension, tmp_path, capfdbinary):
    """Runs the extension with a stand-in for handout: its exit code, the document, what it says, what it asked."""
    command = tmp_path / "handout"
    command.write_text(STAND_IN, encoding="utf-8")
    command.chmod(0o755)

    def called(*options, document=DOCUMENT, command=command):
        (tmp_path / "document.svg").write_text(document, encoding="utf-8")
        code = extension.main([f"--command={command}", *options, str(tmp_path / "document.svg")])
        out, said = capfdbinary.readouterr()
        note = tmp_path / "handout.json"
        return code, out, said.decode(), json.loads(note.read_text()) if note.exists() else {}

    return called


def placed(data):
    """The ends of the stroke that was written, mm on the page."""
    lines = [stroke for stroke in from_svg(data).strokes if stroke.colour == "#ff0000"]
    return lines[-1].xy[[0, -1]]


@pytest.mark.parametrize(
    "selected, page, corner",
    [
        ([], "210.000x148.000mm", (0, 0)),
        (["box"], "50.000x80.000mm", (-30, 30)),  # turned: from 20, 30 down to the left
        (["round"], "60.000x60.000mm", (75, 30)),
        (["box", "round"], "165.000x80.000mm", (-30, 30)),
        (["corner"], "110.000x130.500mm", (100, 17.5)),  # too small: from there on
        (["none"], "210.000x148.000mm", (0, 0)),
    ],
)
def test_strokes_lie_where_the_selection_lies_in_the_documents_units(call, selected, page, corner):
    code, out, said, asked = call("--text=Dear", *(f"--id={name}" for name in selected))
    assert (code, said.strip()) == (0, "borrowed a letter")
    call_ = asked["asked"]
    assert call_[call_.index("--page") + 1] == page and ("--margin" in call_) == (page[:3] != "210")
    size = np.array(page[:-2].split("x"), dtype=float)
    assert np.allclose(placed(out), [corner, corner + size], atol=2e-3)


def test_they_are_in_the_current_layer_under_new_names_and_nothing_else_changes(call):
    _, once, _, asked = call(
        "--text=Dear\\nZoë", "--seed=7", "--ink=437923583", "--fit=true", "--pen_width=0.5", "--tab=pen"
    )
    _, twice, *_ = call("--text=Dear", document=once.decode())
    assert asked["text"] == "Dear\nZoë"
    told = " ".join(asked["asked"])
    assert all(
        part in told for part in ("--seed 7", "--ink #1a1a2e", "--fit", "--pen-width 0.5mm", "--hand house-joined")
    )
    root = ElementTree.fromstring(twice)
    layer = next(element for element in root.iter() if element.get("id") == "layer2")
    assert [child.get("id") for child in layer] == ["round", "handout-1", "handout-2"]
    names = [element.get("id") for element in root.iter() if element.get("id")]
    assert len(names) == len(set(names)) and b"<!-- kept -->" in twice and b"ns0" not in twice
    assert b"url(#handout-2-mark-0)" in twice and b'class="' not in twice and b"groupmode" not in twice
    assert layer[1].findtext(f"{SVG}desc") == "Written by handout: hand house-joined, seed 7."


@pytest.mark.parametrize(
    "options, said",
    [
        (["--text=x", "--command=/no/handout"], "was not found as /no/handout. Install it"),
        (["--text= \\n"], "There is no text"),
        (["--text=x", "--id=edge"], "There is no room"),
        (["--text=x", f"--command={shutil.which('true')}"], "does not answer as handout does"),
        (["--text=x", f"--command={shutil.which('false')}"], "failed and said nothing (exit code 1)"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_sentence(call, options, said):
    code, out, told, _ = call(*options)
    assert (code, out) == (1, b"") and said in told and "Traceback" not in told


def test_other_documents(call):
    assert call("--text=x", document=f'<svg {NAMES} width="100%"/>')[2].startswith("The document has no size")
    assert call("--text=x", document="<svg")[2].startswith("The document cannot be read")
    _, out, *_ = call("--text=x", document=f'<svg {NAMES} viewBox="0 0 800 600"/>')
    assert placed(out)[1] == pytest.approx([800 / 96 * 25.4, 600 / 96 * 25.4], abs=2e-3)


def test_every_option_of_the_dialogue_is_one_of_the_script(extension):
    root = ElementTree.parse(FOLDER / "handout_write.inx").getroot()
    names = {param.get("name") for param in root.iter() if param.tag.endswith("}param")} - {"tab"}
    assert names <= vars(extension._parse_arguments(["document.svg"])).keys()
    assert root.findtext(".//{*}command") == SCRIPT.name
    ast.parse(SCRIPT.read_text(encoding="utf-8"), feature_version=(3, 8))  # the oldest Python that an Inkscape 1 brings


@pytest.mark.slow
def test_with_handout_itself(tmp_path):
    (tmp_path / "document.svg").write_text(DOCUMENT, encoding="utf-8")
    command = Path(sys.executable).with_name("handout")
    if not command.exists():
        pytest.skip("the command handout is not installed beside Python")
    done = subprocess.run(
        [
            sys.executable,
            "-I",
            SCRIPT,
            "--text=Zoë",
            "--seed=4",
            "--id=round",
            f"--command={command}",
            tmp_path / "document.svg",
        ],
        capture_output=True,
        check=True,
    )
    strokes = from_svg(done.stdout).strokes
    assert len(strokes) > 3 and b'inkscape:label="Zo' in done.stdout
    bounds = np.concatenate([stroke.xy for stroke in strokes])
    assert (bounds.min(axis=0) > (74, 29)).all() and (bounds.max(axis=0) < (136, 91)).all()
