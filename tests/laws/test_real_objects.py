"""Real meshes, touched some times: what holds of any object, with edges, thin parts and detail."""

import igl
import numpy as np
import pytest

from tests.real import real_mesh
from touchatlas.atlas import Atlas, extract_surface
from touchatlas.patch import SamplingPlane
from touchatlas.planner import Planner, ProbePlan, Reason, explore
from touchatlas.sim import Probe

# Two that few touches explore in seconds: a ring, and an animal with thin legs. Others take longer.
QUICK = ("spot", "torus_ode")
OTHERS = (
    *("lemon_ycb", "wingnut_ode", "featuretype", "hand_ode"),
    *("mustard_ycb", "skull_ode", "goathead_ode", "demosthenes_ode"),
)
NOISE, FEW, MANY = 2e-4, 8, 40


def explored(name: str, touches: int):
    """An object, its atlas validated at every fifth touch, and all contact points."""
    obj = real_mesh(name)
    atlas = Atlas(obj.tolerance)
    probe = Probe(obj, NOISE * obj.diagonal, np.random.default_rng(2))
    points = []
    for step in explore(atlas, Planner(*obj.start()), probe, touches):
        points += [contour.points for contour in step.touch.contours]
        if step.plan.number % 5 == 0:
            atlas.validate()
    return obj, atlas, np.concatenate(points)


def distances(obj, points):
    return np.sqrt(igl.point_mesh_squared_distance(points, obj.vertices, obj.faces)[0])


@pytest.mark.parametrize("touches", [FEW, pytest.param(MANY, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS)]
)
def test_an_atlas_of_a_real_mesh_stays_sound_and_lies_on_it(name, touches, request):
    """Contacts are off by their noise alone: by no more than six deviations of 10,000 numbers. Of
    the surface that claims a deviation of half a tolerance nearly all is within three tolerances.
    What was touched little is drawn as well, and says that it is less sure."""
    if (name, touches) == ("featuretype", MANY):
        reason = "0.939: laws are believed over holes and pockets that no contour has crossed yet"
        request.applymarker(pytest.mark.xfail(strict=True, reason=reason))
    obj, atlas, contacts = explored(name, touches)
    assert distances(obj, contacts).max() < 6.0 * NOISE * obj.diagonal
    atlas.finish()
    atlas.validate()
    surface = extract_surface(atlas)
    off = distances(obj, surface.vertices)
    sure = surface.deviation <= 0.5 * obj.tolerance
    assert sure.any() and (off[sure] < 3.0 * obj.tolerance).mean() > 0.95


@pytest.mark.parametrize("seed", [0, 1])
def test_contours_beside_edges_face_outward_though_a_quadric_follows_none(seed):
    """Three contours over the ridge of a wing: the quadric of their near arcs faces 75 degrees away
    from the approach, which each contour faces. One of them was learned inside out, and the
    surface had crumbs all along the wing."""
    nut = real_mesh("wingnut_ode")
    contact, approach = np.array([-0.949, 0.591, 0.724]), np.array([-0.677, 0.545, 0.494])
    across = np.array([[0.579, -0.02, 0.815], [0.683, 0.716, 0.146], [0.104, 0.736, -0.669]])
    across /= np.linalg.norm(across, axis=1)[:, None]
    planes = tuple(SamplingPlane(contact, normal) for normal in across)
    approach /= np.linalg.norm(approach)
    plan = ProbePlan(0, contact, approach, planes, 4.0, 0.0837, np.pi, Reason.START)
    probe = Probe(nut, NOISE * nut.diagonal, np.random.default_rng(seed))
    touch, atlas = probe(plan), Atlas(1e-2 * nut.diagonal)
    for _ in explore(atlas, Planner(*nut.start()), probe, 2):
        pass
    before = len(atlas.pool)
    assert not atlas.add(touch).refused
    points, normals = atlas.pool.points[before:], atlas.pool.normals[before:]
    nearest = igl.point_mesh_squared_distance(points, nut.vertices, nut.faces)[1]
    true = igl.per_face_normals(nut.vertices, nut.faces, np.zeros(3))[nearest]
    assert ((normals * true).sum(axis=1) > 0.0).mean() > 0.97
