"""A region of interest: touches are made there, and what lies outside costs nothing."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, PlannerOptions, explore
from touchatlas.planner.region import region_doubts, region_of
from touchatlas.sim import Probe, make_object


def explored(options, name="ellipsoid", most=25):
    """Touches of an ellipsoid of half axes 80, 50, 30, or another body, from its top."""
    obj = make_object(name)
    atlas, planner = Atlas(0.3, scale=0.3), Planner(*obj.start(), options)
    steps = list(explore(atlas, planner, Probe(obj, 0.06, np.random.default_rng(0)), most))
    return atlas, planner, steps


def test_distances_from_box_ball_and_mesh_are_those_of_formulas(tmp_path):
    points = np.random.default_rng(0).uniform(-3.0, 3.0, (200, 3))
    trimesh.creation.box((2.0, 2.0, 2.0)).export(tmp_path / "cube.stl")
    off = np.linalg.norm(np.maximum(np.abs(points) - 1.0, 0.0), axis=1)
    # Single precision of an STL file, of coordinates of 1.
    for text in ("box:-1,-1,-1,1,1,1", "box:1,1,1,-1,-1,-1", str(tmp_path / "cube.stl")):
        assert np.allclose(region_of(text).distance(points), off, atol=1e-6)
    ball = np.maximum(np.linalg.norm(points - [1.0, 0.0, 0.0], axis=1) - 2.0, 0.0)
    assert np.allclose(region_of("ball:1,0,0,2").distance(points), ball, atol=1e-12)


def test_a_mesh_file_that_was_written_again_is_read_again(tmp_path):
    path = tmp_path / "part.stl"
    for side in (2.0, 4.0):
        trimesh.creation.box((side, side, side)).export(path)
        assert region_of(str(path)).distance([[5.0, 0.0, 0.0]]) == pytest.approx(5.0 - 0.5 * side)


def test_a_step_file_is_no_region_because_its_unit_would_be_lost(tmp_path):
    path = tmp_path / "part.STEP"
    path.write_text("ISO-10303-21;")
    with pytest.raises(ValueError, match=r"region is '.*part\.STEP', a STEP file; give a mesh"):
        region_of(str(path))


def test_half_a_body_takes_less_length_and_ends_as_known():
    """With 17 samples on each arm instead of 43, which takes less time."""
    few, half = PlannerOptions(step=0.035), "box:0,-99,-99,99,99,99"
    _, _, whole = explored(few, "blob")
    _, planner, steps = explored(replace(few, region=half), "blob")
    assert planner.stop.reason.value == "known to the tolerance"
    lengths = [sum(step.touch.tracked_length for step in some) for some in (whole, steps)]
    assert lengths[1] < 0.8 * lengths[0]
    # All but the first were planned within it.
    assert all(step.plan.reference_point[0] >= 0.0 for step in steps[1:])


def test_touches_approach_a_region_that_the_start_is_not_in():
    atlas, planner, steps = explored(PlannerOptions(region="ball:80,0,0,20"))
    assert planner.stop.reason.value == "known to the tolerance"
    away = [np.linalg.norm(step.touch.contact - [80.0, 0.0, 0.0]) for step in steps]
    assert away == sorted(away, reverse=True)
    found, known = atlas.body.at(np.array([[80.0, 0.0, 0.0]]))
    assert known[0] and abs(found.distance[0]) < atlas.tolerance


def test_a_looser_tolerance_elsewhere_still_finds_the_whole():
    region = "box:0,-99,-99,99,99,99"
    atlas, planner, _ = explored(PlannerOptions(region=region, elsewhere=3.0))
    assert planner.stop.reason.value == "known to the tolerance"
    assert np.ptp(atlas.pool.points[:, 0]) > 150.0


@pytest.mark.parametrize(
    "options",
    [{"region": "box:1,2"}, {"region": "ball:0,0,0,-1"}, {"region": "no.stl"}, {"elsewhere": 1.0}],
)
def test_what_is_no_region_is_refused(options):
    with pytest.raises(ValueError, match="region"):
        PlannerOptions(**options)


def test_a_region_in_which_nothing_was_met_is_doubted():
    points = np.array([[5.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    (found,) = region_doubts("ball:0,0,0,2", points)
    assert found.name == "empty region" and "ball:0,0,0,2" in found.words
    assert region_doubts("ball:0,0,0,4", points) == [] == region_doubts("", points)
    assert len(region_doubts("box:0,0,0,1,1,1", points[:0])) == 1
