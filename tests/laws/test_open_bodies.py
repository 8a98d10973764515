"""Bodies with open rims: the surface ends there, and the planner does not touch beyond."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
import trimesh

from tests.flat import flat_touch
from touchatlas.atlas import Atlas, Surface, Touch, extract_surface
from touchatlas.patch import ContourEnd
from touchatlas.planner import Planner, ProbePlan, StopReason, explore
from touchatlas.sim import make_object
from touchatlas.sim.folder.run_options import fit_scale
from touchatlas.sim.study.bodies import cup
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.probe import Probe

TOLERANCE, NOISE, RADIUS = 0.1, 0.02, 33.0


@lru_cache
def bowl() -> tuple[Atlas, Surface, int]:
    """The upper half of a ball, explored; its surface, and the touches without contact."""
    body = cup(0.5)
    atlas = Atlas(TOLERANCE, scale=fit_scale(NOISE, body.diagonal))
    planner = Planner(*body.start())
    touches = explore(atlas, planner, Probe(body, NOISE, np.random.default_rng(5)), 60)
    missed = sum(not step.touch.contours for step in touches)
    assert planner.stop is not None and planner.stop.reason is StopReason.KNOWN
    atlas.finish()
    return atlas, extract_surface(atlas), missed


def test_the_surface_of_a_bowl_ends_at_its_rim():
    """Ends lie within an eighth of a step, 0.17, of the rim; three noises come to it. Single
    triangles across the rim, with edges of 1.5, may be missing."""
    _, surface, _ = bowl()
    mesh = surface.to_trimesh()
    assert mesh.euler_number == 1 and mesh.body_count == 1
    assert surface.vertices[:, 2].min() > -0.17 - 3.0 * NOISE
    rim = surface.vertices[np.unique(mesh.edges[trimesh.grouping.group_rows(mesh.edges_sorted, 1)])]
    assert np.quantile(np.abs(rim[:, 2]), 0.95) < 3.0 * TOLERANCE
    assert np.abs(rim[:, 2]).max() < 15.0 * TOLERANCE
    assert np.abs(np.linalg.norm(surface.vertices, axis=1) - RADIUS).max() < 3.0 * TOLERANCE


@pytest.mark.parametrize("missing", [0.1, pytest.param(0.03, marks=pytest.mark.slow)])
def test_an_opening_that_samples_surround_stays_open(missing):
    """Openings of radii of 20 and 11 mm are narrower than what a law is believed across, 27. Ends
    lie within an eighth of a step of the rim."""
    body = cup(missing)
    atlas, planner = Atlas(TOLERANCE, scale=fit_scale(NOISE, body.diagonal)), Planner(*body.start())
    for _ in explore(atlas, planner, Probe(body, NOISE, np.random.default_rng(0)), 40):
        pass
    assert planner.stop is not None and planner.stop.reason is StopReason.KNOWN
    surface = extract_surface(atlas)
    mesh = surface.to_trimesh()
    assert mesh.euler_number == 1 and mesh.body_count == 1
    rim = RADIUS * (2.0 * missing - 1.0)
    assert rim - 3.0 * TOLERANCE < surface.vertices[:, 2].min() < rim + 3.0 * TOLERANCE


def test_few_touches_go_beyond_the_rim():
    """Before any contour has met the rim a place beyond it may be touched in vain, and once more
    from the side; afterwards none is, but where the rim itself is looked for."""
    assert bowl()[2] <= 6


def test_nothing_is_known_beyond_the_rim():
    atlas, *_ = bowl()
    angles = np.linspace(0.0, 2.0 * np.pi, 40)
    for height, known in ((1.5, True), (-1.5, False)):
        flat = np.sqrt(RADIUS**2 - height**2)
        points = np.stack([flat * np.cos(angles), flat * np.sin(angles), 0 * angles + height], 1)
        found = atlas.blend(points)
        assert (found.known == known).all() and (np.isfinite(found.distance) == known).all()


def test_a_slip_that_was_passed_leaves_the_surface_as_without_it():
    """The first contour of the first touch lost contact at (1, 0, 0), and the second touch went on
    from there: no end shows a rim."""

    def drawn(end: ContourEnd) -> Surface:
        atlas, rng = Atlas(0.01), np.random.default_rng(0)
        for number, x in enumerate((0.0, 1.05)):
            touch = flat_touch([x, 0, 0], *np.eye(3)[[2, 0]], 2e-3, rng, number)
            first = replace(touch.contours[0], ends=(ContourEnd.LENGTH_REACHED, end))
            slipped = replace(touch, contours=(first, *touch.contours[1:]))
            atlas.add(touch if number else slipped)
        return extract_surface(atlas)

    slipped, whole = drawn(ContourEnd.LOST_CONTACT), drawn(ContourEnd.LENGTH_REACHED)
    assert len(whole.faces) and np.array_equal(slipped.vertices, whole.vertices)
    assert np.array_equal(slipped.faces, whole.faces)


@pytest.mark.parametrize("slips", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_a_slip_does_not_hide_a_closed_body(slips):
    """The second touch of a ball loses contact after 2 mm in one or all of its contours. The probe
    touches beyond the ends then, and the whole ball is known."""
    ball = make_object("sphere")
    probe = Probe(ball, NOISE, np.random.default_rng(1))

    def slipping(plan: ProbePlan) -> Touch:
        if plan.number != 1:
            return probe(plan)
        touch = probe(replace(plan, reach=2.0, step=0.25))
        lost = (ContourEnd.LOST_CONTACT, ContourEnd.LOST_CONTACT)
        ended = tuple(replace(c, ends=lost) for c in touch.contours[:slips])
        return replace(touch, contours=(*ended, *touch.contours[slips:]))

    atlas = Atlas(TOLERANCE, scale=fit_scale(NOISE, ball.diagonal))
    planner = Planner(*ball.start())
    for _ in explore(atlas, planner, slipping, 40):
        pass
    assert planner.stop is not None and planner.stop.reason is StopReason.KNOWN
    atlas.finish()
    surface = extract_surface(atlas)
    mesh = surface.to_trimesh()
    assert mesh.is_watertight and mesh.euler_number == 2
    # Triangles with sides of a thirtieth of the radius have 1e-3 less than the ball.
    assert mesh.area == pytest.approx(4.0 * np.pi * RADIUS**2, rel=2e-3)
    assert not len(atlas.rims)


def test_a_rim_says_nothing_of_surface_far_past_its_ends():
    """Four openings of 25 degrees, each of a share sin(12.5)^2 = 0.047 of the ball. Ends lie within
    a step of rims: circles of 13.9 mm about openings, 0.9 wide, are 0.036 of the ball. A rim
    drawn on without end parts a third of it off."""
    axes = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]]) / np.sqrt(3.0)
    ball = trimesh.creation.icosphere(subdivisions=5, radius=RADIUS)
    ball.update_faces(~(ball.triangles_center @ axes.T > RADIUS * np.cos(np.deg2rad(25.0))).any(1))
    body = MeshObject("ball with four openings", ball.vertices, ball.faces)
    atlas, planner = Atlas(TOLERANCE, scale=fit_scale(NOISE, body.diagonal)), Planner(*body.start())
    for _ in explore(atlas, planner, Probe(body, NOISE, np.random.default_rng(0)), 20):
        pass
    points, normals = body.sample(2000, np.random.default_rng(0))
    assert atlas.body is not None
    assert atlas.body.beyond(points, normals).mean() < 0.06
