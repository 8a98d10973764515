"""Contours that are sampled more finely where they bend."""

import numpy as np
import pytest
import trimesh

from touchatlas.sim import make_object
from touchatlas.sim.world.finer_steps import finer_steps, last_steps
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.mesh_sections import PlaneSections


def circle(at):
    """Eight steps go once about the circle of radius 1."""
    angles = np.pi / 4.0 * np.asarray(at, float)
    return np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)


def turns(points):
    chords = np.diff(points, axis=0)
    chords /= np.linalg.norm(chords, axis=1)[:, None]
    return np.arccos(np.clip((chords[:-1] * chords[1:]).sum(axis=1), -1.0, 1.0))


@pytest.mark.parametrize(("turn", "count"), [(1.0, 9), (0.5, 17), (0.2, 33), (0.1, 65)])
def test_a_circle_is_halved_until_it_turns_by_little(turn, count):
    """An octagon turns by 0.785 rad, halved once by 0.393, twice by 0.196, three times by 0.098."""
    at = finer_steps(circle(np.arange(9)), turn, circle)
    assert at.tolist() == np.linspace(0.0, 8.0, count).tolist()
    assert turns(circle(at)).max() <= turn


def test_steps_are_halved_three_times_at_most_and_beside_the_bend_alone():
    """A right angle half-way of eight steps turns however fine the steps are."""

    def corner(at):
        at = np.asarray(at, float)
        return np.stack([np.minimum(at, 4.0), np.maximum(at - 4.0, 0.0), 0.0 * at], axis=1)

    at = finer_steps(corner(np.arange(9)), 0.2, corner)
    # Each time the two steps beside the corner are halved.
    assert at.tolist() == [0, 1, 2, 3, 3.5, 3.75, 3.875, 4, 4.125, 4.25, 4.5, 5, 6, 7, 8]


def test_a_straight_or_short_arm_stays_as_it_is():
    line = np.outer(np.arange(5.0), [1.0, 2.0, 0.0])
    for count in (1, 2, 5):
        assert finer_steps(line[:count], 0.1, circle).tolist() == list(range(count))


def arms_of(obj, step_turn):
    """Arms across the top of a body, in the plane through its start with the normal y, to both
    sides."""
    start = obj.contact(obj.start()[0] + [0.5, 0.5, 9.0], np.array([0.0, 0.0, -1.0]), 30.0)
    planes, ways = np.array([[0.0, 1.0, 0.0]] * 2), np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    return start, obj.trace_arms(start, planes, ways, 35.0, 5.0, 2.0, step_turn)


def cylinder():
    """A lying cylinder of radius 10, as a mesh of 720 sides."""
    mesh = trimesh.creation.cylinder(10.0, 60.0, 720)
    vertices = mesh.vertices @ np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
    return MeshObject("cylinder", vertices, np.asarray(mesh.faces))


@pytest.mark.parametrize("obj", [make_object("torus"), cylinder()], ids=["formula", "mesh"])
def test_arms_keep_their_ends_and_their_samples_and_get_others_between(obj):
    start, coarse = arms_of(obj, np.pi)
    _, fine = arms_of(obj, 0.2)
    for (before, end), (after, same) in zip(coarse, fine, strict=True):
        assert end is same and len(after) > len(before)
        away = np.linalg.norm(after[:, None] - before, axis=2)
        # Arc lengths are added up in another order.
        assert away.min(axis=0).max() < 1e-9 * 50.0
        assert (away.argmin(axis=0)[1:] > away.argmin(axis=0)[:-1]).all()
        # Facets of half a degree turn by as much more, and uneven chords by a third.
        assert turns(np.vstack([start, after])).max() < 0.2 * 4.0 / 3.0 + 2.0 * np.pi / 720.0
        assert np.abs((after - start)[:, 1]).max() < 1e-9 * 50.0


def test_points_between_are_on_the_body():
    obj = make_object("torus")
    for points, _ in arms_of(obj, 0.1)[1]:
        assert np.linalg.norm(points - obj.project(points), axis=1).max() < 1e-9 * 50.0


@pytest.mark.parametrize("length", [0.05, 0.3, 1.0, 5.8, 7.99])
def test_the_last_sample_lies_within_an_eighth_of_a_step_of_where_contact_is_lost(length):
    """Each halving takes one binary digit of the rest."""
    at = last_steps(length)
    last = at[-1] if len(at) else np.floor(length)
    assert 0.0 <= length - last < 0.125
    assert len(at) == bin(int(8.0 * (length % 1.0))).count("1")


@pytest.mark.parametrize("step", [0.1, 0.3, 0.7])
def test_a_plate_of_whole_steps_but_for_rounding_is_tracked_forward(step):
    """The plate is shorter than whole steps by a unit of the last digit: its last step counts, and
    none of the finer ones, which lie before it."""
    for count in range(1, 20):
        side = np.nextafter(step * count, 0.0)
        corners = np.array(
            [[-1.0, -1.0, 0.0], [side, -1.0, 0.0], [side, 1.0, 0.0], [-1.0, 1.0, 0.0]]
        )
        sections = PlaneSections(corners, np.array([[0, 1, 2], [0, 2, 3]]))
        start, across, along = np.array([0.0, 0.3, 0.0]), np.eye(3)[1], np.eye(3)[0]
        points, _ = sections.arm(start, across, along, 20.0, step, np.pi, np.pi)
        assert len(points) == count and (np.diff(points[:, 0]) > 0.0).all()
