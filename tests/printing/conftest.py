import pytest
from doubles import PrintSystem, install


@pytest.fixture
def print_system(tmp_path, monkeypatch) -> PrintSystem:
    """``lp`` and ``lpstat`` on PATH that keep what they are given."""
    folder = tmp_path / "print-system"
    folder.mkdir()
    return install(folder, monkeypatch)
