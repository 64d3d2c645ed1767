"""What is stored with every output about where it came from, in words and as JSON."""

from __future__ import annotations

import html
import json
import re
import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np

from handout import units
from handout.values import Drawing

# all that XML 1.0 does not allow, however it is written
_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def plain(value: Any) -> Any:
    """The value as JSON has it: mappings, lists, numbers, true, false, null, and text for all else."""
    if value is None or isinstance(value, bool | int | float):
        return value
    if isinstance(value, str):
        # a text that came from a badly decoded file name or argument has halves of characters in it
        return value.encode("utf-8", "replace").decode("utf-8")
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {plain(str(key)): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, set | frozenset):
        return sorted((plain(item) for item in value), key=str)
    return plain(str(value))


def json_text(value: Any) -> str:
    """`value` as JSON in one line of ASCII, so that it survives any container."""
    return json.dumps(plain(value), separators=(",", ":"))


def record(drawing: Drawing) -> dict[str, Any]:
    """Seed, hand, page and duration, and all of `drawing.about`."""
    page = drawing.page
    return {
        "seed": plain(drawing.about.get("seed")),
        "hand": plain(drawing.about.get("hand")),
        "page": {"width": page.width, "height": page.height, "name": page.name},
        "duration": round(drawing.duration, 3),
        "about": plain(drawing.about),
    }


def title(drawing: Drawing) -> str:
    """A title: `about["title"]`, else the first words of the text."""
    text = str(drawing.about.get("title") or drawing.about.get("text") or "")
    words = textwrap.shorten(xml_safe(text), 60, placeholder=" …")
    return words.removeprefix("…").strip() or "Handwriting"


def describe(drawing: Drawing) -> str:
    """What it is, in a sentence: hand, seed, page, length and time."""
    about, page = drawing.about, drawing.page
    number, pages = about.get("page_number"), about.get("pages")
    which = f", page {number} of {pages}" if number and pages and pages != 1 else ""
    hand = f" in the hand {about['hand']}" if about.get("hand") else ""
    seed = f", seed {about['seed']}" if about.get("seed") is not None else ""
    return xml_safe(
        f"Handwriting{hand}{seed}{which}, on {page.width:g} x {page.height:g} mm: "
        f"{units.count(len(drawing.strokes), 'stroke')}, "
        f"{drawing.pen_down:.0f} mm of line, written in {units.duration(drawing.duration)}."
    )


def xml_safe(text: str) -> str:
    """`text` with the characters that XML cannot hold replaced by U+FFFD (it still has to be escaped)."""
    return _NOT_XML.sub("�", text)


def escape_xml(text: str) -> str:
    """`text` as XML has it between tags; `xml.sax.saxutils` would bring the whole of HTTP and TLS with it."""
    return html.escape(text, quote=False)


def quote_attribute(text: str) -> str:
    """`text` as the value of an attribute, in its quotes; breaks and tabs survive."""
    return '"' + re.sub('["\t\n\r]', lambda match: f"&#{ord(match[0])};", escape_xml(text)) + '"'
