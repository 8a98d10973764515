"""probe.toml: what qualify writes is what drivers read."""

import numpy as np
import pytest

from touchatlas.planner.drivers.fitted_ball import pattern_1x25
from touchatlas.planner.drivers.probe_file import probe_toml, read_tip
from touchatlas.planner.drivers.qualification import qualify
from touchatlas.planner.tracking.options import Tip


def written(tmp_path, **known):
    rng = np.random.default_rng(0)
    points = 13.5 * pattern_1x25([0, 0, 1.0]) + 0.003 * rng.normal(size=(25, 3))
    found = qualify(points, 12.5, **known)
    path = tmp_path / "probe.toml"
    path.write_text(probe_toml(found, 12.5, "mm", "points\nof a ball"))
    return path, found


def test_a_tip_is_read_as_it_was_written(tmp_path):
    """To the last digit; what was not measured is the default."""
    path, found = written(tmp_path, stiffness=1.3, stiffness_std=0.01)
    assert read_tip(path) == found.tip
    path, found = written(tmp_path)
    assert "stiffness" not in path.read_text()
    assert read_tip(path) == found.tip
    assert found.tip.stiffness == Tip().stiffness


def test_a_tip_is_read_in_another_unit(tmp_path):
    path, found = written(tmp_path, stiffness=1.3)
    tip = read_tip(path, "m")
    assert tip.radius == pytest.approx(1e-3 * found.tip.radius)
    assert tip.stiffness == pytest.approx(1.3e3)


@pytest.mark.parametrize(
    "text, words",
    [
        (None, "is no file"),
        ("[tip", "cannot be read as TOML"),
        ("radius = 1.0", "no table"),
        ("[tip]\nradios = 1.0", "has radios in"),
        ("[tip]\nradius = -1.0", "must be a finite number"),
        ('unit = "furlong"\n[tip]\nradius = 1.0', "no unit 'furlong'"),
    ],
)
def test_what_is_no_probe_file_is_refused_in_a_sentence(tmp_path, text, words):
    path = tmp_path / "probe.toml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(ValueError, match=words):
        read_tip(path, "mm")
