"""Plans as a program for LinuxCNC by touchatlas next, and its logs back by touchatlas learn."""

import pytest

from tests.command import assert_refused, ran, touchatlas
from tests.unit.planner.drivers.linuxcnc_logs import log_of
from touchatlas.planner.tracking.options import TriggerOptions
from touchatlas.sim.run.learning import pending_plans

BALL, TIP = 20.0, 1.0


@pytest.fixture
def folder(tmp_path):
    """A run that begins above a ball, its first plan as a program, and the tip."""
    (tmp_path / "probe.toml").write_text(f"[tip]\nradius = {TIP}\nnoise_std = 0.003\n")
    start = ("--start", "0,0,20", "--outward", "0,0,1", "--noise", 0.003, "--tolerance", 0.2)
    ran("next", "run", *start, "--program", "probe.ngc", cwd=tmp_path)
    return tmp_path


def test_the_log_of_a_program_is_an_answer_to_its_plan(folder):
    assert "(PROBEOPEN touch-0000.txt)" in (folder / "probe.ngc").read_text()
    again = ("next", "run", "--program", "probe.ngc")
    assert_refused(touchatlas(*again, cwd=folder), 2, "give another --program, or --force")
    ran(*again, "--force", cwd=folder)
    plan = pending_plans(folder / "run")[0]
    log = folder / "touch-0000.txt"
    (folder / "cut").mkdir()
    (folder / "cut" / log.name).write_text("0 0 1\n")
    log.write_text(log_of(plan, TriggerOptions(), BALL + TIP))
    cut = "learn", "run", f"cut/{log.name}", "--tip", "probe.toml"
    for words, said in (
        (("learn", "run", log.name), "holds centres of a tip; give --tip"),
        (("learn", log.name, "--tip", "probe.toml"), "name the run before it"),
        (("learn", "run", "touch-0007.txt", "--tip", "probe.toml"), "plan 7, which is not pending"),
        (cut, "cut/touch-0000.txt: line 1 of the log of plan 0 is '0 0 1'; nine numbers"),
    ):
        assert_refused(touchatlas(*words, cwd=folder), 2, said)
    ran("learn", "run", log.name, "--tip", "probe.toml", "--no-draw", cwd=folder)
    assert 0 not in pending_plans(folder / "run")


def test_a_program_that_cannot_be_written_begins_no_run(tmp_path):
    start = ("--start", "0,0,20", "--outward", "0,0,1", "--noise", 0.003, "--tolerance", 0.2)
    for file, said in (("none/p.ngc", "none is not a folder; make it"), (".", "is a folder")):
        done = touchatlas("next", "run", *start, "--program", file, cwd=tmp_path)
        assert_refused(done, 2, said)
    assert not any(tmp_path.iterdir())
