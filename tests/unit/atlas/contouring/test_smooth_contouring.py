"""Smooth contouring: closed manifolds on the surface, with few questions."""

import numpy as np
import pytest
import trimesh

from tests.unit.atlas.contouring.test_dual_contouring import _TURN, known, sphere, torus, turned
from touchatlas.atlas.contouring.dual_contouring import dual_contour
from touchatlas.atlas.contouring.smooth_contouring import smooth_contour


class Counted:
    """A body, with the number of points that it was asked."""

    def __init__(self, body) -> None:
        self._body, self.count = body, 0

    def __call__(self, points):
        self.count += len(points)
        return self._body(points)


@pytest.mark.parametrize("edge", [0.2, 0.1])
@pytest.mark.parametrize(
    ("body", "seed", "euler_number"), [(sphere, [1.0, 0, 0], 2), (torus, [1.4, 0, 0], 0)]
)
def test_smooth_bodies_are_closed_and_their_vertices_exact(body, seed, euler_number, edge):
    """One Newton step is exact for a true distance."""
    mesh = trimesh.Trimesh(*smooth_contour(body, known(body), [seed], edge), process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.euler_number == euler_number
    assert mesh.volume > 0.0
    assert np.abs(body(mesh.vertices)[0]).max() < 1e-9


def test_it_has_the_triangles_of_dual_contouring_and_asks_half_as_often():
    """The same cubes give the same number of vertices and triangles."""
    body, seeds = turned(torus), [1.4 * _TURN[:, 0]]
    counts, meshes = [], []
    for contour in (dual_contour, smooth_contour):
        asked = Counted(body)
        meshes.append(contour(asked, known(asked), seeds, 0.1))
        counts.append(asked.count)
    assert len(meshes[0][0]) == len(meshes[1][0])
    assert len(meshes[0][1]) == len(meshes[1][1])
    assert counts[1] < 0.5 * counts[0]
    assert counts[1] < 5 * len(meshes[1][0])


def test_a_seed_off_the_surface_finds_nothing():
    vertices, faces = smooth_contour(sphere, known(sphere), [[5.0, 0.0, 0.0]], 0.1)
    assert vertices.shape == (0, 3)
    assert faces.shape == (0, 3)
