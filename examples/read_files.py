"""Reads the files that handout keeps, by docs/formats.md alone: with numpy, and Pillow for pictures, not with handout.

python examples/read_files.py FILE …  says what is in .hand, .style, .pose and .brush files, drawings and journals.
"""

import hashlib
import io
import json
import sys
import zipfile
import zlib
from pathlib import Path

import numpy as np


class Archive:
    """A zip of JSON, arrays and pictures; a member is looked for in some folders first."""

    def __init__(self, path, folders=()):
        self.zip, self.folders = zipfile.ZipFile(path), tuple(folders)

    def bytes(self, name):
        known = set(self.zip.namelist())
        return self.zip.read(next((folder + name for folder in self.folders if folder + name in known), name))

    def has(self, name):
        return any(folder + name in self.zip.namelist() for folder in (*self.folders, ""))

    def json(self, name):
        return json.loads(self.bytes(name))

    def array(self, name):
        array = np.load(io.BytesIO(self.bytes(name)), allow_pickle=False)
        if array.dtype != np.uint8 or array.ndim == 1:
            return array
        # of whole numbers the lowest bytes of all, then the next ones; negative numbers odd, others even
        folded = sum(row.astype(np.int64) << 8 * k for k, row in enumerate(array))
        return np.where(folded % 2, -(folded + 1) // 2, folded // 2).T

    def steps(self, name, parts=1):
        return np.cumsum(self.array(name).astype(np.int64), axis=0) / parts

    def lists(self, folder):
        ends = np.cumsum(self.array(f"{folder}/counts.npy"))
        return np.split(self.steps(f"{folder}/vertices.npy").astype(int), ends[:-1])

    def picture(self, name):
        from PIL import Image

        return np.asarray(Image.open(io.BytesIO(self.bytes(name))))


def read_hand(path):
    """Pages and glyphs of a .hand file as they are now, with the corrections in force."""
    journal = Archive(path).json("corrections.json")
    file = Archive(path, [f"corrections/{k}/" for k in range(journal["made"], 0, -1)])
    facts = file.json("hand.json")
    if facts["format"] not in (2, 3):
        raise ValueError("another format of .hand")
    pages = []
    for number, page in enumerate(facts["pages"]):
        folder = f"pages/{number}/"
        edges = file.array(folder + "edges.npy").astype(np.int64)
        first = np.cumsum(edges[:, 0])
        uv = file.steps(folder + "uv.npy", 16)
        ink = "ink.webp" if file.has(folder + "ink.webp") else "ink.png"
        pages.append(
            page
            | {
                "uv": uv,
                "xy": (uv + 0.5) * 25.4 / page["dpi"],
                "radius": file.array(folder + "radius.npy") / 256,
                "density": file.array(folder + "density.npy") / 100,
                "edges": np.column_stack([first, first + edges[:, 1]]),
                "ink": lambda name=folder + ink: file.picture(name),
                "scan": lambda name=folder + "scan.webp": file.picture(name) if file.has(name) else None,
            }
        )
    ligatures = list(zip(file.array("ligatures/from.npy").tolist(), file.lists("ligatures"), strict=True))
    return {
        "name": facts["name"],
        "pages": pages,
        "letters": facts["letters"],
        "table": file.array("glyphs/table.npy"),
        "confidence": file.array("glyphs/confidence.npy"),
        "vertices": file.lists("glyphs"),
        "ligatures": ligatures,
    }


def baseline(page, line, x):
    """y of a line's baseline at x, pixels."""
    c0, c1, c2, middle, reach = page["baselines"][line]
    d = x - middle
    held = min(max(d, -reach), reach)
    return c0 + held * (c1 + held * c2) + (d - held) * (c1 + 2 * c2 * held)


def read_pose(path):
    """Strokes of a .pose file: places in mm, and the channels of each."""
    file = Archive(path)
    head = file.json("pose.json")
    cuts = np.cumsum(file.array("lengths.npy"))[:-1]
    parts = {"pressure": 2048, "tilt": 1024, "azimuth": 1024, "rotation": 1024}
    channels = {name: np.split(file.steps(f"{name}.npy", parts[name]), cuts) for name in head["channels"]}
    return {"path": np.split(file.steps("path.npy", 64) * head["unit"], cuts), **channels}


def read_style(path):
    """Networks and primers of a .style file."""
    file = Archive(path)
    head = file.json("learned.json")
    networks = {
        name: [file.array(f"{name}/{k}.npy").astype(np.float32) for k in range(len(head["hidden"]) + 1)]
        for name in ("dynamics", *(["structure"] if head["longest"] else []))
    }
    n = networks["dynamics"][0].shape[0] - head["hidden"][0] - 1
    scales = np.split(file.array("dynamics/scales.npy"), np.cumsum([n, n, 2]))
    primers = {name: file.array(f"primers/{k}.npy") for k, name in enumerate(head["primers"])}
    return {"networks": networks, "scales": scales, "primers": primers}


def read_brush(path):
    """Ribbons of a .brush file: pixels, and the bend of each segment."""
    file = Archive(path)
    ribbons = file.json("brush.json")["ribbons"]
    return [(file.picture(f"{k}.webp"), np.array(ribbon["bend"])) for k, ribbon in enumerate(ribbons)]


def read_drawing(path):
    """Strokes of a drawing: arrays t, x, y and whatever else is known."""
    file = json.loads(Path(path).read_text("utf-8"))
    return [{name: np.array(v) if isinstance(v, list) else v for name, v in s.items()} for s in file["strokes"]]


def read_key(path):
    """The name of a study and what is true of its sheets, of a .key file."""
    data = Path(path).read_bytes()
    head, packed = data[:20], data[20:]
    if head != b"handout study key 1\n":
        raise ValueError("not the key of a study")
    return hashlib.sha256(data).hexdigest()[:12], json.loads(zlib.decompress(packed))


def read_journal(path):
    """Words of the whole lines of a plot's journal; ValueError if it is damaged before its end."""
    lines, torn = [], False
    for line in Path(path).read_bytes().split(b"\n"):
        if line[:9] != b"%08x " % zlib.crc32(line[9:]):
            torn = True
        elif torn:
            raise ValueError("damaged before its end")
        else:
            lines.append(line[9:].decode().split())
    return lines


def main(paths):
    for path in map(Path, paths):
        if path.suffix == ".hand":
            hand = read_hand(path)
            print(path.name, len(hand["letters"]), "glyphs,", [len(page["uv"]) for page in hand["pages"]], "vertices")
        elif path.suffix == ".pose":
            print(path.name, {name: len(strokes) for name, strokes in read_pose(path).items()})
        elif path.suffix == ".style":
            print(path.name, {name: len(rows) for name, rows in read_style(path)["primers"].items()})
        elif path.suffix == ".brush":
            print(path.name, [pixels.shape for pixels, _ in read_brush(path)])
        elif path.suffix == ".key":
            name, key = read_key(path)
            print(path.name, name, len(key["people"]), "people")
        elif path.suffix == ".json":
            print(path.name, [len(stroke["t"]) for stroke in read_drawing(path)], "samples")
        else:
            print(path.name, *read_journal(path)[-1:])


if __name__ == "__main__":
    main(sys.argv[1:])
