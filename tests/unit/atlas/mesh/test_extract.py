"""The surface of an atlas: that of its body, as fine as is asked for."""

from functools import cache

import numpy as np
import pytest

from tests.lawful import NOISE, known_body, samples_of_touches, touched
from touchatlas.atlas import AtlasOptions, extract_surface
from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.one_face import face_of_all
from touchatlas.atlas.mesh.surface import body_surface, shape_edge
from touchatlas.atlas.samples.predictive_law import PredictiveLaw
from touchatlas.atlas.samples.rims import Rims
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.atlas.state import AtlasState
from touchatlas.sim import make_object

TOLERANCE = 0.1
STD = np.sqrt(2.0) * NOISE


class Known(AtlasState):
    """The state of an atlas of which a body is all that is known."""

    body: Body | None = None

    def __init__(self, body: Body | None, facets: float = 0.2) -> None:
        self.body, self.tolerance, self.pool = body, TOLERANCE, SamplePool()
        self.options, self.rims = AtlasOptions(facets=facets), Rims(self.pool)
        self.law = PredictiveLaw()
        self.innovations = np.zeros((0, 6))


def smooth_body(name: str, touches: int, keep=lambda points: np.ones(len(points), bool)):
    """A built-in object, touched at places spread evenly, as one free-form face."""
    obj = make_object(name)
    columns = touched(obj, touches, NOISE, 3, 0.12 * obj.diagonal, 12)
    samples = samples_of_touches(columns, STD, keep(columns[0]))
    return Body(face_of_all(samples), samples)


@pytest.fixture(scope="module")
def torus():
    return smooth_body("torus", 60)


@pytest.fixture(scope="module")
def drawn(torus):
    """The torus drawn with an option of facets, once each."""
    return cache(lambda facets: extract_surface(Known(torus, facets)))


def off(body, surface) -> np.ndarray:
    """Distances of vertices, middles of sides and centres of one triangle in eight from the body,
    in tolerances."""
    a, b, c = surface.vertices[surface.faces[::8]].transpose(1, 0, 2)
    points = [a, (a + b) / 2, (b + c) / 2, (c + a) / 2, (a + b + c) / 3]
    return np.abs(body.field.at(np.concatenate(points)).distance) / TOLERANCE


def test_triangles_are_as_near_to_a_smooth_body_as_the_option_says(torus, drawn):
    """And a quarter of the distance takes three to six times the triangles: edges are halved, so
    that their number goes in steps. Where the field jumps, few are farther."""
    counts = []
    for facets in (0.8, 0.2):
        surface = drawn(facets)
        assert np.quantile(off(torus, surface), 0.99) < facets
        mesh = surface.to_trimesh()
        assert mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 0
        counts.append(len(surface.faces))
    assert 3.0 < counts[1] / counts[0] < 6.0


def test_a_smooth_body_takes_half_the_triangles_of_cubes_that_are_as_near(torus, drawn):
    """On cubes of 1.3 mm 99 of 100 points are within 0.2 tolerances, and are moved out by nothing:
    they are as small everywhere as the strongest bend asks for."""
    surface, cubes = drawn(0.2), body_surface(torus, 1.3)
    assert np.quantile(off(torus, cubes), 0.99) > np.quantile(off(torus, surface), 0.99)
    assert len(surface.faces) < 0.7 * len(cubes.faces)


def test_an_edge_that_is_given_is_that_of_the_cubes(torus):
    """A triangle in a cube has an area of about half of its square."""
    mesh = extract_surface(Known(torus), 3.0).to_trimesh()
    assert mesh.is_watertight and mesh.euler_number == 0
    assert mesh.area / len(mesh.faces) == pytest.approx(0.5 * 3.0**2, rel=0.4)


def test_a_body_whose_faces_obey_laws_is_drawn_as_they_are():
    body = known_body("box", 40)
    found = extract_surface(Known(body))
    drawn = body_surface(body, shape_edge(body))
    for name in ("vertices", "faces", "normals", "patch"):
        assert getattr(found, name).tobytes() == getattr(drawn, name).tobytes()
    assert np.array_equal(found.deviation, PredictiveLaw().deviations(drawn.deviation))


def test_a_half_of_a_body_is_open_and_drawn_where_it_was_touched():
    """Samples above z = 0: no vertex is lower by more than a step and a half and a cube."""
    half = smooth_body("sphere", 50, lambda points: points[:, 2] > 0.0)
    mesh = extract_surface(Known(half)).to_trimesh()
    assert not mesh.is_watertight and mesh.is_winding_consistent
    lowest = -1.5 * half.samples.steps.max() - half.extent / 32
    assert mesh.vertices[:, 2].min() > lowest
