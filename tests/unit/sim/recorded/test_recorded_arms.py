"""Recordings with forces, by learn and fit: a file with columns of time, position and force."""

import json

import numpy as np
import pytest

from tests.command import assert_refused, ran, touchatlas
from tests.unit.planner.drivers.ball_recordings import BALL, TIP, recording
from tests.unit.planner.drivers.test_bags import write_bag
from touchatlas.sim.recorded.contour_file import read_curves
from touchatlas.sim.recorded.curves import ReadOptions
from touchatlas.sim.recorded.recorded_arms import recording_of, with_tip

PROBE = f"""
unit = "mm"
[tip]
radius = {TIP.radius}
radius_std = 0.003
stiffness = {TIP.stiffness}
noise_std = {TIP.noise_std}
force_std = {TIP.force_std}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arms")
    for name, places in (("one", np.eye(3)[:1]), ("two", np.eye(3)[:2])):
        held = recording(places)
        rows = np.hstack([held.times[:, None], held.positions, held.forces])
        lines = [",".join(f"{x:.5f}" for x in row) for row in rows]
        head = "time [s],x [mm],y [mm],z [mm],fx,fy,fz"
        (folder / f"{name}.csv").write_text("\n".join([head, *lines]) + "\n")
    (folder / "probe.toml").write_text(PROBE)
    (folder / "plain.csv").write_text("x,y,z\n" + "\n".join(f"{k},{k * k},0" for k in range(9)))
    return folder


def test_arms_are_curves_with_normals_of_the_surface(folder):
    """Their points are on the ball within five deviations of a sample (see test_replay), which are
    a fifth of what the tip's radius of 2 would make."""
    file = read_curves(folder / "two.csv", ReadOptions(tip=str(folder / "probe.toml")))
    assert [curve.name for curve in file.curves] == ["0.0", "0.1", "0.2", "1.0", "1.1", "1.2"]
    assert file.unit == "mm" and "2 touches of 6 contours in contact" in file.how
    for curve in file.curves:
        distance = np.linalg.norm(curve.points, axis=1)
        assert curve.exact and np.abs(distance - BALL).max() < 5 * 0.004
        assert ((curve.points * curve.outward).sum(axis=1) > 0.999 * distance).all()


@pytest.mark.slow
def test_a_patch_is_fitted_to_a_touch_of_a_recording(folder):
    """A ball of 30 mm bends by -1/30 everywhere; the fit says how sure it is."""
    done = ran("fit", "one.csv", "--tip", "probe.toml", "--json", cwd=folder)
    found = json.loads(done.stdout)
    for k in ("k1", "k2"):
        assert abs(found[k] + 1 / BALL) < 4 * max(found[f"{k}_std"], 1e-4)


@pytest.mark.slow
def test_a_recording_is_learned(folder):
    done = ran(
        *("learn", "two.csv", "--tip", "probe.toml", "--tolerance", 0.2, "--json"), cwd=folder
    )
    assert "2 touches of 6 contours in contact" in done.stderr
    assert "a tip of radius 2 was taken off along normals from the force" in done.stderr
    assert json.loads(done.stdout)["predicted_coverage"] > 0.0


def test_other_points_are_centres_of_the_tip(folder):
    """A probe.toml stands for --tip-radius and --systematic-std."""
    options = ReadOptions(tip=str(folder / "probe.toml"))
    found = with_tip(options, [folder / "plain.csv"], "mm")
    assert (found.tip, found.tip_radius, found.systematic_std) == ("", 2.0, 0.003)
    assert with_tip(options, [folder / "one.csv"], "m").systematic_std == pytest.approx(3e-6)
    assert with_tip(ReadOptions(), [folder / "one.csv"], "mm") == ReadOptions()


def test_a_bag_is_in_millimetres_unless_another_unit_is_named(tmp_path):
    """ROS has metres. The tool is given in the unit that comes out."""
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    bag = write_bag(tmp_path / "bag")
    plain, metres = recording_of(bag), recording_of(bag, "m")
    assert (plain.unit, metres.unit) == ("mm", "m")
    np.testing.assert_allclose(plain.positions, 1000.0 * metres.positions)
    longer = recording_of(bag, tool=[100.0, 0.0, 0.0]).positions - plain.positions
    np.testing.assert_allclose(np.linalg.norm(longer, axis=1), 100.0)


def test_contacts_and_centres_are_not_mixed(folder):
    done = touchatlas("learn", "one.csv", "plain.csv", "--tip", "probe.toml", cwd=folder)
    assert_refused(done, 2, "plain.csv has no forces, but one.csv has")
    done = touchatlas("learn", "one.csv", "--tip", "none.toml", cwd=folder)
    assert_refused(done, 2, "none.toml is no file; touchatlas qualify writes one")


def test_a_bag_is_a_folder_that_is_no_run(folder, tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    write_bag(tmp_path / "bag")
    done = touchatlas("learn", "bag", "--tip", folder / "probe.toml", cwd=tmp_path)
    assert "199 poses of /pose with forces of /wrench" in done.stderr
    assert "1 touch of 1 contour in contact" in done.stderr


@pytest.mark.parametrize("flag", ["--tip-radius", "--systematic-std"])
def test_what_a_probe_file_says_is_not_said_twice(folder, flag):
    done = touchatlas("learn", "one.csv", "--tip", "probe.toml", flag, 2, cwd=folder)
    assert_refused(done, 2, f"{flag} is 2, but --tip probe.toml says it, too")
