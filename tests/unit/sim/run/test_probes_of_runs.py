"""Runs with simulated machines and faults: options, numbers, and resuming byte for byte."""

from dataclasses import replace

import pytest

from tests.command import assert_refused, touchatlas
from touchatlas.sim import ProbeOptions, RunOptions, make_object
from touchatlas.sim.command.option_flags import updated_by_flags
from touchatlas.sim.folder.run_folder import read_settings
from touchatlas.sim.machine.options import check_used
from touchatlas.sim.run.exploration import resume_exploration, run_exploration

pytestmark = pytest.mark.usefixtures("no_pictures", "few_judged")
# With so little noise the first arms are short.
SCANNING = RunOptions(
    noise=0.005,
    max_touches=2,
    tolerance=2.0,
    fault="noise=2,moved=0.1:touch1",
    probe=ProbeOptions(name="scanning", radius=1.5, feed=60.0),
)


def test_a_scanning_run_is_resumed_byte_for_byte(tmp_path):
    obj = make_object("sphere")
    whole = run_exploration(obj, tmp_path / "whole", SCANNING)
    run_exploration(obj, tmp_path / "cut", replace(SCANNING, max_touches=1))
    resume_exploration(tmp_path / "cut", max_touches=2)
    for name in ("journal.sqlite", "atlas.npz"):
        assert (tmp_path / "cut" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    settings = read_settings(tmp_path / "whole")
    assert settings["probe"]["name"] == "scanning" and settings["probe"]["radius"] == 1.5
    assert settings["fault"] == SCANNING.fault
    assert whole.numbers["machine_seconds"] > 3.0


def test_an_ideal_probe_has_no_machine(tmp_path):
    options = RunOptions(max_touches=1, tolerance=2.0)
    result = run_exploration(make_object("sphere"), tmp_path / "r", options)
    assert result.numbers["machine_seconds"] is None


def test_a_measuring_machine_is_ten_times_as_good(tmp_path):
    probe = ProbeOptions(name="trigger", machine="measuring", points=2)
    options = RunOptions(max_touches=1, tolerance=2.0, probe=probe)
    result = run_exploration(make_object("sphere"), tmp_path / "r", options)
    assert result.numbers["noise_std"] == pytest.approx(0.002)


def test_flags_of_probes_and_faults_are_listed_and_checked(tmp_path):
    found = touchatlas("explore", "--help", cwd=tmp_path).stdout
    for words in ("--probe ", "--probe.radius", "--fault", "noise=N", "moved=T:touchK"):
        assert words in found
    for flag, value, words in (
        ("--probe", "best", "--probe is 'best'; it must be one of ideal, scanning, trigger"),
        ("--fault", "noise", "fault is 'noise'; it must be a name, = and a size"),
        ("--probe.radius", "2", "the probe is ideal, which has none; give --probe scanning or"),
    ):
        assert_refused(touchatlas("explore", "sphere", flag, value, cwd=tmp_path), 2, words)


@pytest.mark.parametrize("name", ["probe.feed", "planner.cost.feed"])
def test_what_is_refused_has_the_flag_of_its_own_record(name):
    others = {("probe", "feed"): 2.0, ("planner", "cost", "feed"): 2.0}
    given = others | {tuple(name.split(".")): -1.0}
    for flags in (given, {path: value for path, value in given.items() if value < 0}):
        with pytest.raises(ValueError, match=f"^--{name} is -1.0; "):
            updated_by_flags(RunOptions(), flags)


@pytest.mark.parametrize(
    "probe, said",
    [
        (ProbeOptions(feed=3.0), "--probe.feed is 3.0, but the probe is ideal"),
        (ProbeOptions(name="scanning", points=3), "the probe is scanning, which has none"),
        (ProbeOptions(name="trigger", normals=False), "which has none; give --probe scanning"),
    ],
)
def test_an_option_that_a_probe_has_not_is_refused(probe, said, tmp_path):
    """From Python, too."""
    with pytest.raises(ValueError, match=said):
        run_exploration(make_object("sphere"), tmp_path / "r", RunOptions(probe=probe))
    assert not (tmp_path / "r").exists()


def test_an_option_that_a_probe_has_is_taken():
    for name in ("scanning", "trigger"):
        check_used(ProbeOptions(name=name, radius=1.0, feed=2.0))
    check_used(ProbeOptions(name="ideal", machine="measuring"))
    check_used(ProbeOptions(name="trigger", points=3))


@pytest.mark.parametrize(
    "probe, said",
    [
        ({"radius": 0.005}, "--probe.radius is 0.005, but this machine knows a radius to 0.002"),
        ({"radius": 500.0}, "--probe.radius is 500, but sphere has a diagonal of 114.3"),
        ({"feed": 5000.0}, "--probe.feed is 5000, with which the switch opens 2.51 past the cont"),
    ],
)
def test_a_ball_that_no_machine_has_is_refused_and_leaves_no_run(tmp_path, probe, said):
    """A switch opens half a period of 1 ms, and 0.01 mm, late: 2.51 mm at 5000 mm/s."""
    options = RunOptions(probe=ProbeOptions("trigger", **probe))
    with pytest.raises(ValueError, match=said):
        run_exploration(make_object("sphere"), tmp_path / "r", options)
    assert not (tmp_path / "r" / "run.toml").exists()


def test_a_fault_that_never_began_is_said(tmp_path):
    words = "explore", "sphere", "--tolerance", 2, "--max-touches", 1, "--out", "r"
    for fault, said in (("noise=3:touch9", True), ("noise=3:touch0", False)):
        done = touchatlas(*words, "--fault", fault, "--force", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert (f"--fault {fault} never began: the run has 1 touch," in done.stderr) is said
    done = touchatlas("resume", "r", "--max-touches", 2, cwd=tmp_path)
    assert done.returncode == 0 and "never began" not in done.stderr
