"""The .hand file: a scanned hand, and what was corrected of it, in one archive.

The hand as it was found is in the parts at the top.  Every entry of the journal of corrections has a folder with those
parts that it changed, so that what was learned need not be learned again when the file is read, and any entry can be
undone and made again: the hand after entry k has of every part the newest of the entries up to k.

What was worked out of the hand is kept with it, beside the parts that it was worked out of (`hand.learnt`): it counts
for a hand of those parts alone.

Places are kept to 1/16 pixel, radii to 1/256 pixel, densities to 1/100; arrays as `archive.split_bytes` gives them.

Source: seed 000, §5.1.3 for what is kept.
"""

from __future__ import annotations

import io
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import accumulate, pairwise
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import msgspec
import numpy as np
from numpy.typing import NDArray

from handout import atomic
from handout.errors import InputError
from handout.hand import learnt
from handout.hand.archive import Archive, Content, Packed, content_bytes, pack, split_bytes
from handout.hand.corrections import AnyCorrection, CorrectionJournal, JournalEntry, apply, read_corrections
from handout.hand.ligatures import find_again
from handout.hand.places import PLACES
from handout.hand.scanned import KeptScan, Ligature, ScannedGlyph, ScannedHand, ScannedPage, Texture
from handout.values import Array, Indices, LineGraph, Moments

_RISING = "ligatures/rising.npy"  # empty: in files of programs that found ligatures as they are found now
FORMAT, _EARLIER = 3, 2  # of the file, and the one before, which has arrays as they are; others are refused
SUFFIX = ".hand"
_UV, _RADIUS, _DENSITY = 16.0, 256.0, 100.0  # steps a pixel, a pixel, 1
_WIDEST = 10.0  # mm, half the width of a line: the widest brush of a pen; set by eye
_MOMENTS = {"times": 1e5, "pressure": 1e3, "tilt": 1e4, "azimuth": 1e4, "rotation": 1e4}  # steps a second, 1, rad
_MOST_PAPER = 1_000_000  # pixels; what is kept of it has a few thousand
_SCAN = "scan.webp"  # of a page, in its folder
_JOURNAL, _ENTRIES, _LEARNT = "corrections.json", "corrections/", "learnt.json"
_SHIPPED = Path(__file__).resolve().parent / "house"
BESIDE = ".learnt"  # suffix of what is kept of a hand that ships, or was found anew: its own file stays as it is
_OWN = b'{"of":'  # how such a file begins, as `_learnt_bytes` writes it
_TIGHT, _QUICK = 7, 1  # of packing pictures: how hard, and how hard while somebody waits
_WAITED = 4  # of packing other parts then: a thirtieth of the time of 9 for a tenth more, measured on a painted page
_read_from: WeakKeyDictionary[ScannedHand, tuple[Path, str]] = WeakKeyDictionary()  # hand → file, and fingerprint
_COLUMNS = ("page", "line", "word", "at", "before", "after", "place")


class _Version(msgspec.Struct):
    format: int


class _PageHead(msgspec.Struct, forbid_unknown_fields=True):
    source: str
    transcript: str
    dpi: float
    shape: tuple[int, int]
    baselines: list[tuple[float, float, float, float, float]]
    pitch: float
    x_height: float
    slant: float
    pen: str
    corner: tuple[int, int]
    texture: tuple[int, int]


class _HandHead(msgspec.Struct, forbid_unknown_fields=True):
    format: int
    name: str
    title: str
    pages: list[_PageHead]
    letters: list[str]


class _Learnt(msgspec.Struct):
    """of : the fingerprint of the parts that the values were worked out of."""

    of: str
    values: dict[str, list[float]]


def save(hand: ScannedHand, path: Path, *, packed: bool = False) -> None:
    """Write a hand as it was found; whole or not at all, and only what can be read back.

    packed : see `to_bytes`.

    Raises InputError: the file cannot be written or would not be read back.
    """
    _write(path, to_bytes(hand, packed=packed))


