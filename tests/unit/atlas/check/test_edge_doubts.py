"""Edges of which no contour shows whether they are sharp or rounded."""

from types import SimpleNamespace

import numpy as np
import pytest

from touchatlas.atlas.check import edge_doubts as module
from touchatlas.atlas.check.edge_doubts import edge_doubts
from touchatlas.atlas.faces.boundary import EdgeKind
from touchatlas.atlas.faces.faces import FaceEdge

RADIUS = 5.0
# A rounding of a right angle is so far from its sharp edge.
OFF = RADIUS * (np.sqrt(2.0) - 1.0)
CURVE = np.column_stack([np.linspace(0.0, 20.0, 21), np.zeros((21, 2))])


def edge(number: int, radius: float) -> FaceEdge:
    """An edge of a right angle along x, some way from the others."""
    curve = CURVE + [0.0, 50.0 * number, 0.0]
    return FaceEdge(0, number, EdgeKind.SHARP_CONVEX, (curve,), 20.0, 0.01, np.pi / 2, 0.0, radius)


def doubted(monkeypatch, radii, nearest: float, tolerance: float = 0.1):
    """The doubts about a body with edges of such radii, each a distance from the nearest sample."""
    edges = tuple(edge(k, radius) for k, radius in enumerate(radii))
    samples = np.concatenate([e.curves[0] + [0.0, 0.0, nearest] for e in edges])
    body = SimpleNamespace(faces=SimpleNamespace(edges=edges))
    monkeypatch.setattr(module, "with_uncrossed_edges", lambda body: body.faces)
    pool = SimpleNamespace(points=samples)
    return edge_doubts(SimpleNamespace(body=body, pool=pool, tolerance=tolerance))


def test_a_sharp_edge_among_rounded_ones_that_no_contour_crossed_is_told_with_its_place(
    monkeypatch,
):
    [doubt] = doubted(monkeypatch, [RADIUS, RADIUS, 0.0], 1.01 * OFF)
    assert doubt.name == "guessed edges"
    assert "1 edge is drawn sharp" in doubt.words and "by 5 in the median" in doubt.words
    assert doubt.places.tolist() == [[10.0, 100.0, 0.0]]


@pytest.mark.parametrize(
    ("radii", "nearest", "tolerance"),
    [
        ([RADIUS, RADIUS, 0.0], 0.99 * OFF, 0.1),
        ([RADIUS, 0.0, 0.0], 1.01 * OFF, 0.1),
        ([RADIUS, RADIUS, RADIUS], 1.01 * OFF, 0.1),
        ([RADIUS, RADIUS, 0.0], 1.01 * OFF, 1.01 * OFF),
    ],
    ids=["crossed", "most are sharp", "all are rounded", "within the tolerance"],
)
def test_other_sharp_edges_are_no_doubt(monkeypatch, radii, nearest, tolerance):
    assert doubted(monkeypatch, radii, nearest, tolerance) == []
