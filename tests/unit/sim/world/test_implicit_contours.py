"""Contours of implicit functions over edges."""

import numpy as np

from touchatlas.sim.world.implicit_fields import polyhedron, union
from touchatlas.sim.world.implicit_object import ImplicitObject

SIDES = np.concatenate([np.eye(3), -np.eye(3)])
STEP = 0.9975699334487933


def stepped_block() -> ImplicitObject:
    """Two boxes beside each other: from -30 to 0 along x up to z = 15, from there to 30 up to 0."""
    low = polyhedron(SIDES, [30, 20, 0, 30, 20, 20])
    high = polyhedron(SIDES, [0, 20, 15, 30, 20, 20])
    return ImplicitObject("step", "", union(low, high), (30, 20, 20), 0.02, 0.1)


def test_a_contour_beside_a_face_parallel_to_its_plane_stays_on_the_body():
    """A quarter above the lower top, in a plane that leans by 4e-4: about the edge at x = 0 the
    plane meets that top 180 away, and Newton's method ended there."""
    contact = np.array([-15.976308796622032, -20.0, 0.23054678719345365])
    plane = np.array([0.00038381725184357253, -0.00013323402930542067, 0.9999999174665021])
    along = np.array([0.9999998604093162, -0.00036308201010012823, -0.000383865604827205])
    block = stepped_block()
    [(points, _)] = block.trace_arms(
        contact, [plane], np.array([along]), 43.0, STEP, 2.0 * np.pi / 3.0, np.pi / 12.0
    )
    assert np.abs(block.value(points)).max() < 1e-9
    assert np.abs(points).max() < 30.0 + 1e-9
    chords = np.linalg.norm(np.diff(points, axis=0, prepend=contact[None]), axis=1)
    assert chords.max() < 1.01 * STEP


def test_a_contour_passes_an_edge_beside_a_face_that_is_parallel_to_its_plane():
    """A plane half a step below the higher top: a step that the edge turns up to that top lands
    where the face has no curve in the plane. It was NaN."""
    contact, plane = np.array([0.0, -19.4, 14.55]), np.array([0.0, 0.0, 1.0])
    block = stepped_block()
    [(points, _)] = block.trace_arms(
        contact, [plane], np.array([[0.0, -1.0, 0.0]]), 20.0, 2.0, 2.0 * np.pi / 3.0, np.pi / 12.0
    )
    assert len(points) >= 10 and np.abs(block.value(points)).max() < 1e-9
    assert np.abs(points[:, 2] - 14.55).max() < 1e-9