def record(source: Path, path: Path, before: ScannedHand, after: ScannedHand, entry: JournalEntry) -> CorrectionJournal:
    """Write the hand of `source` to `path` with one entry more in its journal; entries that were undone are forgotten.

    Whoever calls this holds both files (`atomic.hold_file`) since before `before` was loaded.

    before : the hand that `load` gives of `source`.
    after : what the entry made of it.

    Raises InputError: as `load` and `save`.
    """
    return record_all(source, path, before, [(after, entry)])


def record_all(
    source: Path, path: Path, before: ScannedHand, steps: Sequence[tuple[ScannedHand, JournalEntry]]
) -> CorrectionJournal:
    """The same for one or more entries; each comes with the hand that it made of the one before."""
    with Archive(source) as archive:
        whole, earlier = _journal(archive, source)
        kept = CorrectionJournal(whole.entries[: whole.made], whole.made)
        folders = _folders(kept.made)
        parts: dict[str, Content | Packed] = {
            name: archive.packed_part(name)
            for name in archive.names
            if not name.startswith(_ENTRIES) or name.startswith(folders)
        }
        archive.look_in(folders)
        newest: dict[str, bytes] = {}
        inks: set[int] = set()
        for number, (after, _) in enumerate(steps, kept.made + 1):
            drawn = [old.texture is not new.texture for old, new in zip(before.pages, after.pages, strict=True)]
            inks |= {page for page, is_ in enumerate(drawn) if is_}
            for name, content in _hand_parts(after, packed="pages/0/ink.webp" in archive, drawn=drawn).items():
                data = content_bytes(content)
                if name not in newest and name in archive:
                    newest[name] = archive.read_part(name)
                if newest.get(name) != data:
                    parts[f"{_ENTRIES}{number}/{name}"] = newest[name] = data
            before = after
    first, *others = (entry for _, entry in steps)
    first = msgspec.structs.replace(first, corrections=(*earlier, *first.corrections))
    journal = CorrectionJournal((*kept.entries, first, *others), kept.made + len(steps))
    # ink that is copied as it was packed is known to be whole by its check sum
    _write(path, pack({**parts, _JOURNAL: _journal_bytes(journal)}, level=_WAITED), inks)
    return journal


def keep_learnt(path: Path, values: Mapping[str, Array]) -> None:
    """Add what was worked out of a hand to its file; for a hand that ships, to a file beside it.

    Raises InputError: as `load` and `save`.
    """
    with Archive(path) as archive:
        folders = _folders(_journal(archive, path)[0].made)
        place = ("", *folders)[-1] + _LEARNT
        again = {name: archive.packed_part(name) for name in archive.names} if place in archive.names else {}
        archive.look_in(folders)
        found = _learnt_bytes(_fingerprint(archive), values)
    if path.resolve().parent == _SHIPPED:
        atomic.write(path.with_suffix(BESIDE), found)
        _read_learnt.cache_clear()
    else:
        atomic.write(path, pack({**again, place: found}, b"" if again else path.read_bytes()))


def beside(hand: ScannedHand) -> Path | None:
    """The file for what is worked out of a hand, beside its own; None where it has no file, or ships."""
    path, _ = _read_from.get(hand, (None, ""))
    return None if path is None or path.resolve().parent == _SHIPPED else path.with_suffix(BESIDE)


def keep_beside(hand: ScannedHand, values: Mapping[str, Array]) -> None:
    """Keep what was worked out of a hand in the file `beside` it.

    Raises InputError: the folder cannot be written, or holds another file of that name (`tell_foreign`).
    """
    if foreign := tell_foreign(hand):
        raise InputError(foreign)
    if path := beside(hand):
        atomic.write(path, _learnt_bytes(_read_from[hand][1], values))


def tell_foreign(hand: ScannedHand) -> str:
    """That the file `beside` a hand is somebody's own, in a sentence; "" where it is none, or was kept here."""
    path = beside(hand.author or hand)
    with suppress(OSError):
        if path is not None and not path.read_bytes().startswith(_OWN):
            return f"{path} was not made by handout and stays as it is: what is worked out of {hand.name} is not kept."
    return ""


