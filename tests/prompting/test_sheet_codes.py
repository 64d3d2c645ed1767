"""The codes of a page: packing, parity, base 45, and squares that any reader reads."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import DoesNotFit, InputError
from handout.prompting import sheet_codes
from handout.prompting.sheet_codes import PageRecord

RECORD = PageRecord("00ff" * 4, 2, 4, 9.5, True, ("Zoë's first line,", "a second & a third."))


@given(
    st.builds(
        PageRecord,
        st.binary(min_size=8, max_size=8).map(bytes.hex),
        st.integers(1, 999),
        st.integers(1, 999),
        st.floats(6, 20),
        st.booleans(),
        st.lists(st.text("abcÄ€ ", min_size=1), max_size=8).map(tuple),
    )
)
def test_records_come_back(record):
    assert sheet_codes.unpack(sheet_codes.pack(record)) == record


@given(st.binary(max_size=300))
def test_base45_comes_back(data):
    assert sheet_codes.from_base45(sheet_codes.base45(data)) == data


def test_base45_is_that_of_the_standard():
    # examples of RFC 9285, §4
    assert sheet_codes.base45(b"AB") == "BB8"
    assert sheet_codes.base45(b"Hello!!") == "%69 VD92EX0"
    assert sheet_codes.from_base45("QED8WEX0") == b"ietf!"
    assert [sheet_codes.from_base45(text) for text in ("GGW", ":::", "a", "AAAA", "::")] == [None] * 5


@given(st.binary(min_size=1, max_size=400), st.integers(0, 5), st.randoms())
def test_any_five_of_six_parts_suffice(data, lost, random):
    parts = sheet_codes.split_data(data)
    del parts[lost]
    random.shuffle(parts)
    assert sheet_codes.join(parts) == data
    assert sheet_codes.join(parts[1:]) is None


@given(st.binary(min_size=1, max_size=60), st.binary(min_size=1, max_size=60), st.binary(max_size=30))
def test_parts_of_other_pages_and_noise_do_no_harm(data, other, noise):
    if data != other:
        assert sheet_codes.join([noise, *sheet_codes.split_data(other)[:3], *sheet_codes.split_data(data)]) == data


def test_a_wrong_part_is_noticed():
    parts = sheet_codes.split_data(sheet_codes.pack(RECORD))
    parts[1] = parts[1][:-1] + bytes([parts[1][-1] ^ 1])
    assert sheet_codes.join(parts) is None
    assert sheet_codes.join([]) is None


@pytest.mark.parametrize("data", [b"", b"junk", sheet_codes.pack(RECORD)[:-9], b"x\x9c\x03\x00\x00\x00\x00\x01"])
def test_what_is_no_record_is_refused(data):
    with pytest.raises(InputError, match="hold no text"):
        sheet_codes.unpack(data)


def test_keys_name_texts():
    assert sheet_codes.key([["a", "b"]]) == sheet_codes.key((("a", "b"),)) != sheet_codes.key([["a"], ["b"]])
    assert len(bytes.fromhex(sheet_codes.key([]))) == 8


def test_symbols_are_read_by_a_reader_of_qr_codes():
    symbols = sheet_codes.symbols(RECORD)
    assert len({symbol.shape for symbol in symbols}) == 1
    parts = []
    for symbol in symbols:
        image = np.kron(np.pad(np.where(symbol, 0, 255), 4, constant_values=255), np.ones((6, 6))).astype(np.uint8)
        text, _, _ = cv2.QRCodeDetector().detectAndDecode(image)
        parts.append(sheet_codes.from_base45(text))
    assert parts == sheet_codes.split_data(sheet_codes.pack(RECORD))


@pytest.mark.slow
@pytest.mark.parametrize("version", sheet_codes.VERSIONS)
def test_every_size_holds_what_is_said_of_it(version):
    most = sheet_codes._HOLDS[version - 1]
    rng = np.random.default_rng(version)
    text = "".join(rng.choice(list(sheet_codes._BASE45), most))
    symbol = sheet_codes._symbol(text, version)
    assert symbol.shape == (sheet_codes.side_modules(version),) * 2
    assert symbol[:7, :7].sum() == 33  # the square of a corner
    with pytest.raises(cv2.error):
        sheet_codes._symbol(text + "A", version)


def test_too_much_text_is_refused():
    rng = np.random.default_rng(0)
    lines = tuple("".join(map(chr, rng.integers(33, 127, 80))) for _ in range(60))
    with pytest.raises(DoesNotFit, match="wider ruling"):
        sheet_codes.symbols(PageRecord("00" * 8, 1, 1, 6.0, True, lines))
