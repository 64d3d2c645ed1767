"""CYN, UIM and pointer events: what is read of them, and what is said of files that cannot be."""

import json
import struct

import numpy as np
import pytest

from handout.errors import InputError
from handout.sources import read_drawing
from handout.sources.cyn import from_cyn
from handout.sources.pointer_events import from_pointer_events
from handout.sources.uim import from_uim

CYN = """#
Version 0.0
#

painter 1
1

2
stroke 0
3
0 0     0.10 0.50 0.2 0  0.25 0
1 0.007 0.11 0.50 0.4 10 0.25 0
2 0.014 0.12 0.51 0.6 20 0.25 0
stroke 1
2
0 1.0   0.20 0.50 0.5 0 0 0.25
1 1.007 0.21 0.50 0.5 0 0 0.25
"""


def test_cyn():
    drawing = from_cyn(CYN.encode())
    first, second = drawing.strokes
    np.testing.assert_allclose(np.diff(first.xy, axis=0), [[2, 0], [2, 2]], atol=1e-9)
    np.testing.assert_allclose(first.pressure, [0.2, 0.4, 0.6])
    np.testing.assert_allclose(first.tilt, np.radians(22.5))
    np.testing.assert_allclose(first.azimuth, 0, atol=1e-12)
    np.testing.assert_allclose(first.rotation, np.radians([0, 10, 20]))
    np.testing.assert_allclose(second.azimuth, np.pi / 2)  # leaning down the page
    assert drawing.timed and second.t[0] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("", "no line that begins a stroke"),
        (CYN.replace("0.12 0.51", "0.12 x"), "Stroke 1 of this CYN file has a sample that is not 8 numbers"),
        (CYN[:-40], "cut off: stroke 2 has 1 of 2|has a sample that is not 8 numbers"),
        (CYN.replace("stroke 1\n2", "stroke 1\n?"), "Stroke 2 of this CYN file does not say how many"),
    ],
)
def test_cyn_that_cannot_be_read(data, said):
    with pytest.raises(InputError, match=said):
        from_cyn(data.encode())


def varint(value):
    out = b""
    while value > 127:
        out += bytes([value & 127 | 128])
        value >>= 7
    return out + bytes([value])


def field(number, value):
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    return varint(number << 3 | 2) + varint(len(value)) + value


def zigzag(values):
    steps = np.diff(np.rint(values).astype(int), prepend=0).tolist()
    return b"".join(varint(2 * v if v >= 0 else -2 * v - 1) for v in steps)


def uim(channels, version=b"\x03\x01\x00\x00"):
    """A file of one movement: name → values, digits, resolution."""
    described, samples = b"", b""
    for number, (name, (values, digits, resolution)) in enumerate(channels.items()):
        identity = bytes([number + 1]) * 16
        about = field(1, identity) + field(2, b"will://input/3.0/channel/" + name.encode())
        about += b"\x21" + struct.pack("<d", resolution) + field(7, digits)
        described += field(2, about)
        whole = zigzag(np.array(values) * resolution * 10.0**digits)
        samples += field(5, field(1, identity) + field(2, whole))
    context = field(5, field(1, b"s" * 16) + field(2, field(1, b"c" * 16) + described))
    body = field(1, context) + field(2, field(1, b"d" * 16) + field(4, 1_700_000_000_000) + samples)
    parts = b"".join(kind + struct.pack("<I", len(b)) + b + b"\0" * (len(b) % 2) for kind, b in (
        (b"HEAD", version), (b"INPT", body)
    ))  # fmt: skip
    return b"RIFF" + struct.pack("<I", 4 + len(parts)) + b"UINK" + parts


PEN = {
    "X": ([0.010, 0.011, 0.012], 2, 3779.5),
    "Y": ([0.020, 0.020, 0.021], 2, 3779.5),
    "Timestamp": ([0.0, 0.008, 0.016], 0, 1000.0),
    "Pressure": ([0.1, 0.5, 0.45], 2, 1.0),
    "Altitude": ([0.9, 1.0, 1.1], 2, 1.0),
    "Azimuth": ([-0.4, -0.3, 0.2], 2, 1.0),
}