def _learnt_bytes(of: str, values: Mapping[str, Array]) -> bytes:
    # whole numbers without a point, which a third of the file would be
    numbers = {name: [int(v) if v.is_integer() else v for v in each.tolist()] for name, each in values.items()}
    return msgspec.json.encode(_Learnt(of, numbers))


def _fingerprint(archive: Archive) -> str:
    """Of all parts of a hand but its pictures."""
    parts = (name for name in archive.list_parts() if not name.startswith((_ENTRIES, _JOURNAL, _LEARNT)))
    known = archive.fingerprint([name for name in parts if not name.endswith((".png", ".webp"))])
    # what was worked out of other ligatures is no longer true
    return known if _RISING in archive else known + " rising"


def rewind(source: Path, path: Path, made: int) -> CorrectionJournal:
    """Write the hand of `source` to `path` with the first `made` entries of its journal in force.

    Raises InputError: as `load` and `save`; the journal has fewer entries than that.
    """
    with Archive(source) as archive:
        journal, _ = _journal(archive, source)
        parts: dict[str, Content | Packed] = {name: archive.packed_part(name) for name in archive.names}
    if not 0 <= made <= len(journal.entries):
        raise InputError(f"{source}: there is nothing to be {'undone' if made < 0 else 'made again'}.")
    journal = msgspec.structs.replace(journal, made=made)
    _write(path, pack({**parts, _JOURNAL: _journal_bytes(journal)}), ())
    return journal


def without_scans(path: Path) -> bytes:
    """The bytes of a file without the scans of its pages. Raises InputError: as `load`."""
    _refuse_foreign(path)
    with Archive(path) as archive:
        return pack({name: archive.packed_part(name) for name in archive.names if not name.endswith(_SCAN)})


def journal(path: Path) -> CorrectionJournal:
    """What was corrected of the hand of a file. Raises InputError: as `load`."""
    _refuse_foreign(path)
    with Archive(path) as archive:
        _check_known(archive, path)
        return _journal(archive, path)[0]


def _write(path: Path, data: bytes, inks: Collection[int] | None = None) -> None:
    """Write a file and check that it can be read back; `inks` : the pages whose ink is checked, None for all."""
    try:
        hand = _read_file(path, data)
        for number, page in enumerate(hand.pages):
            _ = page.texture.pixels if inks is None or number in inks else None
    except InputError as error:
        raise InputError(
            f"{path} is not written, because it could not be read back; that is a fault of this program. {error}"
        ) from error
    with atomic.hold_file(path):
        atomic.write(path, data)


def to_bytes(hand: ScannedHand, *, packed: bool = False) -> bytes:
    """The same as the bytes of the file; the same hand gives the same bytes.

    packed : ink as lossless WebP, which takes three quarters of the room and no page above 16383 pixels.
    """
    return pack({**_hand_parts(hand, packed), _JOURNAL: _journal_bytes(CorrectionJournal())})


