"""touchatlas qualify: files of points and recordings with forces, probe.toml, refusals."""

import json

import numpy as np
import pytest

from tests.command import assert_refused, ran, touchatlas
from touchatlas.planner.drivers.fitted_ball import pattern_1x25
from touchatlas.planner.drivers.probe_file import read_tip
from touchatlas.sim import RunOptions
from touchatlas.sim.folder.kept_settings import NO_OPTIONS
from touchatlas.sim.folder.option_tables import read_options

BALL, TIP, STIFFNESS = 12.5, 1.0, 2.0


def write(path, names, rows):
    lines = [",".join(f"{x:.6f}" for x in row) for row in rows]
    path.write_text("\n".join([names, *lines]) + "\n")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The 25 points of the pattern, and a recording along meridians with a force that swells."""
    folder, rng = tmp_path_factory.mktemp("qualify"), np.random.default_rng(0)
    u = pattern_1x25([0.0, 0.0, 1.0])
    write(folder / "points.csv", "x [mm],y [mm],z [mm]", (BALL + TIP) * u + [1, 2, 3])
    write(folder / "half.csv", "x,y,z", (BALL + TIP) * u[-8:])
    t = np.linspace(0.0, 1.0, 2000)
    polar, turn = 0.5 * np.pi * np.abs(np.cos(2.5 * np.pi * t)), 1.3 * np.floor(2.5 * t)
    n = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], 1)
    forces = (0.2 + 0.4 * np.sin(37 * t) ** 2)[:, None] * n
    places = (BALL + TIP) * n - forces / STIFFNESS + 0.002 * rng.normal(size=n.shape)
    rows = np.hstack([20.0 * t[:, None], places, forces])
    air = np.hstack([rows[-1:, :4] + [0.1, 0.0, 0.0, 50.0], np.zeros((1, 3))])
    write(folder / "scan.csv", "time [s],x [mm],y [mm],z [mm],fx,fy,fz", np.vstack([rows, air]))
    write(folder / "even.csv", "time,x,y,z,fx,fy,fz", np.hstack([rows[:, :4], 0.4 * n]))
    write(folder / "back.csv", "time,x,y,z,fx,fy,fz", rows[200::-1])
    write(folder / "clockless.csv", "x,y,z,fx,fy,fz", rows[:200, 1:])
    still = np.hstack([np.full((9, 1), 3.0), rows[:9, 1:]])
    write(folder / "still.csv", "time,x,y,z,fx,fy,fz", still)
    return folder


def test_points_tell_radius_and_form(folder):
    done = ran(*("qualify", "points.csv", "--ball", BALL, "--radius", 0.99, "--json"), cwd=folder)
    found = json.loads(done.stdout)
    # The file has six digits.
    assert found["radius"] == pytest.approx(TIP, abs=2e-6)
    assert found["P_Form.Sph.1x25"] == pytest.approx(0.0, abs=4e-6)
    assert found["P_Size.Sph"] == pytest.approx(0.02, abs=4e-6)
    assert found["unit"] == "mm"
    assert "stiffness" not in found
    assert read_tip(folder / "probe.toml").radius == found["radius"]
    again = touchatlas("qualify", "points.csv", "--ball", BALL, cwd=folder)
    assert_refused(again, 2, "probe.toml is there already")


def test_a_recording_tells_stiffness_too(folder):
    """Readings in the air are left out."""
    done = ran("qualify", "scan.csv", "--ball", BALL, "--out", "scan.toml", cwd=folder)
    assert "P_Form.Sph.Scan" in done.stdout
    tip = read_tip(folder / "scan.toml", "mm")
    assert abs(tip.radius - TIP) < 4 * tip.radius_std < 0.004
    assert abs(tip.stiffness / STIFFNESS - 1.0) < 4 * tip.stiffness_std < 0.04
    assert tip.noise_std == pytest.approx(0.002, rel=0.1)


def test_a_simulated_trigger_is_qualified(folder):
    """A measuring machine's: pre-travel 0.01 mm and half a period at 10 mm/s, 0.005, in the mean;
    its lobes of 0.004 are the form. What its ball truly is differs by 0.0005 from 2 mm."""
    words = ("trigger", "--ball", BALL, "--machine", "measuring", "--out", "trigger.toml")
    done = ran("qualify", *words, "--json", cwd=folder)
    found = json.loads(done.stdout)
    assert found["radius"] == pytest.approx(2.0 - 0.01 - 0.0025, abs=5 * found["radius_std"] + 2e-3)
    assert 0.004 < found["P_Form.Sph.1x25"] < 0.03
    probe = read_options(folder / "trigger.toml", RunOptions(), NO_OPTIONS).probe
    assert (probe.name, probe.machine, probe.radius) == ("trigger", "measuring", found["radius"])


@pytest.mark.slow
def test_a_simulated_scanning_probe_is_qualified_and_then_explores(folder):
    """Radius and stiffness are drawn about 2 mm and 2 N/mm with 0.0005 and 1 %."""
    words = ("scanning", "--ball", BALL, "--machine", "measuring", "--out", "head.toml")
    ran("qualify", *words, cwd=folder)
    tip = read_tip(folder / "head.toml")
    assert abs(tip.radius - 2.0) < 4 * 0.0005 and abs(tip.stiffness - 2.0) < 4 * 0.02
    run = ("explore", "sphere", "--options", "head.toml", "--max-touches", 1, "--tolerance", 2)
    ran(*run, "--out", "run", cwd=folder)
    assert 'name = "scanning"' in (folder / "run" / "run.toml").read_text()


def test_help_says_what_is_measured(folder):
    done = touchatlas("qualify", "--help", cwd=folder)
    assert done.returncode == 0
    for words in ("--ball", "--stiffness", "--axis", "ISO 10360-5"):
        assert words in done.stdout


@pytest.mark.parametrize(
    "words, said",
    [
        (("none.csv", "--ball", 12.5), "none.csv is no file"),
        (("trigger", "--ball", 12.5, "--seed", -1), "--seed is -1; it must be a whole number"),
        (("half.csv", "--ball", 12.5), "touch it all around"),
        (("points.csv", "--ball", 25), "see radius, diameter, unit"),
        (("points.csv", "--ball", 0), "--ball is 0.0; it must be a finite number, more"),
        (("points.csv", "--ball", 12.5, "--ball-std", -1), "--ball-std is -1.0; it must be"),
        (("points.csv", "--ball", 12.5, "--axis", "0,0,0"), "--axis has length 0"),
        (("points.csv", "--ball", 12.5, "--unit", "ell"), "--unit is 'ell'; it must be nm"),
        (("points.csv",), "--ball requires an argument"),
        (("even.csv", "--ball", 12.5), "do not tell the stiffness"),
        (("scan.csv", "--ball", 12.5, "--least", 5), "never above 5 N for 0.32 s"),
        (("trigger", "--ball", 12.5, "--machine", "arms"), "machine is 'arms'"),
        (("trigger", "--ball", 12.5, "--unit", "m"), "simulated probes are in mm"),
        (("back.csv", "--ball", 12.5), "line 3: the time is earlier"),
        (("still.csv", "--ball", 12.5), "still.csv has one time only, 3 s"),
        (("trigger", "--ball", 12.5, "--tool", "1,2"), "--tool is '1,2', but trigger is a simul"),
        (("scan.csv", "--ball", 12.5, "--tool", "0,0,9"), "but scan.csv is text with forces, wh"),
        (("scan.csv", "--ball", 12.5, "--columns", "x=1"), "--columns is 'x=1', but scan.csv is"),
        (("points.csv", "--ball", 12.5, "--pose", "/p"), "but points.csv is a file of points, wh"),
        (("clockless.csv", "--ball", 12.5), "no column of time"),
        (("points.csv", "--ball", 12.5, "--out", "none/p.toml"), "none is not a folder; make it"),
    ],
)
def test_wrong_input_is_refused_in_one_sentence(folder, words, said):
    out = () if "--out" in words else ("--out", "other.toml")
    done = touchatlas("qualify", *words, *out, cwd=folder)
    lines = [line for line in done.stderr.splitlines() if not line.startswith("touchatlas: read:")]
    done.stderr = "\n".join(lines)
    assert_refused(done, 2, said)
    assert not (folder / "other.toml").exists()
