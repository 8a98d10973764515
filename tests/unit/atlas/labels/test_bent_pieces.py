"""A quadric that two planes explain is two planes; a dome is one piece."""

import numpy as np
import pytest

from touchatlas.atlas.labels.grow import is_edge
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.records.options import Levels

STD = 0.02
# Half of the level above which normals face other sides.
TURN = 0.5 * Levels().same_side


def two_planes(radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals of two sides of 60 x 60 at a right angle, and of the rounding between."""
    rng, inner = np.random.default_rng(0), 60.0 - radius
    across, along = rng.uniform(0.0, inner, 300), rng.uniform(0.0, 60.0, (3, 300))
    angle = rng.uniform(0.0, 0.5 * np.pi, 300)[: int(30 * radius)]
    zero, one = np.zeros(300), np.ones(300)
    top = np.column_stack([across, along[0], 0 * zero + radius])
    side = np.column_stack([inner + radius * one, along[1], -across])
    arc = np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    ball = radius * arc + np.column_stack([inner + 0 * angle, along[2][: len(angle)], 0 * angle])
    points = np.concatenate([top, side, ball])
    normals = np.concatenate([np.tile([0, 0, 1], (300, 1)), np.tile([1, 0, 0], (300, 1)), arc])
    return points + STD * rng.normal(size=points.shape), normals


def dome(height: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals of half an ellipsoid of radius 30."""
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(800, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    ball[:, 2] = np.abs(ball[:, 2])
    axes = np.array([30.0, 30.0, height])
    normals = ball / axes
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return ball * axes + STD * rng.normal(size=ball.shape), normals


@pytest.mark.parametrize("scale", [1.0, 1e-3])
@pytest.mark.parametrize("radius", [0.5, 2.0, 6.0])
def test_a_quadric_of_two_planes_and_their_rounding_is_an_edge(radius, scale):
    """A hyperbolic cylinder: with a rounding of a tenth of the sides half of its samples turn by
    some 0.08 over their length, and it turns by a right angle in all."""
    points, normals = two_planes(radius)
    piece = fit_piece(Kind.QUADRIC, scale * points, normals, scale * STD)
    assert is_edge(piece, scale * points, TURN)


@pytest.mark.parametrize("height", [5.0, 15.0, 30.0])
def test_a_dome_is_no_edge(height):
    points, normals = dome(height)
    piece = fit_piece(Kind.QUADRIC, points, normals, STD)
    assert not is_edge(piece, points, TURN)
