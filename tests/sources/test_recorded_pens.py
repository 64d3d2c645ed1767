"""UNIPEN, SVC and GML: what is read of them, and what is said of files that cannot be."""

import numpy as np
import pytest

from handout.errors import InputError
from handout.sources import read_drawing, recorded
from handout.sources.gml import from_gml
from handout.sources.svc import from_svc
from handout.sources.unipen import from_unipen

UNIPEN = b"""\
.VERSION 1.0
.COORD X Y T P
.X_POINTS_PER_INCH 254
.Y_POINTS_PER_INCH 254
.POINTS_PER_SECOND 100
.SEGMENT WORD 0 OK "a"
.SEGMENT WORD 2-3 OK "\\"b\\""
.SEGMENT CHARACTER 3:0-3:2 ? "i"
.PEN_DOWN
100 100 0 10
110 100 10 400
120 110 20 500
.PEN_UP
120 120 30 0
.PEN_DOWN
130 130 40 5
140 120 50 5
.PEN_DOWN
150 100 60 5
150 100 60 5
160 90 70 5
"""


def test_unipen():
    drawing = from_unipen(UNIPEN)
    assert [len(s.t) for s in drawing.strokes] == [3, 2, 2]
    first = drawing.strokes[0]
    assert first.t == pytest.approx([0, 0.01, 0.02])
    assert np.diff(first.xy, axis=0) == pytest.approx(np.array([[1, 0], [1, -1]]))  # 10 points a mm, y turned down
    assert first.pressure == pytest.approx(np.array([10, 400, 500]) / 511)
    assert [s.word for s in drawing.strokes] == [0, 1, 1]
    assert drawing.about["segments"] == [
        {"level": "WORD", "label": "a", "strokes": [0]},
        {"level": "WORD", "label": '"b"', "strokes": [1, 2]},
        {"level": "CHARACTER", "label": "i", "strokes": [2]},
    ]


def test_unipen_samples_without_pressure_are_above_the_paper():
    hovering = UNIPEN.replace(b"110 100 10 400", b"110 100 10 0")
    drawing = from_unipen(hovering)
    assert [len(s.t) for s in drawing.strokes] == [1, 1, 2, 2]
    assert [s.word for s in drawing.strokes] == [0, 0, 1, 1]
    assert drawing.about["segments"][0]["strokes"] == [0, 1] and drawing.about["segments"][1]["strokes"] == [2, 3]
    assert drawing.strokes[1].t == pytest.approx([0.02])


def test_an_empty_pen_up_of_unipen_is_not_counted():
    data = b'.COORD X Y\n.SEGMENT CHARACTER 1-2 OK "i"\n' + b"".join(
        b".PEN_DOWN\n%d 0\n%d 9\n.PEN_UP\n\n" % (x, x) for x in (0, 10, 20)
    )
    drawing = from_unipen(data)
    assert drawing.about["segments"] == [{"level": "CHARACTER", "label": "i", "strokes": [0, 1]}]
    assert drawing.strokes[1].xy[0, 0] - drawing.strokes[0].xy[0, 0] == pytest.approx(1.0)


def test_unipen_coordinates_behind_samples_and_empty_components_are_met():
    with pytest.raises(InputError, match=r"\.COORD behind samples"):
        from_unipen(b".COORD X Y\n.PEN_DOWN\n1 2\n3 4\n.COORD X Y T P\n.PEN_DOWN\n5 6 7 8\n")
    two = b".COORD X Y T\n.PEN_DOWN\n1 2 0\n3 4 10\n.PEN_DOWN\n\n.PEN_DOWN\n7 8 30\n9 9 40\n"
    assert len(from_unipen(two).strokes) == 2


def test_unipen_times_may_be_microseconds_or_absent():
    micro = UNIPEN.replace(b" 10 400", b" 10000 400").replace(b" 20 500", b" 20000 500")
    assert from_unipen(micro).strokes[0].t == pytest.approx([0, 0.01, 0.02])
    without = b".COORD X Y\n.PEN_DOWN\n0 0\n10 0\n10 10\n"
    drawing = from_unipen(without)
    assert drawing.strokes[0].t == pytest.approx([0, 0.01, 0.02])
    assert drawing.about["timing"] == "assumed: 100 samples a second"


def test_unipen_uses_what_its_labels_name_of_the_files_it_includes(tmp_path):
    (tmp_path / "include" / "ink").mkdir(parents=True)
    (tmp_path / "include" / "ink" / "page.dat").write_bytes(
        UNIPEN.split(b".SEGMENT")[0] + UNIPEN[UNIPEN.index(b".PEN") :]
    )
    labels = tmp_path / "data" / "deep" / "labels.dat"
    labels.parent.mkdir(parents=True)
    labels.write_bytes(b'.VERSION 1.0\n.INCLUDE ink/page.dat\n.SEGMENT TEXT 2 OK "go"\n')
    drawing = read_drawing(labels)
    assert len(drawing.strokes) == 1
    assert drawing.strokes[0].word == 0
    labels.write_bytes(b".INCLUDE ../../../etc/passwd\n")
    with pytest.raises(InputError, match="is missing"):
        read_drawing(labels)


def svc(rows):
    return f"{len(rows)}\n".encode() + b"".join(" ".join(map(str, row)).encode() + b"\n" for row in rows)


