"""Edges of which no contour shows whether they are sharp or rounded."""

from types import SimpleNamespace

import numpy as np
import pytest

from touchatlas.atlas.body import uncrossed_edges as module
from touchatlas.atlas.body.uncrossed_edges import guessed_edges
from touchatlas.atlas.check.sample_doubts import edge_doubts
from touchatlas.atlas.edges.boundary import EdgeKind
from touchatlas.atlas.faces.faces import FaceEdge

RADIUS = 5.0
# A rounding of a right angle is so far from its sharp edge.
OFF = RADIUS * (np.sqrt(2.0) - 1.0)
CURVE = np.column_stack([np.linspace(0.0, 20.0, 21), np.zeros((21, 2))])


class Trees:
    """Face 0 looks along z, all others along y."""

    def of(self, face):
        normal = [0.0, 1.0, 0.0] if face else [0.0, 0.0, 1.0]
        return SimpleNamespace(values=lambda at: np.tile([0.0, *normal, 0.0], (len(at), 1)))


def edge(number: int, radius: float) -> FaceEdge:
    """An edge of a right angle along x, some way from the others."""
    curve = CURVE + [0.0, 50.0 * number, 0.0]
    return FaceEdge(0, number, EdgeKind.SHARP_CONVEX, (curve,), 20.0, 0.01, np.pi / 2, 0.0, radius)


@pytest.fixture
def body_of(monkeypatch):
    """Bodies with edges of some radii, each a distance from the nearest sample."""
    monkeypatch.setattr(module, "with_uncrossed_edges", lambda body: body.faces)

    def make(radii, nearest: float):
        edges = tuple(edge(k, radius) for k, radius in enumerate(radii, 1))
        points = np.concatenate([e.curves[0] + [0.0, 0.0, nearest] for e in edges])
        return SimpleNamespace(
            faces=SimpleNamespace(edges=edges),
            samples=SimpleNamespace(points=points),
            field=SimpleNamespace(trees=Trees()),
        )

    return make


def test_a_sharp_edge_among_rounded_ones_that_no_contour_crossed_is_a_guess(body_of):
    found = guessed_edges(body_of([RADIUS, RADIUS, 0.0], 1.01 * OFF), 0.1)
    assert found.points.tolist() == [[10.0, 150.0, 0.0]] and found.radius == RADIUS
    assert found.normals == pytest.approx(np.array([[0.0, 1.0, 1.0]]) / np.sqrt(2.0))


@pytest.mark.parametrize(
    ("radii", "nearest", "tolerance"),
    [
        ([RADIUS, RADIUS, 0.0], 0.99 * OFF, 0.1),
        ([RADIUS, 0.0, 0.0], 1.01 * OFF, 0.1),
        ([RADIUS, RADIUS, RADIUS], 1.01 * OFF, 0.1),
        ([RADIUS, RADIUS, 0.0], 1.01 * OFF, 1.01 * OFF),
        ([], 1.0, 0.1),
    ],
    ids=["crossed", "most are sharp", "all are rounded", "within the tolerance", "no edges"],
)
def test_other_sharp_edges_are_no_guess(body_of, radii, nearest, tolerance):
    some = body_of(radii or [0.0], nearest)
    if not radii:
        some.faces.edges = ()
    found = guessed_edges(some, tolerance)
    assert found.points.shape == found.normals.shape == (0, 3)


def test_a_doubt_tells_of_guessed_edges_with_their_places(body_of):
    body = body_of([RADIUS, RADIUS, 0.0], 1.01 * OFF)
    pool = SimpleNamespace(points=body.samples.points)
    [doubt] = edge_doubts(SimpleNamespace(body=body, pool=pool, tolerance=0.1))
    assert doubt.name == "guessed edges"
    assert "1 edge is drawn sharp" in doubt.words and "by 5 in the median" in doubt.words
    assert doubt.places.tolist() == [[10.0, 150.0, 0.0]]
    assert edge_doubts(SimpleNamespace(body=None, pool=pool, tolerance=0.1)) == []
    body.faces.edges = body.faces.edges[:2]
    assert edge_doubts(SimpleNamespace(body=body, pool=pool, tolerance=0.1)) == []