def _hand_parts(hand: ScannedHand, packed: bool, drawn: Sequence[bool] = ()) -> dict[str, Content]:
    """The parts of a file that hold a hand; `drawn` : of each page whether its ink is included, () for all.

    Ink that a person painted is packed less tightly: somebody waits for it.
    """
    facts = _HandHead(FORMAT, hand.name, hand.title, [_facts(p) for p in hand.pages], [g.letter for g in hand.glyphs])
    parts: dict[str, Content] = {"hand.json": facts}
    parts |= _glyph_arrays(hand.glyphs)
    for number, page in enumerate(hand.pages):
        graph, folder = page.graph, f"pages/{number}/"
        parts[folder + "uv.npy"] = _steps(np.rint(graph.uv * _UV))
        parts[folder + "radius.npy"] = split_bytes(np.clip(np.rint(graph.radius / page.pixel * _RADIUS), 0, 65535))
        parts[folder + "density.npy"] = np.clip(np.rint(graph.density * _DENSITY), 0, 255).astype(np.uint8)
        first, second = graph.edges.T
        parts[folder + "edges.npy"] = split_bytes(np.column_stack([np.diff(first, prepend=0), second - first]))
        parts[folder + "dismissed.npy"] = _steps(page.dismissed)
        if page.moments is not None:
            # an empty array says that the page was recorded where nothing more is known of its vertices
            rows = {
                f"{folder}{name}.npy": _steps(np.rint(getattr(page.moments, name) * step))
                for name, step in _MOMENTS.items()
                if getattr(page.moments, name) is not None
            }
            parts |= rows or {f"{folder}order.npy": _flat([])}
        parts[folder + "paper.png"] = _picture(page.paper)
        if page.scan is not None and not drawn:
            parts[folder + _SCAN] = page.scan.packed()
        if not drawn or drawn[number]:
            parts[folder + ("ink.webp" if packed else "ink.png")] = _picture(
                page.texture.rgba, packed, _QUICK if drawn else _TIGHT
            )
    return parts


def _journal_bytes(journal: CorrectionJournal) -> bytes:
    # places may be numpy's numbers, in corrections that a script made
    return msgspec.json.format(msgspec.json.encode(journal, enc_hook=float), indent=1)


def load(path: Path) -> ScannedHand:
    """The hand of a file, its corrections made; textures are read when they are looked at.

    Raises InputError: not a .hand file, one that is damaged or made by a newer program, or one whose parts do not fit
    together.
    """
    return _read_file(path, None)


def check(path: Path, data: bytes | None = None) -> ScannedHand:
    """The hand of the file `path`, or of `data` that are to become it, with every part looked at, the ink too.

    Raises InputError: as `load`, or the ink is damaged.
    """
    hand = _read_file(path, data)
    for page in hand.pages:
        _ = page.texture.rgba
        _ = page.scan and page.scan.load()  # which are not kept
    return hand


def _read_file(path: Path, data: bytes | None) -> ScannedHand:
    """What a file holds; `data` are its bytes where they are not yet there."""
    if data is None:
        _refuse_foreign(path)
    with Archive(path, data) as archive:
        return _hand(archive, path, data)


def _refuse_foreign(path: Path) -> None:
    if not path.is_file():
        raise InputError(f"{path}: there is no such file.")
    with path.open("rb") as stream:
        if stream.read(2) != b"PK":
            raise InputError(f"{path} is not a .hand file: make one with `handout hand read`.")


def _hand(archive: Archive, path: Path, data: bytes | None) -> ScannedHand:
    _check_known(archive, path)
    journal, earlier = _journal(archive, path)
    folders = _folders(journal.made)
    archive.look_in(folders)
    facts = archive.json("hand.json", _HandHead)
    pictures = _Pictures(path, data, folders)
    try:
        pages = tuple(_page(archive, pictures, number, page) for number, page in enumerate(facts.pages))
        hand = ScannedHand(facts.name, facts.title, pages, _glyphs(archive, facts.letters, pages))
    except (ValueError, IndexError, OverflowError) as error:
        raise InputError(f"{path} cannot be used: its parts do not fit together ({error}).") from error
    fingerprint = _fingerprint(archive)
    _read_from[hand] = path, fingerprint
    own = path.with_suffix(BESIDE)
    kept = list[_Learnt]()
    with suppress(OSError):  # there is none, or another program takes it away just now
        kept.append(_read_learnt(own, own.stat().st_mtime_ns))
    kept += [_read_learnt(file) for file in sorted(_SHIPPED.glob("*" + BESIDE))]
    kept += [archive.json(_LEARNT, _Learnt)] if _LEARNT in archive else []
    for found in kept:
        if found.of == fingerprint:
            learnt.remember(hand, found.values)
            break
    return apply(hand, earlier, strict=False)


