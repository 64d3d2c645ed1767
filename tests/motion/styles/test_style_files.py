"""Every shipped style is valid; every slip in a file is refused with the name of file and key."""

import re

import pytest

from handout import shipped, tables
from handout.errors import InputError
from handout.motion.styles import style
from handout.motion.styles.style import Style

SHIPPED = sorted(shipped.folder("styles").glob("*.toml"))


def test_five_ship():
    assert {path.stem for path in SHIPPED} == {"blackletter", "calm", "chancery", "fast-tag", "scrawl"}
    assert all(style.read_style(path).name == path.stem and style.read_style(path).title for path in SHIPPED)


def test_a_learned_one_ships_with_five_primers():
    learned = style.find("learned")
    assert learned.model is not None and learned.model.structure is not None and len(learned.model.primers) == 5
    assert (shipped.folder("styles") / "learned.style").stat().st_size < 250_000


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "title is missing"),
        ('title = "a"\n[movement]\nsmoth = 0.3', "movement.smoth is not a known key; did you mean 'smooth'?"),
        ('title = "a"\n[movement]\nsmooth = 3.0', "movement.smooth = 3 is outside 0.05 to 1"),
        ('title = "a"\n[movement]\ninterval = 0.05', "movement.interval: needs a time with its unit"),
        ('title = "a"\n[movement]\ninterval = "5deg"', "movement.interval: '5deg' is not a time"),
        ('title = "a"\n[movement]\norder = 7', "movement.order"),
        ('title = "a"\n[form]\nshear = "85deg"', "form.shear"),
        ('title = "a"\n[brush]\nkind = "chisel"', "brush.kind"),
        ('title = "a"\n[covariance]\naxes = [0.0, 1.0]', "covariance.axes"),
        ('title = "a"\n[covariance]\nangles = ["30deg", "211deg"]', "covariance.angles are nearly the same"),
        ('title = "a"\n[breaking]\ndirections = ["90deg"]', "breaking.directions needs two"),
        ('title = "a"\n[breaking]\ndirections = ["0deg", "180deg"]', "breaking.directions"),
        ('title = "a"\nname = "b"', "name cannot be set"),
        ("title = ", "cannot be read as a style"),
        ('title = "a"\n[brush]\nwidth = nan', "brush.width"),
        ('title = "a"\n[covariance]\naxes = [inf, inf]', "covariance.axes = inf is no number that can be used"),
        ('title = "a"\n[covariance]\naxes = [1e308, 1e308]', "covariance.axes = 1e+308 is no number"),
        ('title = "a"\n[breaking]\ndirections = ["0deg", "1e308deg"]', "'1e308deg' is too large"),
        ('title = "a"\n[movement]\norder = 99999999999999999999', "movement.order is a whole number of more than 64"),
    ],
)
def test_a_slip_is_named(tmp_path, text, said):
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(said)) as raised:
        style.read_style(path)
    assert str(raised.value).startswith(f"{path}: ") and "\n" not in str(raised.value)


def test_found_by_name_by_file_or_not_at_all(tmp_path, monkeypatch):
    assert style.find("calm").title.startswith("Calm")
    path = tmp_path / "styles" / "calm.toml"
    path.parent.mkdir()
    path.write_text('title = "My own calm"', encoding="utf-8")
    assert style.find(str(path)).title == "My own calm"
    with pytest.raises(InputError, match="nearest: blackletter"):
        style.find("blakletter")
    monkeypatch.setattr(shipped, "user_folder", lambda name: tmp_path / name)
    assert style.find("calm").title == "My own calm" and "scrawl" in style.names()


def test_bounds_name_fields_that_there_are():
    known = set(Style.__struct_fields__)
    for key in style.BOUNDS:
        table, name = key.split(".")
        assert table in known and name in type(getattr(Style(title="a"), table)).__struct_fields__


def test_an_angle_has_a_unit():
    assert tables.convert_table({"title": "a", "form": {"shear": "180deg"}}, Style).form.shear == pytest.approx(
        3.14159265
    )
