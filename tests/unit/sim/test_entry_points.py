"""What other packages add is used by its name, without a change of ours."""

import sys
from pathlib import Path

import numpy as np
import pytest

from touchatlas.atlas import load_atlas
from touchatlas.patch.entry_points import added
from touchatlas.planner import Planner, PlannerOptions, StopReason, explore
from touchatlas.sim import RunOptions, make_object, object_names
from touchatlas.sim.machine.options import ProbeOptions
from touchatlas.sim.machine.simulated_probe import probe_of
from touchatlas.sim.recorded.fit_file import fit_file
from touchatlas.sim.run.exploration import resume_exploration, run_exploration
from touchatlas.sim.run.work import begin, random_streams
from touchatlas.sim.study.tradeoff import measure_cell

PACKAGE = """
import numpy as np
from touchatlas.patch import fit_patch
from touchatlas.planner import Planner, target_at

def lowest(view, places):
    points, _ = places.all
    height = np.where(view.is_free(points), points[:, 2], np.inf)
    return target_at(places, int(height.argmin())) if np.isfinite(height).any() else None

class Twice:
    # Asks ours, and ends after two touches.
    def __init__(self, start, outward, options, rng):
        self.planner, self.told = Planner(start, outward), 0

    def ask(self, atlas):
        return self.planner.ask(atlas) if self.told < 2 else None

    def tell(self, touch, change):
        self.told += 1
        self.planner.tell(touch, change)

def ours_again(point, contours, outward):
    return fit_patch(point, contours, outward).patch

def deaf(obj, options, rng):
    from touchatlas.sim import Probe
    return Probe(obj, 0.0, rng)

class Unlike:
    # Says once that its touches hold centres of a ball.
    wrong = True

    def __init__(self, obj, options, rng):
        from touchatlas.sim import Probe
        self.probe = Probe(obj, options.noise, rng)
        self.state, self.restore = self.probe.state, self.probe.restore

    def __call__(self, plan):
        from dataclasses import replace
        return replace(self.probe(plan), tip_radius=float(self.wrong and plan.number == 1))

def tetrahedron(seed):
    points = 10.0 * np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    return points, np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])

"""
ENTRIES = """
[touchatlas.planners]
lowest = added_package:lowest
twice = added_package:Twice
broken = added_package:nothing_there
[touchatlas.estimators]
ours_again = added_package:ours_again
[touchatlas.probes]
deaf = added_package:deaf
unlike = added_package:Unlike
[touchatlas.objects]
tetrahedron = added_package:tetrahedron
"""


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package as pip installs it."""
    info = tmp_path / "added_package-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: added-package\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRIES)
    (tmp_path / "added_package.py").write_text(PACKAGE)
    monkeypatch.syspath_prepend(tmp_path)
    added.cache_clear()
    yield
    added.cache_clear()
    sys.modules.pop("added_package", None)


def planned(name: str, most: int):
    """Steps and planner of a short exploration of a ball by the planner of a name."""
    obj = make_object("sphere")
    options = RunOptions(0.1, 1.0, planner=PlannerOptions(name))
    probe_rng, _, _, planner_rng = random_streams(0)
    atlas, planner = begin(options, obj, planner_rng)
    steps = list(explore(atlas, planner, probe_of(options, obj, probe_rng), most))
    return steps, planner


@pytest.mark.usefixtures("package")
def test_a_function_that_chooses_a_place_plans_a_run():
    steps, planner = planned("lowest", 3)
    assert type(planner) is Planner and len(steps) == 3
    # All its touches but the first are lower than the start, which is the top.
    heights = [step.plan.reference_point[2] for step in steps]
    assert max(heights[1:]) < heights[0]


@pytest.mark.usefixtures("package")
def test_a_class_that_asks_and_tells_plans_a_run_and_ours_says_what_is_known():
    steps, planner = planned("twice", 9)
    assert len(steps) == 2 and planner.stop.reason is StopReason.TRIED
    assert 0.0 < planner.stop.forecast.predicted_coverage < 1.0
    assert steps[1].plan.known > 0.0 and [step.plan.number for step in steps] == [0, 1]
    ours, _ = planned("tolerance", 2)
    for one, other in zip(steps, ours, strict=True):
        assert np.array_equal(one.touch.contact, other.touch.contact)


@pytest.mark.usefixtures("package")
def test_an_estimator_fits_files_and_stands_in_charts(tmp_path):
    turns = np.pi / 3.0 * np.arange(3)
    line = np.linspace(-5.0, 5.0, 19)
    rows = [
        f"{k},{r * np.cos(t)},{r * np.sin(t)},{-r * r / 60.0}"
        for k, t in enumerate(turns)
        for r in line
    ]
    Path(tmp_path / "c.csv").write_text("\n".join(["curve,x,y,z", *rows]) + "\n")
    ours = fit_file(tmp_path / "c.csv", "map", 0.01, outward=[0.0, 0.0, 1.0])
    again = fit_file(tmp_path / "c.csv", "ours_again", 0.01, outward=[0.0, 0.0, 1.0])
    assert again.patch.curvatures.k1 == pytest.approx(ours.patch.curvatures.k1, rel=1e-6)
    rows = {row["method"]: row for row in measure_cell("ball", 0.0, "normal", 1, 0, ["ours_again"])}
    assert rows["ours_again"]["mean_error"] == rows["map"]["mean_error"]


@pytest.mark.usefixtures("package")
def test_an_object_has_a_name():
    assert "tetrahedron" in object_names()
    obj = make_object("tetrahedron")
    assert obj.source == "tetrahedron" and obj.diagonal == pytest.approx(20.0 * np.sqrt(3.0))


@pytest.mark.usefixtures("package")
def test_a_probe_has_a_name():
    obj = make_object("sphere")
    options = RunOptions(0.1, 1.0, probe=ProbeOptions("deaf"))
    atlas, planner = begin(options, obj, np.random.default_rng(0))
    touch = probe_of(options, obj, np.random.default_rng(0))(planner.ask(atlas))
    assert np.linalg.norm(touch.contact) == pytest.approx(33.0, rel=1e-9)  # no noise


@pytest.mark.usefixtures("package", "no_pictures", "few_judged")
def test_a_run_keeps_all_before_a_touch_that_is_refused_and_goes_on(tmp_path):
    options = RunOptions(0.1, 1.0, max_touches=2, probe=ProbeOptions("unlike"))
    with pytest.raises(ValueError, match="has a tip radius of 1") as end:
        run_exploration(make_object("sphere"), tmp_path / "run", options)
    assert end.value.__notes__ == [f"1 touch is kept, touchatlas resume {tmp_path / 'run'} goes on"]
    assert load_atlas(tmp_path / "run" / "atlas.npz").touches == 1
    sys.modules["added_package"].Unlike.wrong = False
    assert resume_exploration(tmp_path / "run").numbers["touches"] == 2


@pytest.mark.usefixtures("package")
def test_what_is_not_there_is_named():
    with pytest.raises(ValueError, match="it must be one of tolerance, .*, lowest"):
        PlannerOptions("lowes")
    with pytest.raises(ValueError, match="broken of the package added-package cannot be imported"):
        planned("broken", 3)
    with pytest.raises(ValueError, match="did you mean ours_again"):
        fit_file("c.csv", "ours_agai")