@lru_cache(maxsize=4)
def _read_learnt(path: Path, state: int = 0) -> _Learnt:
    """What a file beside a hand keeps, of a hand that ships for copies of it too; nothing where it cannot be read."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=_Learnt)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
        return _Learnt("", {})


def _folders(made: int) -> tuple[str, ...]:
    """The folders of the entries that are in force, in their order."""
    return tuple(f"{_ENTRIES}{number}/" for number in range(1, made + 1))


def _journal(archive: Archive, path: Path) -> tuple[CorrectionJournal, tuple[AnyCorrection, ...]]:
    """The journal of a file, and corrections that an earlier program kept without one."""
    data = archive.read_part(_JOURNAL)
    try:
        journal = msgspec.json.decode(data, type=CorrectionJournal)
    except msgspec.MsgspecError:
        return CorrectionJournal(), read_corrections(data, f"{path}, {_JOURNAL}")
    if journal.format != CorrectionJournal().format or not 0 <= journal.made <= len(journal.entries):
        raise InputError(f"{path} cannot be used: its journal of corrections is none that this program knows.")
    return journal, ()


def _check_known(archive: Archive, path: Path) -> None:
    if "hand.json" not in archive:
        raise InputError(f"{path} is not a .hand file: make one with `handout hand read`.")
    version = archive.json("hand.json", _Version).format
    if version not in (_EARLIER, FORMAT):
        way = "use a newer version of handout" if version > FORMAT else "read the pages again"
        raise InputError(f"{path} is of format {version} and this program knows format {FORMAT}: {way}.")


def _facts(page: ScannedPage) -> _PageHead:
    return _PageHead(
        source=page.source,
        transcript=page.transcript,
        dpi=page.dpi,
        shape=page.shape,
        baselines=[tuple(row) for row in page.baselines.tolist()],
        pitch=page.pitch,
        x_height=page.x_height,
        slant=page.slant,
        pen=page.pen,
        corner=page.texture.corner,
        texture=page.texture.shape,
    )


def _page(archive: Archive, pictures: _Pictures, number: int, facts: _PageHead) -> ScannedPage:
    folder = f"pages/{number}/"
    dismissed = folder + "dismissed.npy"
    uv = _sums(archive.array(folder + "uv.npy", "int32", None, 2)) / _UV
    count = len(uv)
    first, apart = archive.array(folder + "edges.npy", "int32", None, 2).T
    first = _sums(first)
    pixel = 25.4 / facts.dpi if facts.dpi > 0 else 0.0
    radius = archive.array(folder + "radius.npy", "uint16", count) / _RADIUS * pixel
    if count and not 0 < radius.min() <= radius.max() <= _WIDEST:
        raise archive.error(f"{folder}radius.npy holds lines that no pen has drawn")
    graph = LineGraph(
        (uv + 0.5) * pixel,
        radius,
        archive.array(folder + "density.npy", "uint8", count) / _DENSITY,
        uv,
        np.column_stack([first, first + apart]),
    )
    ink = folder + ("ink.webp" if folder + "ink.webp" in archive else "ink.png")
    texture = Texture(
        facts.corner, facts.texture, partial(pictures.unpack_picture, ink, facts.texture, "BGRA"), blue_first=True
    )
    if ink not in archive:
        raise ValueError(f"page {number} has no ink")
    name = folder + _SCAN
    scan = None
    if name in archive:
        load = partial(pictures.unpack_picture, name, facts.shape, "BGR")
        scan = KeptScan(facts.shape, load, partial(pictures.packed_picture, name))
    values = {name: getattr(facts, name) for name in ("source", "transcript", "dpi", "shape", "pitch", "x_height")}
    return ScannedPage(
        **values,
        graph=graph,
        baselines=np.array(facts.baselines, dtype=np.float64).reshape(-1, 5),
        slant=facts.slant,
        pen=facts.pen,
        texture=texture,
        paper=archive.picture(folder + "paper.png", "RGB", _MOST_PAPER),
        moments=_moments(archive, folder, count),
        dismissed=_sums(archive.array(dismissed, "int32", None)) if dismissed in archive else np.zeros(0, np.intp),
        scan=scan,
    )


def _moments(archive: Archive, folder: str, count: int) -> Moments | None:
    files = {name: f"{folder}{name}.npy" for name in (*_MOMENTS, "order")}
    if not any(file in archive for file in files.values()):
        return None
    return Moments(
        **{
            name: _sums(archive.array(files[name], "int32", count)) / step
            for name, step in _MOMENTS.items()
            if files[name] in archive
        }
    )


@dataclass(frozen=True, eq=False)
class _Pictures:
    """The pictures of a file, each read when it is first used.  data : the file's bytes if it is not yet written."""

    path: Path
    data: bytes | None
    folders: Sequence[str]

    def unpack_picture(self, part: str, shape: tuple[int, int], mode: str) -> NDArray[np.uint8]:
        with Archive(self.path, self.data) as archive:
            archive.look_in(self.folders)
            pixels = archive.picture(part, mode, shape[0] * shape[1])
        if pixels.shape[:2] != shape:
            raise InputError(f"{self.path} cannot be used: {part} has another size than it says; make it again.")
        return pixels

    def packed_picture(self, part: str) -> bytes:
        with Archive(self.path, self.data) as archive:
            return archive.read_part(part)


