"""A run folder as an object, plots for notebooks, and the package's own names."""

import json

import numpy as np
import pytest

import touchatlas as ta
from tests.explored import explore_body
from touchatlas.planner import Planner, PlannerOptions
from touchatlas.sim import Probe
from touchatlas.sim.look.words import Outlook


def test_a_run_is_read_from_its_folder(whole_run):
    folder, printed = whole_run
    run, numbers = ta.load_run(folder), json.loads(printed)
    assert run.numbers == numbers and run.settings["tolerance"] == numbers["tolerance"]
    assert len(run.touches) == len(run.steps["touch"]) == numbers["touches"]
    assert run.steps["tracked_length"][-1] == numbers["tracked_length"]
    assert len(run.atlas) == numbers["patches"]
    drawn = ta.extract_surface(run.atlas)
    assert run.surface is not None and len(run.surface.faces) == len(drawn.faces)
    # Single precision.
    np.testing.assert_allclose(run.surface.vertices, drawn.vertices, rtol=1e-6, atol=1e-4)
    line, page = repr(run), run._repr_html_()
    assert f"{numbers['touches']} touches" in line and "\n" not in line
    assert "accuracy_p95" in page and "The tolerance" in page


@pytest.mark.parametrize("damage", [lambda data: data[:-5], lambda _: b"solid"])
def test_a_damaged_surface_is_refused_in_a_sentence(whole_run, damage):
    path = whole_run[0] / "surface.ply"
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(ValueError, match=r"surface.ply is (cut off|no surface.ply)"):
        _ = ta.load_run(whole_run[0]).surface


def names_of(plot) -> set[str]:
    """The names of what a plot shows."""
    return {thing.name for thing in plot.objects}


def test_everything_can_be_looked_at(whole_run):
    run = ta.load_run(whole_run[0])
    assert names_of(run.plot()) >= {"surface, deviation", "contours", "contacts"}
    assert names_of(run.surface.plot("face")) == {"surface, face"}
    assert names_of(run.atlas.plot()) == {"surface, deviation", "samples"}
    with pytest.raises(ValueError, match="give 'deviation' or 'face'"):
        run.surface.plot("colour")


def test_a_planner_shows_what_it_knows_and_wants():
    obj = ta.make_object("sphere")
    planner, atlas = Planner(*obj.start()), ta.Atlas(obj.tolerance)
    assert names_of(planner.plot(atlas)) == set()
    assert planner.ask(atlas) is not None and "next: start at (" in repr(planner)
    assert names_of(planner.plot(atlas)) == {"planes of the next plans"}
    found = explore_body(obj, 2)
    assert "0 touches" in repr(ta.Atlas(1.0)) and "2 touches" in repr(found.atlas)
    assert found.atlas._repr_html_().count("<tr>") == 1 + len(found.atlas.body.faces)


def test_records_say_in_one_line_what_they_hold():
    obj, atlas = ta.make_object("sphere"), ta.Atlas(0.1)
    plan = ta.Planner([0, 0, 40], [0, 0, 1]).ask(atlas)
    touch = Probe(obj, 0.0, np.random.default_rng(0))(plan)
    atlas.add(touch)
    surface = ta.extract_surface(atlas)
    records = touch, touch.contours[0], plan, atlas.blend(np.zeros((2, 3))), surface
    lines = [repr(record) for record in records]
    assert all("\n" not in line and len(line) < 100 for line in lines)
    assert lines[0].startswith("<Touch 0: touched at (") and "start at (0, 0, 40)" in lines[2]
    points = sum(len(contour.points) for contour in touch.contours)
    assert f"{points} points>" in lines[0] and f"{len(touch.contours[0].points)} points" in lines[1]
    assert "2 points" in lines[3] and "95 %" in surface._repr_html_()


def test_a_run_is_explored_from_a_script(tmp_path, few_judged, no_pictures, capsys):
    said: list[tuple[int, float]] = []
    options = ta.RunOptions(max_touches=3, tolerance=0.6, noise=0.12)
    run = ta.explore("sphere", tmp_path / "r", options, progress=lambda *now: said.append(now))
    assert [count for count, _ in said] == [1, 2, 3] and len(run.touches) == 3
    assert capsys.readouterr().out == ""


def test_touches_to_come_follow_from_what_the_last_ones_gained():
    outlook = Outlook([0.1, 0.2, 0.3], [2.0] * 3)
    wanted = PlannerOptions().coverage
    count, seconds = outlook.left()
    assert count == int(np.ceil((wanted - 0.3) / 0.1)) and seconds == 2.0 * count
    assert Outlook([0.3, 0.2, 0.1], [1.0] * 3).left() is None


def test_why_less_is_known_is_said():
    outlook = Outlook([0.7], [1.0], _faces=(1, 3), _extent=(5.0, 5.0))
    assert "3 faces after 1" in outlook.less_because(0.3)
    outlook = Outlook([0.7], [1.0], _faces=(1, 1), _extent=(5.0, 6.0))
    assert "more of the surface" in outlook.less_because(0.3)
    assert outlook.less_because(0.7) == ""


def test_the_package_says_its_version():
    assert ta.__version__.count(".") == 2
    with pytest.raises(AttributeError, match="the public names are"):
        _ = ta.nothing