def test_uim():
    stroke = from_uim(uim(PEN)).strokes[0]
    np.testing.assert_allclose(np.diff(stroke.xy, axis=0), [[1, 0], [1, 1]], atol=0.01)
    np.testing.assert_allclose(np.diff(stroke.t), 0.008, atol=1e-6)
    np.testing.assert_allclose(stroke.pressure, [0.1, 0.5, 0.45])
    np.testing.assert_allclose(stroke.tilt, np.pi / 2 - np.array([0.9, 1.0, 1.1]))
    np.testing.assert_allclose(stroke.azimuth, [-0.4, -0.3, 0.2])
    assert stroke.rotation is None


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"%PDF", "not UIM"),
        (uim(PEN)[:-20], "cut off or damaged"),
        (uim(PEN, b"\x04\x00\x00\x00"), "another version"),
        (uim({"Pressure": PEN["Pressure"]}), "no movement of a pen"),
        (uim(PEN | {"Pressure": ([0.1], 2, 1.0)}), "cut off or damaged"),
    ],
)
def test_uim_that_cannot_be_read(data, said):
    with pytest.raises(InputError, match=said):
        from_uim(data)


def test_damaged_uim_never_crashes():
    data = uim(PEN)
    rng = np.random.default_rng(0)
    for _ in range(200):
        at = int(rng.integers(12, len(data)))
        spoilt = data[:at] + bytes([int(rng.integers(256))]) + data[at + 1 :]
        try:
            from_uim(spoilt)
        except InputError:
            continue


def event(kind, x, **more):
    return {"type": kind, "x": x, "y": 2.0 * x, "timeStamp": 10.0 * x, "pressure": 0.5, "extra": None, **more}


EVENTS = [
    event("pointermove", 0), event("pointerdown", 1, tiltX=45, tiltY=0, twist=90),
    event("pointermove", 2, tiltX=45, tiltY=0, twist=90), event("pointerup", 3),
    event("pointerdown", 5), event("pointermove", 6), event("pointerup", 7),
]  # fmt: skip


@pytest.mark.parametrize("form", [lambda e: e, lambda e: {"events": e, "version": 3}])
def test_pointer_events(form, tmp_path):
    path = tmp_path / "pen.json"
    path.write_text(json.dumps(form(EVENTS)))
    first, second = read_drawing(path).strokes
    assert (len(first.t), len(second.t)) == (2, 2)
    np.testing.assert_allclose(first.tilt, np.pi / 4)
    np.testing.assert_allclose(first.azimuth, 0)
    np.testing.assert_allclose(first.rotation, np.pi / 2)
    np.testing.assert_allclose(np.diff(first.xy, axis=0), [[25.4 / 96, 2 * 25.4 / 96]])
    assert second.tilt is None and second.t[0] - first.t[0] == pytest.approx(0.04)


def test_pointer_events_without_types_are_parted_by_pressure_or_lists():
    plain = [{"clientX": x, "clientY": 0, "pressure": p} for x, p in enumerate((0.2, 0.3, 0, 0.4, 0.5))]
    assert [len(s.t) for s in from_pointer_events(json.dumps(plain).encode()).strokes] == [2, 2]
    lists = [plain[:2], plain[3:]]
    assert [len(s.t) for s in from_pointer_events(json.dumps(lists).encode()).strokes] == [2, 2]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("[", "not pointer events"),
        ("[1, 2]", "not pointer events"),
        ("[]", "no movement"),
        ('[{"pressure": 0.5}]', "without places"),
        ('{"events": 3}', "not pointer events"),
    ],
)
def test_pointer_events_that_cannot_be_read(data, said):
    with pytest.raises(InputError, match=said):
        from_pointer_events(data.encode())