def _glyph_arrays(glyphs: Sequence[ScannedGlyph]) -> dict[str, Content]:
    """The glyphs as columns; lists of vertices are one array and the length of each."""
    rows = [(g.page, g.line, g.word, g.at, g.before, g.after, PLACES.index(g.place)) for g in glyphs]
    ways = [(number, way) for number, glyph in enumerate(glyphs) for way in glyph.ligatures]
    strokes = [(number, way) for number, glyph in enumerate(glyphs) for way in glyph.ways]
    return {
        **(_numbered_lists("strokes", strokes) if strokes else {}),
        "glyphs/table.npy": split_bytes(np.array(rows, dtype=np.int32).reshape(-1, len(_COLUMNS))),
        "glyphs/confidence.npy": np.array([g.confidence for g in glyphs], dtype=np.float32),
        "glyphs/confirmed.npy": np.array([g.confirmed + (g.confirmed and g.kept_out) for g in glyphs], dtype=np.uint8),
        "glyphs/vertices.npy": _flat([g.vertices for g in glyphs]),
        "glyphs/counts.npy": split_bytes(np.array([len(g.vertices) for g in glyphs])),
        **_numbered_lists("ligatures", [(number, way.path) for number, way in ways]),
        _RISING: np.zeros(0, dtype=np.uint8),
    }


def _numbered_lists(folder: str, lists: Sequence[tuple[int, Indices]]) -> dict[str, Content]:
    """Lists of vertices, and of which glyph each is."""
    return {
        f"{folder}/from.npy": split_bytes(np.array([number for number, _ in lists])),
        f"{folder}/vertices.npy": _flat([vertices for _, vertices in lists]),
        f"{folder}/counts.npy": split_bytes(np.array([len(vertices) for _, vertices in lists])),
    }


def _flat(lists: Sequence[Indices]) -> NDArray[np.uint8]:
    return _steps(np.concatenate([np.zeros(0, np.intp), *lists]))