ROWS = [
    (100, 200, 1000, 1, 900, 600, 500),
    (100, 300, 1008, 1, 900, 600, 900),
    (100, 400, 1015, 0, 900, 600, 0),
    (200, 500, 1023, 1, 900, 450, 1000),
    (200, 700, 1030, 1, 900, 450, 1200),
]


def test_svc():
    drawing = from_svc(svc(ROWS))
    one, two = drawing.strokes
    assert one.t == pytest.approx([0, 0.008]) and two.t[0] == pytest.approx(0.023)
    assert one.xy[1] - one.xy[0] == pytest.approx([0.5, 0])
    assert two.xy[0] - one.xy[0] == pytest.approx([1.5, -0.5])  # y is counted upwards
    assert np.degrees(two.tilt) == pytest.approx([45, 45]) and np.degrees(one.azimuth) == pytest.approx([90, 90])
    assert one.pressure == pytest.approx(np.array([500, 900]) / 2047)  # the range that holds the whole file's


TAG = b"""<GML><tag><header><client><name>x</name></client><environment>
<screenBounds><x>200</x><y>100</y></screenBounds></environment></header><drawing>
<stroke isdrawing="false"><pt><x>0</x><y>0</y></pt></stroke>
<stroke><pt><x>0.1</x><y>0.1</y><time>0</time></pt><pt><x>0.2</x><y>0.1</y><time>0.5</time></pt>
<pt><x>0.2</x><y>0.2</y><time>0.5</time></pt><pt><x>0.2</x><y>0.3</y><time>1</time></pt><pt><pres>1</pres></pt></stroke>
</drawing></tag></GML>"""


def test_gml():
    drawing = from_gml(TAG)
    (stroke,) = drawing.strokes
    assert stroke.t == pytest.approx([0, 0.5, 1])
    assert np.diff(stroke.xy, axis=0) == pytest.approx(np.array([[20, 0], [0, 20]]))
    assert drawing.about == {"name": "x"}
    real = TAG.replace(b"</environment>", b"<realScale><x>1</x><y>2</y><unit>m</unit></realScale></environment>")
    assert np.diff(from_gml(real).strokes[0].xy, axis=0) == pytest.approx(np.array([[100, 0], [0, 400]]))


@pytest.mark.parametrize(
    ("read", "data", "said"),
    [
        (from_unipen, b"hello", "not UNIPEN"),
        (from_unipen, UNIPEN.replace(b"110 100", b"110 nan"), "not a finite number"),
        (from_unipen, UNIPEN.replace(b"110 100", b"110 abc"), "Component 0"),
        (from_unipen, UNIPEN.replace(b"COORD X Y", b"COORD X Z"), "X and Y are needed"),
        (from_unipen, b".PEN_UP\n1 2\n", "no movement of a pen"),
        (from_unipen, b".X_POINTS_PER_INCH 0\n.PEN_DOWN\n1 2\n", "positive number"),
        (from_svc, b"x\n", "not SVC"),
        (from_svc, svc(ROWS).replace(b"5\n", b"9\n", 1), "5 of 9 samples"),
        (from_svc, b"1\n1 2 3\n", "3 columns"),
        (from_svc, b"1\n1 2 3 1 5 6 inf\n", "not a finite number"),
        (from_svc, b"1\n1 2 3 0 5 6 7\n", "no movement of a pen"),
        (from_svc, b"1\n1 2 3 1 5 6 seven\n", "not seven numbers"),
        (from_gml, b"<gml><tag><drawing><stroke><pt><x>0</x><y>0</y></pt></stroke></drawing></tag></gml>", "1 points"),
        (from_gml, b"<svg/>", "not GML"),
        (from_gml, TAG.replace(b"<x>0.2</x>", b"<x>left</x>", 1), "x or y is not a number"),
        (from_gml, TAG.replace(b"</GML>", b""), "GML"),
    ],
)
def test_what_cannot_be_read_is_named(read, data, said):
    with pytest.raises(InputError, match=said) as raised:
        read(data)
    assert "\n" not in str(raised.value)


def test_too_many_samples_are_refused(monkeypatch):
    monkeypatch.setattr(recorded, "MOST", 4)
    with pytest.raises(InputError, match="9 samples; at most 4"):
        from_unipen(UNIPEN)


def test_drawings_of_one_gml_lie_apart():
    def tag(left: float, right: float) -> str:
        points = "".join(f"<pt><x>{x}</x><y>0.5</y><t>{x}</t></pt>" for x in np.linspace(left, right, 5))
        return f"<drawing><stroke>{points}</stroke></drawing>"

    drawing = from_gml(f"<gml><tag>{tag(0.2, 0.6)}{tag(0.1, 0.7)}{tag(0.3, 0.5)}</tag></gml>".encode())
    assert drawing.about["drawings"] == 3 and len(drawing.strokes) == 3
    boxes = [(*s.xy.min(axis=0), *s.xy.max(axis=0)) for s in drawing.strokes]
    for number, (left, top, right, bottom) in enumerate(boxes):
        for a, b, c, d in boxes[number + 1 :]:
            assert right < a or c < left or bottom < b or d < top
    assert drawing.page.width > 100
