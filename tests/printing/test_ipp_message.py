import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import PrinterError
from handout.printing.ipp.message import (
    Attribute,
    AttributeGroup,
    Message,
    MessageTag,
    Range,
    Resolution,
    Value,
    attribute,
    decode,
    encode,
)

INTEGERS = st.integers(-(2**31), 2**31 - 1)
TEXTS = st.text(max_size=40)
SIMPLE = st.one_of(
    st.builds(Value, st.sampled_from([MessageTag.INTEGER, MessageTag.ENUM]).map(int), INTEGERS),
    st.builds(Value, st.just(int(MessageTag.BOOLEAN)), st.booleans()),
    st.builds(
        Value, st.just(int(MessageTag.RESOLUTION)), st.builds(Resolution, INTEGERS, INTEGERS, st.sampled_from([3, 4]))
    ),
    st.builds(Value, st.just(int(MessageTag.RANGE)), st.builds(Range, INTEGERS, INTEGERS)),
    st.builds(
        Value,
        st.sampled_from(
            [MessageTag.TEXT, MessageTag.NAME, MessageTag.KEYWORD, MessageTag.URI, MessageTag.MIME_TYPE]
        ).map(int),
        TEXTS,
    ),
    st.builds(
        Value,
        st.sampled_from(
            [
                MessageTag.OCTETS,
                MessageTag.DATE_TIME,
                MessageTag.NAME_WITH_LANGUAGE,
                MessageTag.NO_VALUE,
                MessageTag.UNKNOWN,
            ]
        ).map(int),
        st.binary(max_size=30),
    ),
)


def attributes(values):
    names = st.text("abcdefghij-", min_size=1, max_size=12)
    return st.builds(Attribute, names, st.lists(values, min_size=1, max_size=3).map(tuple))


def collections(values):
    return st.builds(Value, st.just(int(MessageTag.COLLECTION)), st.lists(attributes(values), max_size=3).map(tuple))


VALUES = st.recursive(SIMPLE, collections, max_leaves=6)
GROUPS = st.builds(
    AttributeGroup,
    st.sampled_from([MessageTag.OPERATION, MessageTag.JOB, MessageTag.PRINTER, MessageTag.UNSUPPORTED_GROUP]).map(int),
    st.lists(attributes(VALUES), max_size=4).map(tuple),
)
MESSAGES = st.builds(
    Message,
    st.integers(0, 0xFFFF),
    st.lists(GROUPS, max_size=3).map(tuple),
    st.integers(1, 2**31 - 1),
    st.sampled_from([(1, 1), (2, 0)]),
)


@pytest.mark.slow
@given(MESSAGES, st.binary(max_size=20))
def test_what_is_encoded_is_decoded(message, document):
    data = encode(message)
    found, behind = decode(data + document)
    assert found == message and behind == len(data)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_message_or_a_plain_error(data):
    try:
        found, behind = decode(data)
    except PrinterError:
        return
    assert behind <= len(data) and encode(found)[:8] == data[:8]


@pytest.mark.slow
@given(MESSAGES, st.data())
def test_a_message_that_is_cut_off_is_noticed(message, data):
    whole = encode(message)
    with pytest.raises(PrinterError, match="ends in the middle"):
        decode(whole[: data.draw(st.integers(0, len(whole) - 1))])


def test_bytes_as_the_standard_has_them():
    # RFC 8010, appendix A.1: a Print-Job request, its first attributes and the number of copies
    expected = (
        b"\x01\x01\x00\x02\x00\x00\x00\x01\x01"
        b"\x47\x00\x12attributes-charset\x00\x05utf-8"
        b"\x48\x00\x1battributes-natural-language\x00\x05en-us"
        b"\x45\x00\x0bprinter-uri\x00\x2cipp://printer.example.com/ipp/print/pinetree"
        b"\x02\x21\x00\x06copies\x00\x04\x00\x00\x00\x14"
        b"\x44\x00\x05sides\x00\x13two-sided-long-edge\x03"
    )
    head = (
        attribute("attributes-charset", MessageTag.CHARSET, "utf-8"),
        attribute("attributes-natural-language", MessageTag.LANGUAGE, "en-us"),
        attribute("printer-uri", MessageTag.URI, "ipp://printer.example.com/ipp/print/pinetree"),
    )
    job = (attribute("copies", MessageTag.INTEGER, 20), attribute("sides", MessageTag.KEYWORD, "two-sided-long-edge"))
    message = Message(2, (AttributeGroup(MessageTag.OPERATION, head), AttributeGroup(MessageTag.JOB, job)), 1, (1, 1))
    assert encode(message) == expected and decode(expected) == (message, len(expected))


def test_collections_as_the_standard_has_them():
    # RFC 8010 §3.1.6: media-col with a media-size in it
    size = attribute("media-size", MessageTag.COLLECTION, (attribute("x-dimension", MessageTag.INTEGER, 6),))
    message = Message(2, (AttributeGroup(MessageTag.JOB, (attribute("media-col", MessageTag.COLLECTION, (size,)),)),))
    expected = (
        b"\x02\x34\x00\x09media-col\x00\x00\x4a\x00\x00\x00\x0amedia-size\x34\x00\x00\x00\x00"
        b"\x4a\x00\x00\x00\x0bx-dimension\x21\x00\x00\x00\x04\x00\x00\x00\x06\x37\x00\x00\x00\x00\x37\x00\x00\x00\x00\x03"
    )
    assert encode(message)[8:] == expected


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (Value(MessageTag.TEXT, "x" * 40000), "40000 bytes"),
        (Value(MessageTag.TEXT, (attribute("a", MessageTag.TEXT, "b"),)), "collection"),
    ],
)
def test_what_cannot_be_encoded_is_refused(value, words):
    with pytest.raises(ValueError, match=words):
        encode(Message(2, (AttributeGroup(MessageTag.JOB, (Attribute("a", (value,)),)),)))
    with pytest.raises(ValueError, match="no value"):
        encode(Message(2, (AttributeGroup(MessageTag.JOB, (Attribute("a", ()),)),)))


def test_collections_without_an_end_to_them_are_refused():
    begin = b"\x4a\x00\x00\x00\x01m\x34\x00\x00\x00\x00"
    with pytest.raises(PrinterError, match="collections in more than"):
        decode(b"\x02\x00\x00\x02\x00\x00\x00\x01\x02\x34\x00\x01c\x00\x00" + begin * 400)
