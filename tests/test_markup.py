from __future__ import annotations

import pytest

from handout import markup
from handout.errors import InputError

BOMB = """<?xml version="1.0"{coding}?><!DOCTYPE ink [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;">]>
<ink>&b;</ink>"""


@pytest.mark.parametrize("coding", ["utf-8", "utf-16"])
def test_refuses_document_types_in_any_coding(coding: str) -> None:
    with pytest.raises(InputError, match="DOCTYPE"):
        markup.parse(BOMB.format(coding="").encode(coding), "InkML")


def test_refuses_references_to_files() -> None:
    data = b'<!DOCTYPE ink SYSTEM "file:///etc/hostname"><ink/>'
    with pytest.raises(InputError, match="DOCTYPE"):
        markup.parse(data, "InkML")


def test_refuses_bottomless_nesting() -> None:
    assert markup.parse(b"<a>" * 60 + b"</a>" * 60, "InkML").tag == "a"
    with pytest.raises(InputError, match="deep"):
        markup.parse(b"<a>" * 100_000, "InkML")


def test_names_come_without_namespaces() -> None:
    root = markup.parse(b'<x:a xmlns:x="urn:x" xml:id="one"><x:b/>text</x:a>', "XML")
    assert root.tag == "a" and root.get("id") == "one" and root[0].tag == "b" and root[0].tail == "text"


@pytest.mark.parametrize("data", [b"", b"\x00\xff", b"<a", b"<a></b>", b"<a>\x07</a>", b"<a>&none;</a>"])
def test_refuses_what_is_not_well_formed(data: bytes) -> None:
    with pytest.raises(InputError, match="not XML"):
        markup.parse(data, "XML")
