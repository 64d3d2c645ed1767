"""Archives: what goes in comes out, and nothing else is let in."""

import io
import zipfile

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from handout.errors import InputError
from handout.hand.archive import Archive, join_bytes, pack, split_bytes, write


class Facts(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    count: int


def png(mode="RGBA", size=(7, 5)):
    stream = io.BytesIO()
    picture = np.random.default_rng(0).integers(0, 255, (size[1], size[0], len(mode)), dtype=np.uint8)
    Image.fromarray(picture, mode).save(stream, "PNG")
    return stream.getvalue(), picture


PICTURE, PIXELS = png()
ARRAY = np.linspace(0, 1, 600, dtype=np.float32).reshape(-1, 2)
WHOLE = pack({"facts.json": Facts("a", 3), "xy.npy": ARRAY, "page.png": PICTURE})


def read_all(path):
    with Archive(path) as archive:
        facts = archive.json("facts.json", Facts)
        return facts, archive.array("xy.npy", "float32", None, 2), archive.picture("page.png", "RGBA")


def test_what_goes_in_comes_out(tmp_path):
    path = tmp_path / "a.hand"
    write(path, {"facts.json": Facts("a", 3), "xy.npy": ARRAY, "page.png": PICTURE})
    assert path.read_bytes() == WHOLE  # no clock in it
    facts, xy, picture = read_all(path)
    assert facts == Facts("a", 3)
    assert np.array_equal(xy, ARRAY)
    assert np.array_equal(picture, PIXELS)


_WHOLE_NUMBERS = st.integers(-(2**31), 2**31 - 1) | st.integers(-300, 300)


@given(st.lists(st.tuples(_WHOLE_NUMBERS, _WHOLE_NUMBERS), max_size=20), st.booleans())
def test_whole_numbers_that_are_split_come_back(rows, flat):
    numbers = np.array(rows, dtype=np.int32).reshape(-1, 2)
    numbers = numbers[:, 0] if flat else numbers
    split = split_bytes(numbers)
    assert split.dtype == np.uint8 and split.shape[1:] == numbers.T.shape
    back = join_bytes(split)
    assert back.dtype == np.int32 and np.array_equal(back, numbers) and back.flags.c_contiguous
    # none is kept whose bytes are all 0
    assert len(split) == 1 or split[-1].any()


@pytest.mark.slow
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_a_damaged_file_is_refused_or_read_as_it_was(tmp_path, data):
    damaged = bytearray(WHOLE)
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(WHOLE) - 1))] = data.draw(st.integers(0, 255))
    damaged = damaged[: data.draw(st.integers(0, len(WHOLE)) | st.just(len(WHOLE)))]
    path = tmp_path / "b.hand"
    path.write_bytes(damaged)
    try:
        facts, xy, picture = read_all(path)
    except InputError as error:
        assert str(path) in str(error)
    else:
        assert facts == Facts("a", 3)
        assert np.array_equal(xy, ARRAY)
        assert np.array_equal(picture, PIXELS)


def refusal(tmp_path, members, read):
    path = tmp_path / "c.hand"
    write(path, members)
    with Archive(path) as archive, pytest.raises(InputError) as caught:
        read(archive)
    return str(caught.value)


def test_parts_must_be_what_they_should(tmp_path):
    array = {"xy.npy": ARRAY}
    assert "missing" in refusal(tmp_path, array, lambda a: a.array("uv.npy", "float32", None, 2))
    assert "float64" in refusal(tmp_path, array, lambda a: a.array("xy.npy", "float64", None, 2))
    assert "(any, 3)" in refusal(tmp_path, array, lambda a: a.array("xy.npy", "float32", None, 3))
    split = {"r.npy": split_bytes(np.array([3, 65536])), "d.npy": np.ones((2, 5), dtype=np.uint8)}
    assert "r.npy is int32 of (2,), not uint16" in refusal(tmp_path, split, lambda a: a.array("r.npy", "uint16", None))
    assert "d.npy is uint8 of (2, 5), not uint8" in refusal(tmp_path, split, lambda a: a.array("d.npy", "uint8", None))
    assert "d.npy is uint8" in refusal(tmp_path, split, lambda a: a.array("d.npy", "float32", None))
    holes = {"xy.npy": np.array([0.0, np.nan])}
    assert "finite" in refusal(tmp_path, holes, lambda a: a.array("xy.npy", "float64", None))
    assert "RGB" in refusal(tmp_path, {"p.png": png("RGB")[0]}, lambda a: a.picture("p.png", "RGBA"))
    assert "picture" in refusal(tmp_path, {"p.png": b"no"}, lambda a: a.picture("p.png", "RGBA"))
    assert "extra" in refusal(
        tmp_path, {"f.json": b'{"name": "", "count": 1, "extra": 2}'}, lambda a: a.json("f.json", Facts)
    )


def test_an_array_of_objects_is_never_made(tmp_path):
    stream = io.BytesIO()
    np.save(stream, np.array([print], dtype=object), allow_pickle=True)
    assert "not an array" in refusal(tmp_path, {"x.npy": stream.getvalue()}, lambda a: a.array("x.npy", "O", None))
    cut = io.BytesIO()
    np.save(cut, np.zeros(3))
    open_brace = cut.getvalue().replace(b"}", b" ")  # a header that Python's tokens end in the middle of
    assert "not an array" in refusal(tmp_path, {"x.npy": open_brace}, lambda a: a.array("x.npy", "float64", 3))


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path):
    path = tmp_path / "bomb.hand"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("x.npy", bytes(1 << 20))
        archive.getinfo("x.npy").file_size = 1100 << 20  # as the archive's directory tells it
    with Archive(path) as opened, pytest.raises(InputError, match="1100 MB, more than 1024"):
        opened.read_part("x.npy")


def test_what_is_no_archive_is_refused(tmp_path):
    path = tmp_path / "no.hand"
    with pytest.raises(InputError, match="No such file"):
        Archive(path)
    path.write_bytes(b"")
    with pytest.raises(InputError, match="cut off or damaged"):
        Archive(path)
    with pytest.raises(InputError, match=r"directory|denied"):
        Archive(tmp_path)