def _steps(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Whole numbers as differences, which are small where vertices follow their line: they pack far better."""
    return split_bytes(np.diff(values.astype(np.int64), axis=0, prepend=0))


def _sums(steps: NDArray[Any]) -> NDArray[np.int64]:
    """What `_steps` was made of."""
    return np.cumsum(steps, axis=0, dtype=np.int64)


def _glyphs(archive: Archive, letters: list[str], pages: Sequence[ScannedPage]) -> tuple[ScannedGlyph, ...]:
    count = len(letters)
    table = archive.array("glyphs/table.npy", "int32", count, len(_COLUMNS)).tolist()
    sure = archive.array("glyphs/confidence.npy", "float32", count).tolist()
    known = "glyphs/confirmed.npy"
    said = archive.array(known, "uint8", count).tolist() if known in archive else [0] * count
    vertices = _lists(archive, "glyphs", count)
    ways, strokes = _ligatures(archive, table, pages), _strokes(archive, count)
    glyphs = []
    for i, (page, line, word, at, before, after, place) in enumerate(table):
        if not 0 <= place < len(PLACES):
            raise ValueError(f"glyph {i} has no place in its word")
        if not 0 <= sure[i] <= 1:
            raise ValueError(f"glyph {i} has a confidence of {sure[i]:g}")
        rest = (before, after, tuple(ways.get(i, ())), sure[i], said[i] > 0, tuple(strokes.get(i, ())), said[i] > 1)
        glyphs.append(ScannedGlyph(letters[i], PLACES[place], page, line, word, at, vertices[i], *rest))
    return tuple(glyphs) if _RISING in archive else find_again(glyphs, pages)


def _strokes(archive: Archive, count: int) -> dict[int, list[Indices]]:
    """How glyphs were written, as a person said."""
    strokes: dict[int, list[Indices]] = {}
    if "strokes/from.npy" in archive:
        owner = archive.array("strokes/from.npy", "int32", None).tolist()
        for number, way in zip(owner, _lists(archive, "strokes", len(owner)), strict=True):
            if not 0 <= number < count or not len(way):
                raise ValueError(f"a stroke is that of glyph {number} of {count}, or has no vertices")
            strokes.setdefault(number, []).append(way)
    return strokes


def _ligatures(archive: Archive, table: list[Any], pages: Sequence[ScannedPage]) -> dict[int, list[Ligature]]:
    owner = archive.array("ligatures/from.npy", "int32", None).tolist()
    ligatures: dict[int, list[tuple[int, int, Indices]]] = {}
    for number, path in zip(owner, _lists(archive, "ligatures", len(owner)), strict=True):
        if not 0 <= number < len(table):
            raise ValueError(f"a ligature begins at glyph {number} of {len(table)}")
        page, line = table[number][:2]
        if not (0 <= page < len(pages) and 0 <= line < len(pages[page].baselines)):
            raise ValueError(f"glyph {number} is on a line that there is not")
        if len(path) < 2 or not all(0 <= end < len(pages[page].graph) for end in (path[0], path[-1])):
            raise ValueError(f"a ligature of glyph {number} names a vertex that there is not")
        ligatures.setdefault(page, []).append((number, line, path))
    ways: dict[int, list[Ligature]] = {}
    for page, some in ligatures.items():
        # all ends of a page at once: there are thousands
        vertices = np.array([vertex for _, _, path in some for vertex in (path[0], path[-1])])
        lines = np.repeat([line for _, line, _ in some], 2)
        ends = pages[page].to_line(lines, pages[page].graph.uv[vertices]).reshape(-1, 2, 2)
        for (number, _, path), (start, end) in zip(some, ends, strict=True):
            ways.setdefault(number, []).append(Ligature(path, start, end))
    return ways


def _lists(archive: Archive, folder: str, count: int) -> list[Indices]:
    """Lists of vertices, cut from their one array."""
    counts = archive.array(f"{folder}/counts.npy", "int32", count)
    flat = _sums(archive.array(f"{folder}/vertices.npy", "int32", None))
    if (counts < 0).any() or int(counts.sum(dtype=np.int64)) != len(flat):
        raise ValueError(f"the lists of {folder} are not as long as they say")
    flat = flat.astype(np.intp)
    return [flat[a:b] for a, b in pairwise(accumulate(counts.tolist(), initial=0))]


def _picture(pixels: NDArray[np.uint8], packed: bool = False, level: int = _TIGHT) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    image = Image.fromarray(np.ascontiguousarray(pixels))
    if packed:
        image.save(stream, "WEBP", lossless=True, quality=80, method=5 if level == _TIGHT else 0, exact=True)
    else:
        image.save(stream, "PNG", compress_level=level)
    return stream.getvalue()
