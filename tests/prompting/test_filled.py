"""A sheet that was written on and photographed, from the file to a flat page."""

import cv2
import numpy as np
import pytest
import scans
from PIL import Image

from handout.errors import InputError
from handout.tagging.page_sources import gather_sources


@pytest.fixture(scope="module")
def photo(drawn):
    """The sheet with some writing, seen from aside, in shades of grey."""
    written = drawn.copy()
    for row in range(3):
        cv2.putText(written, "hand", (900, 1700 + 240 * row), cv2.FONT_HERSHEY_SCRIPT_SIMPLEX, 6, 40, 12, cv2.LINE_AA)
    return scans.scanned(written, 200, angle=3, perspective=0.15, shadow=0.3)[0]


@pytest.mark.slow
def test_a_photograph_of_a_sheet_is_made_flat_and_knows_its_size(photo, prompt, tmp_path):
    Image.fromarray(photo).save(tmp_path / "photo.png")  # no resolution, no text
    (source,) = gather_sources([str(tmp_path / "photo.png")], [], None)
    scan = source.prepared.scan
    (note,) = source.notes
    written = source.transcript.splitlines()
    assert 3 <= len(written) < 10, "only three rows were written, each over one line or two"
    assert set(written) <= {*prompt.pages[1]} and not any(f"“{line}”" in note for line in written)
    assert scan.dpi == pytest.approx(200, rel=0.15)
    size = np.array(scan.shape) * scan.pixel
    assert size == pytest.approx((297, 210), abs=12)


@pytest.mark.slow
def test_a_mirrored_sheet_is_named(photo, tmp_path):
    Image.fromarray(photo[:, ::-1].copy()).save(tmp_path / "photo.png")
    with pytest.raises(InputError, match=r"photo\.png is mirrored: the marks of a sheet can be read only backwards"):
        gather_sources([str(tmp_path / "photo.png")], [], None)


@pytest.mark.slow
def test_half_a_sheet_is_named_with_its_file(photo, tmp_path):
    Image.fromarray(photo[: len(photo) // 2]).save(tmp_path / "half.png")
    with pytest.raises(InputError, match=r"half\.png: Only the marks at the top left and top right.*Scan the whole"):
        gather_sources([str(tmp_path / "half.png")], [], None)
